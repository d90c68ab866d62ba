"""Extrinsic calibration: accuracy by rig and by noise, consistency of its covariances, time, the influence of wheel
errors, calibration in a map, verdicts on spoiled drives, and the published images."""
import argparse
import math

import cv2
import numpy as np
import yaml

import vcharge
from vcharge_evaluation import spoiled_drives
from vcharge_evaluation.chain.figures import judge_rig as judge_and_draw_rig
from vcharge_evaluation.drives import MAX_TIMED_RATIO, TIMINGS
from vcharge_evaluation.live import rig_calibration as live_rig_calibration
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, import_published_images, judge_rig, run_tool, say, simulate

MAX_ROTATION_DEG, MAX_TRANSLATION_M = 0.05, 0.01
AXES = ("forwards", "sideways", "height", "roll", "pitch", "yaw")
SCENARIO = CONFIG / "scenarios" / "calibration_figure_eight.yaml"
USUAL_WHEELS = ("--set", "odometer.scale_error=0.0005", "--set", "odometer.left_right_error=0.0002")
OPTIONS = {"calibrate_rig": "calibration.yaml", "calibrate_rig_from_map": "calibration_in_map.yaml"}
PARTS = ("rigs", "live", "kinds", "heat", "shutters", "seeds", "wheels", "map", "faults", "real")
# What heat does to lenses: focal lengths, relative, and principal points over the image's width.
HEAT_FOCAL, HEAT_SHIFT = 0.002, 0.001
# Cameras of the rig `eight` that are calibrated together, of three camera models.
KINDS = {"one camera": ["front"], "two without a common view": ["left", "right"],
         "two pinhole cameras and a fisheye": ["roof", "rear", "left_pillar"],
         "six": ["front", "left", "rear", "right", "roof", "trailer"],
         "eight": ["front", "left", "rear", "right", "roof", "trailer", "left_pillar", "right_pillar"]}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "calibration_evaluation")
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--rigs", nargs="*", default=["lot:71:11", "lot:71:12", "garage:71:13", "garage:71:14"],
                        help="scene:seed:rig-seed of each random rig")
    parser.add_argument("--image-scale", type=float, default=1.0, help="image size of the rigs' drives over 1280x800")
    parser.add_argument("--image-step", type=int, default=2,
                        help="use every n-th of 12.5 images a second: 2 gives 500 frames in 80 s")
    parser.add_argument("--duration-s", type=float, default=80.0)
    parser.add_argument("--timings", nargs="*", default=[one.name for one in TIMINGS], choices=[one.name for one in TIMINGS],
                        help="of the part shutters")
    parser.add_argument("--seeds", type=int, default=10, help="number of noise seeds, on one drive of half-size images")
    return parser.parse_args()


class Drive:
    """A drive that was rendered without noise; read() adds noise and faults to it."""

    def __init__(self, args, rig, image_scale, kind="random"):
        scene, seed, rig_seed = rig.split(":")
        self.folder = args.work / f"{scene}{seed}_rig{rig_seed}_{kind}_scale{image_scale:g}"
        self.words = ["--scenario", SCENARIO, "--scene", scene, "--scene-seed", seed, "--rig", kind, "--rig-seed",
                      rig_seed, "--seed", 1000 + int(rig_seed), "--image-scale", image_scale, "--image-step",
                      args.image_step, "--duration-s", args.duration_s]
        simulate(self.folder, [*self.words, "--noise", "off"])

    def read(self, name, *words):
        folder = self.folder / name
        simulate(folder, [*self.words, "--images-from", self.folder / "drive.bag", *words])
        return folder


