"""Draws one moment of a drive's obstacle maps: an image with the obstacles, one camera's scan, and the fused map (green
free, red occupied, dark unknown) with the vehicle (white) and, if the truth is given, the true outlines of what stands (cyan)
and moves (magenta)."""
import argparse
import math
import pathlib

import cv2
import numpy as np
import yaml

import vcharge
from vcharge_evaluation.drawing.pictures import add_moment_arguments, chosen_stamp, read_image, save
from vcharge.obstacle_map import FREE, OCCUPIED, UNOBSERVED

PIXELS_PER_CELL = 4
FRONT_M, REAR_M, HALF_WIDTH_M = 3.7, -0.9, 0.9  # outline of the simulated car about the origin of its frame
CYAN, MAGENTA = (255, 255, 0), (255, 0, 255)


def projection_into(camera):
    """Function from points (N x 3, in the vehicle's frame) to pixels (N x 2), and whether each is in front of the camera."""
    def pixels_of(points):
        in_camera = camera.camera_from_vehicle(points)
        pixels = camera.project(in_camera)
        in_front = in_camera[:, 2] > np.linalg.norm(in_camera, axis=1) * math.cos(math.radians(88))
        return pixels, in_front & np.isfinite(pixels).all(1)
    return pixels_of


def frame(picture, corners, pixels_of, colour):
    """A rectangle around a body given by its corners, if all are in front of the camera."""
    pixels, ok = pixels_of(corners)
    if ok.all():
        low, high = pixels.min(0).astype(int) - 3, pixels.max(0).astype(int) + 3
        cv2.rectangle(picture, tuple(low.tolist()), tuple(high.tolist()), colour, 1)


def draw_over_image(image, scan, camera, truth):
    """Obstacles as vertical bars up to their heights, free ground as green dots, what truly moves in frames."""
    picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    pixels_of = projection_into(camera)
    for angle, distance, free_m, height in zip(scan.angle_rad, scan.range_m, scan.free_m, scan.height_m):
        direction = np.array([math.cos(angle), math.sin(angle)])

        def at(distance, z, direction=direction):
            return [*(scan.origin_m + distance * direction), z]
        free = [at(d, 0.0) for d in np.arange(0.4, free_m, 0.15)]
        if free:
            for pixel, ok in zip(*pixels_of(free)):
                if ok:
                    cv2.circle(picture, tuple(int(v) for v in pixel), 1, (0, 200, 0), -1)
        if not math.isnan(distance):
            ends, ok = pixels_of([at(distance, 0.0), at(distance, height)])
            if ok.all():
                cv2.line(picture, tuple(int(v) for v in ends[0]), tuple(int(v) for v in ends[1]), (0, 0, 255), 2)
    for mover in truth.moving if truth else ():
        frame(picture, truth.corners(mover), pixels_of, MAGENTA)
    return picture


def draw_scan(scan, size, metres=6.0):
    """A camera's scan from above: white obstacles, gray free ground, black unknown."""
    picture = np.zeros((size, size, 3), np.uint8)
    per_metre = size / (2 * metres)

    def pixel(x, y):
        return int(size / 2 + (x - 1.9) * per_metre), int(size / 2 - y * per_metre)

    def at(distance, angle):
        return pixel(scan.origin_m[0] + distance * math.cos(angle), scan.origin_m[1] + distance * math.sin(angle))
    half = 0.5 * (scan.angle_rad[1] - scan.angle_rad[0])
    for angle, free_m in zip(scan.angle_rad, scan.free_m):
        if free_m > 0:
            corners = [pixel(*scan.origin_m), at(free_m, angle - half), at(free_m, angle + half)]
            cv2.fillPoly(picture, [np.array(corners)], (110, 110, 110))
    for angle, distance in zip(scan.angle_rad, scan.range_m):
        if not math.isnan(distance):
            cv2.circle(picture, at(distance, angle), 2, (255, 255, 255), -1)
    return picture


def yaw_of(q):
    return 2 * math.atan2(q[2], q[3])


def yaw_of_matrix(transform):
    return math.atan2(transform[1, 0], transform[0, 0])


def read_yaml(path):
    return yaml.load(path.read_text(), Loader=yaml.CSafeLoader)


