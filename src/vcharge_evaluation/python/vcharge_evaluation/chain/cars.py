"""The whole chain from unknown calibration on several cars, and what each stage adds to the errors of the next: the same
stages once more with the true rig, and height maps with true poses."""
import argparse

from vcharge_evaluation.chain import report, steps
from vcharge_evaluation.chain.arguments import argument_parser
from vcharge_evaluation.results import Figure, Results, add_arguments, figure

# Title and step of each variant of the stages after calibration.
VARIANTS = (("estimated rig", ""), ("true rig", "_true_rig"))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "chain_evaluation")
    parser.add_argument("--cars", nargs="*", help="SCENE:SEED:RIG_SEED of each",
                        default=["lot:1:1", "lot:2:2", "lot:3:3", "garage:1:4", "garage:2:5", "garage:3:6"])
    parser.add_argument("--full", action="store_true", help="images of 1280x800 and longer drives")
    parser.add_argument("--no-truth", action="store_true", help="leave out the variants with the true rig")
    return parser.parse_args()


def run_chain(args, car):
    """Figures of all steps on a car."""
    scene, seed, rig_seed = car.split(":")
    words = ["--work", str(args.work / car.replace(":", "_")), "--scene", scene, "--seed", seed, "--rig-seed", rig_seed]
    chain = steps.Chain(argument_parser(steps.__doc__).parse_args([*words, *([] if args.full else ["--quick"])]))
    mapping, other, *_ = chain.stages()
    if not args.no_truth:
        chain.stages_from_truth(mapping, other)
    report.write(chain.work / "report.html", chain)
    return {name: step["figures"] for name, step in chain.steps.items()}


def scaled(figures, step, key, factor=1.0):
    value = figures.get(step, {}).get(key)
    return None if value is None else factor * value


def pose_figures(figures, step, title):
    found = figures.get(step, {})
    yield figure(f"pose in the map, {title}: median", scaled(figures, step, "median_m", 100), "cm", at_most=5)
    yield figure(f"pose in the map, {title}: median of the angle", scaled(figures, step, "median_deg"), "degrees", at_most=0.1)
    yield Figure(f"pose in the map, {title}: 95 %", scaled(figures, step, "p95_m", 100), "cm")
    yield Figure(f"frames localized, {title}, of {found.get('frames')}", found.get("localized"))
    yield figure(f"wrong poses reported as localized, {title}", found.get("wrong"), equal=0)
    yield Figure(f"normalized error squared per degree of freedom, {title}", found.get("normalized"))


def height_figures(figures, step, title):
    yield figure(f"height map, {title}: mean", scaled(figures, step, "mean_m", 100), "cm", at_most=5)
    yield Figure(f"tape measures, {title}: mean error", scaled(figures, step, "tape_m", 100), "cm")
    yield Figure(f"tape measures shown, {title}, of {figures.get(step, {}).get('all_tapes')}",
                 figures.get(step, {}).get("tapes"))


def obstacle_figures(figures, step, title):
    found = figures.get(step, {})
    yield figure(f"obstacles within 5 m, {title}: mean", scaled(figures, step, "mean_m", 100), "cm", at_most=7)
    yield Figure(f"obstacles within 5 m, {title}: 95 %", scaled(figures, step, "p95_m", 100), "cm")
    yield Figure(f"obstacles missed, {title}", found.get("missed"))
    yield Figure(f"false cells per 10 m, {title}", found.get("false_per_10_m"))
    yield Figure(f"cells inside obstacles that were free, {title}", found.get("free_inside"))


def car_figures(figures):
    """All figures of a car; those of variants that were not run are left out."""
    lenses = [camera["error_px"] for camera in figures["intrinsics"].values()]
    yield Figure("intrinsics: largest rms error of a camera", max(lenses), "px")
    yield Figure("extrinsics: largest error", 100 * max(figures["extrinsics"]["error_m"].values()), "cm")
    yield Figure("extrinsics: largest rotation error", max(figures["extrinsics"]["error_deg"].values()), "degrees")
    for title, suffix in VARIANTS:
        if f"map{suffix}" not in figures:
            continue
        yield Figure(f"sparse map, {title}: rms", scaled(figures, f"map{suffix}", "position_rms_m", 100), "cm")
        yield Figure(f"sparse map, {title}: scale error", scaled(figures, f"map{suffix}", "scale_error", 100), "%")
        yield from pose_figures(figures, f"localization{suffix}", title)
        yield from height_figures(figures, f"height_map{suffix}", title)
        yield from obstacle_figures(figures, f"obstacles{suffix}", title)
    if "height_map_truth" in figures:
        yield from height_figures(figures, "height_map_truth", "true rig and poses")


def main():
    args = arguments()
    results = Results("chain", "End to end", args)
    size = "images of 1280x800" if args.full else "half-size images"
    for car in args.cars:
        results.add(f"From unknown calibration, {size} (scene:seed:rig)", (car, car_figures(run_chain(args, car))))
    results.end()


if __name__ == "__main__":
    main()
