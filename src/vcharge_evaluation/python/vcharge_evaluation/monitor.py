"""Watching a rig: alarms without a change, and what is told of knocked cameras, a tyre, a load, a suspension and a dirty lens,
and when; the errors of repaired cameras."""
import argparse
import math

import numpy as np

import vcharge
from vcharge_evaluation.drives import Drive, condition_words
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, judge_rig, run_tool_once, say

PARTS = ("steady", "knocks", "power", "tyre", "load", "suspension", "lens")
AXES = ("forwards", "sideways", "height", "roll", "pitch", "yaw")
KNOCK_S = 40.0
# Camera, axis, size (degrees), and the distance within which it must be found.
KNOCKS = (("left", 4, 0.1, 200.0), ("front", 5, 0.5, 30.0), ("rear", 3, 0.2, 200.0))
# Of the knocks by size: time, cameras in turn, sizes, and whether these must be found.
POWER_S = 25.0
CAMERAS = ("front", "left", "rear", "right")
POWER_TURNS = ((0.05, "degrees", False), (0.1, "degrees", True), (0.2, "degrees", True))
POWER_SHIFTS = ((2.5, "mm", False), (5.0, "mm", True), (10.0, "mm", True))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "monitor_evaluation")
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--scenes", nargs="*", default=["lot:201", "garage:211"], help="scene:seed of each drive")
    parser.add_argument("--conditions", nargs="*", default=["noon", "dusk", "wet"], help="light and weather of steady drives")
    parser.add_argument("--image-scale", type=float, default=0.3)
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the drives early; 0: whole drives")
    return parser.parse_args()


def words_of_drive(args, scene_and_seed):
    scene, seed = scene_and_seed.split(":")
    return ("--scene", scene, "--drive", "loop", "--scene-seed", seed, "--seed", int(seed) + 900, "--image-scale",
            args.image_scale, *(["--duration-s", args.duration_s] if args.duration_s else []))


def clean_drive(args, scene_and_seed):
    """The drive at noon without noise, whose images the others of its scene share."""
    return Drive(args.work, "monitor_clean", *words_of_drive(args, scene_and_seed), "--noise", "off")


def make_drive(args, scene_and_seed, *words):
    """A drive at noon, after `words` for simulate_drive that change few images."""
    return Drive(args.work, "monitor", *words_of_drive(args, scene_and_seed), *words, "--images-from",
                 clean_drive(args, scene_and_seed).bag)


def render_drive(args, scene_and_seed, *words):
    """A drive whose images are all changed by `words`."""
    return Drive(args.work, "monitor", *words_of_drive(args, scene_and_seed), *words)


def monitor(made, rig):
    """The result of monitor_rig, and the folder that it wrote."""
    folder = made.folder / "watched"
    say(f"{made.folder}: monitor_rig")
    return run_tool_once("monitor_rig", folder.with_suffix(".log"), "--bag", made.bag, "--rig", rig, "--output", folder,
                         "--calibration-options", CONFIG / "calibration.yaml", may_fail=True), folder


def driven_until(made, time_s):
    """Distance driven until a time after the start of the drive."""
    rows = vcharge.read_trajectory(made.trajectory).rows
    rows = rows[rows[:, 0] <= rows[0, 0] + time_s]
    return float(np.linalg.norm(np.diff(rows[:, 1:4], axis=0), axis=1).sum())


def in_camera(rig, camera, axis, change):
    """A turn about an axis of the vehicle, or a move along it, as a vector in the camera's frame."""
    vector = np.zeros(3)
    vector[axis] = change
    turn = vcharge.read_rig(rig)[camera].vehicle_from_camera[:3, :3]
    return [round(float(value), 6) for value in turn.T @ vector]


def errors_of(path, true_rig, name, camera):
    """Translation (cm) and rotation error (degrees) of one camera of a rig file."""
    errors = judge_rig(path, true_rig, path.with_suffix(f".{name}.json"))
    index = list(vcharge.read_rig(true_rig).cameras).index(camera)
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
            made = make_drive(args, scene) if condition == "noon" else render_drive(args, scene, *condition_words(condition))
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


