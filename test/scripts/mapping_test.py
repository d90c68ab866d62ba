#!/usr/bin/env python3
"""build_map on a simulated drive: accurate, the same on any number of threads, independent of the truth, and robust."""
import os
import pathlib
import random
import sys
import unittest

import numpy as np
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, run_tool, tool  # noqa: E402
from mapping_fixture import errors_m  # noqa: E402


class MappingTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(drive="figure_eight", duration_s=9, cameras=("front", "left", "rear", "right"),
                          extra=("--image-step", "2"))
        cls.map = cls.drive.folder / "lot.vmap"
        cls.trajectory = cls.drive.folder / "lot.tum"
        status, cls.found, errors = cls.build(cls.drive.bag, cls.map, "--trajectory", cls.trajectory,
                                               "--report", cls.drive.folder / "report")
        if status != 0:
            raise RuntimeError(f"build_map failed: {errors}")

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    @classmethod
    def build(cls, bag, output, *extra, rig=None, prefix=()):
        return run_tool([*prefix, tool("vcharge_mapping", "build_map"), "--bag", bag, "--rig", rig or cls.drive.rig,
                         "--output", output, *extra])

    def rewritten(self, name, change):
        return self.drive.rewrite(name, change)

    def errors_m(self, trajectory):
        return errors_m(trajectory, self.drive.truth / "trajectory.tum")

    def test_the_path_is_right_to_centimetres(self):
        errors = self.errors_m(self.trajectory)
        self.assertGreater(len(errors), 50)
        # Half-size images over about 20 m; the goal for a whole drive at full size is 5 cm.
        self.assertLess(np.sqrt(np.mean(errors ** 2)), 0.05)

    def test_the_map_holds_landmarks_of_all_cameras(self):
        status, found, errors = run_tool([tool("vcharge_mapping", "map_info"), "--map", self.map])
        self.assertEqual((status, errors), (0, []))
        self.assertEqual(found["content_hash"], self.found["content_hash"])
        self.assertEqual({camera["name"] for camera in found["cameras"] if camera["num_observations"] > 0},
                         {"front", "left", "rear", "right"})
        self.assertGreater(found["num_landmarks"], 1000)

    def test_the_report_has_a_verdict_and_says_what_the_tool_says(self):
        page = (self.drive.folder / "report" / "map_report.html").read_text()
        self.assertIn(f'class="verdict {self.found["verdict"]}"', page)
        self.assertIn("no loop was found", page)  # 9 s are shorter than a loop
        self.assertIn(self.found["content_hash"], page)
        self.assertGreaterEqual(page.count("<svg"), 6)
        frames = (self.drive.folder / "report" / "frames.csv").read_text().splitlines()
        self.assertEqual(frames[0], "time_s,motion,keyframe")
        counted = [line.split(",")[1] for line in frames[2:]]  # the first frame has no motion
        motions = self.found["num_motions"]
        self.assertEqual({name: counted.count(name) for name in motions}, motions)

    def test_is_the_same_on_one_thread(self):
        status, found, _ = self.build(self.drive.bag, self.drive.folder / "one.vmap", prefix=("taskset", "-c", "0"))
        self.assertEqual(status, 0)
        self.assertEqual(found["content_hash"], self.found["content_hash"])

    def test_removing_the_ground_truth_changes_nothing(self):
        bag = self.rewritten("blind.bag", lambda topic, message: (
            [] if topic.startswith("/ground_truth") else [(topic, message)]))
        status, found, _ = self.build(bag, self.drive.folder / "blind.vmap")
        self.assertEqual(status, 0)
        self.assertEqual(found["content_hash"], self.found["content_hash"])

    def test_bears_lost_images_a_camera_that_pauses_and_a_gap_in_the_odometry(self):
        chance = random.Random(1)
        start = self.drive.messages()[0][1].header.stamp.to_sec()

        def worse(topic, message):
            time_s = message.header.stamp.to_sec() - start
            lost = topic.endswith("image_raw") and chance.random() < 0.1
            paused = topic == "/camera/left/image_raw" and 2.0 < time_s < 3.5
            gap = topic == "/odom" and 5.0 < time_s < 5.6
            return [] if lost or paused or gap else [(topic, message)]

        trajectory = self.drive.folder / "worse.tum"
        status, found, errors = self.build(self.rewritten("worse.bag", worse), self.drive.folder / "worse.vmap",
                                            "--trajectory", trajectory)
        self.assertEqual((status, errors), (0, []))
        self.assertGreater(found["num_incomplete_frames"], 0)
        self.assertGreater(found["num_frames_without_odometry"], 0)
        self.assertLess(np.sqrt(np.mean(self.errors_m(trajectory) ** 2)), 0.15)

    def test_names_what_is_wrong_and_leaves_the_old_map_alone(self):
        before = self.map.read_bytes()
        no_odometry = self.rewritten("no_odometry.bag", lambda topic, message: (
            [] if topic == "/odom" else [(topic, message)]))
        no_extrinsics = self.drive.write_text("no_extrinsics.yaml", self.without_extrinsics())
        missing = pathlib.Path("/no/such.bag")
        for bag, rig, words in ((no_odometry, None, ("odom",)), (missing, None, ("/no/such.bag",)),
                                (self.drive.bag, no_extrinsics, ("vehicle_from_camera",))):
            status, _, errors = self.build(bag, self.map, rig=rig)
            self.assertNotEqual(status, 0)
            self.assertEqual(len(errors), 1, errors)
            for word in words:
                self.assertIn(word, errors[0])
        self.assertEqual(self.map.read_bytes(), before)

    def without_extrinsics(self):
        lines, skipped = [], False
        for line in self.drive.rig.read_text().splitlines():
            if line.startswith("    vehicle_from_camera"):
                skipped = True
            elif skipped and not line.startswith("      "):
                skipped = False
            if not skipped:
                lines.append(line)
        return "\n".join(lines) + "\n"


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "mapping", MappingTest)
