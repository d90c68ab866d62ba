"""Draws input frames, colour range maps, and the points of all cameras from above over the truth."""
import argparse
import pathlib

import cv2
import numpy as np
import rosbag

import vcharge
from vcharge_evaluation.drawing.pictures import add_moment_arguments, chosen_stamp, label, read_image, save
from vcharge_evaluation.poses import pose_of, transform

CLOUD_CELL_M = 0.05
MAX_RELATIVE_SIGMA = 0.05
MIN_CONFIDENCE = 0.5


def read_poses(arguments):
    """Stamp (ns) -> world_from_vehicle: the truth if it is given, else the drive's odometry."""
    poses = {}
    if arguments.truth:
        trajectory = vcharge.read_trajectory(arguments.truth / "trajectory.tum")
        return dict(zip(trajectory.stamps_ns.tolist(), trajectory.world_from_vehicle))
    with rosbag.Bag(str(arguments.bag)) as bag:
        for _, message, _ in bag.read_messages(topics=["/odom"]):
            poses[message.header.stamp.to_nsec()] = transform(*pose_of(message))
    return poses


class Cloud:
    """Points from above: the highest one below 2.5 m of each cell."""

    def __init__(self, poses):
        centres = np.array([pose[:2, 3] for pose in poses.values()])
        self.low = centres.min(axis=0) - 15
        size = np.ceil((centres.max(axis=0) + 15 - self.low) / CLOUD_CELL_M).astype(int)
        self.height = np.full((size[1], size[0]), np.nan, np.float32)

    def add(self, points):
        points = points[:, (points[2] < 2.5) & (points[2] > -1.0)]
        cells = ((points[:2].T - self.low) / CLOUD_CELL_M).astype(int)
        inside = ((cells >= 0) & (cells < np.array(self.height.shape[::-1]))).all(axis=1)
        cells, heights = cells[inside], points[2, inside]
        order = np.argsort(heights)
        self.height[cells[order, 1], cells[order, 0]] = np.fmax(
            self.height[cells[order, 1], cells[order, 0]], heights[order])

    def draw(self, truth, poses):
        canvas = np.full(self.height.shape + (3,), 30, np.uint8)
        if truth:
            surface = vcharge.read_height_map(truth)
            heights = surface.height_m
            rows, columns = np.indices(self.height.shape)
            column = np.round((columns * CLOUD_CELL_M + self.low[0] - surface.origin_m[0]) / surface.cell_size_m)
            row = np.round((rows * CLOUD_CELL_M + self.low[1] - surface.origin_m[1]) / surface.cell_size_m)
            inside = (column >= 0) & (row >= 0) & (column < heights.shape[1]) & (row < heights.shape[0])
            sampled = np.full(self.height.shape, np.nan, np.float32)
            sampled[inside] = heights[row[inside].astype(int), column[inside].astype(int)]
            gray = np.clip(40 + 60 * np.nan_to_num(sampled), 30, 200).astype(np.uint8)
            canvas = cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR)
        known = np.isfinite(self.height)
        level = np.clip(255 * (np.nan_to_num(self.height) + 0.3) / 2.3, 0, 255).astype(np.uint8)
        coloured = cv2.applyColorMap(level, cv2.COLORMAP_TURBO)
        canvas[known] = coloured[known]
        for pose in poses.values():
            cell = ((pose[:2, 3] - self.low) / CLOUD_CELL_M).astype(int)
            cv2.circle(canvas, tuple(int(c) for c in cell), 3, (255, 255, 255), -1)
        return cv2.flip(canvas, 0)  # y up


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--range", type=pathlib.Path, required=True)
    add_moment_arguments(parser, 0.5)
    parser.add_argument("--truth", type=pathlib.Path)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()

    rig = vcharge.read_rig(arguments.rig)
    poses = read_poses(arguments)
    cloud = Cloud(poses)
    inputs, ranges = [], []
    known = vcharge.list_range_map_cameras(arguments.range)
    for camera in (name for name in rig.cameras if name in known):
        stamps, rays = vcharge.list_range_maps(arguments.range, camera), None
        for stamp in (stamp for stamp in stamps if stamp in poses):
            found = vcharge.read_range_map(arguments.range, camera, stamp)
            rays = found.rays() if rays is None else rays
            with np.errstate(invalid="ignore"):
                good = (found.standard_deviation_m < MAX_RELATIVE_SIGMA * found.range_m) & (found.confidence > MIN_CONFIDENCE) & \
                    (found.range_m < 15)
            points = np.vstack([(rays[good] * found.range_m[good][:, None]).T, np.ones(good.sum())])
            cloud.add((poses[stamp] @ rig[camera].vehicle_from_camera @ points)[:3])
        shown = chosen_stamp(arguments, stamps)
        image = read_image(arguments.bag, camera, shown)
        inputs.append(label(cv2.resize(image, (640, 400), interpolation=cv2.INTER_AREA), camera))
        picture = cv2.imread(str(arguments.range / camera / f"{shown}_range.png"))
        ranges.append(label(cv2.resize(picture, (640, 400), interpolation=cv2.INTER_NEAREST), f"{camera} range"))

    def mosaic(pictures):
        if len(pictures) % 2:
            pictures = pictures + [np.zeros_like(pictures[0])]
        return np.vstack([np.hstack(pictures[i:i + 2]) for i in range(0, len(pictures), 2)])

    save(arguments.output / "input_frames.png", mosaic(inputs))
    save(arguments.output / "range_maps.png", mosaic(ranges))
    save(arguments.output / "cloud_from_above.png", cloud.draw(arguments.truth, poses))


if __name__ == "__main__":
    main()
