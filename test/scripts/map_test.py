#!/usr/bin/env python3
"""A saved map: the description of map_info, and the messages of map_publisher_nodelet."""
import math
import os
import pathlib
import shutil
import sqlite3
import struct
import sys
import tempfile
import unittest

import rospy
import rostest
from nav_msgs.msg import Path
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import files_below, run, tool  # noqa: E402
from nodelet_fixture import TIMEOUT_S, manager_services, wait_for  # noqa: E402

NUM_KEYFRAMES = 24
RADIUS_M = 20.0  # of the circle that the analytic map's vehicle drives on, to the left
TOPICS = (("/mapping/landmarks", PointCloud2), ("/mapping/trajectory", Path), ("/mapping/loop_edges", MarkerArray))


def keyframe_position(i):
    angle = 2.0 * math.pi * i / NUM_KEYFRAMES
    return RADIUS_M * math.sin(angle), RADIUS_M * (1.0 - math.cos(angle))


class MapTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.map = cls.folder / "lot.vmap"
        status, _, errors = run([tool("vcharge_mapping", "write_analytic_map"), "--output", cls.map])
        if status != 0:
            raise RuntimeError(f"write_analytic_map failed: {errors}")
        connection = sqlite3.connect(str(cls.map))
        cls.landmarks = connection.execute("SELECT x_m, y_m, z_m, sigma_m FROM landmark ORDER BY id").fetchall()
        connection.close()
        cls.load, cls.unload, cls.list = manager_services()
        cls.logged = []
        cls.log = rospy.Subscriber("/rosout", Log, lambda m: cls.logged.append(m.msg), queue_size=100)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def publish(self, path=None, version=0):
        rospy.set_param("/map_publisher/map", str(path or self.map))
        rospy.set_param("/map_publisher/version", version)
        self.assertTrue(self.load("/map_publisher", "vcharge_mapping/map_publisher_nodelet", [], [], [], "").success)
        self.addCleanup(self.unload, "/map_publisher")

    def test_map_info_describes_a_map_and_writes_its_trajectory(self):
        tum = self.folder / "map.tum"
        status, output, errors = run([tool("vcharge_mapping", "map_info"), "--map", self.map, "--trajectory", tum,
                                      "--loop-edges"])
        self.assertEqual((status, errors), (0, []))
        for words in (f"landmarks     {len(self.landmarks)}\n", f"keyframes     {NUM_KEYFRAMES} over 120.1 m",
                      "content hash  ", "1 accepted, 1 rejected", "outlier of the pose graph", "bag: analytic.bag",
                      "error rms (px)", "distance 1.01250"):
            self.assertIn(words, output)
        poses = [line.split() for line in tum.read_text().splitlines() if not line.startswith("#")]
        self.assertEqual(len(poses), NUM_KEYFRAMES)
        for i, pose in enumerate(poses):
            self.assertEqual(pose[0], f"{1342626148 + (354042000 + i * 500000000) // 10**9}."
                                      f"{(354042000 + i * 500000000) % 10**9:09d}")
            self.assertAlmostEqual(float(pose[1]), keyframe_position(i)[0], delta=1e-6)
            self.assertAlmostEqual(float(pose[2]), keyframe_position(i)[1], delta=1e-6)
        before = files_below(self.folder)
        status, again, _ = run([tool("vcharge_mapping", "map_info"), "--map", self.map])
        self.assertEqual(status, 0)
        self.assertTrue(output.startswith(again.split("loop edges")[0]))
        self.assertEqual(files_below(self.folder), before, "reading writes nothing")

    def test_publishes_the_map_to_whoever_comes_later(self):
        self.publish()
        for _ in range(2):  # latched
            cloud, path, edges = [rospy.wait_for_message(topic, kind, TIMEOUT_S) for topic, kind in TOPICS]
        for message in (cloud, path, *edges.markers):
            self.assertEqual(message.header.frame_id, "map")
        self.assertEqual([f.name for f in cloud.fields], ["x", "y", "z", "observations", "sigma_m"])
        self.assertEqual(cloud.width * cloud.height, len(self.landmarks))
        for i, (x, y, z, sigma) in enumerate(self.landmarks):
            values = struct.unpack_from("<5f", cloud.data, i * cloud.point_step)
            for value, expected in zip((*values[:3], values[4]), (x, y, z, sigma)):
                self.assertAlmostEqual(value, expected, delta=1e-5)
            self.assertGreaterEqual(values[3], 1.0)
        self.assertEqual(len(path.poses), NUM_KEYFRAMES)
        for i, pose in enumerate(path.poses):
            self.assertAlmostEqual(pose.pose.position.x, keyframe_position(i)[0], delta=1e-9)
            self.assertAlmostEqual(pose.pose.position.y, keyframe_position(i)[1], delta=1e-9)
        by_name = {marker.ns: marker for marker in edges.markers}
        self.assertEqual(set(by_name), {"accepted", "rejected"})
        for name, last in (("accepted", NUM_KEYFRAMES - 1), ("rejected", (NUM_KEYFRAMES - 1) // 2)):
            marker = by_name[name]
            self.assertEqual((marker.type, marker.action), (Marker.LINE_LIST, Marker.ADD))
            self.assertEqual(len(marker.points), 2)
            self.assertAlmostEqual(marker.points[1].x, keyframe_position(last)[0], delta=1e-9)
        self.assertNotEqual(by_name["accepted"].color, by_name["rejected"].color)

    def test_shows_versions_and_what_changed(self):
        first, other, path = [self.folder / f"{name}.vmap" for name in ("first", "other", "versions")]
        for written, keyframes in ((first, NUM_KEYFRAMES), (other, 12)):
            run([tool("vcharge_mapping", "write_analytic_map"), "--output", written, "--keyframes", keyframes,
                 "--descriptor-bytes", 32])
        status, _, errors = run([tool("vcharge_mapping", "merge_maps"), "--map", first, "--session", other, "--output", path])
        self.assertEqual((status, errors), (0, []))
        for version, num_appeared in ((1, 0), (2, 1), (0, 1)):
            self.publish(path, version)
            cloud = rospy.wait_for_message("/mapping/landmarks", PointCloud2, TIMEOUT_S)
            changes = rospy.wait_for_message("/mapping/changes", MarkerArray, TIMEOUT_S)
            by_name = {marker.ns: marker for marker in changes.markers}
            self.assertEqual(set(by_name), {"appeared", "vanished", "moved"})
            appeared = len(by_name["appeared"].points)
            self.assertEqual(cloud.width * cloud.height, len(self.landmarks) + appeared)
            self.assertEqual(appeared > 0, num_appeared > 0)
            self.assertEqual(by_name["appeared"].action, Marker.ADD if appeared else Marker.DELETE)
            self.assertEqual(by_name["vanished"].action, Marker.DELETE)
            self.doCleanups()
        rospy.set_param("/map_publisher/version", 7)
        with self.assertRaises(rospy.ServiceException):
            self.load("/map_publisher", "vcharge_mapping/map_publisher_nodelet", [], [], [], "")

    def test_a_bad_map_does_not_load_and_the_manager_lives_on(self):
        cut = self.folder / "cut.vmap"
        cut.write_bytes(self.map.read_bytes()[:50000])
        for value, words in ((str(cut), "cut.vmap: the map is truncated"),
                             (str(self.folder / "none.vmap"), "none.vmap: no such file"),
                             (None, "/map_publisher/map")):
            if value is None:
                rospy.delete_param("/map_publisher/map")
            else:
                rospy.set_param("/map_publisher/map", value)

            def refused_and_told(words=words):  # again where the log was not yet connected
                with self.assertRaises(rospy.ServiceException):
                    self.load("/map_publisher", "vcharge_mapping/map_publisher_nodelet", [], [], [], "")
                return any(words in text for text in self.logged)
            wait_for(refused_and_told, f"'{words}' in the log")
            self.assertEqual(self.list().nodelets, [])
        self.publish()
        self.assertEqual(self.list().nodelets, ["/map_publisher"])


if __name__ == "__main__":
    rospy.init_node("map_test")
    rostest.rosrun("vcharge_tests", "map", MapTest)
