"""Obstacles: range errors, obstacles missed, false cells, and cells inside obstacles that were free."""
import argparse

from vcharge_evaluation.drawing.moments import OBSTACLE_LEGEND, draw_obstacles
from vcharge_evaluation.drives import (CONDITIONS, OTHER_DAY, Drive, condition_words, found_masks, scenario_drive,
                                       scene_and_drive)
from vcharge_evaluation.results import Figure, Results, add_arguments, calibration_figures, figure, percent
from vcharge_evaluation.tools import CONFIG, NoResult, judge, run_tool_once

STOP_AND_GO = ("--drive", "stop_and_go")
# Scene, duration, and words of each drive. pitch is the lot's drive on a soft suspension.
DRIVES = {
    "course": ("obstacles", 19.5, ("--drive", "creep")),
    "course_back": ("obstacles", 19.5, ("--drive", "creep_back")),
    "lot": ("lot", 6, STOP_AND_GO),
    "pitch": ("lot", 6, (*STOP_AND_GO, "--set", "faults.soft_suspension.pitch_factor=4")),
    "garage": ("garage", 4, ("--drive", "short")),
    "lot_other_day": ("lot", 8, OTHER_DAY),
    "garage_other_day": ("garage", 8, OTHER_DAY),
}
# Drives of config/scenarios, and their duration: backwards into a bay, and out of it forwards.
REVERSING = {"bay_backwards_lot": 20, "bay_backwards_garage": 20}
SMALL = 0.4


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "obstacle_evaluation")
    parser.add_argument("--small", action="store_true",
                        help="images of 512x320, which render faster; range maps have 384x240 pixels either way")
    parser.add_argument("--seed", type=int, default=108, help="those below 50 serve to choose options")
    parser.add_argument("--rig-seed", type=int, help="random rig in place of the Golf's")
    parser.add_argument("--duration-s", type=float, help="in place of each drive's own duration")
    parser.add_argument("--drives", nargs="*", default=["course", "lot", "pitch", "garage"], choices=[*DRIVES, *REVERSING])
    parser.add_argument("--conditions", nargs="*", default=["noon"], choices=CONDITIONS, help="light and weather")
    return parser.parse_args()


def drive_of(args, name, condition):
    """A drive in a condition, its scene, and the words of its car."""
    scale = SMALL if args.small else 1.0
    car = () if args.rig_seed is None else ("--rig", "random", "--rig-seed", args.rig_seed)
    words = (*car, *condition_words(condition))
    if name in REVERSING:
        duration_s = args.duration_s or REVERSING[name]
        return scenario_drive(args.work, name, args.seed, scale, duration_s, words), scene_and_drive(name)[0], car
    scene, duration_s, driving = DRIVES[name]
    # The words of drives.other_day_drive, so that stages share this drive.
    drive = Drive(args.work, name, "--scene", scene, *driving, "--scene-seed", args.seed, "--seed", args.seed + 400,
                  "--image-scale", scale, "--duration-s", args.duration_s or duration_s, "--truth-range", *words)
    return drive, scene, car


def detect(args, name, condition):
    """Errors of the obstacle maps of a drive, the drive, and the masks that make_masks found for its car."""
    drive, scene, car = drive_of(args, name, condition)
    masks = found_masks(args.work, scene, car)
    return judge_obstacles(drive, masks.rig_of(drive.folder)), drive, masks


def detect_obstacles(drive, rig, output, *words):
    """Writes obstacle maps and moving objects of a drive with a rig file into a folder, with the log beside it. Returns the
    number of maps, which a standing car has not. NoResult without any of both."""
    run = run_tool_once("detect_obstacles", output.with_suffix(".log"), "--bag", drive.bag, "--rig", rig, "--options",
                        CONFIG / "obstacles.yaml", "--range-options", CONFIG / "dense_obstacles.yaml", "--output", output,
                        *words, may_fail=True)
    if run.error():
        raise NoResult(run.reason())
    return run.found["num_maps"]


def judge_obstacles(drive, rig, *words, name="obstacles", sound=None):
    """Errors of the obstacle maps of a drive with a rig file; `sound` is a drive with the truth, if not this one. NoResult if
    there are no maps."""
    output = drive.folder / name
    if detect_obstacles(drive, rig, output, *words) == 0:
        raise NoResult("no obstacle map could be made")
    return judge("obstacles", drive.folder / f"{name}_report", "--obstacles", output, "--truth", (sound or drive).truth)


def summary(errors):
    """The main figures of evaluate_obstacles's report. Missed rays count as 0.5 m, in the direction of travel too."""
    fused = next(scan for scan in errors["scans"] if scan["name"] == "fused")
    judged = errors["map"]["obstacles"]
    approach = errors["approach"]
    cells = approach["corridor"]
    free = cells["free_as_free"] + cells["free_as_unknown"] + cells["free_as_occupied"]
    spread = fused["all"]["error_m"]
    return {"mean_m": spread["mean"], "median_m": spread["percentile_50"], "p95_m": spread["percentile_95"],
            "worst_m": spread["max"], "calibration": fused["all"]["calibration"],
            "by_camera": {scan["name"]: scan["all"] for scan in errors["scans"] if scan["name"] != "fused"},
            "classes": recall_by_class(errors["map"]),
            "missed_rays": fused["all"]["missed"] / max(1, fused["all"]["rays"]),
            "overhead": fused["overhead"], "in_motion": errors["fused_after_2_m"]["all"],
            "by_range": [(one["from_m"], one["to_m"], one["error_m"]["mean"] if one["rays"] else None)
                         for one in fused["by_range"]],
            "obstacles": len(judged), "missed": sum(not obstacle["reported"] for obstacle in judged),
            "false_per_10_m": errors["map"]["false_cells_per_10_m"], "free_inside": errors["map"]["free_inside"],
            "observed_inside": errors["map"]["observed_inside"], "reports": approach["reports"],
            "corridor_free": cells["free_as_free"] / max(1, free), "corridor_unknown": cells["free_as_unknown"] / max(1, free),
            "corridor_wrong": cells["occupied_as_free"], "paths": {name: approach[name] for name in ("ahead", "behind")},
            "alarms_per_minute": 60 * approach["false_alarms"] / max(1e-9, approach["duration_s"]),
            "alarms_per_m": approach["false_alarms"] / approach["driven_m"] if approach["driven_m"] > 0.1 else None}


