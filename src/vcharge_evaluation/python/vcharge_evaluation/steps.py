"""Kerbs, steps and holes near the vehicle: the length that is found, and false steps. Bumps with ramps are no steps."""
import argparse

from vcharge_evaluation.drives import scenario_with_masks, scene_and_drive
from vcharge_evaluation.obstacles import detect_obstacles
from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import NoResult, judge, say

DRIVES = ("steps_lot", "road_bumps", "bay_backwards_lot", "movers_lot")
HIGH, LOW, FALSE = "kerbs of 8 cm and more, found", "steps of 5 to 8 cm, found", "false steps per 10 m"
CELL_M = 0.025  # of the true heights: edges are located by them


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "step_evaluation")
    parser.add_argument("--drives", nargs="*", default=DRIVES, choices=DRIVES, help="files in config/scenarios")
    parser.add_argument("--seeds", nargs="*", type=int, default=[31], help="seeds of scenes and plans; those below 100 serve to "
                        "choose options")
    parser.add_argument("--image-scale", type=float, default=0.5)
    parser.add_argument("--duration-s", type=float, default=16.0)
    return parser.parse_args()


def plan(name, seed):
    """Words that draw the plan of a lot, with the height of its kerbs, and the surfaces; the steps have a plan of their own."""
    layout = ("--set", f"layout_seed={seed}") if scene_and_drive(name)[0] == "lot" else ()
    return (*layout, "--set", f"surface_seed={seed}", "--height-cell-m", CELL_M)


def step_figures(errors):
    """Without a goal where there is no such step."""
    for name, one, least in ((HIGH, errors["high"], 95), (LOW, errors["low"], 80)):
        if one["found_fraction"] is None:
            yield Figure(name, None, "%")
        else:
            yield figure(name, 100 * one["found_fraction"], "%", at_least=least)
    yield figure(FALSE, errors["false_steps_per_10_m"], at_most=1)
    for name, one in (("8 cm and more", errors["high"]), ("5 to 8 cm", errors["low"])):
        yield Figure(f"length due, {name}", one["length_m"], "m")
        yield Figure(f"the same, found in most maps ({name})", one["found_length_m"], "m")
        yield Figure(f"mean error of the reported height, {name}", 100 * one["mean_height_error_m"], "cm")
    yield Figure("driven", errors["driven_m"], "m")


def failed_figures():
    """Where detect_obstacles has no result: nothing is found."""
    yield figure(HIGH, 0.0, "%", at_least=95)
    yield figure(LOW, 0.0, "%", at_least=80)


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("steps", "Kerbs, steps and holes", args)
    title = f"Steps within 3 m, image scale {args.image_scale:g}, {args.duration_s:g} s"
    for name, seed in ((name, seed) for name in args.drives for seed in args.seeds):
        column = f"{name}, seed {seed}"
        say(column)
        drive, masks = scenario_with_masks(args, name, seed, plan(name, seed))
        folder = drive.folder / "obstacles"
        try:
            detect_obstacles(drive, masks.rig_of(drive.folder), folder)
        except NoResult as error:
            results.add(title, (column, [*failed_figures(), Figure("remarks", f"{masks.text()}; {error}")]))
            continue
        errors = judge("steps", drive.folder / "step_report", "--steps", folder, "--truth", drive.truth)
        results.add(title, (column, [*step_figures(errors), Figure("remarks", masks.text())]))
    results.end()


if __name__ == "__main__":
    main()
