"""Parking bays: how many of those that a drive passes are found, how far their corners are off, and whether they are free; and
whether a drive on another day tells which of the found ones are free then."""
import argparse

import cv2
import numpy as np

import vcharge
from vcharge_evaluation.drawing.obstacles import read_yaml
from vcharge_evaluation.drives import CONDITIONS, LOOP_STEP, Drive, condition_words
from vcharge_evaluation.gaps import gap_figures
from vcharge_evaluation.living_map import OTHER_DAY
from vcharge_evaluation.localization_errors import Map
from vcharge_evaluation.obstacles import detect_obstacles
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, run_tool, say

REACH_M = 8.0  # a drive passes a bay if it comes this near to its entry, from in front
IN_FRONT = 0.5  # cosine of the largest angle to the entry's normal
SAME_BAY = 0.5  # area in common over that of both


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "bay_evaluation")
    parser.add_argument("--drives", nargs="*", default=["lot:201", "garage:211"], metavar="SCENE:SEED")
    parser.add_argument("--conditions", nargs="*", default=["noon"], choices=CONDITIONS, help="of lots")
    parser.add_argument("--image-scale", type=float, default=0.5)
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the drives early; 0: whole loops")
    parser.add_argument("--live-s", type=float, default=60.0, help="length of the drives of another day through lots; 0: none")
    return parser.parse_args()


class Bay:
    def __init__(self, bay, mapped=None):
        self.kind, self.state, self.corners = bay.kind, bay.state, bay.corners_m
        self.sigmas = np.array([bay.entry_sigma_m] * 2 + [bay.end_sigma_m] * 2)
        if mapped is not None:
            flat = np.column_stack([self.corners, np.full(4, mapped.positions[:, 2].mean())])
            self.corners = (flat @ mapped.turn.T + mapped.shift)[:, :2]
        self.entry = self.corners[:2].mean(0)

    def is_passed(self, positions):
        """Whether a drive comes near to the entry from in front."""
        along = self.corners[1] - self.corners[0]
        out = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        away = positions - self.entry
        distance = np.linalg.norm(away, axis=1)
        return bool(((away @ out > IN_FRONT * distance) & (distance < REACH_M)).any())

    def overlap(self, other):
        """Area in common over that of both."""
        mine, others = np.float32(self.corners), np.float32(other.corners)
        common = cv2.intersectConvexConvex(mine, others)[0]
        return common / (cv2.contourArea(mine) + cv2.contourArea(others) - common)


def bays_of(path, mapped=None):
    return [Bay(bay, mapped) for bay in vcharge.read_bays(path).bays]


def pairs_of(found, true):
    """Indices of found bays and of the true ones that they lie on, the best pairs first."""
    overlaps = np.array([[bay.overlap(other) for other in true] for bay in found]).reshape(len(found), len(true))
    pairs = []
    while overlaps.size and overlaps.max() >= SAME_BAY:
        row, column = np.unravel_index(overlaps.argmax(), overlaps.shape)
        pairs.append((row, column))
        overlaps[row, :] = overlaps[:, column] = 0
    return pairs


def figures(found, true, positions):
    """Found bays, the true ones, and the positions of the drive."""
    pairs = pairs_of(found, true)
    passed = {column for column, bay in enumerate(true) if bay.is_passed(positions)}
    hits = [(found[row], true[column]) for row, column in pairs if column in passed]
    errors = np.array([np.linalg.norm(bay.corners - other.corners, axis=1) for bay, other in hits]).reshape(-1, 4)
    normalized = [(bay.corners - other.corners) / bay.sigmas[:, None] for bay, other in hits]

    def quantile(values, which):
        return 100 * float(np.percentile(values, which)) if len(values) else None
    return [
        Figure("bays that the drive passes", len(passed)),
        figure("of them found", percent(len(hits), len(passed)), "%", at_least=95),
        figure("bays found that there are", percent(len(pairs), len(found)), "%", at_least=98),
        figure("corners, median", quantile(errors, 50), "cm", at_most=10),
        figure("corners, 95 %", quantile(errors, 95), "cm", at_most=25),
        Figure("corners at the entry, median", quantile(errors[:, :2], 50), "cm"),
        Figure("corners at the entry, 95 %", quantile(errors[:, :2], 95), "cm"),
        Figure("corners, normalized error squared", float(np.mean(np.square(normalized))) if hits else None),
        Figure("kind right", percent(sum(bay.kind == other.kind for bay, other in hits), len(hits)), "%"),
        *state_figures(hits)]


