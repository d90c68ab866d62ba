"""Five minutes of standing in a living scene: how much of what stands is still in the obstacle map, and what is wrong in it."""
import argparse
import math

import cv2
import numpy as np
from matplotlib.path import Path

import vcharge

from vcharge_evaluation.drawing.objects import rotation
from vcharge_evaluation.drawing.obstacles import read_yaml, yaw_of, yaw_of_matrix
from vcharge_evaluation.drives import scenario_with_masks
from vcharge_evaluation.obstacles import detect_obstacles
from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import NoResult, say
from vcharge.obstacle_map import FREE, OCCUPIED

DRIVES = ("arrive_and_stand_lot",)
REST_M = 0.02  # within so much of its position in the middle of the drive the vehicle stands
SETTLED_S = 1.0  # after this time of standing the map is the one that has to be held
REACH_M = 8.0
NEAR_M = 0.2  # an obstacle of the truth this near to a cell is in it: two cells
MIN_HEIGHT_M = 0.15
KEPT = "cells of what stands that are still occupied, least"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "standing_evaluation")
    parser.add_argument("--drives", nargs="*", default=DRIVES, choices=DRIVES, help="files in config/scenarios")
    parser.add_argument("--seeds", nargs="*", type=int, default=[31], help="seeds of the scenes; those below 100 serve to choose "
                        "options")
    parser.add_argument("--image-scale", type=float, default=0.4)
    parser.add_argument("--image-step", type=int, default=3, help="every n-th image is rendered")
    parser.add_argument("--duration-s", type=float, default=310.0)
    return parser.parse_args()


class Map:
    """Cells of one obstacle map by their positions in the fixed frame, which stays as long as the vehicle stands."""

    def __init__(self, folder, stamp):
        grid = vcharge.read_occupancy_grid(folder / f"{stamp}.yaml")
        self.state, self.cell_m, self.origin_m = grid.state, grid.cell_size_m, grid.origin_m
        self.here_m, self.yaw = grid.fixed_from_vehicle[:2, 3], yaw_of_matrix(grid.fixed_from_vehicle)
        self.centres = grid.centres_m

    def draw(self, outlines, world_from_fixed):
        """Cells inside outlines in the world, corners N x 2, grown by NEAR_M."""
        turn, shift = world_from_fixed
        picture = np.zeros(self.state.shape, np.uint8)
        for outline in outlines:
            cells = ((np.asarray(outline) - shift) @ turn - self.origin_m) / self.cell_m - 0.5
            cv2.fillPoly(picture, [np.round(cells).astype(np.int32)], 1)
        reach = int(math.ceil(NEAR_M / self.cell_m))
        return cv2.dilate(picture, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0

    def inside(self, outlines, world_from_fixed):
        """Cells whose middles are inside outlines in the world."""
        turn, shift = world_from_fixed
        points = (self.centres() @ turn.T + shift).reshape(-1, 2)
        hits = [Path(outline).contains_points(points) for outline in outlines]
        return np.any(hits, axis=0).reshape(self.state.shape) if hits else np.zeros(self.state.shape, bool)


def world_from_fixed(trajectory, stamp, held):
    """Rotation and translation of the frame of a map in the world, from the vehicle's true pose at its stamp."""
    pose = trajectory[np.argmin(abs(trajectory[:, 0] - stamp * 1e-9))]
    turn = rotation(yaw_of(pose[4:]) - held.yaw)
    return turn, pose[1:3] - turn @ held.here_m


def tall(obstacles):
    return [one["footprint_m"] for one in obstacles if one["top_z_m"] - one["base_z_m"] > MIN_HEIGHT_M]


def judge_standing(drive, folder):
    """Fractions of cells, for each map after the first settled one. NoResult without a standstill."""
    trajectory = vcharge.read_trajectory(drive.trajectory).rows
    middle = trajectory[len(trajectory) // 2]
    rests = trajectory[np.linalg.norm(trajectory[:, 1:3] - middle[1:3], axis=1) < REST_M]
    stamps = [stamp for stamp in vcharge.list_obstacle_maps(folder) if rests[0, 0] + SETTLED_S <= stamp * 1e-9 <= rests[-1, 0]]
    if not stamps:
        raise NoResult("no obstacle map while the vehicle stands")
    held = Map(folder, stamps[0])
    place = world_from_fixed(trajectory, stamps[0], held)
    movers = {image["stamp_ns"]: image["movers"] for image in read_yaml(drive.truth / "movers.yaml")["images"]}
    moving = {stamp: tall(movers[min(movers, key=lambda known, stamp=stamp: abs(known - stamp))]) for stamp in stamps}
    near = np.linalg.norm(held.centres() - held.here_m, axis=-1) < REACH_M
    standing = held.draw(tall(read_yaml(drive.truth / "obstacles.yaml")["obstacles"]), place)
    solid = near & standing & (held.state == OCCUPIED) & ~held.draw(moving[stamps[0]], place)
    free = near & ~standing & (held.state == FREE)
    kept, still_free, wrong, under, under_free = [], [], [], 0, 0
    for stamp in stamps[1:]:
        state = Map(folder, stamp).state
        hidden = held.draw(moving[stamp], place)
        occupied = cv2.dilate((state == OCCUPIED).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        kept.append(np.mean(occupied[solid & ~hidden]))
        still_free.append(np.mean(state[free & ~hidden] == FREE))
        wrong.append(np.mean(state[free & ~hidden] == OCCUPIED))
        below = near & held.inside(moving[stamp], place)
        under += below.sum()
        under_free += (below & (state == FREE)).sum()
    return {"duration_s": (stamps[-1] - stamps[0]) * 1e-9, "cells": int(solid.sum()), "kept": np.array(kept),
            "still_free": np.array(still_free), "wrong": np.array(wrong), "under": int(under), "under_free": int(under_free)}


def standing_figures(errors):
    yield figure(KEPT, 100 * errors["kept"].min(), "%", at_least=100)
    yield Figure("the same, at the end", 100 * errors["kept"][-1], "%")
    yield Figure("free cells that are still free, mean", 100 * errors["still_free"].mean(), "%")
    yield Figure("free cells that are occupied with nothing there, mean", 100 * errors["wrong"].mean(), "%")
    yield Figure("the same, worst map", 100 * errors["wrong"].max(), "%")
    yield Figure("cells under movers that are free, of all maps", errors["under_free"])
    yield Figure("cells under movers, of all maps", errors["under"])
    yield Figure("cells of what stands", errors["cells"])
    yield Figure("stood", errors["duration_s"], "s")


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("standing", "Standing in a living scene", args)
    title = f"Standing, within 8 m, image scale {args.image_scale:g}, every {args.image_step}. image"
    for name, seed in ((name, seed) for name in args.drives for seed in args.seeds):
        column = f"{name}, seed {seed}"
        say(column)
        drive, masks = scenario_with_masks(args, name, seed, ("--image-step", args.image_step))
        folder = drive.folder / "obstacles"
        try:
            detect_obstacles(drive, masks.rig_of(drive.folder), folder)
            figures = list(standing_figures(judge_standing(drive, folder)))
        except NoResult as error:
            figures = [figure(KEPT, 0.0, "%", at_least=100), Figure("remarks", str(error))]
        results.add(title, (column, figures))
    results.end()


if __name__ == "__main__":
    main()