class Calibration:
    """A rig that a tool calibrated, with its errors where it wrote one."""

    def __init__(self, folder, rig, *words, tool="calibrate_rig", name="rig", truth=None, options=None):
        self.output = folder / f"{name}.yaml"
        self.output.unlink(missing_ok=True)
        say(f"{folder}: {tool} {name}")
        self.run = run_tool(tool, folder / f"{name}.log", "--bag", folder / "drive.bag", "--rig", rig, "--output",
                            self.output, "--options", options or CONFIG / OPTIONS[tool], *words, may_fail=True)
        self.verdict = self.run.found.get("verdict", "none")
        self.remarks = self.run.found.get("remarks") or [self.run.error() or ""]
        self.stage_s = self.run.found.get("stage_s", {})
        self.has_rig = self.output.exists()
        self.errors = judge_rig(self.output, truth or folder / "rig_truth.yaml", folder / f"{name}_errors.json") if (
            self.has_rig) else None

    def sizes(self, kind="as_is"):
        """Translation (m) and rotation error (degrees) of each camera."""
        return [(float(np.linalg.norm(camera["error_m"])), math.degrees(np.linalg.norm(camera["error_rad"])))
                for camera in self.errors[kind]] if self.errors else []

    def figures(self):
        yield Figure("verdict", self.verdict)
        if self.errors is None:
            yield Figure("reason", "; ".join(self.remarks[:1]))
            return
        yield Figure("largest translation error", 100 * max(shift for shift, _ in self.sizes()), "cm")
        yield Figure("largest rotation error", max(turn for _, turn in self.sizes()), "degrees")
        yield Figure("largest translation error without the common scale",
                     100 * max(shift for shift, _ in self.sizes("without_scale")), "cm")
        yield Figure("error of the common scale", 100 * (self.errors["scale"] - 1), "%")
        yield Figure("wall time", self.run.wall_s, "s")
        yield Figure("processor time", self.run.cpu_s, "s")


def changed_options(**adjustment):
    """The options of calibrate_rig, with others of the adjustment."""
    values = yaml.safe_load((CONFIG / OPTIONS["calibrate_rig"]).read_text())
    values["adjustment"].update(adjustment)
    return values


def judged(calibrations, num_cameras=4):
    """The goals, over all cameras of all calibrations. All cameras count as missed where there is no rig."""
    sizes = [size for one in calibrations for size in one.sizes()]
    missing = num_cameras * sum(one.errors is None for one in calibrations)
    good = sum(shift <= MAX_TRANSLATION_M and turn <= MAX_ROTATION_DEG for shift, turn in sizes)
    far = sum(shift > 2 * MAX_TRANSLATION_M or turn > 2 * MAX_ROTATION_DEG for shift, turn in sizes)
    yield figure("cameras within 0.05 degrees and 1 cm", percent(good, len(sizes) + missing), "%", at_least=95)
    yield figure("cameras beyond twice that, or without result", far + missing, equal=0)
    rows = [camera["normalized"] for one in calibrations if one.errors for camera in one.errors["without_scale"]]
    squares = np.mean(np.square(rows), axis=0) if rows else [None] * len(AXES)
    for axis, square in zip(AXES, squares):
        yield figure(f"mean normalized squared error, {axis}", None if square is None else float(square), at_least=0.5,
                     at_most=2.0)
    # The wheels of most drives here are right, so that other errors show.
    scales = [(one.errors["scale"] - 1) / one.errors["scale_sigma"] for one in calibrations if one.errors]
    yield Figure("mean normalized squared error, common scale", float(np.mean(np.square(scales))) if scales else None)


def evaluate_rigs(args, results):
    calibrations = {}
    for rig in args.rigs:
        folder = Drive(args, rig, args.image_scale).read("right_wheels", *USUAL_WHEELS)
        calibrations[rig] = Calibration(folder, folder / "rig_truth.yaml", "--report", folder / "report", "--map",
                                        folder / "lot.vmap")
    size = f"image scale {args.image_scale:g}"
    results.add(f"Random rigs (scene:seed:rig), {size}", *((rig, one.figures()) for rig, one in calibrations.items()))
    results.add("Wall time by stage", *((rig, [Figure(stage, seconds, "s") for stage, seconds in one.stage_s.items()])
                                        for rig, one in calibrations.items()))
    results.add(f"Random rigs, goals, {size}", (" ".join(args.rigs), judged(calibrations.values())))
    found = {rig: max(shift for shift, _ in one.sizes()) for rig, one in calibrations.items() if one.errors}
    if found:
        worst = max(found, key=found.get)
        folder = calibrations[worst].output.parent
        judge_and_draw_rig(calibrations[worst].output, folder / "rig_truth.yaml", {}, folder, folder / "rig_errors.png")
        results.show(cv2.imread(str(folder / "rig_errors.png")),
                     f"{worst}: largest translation error of a camera {100 * found[worst]:.2f} cm", found[worst])


