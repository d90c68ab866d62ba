#!/usr/bin/env python3
"""The obstacle nodelet on a simulated drive: it equals the offline tool, agrees with the truth, and survives bad input."""
import collections
import copy
import csv
import math
import os
import sys
import threading
import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
import vcharge
import yaml
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import OccupancyGrid, Odometry
from octomap_msgs.msg import Octomap
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from vcharge_msgs.msg import Corridor
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import CAMERAS, Drive, inputs_of, run, tool  # noqa: E402
from nodelet_fixture import (Diagnostics, drive_publishers, expect_bad_rig_is_refused, manager_services,  # noqa: E402
                             reach, wait_for, wait_until_connected, wait_until_gone)

PARTS = {"image": Image, "standard_deviation": Image, "confidence": Image, "reference": Image, "camera_info": CameraInfo}
FREE, OCCUPIED, UNOBSERVED = 0, 100, -1
MAX_WAITING = 25  # stamps of range maps that wait for odometry


def cells_of(grid):
    return np.array(grid.data, np.int8).reshape(grid.info.height, grid.info.width)


def positions_of(grid, state):
    """Centres (N x 2) of the cells with a state, in the fixed frame."""
    rows, columns = np.nonzero(cells_of(grid) == state)
    origin = grid.info.origin.position
    return np.stack([origin.x + (columns + 0.5) * grid.info.resolution,
                     origin.y + (rows + 0.5) * grid.info.resolution], 1)


def moved(message, seconds):
    """A copy with another stamp."""
    message = copy.copy(message)
    message.header = copy.deepcopy(message.header)
    message.header.stamp = message.header.stamp + rospy.Duration(seconds)
    return message


class ObstacleNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(drive="creep", duration_s=4.0, extra=("--scene", "obstacles", "--truth-range"))
        range_options = {"preset": "fast", "cameras": list(CAMERAS), "working_camera": {"image_scale": 0.5}}
        options = {"cameras": list(CAMERAS)}
        cls.offline = cls.drive.folder / "offline"
        status, output, errors = run([
            tool("vcharge_obstacles", "detect_obstacles"), "--bag", cls.drive.bag, "--rig", cls.drive.rig,
            "--options", cls.drive.write_text("obstacles.yaml", yaml.safe_dump(options)),
            "--range-options", cls.drive.write_text("dense.yaml", yaml.safe_dump(range_options)),
            "--no-objects", "--output", cls.offline])
        if status != 0:
            raise RuntimeError(f"detect_obstacles failed: {output} {errors}")
        cls.load, cls.unload, cls.list = manager_services()
        rospy.set_param("/depth", {"rig": str(cls.drive.rig), "lossless_replay": True, "options": range_options})
        rospy.set_param("/obstacles", {"rig": str(cls.drive.rig), "lossless_replay": True, "options": options})
        cls.messages = cls.record_range_maps()
        cls.publishers = {topic: rospy.Publisher(topic, type(message), queue_size=10000)
                          for topic, message in {topic: message for topic, message in cls.messages}.items()}
        cls.received, cls.log = {}, []
        topics = {"/obstacles/grid": OccupancyGrid, "/obstacles/scan": LaserScan, "/obstacles/markers": MarkerArray,
                  "/obstacles/octomap": Octomap, "/obstacles/corridor": Corridor}
        for camera in CAMERAS:
            topics[f"/obstacles/{camera}/scan"] = LaserScan
            topics[f"/obstacles/{camera}/ground_plane"] = Vector3Stamped

        def keep(topic):
            return lambda message: cls.received.setdefault(topic, []).append(message)

        cls.subscribers = [rospy.Subscriber(topic, kind, keep(topic), queue_size=1000) for topic, kind in topics.items()]
        cls.topics = topics
        cls.diagnostics = Diagnostics()
        cls.subscribers.append(cls.diagnostics.subscriber)
        rospy.Subscriber("/rosout", Log, lambda message: cls.log.append(message.msg), queue_size=1000)

    @classmethod
    def record_range_maps(cls):
        """The drive's odometry and the depth nodelet's range maps of its images, by stamp."""
        recorded = []
        subscribers = [
            rospy.Subscriber(f"/dense/{camera}/range/{part}", kind,
                             lambda message, topic=f"/dense/{camera}/range/{part}": recorded.append((topic, message)),
                             queue_size=1000)
            for camera in CAMERAS for part, kind in PARTS.items()]
        diagnostics = Diagnostics()
        subscribers.append(diagnostics.subscriber)
        publishers = drive_publishers(CAMERAS)
        if not cls.load("/depth", "vcharge_dense/depth_nodelet", [], [], [], "").success:
            raise RuntimeError("the depth nodelet does not load")
        reach(publishers, diagnostics.heard, subscribers)
        drive = inputs_of(cls.drive.messages())
        for topic, message in drive:
            publishers[topic].publish(message)
            time.sleep(0.002)
        stamps = cls.offline_stamps()
        wait_for(lambda: len(recorded) >= len(PARTS) * len(CAMERAS) * (len(stamps) - 3), "range maps", 150.0)
        time.sleep(2.0)
        cls.unload("/depth")
        for connection in [*subscribers, *publishers.values()]:
            connection.unregister()
        parts_of_map = collections.Counter((topic.split("/")[2], message.header.stamp.to_nsec())
                                           for topic, message in recorded)
        if set(parts_of_map.values()) != {len(PARTS)}:
            raise RuntimeError("range maps lost a part on their way")
        for camera in CAMERAS:
            recorded_stamps = sorted(stamp for name, stamp in parts_of_map if name == camera)
            if recorded_stamps != stamps[:len(recorded_stamps)]:
                raise RuntimeError(f"range maps of camera {camera} lost a stamp on their way")
        odometry = [(topic, message) for topic, message in drive if topic == "/odom"]
        return sorted(odometry + recorded, key=lambda entry: entry[1].header.stamp.to_nsec())

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def setUp(self):
        self.load_obstacles()

    def tearDown(self):
        self.unload_obstacles()
        self.assertNotIn("/obstacles", self.list().nodelets, "the manager outlives the nodelet")

    def load_obstacles(self):
        self.assertTrue(self.load("/obstacles", "vcharge_obstacles/obstacle_nodelet", [], [], [], "").success)
        self.wait_until_connected()
        self.reach()

    def wait_until_connected(self):
        wait_for(lambda: all(publisher.get_num_connections() > 0 for publisher in self.publishers.values()),
                 "the nodelet to subscribe")
        wait_until_connected("/manager", self.subscribers)

    def unload_obstacles(self):
        """Waits until no connection to the unloaded nodelet is left."""
        self.assertTrue(self.unload("/obstacles").success)
        wait_until_gone("/manager", self.subscribers)
        wait_for(lambda: all(publisher.get_num_connections() == 0 for publisher in self.publishers.values()),
                 "the nodelet's subscriptions to end")

    def reach(self):
        """Waits until the nodelet reports odometry without a stamp, and all topics are connected."""
        self.diagnostics.clear()

        def heard():
            self.publishers["/odom"].publish(Odometry())
            time.sleep(0.3)
            return self.diagnostics.tells("/odom")
        wait_for(heard, "the nodelet to hear /odom")
        self.clear()

    def clear(self):
        for messages in self.received.values():
            messages.clear()
        self.diagnostics.told.clear()
        self.log.clear()

    def wait_until_quiet(self):
        def counts():
            return [len(messages) for messages in list(self.received.values())]
        before = None
        while counts() != before:
            before = counts()
            time.sleep(3.0)

    def publish(self, change=lambda topic, message: message, from_fraction=0.0, to_fraction=1.0, keeps_step=False):
        """Publishes the drive. keeps_step: waits for grids, because a busy publisher's topics drift further apart than the
        stamps that the nodelet lets wait."""
        published = set()
        messages = self.messages[int(from_fraction * len(self.messages)):int(to_fraction * len(self.messages))]
        for topic, message in messages:
            changed = change(topic, message)
            if changed is not None:
                self.publishers[topic].publish(changed)
                time.sleep(0.001)
                if keeps_step and topic.startswith("/dense/"):
                    published.add(message.header.stamp.to_nsec())
                    wait_for(lambda: len(published) - len(self.grids()) < MAX_WAITING // 2, "grids")
        return messages

    def grids(self):
        return list(self.received.get("/obstacles/grid", []))

    @classmethod
    def offline_stamps(cls):
        return vcharge.list_obstacle_maps(cls.offline)

    def wait_for_message(self, *words):
        wait_for(lambda: self.diagnostics.tells(*words), f"a diagnostic with {words}")

    def expect_recovery(self):
        """A good drive gives a map after bad input."""
        self.clear()
        self.publish()
        wait_for(lambda: len(self.grids()) >= len(self.offline_stamps()) - 3, "maps of a good drive")
        self.assertGreater(len(positions_of(self.grids()[-1], FREE)), 300)

    def test_equals_the_offline_tool_and_the_truth(self):
        self.publish(keeps_step=True)
        stamps = self.offline_stamps()
        self.assertGreater(len(stamps), 30)
        wait_for(lambda: len(self.grids()) >= len(stamps) - 3, "grids")
        for topic in self.topics:
            wait_for(lambda t=topic: self.received.get(t), topic)
        grids = {grid.header.stamp.to_nsec(): grid for grid in self.grids()}
        scans = {scan.header.stamp.to_nsec(): scan for scan in self.received["/obstacles/scan"]}
        compared = 0
        for stamp in stamps:
            if stamp not in grids or stamp not in scans:
                continue
            compared += 1
            np.testing.assert_array_equal(cells_of(grids[stamp]), vcharge.read_obstacle_map(self.offline, stamp).state)
            self.compare_scan(scans[stamp], "fused", stamp)
        self.assertGreaterEqual(compared, len(stamps) - 3)
        for camera in CAMERAS:
            scan = self.received[f"/obstacles/{camera}/scan"][-1]
            self.assertEqual(scan.header.frame_id, f"camera_{camera}_scan")
            self.compare_scan(scan, camera, scan.header.stamp.to_nsec())
        self.check_against_truth(grids[max(grids)])
        self.check_other_outputs()

    def compare_scan(self, scan, name, stamp):
        expected = vcharge.read_obstacle_scans(self.offline, stamp)[name].range_m
        ranges = [math.nan if math.isinf(value) else value for value in scan.ranges]
        np.testing.assert_allclose(ranges, expected, atol=2e-4)  # the file has four digits

    def check_against_truth(self, grid):
        """fixed_from_world: the odometry frame has its origin at the start of the drive."""
        world_from_odom = self.world_from_odom()
        truth = vcharge.read_height_map(self.drive.truth)
        near = int(math.ceil(0.2 / truth.cell_size_m))
        highest = cv2.dilate(truth.height_m, np.ones((2 * near + 1, 2 * near + 1)))
        lowest = cv2.erode(truth.height_m, np.ones((2 * near + 1, 2 * near + 1)))

        def at(image, positions):
            world = positions @ world_from_odom[:, :2].T + world_from_odom[:, 2]
            cells = np.round((world - truth.origin_m) / truth.cell_size_m).astype(int)
            return image[cells[:, 1], cells[:, 0]]

        free, occupied = positions_of(grid, FREE), positions_of(grid, OCCUPIED)
        self.assertGreater(len(free), 300)
        self.assertGreater(len(occupied), 10)
        self.assertGreaterEqual(np.mean(at(lowest, free) < 0.2), 0.99)
        self.assertGreaterEqual(np.mean(at(highest, occupied) > 0.08), 0.7)

    def world_from_odom(self):
        """2 x 3 transform by the pose at the first image."""
        truth = vcharge.read_trajectory(self.drive.truth / "trajectory.tum").rows[0]
        odometry = min((message for topic, message in self.messages if topic == "/odom"),
                       key=lambda message: abs(message.header.stamp.to_sec() - truth[0])).pose.pose
        yaw = 2 * math.atan2(truth[6], truth[7]) - 2 * math.atan2(odometry.orientation.z, odometry.orientation.w)
        rotation = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        translation = truth[1:3] - rotation @ np.array([odometry.position.x, odometry.position.y])
        return np.column_stack([rotation, translation])

    def check_other_outputs(self):
        grid = self.grids()[-1]
        self.assertEqual(grid.header.frame_id, "odom")
        octomap = self.received["/obstacles/octomap"][-1]
        self.assertEqual((octomap.header.frame_id, octomap.id, octomap.binary), ("odom", "OcTree", True))
        self.assertAlmostEqual(octomap.resolution, grid.info.resolution, places=5)
        self.assertGreater(len(octomap.data), 100)
        self.check_corridor(self.received["/obstacles/corridor"])
        walls = next(marker for marker in self.received["/obstacles/markers"][-1].markers if marker.ns == "walls")
        self.assertEqual(walls.header.frame_id, "odom")
        self.assertGreater(max(point.z for point in walls.points), 0.1)
        for camera in CAMERAS:
            planes = np.array([[m.vector.x, m.vector.y, m.vector.z]
                               for m in self.received[f"/obstacles/{camera}/ground_plane"]])
            # The ground is level, and the suspension moves by less than a degree and 3 cm.
            self.assertLess(np.abs(np.median(planes[:, :2], axis=0)).max(), math.radians(1.0))
            self.assertLess(abs(np.median(planes[:, 2])), 0.03)

    def check_corridor(self, corridors):
        """Equals corridor.csv of the offline tool."""
        with open(self.offline / "corridor.csv") as file:
            expected = {(int(row["stamp_ns"]), row["direction"]): row for row in csv.DictReader(file)}
        compared = 0
        for corridor in corridors:
            self.assertEqual(corridor.header.frame_id, "base_link")
            for direction in ("forward", "backward"):
                row = expected.get((corridor.header.stamp.to_nsec(), direction))
                if row is not None:
                    compared += 1
                    found = getattr(corridor, direction)
                    self.assertAlmostEqual(corridor.curvature_per_m, float(row["curvature_per_m"]), places=4)
                    for key in ("known_free_m", "free_beyond_rim_m", "occupied_m", "unknown_fraction", "oldest_age_s"):
                        np.testing.assert_allclose(getattr(found, key), float(row[key]), atol=2e-3, err_msg=key)
                    self.assertFalse(found.has_crossing)
        self.assertGreater(compared, 50)

    def test_camera_info_unlike_the_rig_is_refused_with_one_error(self):
        def other_lens(topic, message):
            if topic == "/dense/left/range/camera_info":
                message = copy.deepcopy(message)
                message.K = [value * 1.1 for value in message.K]
            return message
        self.publish(other_lens)
        self.wait_for_message("/dense/left/range/camera_info", "expected camera 'left' of the rig", "320x200")
        errors = [text for text in list(self.log) if "expected camera 'left'" in text]
        self.assertEqual(len(errors), 1, errors)
        self.assertEqual(int(self.diagnostics.values("obstacles/left")["range_maps"]), 0)
        self.expect_recovery()

    def test_images_of_another_kind_are_refused(self):
        bad = copy.copy(next(message for topic, message in self.messages if topic == "/dense/left/range/image"))
        bad.encoding = "mono8"
        self.publish(lambda topic, message: bad if topic == "/dense/left/range/image" and
                     message.header.stamp == bad.header.stamp else message)
        self.wait_for_message("/dense/left/range/image", "32FC1", "mono8")
        self.expect_recovery()

    def test_jump_of_odometry_empties_the_map_at_once(self):
        last = self.publish(to_fraction=0.7)
        wait_for(lambda: self.grids() and len(positions_of(self.grids()[-1], FREE)) > 300, "free ground")
        odometry = moved([message for topic, message in last if topic == "/odom"][-1], 0.02)
        odometry.pose = copy.deepcopy(odometry.pose)
        odometry.pose.pose.position.x += 2.0
        self.wait_until_quiet()  # range maps may wait longer than they took to arrive
        self.clear()
        self.publishers["/odom"].publish(odometry)  # alone: no range map comes with it
        # A stamp of which only some range maps were published is fused first.
        wait_for(lambda: self.grids() and self.grids()[-1].header.stamp == odometry.header.stamp, "the empty map", 5.0)
        self.assertEqual(np.count_nonzero(cells_of(self.grids()[-1]) != UNOBSERVED), 0)

    def test_range_maps_without_odometry_do_not_pile_up(self):
        left = [(topic, message) for topic, message in self.messages if topic.startswith("/dense/left/range/")]
        stamps = len(left) // len(PARTS)
        for repetition in range(3):
            for topic, message in left:
                self.publishers[topic].publish(moved(message, 100.0 + 10.0 * repetition))
                time.sleep(0.002)

        def counts():
            values = self.diagnostics.values("obstacles/left")
            return {key: int(values[key]) for key in ("range_maps", "without_pose", "waiting_stamps")} if values else {}
        wait_for(lambda: counts().get("range_maps") == 3 * stamps, "the range maps")
        self.assertGreater(3 * stamps, 2 * MAX_WAITING)
        self.assertLessEqual(counts()["waiting_stamps"], MAX_WAITING)
        self.assertEqual(counts()["without_pose"] + counts()["waiting_stamps"], 3 * stamps)
        self.expect_recovery()

    def test_unloads_and_loads_again_amid_messages(self):
        stop = threading.Event()

        def play():
            while not stop.is_set():
                self.publish(lambda topic, message: None if stop.is_set() else message)
        player = threading.Thread(target=play)
        player.start()
        try:
            for _ in range(6):
                time.sleep(0.7)
                self.unload_obstacles()
                self.assertTrue(self.load("/obstacles", "vcharge_obstacles/obstacle_nodelet", [], [], [], "").success)
        finally:
            stop.set()
            player.join()
        self.assertEqual(self.list().nodelets, ["/obstacles"])
        self.wait_until_connected()
        self.wait_until_quiet()  # what is still on its way belongs to the drive before
        self.reach()
        self.expect_recovery()

    def test_nodelet_of_a_loaded_name_is_refused(self):
        with self.assertRaises(rospy.ServiceException):
            self.load("/obstacles", "vcharge_obstacles/obstacle_nodelet", [], [], [], "")
        self.assertEqual(self.list().nodelets, ["/obstacles"])

    def test_nodelet_with_a_bad_rig_does_not_load_and_the_manager_lives_on(self):
        expect_bad_rig_is_refused(self, "vcharge_obstacles/obstacle_nodelet", self.drive.folder / "no_such_rig.yaml")


if __name__ == "__main__":
    rospy.init_node("obstacle_nodelet_test")
    rostest.rosrun("vcharge_tests", "obstacle_nodelet", ObstacleNodeletTest)
