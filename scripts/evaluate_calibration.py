#!/usr/bin/env python3
"""What extrinsic calibration reaches, as Markdown tables: accuracy by rig and by seed, consistency, time, wheel errors,
calibration in a map, verdicts on spoiled drives; see evaluate_calibration.sh."""
import argparse
import copy
import json
import math
import os
import pathlib
import re
import sys

import numpy as np
import rosbag
import yaml

from localization_errors import rotations
from tool_runs import ROOT, TOOLS, mark, run, say, simulate

MAX_TURN_DEG, MAX_SHIFT_M = 0.05, 0.01
DEGREES = 180.0 / math.pi
AXES = ("forwards", "sideways", "height", "roll", "pitch", "yaw")
SCENARIO = ROOT / "config" / "scenarios" / "calibration_figure_eight.yaml"
RIGHT_WHEELS = ("--set", "odometer.scale_error=0.0005", "--set", "odometer.left_right_error=0.0002")
OPTIONS = {"calibrate_rig": "calibration.yaml", "calibrate_rig_from_map": "calibration_in_map.yaml"}
PARTS = ("rigs", "seeds", "wheels", "map", "faults", "real")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/calibration_evaluation"),
                        help="folder for drives and rigs; drives that are there are used again")
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--rigs", nargs="*", default=["lot:11", "lot:12", "garage:13", "garage:14"],
                        help="scene:rig-seed of each random rig; the scene's seed is --scene-seed")
    parser.add_argument("--scene-seed", type=int, default=71)
    parser.add_argument("--image-scale", type=float, default=1.0, help="of the rigs' drives")
    parser.add_argument("--image-step", type=int, default=2,
                        help="only every so many of the 12.5 images a second: 2 gives 500 frames in 80 s")
    parser.add_argument("--duration-s", type=float, default=80.0)
    parser.add_argument("--seeds", type=int, default=10, help="of noise, exposure and ticks, on one drive of half the size")
    return parser.parse_args()


class Drive:
    """A drive that was rendered without noise, to be read with any."""

    def __init__(self, args, scene, rig_seed, image_scale):
        self.folder = args.work / f"{scene}_rig{rig_seed}_scale{image_scale:g}"
        self.words = ["--scenario", SCENARIO, "--scene", scene, "--scene-seed", args.scene_seed, "--rig", "random",
                      "--rig-seed", rig_seed, "--seed", 1000 + rig_seed, "--image-scale", image_scale, "--image-step",
                      args.image_step, "--duration-s", args.duration_s]
        simulate(self.folder, [*self.words, "--noise", "off"])
        self.truth = self.folder / "rig_truth.yaml"

    def read(self, name, *words):
        """The drive with noise and whatever the words ask for, in a folder of its own."""
        folder = self.folder / name
        simulate(folder, [*self.words, "--images-from", self.folder / "drive.bag", *words])
        return folder


def calibrate(folder, rig, *words, tool="calibrate_rig", name="rig"):
    """Calibrates; the verdict, its reasons, errors against the truth where there is a rig, and times."""
    output = folder / f"{name}.yaml"
    output.unlink(missing_ok=True)
    say(f"{folder}: {tool} {name}")
    log = folder / f"{name}.log"
    timed = run([TOOLS / "vcharge_calibration" / tool, "--bag", folder / "drive.bag", "--rig", rig, "--output", output,
                 "--options", ROOT / "config" / OPTIONS[tool], *words], log, may_fail=True)
    (folder / f"{name}.txt").write_text(timed["output"])
    lines = timed["output"].splitlines()
    verdict = next((i for i, line in enumerate(lines) if line in ("PASS", "WARN", "FAIL")), None)
    result = {"verdict": "none" if verdict is None else lines[verdict],
              "remarks": [line.strip() for line in lines[verdict + 1:]] if verdict is not None else
              log.read_text().strip().splitlines()[-1:],
              "wall_s": timed["wall_s"], "cpu_s": timed["cpu_s"], "output": timed["output"], "errors": None,
              "has_rig": output.exists()}
    stages = re.findall(r"([a-z ]+) ([0-9.]+) s; ", timed["output"])
    result["stages"] = {stage.strip(): float(seconds) for stage, seconds in stages}
    if output.exists():
        report = folder / f"{name}_errors.json"
        run([TOOLS / "vcharge_evaluation" / "evaluate_rig", "--estimate", output, "--truth", folder / "rig_truth.yaml",
             "--json", report], folder / f"{name}_errors.log")
        result["errors"] = json.loads(report.read_text())
    return result