def evaluate_live(args, results):
    """The nodelet calibrates the first rig while its drive is replayed in real time, and goes on when it has ended."""
    folder = Drive(args, args.rigs[0], args.image_scale).read("right_wheels", *USUAL_WHEELS)
    live = folder / "live"
    after_s, peak_mb, message, *rigs = live_rig_calibration.replay(live, folder / "drive.bag", folder / "rig_truth.yaml")
    figures = [figure("last result after the end of the drive", after_s, "s", at_most=5.0), Figure("told", message),
               Figure("most memory", peak_mb, "MB")]
    for when, rig in zip(("5 s after the end", "at last"), rigs):
        errors = judge_rig(rig, folder / "rig_truth.yaml", live / f"{rig.stem}_errors.json")["without_scale"] if rig else []
        for name, key, factor, unit in (("translation", "error_m", 100.0, "cm"),
                                        ("rotation", "error_rad", math.degrees(1.0), "degrees")):
            sizes = [factor * float(np.linalg.norm(camera[key])) for camera in errors]
            figures.append(Figure(f"largest {name} error {when}", max(sizes, default=None), unit))
    results.add(f"While the drive goes on, image scale {args.image_scale:g}", (args.rigs[0], figures))


def evaluate_kinds(args, results):
    """Rigs of one to eight cameras of all camera models, with and without a common view."""
    folder = Drive(args, args.rigs[0], args.image_scale, "eight").read("right_wheels", *USUAL_WHEELS)
    rig = yaml.safe_load((folder / "rig_truth.yaml").read_text())
    columns = []
    for number, (kind, cameras) in enumerate(KINDS.items()):
        part = folder / f"rig_{number}.yaml"
        part.write_text(yaml.safe_dump({**rig, "cameras": {name: rig["cameras"][name] for name in cameras}}, sort_keys=False))
        one = Calibration(folder, part, name=f"found_{number}", truth=part)
        columns.append((kind, [Figure("cameras", len(cameras)), *one.figures(), *judged([one], len(cameras))]))
    results.add(f"Rigs of other kinds, image scale {args.image_scale:g}", *columns)


def evaluate_heat(args, results):
    """Intrinsics of cold lenses, kept and corrected."""
    columns = []
    for rig in args.rigs:
        folder = Drive(args, rig, args.image_scale).read("right_wheels", *USUAL_WHEELS)
        given, truth, options = folder / "cold.yaml", folder / "rig_truth.yaml", folder / "corrects.yaml"
        options.write_text(yaml.safe_dump(changed_options(refine_intrinsics=True)))
        deviations = spoiled_drives.write_heated_rig(truth, given, HEAT_FOCAL, HEAT_SHIFT * 1280 * args.image_scale)
        kept = Calibration(folder, given, name="rig_cold", truth=truth)
        one = Calibration(folder, given, name="rig_corrected", truth=truth, options=options)
        found = [(camera["image_deviation"], deviations[camera["name"]]) for camera in one.run.found["cameras"]]
        errors = np.array([np.subtract(deviation["values"], true) for deviation, true in found])
        squares = np.square(errors / [deviation["standard_deviations"] for deviation, _ in found]).mean(axis=0)
        columns.append((rig, [
            figure("verdict, intrinsics kept", kept.verdict, equal="WARN"),
            *(Figure(f"{figure_.name}, intrinsics kept", figure_.value, figure_.unit) for figure_ in list(kept.figures())[1:3]),
            *list(one.figures())[:3], Figure("largest error of a focal length", 100 * float(np.abs(errors[:, 0]).max()), "%"),
            Figure("largest error of a principal point", float(np.abs(errors[:, 1:]).max()), "px"),
            *(figure(f"mean normalized squared error, {axis}", float(square), at_least=0.5, at_most=2.0)
              for axis, square in zip(("focal length", "principal point across", "principal point down"), squares))]))
    results.add(f"Focal lengths off by {100 * HEAT_FOCAL:g} %, principal points by {100 * HEAT_SHIFT:g} % of the width, "
                f"image scale {args.image_scale:g}", *columns)


def timing_errors(calibration, timing):
    """Errors (s) of the readout time and the clock offset of each camera, and the same over their standard deviations."""
    found = [camera["timing"] for camera in calibration.run.found["cameras"]]
    errors = np.array([[(-1 if one["readout_direction"] == "up" else 1) * one["readout_s"] - timing.readout_ms / 1000,
                        one["clock_offset_s"]] for one in found])
    return errors, errors / [one["standard_deviations"] for one in found]