class Knock:
    """A drive on which a camera is turned about an axis of the vehicle or moved along it, and what monitor_rig told of it."""

    def __init__(self, args, scene, camera, axis, size, start_s):
        true_rig = clean_drive(args, scene).true_rig
        turn_rad, shift_m = (math.radians(size), 0.0) if axis >= 3 else (0.0, 1e-3 * size)
        fault = {"cameras": f"[{camera}]", "start_s": start_s,
                 "rotation_rad": in_camera(true_rig, camera, axis % 3, turn_rad),
                 "translation_m": in_camera(true_rig, camera, axis % 3, shift_m)}
        self.drive = make_drive(args, scene, *(
            word for key, value in fault.items() for word in ("--set", f"faults.bumped_camera.{key}={value}")))
        self.run, self.folder = monitor(self.drive, self.drive.truth / "rig_before.yaml")
        self.changes = self.run.found.get("changes", [])
        self.moved = [change for change in self.changes if change.get("camera") == camera and change["main_axis"] == axis]
        self.is_told_right = bool(self.moved) and len(self.changes) == 1
        self.found_after_m = self.moved[0]["found_m"] - driven_until(self.drive, start_s) if self.moved else None

    def text(self):
        return "; ".join(change["text"] for change in self.changes) or "nothing"


def knocks(args, results):
    """A camera is turned during the drive."""
    columns, right = [], []
    for scene in args.scenes:
        for camera, axis, size_deg, within_m in KNOCKS:
            one = Knock(args, scene, camera, axis, size_deg, KNOCK_S)
            right.append(one.is_told_right)
            figures = [Figure("told", one.text()), figure("found after", one.found_after_m, "m", at_most=within_m),
                       figure("other alarms", len(one.changes) - len(one.moved), equal=0)]
            repaired, true_rig = one.folder / "rig.yaml", one.drive.truth / "rig_after.yaml"
            if repaired.exists() and one.run.found.get("repaired"):
                before = errors_of(one.drive.truth / "rig_before.yaml", true_rig, "before", camera)
                after = errors_of(repaired, true_rig, "after", camera)
                figures += [Figure("rotation error before the repair", before[1], "degrees"),
                            figure("rotation error after the repair", after[1], "degrees", at_most=before[1]),
                            Figure("translation error after the repair", after[0], "cm")]
            columns.append((f"{scene}, {camera} {AXES[axis]} {size_deg:g} degrees", figures))
    results.add(f"A camera is knocked, image scale {args.image_scale:g}", *columns)
    results.add(f"A camera is knocked, all drives, image scale {args.image_scale:g}", ("all", [
        figure("right camera and axis, nothing else", percent(sum(right), len(right)), "%", at_least=95)]))


def power(args, results):
    """Knocks of several sizes along and about each axis: how far the car drives until they are found."""
    columns, right, number = [], [], 0
    for scene in args.scenes:
        for axis, name in enumerate(AXES):
            figures = []
            for size, unit, is_goal in POWER_TURNS if axis >= 3 else POWER_SHIFTS:
                one = Knock(args, scene, CAMERAS[number % len(CAMERAS)], axis, size, POWER_S)
                number += 1
                figures.append(figure(f"{size:g} {unit}, found after", one.found_after_m, "m",
                                      at_most=200.0 if is_goal else None))
                figures.append(Figure(f"{size:g} {unit}, told", one.text()))
                if is_goal:
                    right.append(one.is_told_right)
            columns.append((f"{scene}, {name}", figures))
    results.add(f"Knocks by size, image scale {args.image_scale:g}", *columns)
    results.add(f"Knocks of 0.1 degrees and 5 mm or more, image scale {args.image_scale:g}", ("all", [
        Figure("knocks", len(right)),
        figure("right camera and axis, nothing else", percent(sum(right), len(right)), "%", at_least=95)]))


def told_as(args, results, title, words, part="", remark="", make=make_drive):
    """Drives on which something other than a camera changes, after `words` for simulate_drive: told as changes of a part of
    the car, or by a remark."""
    columns = []
    for scene in args.scenes:
        made = make(args, scene, *words)
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
                                                  f"faults.loaded_boot.start_s={KNOCK_S}"), part="body", make=render_drive)


def suspension(args, results):
    """The suspension is five times as soft."""
    told_as(args, results, "A soft suspension", ("--set", "faults.soft_suspension.pitch_factor=5"), remark="soft suspension",
            make=render_drive)


def lens(args, results):
    """The left lens gets dirty."""
    told_as(args, results, "A lens gets dirty", ("--set", "faults.dirty_lens.cameras=[left]", "--set",
                                                 f"faults.dirty_lens.start_s={KNOCK_S}"), remark="camera left has dirt on its lens")


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("monitor", "Watching a rig", args)
    for part in args.parts:
        globals()[part](args, results)
    results.end()


if __name__ == "__main__":
    main()