def sizes(errors, kind):
    """Metres and degrees of each camera."""
    return [(float(np.linalg.norm(camera["error_m"])), DEGREES * float(np.linalg.norm(camera["error_rad"])))
            for camera in errors[kind]]


def normalized_squares(results, kind="without_scale"):
    """Mean normalized squared error of each degree of freedom over all cameras of all results."""
    rows = [camera["normalized"] for result in results if result["errors"] for camera in result["errors"][kind]]
    return np.mean(np.square(np.array(rows)), axis=0) if rows else np.full(len(AXES), np.nan)


def table(title, headings, rows):
    print(f"\n### {title}\n\n| " + " | ".join(headings) + " |\n|" + "---|" * len(headings))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    sys.stdout.flush()


def accuracy_row(name, result):
    if result["errors"] is None:
        return [name, result["verdict"], "-", "-", "-", "-", "; ".join(result["remarks"][:1])]
    as_is, scaled = sizes(result["errors"], "as_is"), sizes(result["errors"], "without_scale")
    return [name, result["verdict"], ", ".join(f"{100 * shift:.2f}" for shift, _ in as_is),
            ", ".join(f"{turn:.3f}" for _, turn in as_is), ", ".join(f"{100 * shift:.2f}" for shift, _ in scaled),
            f"{100 * (result['errors']['scale'] - 1):+.3f} %",
            f"{result['wall_s']:.0f} s, {result['cpu_s']:.0f} s of processor"]


def judge(results):
    cameras = [size for result in results if result["errors"] for size in sizes(result["errors"], "as_is")]
    missing = sum(result["errors"] is None for result in results)
    good = [shift <= MAX_SHIFT_M and turn <= MAX_TURN_DEG for shift, turn in cameras]
    far = sum(shift > 2 * MAX_SHIFT_M or turn > 2 * MAX_TURN_DEG for shift, turn in cameras)
    total = len(cameras) + 4 * missing
    share = sum(good) / max(1, total)
    squares = normalized_squares(results)
    rows = [("cameras within 0.05 degrees and 1 cm", ">= 95 %", f"{sum(good)} of {total}", mark(share >= 0.95)),
            ("cameras beyond twice that, or without result", "0", far + 4 * missing, mark(far + missing == 0))]
    rows += [(f"mean normalized squared error, {axis}", "0.3 to 2.5", f"{square:.2f}", mark(0.3 <= square <= 2.5))
             for axis, square in zip(AXES, squares)]
    return rows


ACCURACY = ("drive", "verdict", "errors (cm)", "errors (degrees)", "without the common scale (cm)", "scale", "time")
JUDGED = ("line", "goal", "figure", "")


def evaluate_rigs(args):
    results, rows = [], []
    for entry in args.rigs:
        scene, rig_seed = entry.split(":")
        drive = Drive(args, scene, int(rig_seed), args.image_scale)
        folder = drive.read("right_wheels", *RIGHT_WHEELS)
        result = calibrate(folder, folder / "rig_truth.yaml", "--report", folder / "report", "--map", folder / "lot.vmap")
        results.append(result)
        rows.append(accuracy_row(f"{scene}, rig {rig_seed}", result))
    table(f"Rigs, image scale {args.image_scale:g}", ACCURACY, rows)
    stages = sorted({stage for result in results for stage in result["stages"]})
    table("Wall time by stage (s)", ("stage", *args.rigs),
          [[stage, *(f"{result['stages'].get(stage, 0):.1f}" for result in results)] for stage in stages])
    table("Rigs: judged", JUDGED, judge(results))


def evaluate_seeds(args):
    scene, rig_seed = args.rigs[0].split(":")
    drive = Drive(args, scene, int(rig_seed), 0.5)
    results, rows = [], []
    for seed in range(1, args.seeds + 1):
        folder = drive.read(f"seed{seed}", *RIGHT_WHEELS, "--sensor-seed", seed)
        results.append(calibrate(folder, folder / "rig_truth.yaml"))
        rows.append(accuracy_row(f"{scene}, rig {rig_seed}, seed {seed}", results[-1]))
        (folder / "drive.bag").unlink()
        (folder / "simulated.txt").unlink()
    table("Seeds, half size", ACCURACY, rows)
    table("Seeds: judged", JUDGED, judge(results))


