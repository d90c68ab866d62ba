"""Obstacles: range errors, obstacles missed, false cells, and cells inside obstacles that were free."""
import argparse

from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import CONFIG, judge, run_tool, simulate

# pitch is the lot's drive on a soft suspension. The other_day drives are those of the chain (chain/steps.py).
OTHER_DAY = ["--drive", "other_day", "--duration-s", 8, "--exposure-gain", 1.2, "--set", "odometer.scale_error=-0.0005",
             "--set", "odometer.left_right_error=0.0003"]
STOP_AND_GO = ["--scene", "lot", "--drive", "stop_and_go", "--duration-s", 6]
DRIVES = {
    "course": ["--scene", "obstacles", "--drive", "creep", "--duration-s", 19.5],
    "lot": STOP_AND_GO,
    "pitch": [*STOP_AND_GO, "--set", "faults.soft_suspension.pitch_factor=4"],
    "garage": ["--scene", "garage", "--drive", "short", "--duration-s", 4],
    "lot_other_day": ["--scene", "lot", *OTHER_DAY],
    "garage_other_day": ["--scene", "garage", *OTHER_DAY],
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "obstacle_evaluation")
    parser.add_argument("--small", action="store_true",
                        help="images of 512x320, which render faster; range maps have 384x240 pixels either way")
    parser.add_argument("--seed", type=int, default=108, help="those below 50 serve to choose options")
    parser.add_argument("--rig-seed", type=int, default=1, help="random rig of the other_day drives")
    parser.add_argument("--drives", nargs="*", default=["course", "lot", "pitch", "garage"], choices=DRIVES)
    return parser.parse_args()


def detect(args, name):
    """Errors of the obstacle maps of a drive."""
    if name.endswith("_other_day"):
        words = ["--seed", args.seed + 400, "--rig", "random", "--rig-seed", args.rig_seed, "--image-scale", 0.5]
        folder = args.work / f"{name}_seed{args.seed}_rig{args.rig_seed}"
    else:
        words = ["--seed", f"{args.seed}1", "--image-scale", 0.4 if args.small else 1.0]
        folder = args.work / (f"{name}_seed{args.seed}" + ("_small" if args.small else ""))
    simulate(folder, [*DRIVES[name], *words, "--scene-seed", args.seed, "--cameras", "front", "left", "right",
                      "--truth-range"])
    run_tool("detect_obstacles", folder / "detect.log", "--bag", folder / "drive.bag", "--rig", folder / "rig_truth.yaml",
             "--options", CONFIG / "obstacles.yaml", "--range-options", CONFIG / "dense_obstacles.yaml", "--output",
             folder / "obstacles")
    return judge("obstacles", folder / "report", "--obstacles", folder / "obstacles", "--truth", folder / "drive_truth")


def summary(errors):
    """The main figures of evaluate_obstacles's report. Missed rays count as 0.5 m, in the direction of travel too."""
    fused = next(scan for scan in errors["scans"] if scan["name"] == "fused")
    judged = errors["map"]["obstacles"]
    approach = errors["approach"]
    cells = approach["corridor"]
    free = cells["free_as_free"] + cells["free_as_unknown"] + cells["free_as_occupied"]
    return {"mean_m": fused["all"]["error_m"]["mean"], "p95_m": fused["all"]["error_m"]["percentile_95"],
            "missed_rays": fused["all"]["missed"] / max(1, fused["all"]["rays"]),
            "by_range": [(one["from_m"], one["to_m"], one["error_m"]["mean"] if one["rays"] else None)
                         for one in fused["by_range"]],
            "obstacles": len(judged), "missed": sum(not obstacle["reported"] for obstacle in judged),
            "false_per_10_m": errors["map"]["false_cells_per_10_m"], "free_inside": errors["map"]["free_inside"],
            "observed_inside": errors["map"]["observed_inside"], "reports": approach["reports"],
            "corridor_free": cells["free_as_free"] / max(1, free), "corridor_unknown": cells["free_as_unknown"] / max(1, free),
            "corridor_wrong": cells["occupied_as_free"],
            "alarms_per_minute": 60 * approach["false_alarms"] / max(1e-9, approach["duration_s"]),
            "alarms_per_m": approach["false_alarms"] / approach["driven_m"] if approach["driven_m"] > 0.1 else None}


def reported_before(reports, distance_m=None, contact_s=None):
    """How many of the obstacles that came this near were reported before, as text; those never reported are misses."""
    if distance_m is not None:
        due = [one for one in reports if one["nearest_m"] <= distance_m and one["first_visible_m"] > distance_m]
        early = [one for one in due if one["first_reported_m"] is not None and one["first_reported_m"] >= distance_m]
    else:
        due = [one for one in reports if one["first_reported_m"] is None or one["contact_s"] is not None]
        early = [one for one in due if one["contact_s"] is not None and one["contact_s"] >= contact_s]
    return f"{len(early)} of {len(due)}"


def report_figures(reports):
    """First reports by kind, people apart from the rest."""
    for name, chosen in (("moving", [one for one in reports if one["moves"]]),
                         ("people at rest", [one for one in reports if one["kind"] == "pedestrian" and not one["moves"]]),
                         ("other things", [one for one in reports if one["kind"] != "pedestrian" and not one["moves"]])):
        if chosen:
            for distance_m in (3.0, 2.0, 1.0):
                yield Figure(f"{name} within 1 m of the path: reported before {distance_m:g} m from the bumper",
                             reported_before(chosen, distance_m=distance_m))
            yield Figure(f"{name}: reported 2 s before contact", reported_before(chosen, contact_s=2.0))


def figures(found):
    yield figure("range error within 5 m, mean, missed rays as 0.5 m", 100 * found["mean_m"], "cm", at_most=7)
    yield Figure("range error within 5 m, 95 %", 100 * found["p95_m"], "cm")
    yield Figure("rays missed", 100 * found["missed_rays"], "%")
    for from_m, to_m, mean_m in found["by_range"]:
        yield Figure(f"range error from {from_m:g} to {to_m:g} m, mean", None if mean_m is None else 100 * mean_m, "cm")
    yield figure(f"obstacles missed, of {found['obstacles']}", found["missed"], equal=0)
    yield figure("false cells per 10 m", found["false_per_10_m"], at_most=1.0)
    yield figure("cells inside obstacles that were free", found["free_inside"], equal=0)
    yield Figure("cells inside obstacles that were observed", found["observed_inside"])
    yield from report_figures(found["reports"])
    yield Figure("free cells of the driving corridor that are free", 100 * found["corridor_free"], "%")
    yield Figure("the same, unknown", 100 * found["corridor_unknown"], "%")
    yield figure("occupied cells of the corridor that are free", found["corridor_wrong"], equal=0)
    yield Figure("false alarms in the corridor a minute", found["alarms_per_minute"])
    yield Figure("false alarms in the corridor per metre", found["alarms_per_m"])


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("obstacles", "Obstacles", args)
    for name in args.drives:
        results.add(f"Obstacles of 20 cm and more at 0.5 to 5 m{', small images' if args.small else ''}",
                    (f"{name}, seed {args.seed}", list(figures(summary(detect(args, name))))))
    results.end()


if __name__ == "__main__":
    main()
