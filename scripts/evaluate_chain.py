#!/usr/bin/env python3
"""The whole chain from unknown calibration on several cars, end to end, and what each stage adds to the errors of the next:
the same stages once more with the true rig, and height maps with true poses; see evaluate_chain.sh."""
import argparse
import pathlib
import sys

import chain
import chain_report
from chain_report import centimetres
from tool_runs import mark


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/chain_evaluation"),
                        help="folder for everything; what an earlier run finished is kept")
    parser.add_argument("--cars", nargs="*", help="SCENE:SEED:RIG_SEED of each",
                        default=["lot:1:1", "lot:2:2", "lot:3:3", "garage:1:4", "garage:2:5", "garage:3:6"])
    parser.add_argument("--full", action="store_true", help="images of 1280x800 and longer drives")
    parser.add_argument("--no-truth", action="store_true", help="not once more with the true rig")
    return parser.parse_args()


def run_chain(args, car):
    scene, seed, rig_seed = car.split(":")
    words = ["--work", str(args.work / car.replace(":", "_")), "--scene", scene, "--seed", seed, "--rig-seed", rig_seed]
    one = chain.Chain(chain.argument_parser().parse_args([*words, *([] if args.full else ["--quick"])]))
    mapping, other, *_ = one.stages()
    if not args.no_truth:
        one.stages_from_truth(mapping, other)
    chain_report.write(one.work / "report.html", one)
    return {name: step["figures"] for name, step in one.figures.items()}


def judged(cars):
    """Line, goal, figure per car, reached."""
    lines = (
        ("pose in the map, median", "<= 5 cm", "localization", "median_m", 0.05, centimetres),
        ("the same, angle", "<= 0.1 degrees", "localization", "median_deg", 0.1, lambda value: f"{value:.3f}"),
        ("height map, mean", "<= 5 cm", "height_map", "mean_m", 0.05, centimetres),
        ("obstacles within 5 m, mean", "<= 7 cm", "obstacles", "mean_m", 0.07, centimetres),
    )
    for name, goal, step, key, bound, text in lines:
        values = [figures[step].get(key, float("inf")) for figures in cars.values()]
        yield [name, goal, *(text(value) for value in values), mark(max(values) <= bound)]


def added(cars):
    """Each figure from estimates of the stages before, and from truth."""
    def row(name, step, key, text):
        return [name, *(text(figures[step][key]) if key in figures.get(step, {}) else "-" for figures in cars.values())]

    def pair(name, step, part, whole):
        return [name, *(f"{figures[step][part]} of {figures[step][whole]}" if {part, whole} <= figures.get(step, {}).keys() else "-"
                        for figures in cars.values())]

    def largest(values):
        return f"{max(values.values()):.3f}"

    yield row("lenses: rms error (px), front", "intrinsics", "front", lambda value: f"{value['error_px']:.3f}")
    yield row("cameras' places: largest error (cm)", "extrinsics", "error_m",
              lambda value: f"{100 * max(value.values()):.2f}")
    yield row("cameras' places: largest error (degrees)", "extrinsics", "error_deg", largest)
    for title, suffix in (("estimated rig", ""), ("true rig", "_true_rig")):
        yield row(f"sparse map, {title}: rms", f"map{suffix}", "position_rms_m", centimetres)
        yield row(f"sparse map, {title}: scale", f"map{suffix}", "scale_error", lambda value: f"{100 * value:+.2f} %")
        yield row(f"pose in the map, {title}: median", f"localization{suffix}", "median_m", centimetres)
        yield row(f"pose in the map, {title}: angle, median (degrees)", f"localization{suffix}", "median_deg",
                  lambda value: f"{value:.3f}")
        yield row("the same: 95 %", f"localization{suffix}", "p95_m", centimetres)
        yield pair("the same: frames localized", f"localization{suffix}", "localized", "frames")
        yield row("the same: localized, but wrong", f"localization{suffix}", "wrong", str)
        yield row("the same: normalized error squared per degree of freedom (all frames)", f"localization{suffix}", "normalized",
                  lambda value: f"{value:.2f}")
        yield row(f"height map, {title}: mean", f"height_map{suffix}", "mean_m", centimetres)
        yield row("the same: tape measures, mean", f"height_map{suffix}", "tape_m", centimetres)
        yield pair("the same: tape measures shown", f"height_map{suffix}", "tapes", "all_tapes")
        yield row(f"obstacles, {title}: mean", f"obstacles{suffix}", "mean_m", centimetres)
        yield row("the same: 95 %", f"obstacles{suffix}", "p95_m", centimetres)
        yield pair("the same: obstacles missed", f"obstacles{suffix}", "missed", "obstacles")
        yield row("the same: false cells per 10 m", f"obstacles{suffix}", "false_per_10_m", lambda value: f"{value:.1f}")
        yield pair("the same: cells inside obstacles that were free for some frame", f"obstacles{suffix}", "free_inside",
                   "observed_inside")
    yield row("height map, true rig and poses: mean", "height_map_truth", "mean_m", centimetres)
    yield row("the same: tape measures, mean", "height_map_truth", "tape_m", centimetres)
    yield pair("the same: tape measures shown", "height_map_truth", "tapes", "all_tapes")


def print_table(title, headings, rows):
    print(f"\n{title}\n\n| " + " | ".join(headings) + " |\n|" + "---|" * len(headings))
    for cells in rows:
        print("| " + " | ".join(str(cell) for cell in cells) + " |")
    sys.stdout.flush()


def main():
    args = arguments()
    cars = {car: run_chain(args, car) for car in args.cars}
    print_table("End to end", ("what", "goal", *cars, "reached"), judged(cars))
    print_table("What each stage adds", ("what", *cars), added(cars))


if __name__ == "__main__":
    main()
