"""Draws the tracked moving objects of one image: from above and over the four images, with the true ones."""
import argparse
import math
import pathlib

import cv2
import numpy as np

import vcharge
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


class Reports:
    """The reported objects of a drive: `folder` is that of detect_obstacles."""

    def __init__(self, folder):
        self.frames = {frame.stamp_ns: frame for frame in vcharge.read_objects(folder)}
        self.poses = {stamp: [*frame.odom_from_vehicle[:2, 3], frame.yaw_rad] for stamp, frame in self.frames.items()}

    def at(self, stamp):
        """Bodies of a stamp; none where nothing was reported."""
        bodies = []
        for one in self.frames[stamp].objects if stamp in self.frames else ():
            here, turn = np.array(self.poses[stamp][:2]), rotation(self.poses[stamp][2])
            bodies.append(Body((one.footprint_m - here) @ turn, (one.position_m - here) @ turn, one.velocity_m_per_s @ turn, 0.0,
                               one.height_m, f"{one.id} {one.object_class}"))
        return bodies


def read_truth(truth):
    """True movers in the vehicle's frame."""
    bodies = []
    for mover in truth.moving:
        solid = truth.corners(mover)
        bodies.append(Body(truth.footprint(mover), (np.array(mover["translation_m"][:2]) - truth.position_m[:2]) @ truth.turn,
                           np.array(mover["velocity_m_per_s"][:2]) @ truth.turn, solid[0, 2], solid[-1, 2]))
    return bodies


def pixels_from_above(points):
    """Pixels, N x 2, of points in the vehicle's frame; the vehicle is in the middle, its x upwards."""
    across = (np.asarray(points) - [0.5 * (FRONT_M + REAR_M), 0.0]) * SIZE_PX / (2 * REACH_M)
    return np.stack([SIZE_PX / 2 - across[:, 1], SIZE_PX / 2 - across[:, 0]], 1)


def draw_from_above(standing, groups, ground=None):
    """View from above: outlines of what stands, and `groups`: colours and their bodies; over `ground`, if there is one."""
    picture = np.full((SIZE_PX, SIZE_PX, 3), 40, np.uint8) if ground is None else ground

    def outline(corners, colour):
        cv2.polylines(picture, [pixels_from_above(corners).astype(int)], True, colour, 1, cv2.LINE_AA)

    for corners in standing:
        outline(corners, CYAN)
    outline([[FRONT_M, HALF_WIDTH_M], [FRONT_M, -HALF_WIDTH_M], [REAR_M, -HALF_WIDTH_M], [REAR_M, HALF_WIDTH_M]], WHITE)
    for colour, bodies in groups:
        for body in bodies:
            outline(body.corners, colour)
            start, end = pixels_from_above([body.centre, body.centre + body.velocity]).astype(int).tolist()
            cv2.line(picture, start, end, colour, 1, cv2.LINE_AA)
            cv2.putText(picture, body.text, (start[0] + 6, start[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)
    return picture


def draw_moment(above, images, cameras, groups):
    """The view from above beside the images (gray, by camera name) with frames around the bodies of `groups`."""
    parts = []
    for name, image in images.items():
        picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
        for colour, bodies in groups:
            for body in bodies:
                if np.linalg.norm(body.centre) <= REACH_M:
                    frame(picture, body.solid, projection_into(cameras[name]), colour)
        parts.append(label(cv2.resize(picture, IMAGE_PX, interpolation=cv2.INTER_AREA), name))
    if len(parts) % 2:
        parts.append(np.zeros_like(parts[0]))
    rows = np.vstack([np.hstack(parts[i:i + 2]) for i in range(0, len(parts), 2)])
    height = max(len(rows), len(above))
    return np.hstack([cv2.copyMakeBorder(part, 0, height - len(part), 0, 0, cv2.BORDER_CONSTANT) for part in (above, rows)])


def draw(bag, rig, folder, truth_folder, stamp):
    """The picture (BGR) of a stamp (ns)."""
    truth = Truth(truth_folder, stamp)
    groups = ((MAGENTA, read_truth(truth)), (YELLOW, Reports(folder).at(stamp)))
    cameras = vcharge.read_rig(rig).cameras
    above = draw_from_above([truth.footprint(obstacle) for obstacle in truth.standing], groups)
    return draw_moment(above, {name: read_image(bag, name, stamp) for name in cameras}, cameras, groups)


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
