"""Draws the tracked moving objects of one image: from above and over the four images, with the true ones."""
import argparse
import csv
import math
import pathlib

import cv2
import numpy as np

from vcharge_evaluation.drawing.obstacles import (CYAN, FRONT_M, HALF_WIDTH_M, MAGENTA, REAR_M, Truth, frame, projection_into,
                                                  read_yaml)
from vcharge_evaluation.drawing.pictures import add_moment_arguments, chosen_stamp, label, read_image, save

YELLOW, WHITE = (0, 255, 255), (255, 255, 255)
SIZE_PX, REACH_M = 640, 12.0  # of the view from above; the judged objects are within 8 m of the vehicle's outline
IMAGE_PX = (512, 320)


def rotation(yaw):
    return np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])


class Body:
    """An object in the vehicle's frame: corners (N x 2) and centre in m, velocity over the ground in m/s, base and top in m."""

    def __init__(self, corners, centre, velocity, base, top, text=""):
        self.corners, self.centre, self.velocity, self.text = corners, centre, velocity, text
        self.solid = np.vstack([np.column_stack([corners, np.full(len(corners), z)]) for z in (base, top)])


def read_reports(folder, stamp):
    """Reported objects of a stamp; none where nothing was reported."""
    with open(folder / "objects_frames.csv", encoding="utf-8") as file:
        poses = {int(row["stamp_ns"]): row for row in csv.DictReader(file)}
    if stamp not in poses:
        return []
    here = np.array([float(poses[stamp][key]) for key in ("x_m", "y_m")])
    turn = rotation(float(poses[stamp]["yaw_rad"]))
    with open(folder / "objects.csv", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if int(row["stamp_ns"]) == stamp]
    bodies = []
    for row in rows:
        corners = np.array([[float(word) for word in corner.split(" ")] for corner in row["footprint_m"].split(";")])
        centre, velocity = (np.array([float(row[key]) for key in keys]) for keys in (("x_m", "y_m"), ("vx_m_per_s", "vy_m_per_s")))
        bodies.append(Body((corners - here) @ turn, (centre - here) @ turn, velocity @ turn, 0.0, float(row["height_m"]),
                           f"{row['id']} {row['class']}"))
    return bodies


def read_truth(truth):
    """True movers in the vehicle's frame."""
    bodies = []
    for mover in truth.moving:
        solid = truth.corners(mover)
        bodies.append(Body(truth.footprint(mover), (np.array(mover["translation_m"][:2]) - truth.position_m[:2]) @ truth.turn,
                           np.array(mover["velocity_m_per_s"][:2]) @ truth.turn, solid[0, 2], solid[-1, 2]))
    return bodies


def draw_from_above(truth, groups):
    """View with the vehicle in the middle, its x upwards; `groups`: colours and their bodies."""
    picture = np.full((SIZE_PX, SIZE_PX, 3), 40, np.uint8)
    middle = np.array([0.5 * (FRONT_M + REAR_M), 0.0])

    def pixels(points):
        across = (np.asarray(points) - middle) * SIZE_PX / (2 * REACH_M)
        return np.stack([SIZE_PX / 2 - across[:, 1], SIZE_PX / 2 - across[:, 0]], 1).astype(int)

    def outline(corners, colour):
        cv2.polylines(picture, [pixels(corners)], True, colour, 1, cv2.LINE_AA)

    for obstacle in truth.standing:
        outline(truth.footprint(obstacle), CYAN)
    outline([[FRONT_M, HALF_WIDTH_M], [FRONT_M, -HALF_WIDTH_M], [REAR_M, -HALF_WIDTH_M], [REAR_M, HALF_WIDTH_M]], WHITE)
    for colour, bodies in groups:
        for body in bodies:
            outline(body.corners, colour)
            start, end = pixels([body.centre, body.centre + body.velocity]).tolist()
            cv2.line(picture, start, end, colour, 1, cv2.LINE_AA)
            cv2.putText(picture, body.text, (start[0] + 6, start[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)
    return picture


def draw(bag, rig, folder, truth_folder, stamp):
    """The picture (BGR) of a stamp (ns)."""
    truth = Truth(truth_folder, stamp)
    groups = ((MAGENTA, read_truth(truth)), (YELLOW, read_reports(folder, stamp)))
    images = []
    for name, camera in read_yaml(rig)["cameras"].items():
        picture = cv2.cvtColor(read_image(bag, name, stamp), cv2.COLOR_GRAY2BGR)
        for colour, bodies in groups:
            for body in bodies:
                if np.linalg.norm(body.centre) <= REACH_M:
                    frame(picture, body.solid, projection_into(camera), colour)
        images.append(label(cv2.resize(picture, IMAGE_PX, interpolation=cv2.INTER_AREA), name))
    if len(images) % 2:
        images.append(np.zeros_like(images[0]))
    rows = np.vstack([np.hstack(images[i:i + 2]) for i in range(0, len(images), 2)])
    above = draw_from_above(truth, groups)
    height = max(len(rows), len(above))
    return np.hstack([cv2.copyMakeBorder(part, 0, height - len(part), 0, 0, cv2.BORDER_CONSTANT) for part in (above, rows)])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--objects", type=pathlib.Path, required=True, help="folder with objects.csv and objects_frames.csv")
    parser.add_argument("--truth", type=pathlib.Path, required=True, help="truth folder of the drive")
    add_moment_arguments(parser, 0.5)
    parser.add_argument("--output", type=pathlib.Path, required=True, help="picture to write")
    args = parser.parse_args()
    stamp = chosen_stamp(args, [image["stamp_ns"] for image in read_yaml(args.truth / "movers.yaml")["images"]])
    save(args.output, draw(args.bag, args.rig, args.objects, args.truth, stamp))


if __name__ == "__main__":
    main()