def class_of(kind):
    """Class of a kind of the truth: people apart from the rest."""
    return {"pedestrian": "people", "car": "cars", "bicycle": "bicycles"}.get(kind, "other things")


def recall_by_class(judged):
    """List of class, whether it moves, how many were reported and judged. Standing things count once, moving ones per image
    that shows them."""
    counts = {}
    for moves, kind, reported, number in (
            *((False, one["kind"], int(one["reported"]), 1) for one in judged["obstacles"]),
            *((True, one["kind"], one["maps_reported"], one["maps"]) for one in judged["movers"])):
        entry = counts.setdefault((class_of(kind), moves), [0, 0])
        entry[0] += reported
        entry[1] += number
    return [[name, moves, *entry] for (name, moves), entry in sorted(counts.items())]


def class_figures(found):
    """Recall and first report by class. What is never reported counts as reported at contact."""
    for name, moves, reported, number in found["classes"]:
        unit = "images in which they are visible" if moves else "that are visible"
        yield figure(f"{name}, {'moving' if moves else 'standing'}: reported, of those {unit}", percent(reported, number), "%",
                     at_least=None if moves else 100)
    for name in ("people", "cars", "bicycles", "other things"):
        chosen = [one for one in found["reports"] if class_of(one["kind"]) == name]
        if not chosen:
            continue
        distances = sorted(one["first_reported_m"] or 0.0 for one in chosen)
        yield Figure(f"{name} within 1 m of the path: first reported, median distance", distances[len(distances) // 2], "m")
        yield Figure("the same, least" + f" ({name})", distances[0], "m")
        times = sorted(one["contact_s"] or 0.0 for one in chosen
                       if one["contact_s"] is not None or one["first_reported_m"] is None)
        if times:
            yield Figure(f"{name} within 1 m of the path: first reported, median time to contact", times[len(times) // 2], "s")
            yield Figure(f"the same time, least ({name})", times[0], "s")


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
    yield Figure("range error within 5 m, median", 100 * found["median_m"], "cm")
    yield Figure("range error within 5 m, 95 %", 100 * found["p95_m"], "cm")
    yield Figure("range error within 5 m, worst", 100 * found["worst_m"], "cm")
    yield Figure("rays missed", 100 * found["missed_rays"], "%")
    moving = found["in_motion"]
    if moving["rays"]:
        yield figure("after 2 m of driving: range error within 5 m, mean", 100 * moving["error_m"]["mean"], "cm", at_most=4)
        yield figure("the same, 95 %", 100 * moving["error_m"]["percentile_95"], "cm", at_most=12)
        yield Figure("the same, rays missed", percent(moving["missed"], moving["rays"]), "%")
    yield Figure("rays missed of what only hangs above 1.7 m, as pipes do",
                 percent(found["overhead"]["missed"], found["overhead"]["rays"]) if found["overhead"]["rays"] else None, "%")
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
    for name, path in found["paths"].items():
        free = sum(path[f"free_as_{state}"] for state in ("free", "unknown", "occupied"))
        yield figure(f"own path {name}, 0.5 to 4 m, after 2 m: free ground known free",
                     percent(path["free_as_free"], free) if free else None, "%", at_least=97)
        yield figure(f"own path {name}: occupied cells that are free", path["occupied_as_free"], equal=0)
    yield Figure("false alarms in the corridor a minute", found["alarms_per_minute"])
    yield Figure("false alarms in the corridor per metre", found["alarms_per_m"])


def camera_figures(found):
    for camera, rays in found["by_camera"].items():
        yield Figure(f"{camera}: range error, mean", 100 * rays["error_m"]["mean"] if rays["rays"] else None, "cm")
        yield Figure(f"{camera}: range error, 95 %", 100 * rays["error_m"]["percentile_95"] if rays["rays"] else None, "cm")
        yield Figure(f"{camera}: rays missed", percent(rays["missed"], rays["rays"]), "%")


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("obstacles", "Obstacles", args)
    size = ", small images" if args.small else ""
    for name, condition in ((name, condition) for name in args.drives for condition in args.conditions):
        errors, drive, masks = detect(args, name, condition)
        found, column = summary(errors), f"{name}, {condition}, seed {args.seed}"
        results.add(f"Obstacles of 20 cm and more at 0.5 to 5 m{size}",
                    (column, [*figures(found), Figure("masks", masks.text())]))
        results.add(f"By class{size}", (column, list(class_figures(found))))
        results.add(f"By camera{size}", (column, list(camera_figures(found))))
        results.add(f"Confidence, by the reported sigma, of ranges within 15 cm{size}",
                    (column, calibration_figures(found["calibration"])))
        results.show(draw_obstacles(drive, drive.folder / "obstacles"),
                     f"{column}: mean range error {100 * found['mean_m']:.1f} cm, {found['missed']} of {found['obstacles']} "
                     f"obstacles missed. {OBSTACLE_LEGEND}", found["missed"] + found["mean_m"])
    results.end()


if __name__ == "__main__":
    main()
