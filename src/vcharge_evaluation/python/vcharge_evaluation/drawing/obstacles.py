"""Draws one moment of a drive's obstacle maps: an image with the obstacles, one camera's scan, and the fused map (green
free, red occupied, dark unknown) with the true outlines if they are given."""
import argparse
import csv
import math
import pathlib

import cv2
import numpy as np
import yaml

from vcharge_evaluation.camera_models import project
from vcharge_evaluation.drawing.pictures import read_image, save
from vcharge_evaluation.poses import rotations

PIXELS_PER_CELL = 4


def read_scans(path):
    scans = {}
    with open(path) as file:
        for row in csv.DictReader(file):
            scans.setdefault(row["name"], []).append({key: float(value) for key, value in row.items() if key != "name"})
    return scans


def draw_over_image(image, scan, camera):
    """Obstacles as vertical bars up to their heights, free ground as green dots."""
    picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    pose = camera["vehicle_from_camera"]
    rotation = rotations([pose["rotation_xyzw"]])[0]
    translation = np.array(pose["translation_m"])

    def pixels_of(points):
        in_camera = (np.array(points) - translation) @ rotation
        in_front = in_camera[:, 2] > np.linalg.norm(in_camera, axis=1) * math.cos(math.radians(88))
        return project(in_camera, camera), in_front

    for ray in scan:
        direction = np.array([math.cos(ray["angle_rad"]), math.sin(ray["angle_rad"])])
        origin = np.array([ray["origin_x_m"], ray["origin_y_m"]])

        def at(distance, z):
            return [*(origin + distance * direction), z]
        free = [at(d, 0.0) for d in np.arange(0.4, ray["free_m"], 0.15)]
        if free:
            for pixel, ok in zip(*pixels_of(free)):
                if ok:
                    cv2.circle(picture, tuple(int(v) for v in pixel), 1, (0, 200, 0), -1)
        if not math.isnan(ray["range_m"]):
            ends, ok = pixels_of([at(ray["range_m"], 0.0), at(ray["range_m"], ray["height_m"])])
            if ok.all():
                cv2.line(picture, tuple(int(v) for v in ends[0]), tuple(int(v) for v in ends[1]), (0, 0, 255), 2)
    return picture


def draw_scan(scan, size, metres=6.0):
    """A camera's scan from above: white obstacles, gray free ground, black unknown."""
    picture = np.zeros((size, size, 3), np.uint8)
    per_metre = size / (2 * metres)

    def pixel(x, y):
        return int(size / 2 + (x - 1.9) * per_metre), int(size / 2 - y * per_metre)
    half = 0.5 * (scan[1]["angle_rad"] - scan[0]["angle_rad"])
    for ray in scan:
        origin = (ray["origin_x_m"], ray["origin_y_m"])
        if ray["free_m"] > 0:
            corners = [pixel(*origin)] + [
                pixel(origin[0] + ray["free_m"] * math.cos(ray["angle_rad"] + side),
                      origin[1] + ray["free_m"] * math.sin(ray["angle_rad"] + side)) for side in (-half, half)]
            cv2.fillPoly(picture, [np.array(corners)], (110, 110, 110))
    for ray in scan:
        if not math.isnan(ray["range_m"]):
            cv2.circle(picture, pixel(ray["origin_x_m"] + ray["range_m"] * math.cos(ray["angle_rad"]),
                                      ray["origin_y_m"] + ray["range_m"] * math.sin(ray["angle_rad"])),
                       2, (255, 255, 255), -1)
    return picture


def yaw_of(q):
    return 2 * math.atan2(q[2], q[3])


def draw_map(folder, stamp, truth):
    gray = cv2.imread(str(folder / f"{stamp}.pgm"), cv2.IMREAD_UNCHANGED)
    meta = yaml.safe_load((folder / f"{stamp}.yaml").read_text())
    picture = np.zeros((*gray.shape, 3), np.uint8)
    picture[gray == 254], picture[gray == 0], picture[gray == 205] = (0, 160, 0), (0, 0, 255), (40, 40, 40)
    k = PIXELS_PER_CELL
    picture = cv2.resize(picture, None, fx=k, fy=k, interpolation=cv2.INTER_NEAREST)
    here, yaw = np.array(meta["fixed_from_vehicle_translation_m"][:2]), yaw_of(meta["fixed_from_vehicle_rotation_xyzw"])

    def outline(points_in_vehicle, colour):
        c, s = math.cos(yaw), math.sin(yaw)
        fixed = np.asarray(points_in_vehicle) @ np.array([[c, s], [-s, c]]) + here
        cells = (fixed - meta["origin"][:2]) / meta["resolution"] * k
        cv2.polylines(picture, [np.stack([cells[:, 0], gray.shape[0] * k - cells[:, 1]], 1).astype(int)], True, colour, 1)

    outline([[3.7, .9], [3.7, -.9], [-.9, -.9], [-.9, .9]], (255, 255, 255))
    if truth:
        poses = np.loadtxt(truth / "trajectory.tum")
        pose = poses[np.argmin(abs(poses[:, 0] - stamp * 1e-9))]
        c, s = math.cos(-yaw_of(pose[4:])), math.sin(-yaw_of(pose[4:]))
        for obstacle in yaml.load((truth / "obstacles.yaml").read_text(), Loader=yaml.CSafeLoader)["obstacles"]:
            outline((np.array(obstacle["footprint_m"]) - pose[1:3]) @ np.array([[c, s], [-s, c]]), (255, 255, 0))
    return picture


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--obstacles", type=pathlib.Path, required=True, help="folder that detect_obstacles wrote")
    parser.add_argument("--camera", help="default: left, or the first of the rig")
    parser.add_argument("--moment", type=float, default=0.7, help="time in the drive as a fraction of its duration")
    parser.add_argument("--truth", type=pathlib.Path)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    draw(parser.parse_args())


def draw(arguments):
    """Writes the picture; `arguments` as of the command line."""
    cameras = yaml.safe_load(arguments.rig.read_text())["cameras"]
    arguments.camera = arguments.camera or ("left" if "left" in cameras else next(iter(cameras)))
    camera = cameras[arguments.camera]
    stamps = sorted(int(path.stem) for path in arguments.obstacles.glob("*.yaml") if path.stem.isdigit())
    with_camera = [stamp for stamp in stamps
                   if arguments.camera in read_scans(arguments.obstacles / f"{stamp}_scans.csv")]
    if not with_camera:
        raise SystemExit(f"{arguments.obstacles}: no scan of camera '{arguments.camera}'")
    stamp = with_camera[int(arguments.moment * (len(with_camera) - 1))]
    scan = read_scans(arguments.obstacles / f"{stamp}_scans.csv")[arguments.camera]
    over = draw_over_image(read_image(arguments.bag, arguments.camera, stamp), scan, camera)
    fused = draw_map(arguments.obstacles, stamp, arguments.truth)
    height = fused.shape[0]
    over = cv2.resize(over, (over.shape[1] * height // (2 * over.shape[0]), height // 2))
    own = cv2.resize(draw_scan(scan, height // 2), (height // 2, height // 2))
    left = np.zeros((height, over.shape[1], 3), np.uint8)
    left[:over.shape[0]] = over
    left[height // 2:height // 2 + own.shape[0], :own.shape[1]] = own
    save(arguments.output, np.hstack([left, fused]))


if __name__ == "__main__":
    main()
