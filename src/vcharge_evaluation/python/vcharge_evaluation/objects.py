"""Tracked moving objects: how many of those that move nearby in sight are found, where, how fast, and with one id."""
import argparse

from vcharge_evaluation.drawing.moments import OBJECT_LEGEND, draw_objects
from vcharge_evaluation.drives import CONDITIONS, condition_words, scenario_with_masks
from vcharge_evaluation.obstacles import detect_obstacles
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent, quantile
from vcharge_evaluation.tools import NoResult, judge, say

DRIVES = ("movers_lot", "movers_garage", "movers_crossing", "standing_lot", "standing_approached", "stop_and_go_lot",
          "bay_backwards_lot")
# Movers of the scenarios that have none.
MOVERS = {"bay_backwards_lot": {"people": 6, "children": 3, "cars": 2, "bicycles": 2}}
LEAST_PERCENT = 90
LEAST_APPROACHES_PERCENT = 98
FOUND, GOOD, KEPT = "found, of those due", "within 0.3 m and 0.3 m/s", "crossings that keep one id"
NEAREST_ERROR, VELOCITY_ERROR = "position error of the nearest point", "velocity error"
MISSED_M, MISSED_M_PER_S = 1.0, 1.0  # errors with which evaluate_objects counts a missed object


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "object_evaluation")
    parser.add_argument("--drives", nargs="*", default=DRIVES, choices=DRIVES, help="files in config/scenarios")
    parser.add_argument("--seeds", nargs="*", type=int, default=[31], help="seeds of the scenes; those below 100 serve to choose "
                        "options")
    parser.add_argument("--conditions", nargs="*", default=["noon"], choices=CONDITIONS, help="light and weather")
    parser.add_argument("--image-scale", type=float, default=0.5)
    parser.add_argument("--duration-s", type=float, default=12.0)
    return parser.parse_args()


def settings(name, condition):
    """Words that add movers and the condition to a scenario."""
    movers = [word for key, count in MOVERS.get(name, {}).items() for word in ("--set", f"movers.{key}={count}")]
    return [*movers, *condition_words(condition)]


def judge_objects(drive, folder):
    """Errors of the tracked objects in a folder."""
    return judge("objects", drive.folder / "object_report", "--objects", folder, "--truth", drive.truth)


def part(name, number, whole, **goals):
    """A figure in percent; without a goal where there is nothing to judge."""
    return figure(name, percent(number, whole), "%", **goals) if whole else Figure(name, None, "%")


def bar_figures(errors):
    yield part(FOUND, errors["found"], errors["due"], at_least=LEAST_PERCENT)
    yield part(GOOD, errors["good"], errors["due"], at_least=LEAST_PERCENT)


def error_figures(errors):
    """Missed objects count as 1 m and 1 m/s."""
    yield Figure("objects due, counted in each image", errors["due"])
    yield part("within 0.3 m", errors["good_position"], errors["due"])
    yield part("within 0.3 m/s", errors["good_velocity"], errors["due"])
    yield part("class right, of those found", errors["right_class"], errors["found"])
    for name, key, unit in ((NEAREST_ERROR, "position_error_m", "m"), ("position error of the centre", "centre_error_m", "m"),
                            (VELOCITY_ERROR, "velocity_error_m_per_s", "m/s")):
        for which, quantity in (("median", "percentile_50"), ("mean", "mean"), ("95 %", "percentile_95"), ("worst", "max")):
            yield Figure(f"{name}, {which}", errors[key][quantity] if errors["due"] else None, unit)


def drive_figures(errors):
    """The bars first."""
    yield from bar_figures(errors["all"])
    yield part(KEPT, sum(one["kept"] for one in errors["crossings"]), len(errors["crossings"]), at_least=LEAST_PERCENT)
    approaches = errors["approaches"]
    if approaches:
        yield part("approaches to the standing vehicle reported before 1.5 m", sum(one["reported"] for one in approaches),
                   len(approaches), at_least=LEAST_APPROACHES_PERCENT)
        yield Figure("approaches", len(approaches))
        firsts = sorted(one["first_reported_m"] for one in approaches)
        yield Figure("first reported at, median", quantile(firsts, 0.5), "m")
        yield Figure("first reported at, nearest", firsts[0], "m")
    yield figure("false objects a minute", errors["false_per_minute"], at_most=1)
    yield from error_figures(errors["all"])
    delays = sorted(one["delay_s"] for one in errors["first_reports"])
    yield Figure("time to the first report, median", quantile(delays, 0.5) if delays else None, "s")
    yield Figure("time to the first report, worst", delays[-1] if delays else None, "s")
    yield Figure("objects never reported", f"{sum(not one['found'] for one in errors['first_reports'])} of {len(delays)}")
    number = errors["normalized_error"]["count"]
    yield Figure("squared position error by its covariance, mean (honest: 2)",
                 errors["normalized_error"]["mean"] if number else None)
    yield part("squared position errors within the 95 % of an honest covariance", errors["normalized_within_95"], number)


def failed_figures():
    """Where detect_obstacles has no result: nothing is found."""
    for name in (FOUND, GOOD, KEPT):
        yield figure(name, 0.0, "%", at_least=LEAST_PERCENT)
    for name, bound, unit in ((NEAREST_ERROR, MISSED_M, "m"), (VELOCITY_ERROR, MISSED_M_PER_S, "m/s")):
        yield Figure(f"{name}, median", bound, unit)


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("objects", "Moving objects", args)
    size = f"image scale {args.image_scale:g}, {args.duration_s:g} s"
    for name, seed, condition in ((name, seed, condition) for name in args.drives for seed in args.seeds
                                  for condition in args.conditions):
        column = f"{name}, {condition}, seed {seed}"
        say(column)
        drive, masks = scenario_with_masks(args, name, seed, settings(name, condition))
        title, folder = f"Moving objects within 8 m, {size}", drive.folder / "objects"
        try:
            detect_obstacles(drive, masks.rig_of(drive.folder), folder)
        except NoResult as error:
            results.add(title, (column, [*failed_figures(), Figure("remarks", f"{masks.text()}; {error}")]))
            continue
        errors = judge_objects(drive, folder)
        results.add(title, (column, [*drive_figures(errors), Figure("remarks", masks.text())]))
        for one in errors["by_class"]:
            results.add(f"By class: {one['class']}, {size}", (column, [*bar_figures(one), *error_figures(one)]))
        for one in errors["by_distance"]:
            results.add(f"By distance: {one['from_m']:g} to {one['to_m']:g} m, {size}", (column, [*bar_figures(one), *error_figures(one)]))
        if errors["worst_ns"]:
            bad = 100.0 - percent(errors["all"]["good"], errors["all"]["due"])
            results.show(draw_objects(drive, folder, errors["worst_ns"]),
                         f"{column}: {bad:.0f} % of the objects due are missed or off by more than 0.3 m or 0.3 m/s. {OBJECT_LEGEND}",
                         bad)
    results.end()


if __name__ == "__main__":
    main()
