#!/usr/bin/env python3
"""The object nodelet beside a standing car with people around it: it equals the offline tool, and keeps up with a live drive by
dropping images."""
import collections
import csv
import os
import sys
import time
import unittest

import rospy
import rostest
import yaml
from nav_msgs.msg import OccupancyGrid
from vcharge_msgs.msg import TrackedObjects
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import CAMERAS, Drive, inputs_of, run, tool  # noqa: E402
from nodelet_fixture import (Diagnostics, drive_publishers, expect_bad_rig_is_refused, manager_services,  # noqa: E402
                             reach, replay, wait_for, wait_until_gone)

OPTIONS = {"ignore_hidden": False}  # no obstacle map is published here


class ObjectNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        movers = [word for name, number in (("people", 8), ("children", 4), ("cars", 2))
                  for word in ("--set", f"movers.{name}={number}")]
        cls.drive = Drive(drive="standing", duration_s=3.0, extra=movers)
        offline = cls.drive.folder / "offline"
        status, output, errors = run([tool("vcharge_obstacles", "detect_obstacles"), "--bag", cls.drive.bag, "--rig",
                                      cls.drive.rig, "--object-options",
                                      cls.drive.write_text("objects.yaml", yaml.safe_dump(OPTIONS)), "--output", offline])
        if status != 0:
            raise RuntimeError(f"detect_obstacles failed: {output} {errors}")
        with open(offline / "objects_frames.csv", encoding="utf-8") as file:
            cls.stamps = [int(row["stamp_ns"]) for row in csv.DictReader(file)]
        cls.offline = collections.defaultdict(dict)
        with open(offline / "objects.csv", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                cls.offline[int(row["stamp_ns"])][int(row["id"])] = row
        cls.messages = inputs_of(cls.drive.messages())
        cls.received, cls.markers = {}, []
        cls.diagnostics = Diagnostics()
        cls.subscribers = [
            rospy.Subscriber("/obstacles/objects", TrackedObjects, cls.keep, queue_size=1000),
            rospy.Subscriber("/obstacles/object_markers", MarkerArray, cls.markers.append, queue_size=1000),
            cls.diagnostics.subscriber]
        cls.publishers = drive_publishers(CAMERAS)
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def keep(cls, message):
        cls.received[message.header.stamp.to_nsec()] = message

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def start(self, is_lossless):
        rospy.set_param("/objects", {"rig": str(self.drive.rig), "lossless_replay": is_lossless, "options": OPTIONS})
        self.assertTrue(self.load("/objects", "vcharge_obstacles/object_nodelet", [], [], [], "").success)
        self.diagnostics.clear()
        reach(self.publishers, self.diagnostics.heard, self.subscribers)
        self.received.clear()
        self.markers.clear()

    def tearDown(self):
        if "/objects" in self.list().nodelets:
            self.assertTrue(self.unload("/objects").success)
            wait_until_gone("/manager", self.subscribers)

    def test_replay_without_loss_equals_the_tool(self):
        self.start(is_lossless=True)
        for topic, message in self.messages:
            self.publishers[topic].publish(message)
            time.sleep(0.002)
        wait_for(lambda: len(self.received) >= len(self.stamps) - 3, "objects of almost all images", 120.0)
        self.assertLessEqual(set(self.received), set(self.stamps))
        num_compared = 0
        for stamp, message in self.received.items():
            self.assertEqual(message.header.frame_id, "odom")
            expected = self.offline[stamp]
            self.assertEqual({one.id for one in message.objects}, set(expected), stamp)
            for one in message.objects:
                row = expected[one.id]
                for value, key in ((one.pose.position.x, "x_m"), (one.pose.position.y, "y_m"),
                                   (one.velocity.x, "vx_m_per_s"), (one.velocity.y, "vy_m_per_s"),
                                   (one.height_m, "height_m"), (one.existence_probability, "existence_probability")):
                    self.assertAlmostEqual(value, float(row[key]), 6, f"{stamp} {key}")
                self.assertGreaterEqual(len(one.footprint.points), 3)
                num_compared += 1
        self.assertGreater(num_compared, 0, "nothing that moves was found in the drive")
        self.assertGreater(len(self.markers), 0)

    def test_live_drive_goes_on_when_images_are_dropped(self):
        self.start(is_lossless=False)
        replay(self.messages, self.publishers)
        wait_for(lambda: len(self.received) >= len(self.stamps) // 6, "objects of some images", 60.0)
        self.assertLessEqual(set(self.received), set(self.stamps))
        wait_for(lambda: "dropped" in self.diagnostics.values("objects"), "the number of dropped images")

    def test_bad_obstacle_map_is_refused_and_the_nodelet_goes_on(self):
        self.start(is_lossless=True)
        publisher = rospy.Publisher("/obstacles/grid", OccupancyGrid, queue_size=1)
        wait_for(lambda: publisher.get_num_connections() > 0, "the nodelet to subscribe to the map")
        publisher.publish(OccupancyGrid())
        wait_for(lambda: self.diagnostics.tells("/obstacles/grid", "expected a stamp"), "the error")
        for topic, message in self.messages:
            self.publishers[topic].publish(message)
            time.sleep(0.002)
        wait_for(lambda: len(self.received) >= len(self.stamps) - 3, "objects of almost all images", 120.0)

    def test_missing_rig_is_refused(self):
        expect_bad_rig_is_refused(self, "vcharge_obstacles/object_nodelet", self.drive.folder / "none.yaml")


if __name__ == "__main__":
    rospy.init_node("object_nodelet_test")
    rostest.rosrun("vcharge_tests", "object_nodelet", ObjectNodeletTest)
