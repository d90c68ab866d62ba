#!/usr/bin/env python3
"""make_masks on a simulated drive finds the body, also into the file that it reads; a short drive leaves that file as it is."""
import json
import os
import sys
import unittest

import cv2
import numpy as np
import rostest
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, run, tool  # noqa: E402


class MakeMasksTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive("figure_eight", duration_s=34, cameras=("left",), extra=("--image-step", "10"), image_scale=0.3)
        truth = yaml.safe_load(cls.drive.rig.read_text())
        cls.body = cv2.imread(str(cls.drive.folder / truth["cameras"]["left"]["mask"]), cv2.IMREAD_GRAYSCALE) == 0
        for key in ("mask", "vehicle_from_camera"):
            del truth["cameras"]["left"][key]
        cls.cameras = yaml.safe_dump(truth)

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def make(self, bag, *extra):
        """Runs the tool with one file as its input and output; returns the file, status, what it printed and its errors."""
        rig = self.drive.write_text("cameras.yaml", self.cameras)
        status, printed, errors = run([tool("vcharge_calibration", "make_masks"), "--bag", bag, "--rig", rig, "--output", rig,
                                       *extra])
        return rig, status, printed, errors

    def test_the_body_is_hidden_and_the_scene_kept(self):
        found, report = self.drive.folder / "found.json", self.drive.folder / "report"
        rig, status, printed, errors = self.make(self.drive.bag, "--json", found, "--report", report)
        self.assertEqual(status, 0, errors)
        self.assertIn("left: PASS", printed)
        self.assertTrue((report / "left.png").exists())
        self.assertEqual(json.loads(found.read_text())["verdict"], "PASS")
        camera = yaml.safe_load(rig.read_text())["cameras"]["left"]
        hidden = cv2.imread(str(rig.parent / camera["mask"]), cv2.IMREAD_GRAYSCALE) == 0
        # At the rim of images this small the body is a seam of a few pixels.
        self.assertGreaterEqual(np.mean(hidden[self.body]), 0.9)
        self.assertLessEqual(np.mean(hidden[~self.body]), 0.02)

    def test_a_short_drive_changes_nothing(self):
        stamps = []

        def shorten(topic, message):
            if topic == "/odom":
                stamps.append(message.header.stamp.to_sec())
            return [(topic, message)] if not stamps or stamps[-1] - stamps[0] < 4.0 else []

        rig, status, printed, errors = self.make(self.drive.rewrite("short.bag", shorten))
        self.assertEqual(status, 1, printed)
        self.assertEqual(len(errors), 1, errors)
        self.assertIn("not enough motion", errors[0])
        self.assertEqual(rig.read_text(), self.cameras)

    def test_a_drive_without_odometry_is_refused(self):
        bag = self.drive.rewrite("blind.bag", lambda topic, message: [] if topic == "/odom" else [(topic, message)])
        rig, status, printed, _ = self.make(bag)
        self.assertEqual(status, 1, printed)
        self.assertEqual(rig.read_text(), self.cameras)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "make_masks", MakeMasksTest)
