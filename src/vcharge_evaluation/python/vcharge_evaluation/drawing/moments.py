"""Draws single moments of a drive for the results page."""
import argparse

import cv2
import numpy as np

import vcharge
from vcharge_evaluation.drawing import objects, obstacles
from vcharge_evaluation.drawing.pictures import read_image

NEAREST_M, FARTHEST_M = 0.5, 20.0
HEIGHT_PX = 300
# What draw_obstacles shows, for captions.
OBSTACLE_LEGEND = ("Image with obstacles, scan, and map: green free, red occupied, dark unknown; true outlines of what stands cyan, "
                   "of what moves magenta")

OBJECT_LEGEND = ("From above and in the images: true moving objects magenta, reported ones yellow with their ids, lines as far as they "
                 "move in 1 s")


def colour_ranges(range_m):
    """Red near, blue far, on a logarithmic scale; black where unknown."""
    known = np.isfinite(range_m)
    level = np.log(np.clip(np.where(known, range_m, 1.0), NEAREST_M, FARTHEST_M) / NEAREST_M) / np.log(FARTHEST_M / NEAREST_M)
    picture = cv2.applyColorMap((255 * (1.0 - level)).astype(np.uint8), cv2.COLORMAP_TURBO)
    picture[~known] = 0
    return picture


def draw_range_map(bag, folder, camera):
    """Image and range map of a camera in the middle of a drive; `folder` is that of compute_range_maps."""
    stamps = vcharge.list_range_maps(folder, camera)
    stamp = stamps[len(stamps) // 2]
    ranges = colour_ranges(vcharge.read_range_map(folder, camera, stamp).range_m)
    parts = [cv2.cvtColor(read_image(bag, camera, stamp), cv2.COLOR_GRAY2BGR), ranges]
    return np.hstack([cv2.resize(part, (part.shape[1] * HEIGHT_PX // part.shape[0], HEIGHT_PX)) for part in parts])


def draw_obstacles(drive, folder):
    """Image, scan and fused map late in a drive; `folder` is that of detect_obstacles."""
    output = folder.parent / f"{folder.name}.png"
    obstacles.draw(argparse.Namespace(bag=drive.bag, rig=drive.true_rig, obstacles=folder, camera=None, stamp_ns=None,
                                      moment=0.7, truth=drive.truth, output=output))
    return cv2.imread(str(output))


def draw_objects(drive, folder, stamp):
    """The tracked objects of one image from above, and over the images; `folder` holds objects.csv."""
    return objects.draw(drive.bag, drive.true_rig, folder, drive.truth, stamp)