class Truth:
    """What stands and what moves at one stamp, in the vehicle's frame."""

    def __init__(self, folder, stamp_ns):
        poses = vcharge.read_trajectory(folder / "trajectory.tum").rows
        pose = poses[np.argmin(abs(poses[:, 0] - stamp_ns * 1e-9))]
        self.position_m, yaw = pose[1:4], yaw_of(pose[4:])
        self.turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        self.standing = read_yaml(folder / "obstacles.yaml")["obstacles"]
        images = read_yaml(folder / "movers.yaml")["images"] if (folder / "movers.yaml").exists() else []
        self.moving = min(images, key=lambda image: abs(image["stamp_ns"] - stamp_ns))["movers"] if images else []

    def footprint(self, obstacle):
        """Corners, N x 2, metres."""
        return (np.array(obstacle["footprint_m"]) - self.position_m[:2]) @ self.turn

    def corners(self, obstacle):
        """Corners on the ground and of the top, 2N x 3, metres."""
        flat = self.footprint(obstacle)
        return np.vstack([np.column_stack([flat, np.full(len(flat), obstacle[key] - self.position_m[2])])
                          for key in ("base_z_m", "top_z_m")])


def draw_map(folder, stamp, truth):
    grid = vcharge.read_occupancy_grid(folder / f"{stamp}.yaml")
    state = grid.state[::-1]
    picture = np.zeros((*state.shape, 3), np.uint8)
    picture[state == FREE], picture[state == OCCUPIED], picture[state == UNOBSERVED] = (0, 160, 0), (0, 0, 255), (40, 40, 40)
    k = PIXELS_PER_CELL
    picture = cv2.resize(picture, None, fx=k, fy=k, interpolation=cv2.INTER_NEAREST)
    here, yaw = grid.fixed_from_vehicle[:2, 3], yaw_of_matrix(grid.fixed_from_vehicle)

    def outline(points_in_vehicle, colour):
        c, s = math.cos(yaw), math.sin(yaw)
        fixed = np.asarray(points_in_vehicle) @ np.array([[c, s], [-s, c]]) + here
        cells = (fixed - grid.origin_m) / grid.cell_size_m * k
        cv2.polylines(picture, [np.stack([cells[:, 0], len(state) * k - cells[:, 1]], 1).astype(int)], True, colour, 1)

    outline([[FRONT_M, HALF_WIDTH_M], [FRONT_M, -HALF_WIDTH_M], [REAR_M, -HALF_WIDTH_M], [REAR_M, HALF_WIDTH_M]], (255, 255, 255))
    for obstacles, colour in ((truth.standing, CYAN), (truth.moving, MAGENTA)) if truth else ():
        for obstacle in obstacles:
            outline(truth.footprint(obstacle), colour)
    return picture


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--obstacles", type=pathlib.Path, required=True, help="folder that detect_obstacles wrote")
    parser.add_argument("--camera", help="default: left, or the first of the rig")
    add_moment_arguments(parser, 0.7)
    parser.add_argument("--truth", type=pathlib.Path)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    draw(parser.parse_args())


def draw(arguments):
    """Writes the picture; `arguments` as of the command line."""
    cameras = vcharge.read_rig(arguments.rig).cameras
    arguments.camera = arguments.camera or ("left" if "left" in cameras else next(iter(cameras)))
    camera = cameras[arguments.camera]
    with_camera = [stamp for stamp in vcharge.list_obstacle_maps(arguments.obstacles)
                   if arguments.camera in vcharge.read_obstacle_scans(arguments.obstacles, stamp)]
    if not with_camera:
        raise SystemExit(f"{arguments.obstacles}: no scan of camera '{arguments.camera}'")
    stamp = chosen_stamp(arguments, with_camera)
    scan = vcharge.read_obstacle_scans(arguments.obstacles, stamp)[arguments.camera]
    truth = Truth(arguments.truth, stamp) if arguments.truth else None
    over = draw_over_image(read_image(arguments.bag, arguments.camera, stamp), scan, camera, truth)
    fused = draw_map(arguments.obstacles, stamp, truth)
    height = fused.shape[0]
    over = cv2.resize(over, (over.shape[1] * height // (2 * over.shape[0]), height // 2))
    own = cv2.resize(draw_scan(scan, height // 2), (height // 2, height // 2))
    left = np.zeros((height, over.shape[1], 3), np.uint8)
    left[:over.shape[0]] = over
    left[height // 2:height // 2 + own.shape[0], :own.shape[1]] = own
    save(arguments.output, np.hstack([left, fused]))


if __name__ == "__main__":
    main()
