"""Range maps: accuracy at fixed density, and whether standard deviation and confidence are honest."""
import argparse

import yaml

from vcharge_evaluation.results import Figure, Results, add_arguments, percent
from vcharge_evaluation.tools import judge, run_tool, say, simulate

DENSITIES = (0.4, 0.6, 0.8)
TRUE_POSES = {"refine_poses": False,
              "pose_noise": {"scale": 0.0, "translation_m": 0.001, "translation_m_per_sqrt_m": 0.0, "rotation_rad": 0.0002,
                             "rotation_rad_per_sqrt_m": 0.0}}
# Name: preset, options of the plane sweep.
SETTINGS = {
    "fast": ("fast", {}),
    "default": ("default", {}),
    "accurate": ("accurate", {}),
    "filled from two levels": ("default", {"num_fill_levels": 2}),
    "all planes": ("default", {"coarse_pass": False}),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "range_evaluation")
    parser.add_argument("--parts", nargs="*", default=["drive"], choices=["drive", "settings"],
                        help="drive: four cameras on 4 s in a lot; settings: two cameras on 1.7 s each in lot and garage")
    parser.add_argument("--drives", nargs="*", default=["lot:5", "garage:6"], help="scene:seed of the settings' drives")
    parser.add_argument("--duration-s", type=float, default=1.7, help="duration of the settings' drives")
    return parser.parse_args()


class RangeErrors:
    """Range maps of a drive and their errors, by camera and over "all cameras"."""

    def __init__(self, folder, name, *words):
        bag, rig, truth = folder / "drive.bag", folder / "rig_truth.yaml", folder / "drive_truth"
        say(f"{folder}: {name}")
        self.run = run_tool("compute_range_maps", folder / f"{name}.log", "--bag", bag, "--rig", rig, "--output",
                            folder / name, "--no-pictures", *words)
        errors = judge("range", folder / f"{name}_report", "--range", folder / name, "--truth", truth, "--bag", bag,
                       "--rig", rig)
        self.sets = {one["label"]: one for one in errors["sets"]}

    def figures(self, label="all cameras"):
        errors = self.sets[label]
        at = {round(entry["density"], 3): entry["fraction_within_tolerance"] for entry in errors["accuracy"]}
        yield Figure("pixels with a range", percent(errors["num_known"], errors["num_judged"]), "%")
        for density in DENSITIES:
            yield Figure(f"within 5 % of the truth, at {100 * density:.0f} % density", 100 * at[density], "%")
        yield Figure("within one standard deviation", 100 * errors["fraction_within_one_sigma"], "%")
        yield Figure("within two standard deviations", 100 * errors["fraction_within_two_sigma"], "%")

    def processor_ms(self):
        return 1000 * self.run.cpu_s / self.sets["all cameras"]["num_frames"]


def evaluate_drive(args, results):
    folder = args.work / "short"
    simulate(folder, ["--scene", "lot", "--drive", "short", "--truth-range"])
    odometry = RangeErrors(folder, "odometry")
    true = RangeErrors(folder, "truth", "--cameras", "front", "left", "--trajectory",
                       folder / "drive_truth" / "trajectory.tum")
    results.add("Range maps of a simulated lot", *((f"{poses}, {label}", errors.figures(label)) for poses, errors in
                                                   (("odometry", odometry), ("true poses, refined", true))
                                                   for label in errors.sets))


def evaluate_settings(args, results):
    drives = []
    for drive in args.drives:
        scene, seed = drive.split(":")
        folder = args.work / f"{scene}_seed{seed}_{args.duration_s:g}s"
        simulate(folder, ["--scene", scene, "--drive", "figure_eight", "--seed", seed, "--duration-s", args.duration_s,
                          "--cameras", "front", "left", "--truth-range"])
        drives += [(f"{scene}, true poses", folder, True), (f"{scene}, odometry", folder, False)]
    for title, folder, true_poses in drives:
        columns = []
        for number, (setting, (preset, overrides)) in enumerate(SETTINGS.items()):
            name = f"setting{number}_{'true' if true_poses else 'odometry'}"
            options = folder / f"{name}.yaml"
            options.write_text(yaml.safe_dump({"plane_sweep": {**overrides, **(TRUE_POSES if true_poses else {})}}))
            poses = ["--trajectory", folder / "drive_truth" / "trajectory.tum"] if true_poses else []
            errors = RangeErrors(folder, name, "--preset", preset, "--options", options, *poses)
            columns.append((setting, [*errors.figures(), Figure("processor time per range map", errors.processor_ms(),
                                                                "ms")]))
            if setting == "default":
                bins = [entry for entry in errors.sets["all cameras"]["by_confidence"] if entry["count"]]
        results.add(f"Settings, {title}", *columns)
        results.add(f"Within 5 % of the truth by confidence, {title}", ("default", [
            Figure(f"confidence {entry['low']:g} to {entry['high']:g}", 100 * entry["fraction_within_tolerance"], "%")
            for entry in bins]))


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("ranges", "Range maps", args)
    if "drive" in args.parts:
        evaluate_drive(args, results)
    if "settings" in args.parts:
        evaluate_settings(args, results)
    results.end()


if __name__ == "__main__":
    main()
