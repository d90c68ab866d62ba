#!/usr/bin/env python3
"""The mapping nodelet on a simulated drive: it makes the map of build_map, publishes it, and survives bad input."""
import copy
import os
import shutil
import sys
import time
import unittest

import numpy as np
import rospy
import rostest
from nav_msgs.msg import Path
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, inputs_of, run_tool, tool  # noqa: E402
from mapping_fixture import numbers_of_map  # noqa: E402
from nodelet_fixture import (TIMEOUT_S, Diagnostics, drive_publishers, manager_services, reach, wait_for,  # noqa: E402
                             wait_until_gone)

CAMERAS = ("front", "left", "rear", "right")
WORK_TIMEOUT_S = 150.0


class MappingNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(drive="figure_eight", duration_s=7, cameras=CAMERAS, extra=("--image-step", "2"),
                          image_scale=0.25)
        cls.offline_map = cls.drive.folder / "offline.vmap"
        status, cls.offline, errors = run_tool([
            tool("vcharge_mapping", "build_map"), "--bag", cls.drive.bag, "--rig", cls.drive.rig, "--output",
            cls.offline_map])
        if status != 0:
            raise RuntimeError(f"build_map failed: {cls.offline} {errors}")
        cls.messages = inputs_of(cls.drive.messages())
        cls.num_frames = len({message.header.stamp.to_nsec() for topic, message in cls.messages if topic != "/odom"})
        cls.received = {}

        def keep(topic):
            return lambda message: cls.received.setdefault(topic, []).append(message)

        cls.subscribers = [rospy.Subscriber(topic, kind, keep(topic), queue_size=1000) for topic, kind in (
            ("/mapping/landmarks", PointCloud2), ("/mapping/trajectory", Path), ("/mapping/loop_edges", MarkerArray))]
        cls.diagnostics = Diagnostics()
        cls.subscribers.append(cls.diagnostics.subscriber)
        cls.publishers = drive_publishers(CAMERAS)
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def setUp(self):
        self.output = self.drive.folder / f"{self.id().split('.')[-1]}.vmap"
        rospy.set_param("/mapping/rig", str(self.drive.rig))
        rospy.set_param("/mapping/output", str(self.output))
        rospy.set_param("/mapping/lossless_replay", True)
        rospy.set_param("/mapping/map", "")
        self.assertTrue(self.load("/mapping", "vcharge_mapping/mapping_nodelet", [], [], [], "").success)
        self.finish = rospy.ServiceProxy("/mapping/finish", Trigger)
        self.save = rospy.ServiceProxy("/mapping/save", Trigger)
        self.merge = rospy.ServiceProxy("/mapping/merge", Trigger)
        self.finish.wait_for_service(TIMEOUT_S)
        self.diagnostics.clear()
        reach(self.publishers, self.diagnostics.heard, self.subscribers)
        for kind in self.received.values():
            kind.clear()
        self.diagnostics.told.clear()

    def tearDown(self):
        self.assertTrue(self.unload("/mapping").success)
        wait_until_gone("/manager", self.subscribers)
        self.assertEqual(self.list().nodelets, [], "the manager outlives the nodelet")

    def publish(self, change=lambda topic, message: message):
        for topic, message in self.messages:
            changed = change(topic, message)
            if changed is not None:
                self.publishers[topic].publish(changed)
                time.sleep(0.001)

    def message_of_map(self):
        status = self.diagnostics.status_of("mapping/map")
        return status.message if status else ""

    def wait_for_frames(self, count):
        wait_for(lambda: int(self.diagnostics.values("mapping/map").get("frames", 0)) >= count, f"{count} frames", WORK_TIMEOUT_S)

    def wait_until_finished(self):
        wait_for(lambda: self.message_of_map().startswith("finished"), "the map", WORK_TIMEOUT_S)

    def finish_good_drive(self):
        self.publish()
        # The last frames still wait for odometry to be sorted; finish() processes them.
        self.wait_for_frames(self.num_frames - 10)
        time.sleep(1.0)
        answer = self.finish()
        self.assertTrue(answer.success, answer.message)
        self.wait_until_finished()

    def test_makes_shows_and_saves_the_map_of_the_offline_tool(self):
        self.assertFalse(self.save().success, "there is no map yet")
        self.assertFalse(self.output.exists())
        start = time.monotonic()
        self.finish_good_drive()
        # Diagnostics come once a second: a faster map may report no stage. The last frames wait for a second of silence.
        took_long = time.monotonic() - start > 1.0 + 1.0 + 3.0 + self.num_frames * len(self.publishers) * 0.002
        self.assertTrue(any(text.startswith("stage ") for _, text in self.diagnostics.told) or not took_long, "progress is told")
        self.assertIn(self.offline["content_hash"], self.message_of_map())
        answer = self.save()
        self.assertTrue(answer.success, answer.message)
        self.assertIn(self.offline["content_hash"], answer.message)
        saved, offline = numbers_of_map(self.output), numbers_of_map(self.offline_map)
        for column, values in offline.items():
            np.testing.assert_array_equal(saved[column], values, column)
        merged = self.merge()
        self.assertFalse(merged.success)
        self.assertIn("/mapping/map", merged.message)
        rospy.set_param("/mapping/map", str(self.output))
        merged = self.merge()
        self.assertFalse(merged.success)
        self.assertIn("has this drive already", merged.message)
        again = self.finish()
        self.assertFalse(again.success)
        self.assertIn("made before", again.message)

        wait_for(lambda: self.received.get("/mapping/loop_edges"), "the loop edges")
        num_keyframes = len(offline["keyframe.x_m"])
        lengths = [len(path.poses) for path in self.received["/mapping/trajectory"]]
        self.assertGreater(len(lengths), 3, "the path is shown while it grows")
        self.assertEqual(lengths, sorted(lengths))
        self.assertEqual(lengths[-1], num_keyframes)
        clouds = self.received["/mapping/landmarks"]
        self.assertEqual(clouds[-1].width, len(offline["landmark.x_m"]))
        self.assertEqual(clouds[-1].header.frame_id, "map")
        # Landmarks shown while driving are near those of the final map: within the drive's extent and 60 m.
        points = np.array(list(point_cloud2.read_points(clouds[-2], field_names=("x", "y", "z"))))
        self.assertGreater(len(points), 100)
        self.assertTrue(np.isfinite(points).all())
        self.assertLess(np.abs(points).max(), 100.0)

    def test_a_session_is_kept_while_driving_and_merged_on_command(self):
        self.assertTrue(self.unload("/mapping").success)
        living = self.drive.folder / "living.vmap"
        shutil.copy(self.offline_map, living)
        rospy.set_param("/mapping/map", str(living))
        self.output.write_bytes(b"the drive of yesterday")
        with self.assertRaises(rospy.ServiceException, msg="it is not overwritten"):
            self.load("/mapping", "vcharge_mapping/mapping_nodelet", [], [], [], "")
        self.output.unlink()
        self.assertTrue(self.load("/mapping", "vcharge_mapping/mapping_nodelet", [], [], [], "").success)
        self.finish.wait_for_service(TIMEOUT_S)
        reach(self.publishers, self.diagnostics.heard, self.subscribers)
        self.publish()
        wait_for(self.output.exists, "the drive so far")
        lost = self.drive.folder / "lost.vmap"
        shutil.copy(self.output, lost)
        after_crash = self.drive.folder / "after_crash.vmap"
        shutil.copy(self.offline_map, after_crash)
        status, found, errors = run_tool([tool("vcharge_mapping", "update_map"), "--map", after_crash, "--session", lost])
        self.assertEqual((status, errors), (0, []))
        self.assertGreater(found["common_ratio"], 0.3)
        self.wait_for_frames(self.num_frames - 10)
        time.sleep(1.0)
        self.assertTrue(self.finish().success)
        self.wait_until_finished()
        answer = self.merge()
        self.assertTrue(answer.success, answer.message)
        self.assertFalse(self.output.exists(), "it is in the map")
        _, log, _ = run_tool([tool("vcharge_mapping", "map_log"), "--map", living])
        self.assertIn("updated by live until", log["versions"][-1]["change"])

    def test_a_drive_without_odometry_is_told_and_the_next_one_is_mapped(self):
        first = self.messages[0][1].header.stamp
        self.publish(lambda topic, message: (
            None if topic == "/odom" and (message.header.stamp - first).to_sec() > 0.1 else message))
        wait_for(lambda: self.diagnostics.tells("/odom: no data for"), "the missing topic")
        answer = self.finish()
        self.assertTrue(answer.success, answer.message)
        wait_for(lambda: "without odometry" in self.message_of_map(), "why there is no map", WORK_TIMEOUT_S)
        self.assertFalse(self.save().success)

        def later(_topic, message):
            message = copy.copy(message)
            message.header = copy.deepcopy(message.header)
            message.header.stamp += rospy.Duration(1000.0)
            return message

        self.publish(later)
        self.wait_for_frames(self.num_frames - 10)
        time.sleep(1.0)
        self.assertTrue(self.finish().success)
        self.wait_until_finished()
        self.assertTrue(self.save().success)
        self.assertTrue(np.isfinite(numbers_of_map(self.output)["landmark.x_m"]).all())

    def test_a_map_that_cannot_be_written_is_told_and_may_be_written_elsewhere(self):
        self.finish_good_drive()
        rospy.set_param("/mapping/output", str(self.drive.bag / "lot.vmap"))
        answer = self.save()
        self.assertFalse(answer.success)
        self.assertIn(str(self.drive.bag), answer.message)
        rospy.set_param("/mapping/output", str(self.output))
        self.assertTrue(self.save().success)

    def test_unloading_while_the_map_is_made_leaves_nothing_behind(self):
        self.publish()
        self.wait_for_frames(self.num_frames - 10)
        self.assertTrue(self.finish().success)
        self.assertFalse(self.output.exists())

    def test_a_bad_rig_or_option_does_not_load_and_the_manager_lives_on(self):
        lines = self.drive.rig.read_text()
        without = "\n".join(line for line in lines.splitlines()
                            if not line.startswith(("    vehicle_from_camera", "      translation", "      rotation")))
        rigs = {"missing": self.drive.folder / "none.yaml", "bare": self.drive.write_text("bare.yaml", without + "\n")}
        for name, rig in rigs.items():
            rospy.set_param(f"/{name}/rig", str(rig))
            with self.assertRaises(rospy.ServiceException):
                self.load(f"/{name}", "vcharge_mapping/mapping_nodelet", [], [], [], "")
        rospy.set_param("/odd/rig", str(self.drive.rig))
        rospy.set_param("/odd/options", {"no_such_option": 1})
        with self.assertRaises(rospy.ServiceException):
            self.load("/odd", "vcharge_mapping/mapping_nodelet", [], [], [], "")
        self.assertEqual(self.list().nodelets, ["/mapping"])


if __name__ == "__main__":
    rospy.init_node("mapping_nodelet_test")
    rostest.rosrun("vcharge_tests", "mapping_nodelet", MappingNodeletTest)