def timed_figures(args, drive, least, timing):
    """A drive with a timing of which the rig tells nothing but how far stamps may differ, that it tells, and that is found."""
    folder = args.work / f"{drive.folder.name}_{timing.name.replace(', ', '_').replace(' ', '_')}"
    simulate(folder, [*drive.words, *USUAL_WHEELS, *timing.words()])
    truth = folder / "rig_truth.yaml"
    options = args.work / "finds_timing.yaml"
    options.write_text(yaml.safe_dump(changed_options(refine_timing=True)))

    def calibrated(name, readout_ms, direction="down", told_options=None):
        rig = spoiled_drives.write_timed_rig(truth, folder / f"{name}.yaml", readout_ms / 1000, direction,
                                             timing.tolerance_ms / 1000)
        return Calibration(folder, rig, name=f"rig_{name}", truth=truth, options=told_options)

    runs = {"given": calibrated("given", timing.readout_ms), "found": calibrated("found", 0, told_options=options)}
    if timing.readout_ms:
        runs["unknown"] = calibrated("unknown", 0)
        yield figure("verdict, timing unknown", runs["unknown"].verdict, equal="WARN")
        misled = calibrated("misled", timing.readout_ms, "up")
        yield figure("verdict, readout in the wrong direction", misled.verdict, equal="WARN")
        yield Figure("told", "; ".join(misled.remarks[:1]))
    for name, one in (("at once", least), *((f"timing {name}", one) for name, one in runs.items())):
        for entry in list(one.figures())[1:3]:
            yield Figure(f"{entry.name}, {name}", entry.value, entry.unit)
    both = runs["given"].errors and least.errors
    for entry, at_once in zip(list(runs["given"].figures())[1:3], list(least.figures())[1:3]):
        yield figure(f"{entry.name}, given over at once", entry.value / at_once.value if both else None, at_most=MAX_TIMED_RATIO)
    if not runs["found"].has_rig:
        return
    errors, over_sigmas = timing_errors(runs["found"], timing)
    for i, axis in enumerate(("readout time", "clock offset")):
        yield figure(f"largest error of a {axis}", 1000 * float(np.abs(errors[:, i]).max()), "ms", at_most=0.5)
        yield figure(f"mean normalized squared error, {axis}", float(np.square(over_sigmas[:, i]).mean()), at_least=0.5,
                     at_most=2.0)
    relative = errors[:, 1] - errors[:, 1].mean()
    yield figure("largest error of a clock offset against the other cameras", 1000 * float(np.abs(relative).max()), "ms",
                 at_most=0.5)


def evaluate_shutters(args, results):
    """Rolling shutters, and cameras without a common trigger."""
    for rig in args.rigs:
        drive = Drive(args, rig, args.image_scale)
        sound = drive.read("right_wheels", *USUAL_WHEELS)
        least = Calibration(sound, sound / "rig_truth.yaml")
        for timing in (one for one in TIMINGS if one.name in args.timings):
            results.add(f"Timing, image scale {args.image_scale:g}",
                        (f"{rig}, {timing.name}", list(timed_figures(args, drive, least, timing))))


def evaluate_seeds(args, results):
    drive = Drive(args, args.rigs[0], 0.5)
    calibrations = []
    for seed in range(1, args.seeds + 1):
        folder = drive.read(f"seed{seed}", *USUAL_WHEELS, "--sensor-seed", seed)
        calibrations.append(Calibration(folder, folder / "rig_truth.yaml"))
        (folder / "drive.bag").unlink()
        (folder / "simulated.txt").unlink()
    results.add("Noise seeds, goals, half-size images", (f"{args.rigs[0]}, {args.seeds} seeds", judged(calibrations)))


def evaluate_wheels(args, results):
    drive = Drive(args, args.rigs[0], 0.5)
    columns = []
    for scale_error in (0.0, 0.003, -0.003):
        folder = drive.read(f"wheels{scale_error:g}", "--set", f"odometer.scale_error={scale_error}", "--set",
                            "odometer.left_right_error=0.0002")
        columns.append((f"wheels {100 * scale_error:+.1f} %", Calibration(folder, folder / "rig_truth.yaml").figures()))
    results.add("Common error of the wheels, half-size images", *columns)


def evaluate_map(args, results):
    """Calibrates the second rig in the map of the first, whose odometer counts 0.2 % more."""
    first, second = args.rigs[:2]
    mapped = Drive(args, first, args.image_scale).read(
        "map_wheels", "--set", "odometer.scale_error=0.002", "--set", "odometer.left_right_error=0.0002")
    built = Calibration(mapped, mapped / "rig_truth.yaml", "--map", mapped / "lot.vmap")
    folder = Drive(args, second, args.image_scale).read("right_wheels", *USUAL_WHEELS)
    result = Calibration(folder, folder / "rig_truth.yaml", "--map", mapped / "lot.vmap", "--report",
                         folder / "map_report", tool="calibrate_rig_from_map", name="rig_from_map")
    results.add("In a map of another rig with another odometer scale", (f"{first}, builds the map", built.figures()),
                (f"{second}, in this map", result.figures()))
    results.add("In a map, goals", (second, [
        *judged([result]), figure("wall time over the drive's", result.run.wall_s / args.duration_s, at_most=1.0)]))


