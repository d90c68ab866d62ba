"""Simulated drives that several stages share, and what is made from them once: the masks of the car's own body, and maps."""
import dataclasses
import hashlib

import cv2
import numpy as np
import yaml

from vcharge_evaluation.tools import CONFIG, run_tool_once, simulate

SCENARIOS = CONFIG / "scenarios"
# A car's masks come once from the loop of the scene with this seed; elsewhere those of the same car from the lot serve.
MASK_SEEDS = {"lot": 201, "garage": 211}
# The loop of a scene at noon, from which come its masks, its height map and the map for other days.
LOOP_S, LOOP_STEP, HEIGHT_CELL_M = 24, 2, 0.025
CONDITIONS = ("noon", "dusk", "wet")
MASK_SCALE = 0.4  # image size, over 1280x800, of the drives in which masks are found
# Another day's drive, that of the chain too: other light, moved cars, other errors of the wheels.
OTHER_DAY = ("--drive", "other_day", "--exposure-gain", 1.2, "--set", "odometer.scale_error=-0.0005", "--set",
             "odometer.left_right_error=0.0003")


class Drive:
    """A simulated drive with its folder WORK/drives/NAME_HASH, where the hash is that of the words that make the drive."""

    def __init__(self, work, name, *words):
        words = [f"{word:g}" if isinstance(word, float) else str(word) for word in words]
        key = hashlib.sha1(" ".join(words).encode()).hexdigest()[:8]
        self.folder = work / "drives" / f"{name}_{key}"
        simulate(self.folder, words)
        self.bag, self.truth = self.folder / "drive.bag", self.folder / "drive_truth"
        self.trajectory, self.true_rig = self.truth / "trajectory.tum", self.folder / "rig_truth.yaml"

    def map(self, rig, name="map"):
        """Sparse map and trajectory of build_map with a rig file, and its run, which may have failed."""
        path, trajectory = self.folder / f"{name}.vmap", self.folder / f"{name}.tum"
        run = run_tool_once("build_map", self.folder / f"{name}.log", "--bag", self.bag, "--rig", rig, "--output", path,
                            "--trajectory", trajectory, "--options", CONFIG / "mapping.yaml", may_fail=True)
        return path, trajectory, run


def loop_drive(work, scene, seed, scale, duration_s=LOOP_S, words=()):
    """The loop of a scene at noon. `words` choose another car."""
    return Drive(work, f"{scene}_loop", "--scene", scene, "--drive", "loop", "--scene-seed", seed, "--seed", seed,
                 "--image-scale", scale, "--image-step", LOOP_STEP, "--duration-s", duration_s, "--height-cell-m",
                 HEIGHT_CELL_M, *words)


def other_day_drive(work, scene, seed, scale, duration_s, words=()):
    """A drive in a scene on another day, with true ranges. `words` choose another car."""
    # The same words as those of evaluate.sh obstacles, so that the stages share the drive.
    return Drive(work, f"{scene}_other_day", "--scene", scene, *OTHER_DAY, "--scene-seed", seed, "--seed", seed + 400,
                 "--image-scale", scale, "--duration-s", duration_s, "--truth-range", *words)


def scenario_drive(work, name, seed, scale, duration_s, words=()):
    """A drive of config/scenarios with true ranges. `words` change the scenario."""
    return Drive(work, name, "--scenario", SCENARIOS / f"{name}.yaml", "--scene-seed", seed, "--seed", seed + 2, "--image-scale",
                 scale, "--duration-s", duration_s, "--truth-range", *words)


def shutter_words(readout_ms):
    """Words that give all cameras of a drive a rolling shutter from top to bottom; none for 0."""
    return ("--set", "faults.rolling_shutter.cameras=[all]", "--set",
            f"faults.rolling_shutter.readout_time_s={readout_ms / 1000}") if readout_ms else ()


def trigger_words(shifts_ms):
    """Words that let cameras expose after the others, by these times; none for {}."""
    names, values = ", ".join(shifts_ms), ", ".join(f"{shift / 1000:g}" for shift in shifts_ms.values())
    return ("--set", f"faults.image_stamp_shift.cameras=[{names}]", "--set", f"faults.image_stamp_shift.shifts_s=[{values}]",
            "--set", "faults.image_stamp_shift.moves_exposure=true") if shifts_ms else ()


