"""Watching a rig: alarms without a change, and what is told of knocked cameras, a tyre, a load, a suspension and a dirty lens,
and when; the errors of repaired cameras."""
import argparse
import math

import numpy as np
import yaml

from vcharge_evaluation.drives import Drive
from vcharge_evaluation.poses import rotations
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, judge_rig, run_tool_once, say

PARTS = ("steady", "knocks", "tyre", "load", "suspension", "lens")
AXES = ("forwards", "sideways", "height", "roll", "pitch", "yaw")
KNOCK_S = 40.0
# Camera, axis, size (degrees), and the distance within which it must be found.
KNOCKS = (("left", 1, 0.1, 200.0), ("front", 2, 0.5, 30.0), ("rear", 0, 0.2, 200.0))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "monitor_evaluation")
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--scenes", nargs="*", default=["lot:201", "garage:211"], help="scene:seed of each drive")
    parser.add_argument("--conditions", nargs="*", default=["noon", "dusk", "wet"], help="light and weather of steady drives")
    parser.add_argument("--image-scale", type=float, default=0.3)
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the drives early; 0: whole drives")
    return parser.parse_args()


def make_drive(args, scene_and_seed, *words):
    scene, seed = scene_and_seed.split(":")
    return Drive(args.work, "monitor", "--scene", scene, "--drive", "loop", "--scene-seed", seed, "--seed", int(seed) + 900,
                 "--image-scale", args.image_scale, *(["--duration-s", args.duration_s] if args.duration_s else []), *words)


def monitor(made, rig):
    """The result of monitor_rig, and the folder that it wrote."""
    folder = made.folder / "watched"
    say(f"{made.folder}: monitor_rig")
    return run_tool_once("monitor_rig", folder.with_suffix(".log"), "--bag", made.bag, "--rig", rig, "--output", folder,
                         "--calibration-options", CONFIG / "calibration.yaml", may_fail=True), folder


def driven_until(made, time_s):
    """Distance driven until a time after the start of the drive."""
    rows = np.loadtxt(made.trajectory)
    rows = rows[rows[:, 0] <= rows[0, 0] + time_s]
    return float(np.linalg.norm(np.diff(rows[:, 1:4], axis=0), axis=1).sum())


def in_camera(rig, camera, axis, turn_rad):
    """A turn about an axis of the vehicle as a rotation vector in the camera's frame."""
    turn = np.zeros(3)
    turn[axis] = turn_rad
    pose = yaml.safe_load(rig.read_text())["cameras"][camera]["vehicle_from_camera"]
    return [round(float(value), 6) for value in rotations(np.array([pose["rotation_xyzw"]]))[0].T @ turn]


def errors_of(path, true_rig, name, camera):
    """Translation (cm) and rotation error (degrees) of one camera of a rig file."""
    errors = judge_rig(path, true_rig, path.with_suffix(f".{name}.json"))
    index = list(yaml.safe_load(true_rig.read_text())["cameras"]).index(camera)
    entry = errors["as_is"][index]
    return 100 * float(np.linalg.norm(entry["error_m"])), math.degrees(np.linalg.norm(entry["error_rad"]))


def largest_sigmas(found):
    """The largest deviation of a result of monitor_rig over its sigma; None where it found nothing."""
    if "deviation" not in found:
        return None
    return float(np.max(np.abs(found["deviation"]) / np.array(found["standard_deviations"])))


def steady(args, results):
    """Drives on which nothing changes."""
    alarms, distance_m, columns = 0, 0.0, []
    for scene in args.scenes:
        for condition in args.conditions:
            words = () if condition == "noon" else ("--set", f"condition.kind={condition}")
            made = make_drive(args, scene, *words)
            run, _ = monitor(made, made.true_rig)
            found = run.found
            alarms += len(found.get("changes", ["no result"]))
            distance_m += found.get("distance_m", 0.0)
            columns.append((f"{scene}, {condition}", [
                Figure("verdict", found.get("verdict", "none")), Figure("driven", found.get("distance_m"), "m"),
                figure("alarms", len(found.get("changes", ["no result"])), equal=0),
                Figure("largest deviation over its sigma", largest_sigmas(found))]))
    results.add(f"Nothing changes, image scale {args.image_scale:g}", *columns)
    results.add(f"Nothing changes, all drives, image scale {args.image_scale:g}", ("all", [
        Figure("driven", distance_m / 1e3, "km"), figure("alarms", alarms, equal=0)]))


