"""Draws the occupied voxels of an OctoMap (octomap.bt of build_height_map) from above and aside, coloured by height."""
import argparse
import math
import pathlib

import cv2
import numpy as np

from vcharge_evaluation.drawing.pictures import save

SPAN_M = 2.5  # range of the colours, from the ground
AZIMUTH_RAD, ELEVATION_RAD = math.radians(30.0), math.radians(40.0)  # view
DEPTH = 16  # levels of an octree


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--octomap", type=pathlib.Path, required=True, help="octomap.bt")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="picture to write")
    parser.add_argument("--width-px", type=int, default=1400)
    parser.add_argument("--max-height-m", type=float, default=3.0, help="voxels higher over the ground hide others and are left out")
    return parser.parse_args()


def occupied_leaves(path):
    """Centres (N x 3) and side lengths (N) of the occupied leaves. The file has nodes in depth-first order, with two bits for
    each of the eight children (1: free, 2: occupied, 3: an inner node)."""
    text, _, data = path.read_bytes().partition(b"data\n")
    header = dict(line.split(" ", 1) for line in text.decode().splitlines() if line and not line.startswith("#"))
    if header.get("id") != "OcTree" or "res" not in header:
        raise SystemExit(f"{path}: expected a binary OctoMap (id OcTree, with res)")
    resolution = float(header["res"])
    leaves, at = [], 0

    def read(x, y, z, side):
        nonlocal at
        bits = int.from_bytes(data[at:at + 2], "little")
        at += 2
        half = side // 2
        inner = []
        for child in range(8):
            state = (bits >> (2 * child)) & 3
            corner = (x + half * (child & 1), y + half * (child >> 1 & 1), z + half * (child >> 2 & 1))
            if state == 2:
                leaves.append((*corner, half))
            elif state == 3:
                inner.append(corner)
        for corner in inner:
            read(*corner, half)

    if data:
        read(-(1 << (DEPTH - 1)), -(1 << (DEPTH - 1)), -(1 << (DEPTH - 1)), 1 << DEPTH)
    if not leaves:
        raise SystemExit(f"{path}: no voxel is occupied")
    corner, side = np.split(np.array(leaves, float), [3], axis=1)
    return (corner + 0.5 * side) * resolution, side[:, 0] * resolution


def draw(middles, sides, width_px, max_height_m):
    ground = np.median(middles[:, 2]) - 0.2  # most voxels are the ground
    keep = middles[:, 2] < ground + max_height_m
    middles, sides = middles[keep], sides[keep]
    turn = np.array([[math.cos(AZIMUTH_RAD), -math.sin(AZIMUTH_RAD)], [math.sin(AZIMUTH_RAD), math.cos(AZIMUTH_RAD)]])
    right, away = turn @ middles[:, :2].T
    up = middles[:, 2] * math.cos(ELEVATION_RAD) + away * math.sin(ELEVATION_RAD)
    nearness = middles[:, 2] * math.sin(ELEVATION_RAD) - away * math.cos(ELEVATION_RAD)
    scale = (width_px - 20) / np.ptp(right)
    column = 10 + (right - right.min()) * scale
    row = 10 + (up.max() - up) * scale
    level = np.clip((middles[:, 2] - ground) / SPAN_M, 0.0, 1.0)
    colours = cv2.applyColorMap((255 * level).astype(np.uint8)[:, None], cv2.COLORMAP_JET)[:, 0]
    picture = np.full((int(row.max()) + 20, width_px, 3), 30, np.uint8)
    for i in np.argsort(nearness):
        half = 0.5 * sides[i] * scale
        low = (int(column[i] - half), int(row[i] - half))
        high = (int(math.ceil(column[i] + half)), int(math.ceil(row[i] + half)))
        colour = colours[i].tolist()
        cv2.rectangle(picture, low, high, colour, -1)
        cv2.line(picture, (low[0], high[1]), high, [0.6 * c for c in colour], 1)  # an edge between voxels
    return picture


def main():
    args = arguments()
    save(args.output, draw(*occupied_leaves(args.octomap), args.width_px, args.max_height_m))


if __name__ == "__main__":
    main()