@dataclasses.dataclass(frozen=True)
class Timing:
    """Of all cameras of a drive."""
    name: str
    readout_ms: float = 0
    shifts_ms: tuple = ()  # of (camera, time after the others)
    tolerance_ms: float = 0

    def words(self):
        """Words that give a drive this timing."""
        return (*shutter_words(self.readout_ms), *trigger_words(dict(self.shifts_ms)))


AT_ONCE = Timing("at once")
MAX_TIMED_RATIO = 1.3  # of an error with a timing that the rig tells, to that of a drive exposed at once
FREE = (("left", 20), ("rear", -30), ("right", 37))
TIMINGS = (Timing("readout 10 ms", 10), Timing("readout 25 ms", 25),
           Timing("left and right 7 ms later", 0, (("left", 7), ("right", 7)), 10),
           Timing("free-running", 0, FREE, 40), Timing("free-running, readout 25 ms", 25, FREE, 40))


def condition_words(condition):
    """Words that put a drive into a light and weather of CONDITIONS; none at noon."""
    return () if condition == "noon" else ("--set", f"condition.kind={condition}")


def scene_and_drive(name):
    """Scene and drive that a scenario names, or their defaults."""
    scenario = yaml.safe_load((SCENARIOS / f"{name}.yaml").read_text())
    return scenario.get("scene", "lot"), scenario.get("drive", "short")


class FoundMasks:
    """Masks of the own body that make_masks finds in a drive: its verdict, and its rig file or None."""

    def __init__(self, drive):
        truth = yaml.safe_load(drive.true_rig.read_text())
        cameras = {name: {key: value for key, value in camera.items() if key not in ("mask", "vehicle_from_camera")}
                   for name, camera in truth["cameras"].items()}
        source = drive.folder / "cameras.yaml"
        source.write_text(yaml.safe_dump({**truth, "cameras": cameras}, sort_keys=False))
        output = drive.folder / "masked" / "cameras.yaml"
        self.run = run_tool_once("make_masks", drive.folder / "make_masks.log", "--bag", drive.bag, "--rig", source,
                                 "--output", output, may_fail=True)
        self.verdict = self.run.found.get("verdict") or self.run.reason()
        self.rig = None if self.run.error() or self.verdict == "FAIL" or not output.exists() else output

    def text(self):
        """What a row of the results says about masks."""
        return f"make_masks: {self.verdict}" + ("" if self.rig else "; without masks")

    def rig_of(self, folder):
        """Rig file of a drive in a folder: the true calibration, with the found masks in place of the true ones, which only
        judge."""
        return write_masked_rig(folder / "rig_truth.yaml", self.rig, folder / "rig_found_masks.yaml")


def write_masked_rig(true_rig, masked_rig, path):
    """Writes the true rig with the masks of another rig file of the same cameras; None: without masks. Returns `path`."""
    rig = yaml.safe_load(true_rig.read_text())
    found = yaml.safe_load(masked_rig.read_text())["cameras"] if masked_rig else {}
    for name, camera in rig["cameras"].items():
        camera.pop("mask", None)
        mask = found.get(name, {}).get("mask")
        if mask:
            camera["mask"] = f"found_mask_{name}.png"
            save_resized(masked_rig.parent / mask, path.parent / camera["mask"], camera["image_size_px"])
    path.write_text(yaml.safe_dump(rig, sort_keys=False))
    return path


def save_resized(mask, path, size_px):
    """Writes a mask in another image size; a pixel that lies on a hidden one to any part is hidden."""
    pixels = cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE)
    if pixels.shape[::-1] != tuple(size_px):
        whole = cv2.resize(pixels, tuple(size_px), interpolation=cv2.INTER_AREA)
        pixels = np.where(whole == 255, 255, 0).astype(np.uint8)
    cv2.imwrite(str(path), pixels)


def found_masks(work, scene, words=()):
    """Masks of a car, found in a loop of the scene (or of the lot). `words` choose another car."""
    scene = scene if scene in MASK_SEEDS else "lot"
    return FoundMasks(loop_drive(work, scene, MASK_SEEDS[scene], MASK_SCALE, words=words))


def scenario_with_masks(args, name, seed, words=()):
    """A drive of config/scenarios as a stage's arguments want it (work, image_scale, duration_s), and its car's masks."""
    drive = scenario_drive(args.work, name, seed, args.image_scale, args.duration_s, words)
    return drive, found_masks(args.work, scene_and_drive(name)[0])
