#!/usr/bin/env python3
"""monitor_rig and its nodelet on a drawn drive: a knocked camera is named and repaired, a sound rig raises no alarm."""
import csv
import math
import os
import pathlib
import shutil
import sys
import tempfile
import time
import unittest

import numpy as np
import rosbag
import rospy
import rostest
import yaml
from std_srvs.srv import Trigger
from vcharge_msgs.msg import CameraHealth, RigHealth

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import drawn_drive  # noqa: E402
from drive_fixture import run, run_tool, tool  # noqa: E402
from nodelet_fixture import (TIMEOUT_S, Diagnostics, drive_publishers, expect_bad_rig_is_refused, manager_services,  # noqa: E402
                             reach, wait_for, wait_until_gone)

CALIBRATION = {"tracker": {"max_tracks_per_camera": 200}}  # sparse, to be quick
CAMERAS = tuple(drawn_drive.CAMERAS)
KNOCK_RAD = math.radians(1.0)
WORK_TIMEOUT_S = 150.0


class MonitorRigTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.steady, cls.knocked, cls.next_day = (cls.folder / f"{name}.bag" for name in ("steady", "knocked", "next_day"))
        cls.rig = cls.folder / "rig.yaml"
        x, y, z, yaw, down = drawn_drive.CAMERAS["left"]
        drawn_drive.write_rig(cls.rig, with_extrinsics=True)
        drawn_drive.write_bag(cls.steady)
        knocked = {**drawn_drive.CAMERAS, "left": (x, y, z, yaw + KNOCK_RAD, down)}
        drawn_drive.write_bag(cls.knocked, knocked=knocked)
        drawn_drive.write_bag(cls.next_day, duration_fraction=0.5, knocked=knocked, knocked_at=0.0)
        cls.options = cls.folder / "calibration_options.yaml"
        cls.options.write_text(yaml.safe_dump(CALIBRATION))
        cls.received, cls.diagnostics = [], Diagnostics()
        cls.subscribers = [cls.diagnostics.subscriber,
                           rospy.Subscriber("/calibration/health", RigHealth, cls.received.append, queue_size=1000)]
        cls.publishers = drive_publishers(CAMERAS)
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def monitor(self, *bags, rig=None):
        output = self.folder / f"{bags[-1].stem}_watched"
        status, found, errors = run_tool([
            tool("vcharge_calibration", "monitor_rig"), "--bag", *bags, "--rig", rig or self.rig, "--output", output,
            "--calibration-options", self.options])
        return status, found, errors, output

    def test_a_sound_rig_raises_no_alarm(self):
        status, found, errors, output = self.monitor(self.steady)
        self.assertEqual(status, 0, errors)
        self.assertEqual(found["verdict"], "PASS", found)
        self.assertEqual(found["changes"], [])
        self.assertGreater(found["distance_m"], 75.0)
        self.assertLess(np.max(np.abs(found["deviation"]) / np.array(found["standard_deviations"])), 3.0)
        self.assertFalse((output / "rig.yaml").exists())
        page = (output / "monitor_report.html").read_text()
        self.assertIn('class="verdict PASS"', page)
        self.assertEqual(page.count("<svg"), 2 * len(CAMERAS) + 1)

    def test_a_knocked_camera_is_named_and_repaired_live_as_offline(self):
        status, found, errors, output = self.monitor(self.knocked)
        self.assertEqual(status, 0, errors)
        self.assertEqual(found["verdict"], "WARN")
        self.assertEqual(len(found["changes"]), 1, found)
        change = found["changes"][0]
        self.assertEqual((change["part"], change["camera"], change["main_axis"]), ("camera", "left", 5))
        self.assertIn("camera left moved: yaw by", change["text"])
        self.assertLess(abs(change["size"][5] - KNOCK_RAD), 4 * change["standard_deviations"][5])
        self.assertLess(change["earliest_m"], 40.0)
        self.assertGreater(change["latest_m"], 40.0)
        self.assertLess(change["found_m"], 70.0)
        self.assertEqual(found["repaired"], ["left"])
        self.check_repaired(output / "rig.yaml")
        self.check_live(output)

    def test_the_next_drive_is_compared_with_the_repaired_rig(self):
        output = self.folder / "next_day_watched"
        output.mkdir()
        (output / "rig.yaml").write_text("older")
        status, found, errors, output = self.monitor(self.knocked, self.next_day)
        self.assertEqual(status, 0, errors)
        self.assertEqual((len(found["changes"]), found["repaired"], found["num_versions"]), (1, ["left"], 1), found)
        self.assertLess(np.max(np.abs(found["deviation"]) / np.array(found["standard_deviations"])), 3.0)
        self.check_repaired(output / "rig.yaml")
        self.assertEqual(yaml.safe_load((output / "rig.yaml").read_text())["provenance"]["version"], 2)
        older = list(output.glob("rig_until_*.yaml"))
        self.assertEqual([path.read_text() for path in older], ["older"])
        page = (output / "monitor_report.html").read_text()
        for event in ("drive knocked.bag", "camera left moved", "new version of the rig: left", "drive next_day.bag"):
            self.assertIn(event, page)

    def check_repaired(self, path):
        before, repaired = yaml.safe_load(self.rig.read_text()), yaml.safe_load(path.read_text())
        self.assertEqual(repaired["cameras"]["front"], before["cameras"]["front"])
        turns = [rig["cameras"]["left"]["vehicle_from_camera"]["rotation_xyzw"] for rig in (before, repaired)]
        turn_rad = 2 * math.acos(min(1.0, abs(np.dot(*turns))))
        self.assertAlmostEqual(turn_rad, KNOCK_RAD, delta=math.radians(0.1))
        covariance = np.array(repaired["cameras"]["left"]["vehicle_from_camera"]["covariance"]).reshape(6, 6)
        self.assertTrue(np.all(np.linalg.eigvalsh(covariance) > 0))
        self.assertIn("camera left moved", repaired["provenance"]["evidence"])

    def check_live(self, offline):
        repaired = self.folder / "live.yaml"
        rospy.set_param("/monitor", {"rig": str(self.rig), "output": str(repaired), "lossless_replay": True,
                                     "calibration": CALIBRATION})
        self.received.clear()
        self.assertTrue(self.load("/monitor", "vcharge_calibration/monitor_nodelet", [], [], [], "").success)
        try:
            repair = rospy.ServiceProxy("/monitor/repair", Trigger)
            repair.wait_for_service(TIMEOUT_S)
            reach(self.publishers, self.diagnostics.heard, self.subscribers)
            self.assertIn("no camera moved", repair().message)
            with rosbag.Bag(str(self.knocked)) as bag:
                for topic, message, _ in bag.read_messages():
                    self.publishers[topic].publish(message)
                    time.sleep(0.002)  # topics must not drift apart by the sorting window on a busy machine
            rows = list(csv.DictReader((offline / "deviation.csv").open()))
            wait_for(lambda: len(self.received) >= len(rows) - 1, "the parts of the drive", WORK_TIMEOUT_S)
            for health, expected in zip(self.received, rows):
                self.assertAlmostEqual(health.distance_m, float(expected["driven_m"]), places=5)
                left = next(camera for camera in health.cameras if camera.camera == "left")
                self.assertAlmostEqual(left.deviation[5], float(expected["left yaw"]), places=7)
            self.assertEqual(left.state, CameraHealth.MOVED)
            self.assertEqual(health.cameras[0].state, CameraHealth.OK)
            self.assertIn("camera left moved", health.changes[0])
            wait_for(lambda: self.diagnostics.tells("camera left moved", level=1), "the warning")
            answer = repair()
            self.assertTrue(answer.success, answer.message)
            self.check_repaired(repaired)
            self.assertIn("no camera moved", repair().message)  # the repaired rig is watched from now on
            expect_bad_rig_is_refused(self, "vcharge_calibration/monitor_nodelet", self.folder / "none.yaml")
        finally:
            self.unload("/monitor")
            wait_until_gone("/manager", self.subscribers)
            rospy.delete_param("/monitor")

    def test_bad_input_is_one_line(self):
        bare = self.folder / "bare.yaml"
        drawn_drive.write_rig(bare, with_extrinsics=False)
        status, _, errors, _ = self.monitor(self.steady, rig=bare)
        self.assertEqual((status, len(errors)), (1, 1), errors)
        self.assertIn("vehicle_from_camera", errors[0])
        standing = self.folder / "standing.bag"
        drawn_drive.write_bag(standing, duration_fraction=0.002)
        status, _, errors, output = self.monitor(standing)
        self.assertEqual((status, len(errors)), (1, 1), errors)
        self.assertIn("the car did not move", errors[0])
        self.assertFalse((output / "rig.yaml").exists())
        for missing in ("--bag", "--rig", "--output"):
            words = [word for name in ("--bag", "--rig", "--output") if name != missing
                     for word in (name, self.folder / "none")]
            status, _, errors = run([tool("vcharge_calibration", "monitor_rig"), *words])
            self.assertNotEqual(status, 0)
            self.assertIn(f"{missing} is required", errors[0])


if __name__ == "__main__":
    rospy.init_node("monitor_rig_test")
    rostest.rosrun("vcharge_tests", "monitor_rig", MonitorRigTest)