def evaluate_wheels(args):
    scene, rig_seed = args.rigs[0].split(":")
    drive = Drive(args, scene, int(rig_seed), 0.5)
    rows = []
    for scale_error in (0.0, 0.003, -0.003):
        folder = drive.read(f"wheels{scale_error:g}", "--set", f"odometer.scale_error={scale_error}", "--set",
                            "odometer.left_right_error=0.0002")
        rows.append(accuracy_row(f"wheels {100 * scale_error:+.1f} %", calibrate(folder, folder / "rig_truth.yaml")))
    table("Common wheel error, half size", ACCURACY, rows)


def evaluate_map(args):
    """The second rig in the map of the first, whose odometer counts 0.2 % more."""
    (scene, first), (_, second) = (entry.split(":") for entry in args.rigs[:2])
    mapper = Drive(args, scene, int(first), args.image_scale)
    mapped = mapper.read("map_wheels", "--set", "odometer.scale_error=0.002", "--set", "odometer.left_right_error=0.0002")
    built = calibrate(mapped, mapped / "rig_truth.yaml", "--map", mapped / "lot.vmap")
    drive = Drive(args, scene, int(second), args.image_scale)
    folder = drive.read("right_wheels", *RIGHT_WHEELS)
    result = calibrate(folder, folder / "rig_truth.yaml", "--map", mapped / "lot.vmap", "--report",
                       folder / "map_report", tool="calibrate_rig_from_map", name="rig_from_map")
    table("In a map of another rig with another odometer's scale", ACCURACY,
          [accuracy_row(f"the map's rig {first}, wheels +0.2 %", built),
           accuracy_row(f"rig {second} in its map", result)])
    rows = judge([result])
    rows.append(("time, against the drive's", f"< {args.duration_s:.0f} s", f"{result['wall_s']:.0f} s",
                 mark(result["wall_s"] < args.duration_s)))
    table("In a map: judged", JUDGED, rows)


def rewrite(source, target, change):
    with rosbag.Bag(str(source)) as bag, rosbag.Bag(str(target), "w") as output:
        for topic, message, stamp in bag.read_messages():
            for name, changed in change(topic, message):
                output.write(name, changed, stamp)


def with_negative(field):
    """Odometry of a wheel counter or a gyro that was wired the wrong way round."""
    state = {"last": None, "yaw": 0.0, "x": 0.0, "y": 0.0}

    def change(topic, message):
        if topic != "/odom":
            return [(topic, message)] if topic != "/wheel_ticks" else []
        pose = message.pose.pose
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        x, y = pose.position.x, pose.position.y
        if state["last"] is not None:
            last_x, last_y, last_yaw = state["last"]
            turn = math.remainder(yaw - last_yaw, 2.0 * math.pi)
            middle = last_yaw + 0.5 * turn
            length = (x - last_x) * math.cos(middle) + (y - last_y) * math.sin(middle)
            turn, length = (-turn, length) if field == "turn" else (turn, -length)
            state["x"] += length * math.cos(state["yaw"] + 0.5 * turn)
            state["y"] += length * math.sin(state["yaw"] + 0.5 * turn)
            state["yaw"] += turn
        state["last"] = (x, y, yaw)
        message = copy.deepcopy(message)
        message.pose.pose.position.x, message.pose.pose.position.y = state["x"], state["y"]
        message.pose.pose.orientation.z = math.sin(0.5 * state["yaw"])
        message.pose.pose.orientation.w = math.cos(0.5 * state["yaw"])
        return [(topic, message)]

    return change


