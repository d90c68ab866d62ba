#!/usr/bin/env python3
"""Ranges, obstacle map and objects of all four cameras in one manager, while a drive replays in real time beside a process that
keeps a core busy: maps and objects go on, in order, up to the end of the drive, and what is dropped is counted."""
import math
import os
import subprocess
import sys
import unittest

import rospy
import rostest
from nav_msgs.msg import OccupancyGrid
from vcharge_msgs.msg import Corridor, TrackedObjects

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, inputs_of  # noqa: E402
from nodelet_fixture import Diagnostics, drive_publishers, manager_services, replay, wait_for  # noqa: E402

CAMERAS = ("front", "left", "rear", "right")
TOPICS = {"/obstacles/grid": OccupancyGrid, "/obstacles/corridor": Corridor, "/obstacles/objects": TrackedObjects}
NODELETS = {"/depth": "vcharge_dense/depth_nodelet", "/obstacles": "vcharge_obstacles/obstacle_nodelet",
            "/objects": "vcharge_obstacles/object_nodelet"}
OPTIONS = {"/depth": {"preset": "fast", "working_camera": {"image_scale": 0.5}}}
DURATION_S = 4.0


class AroundLiveTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(duration_s=DURATION_S, cameras=CAMERAS, extra=("--set", "movers.people=6"))
        cls.messages = inputs_of(cls.drive.messages())
        cls.received = {topic: [] for topic in TOPICS}
        cls.subscribers = [rospy.Subscriber(topic, kind, cls.received[topic].append, queue_size=1000)
                           for topic, kind in TOPICS.items()]
        cls.diagnostics = Diagnostics()
        cls.publishers = drive_publishers(CAMERAS)
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def stamps(self, topic):
        return [message.header.stamp.to_sec() for message in list(self.received[topic])]

    def test_all_goes_on_beside_a_busy_core_and_losses_are_reported(self):
        for name, kind in NODELETS.items():
            rospy.set_param(name, {"rig": str(self.drive.rig), "options": OPTIONS.get(name, {})})
            self.assertTrue(self.load(name, kind, [], [], [], "").success)
        # Depth and objects read the images, the map of obstacles reads their fingerprints.
        wait_for(lambda: all(publisher.get_num_connections() > 0 for publisher in self.publishers.values()),
                 "the nodelets to subscribe")
        wait_for(lambda: all(subscriber.get_num_connections() > 0 for subscriber in self.subscribers),
                 "the results to be connected")
        busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
        try:
            replay(self.messages, self.publishers)
        finally:
            busy.kill()
            busy.wait()
        first, last = (self.messages[i][1].header.stamp.to_sec() for i in (0, -1))
        for topic in TOPICS:
            wait_for(lambda topic=topic: self.stamps(topic) and self.stamps(topic)[-1] > first + 0.8 * DURATION_S,
                     f"{topic} of the end of the drive")
            stamps = self.stamps(topic)
            self.assertEqual(stamps, sorted(set(stamps)), f"{topic}: stamps in order, each once")
            self.assertGreaterEqual(stamps[0], first)
            self.assertLessEqual(stamps[-1], last)
            self.assertGreater(len(stamps), 3, topic)
        # How much ground is known depends on how many range maps a busy machine computes: a slow one may know none.
        for grid in self.received["/obstacles/grid"]:
            self.assertLessEqual(set(grid.data), set(range(-1, 101)), "cells are unknown or a probability in percent")
        wait_for(lambda: "dropped" in self.diagnostics.values("objects"), "the number of images without objects")
        values = wait_for(lambda: self.diagnostics.values("obstacles/front"), "the state of the front camera's map")
        for key in ("dropped_of_all_cameras", "waiting_stamps"):
            self.assertGreaterEqual(int(values[key]), 0, key)
        # Without free ground beyond the rim there is no age: it is not a number. A metre of free ground has one.
        for corridor in self.received["/obstacles/corridor"]:
            for way in (corridor.forward, corridor.backward):
                is_nothing_known = math.isnan(way.oldest_age_s) and way.free_beyond_rim_m < 1.0
                self.assertTrue(way.oldest_age_s >= 0.0 or is_nothing_known, f"age of the corridor: {way}")
        self.assertEqual(set(self.list().nodelets), set(NODELETS), "all live on")


if __name__ == "__main__":
    rospy.init_node("around_live_test")
    rostest.rosrun("vcharge_tests", "around_live", AroundLiveTest)
