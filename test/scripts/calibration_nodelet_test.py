#!/usr/bin/env python3
"""The calibration nodelet on a drawn drive: it reports missing manoeuvres, finds the rig of calibrate_rig, and survives insufficient drives."""
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
from nav_msgs.msg import Path
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger
from vcharge_msgs.msg import CalibrationStatus
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import drawn_drive  # noqa: E402
from drive_fixture import run, tool  # noqa: E402
from nodelet_fixture import (TIMEOUT_S, Diagnostics, drive_publishers, manager_services, reach, wait_for,  # noqa: E402
                             wait_until_gone)

OPTIONS = {"keyframe_distance_m": 0.9, "tracker": {"max_tracks_per_camera": 200}}  # sparse, to be quick
CAMERAS = tuple(drawn_drive.CAMERAS)
WORK_TIMEOUT_S = 150.0
ENDED = (CalibrationStatus.DONE, CalibrationStatus.FAILED)


def rig_of(path):
    return yaml.safe_load(path.read_text())


class CalibrationNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.bag, cls.cameras = cls.folder / "drive.bag", cls.folder / "cameras.yaml"
        cls.truth = cls.folder / "rig_truth.yaml"
        drawn_drive.write_bag(cls.bag)
        drawn_drive.write_rig(cls.cameras, with_extrinsics=False)
        drawn_drive.write_rig(cls.truth, with_extrinsics=True)
        with rosbag.Bag(str(cls.bag)) as bag:
            cls.messages = [(topic, message) for topic, message, _ in bag.read_messages()]
        cls.num_frames = sum(topic == "/camera/front/image_raw" for topic, _ in cls.messages)
        cls.states, cls.received = [], {}

        def keep(topic):
            return lambda message: cls.received.setdefault(topic, []).append(message)

        cls.subscribers = [rospy.Subscriber(topic, kind, keep(topic), queue_size=1000) for topic, kind in (
            ("/calibration/landmarks", PointCloud2), ("/calibration/trajectory", Path),
            ("/calibration/cameras", MarkerArray))]
        cls.subscribers.append(rospy.Subscriber("/calibration/status", CalibrationStatus, cls.states.append,
                                                queue_size=1000))
        cls.diagnostics = Diagnostics()
        cls.subscribers.append(cls.diagnostics.subscriber)
        cls.publishers = drive_publishers(CAMERAS)
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.work = self.folder / self.id().split(".")[-1]
        self.work.mkdir()
        self.output = self.work / "rig.yaml"
        rospy.set_param("/calibration", {
            "rig": str(self.cameras), "output": str(self.output), "map": str(self.work / "room.vmap"),
            "trajectory": str(self.work / "path.tum"), "report": str(self.work / "report"), "lossless_replay": True,
            "options": OPTIONS, "session": {"coach": {"enough_distance_m": 70.0}}})

    def start(self):
        self.assertTrue(self.load("/calibration", "vcharge_calibration/calibration_nodelet", [], [], [], "").success)
        self.calibrate = rospy.ServiceProxy("/calibration/calibrate", Trigger)
        self.reset = rospy.ServiceProxy("/calibration/reset", Trigger)
        self.calibrate.wait_for_service(TIMEOUT_S)
        self.diagnostics.clear()
        reach(self.publishers, self.diagnostics.heard, self.subscribers)
        self.states.clear()
        for kind in self.received.values():
            kind.clear()

    def tearDown(self):
        if "/calibration" in self.list().nodelets:
            self.assertTrue(self.unload("/calibration").success)
        wait_until_gone("/manager", self.subscribers)
        self.assertEqual(self.list().nodelets, [], "the manager outlives the nodelet")
        rospy.delete_param("/calibration")

    def publish(self, fraction=1.0):
        """Publishes the first part of the drive; returns when the nodelet has processed it and is idle, since unloading
        a nodelet inside a callback destroys its queues first."""
        count = int(fraction * len(self.messages))
        for topic, message in self.messages[:count]:
            self.publishers[topic].publish(message)
            time.sleep(0.002)  # topics must not drift apart by the sorting window on a busy machine
        expected = int(fraction * self.num_frames) - 10
        wait_for(lambda: self.num_followed() >= expected, "the frames", WORK_TIMEOUT_S)
        while True:
            before = self.num_followed()
            time.sleep(2.5)  # more than two periods of diagnostics
            if self.num_followed() == before:
                break

    def num_followed(self):
        return int(self.diagnostics.values("calibration/rig").get("frames", 0))

    def wait_for_end(self):
        return wait_for(lambda: next((state for state in list(self.states) if state.state in ENDED), None),
                        "the calibration to end", WORK_TIMEOUT_S)

    def test_coaches_and_finds_the_rig_of_the_offline_tool(self):
        self.start()
        self.publish()
        coached = list(self.states)
        nexts = [state.next for state in coached]
        self.assertIn("degrees more", nexts[0])
        self.assertTrue(any(text.startswith("turn right") for text in nexts), nexts)
        self.assertEqual(nexts[-1], "you can stop now", coached[-1])
        self.assertEqual(coached[-1].state, CalibrationStatus.READY)
        self.assertEqual(list(coached[-1].missing), [])
        self.assertAlmostEqual(coached[-1].left_turn_rad, 3 * math.pi, delta=0.6)  # an outlook every 2 m
        self.assertAlmostEqual(coached[-1].right_turn_rad, 2 * math.pi, delta=0.1)
        predicted = {camera.camera: camera for camera in coached[-1].cameras}
        self.assertEqual(tuple(predicted), CAMERAS)
        for camera in predicted.values():
            self.assertTrue(camera.is_prediction and camera.is_enough, camera)
            self.assertTrue(0.0 < camera.x_m < 0.1 and math.isnan(camera.z_m), camera)

        answer = self.calibrate()
        self.assertTrue(answer.success, answer.message)
        self.assertFalse(self.calibrate().success, "it is being calibrated")
        end = self.wait_for_end()
        self.assertEqual(end.state, CalibrationStatus.DONE, end.message)
        work = [state for state in self.states if state.state == CalibrationStatus.CALIBRATING]
        progress = [state.progress for state in work]
        self.assertEqual(progress, sorted(progress))
        self.assertTrue(any("judgement" in state.message for state in work))
        self.check_result(end, predicted)
        self.check_shown()
        self.check_offline()

    def check_result(self, end, predicted):
        truth, found = rig_of(self.truth)["cameras"], rig_of(self.output)["cameras"]
        for camera in end.cameras:
            there, here = (rig[camera.camera]["vehicle_from_camera"] for rig in (truth, found))
            # Four reported standard deviations: a few centimetres for images this small.
            for axis, sigma_m in enumerate((camera.x_m, camera.y_m, camera.z_m)):
                self.assertLess(sigma_m, 0.05)
                self.assertLess(abs(there["translation_m"][axis] - here["translation_m"][axis]), 4 * sigma_m + 0.01, camera)
            turn = abs(np.dot(there["rotation_xyzw"], here["rotation_xyzw"]))
            sigma_rad = math.sqrt(camera.roll_rad**2 + camera.pitch_rad**2 + camera.yaw_rad**2)
            self.assertLess(2 * math.acos(min(1.0, turn)), 4 * sigma_rad + 0.002, camera)
            self.assertFalse(camera.is_prediction)
            self.assertLess(camera.yaw_rad, predicted[camera.camera].yaw_rad, "predictions bound the final sigma")
            self.assertLess(camera.x_m, predicted[camera.camera].x_m, "predictions bound the final sigma")
        self.assertTrue((self.work / "room.vmap").exists())
        self.assertIn("class=\"verdict", (self.work / "report" / "rig_report.html").read_text())

    def check_shown(self):
        paths = self.received["/calibration/trajectory"]
        lengths = [len(path.poses) for path in paths]
        self.assertGreater(len(lengths), 5, "the path is shown while it grows")
        self.assertEqual(lengths, sorted(lengths))
        # The landmarks may arrive after the status "calibrated".
        wait_for(lambda: self.received["/calibration/landmarks"][-1].width > 1000, "the map's landmarks")
        cloud = self.received["/calibration/landmarks"][-1]
        self.assertEqual(cloud.header.frame_id, "map")
        points = np.array(list(point_cloud2.read_points(cloud, field_names=("x", "y", "z", "rgb"))))
        self.assertEqual(len(np.unique(points[:, 3])), len(CAMERAS), "a colour per camera")
        # The map's ground is the floor; the ceiling is 5 m above it.
        self.assertLess(np.quantile(np.abs(points[:, 2][points[:, 2] < 0.5]), 0.5), 0.05)
        markers = self.received["/calibration/cameras"][-1].markers
        self.assertEqual({marker.text.split()[0] for marker in markers if marker.ns == "names"}, set(CAMERAS))

    def check_offline(self):
        offline, options = self.work / "offline.yaml", self.work / "options.yaml"
        options.write_text(yaml.safe_dump(OPTIONS))
        status, output, errors = run([tool("vcharge_calibration", "calibrate_rig"), "--bag", self.bag, "--rig",
                                      self.cameras, "--output", offline, "--trajectory", self.work / "offline.tum",
                                      "--options", options])
        self.assertEqual(status, 0, f"{output} {errors}")
        self.assertEqual(rig_of(offline)["cameras"], rig_of(self.output)["cameras"])
        self.assertEqual((self.work / "offline.tum").read_text(), (self.work / "path.tum").read_text())

    def test_a_short_drive_fails_with_the_reason_and_may_go_on_or_begin_anew(self):
        self.output.write_text("an older rig\n")
        self.start()
        self.assertTrue(self.calibrate().success)
        self.assertIn("no images", self.wait_for_end().message)
        self.states.clear()
        self.publish(0.1)
        self.assertEqual(self.states[-1].state, CalibrationStatus.COLLECTING, "the drive goes on")
        self.states.clear()
        self.assertTrue(self.calibrate().success)
        end = self.wait_for_end()
        self.assertEqual(end.state, CalibrationStatus.FAILED)
        self.assertTrue(end.message.startswith("FAIL; "), end.message)
        self.assertIn("the drive turned only 0 degrees to the right", end.message)
        self.assertIn("degrees more", end.next)
        self.assertEqual(self.output.read_text(), "an older rig\n")
        self.assertFalse((self.work / "room.vmap").exists())
        self.assertIn("turned only 0 degrees to the right", (self.work / "report" / "rig_report.html").read_text())
        wait_for(lambda: self.diagnostics.tells("turned only"), "a diagnostic")
        self.states.clear()
        self.assertTrue(self.reset().success)
        state = wait_for(lambda: list(self.states), "a status")[-1]
        self.assertEqual((state.state, state.num_views, state.distance_m), (CalibrationStatus.COLLECTING, 0, 0.0))
        self.publish(0.1)
        self.assertGreater(self.states[-1].distance_m, 2.0)

    def test_calibrates_itself_while_the_drive_goes_on(self):
        rospy.set_param("/calibration/session", {"calibrates_itself": True, "coach": {
            "enough_distance_m": 10.0, "enough_turn_rad": 0.001, "enough_revisited_m": 0.0, "enough_sigma_m": 0.5,
            "enough_sigma_rad": 0.05, "min_steps": 1000}})
        self.start()
        self.publish(0.5)
        end = self.wait_for_end()
        states = [state.state for state in self.states]
        self.assertIn(CalibrationStatus.CALIBRATING, states)
        before = states[:states.index(CalibrationStatus.CALIBRATING)]
        self.assertNotIn(CalibrationStatus.FAILED, before, "an early failure is no news")
        self.assertGreater(end.distance_m, 10.0)
        self.assertEqual(self.output.exists(), end.state == CalibrationStatus.DONE, end.message)

    def test_a_rig_that_cannot_be_written_is_told(self):
        rospy.set_param("/calibration/report", "/proc/none")
        self.start()
        self.publish(0.1)
        self.assertTrue(self.calibrate().success)
        end = self.wait_for_end()
        self.assertEqual(end.state, CalibrationStatus.FAILED)
        self.assertIn("/proc/none", end.message)

    def test_bad_parameters_do_not_load_and_the_manager_lives_on(self):
        for name, value, what in (("rig", "/none.yaml", "a rig that is not there"),
                                  ("session", {"coach": {"enough_turn_rad": -1.0}}, "a bad option"),
                                  ("options", {"no_such_option": 1}, "an option that there is not")):
            good = rospy.get_param("/calibration")
            rospy.set_param(f"/calibration/{name}", value)
            with self.assertRaises(rospy.ServiceException, msg=what):
                self.load("/calibration", "vcharge_calibration/calibration_nodelet", [], [], [], "")
            rospy.set_param("/calibration", good)


if __name__ == "__main__":
    rospy.init_node("calibration_nodelet_test")
    rostest.rosrun("vcharge_tests", "calibration_nodelet", CalibrationNodeletTest)