def evaluate_faults(args):
    scene, rig_seed = args.rigs[0].split(":")
    drive = Drive(args, scene, int(rig_seed), 0.5)
    rows = []

    def add(name, goal, result):
        figure = result["verdict"] + ("" if not result["remarks"] else ": " + "; ".join(result["remarks"][:2]))
        if result["errors"]:
            shift, turn = (max(values) for values in zip(*sizes(result["errors"], "as_is")))
            figure += f" (at most {100 * shift:.1f} cm, {turn:.3f} degrees off)"
        rows.append((name, goal, figure, mark(result["verdict"] in goal and
                                              result["has_rig"] == (result["verdict"] != "FAIL"))))

    for name, words, goal in (
            ("20 % of the images dropped", ["faults.dropped_images.cameras=[all]", "faults.dropped_images.probability=0.2"],
             "PASS"),
            ("odometer 100 ms late", ["faults.odometry_stamp_shift.shift_s=0.1"], "WARN or FAIL, 100 ms +- 5"),
            ("left camera covered", ["faults.dead_camera.cameras=[left]", "faults.dead_camera.black_images=true"], "FAIL")):
        changes = [word for change in words for word in ("--set", change)]
        folder = drive.read(words[0].split("=")[0].split(".")[1], *RIGHT_WHEELS, *changes)
        result = calibrate(folder, folder / "rig_truth.yaml")
        add(name, goal, result)
    right = drive.read("right", *RIGHT_WHEELS)
    add("nothing wrong", "PASS or WARN", calibrate(right, right / "rig_truth.yaml"))
    wrong = yaml.safe_load((right / "rig_truth.yaml").read_text())
    for key in ("gamma1", "gamma2", "fx", "fy"):
        if key in wrong["cameras"]["left"]["intrinsics"]:
            wrong["cameras"]["left"]["intrinsics"][key] *= 1.05
    (right / "wrong_focal.yaml").write_text(yaml.safe_dump(wrong, sort_keys=False))
    add("left focal length 5 % too long", "FAIL", calibrate(right, right / "wrong_focal.yaml", name="rig_wrong_focal"))
    for field in ("turn", "distance"):
        folder = right / f"negative_{field}"
        folder.mkdir(exist_ok=True)
        rewrite(right / "drive.bag", folder / "drive.bag", with_negative(field))
        add(f"odometer's {field} with the wrong sign", "FAIL", calibrate(folder, right / "rig_truth.yaml"))
        (folder / "drive.bag").unlink()
    for name in ("straight", "standing"):
        folder = args.work / name
        simulate(folder, ["--drive", name, "--image-scale", 0.5, "--image-step", args.image_step, "--duration-s", 12])
        add(f"{name} only", "FAIL", calibrate(folder, folder / "rig_truth.yaml"))
    table("Spoiled drives, half size", JUDGED, rows)


def evaluate_real(args):
    """The published images: too short and straight for a rig, but the direction of travel can be compared."""
    folder = args.work / "real"
    folder.mkdir(parents=True, exist_ok=True)
    if "VCHARGE_DATA" not in os.environ:
        say("real images: skipped, VCHARGE_DATA is not set")
        return
    data = pathlib.Path(os.environ["VCHARGE_DATA"]) / "vcharge_left"
    given = folder / "given.yaml"
    run([TOOLS / "vcharge_ros" / "import_vcharge_images", "--folder", data, "--output", folder / "drive.bag", "--rig",
         given], folder / "import.log")
    result = calibrate(folder, given)
    cameras = yaml.safe_load(given.read_text())["cameras"]
    rows = [("verdict", "FAIL, no turn", f"{result['verdict']}: {'; '.join(result['remarks'][:1])}",
             mark(result["verdict"] == "FAIL" and "no turn" in " ".join(result["remarks"])))]
    for name, axis, pattern, limit in (("direction of travel", 0, r"straight ahead is \((\S+), (\S+), (\S+)\)", 0.5),
                                       ("ground's normal", 2, r"upwards is \((\S+), (\S+), (\S+)\)", 1.0)):
        found = re.search(pattern, result["output"])
        if not found:
            rows.append((f"{name} against the calibration given there", f"<= {limit} degrees", "not told", mark(False)))
            continue
        # The vehicle's axis in the camera's frame.
        turn = rotations(np.array([next(iter(cameras.values()))["vehicle_from_camera"]["rotation_xyzw"]]))[0]
        seen = np.array([float(value.rstrip(",")) for value in found.groups()])
        angle = DEGREES * math.atan2(float(np.linalg.norm(np.cross(seen, turn[axis]))), float(seen @ turn[axis]))
        rows.append((f"{name} against the calibration given there", f"<= {limit} degrees", f"{angle:.2f} degrees",
                     mark(angle <= limit)))
    table("Real images", JUDGED, rows)


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    for part in args.parts:
        globals()[f"evaluate_{part}"](args)


if __name__ == "__main__":
    main()
