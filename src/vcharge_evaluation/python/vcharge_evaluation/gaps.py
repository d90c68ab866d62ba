"""Gaps to park in: how long those are that a drive is offered, against the things that truly stand there."""
import csv

import cv2
import numpy as np

from vcharge_evaluation.poses import at_stamps, rotations
from vcharge_evaluation.results import Figure, figure, percent

LEAST_MAPS = 5  # a gap is judged if this many maps show it
STEP_M, REACH_M = 0.02, 12.0
LENGTH_TOLERANCE_M = 0.5  # a gap is no gap if the truth is shorter by more
# What a car must not touch; lower things end a gap only at its back.
LOWEST_M = 0.2


class Gap:
    """A gap in the world, as the last of the maps that show it tells it."""

    def __init__(self, kind, corners, length_m, sigma_m):
        self.kind, self.corners, self.length_m, self.sigma_m = kind, corners, length_m, sigma_m
        self.num_maps = 1

    def centre(self):
        return self.corners.mean(0)

    def true_length(self, outlines):
        """Free length along the entry between what truly stands within the gap's depth; 0 if its middle is not free."""
        along = self.corners[1] - self.corners[0]
        along /= np.linalg.norm(along)
        into = self.corners[3] - self.corners[0]
        depth = np.linalg.norm(into)
        middle, ends = 0.5 * (self.corners[0] + self.corners[1]), [REACH_M, REACH_M]
        steps = np.arange(0, REACH_M, STEP_M)
        # The last places before the back belong to what closes it.
        for out in np.arange(0.1, depth - 0.3, 0.1):
            for i, sign in enumerate((1, -1)):
                places = middle + out * into / depth + sign * steps[:, None] * along
                hit = np.zeros(len(steps), bool)
                for outline in outlines:
                    if np.linalg.norm(outline.mean(0) - middle) < REACH_M + 10:
                        hit |= inside(outline, places)
                if hit.any():
                    ends[i] = min(ends[i], steps[hit.argmax()])
        return ends[0] + ends[1] if min(ends) > 0 else 0.0


def inside(outline, places):
    """Whether places lie inside a convex outline."""
    edges = np.roll(outline, -1, 0) - outline
    away = places[:, None, :] - outline[None]
    turns = edges[None, :, 0] * away[:, :, 1] - edges[None, :, 1] * away[:, :, 0]
    return (turns > 0).all(1) | (turns < 0).all(1)


def gaps_of(path, true_trajectory):
    """Gaps of a gaps.csv, placed in the world by the true poses."""
    with open(path, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    gaps = []
    if not rows:
        return gaps
    truth = at_stamps(true_trajectory, np.array([int(row["stamp_ns"]) / 1e9 for row in rows]))
    turns = rotations(truth[:, 4:])
    for row, pose, turn in zip(rows, truth, turns):
        corners = np.array([[float(row[f"{axis}{i}_m"]) for axis in "xy"] for i in range(4)])
        yaw = float(row["vehicle_yaw_rad"])
        away = corners - [float(row["vehicle_x_m"]), float(row["vehicle_y_m"])]
        local = np.column_stack([away @ [np.cos(yaw), np.sin(yaw)], away @ [-np.sin(yaw), np.cos(yaw)], np.zeros(4)])
        world = (local @ turn.T + pose[1:4])[:, :2]
        same = next((gap for gap in gaps if gap.kind == row["kind"] and
                     cv2.pointPolygonTest(np.float32(gap.corners), tuple(map(float, world.mean(0))), False) >= 0), None)
        if same:
            same.corners, same.length_m, same.sigma_m = world, float(row["length_m"]), float(row["length_sigma_m"])
            same.num_maps += 1
        else:
            gaps.append(Gap(row["kind"], world, float(row["length_m"]), float(row["length_sigma_m"])))
    return [gap for gap in gaps if gap.num_maps >= LEAST_MAPS]


def gap_figures(path, true_trajectory, obstacles):
    """`obstacles`: the truth's entries of what stands still."""
    outlines = [np.array(entry["footprint_m"]) for entry in obstacles if entry["top_z_m"] > LOWEST_M]
    figures = []
    gaps = gaps_of(path, true_trajectory)
    for kind in ("parallel", "perpendicular"):
        found = [gap for gap in gaps if gap.kind == kind]
        figures.append(Figure(f"gaps, {kind}", len(found)))
        if not found:
            continue
        true, told = np.array([gap.true_length(outlines) for gap in found]), np.array([gap.length_m for gap in found])
        right = told - true < LENGTH_TOLERANCE_M
        errors = 100 * np.abs(told - true)[right]
        figures += [figure(f"gaps, {kind}: free as told", percent(int(right.sum()), len(found)), "%", at_least=98),
                    figure(f"gaps, {kind}: error of the length, median", float(np.median(errors)) if len(errors) else None, "cm",
                           at_most=10),
                    Figure(f"gaps, {kind}: error of the length, worst", float(errors.max()) if len(errors) else None, "cm")]
    return figures
