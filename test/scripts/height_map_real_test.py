#!/usr/bin/env python3
"""The published images of one camera as a height map: flat cobbles, a raised pavement behind a kerb, a hedge."""
import math
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import numpy as np
import rosbag
import rostest
import vcharge

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import counted_skips  # noqa: E402,F401
from drive_fixture import run, tool  # noqa: E402

DATA = os.environ.get("VCHARGE_DATA")
FLAT_M = 0.03
# Areas in metres ahead and to the left of the vehicle at the middle image.
COBBLES = (-2.0, 4.0, 1.25, 3.4)
PAVEMENT = (-3.0, -0.5, 4.25, 5.5)
HEDGE = (2.0, 5.5, 3.9, 5.0)


@unittest.skipUnless(DATA, "VCHARGE_DATA is not set: no height map of the real images")
class HeightMapRealTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        bag, rig, saved = cls.folder / "real.bag", cls.folder / "real.yaml", cls.folder / "map"
        for words in ([tool("vcharge_recordings", "import_vcharge_images"), "--folder", pathlib.Path(DATA) / "vcharge_left",
                       "--output", bag, "--rig", rig],
                      [tool("vcharge_dense", "build_height_map"), "--bag", bag, "--rig", rig, "--output", saved]):
            status, output, errors = run(words)
            if status != 0:
                raise RuntimeError(f"{words[0]} failed: {output} {errors}")
        grid = vcharge.read_height_map(saved)
        with rosbag.Bag(str(bag)) as recording:
            poses = [message.pose.pose for _, message, _ in recording.read_messages(topics=["/odom"])]
        pose = poses[len(poses) // 2]
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        known = np.isfinite(grid.height_m)
        x, y = (grid.centres_m()[known] - [pose.position.x, pose.position.y]).T
        cls.ahead, cls.left = math.cos(yaw) * x + math.sin(yaw) * y, math.cos(yaw) * y - math.sin(yaw) * x
        cls.height = grid.height_m[known].astype(float)
        a = cls.plane_terms(cls.inside(COBBLES))
        cls.plane = np.linalg.lstsq(a, cls.height[cls.inside(COBBLES)], rcond=None)[0]

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def inside(cls, area):
        return (cls.ahead > area[0]) & (cls.ahead < area[1]) & (cls.left > area[2]) & (cls.left < area[3])

    @classmethod
    def plane_terms(cls, chosen):
        return np.stack([cls.ahead[chosen], cls.left[chosen], np.ones(chosen.sum())], 1)

    def above_cobbles(self, area):
        """Heights of an area's cells over the cobbles' plane; most of the area must be in the map."""
        chosen = self.inside(area)
        self.assertGreater(chosen.sum(), 0.6 * (area[1] - area[0]) * (area[3] - area[2]) / 0.05**2)
        return self.height[chosen] - self.plane_terms(chosen) @ self.plane

    def test_cobbles_are_flat(self):
        residuals = self.above_cobbles(COBBLES)
        print(f"cobbles: rms {100 * np.sqrt(np.mean(residuals**2)):.2f} cm, "
              f"95 % within {100 * np.quantile(abs(residuals), 0.95):.2f} cm")
        self.assertLess(np.quantile(abs(residuals), 0.95), FLAT_M)
        self.assertLess(math.hypot(*self.plane[:2]), 0.05)

    def test_pavement_is_raised(self):
        heights = self.above_cobbles(PAVEMENT)
        print(f"pavement: {100 * np.median(heights):.1f} cm above the cobbles")
        self.assertGreater(np.quantile(heights, 0.05), 0.03)
        self.assertLess(np.quantile(heights, 0.95), 0.2)

    def test_hedge_is_raised(self):
        heights = self.above_cobbles(HEDGE)
        print(f"hedge: up to {np.quantile(heights, 0.95):.2f} m")
        self.assertGreater(np.median(heights), 0.15)
        self.assertGreater(np.quantile(heights, 0.95), 0.5)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "height_map_real", HeightMapRealTest)