def knocks(args, results):
    """A camera is turned during the drive."""
    columns, right = [], []
    for scene in args.scenes:
        made_before = make_drive(args, scene)
        for camera, axis, size_deg, within_m in KNOCKS:
            turn = in_camera(made_before.true_rig, camera, axis, math.radians(size_deg))
            made = make_drive(args, scene, "--set", f"faults.bumped_camera.cameras=[{camera}]", "--set",
                              f"faults.bumped_camera.start_s={KNOCK_S}", "--set",
                              f"faults.bumped_camera.rotation_rad={turn}")
            run, folder = monitor(made, made.truth / "rig_before.yaml")
            changes = run.found.get("changes", [])
            moved = [change for change in changes if change.get("camera") == camera and change["main_axis"] == 3 + axis]
            right.append(bool(moved) and len(changes) == 1)
            after_m = moved[0]["found_m"] - driven_until(made, KNOCK_S) if moved else None
            figures = [Figure("told", "; ".join(change["text"] for change in changes) or "nothing"),
                       figure("found after", after_m, "m", at_most=within_m), figure("other alarms",
                                                                                     len(changes) - len(moved), equal=0)]
            repaired, true_rig = folder / "rig.yaml", made.truth / "rig_after.yaml"
            if repaired.exists() and run.found.get("repaired"):
                before = errors_of(made.truth / "rig_before.yaml", true_rig, "before", camera)
                after = errors_of(repaired, true_rig, "after", camera)
                figures += [Figure("rotation error before the repair", before[1], "degrees"),
                            figure("rotation error after the repair", after[1], "degrees", at_most=before[1]),
                            Figure("translation error after the repair", after[0], "cm")]
            columns.append((f"{scene}, {camera} {AXES[3 + axis]} {size_deg:g} degrees", figures))
    results.add(f"A camera is knocked, image scale {args.image_scale:g}", *columns)
    results.add(f"A camera is knocked, all drives, image scale {args.image_scale:g}", ("all", [
        figure("right camera and axis, nothing else", percent(sum(right), len(right)), "%", at_least=95)]))


def told_as(args, results, title, words, part="", remark=""):
    """Drives on which something other than a camera changes, after `words` for simulate_drive: told as changes of a part of
    the car, or by a remark."""
    columns = []
    for scene in args.scenes:
        made = make_drive(args, scene, *words)
        run, _ = monitor(made, made.true_rig)
        changes, remarks = run.found.get("changes", []), run.found.get("remarks", [])
        told = [change for change in changes if change["part"] == part]
        columns.append((scene, [
            Figure("told", "; ".join(remarks) or "nothing"),
            figure("told as such", sum(remark in text for text in remarks), equal=1) if remark else
            figure("told as such", len(told), at_least=1),
            figure("other alarms", len(changes) - len(told) if "changes" in run.found else 1, equal=0),
            Figure("found after", told[0]["found_m"] - driven_until(made, KNOCK_S) if told else None, "m")]))
    results.add(f"{title}, image scale {args.image_scale:g}", *columns)


def tyre(args, results):
    """The left rear tyre loses 0.3 % of its radius, and turns more."""
    told_as(args, results, "A tyre loses 0.3 %", ("--set", "faults.wheel_slip.ratio=0.003", "--set",
                                                  f"faults.wheel_slip.start_s={KNOCK_S}"), part="odometer")


def load(args, results):
    """The boot is loaded."""
    told_as(args, results, "The boot is loaded", ("--set", "faults.loaded_boot.pitch_rad=0.01", "--set",
                                                  f"faults.loaded_boot.start_s={KNOCK_S}"), part="body")


def suspension(args, results):
    """The suspension is five times as soft."""
    told_as(args, results, "A soft suspension", ("--set", "faults.soft_suspension.pitch_factor=5"), remark="soft suspension")


def lens(args, results):
    """The left lens gets dirty."""
    told_as(args, results, "A lens gets dirty", ("--set", "faults.dirty_lens.cameras=[left]", "--set",
                                                 f"faults.dirty_lens.start_s={KNOCK_S}"), remark="camera left has dirt on its lens")


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("monitor", "Watching a rig", args)
    steps = {"steady": steady, "knocks": knocks, "tyre": tyre, "load": load, "suspension": suspension, "lens": lens}
    for part in args.parts:
        steps[part](args, results)
    results.end()


if __name__ == "__main__":
    main()
