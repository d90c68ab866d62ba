"""Draws input frames, colour range maps, and the points of all cameras from above over the truth."""
import argparse
import pathlib

import cv2
import numpy as np
import rosbag
import yaml

from vcharge_evaluation.drawing.pictures import add_moment_arguments, chosen_stamp, label, read_image, save
from vcharge_evaluation.poses import pose_of, stamp_ns, transform

CLOUD_CELL_M = 0.05
MAX_RELATIVE_SIGMA = 0.05
MIN_CONFIDENCE = 0.5


def read_poses(arguments):
    """Stamp (ns) -> world_from_vehicle: the truth if it is given, else the drive's odometry."""
    poses = {}
    if arguments.truth:
        for line in (arguments.truth / "trajectory.tum").read_text().splitlines():
            fields = line.split("#")[0].split()
            if fields:
                values = [float(field) for field in fields[1:]]
                poses[stamp_ns(fields[0])] = transform(values[:3], values[3:])
        return poses
    with rosbag.Bag(str(arguments.bag)) as bag:
        for _, message, _ in bag.read_messages(topics=["/odom"]):
            poses[message.header.stamp.to_nsec()] = transform(*pose_of(message))
    return poses


def rays_of(size, mei):
    """Unit rays of a Mei camera without distortion (paper, section Camera Model), 3 x H x W; NaN where a pixel has none."""
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    x = (u - mei["u0"]) / mei["gamma1"]
    y = (v - mei["v0"]) / mei["gamma2"]
    r = x * x + y * y
    discriminant = 1 + (1 - mei["xi"] ** 2) * r
    scale = (mei["xi"] + np.sqrt(np.where(discriminant > 0, discriminant, np.nan))) / (r + 1)
    return np.stack([scale * x, scale * y, scale - mei["xi"]])


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
            meta = yaml.safe_load((truth / "height_map.yaml").read_text())
            heights = cv2.imread(str(truth / "height_map.tiff"), cv2.IMREAD_UNCHANGED)
            rows, columns = np.indices(self.height.shape)
            column = np.round((columns * CLOUD_CELL_M + self.low[0] - meta["origin_m"][0]) / meta["cell_size_m"])
            row = np.round((rows * CLOUD_CELL_M + self.low[1] - meta["origin_m"][1]) / meta["cell_size_m"])
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

    rig = yaml.safe_load(arguments.rig.read_text())["cameras"]
    poses = read_poses(arguments)
    cloud = Cloud(poses)
    inputs, ranges = [], []
    for camera, description in rig.items():
        folder = arguments.range / camera
        stamps = sorted(int(path.stem) for path in folder.glob("*.yaml"))
        if not stamps:
            continue
        extrinsics = description["vehicle_from_camera"]
        vehicle_from_camera = transform(extrinsics["translation_m"], extrinsics["rotation_xyzw"])
        meta = yaml.safe_load((folder / f"{stamps[0]}.yaml").read_text())
        rays = None
        for stamp in stamps:
            distance = cv2.imread(str(folder / f"{stamp}_range.tiff"), cv2.IMREAD_UNCHANGED)
            sigma = cv2.imread(str(folder / f"{stamp}_sigma.tiff"), cv2.IMREAD_UNCHANGED)
            confidence = cv2.imread(str(folder / f"{stamp}_confidence.tiff"), cv2.IMREAD_UNCHANGED)
            if rays is None:
                rays = rays_of(distance.shape[::-1], meta["mei"])
            if stamp not in poses:
                continue
            with np.errstate(invalid="ignore"):
                good = (sigma < MAX_RELATIVE_SIGMA * distance) & (confidence > MIN_CONFIDENCE) & (distance < 15)
            points = np.vstack([rays[:, good] * distance[good], np.ones(good.sum())])
            cloud.add((poses[stamp] @ vehicle_from_camera @ points)[:3])
        shown = chosen_stamp(arguments, stamps)
        image = read_image(arguments.bag, camera, shown)
        inputs.append(label(cv2.resize(image, (640, 400), interpolation=cv2.INTER_AREA), camera))
        picture = cv2.imread(str(folder / f"{shown}_range.png"))
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
