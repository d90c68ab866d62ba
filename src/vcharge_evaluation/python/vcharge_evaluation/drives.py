"""Simulated drives that several stages share, and what is made from them once: the masks of the car's own body, and maps."""
import hashlib
import shutil

import yaml

from vcharge_evaluation.tools import CONFIG, run_tool_once, simulate

SCENARIOS = CONFIG / "scenarios"
# Scenes whose loop is long enough for masks of the own body; elsewhere the same car's masks come from the lot.
MASK_SCENES = ("lot", "garage", "two_levels")
# The loop of a scene at noon, from which come its masks, its height map and the map for other days.
LOOP_S, LOOP_STEP, HEIGHT_CELL_M = 24, 2, 0.025


class Drive:
    """A simulated drive with its folder WORK/drives/NAME_HASH, where the hash is that of the words that make the drive."""

    def __init__(self, work, name, *words):
        words = [str(word) for word in words]
        key = hashlib.sha1(" ".join(words).encode()).hexdigest()[:8]
        self.folder = work / "drives" / f"{name}_{key}"
        simulate(self.folder, words)
        self.bag, self.truth = self.folder / "drive.bag", self.folder / "drive_truth"
        self.trajectory, self.true_rig = self.truth / "trajectory.tum", self.folder / "rig_truth.yaml"

    def map(self, rig):
        """Sparse map and trajectory of build_map with a rig file, and its run."""
        run = run_tool_once("build_map", self.folder / "map.log", "--bag", self.bag, "--rig", rig, "--output",
                            self.folder / "map.vmap", "--trajectory", self.folder / "map.tum", "--options",
                            CONFIG / "mapping.yaml")
        return self.folder / "map.vmap", self.folder / "map.tum", run


def loop_drive(work, scene, seed, scale, duration_s=LOOP_S, words=()):
    """The loop of a scene at noon. `words` choose another car."""
    return Drive(work, f"{scene}_loop", "--scene", scene, "--drive", "loop", "--scene-seed", seed, "--seed", seed,
                 "--image-scale", scale, "--image-step", LOOP_STEP, "--duration-s", duration_s, "--height-cell-m",
                 HEIGHT_CELL_M, *words)


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
        self.verdict = self.run.found.get("verdict") or self.run.error()
        self.rig = None if self.run.error() or self.verdict == "FAIL" or not output.exists() else output

    def text(self):
        """What a row of the results says about masks."""
        return f"make_masks: {self.verdict}" + ("" if self.rig else "; without masks")

    def rig_of(self, drive):
        """A drive's rig file with its true calibration and the found masks in place of the true ones, which only judge."""
        return write_masked_rig(drive.true_rig, self.rig, drive.folder / "rig_found_masks.yaml")


def write_masked_rig(true_rig, masked_rig, path):
    """Writes the true rig with the masks of another rig file of the same cameras; None: without masks. Returns `path`."""
    rig = yaml.safe_load(true_rig.read_text())
    found = yaml.safe_load(masked_rig.read_text())["cameras"] if masked_rig else {}
    for name, camera in rig["cameras"].items():
        camera.pop("mask", None)
        mask = found.get(name, {}).get("mask")
        if mask:
            shutil.copyfile(masked_rig.parent / mask, path.parent / f"found_mask_{name}.png")
            camera["mask"] = f"found_mask_{name}.png"
    path.write_text(yaml.safe_dump(rig, sort_keys=False))
    return path


def found_masks(work, scene, seed, scale, words=()):
    """Masks of a car, found in the loop of the scene (or of the lot) with images of this scale."""
    return FoundMasks(loop_drive(work, scene if scene in MASK_SCENES else "lot", seed, scale, words=words))