def state_figures(hits, when=""):
    """Pairs of found and true bays."""
    known = [(bay, other) for bay, other in hits if bay.state != "unknown"]
    return [
        figure(f"{when}free or occupied right, of those known",
               percent(sum(bay.state == other.state for bay, other in known), len(known)), "%", at_least=98),
        Figure(f"{when}free or occupied not known", percent(len(hits) - len(known), len(hits)), "%")]


def live_figures(args, scene, seed, mapped, bays):
    """States of found bays, as a drive on another day tells them that is localized in their map."""
    drive = Drive(args.work, f"{scene}_bays_live", "--scene", scene, *OTHER_DAY, "--day", 1, "--exchanged-cars", 0.3, "--scene-seed",
                  seed, "--seed", seed + 100, "--image-scale", args.image_scale, "--duration-s", args.live_s)
    poses, output = drive.folder / "in_map.tum", drive.folder / "obstacles"
    say(f"{drive.folder}: which bays are free")
    run_tool("localize_drive", drive.folder / "in_map.log", "--bag", drive.bag, "--rig", drive.true_rig, "--map", mapped.path,
             "--options", CONFIG / "localization.yaml", "--output", poses)
    detect_obstacles(drive, drive.true_rig, output, "--bays", bays, "--trajectory", poses, "--no-objects")
    found, true = bays_of(output / "bays.yaml", mapped), bays_of(drive.truth / "bays.yaml")
    positions = vcharge.read_trajectory(drive.trajectory).positions_m[:, :2]
    hits = [(found[row], true[column]) for row, column in pairs_of(found, true) if true[column].is_passed(positions)]
    obstacles = read_yaml(drive.truth / "obstacles.yaml")["obstacles"]
    return [Figure("another day: found bays that the drive passes", len(hits)), *state_figures(hits, "another day: "),
            *gap_figures(output / "gaps.csv", drive.trajectory, obstacles)]


def evaluate(args, scene, seed, condition):
    words = condition_words(condition)
    drive = Drive(args.work, f"{scene}_bays", "--scene", scene, "--drive", "loop", "--scene-seed", seed, "--seed", seed,
                  "--image-scale", args.image_scale, "--image-step", LOOP_STEP,
                  *(["--duration-s", args.duration_s] if args.duration_s else []), *words)
    path, trajectory, _ = drive.map(drive.true_rig)
    say(f"{drive.folder}: height map and bays")
    run_tool("build_height_map", drive.folder / "height_map.log", "--bag", drive.bag, "--rig", drive.true_rig, "--trajectory",
             trajectory, "--options", CONFIG / "height_map.yaml", "--output", drive.folder / "height_map")
    made = run_tool("map_bays", drive.folder / "bays.log", "--height-map", drive.folder / "height_map", "--output",
                    drive.folder / "bays.yaml")
    mapped = Map(path, drive.trajectory)
    found = bays_of(drive.folder / "bays.yaml", mapped)
    live = scene == "lot" and condition == "noon" and args.live_s > 0
    return [*figures(found, bays_of(drive.truth / "bays.yaml"), vcharge.read_trajectory(drive.trajectory).positions_m[:, :2]),
            Figure("time", made.wall_s, "s"),
            *(live_figures(args, scene, seed, mapped, drive.folder / "bays.yaml") if live else [])]


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("bays", "Parking bays", args)
    for name in args.drives:
        scene, _, seed = name.partition(":")
        for condition in args.conditions if scene == "lot" else ["noon"]:
            results.add(f"{scene.capitalize()}s, {condition}, image scale {args.image_scale:g}",
                        (f"{scene} {seed}", evaluate(args, scene, int(seed), condition)))
    results.end()


if __name__ == "__main__":
    main()
