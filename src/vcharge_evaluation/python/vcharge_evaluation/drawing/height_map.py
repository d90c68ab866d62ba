"""Draws a height map of build_height_map from above: heights in colours with a scale, brightness, and drivable cells."""
import argparse
import pathlib

import cv2
import numpy as np

import vcharge
from vcharge_evaluation.drawing.pictures import save
from vcharge.obstacle_map import FREE, OCCUPIED, UNOBSERVED

SPAN_M = 1.8  # range of the colours, from a little below most of the ground
BAR_M = 5.0  # length of the scale bar
STATES = {FREE: (150, 200, 150), OCCUPIED: (60, 60, 200), UNOBSERVED: (40, 40, 40)}  # drivable, obstacle, unobserved; BGR


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", type=pathlib.Path, required=True, help="folder of build_height_map")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="picture to write")
    parser.add_argument("--width-px", type=int, default=700, help="width of each of the three panels")
    return parser.parse_args()


def with_title(image, title):
    framed = cv2.copyMakeBorder(image, 30, 6, 3, 3, cv2.BORDER_CONSTANT, value=(20, 20, 20))
    cv2.putText(framed, title, (8, 21), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (230, 230, 230), 1, cv2.LINE_AA)
    return framed


def colour(heights):
    known = np.isfinite(heights)
    low = np.quantile(heights[known], 0.05) - 0.2
    level = np.clip((np.nan_to_num(heights) - low) / SPAN_M, 0.0, 1.0)
    # Shading with light from the lower left shows small steps.
    beside = np.roll(heights, (1, 1), (0, 1))
    slope = np.nan_to_num(heights - beside) / 0.05
    shade = np.clip(0.85 + 0.3 * slope, 0.4, 1.0)[..., None]
    picture = cv2.applyColorMap((255 * level).astype(np.uint8), cv2.COLORMAP_JET) * shade
    picture[~known] = 40
    return picture.astype(np.uint8), low


def add_scales(picture, low, pixels_per_m):
    rows = picture.shape[0]
    length = int(BAR_M * pixels_per_m)
    cv2.line(picture, (12, rows - 14), (12 + length, rows - 14), (255, 255, 255), 2)
    cv2.putText(picture, f"{BAR_M:g} m", (12, rows - 20), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
    for i in range(7):
        fraction = i / 6
        bgr = cv2.applyColorMap(np.uint8([[int(255 * fraction)]]), cv2.COLORMAP_JET)[0, 0].tolist()
        at = (picture.shape[1] - 78, rows - 16 - 17 * i)
        cv2.rectangle(picture, (at[0], at[1] - 11), (at[0] + 16, at[1] + 3), bgr, -1)
        cv2.putText(picture, f"{low + fraction * SPAN_M:.1f} m", (at[0] + 22, at[1]), cv2.FONT_HERSHEY_SIMPLEX, 0.4,
                    (255, 255, 255), 1, cv2.LINE_AA)


def main():
    args = arguments()
    found = vcharge.read_height_map(args.map)
    cell, heights, gray = found.cell_size_m, found.height_m, found.gray
    states = vcharge.read_occupancy_grid(args.map / "drivable.yaml").state
    rows, columns = np.nonzero(np.isfinite(heights) | (states != UNOBSERVED))  # walls have a state but no height
    if rows.size == 0:
        raise SystemExit(f"{args.map}: expected a height map with observed cells")
    part = np.s_[rows.min():rows.max() + 1, columns.min():columns.max() + 1]
    height_picture, low = colour(heights[part])
    drivable = np.zeros((*states[part].shape, 3), np.uint8)
    for state, bgr in STATES.items():
        drivable[states[part] == state] = bgr
    panels = []
    for title, image in (("height", height_picture), ("brightness", cv2.cvtColor(gray[part], cv2.COLOR_GRAY2BGR)),
                         ("drivable (green), obstacles (red)", drivable)):
        scale = args.width_px / image.shape[1]
        size = (args.width_px, max(1, round(image.shape[0] * scale)))
        panel = cv2.resize(image[::-1], size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST)
        if title == "height":
            add_scales(panel, low, scale / cell)
        panels.append(with_title(panel, title))
    is_wide = heights[part].shape[1] > heights[part].shape[0]
    save(args.output, np.vstack(panels) if is_wide else np.hstack(panels))


if __name__ == "__main__":
    main()
