#!/usr/bin/env python3
"""The published images of one camera as a drive: the path of build_map against the published poses."""
import copy
import math
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import cv2
import numpy as np
import rosbag
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import counted_skips  # noqa: E402,F401
from drive_fixture import run, tool  # noqa: E402
from mapping_fixture import numbers_of_map  # noqa: E402

DATA = os.environ.get("VCHARGE_DATA")
MAX_LENGTH_ERROR = 0.02
MAX_ROTATION_ERROR_RAD = math.radians(1.0)
BEND_RAD = math.radians(6.0)  # that the bent odometer turns over the drive, besides


def rotation(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def angle(matrix):
    return math.acos(min(1.0, max(-1.0, (np.trace(matrix) - 1) / 2)))


def length(poses):
    return np.linalg.norm(np.diff(poses[:, 1:4], axis=0), axis=1).sum()


def pose_of(message):
    p, q = message.pose.pose.position, message.pose.pose.orientation
    return [message.header.stamp.to_sec(), p.x, p.y, p.z, q.x, q.y, q.z, q.w]


@unittest.skipUnless(DATA, "VCHARGE_DATA is not set: the real images are not mapped")
class MappingRealTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.bag, cls.rig = cls.folder / "real.bag", cls.folder / "real.yaml"
        status, output, errors = run([tool("vcharge_recordings", "import_vcharge_images"), "--folder",
                                      pathlib.Path(DATA) / "vcharge_left", "--output", cls.bag, "--rig", cls.rig])
        if status != 0:
            raise RuntimeError(f"import_vcharge_images failed: {output} {errors}")
        with rosbag.Bag(str(cls.bag)) as bag:
            cls.given = np.array([pose_of(message) for _, message, _ in bag.read_messages(topics=["/odom"])])

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def map(self, bag):
        output, trajectory = self.folder / "real.vmap", self.folder / "real.tum"
        status, text, errors = run([tool("vcharge_mapping", "build_map"), "--bag", bag, "--rig", self.rig, "--output",
                                    output, "--trajectory", trajectory])
        self.assertEqual((status, errors), (0, []), text)
        self.assertIn("frames: 25 (", text)
        for column, values in numbers_of_map(output).items():
            self.assertTrue(np.isfinite(values).all(), column)
        return output, np.loadtxt(trajectory)

    def given_at(self, stamps):
        nearest = [np.abs(self.given[:, 0] - stamp).argmin() for stamp in stamps]
        self.assertLess(np.abs(self.given[nearest, 0] - stamps).max(), 1e-6)
        return self.given[nearest]

    def rotation_errors(self, path):
        """Rotation of each pose relative to the first."""
        given = self.given_at(path[:, 0])
        relative = [[rotation(poses[0, 4:]).T @ rotation(pose[4:]) for pose in poses] for poses in (path, given)]
        return [angle(estimate.T @ truth) for estimate, truth in zip(*relative)]

    def judge(self, path):
        length_error = length(path) / length(self.given_at(path[:, 0])) - 1
        rotation_error_rad = max(self.rotation_errors(path))
        print(f"length {100 * length_error:+.2f} %, rotation {math.degrees(rotation_error_rad):.2f} degrees")
        self.assertLess(abs(length_error), MAX_LENGTH_ERROR)
        self.assertLess(rotation_error_rad, MAX_ROTATION_ERROR_RAD)

    def bent(self):
        """The drive with a planar odometer that turns more than the car, in proportion to the distance."""
        path = self.folder / "bent.bag"
        whole_m = length(self.given)
        before, x, y, heading = None, 0.0, 0.0, 0.0
        with rosbag.Bag(str(self.bag)) as source, rosbag.Bag(str(path), "w") as target:
            for topic, message, stamp in source.read_messages():
                if topic == "/odom":
                    pose = np.array(pose_of(message))
                    true_heading = math.atan2(*rotation(pose[4:])[[1, 0], [0, 0]])
                    if before is not None:
                        step = np.linalg.norm(pose[1:4] - before[0][1:4])
                        turn = math.remainder(true_heading - before[1], 2 * math.pi) + BEND_RAD * step / whole_m
                        x += step * math.cos(heading + turn / 2)
                        y += step * math.sin(heading + turn / 2)
                        heading += turn
                    before = (pose, true_heading)
                    message = copy.deepcopy(message)
                    p, q = message.pose.pose.position, message.pose.pose.orientation
                    p.x, p.y, p.z = x, y, 0.0
                    q.x, q.y, q.z, q.w = 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)
                target.write(topic, message, stamp)
        self.assertGreater(abs(heading - math.remainder(true_heading - math.atan2(
            *rotation(self.given[0, 4:])[[1, 0], [0, 0]]), 2 * math.pi)), 0.9 * BEND_RAD)
        return path

    def test_the_path_is_as_long_and_turns_as_the_given_one(self):
        output, path = self.map(self.bag)
        self.assertEqual(len(path), 25)
        self.judge(path)
        picture = self.folder / "landmarks.png"
        status, text, errors = run([tool("vcharge_mapping", "draw_landmarks"), "--map", output, "--bag", self.bag,
                                    "--camera", "left", "--output", picture])
        self.assertEqual((status, errors), (0, []))
        drawn = cv2.imread(str(picture))
        self.assertEqual(drawn.shape, (800, 1280, 3))
        colourful = (drawn.max(axis=2).astype(int) - drawn.min(axis=2)) > 60
        self.assertGreater(colourful[:780].sum(), 1000, text)
        status, _, errors = run([tool("vcharge_mapping", "draw_landmarks"), "--map", output, "--bag", self.bag,
                                 "--camera", "roof", "--output", self.folder / "none.png"])
        self.assertEqual((status, len(errors)), (1, 1))
        self.assertIn("'roof', expected one of left", errors[0])

    def test_the_images_correct_an_odometer_that_turns_wrongly(self):
        _, path = self.map(self.bent())
        self.judge(path)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "mapping_real", MappingRealTest)
