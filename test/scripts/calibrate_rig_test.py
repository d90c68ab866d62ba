#!/usr/bin/env python3
"""calibrate_rig on insufficient drives gives the right reason and no file; compare_rigs and evaluate_rig."""
import copy
import os
import sys
import unittest

import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, run, run_tool, tool  # noqa: E402


class CalibrateRigTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive("straight", duration_s=6, extra=(), image_scale=0.25)

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def calibrate(self, bag, *extra, program="calibrate_rig"):
        """Expects a failure that leaves the old file as it is; returns the printed text and the error line."""
        output = self.drive.write_text("rig.yaml", "an older rig\n")
        status, printed, errors = run([tool("vcharge_calibration", program), "--bag", bag, "--rig",
                                       self.drive.rig, "--output", output, *extra])
        self.assertEqual(status, 1, printed)
        self.assertEqual(len(errors), 1, errors)
        self.assertEqual(output.read_text(), "an older rig\n")
        return printed, errors[0]

    def test_straight_ahead_is_not_enough(self):
        report = self.drive.folder / "report"
        map_file = self.drive.folder / "map.vmap"
        printed, error = self.calibrate(self.drive.bag, "--report", report, "--map", map_file)
        self.assertIn("FAIL: camera 'front': no turn", error)
        self.assertIn("figure of eight", error)
        self.assertIn("camera 'left': no turn", printed)
        self.assertFalse(map_file.exists())
        page = (report / "rig_report.html").read_text()
        self.assertIn('class="verdict FAIL"', page)
        self.assertIn("no turn", page)

    def test_a_standing_vehicle_is_told(self):
        poses = []

        def stop(topic, message):
            if topic == "/odom":
                poses.append(message.pose)
                message = copy.deepcopy(message)
                message.pose = poses[0]
            return [(topic, message)]

        _, error = self.calibrate(self.drive.rewrite("standing.bag", stop))
        self.assertIn("the vehicle stood", error)

    def test_a_covered_camera_is_named(self):
        def cover(topic, message):
            if topic == "/camera/left/image_raw":
                message = copy.deepcopy(message)
                message.data = bytes(len(message.data))
            return [(topic, message)]

        printed, _ = self.calibrate(self.drive.rewrite("covered.bag", cover))
        self.assertIn("camera 'left': too few images with tracked points", printed)

    def test_a_drive_without_odometry_is_refused(self):
        bag = self.drive.rewrite("blind.bag", lambda topic, message: [] if topic == "/odom" else [(topic, message)])
        _, error = self.calibrate(bag)
        self.assertIn("/odom", error)

    def test_missing_arguments_are_named(self):
        for program, needs in (("calibrate_rig", ["--bag", "--rig", "--output"]),
                               ("calibrate_rig_from_map", ["--bag", "--rig", "--output", "--map"])):
            for missing in needs:
                words = [word for name in needs if name != missing for word in (name, self.drive.folder / "none")]
                status, _, errors = run([tool("vcharge_calibration", program), *words])
                self.assertNotEqual(status, 0)
                self.assertIn(f"{missing} is required", errors[0])

    def test_a_map_of_unknown_features_is_refused(self):
        map_file = self.drive.folder / "analytic.vmap"
        status, printed, errors = run([tool("vcharge_mapping", "write_analytic_map"), "--output", map_file])
        self.assertEqual(status, 0, printed + str(errors))
        _, error = self.calibrate(self.drive.bag, "--map", map_file, program="calibrate_rig_from_map")
        self.assertIn("feature_options", error)

    def test_a_map_that_is_none_is_named(self):
        map_file = self.drive.write_text("broken.vmap", "not a map")
        _, error = self.calibrate(self.drive.bag, "--map", map_file, program="calibrate_rig_from_map")
        self.assertIn("broken.vmap", error)

    def test_a_rig_is_like_itself_and_unlike_one_that_was_moved(self):
        text = self.drive.rig.read_text()
        line = next(line for line in text.splitlines() if "translation_m" in line)
        x = line.split("[")[1].split(",")[0]
        moved = self.drive.write_text("moved.yaml", text.replace(x, str(float(x) + 0.02), 1))
        compare = tool("vcharge_calibration", "compare_rigs")
        status, output, _ = run([compare, self.drive.rig, moved])
        self.assertEqual(status, 0)
        self.assertIn("forwards     2.000 cm", output)
        status, found, _ = run_tool([tool("vcharge_evaluation", "evaluate_rig"), "--estimate", moved, "--truth",
                                     self.drive.rig])
        self.assertEqual(status, 0)
        front = next(camera for camera in found["as_is"] if camera["camera"] == "front")
        self.assertAlmostEqual(front["error_m"][0], -0.02, places=6)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "calibrate_rig", CalibrateRigTest)
