#!/usr/bin/env python3
"""The depth nodelet on a simulated drive: it equals the offline tool, agrees with the truth, and survives bad input."""
import copy
import os
import sys
import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
import vcharge
import yaml
from sensor_msgs.msg import Image, PointCloud2
from vcharge_msgs.msg import ScheduledCameras

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import CAMERAS, Drive, inputs_of  # noqa: E402
from nodelet_fixture import (Diagnostics, drive_publishers, expect_bad_rig_is_refused, manager_services,  # noqa: E402
                             project_mei, reach, tell_rig_health, wait_for, wait_until_gone)


def rays_without_distortion(width, height, p):
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    x, y = (u - p["u0"]) / p["gamma1"], (v - p["v0"]) / p["gamma2"]
    r = x * x + y * y
    scale = (p["xi"] + np.sqrt(np.maximum(0, 1 + (1 - p["xi"] ** 2) * r))) / (r + 1)
    return np.stack([scale * x, scale * y, scale - p["xi"]]).reshape(3, -1)


class DepthNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive()
        cls.offline = cls.drive.folder / "offline"
        status, output, errors = cls.drive.compute_range_maps(cls.offline, extra=["--online"])
        if status != 0:
            raise RuntimeError(f"compute_range_maps failed: {output} {errors}")
        cls.messages = inputs_of(cls.drive.messages())
        cls.received = {}
        cls.clouds = []

        def keep(topic):
            def callback(message):
                cls.received.setdefault(topic, {})[message.header.stamp.to_nsec()] = message
            return callback

        cls.subscribers = [
            rospy.Subscriber(f"/dense/{camera}/range/{kind}", Image, keep((camera, kind)), queue_size=100)
            for camera in CAMERAS for kind in ("image", "confidence", "standard_deviation")]
        cls.subscribers.append(rospy.Subscriber("/dense/left/points", PointCloud2, cls.clouds.append, queue_size=100))
        cls.diagnostics = Diagnostics()
        cls.subscribers.append(cls.diagnostics.subscriber)
        cls.publishers = drive_publishers(CAMERAS)

        rospy.set_param("/depth/rig", str(cls.drive.rig))
        rospy.set_param("/depth/lossless_replay", True)
        rospy.set_param("/drive_tf/rig", str(cls.drive.rig))
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def setUp(self):
        self.assertTrue(self.load("/depth", "vcharge_dense/depth_nodelet", [], [], [], "").success)
        self.diagnostics.clear()
        reach(self.publishers, self.diagnostics.heard, self.subscribers)
        for kinds in self.received.values():
            kinds.clear()
        self.diagnostics.clear()

    def tearDown(self):
        self.assertTrue(self.unload("/depth").success)
        wait_until_gone("/manager", self.subscribers)
        self.assertNotIn("/depth", self.list().nodelets, "the manager outlives the nodelet")

    def publish(self, change=lambda topic, message: message, pause_s=0.002):
        for topic, message in self.messages:
            changed = change(topic, message)
            if changed is not None:
                self.publishers[topic].publish(changed)
                time.sleep(pause_s)

    def count(self, camera="left"):
        return len(self.received.get((camera, "standard_deviation"), {}))

    def offline_stamps(self, camera):
        return sorted(int(path.stem) for path in (self.offline / camera).glob("*.yaml"))

    def wait_for_message(self, *words):
        # Frames are processed in order: on a busy machine the bad one waits for those before it.
        wait_for(lambda: self.diagnostics.tells(*words), f"a diagnostic with {words}")

    def expect_recovery(self):
        """A good drive gives range maps after bad input."""
        for kinds in self.received.values():
            kinds.clear()
        self.publish()
        wait_for(lambda: self.count() >= len(self.offline_stamps("left")) - 2, "range maps of a good drive")

    def test_equals_the_offline_tool_and_the_truth(self):
        self.publish()
        rig = yaml.safe_load(self.drive.rig.read_text())["cameras"]
        errors = []
        for camera in CAMERAS:
            stamps = self.offline_stamps(camera)
            self.assertGreater(len(stamps), 8)
            wait_for(lambda c=camera, n=len(stamps): self.count(c) >= n, f"the range maps of {camera}")
            self.assertEqual(sorted(self.received[camera, "image"]), stamps)
            for stamp in stamps:
                images, offline = {}, vcharge.read_range_map(self.offline, camera, stamp)
                for kind, part, stored in (("image", "range", offline.range_m), ("confidence", "confidence", offline.confidence),
                                           ("standard_deviation", "sigma", offline.standard_deviation_m)):
                    message = self.received[camera, kind][stamp]
                    self.assertEqual((message.encoding, message.header.frame_id),
                                     ("32FC1", f"camera_{camera}_optical"))
                    images[part] = np.frombuffer(message.data, np.float32).reshape(message.height, message.width)
                    np.testing.assert_array_equal(images[part], stored)
                errors.append(self.relative_errors(camera, stamp, rig[camera]["intrinsics"], images))
        errors = np.concatenate(errors)
        self.assertGreater(errors.size, 100000)
        self.assertLess(np.median(errors), 0.03)
        self.assertGreater(np.mean(errors < 0.05), 0.75)
        wait_for(lambda: self.clouds, "a point cloud")
        self.assertEqual(self.clouds[-1].header.frame_id, "camera_left_optical")

    def relative_errors(self, camera, stamp, intrinsics, images):
        """Errors of the confident pixels against the truth at the nearest sensor pixel."""
        working = yaml.safe_load((self.offline / camera / f"{stamp}.yaml").read_text())["mei"]
        truth = cv2.imread(str(self.drive.truth / "range" / camera / f"{stamp}.tiff"), cv2.IMREAD_UNCHANGED)
        height, width = images["range"].shape
        u, v = project_mei(rays_without_distortion(width, height, working), intrinsics)
        u, v = np.round(u).astype(int), np.round(v).astype(int)
        inside = (u >= 0) & (v >= 0) & (u < truth.shape[1]) & (v < truth.shape[0])
        inside &= (images["confidence"] > 0.5).ravel()
        expected = truth[v[inside], u[inside]]
        error = np.abs(images["range"].ravel()[inside] - expected) / expected
        return error[np.isfinite(error) & (expected > 0.5) & (expected < 20)]

    def test_image_unlike_the_rig_is_reported_and_skipped(self):
        small = Image(height=48, width=64, step=64, encoding="mono8", data=bytes(48 * 64))
        small.header = copy.deepcopy(self.messages[0][1].header)
        self.publishers["/camera/left/image_raw"].publish(small)
        self.wait_for_message("/camera/left/image_raw", "640x400", "64x48")
        self.expect_recovery()

    def test_odometry_that_is_not_finite_is_reported_and_skipped(self):
        bad = copy.deepcopy(next(message for topic, message in self.messages if topic == "/odom"))
        bad.pose.pose.position.x = float("nan")
        self.publishers["/odom"].publish(bad)
        self.wait_for_message("/odom", "finite")
        self.expect_recovery()

    def test_stamps_that_jump_back_are_reported_and_begin_anew(self):
        self.publish()
        wait_for(lambda: self.count() > 8, "range maps")

        def earlier(_topic, message):
            message = copy.copy(message)
            message.header = copy.deepcopy(message.header)
            message.header.stamp = message.header.stamp - rospy.Duration(100.0)
            return message

        for kinds in self.received.values():
            kinds.clear()
        self.publish(earlier)
        self.wait_for_message("jumped back")
        wait_for(lambda: self.count() > 8, "range maps after the jump")

    def test_camera_that_stops_is_named_and_may_return(self):
        self.publish(lambda topic, message: None if topic == "/camera/left/image_raw" else message)
        self.wait_for_message("/camera/left/image_raw", "no data for")
        self.expect_recovery()

    def test_camera_that_moved_is_named_and_goes_on(self):
        tell_rig_health(self.drive.rig, moved="left")
        self.expect_recovery()
        wait_for(lambda: self.diagnostics.tells("left: ", "it moved: its extrinsics must be repaired", level=1), "the warning")

    def test_drive_tf_loads_and_unloads_beside_it(self):
        self.assertTrue(self.load("/drive_tf", "vcharge_ros/drive_tf_nodelet", [], [], [], "").success)
        self.assertEqual(sorted(self.list().nodelets), ["/depth", "/drive_tf"])
        self.assertTrue(self.unload("/drive_tf").success)

    def test_cameras_take_turns_within_a_small_budget(self):
        self.assertTrue(self.unload("/depth").success)
        wait_until_gone("/manager", self.subscribers)
        rospy.set_param("/depth/lossless_replay", False)
        rospy.set_param("/depth/processor_budget", 0.05)
        announced = []
        subscriber = rospy.Subscriber("/dense/scheduled", ScheduledCameras, announced.append, queue_size=None)
        try:
            self.assertTrue(self.load("/depth", "vcharge_dense/depth_nodelet", [], [], [], "").success)
            reach(self.publishers, self.diagnostics.heard, self.subscribers + [subscriber])
            self.publish(pause_s=0.02)
            self.wait_for_message("the processor budget does not suffice")
        finally:
            rospy.set_param("/depth/lossless_replay", True)
            rospy.delete_param("/depth/processor_budget")
            subscriber.unregister()
        turns = [(message.header.stamp.to_nsec(), camera) for message in announced for camera in message.cameras]
        self.assertEqual(len(turns), len(set(turns)))
        self.assertEqual({camera for _, camera in turns}, set(CAMERAS), "no camera is left out for good")
        self.assertLess(len(turns), 0.7 * sum(len(self.offline_stamps(camera)) for camera in CAMERAS))
        wait_for(lambda: all(stamp in self.received.get((camera, "image"), {}) for stamp, camera in turns),
                 "the announced range maps")
        self.assertEqual(sum(self.count(camera) for camera in CAMERAS), len(turns))

    def test_nodelet_with_a_bad_rig_does_not_load_and_the_manager_lives_on(self):
        expect_bad_rig_is_refused(self, "vcharge_dense/depth_nodelet", self.drive.folder / "no_such_rig.yaml")


if __name__ == "__main__":
    rospy.init_node("depth_nodelet_test")
    rostest.rosrun("vcharge_tests", "depth_nodelet", DepthNodeletTest)