def evaluate_faults(args, results):
    drive = Drive(args, args.rigs[0], 0.5)

    def verdict(name, goals, one):
        right = one.verdict in goals and one.has_rig == (one.verdict != "FAIL")
        return Figure(name, f"{one.verdict}: {'; '.join(one.remarks[:2])}", "", " or ".join(goals), right)

    figures = []
    for name, changes, goals in (
            ("20 % of the images dropped", ["dropped_images.cameras=[all]", "dropped_images.probability=0.2"], ["PASS"]),
            ("odometer 100 ms late", ["odometry_stamp_shift.shift_s=0.1"], ["WARN", "FAIL"]),
            ("left camera covered", ["dead_camera.cameras=[left]", "dead_camera.black_images=true"], ["FAIL"]),
            ("cables of left and right exchanged", ["swapped_cameras.cameras=[left, right]"], ["FAIL"])):
        words = [word for change in changes for word in ("--set", f"faults.{change}")]
        folder = drive.read(changes[0].split(".")[0], *USUAL_WHEELS, *words)
        figures.append(verdict(name, goals, Calibration(folder, folder / "rig_truth.yaml")))
    knocked = args.work / "knocked_twice"
    simulate(knocked, [*drive.words, *USUAL_WHEELS, "--set", "faults.bumped_camera.cameras=[left]", *(
        word for key, value in (("start_s", 25), ("end_s", 50), ("rotation_rad", [0.0, 0.01, 0.0]))
        for word in ("--set", f"faults.bumped_camera.{key}={value}"))])
    figures.append(verdict("left camera knocked by 0.6 degrees, and back", ["WARN", "FAIL"],
                           Calibration(knocked, knocked / "rig_truth.yaml")))
    sound = drive.read("right", *USUAL_WHEELS)
    truth = sound / "rig_truth.yaml"
    figures.append(verdict("no fault", ["PASS", "WARN"], Calibration(sound, truth)))
    spoiled_drives.write_wrong_focal(truth, sound / "wrong_focal.yaml")
    figures.append(verdict("left focal length 5 % too long", ["FAIL"],
                           Calibration(sound, sound / "wrong_focal.yaml", name="rig_wrong_focal")))
    for field in ("turn", "distance"):
        folder = sound / f"negative_{field}"
        folder.mkdir(exist_ok=True)
        spoiled_drives.write_negative_odometry(sound / "drive.bag", folder / "drive.bag", field)
        figures.append(verdict(f"odometer's {field} with the wrong sign", ["FAIL"], Calibration(folder, truth)))
        (folder / "drive.bag").unlink()
    for name in ("straight", "standing"):
        folder = args.work / name
        simulate(folder, ["--drive", name, "--image-scale", 0.5, "--image-step", args.image_step, "--duration-s", 12])
        figures.append(verdict(f"{name} only", ["FAIL"], Calibration(folder, folder / "rig_truth.yaml")))
    results.add("Spoiled drives, half-size images", (args.rigs[0], figures))


def evaluate_real(args, results):
    """The published images: too short and straight for a rig, but the direction of travel can be compared."""
    folder = args.work / "real"
    if not import_published_images(folder):
        return
    given = folder / "rig.yaml"
    one = Calibration(folder, given, name="calibrated")
    camera = next(iter(vcharge.read_rig(given)))
    camera_from_vehicle = camera.vehicle_from_camera[:3, :3].T
    found = next(iter(one.run.found.get("cameras", [])), {})
    figures = [figure("verdict", one.verdict, equal="FAIL")]
    for name, axis, key, limit in (("direction of travel", 0, "travel_in_camera", 0.5),
                                   ("ground's normal", 2, "up_in_camera", 1.0)):
        seen, wanted = np.array(found.get(key) or [0, 0, 0], float), camera_from_vehicle[:, axis]
        angle = math.degrees(math.atan2(np.linalg.norm(np.cross(seen, wanted)), seen @ wanted)) if seen.any() else None
        figures.append(figure(f"{name} against the published calibration", angle, "degrees", at_most=limit))
    results.add("Published images", ("one camera", figures))


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("calibration", "Extrinsic calibration", args)
    for part in args.parts:
        globals()[f"evaluate_{part}"](args, results)
    results.end()


if __name__ == "__main__":
    main()
