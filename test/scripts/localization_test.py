#!/usr/bin/env python3
"""Another day's drive in a map: accurate poses, the same offline and online, and every fault is reported."""
import copy
import os
import sys
import time
import unittest

import numpy as np
import rosbag
import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import inputs_of  # noqa: E402
from localization_fixture import CAMERAS, MappedRoad, count, rig_text, warnings  # noqa: E402
from nodelet_fixture import Diagnostics, drive_publishers, manager_services, reach, tell_rig_health, wait_for, \
    wait_until_gone  # noqa: E402
from vcharge_msgs.msg import LocalizationStatus  # noqa: E402

MAX_ERROR_M = 0.1
NODELET = "vcharge_localization/localization_nodelet"
STATUS = ("localized", "too_few_matches", "no_consensus", "ambiguous", "bridged_by_odometry", "lost")


def later(shift_s):
    def change(_topic, message):
        message = copy.copy(message)
        message.header = copy.deepcopy(message.header)
        message.header.stamp += rospy.Duration(shift_s)
        return message
    return change


class LocalizationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.road = MappedRoad()
        status, cls.found, errors, cls.rows = cls.road.localize()
        if status != 0:
            raise RuntimeError(f"localize_drive failed: {errors}")
        cls.messages = inputs_of(cls.messages_of(cls.road.bag))
        cls.received = {}
        cls.logged = []

        def keep(topic):
            return lambda message: cls.received.setdefault(topic, []).append(message)

        cls.subscribers = [rospy.Subscriber(topic, kind, keep(topic), queue_size=1000) for topic, kind in (
            ("/localization/pose", PoseWithCovarianceStamped), ("/localization/status", LocalizationStatus),
            ("/localization/observations", Marker), ("/tf", TFMessage))]
        cls.diagnostics = Diagnostics()
        cls.subscribers.append(cls.diagnostics.subscriber)
        cls.subscribers.append(rospy.Subscriber("/rosout", Log, lambda m: cls.logged.append(m.msg), queue_size=100))
        cls.publishers = drive_publishers(CAMERAS)
        cls.initial_pose = rospy.Publisher("/initialpose", PoseWithCovarianceStamped, queue_size=1)
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        cls.road.remove()

    @classmethod
    def messages_of(cls, path):
        with rosbag.Bag(str(path)) as bag:
            return [(topic, message) for topic, message, _ in bag.read_messages()]

    def expect_right(self, rows, min_localized=0.9, max_error_m=MAX_ERROR_M):
        self.assertEqual(len(rows), len(self.rows))
        self.assertGreaterEqual(count(rows, "localized"), min_localized * len(rows))
        self.assertLess(self.road.errors_of_rows_m(rows).max(), max_error_m)

    def test_poses_are_right_and_no_camera_is_blamed(self):
        self.assertGreater(len(self.rows), 40)
        self.expect_right(self.rows)
        self.assertEqual(self.rows[0]["status"], "lost", "one recognized place alone is not believed")
        self.assertEqual(warnings(self.found), [])
        self.assertEqual((self.found["num_frames"], self.found["num_incomplete_frames"]), (len(self.rows), 0))

    def test_is_the_same_on_one_thread_and_without_the_truth(self):
        blind = self.road.map_drive.folder / "blind.bag"
        with rosbag.Bag(str(blind), "w") as bag:
            for topic, message in self.messages_of(self.road.bag):
                if not topic.startswith("/ground_truth"):
                    bag.write(topic, message, message.header.stamp)
        status, found, _, _ = self.road.localize(bag=blind, prefix=("taskset", "-c", "0"))
        self.assertEqual(status, 0)
        self.assertEqual(found["content_hash"], self.found["content_hash"])

    def test_faults_of_cameras_are_named_and_the_pose_stays_right(self):
        frozen = self.road.drive("frozen", "faults.frozen_camera.cameras=[left]", "faults.frozen_camera.start_s=1.5")
        dead = self.road.drive("dead", "faults.dead_camera.cameras=[rear]", "faults.dead_camera.start_s=1.5")
        swapped = self.road.drive("swapped", "faults.swapped_cameras.cameras=[left,right]")

        def wrong_lens(cameras):
            for key in ("gamma1", "gamma2"):
                cameras["right"]["intrinsics"][key] *= 1.1

        wrong = self.road.rig.parent / "wrong_lens.yaml"
        wrong.write_text(rig_text(self.road.rig, wrong_lens))
        for bag, rig, blamed, words in ((frozen, None, ("left",), "frozen"), (dead, None, ("rear",), "no image"),
                                        (swapped, None, ("left", "right"), "intrinsics"),
                                        (None, wrong, ("right",), "intrinsics")):
            status, found, errors, rows = self.road.localize(bag=bag, rig=rig)
            self.assertEqual((status, errors), (0, []))
            # With these small images a frame has about 80 inliers and needs 20: each lost camera costs frames.
            self.expect_right(rows, min_localized=0.9 - 0.1 * len(blamed))
            told = warnings(found)
            self.assertEqual({text.split(":")[0] for _, text in told}, set(blamed), told)
            self.assertTrue(all(words in text for _, text in told), told)
            self.assertGreater(min(frames for frames, _ in told), 10)
            without_rear = found["num_missing_images"]["rear"]
            self.assertEqual((found["num_incomplete_frames"], without_rear > 10), (without_rear, words == "no image"))

    def test_faults_of_the_odometer_and_late_images_are_borne(self):
        for name, *settings in (("reset", "faults.counter_reset.time_s=2"),
                                ("gap", "faults.missing_ticks.start_s=1.5", "faults.missing_ticks.end_s=2.5"),
                                ("late", "faults.late_images.cameras=[rear]", "faults.late_images.probability=0.5",
                                 "faults.late_images.delay_s=0.17")):
            status, found, errors, rows = self.road.localize(bag=self.road.drive(name, *settings))
            self.assertEqual((status, errors), (0, []), name)
            self.expect_right(rows)
            self.assertEqual(warnings(found), [], name)
            self.assertEqual(found["num_odometry_resets"], 1 if name == "reset" else 0, name)

    def test_a_rig_with_other_cameras_and_a_map_of_other_features_work(self):
        two = self.road.rig.parent / "two.yaml"
        two.write_text(rig_text(self.road.rig, lambda cameras: {name: cameras[name] for name in ("rear", "left")}))
        status, _, errors, rows = self.road.localize(rig=two)
        self.assertEqual((status, errors), (0, []))
        self.expect_right(rows, min_localized=0.7)
        other = self.road.folder / "root_sift.yaml"
        other.write_text("features: {type: root_sift}\n")
        status, _, errors, rows = self.road.localize(map_path=self.road.build("root_sift", "--options", other))
        self.assertEqual((status, errors), (0, []))
        self.expect_right(rows, min_localized=0.8)

    def test_bad_input_is_one_error_and_nothing_is_written(self):
        for name, map_path, rig, options, words in self.road.bad_inputs():
            extra = ()
            if options:
                path = self.road.folder / "odd.yaml"
                path.write_text("no_such_option: 1\n")
                extra = ("--options", path)
            status, _, errors, rows = self.road.localize(map_path=map_path, rig=rig, words=extra)
            self.assertNotEqual(status, 0, name)
            self.assertEqual(len(errors), 1, errors)
            for word in words:
                self.assertIn(word, errors[0])
            self.assertEqual(rows, [])
            self.assertFalse((self.road.folder / "localized.tum").exists())

    def start(self, lossless=True):
        rospy.set_param("/localization/rig", str(self.road.rig))
        rospy.set_param("/localization/map", str(self.road.map))
        rospy.set_param("/localization/lossless_replay", lossless)
        self.assertTrue(self.load("/localization", NODELET, [], [], [], "").success)
        self.addCleanup(self.stop)
        self.diagnostics.clear()
        reach(self.publishers, self.diagnostics.heard, self.subscribers)
        self.diagnostics.clear()
        for messages in self.received.values():
            messages.clear()

    def stop(self):
        self.assertTrue(self.unload("/localization").success)
        wait_until_gone("/manager", self.subscribers[:-1])  # the manager itself goes on writing to /rosout
        self.assertEqual(self.list().nodelets, [], "the manager outlives the nodelet")

    def publish(self, change=lambda topic, message: message, pause_s=0.001):
        for topic, message in self.messages:
            changed = change(topic, message)
            if changed is not None:
                self.publishers[topic].publish(changed)
                time.sleep(pause_s)

    def statuses(self):
        return self.received.get("/localization/status", [])

    def poses(self):
        return self.received.get("/localization/pose", [])

    def wait_for_frames(self, number):
        wait_for(lambda: len(self.statuses()) >= number, f"{number} frames")

    def wait_until_told(self, level, *words):
        wait_for(lambda: self.diagnostics.tells(*words, level=level), f"a diagnostic with {words}")

    def pose_errors_m(self, shift_s=0.0):
        return self.road.errors_m(
            [pose.header.stamp.to_sec() - shift_s for pose in self.poses()],
            [[getattr(pose.pose.pose.position, axis) for axis in "xyz"] for pose in self.poses()])

    def test_nodelet_equals_the_offline_tool(self):
        self.start()
        self.publish()
        self.wait_for_frames(len(self.rows))
        posed = [row for row in self.rows if row["tx"]]
        wait_for(lambda: len(self.poses()) >= len(posed), "the poses")
        self.assertEqual((len(self.statuses()), len(self.poses())), (len(self.rows), len(posed)))
        for row, status in zip(self.rows, self.statuses()):
            self.assertEqual(row["time_s"], f"{status.header.stamp.secs}.{status.header.stamp.nsecs:09d}")
            self.assertEqual(row["status"], STATUS[status.status])
            self.assertEqual((int(row["matches"]), int(row["inliers"])), (status.num_matches, status.num_inliers))
            for camera, inliers in zip(status.camera_names, status.inliers_of_camera):
                self.assertEqual(int(row[f"inliers_{camera}"]), inliers)
        for row, message in zip(posed, self.poses()):
            self.assertEqual(message.header.frame_id, "map")
            pose = message.pose.pose
            numbers = [*(getattr(pose.position, axis) for axis in "xyz"),
                       *(getattr(pose.orientation, axis) for axis in "xyzw")]
            keys = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"]
            for i in range(6):
                for k in range(i, 6):
                    keys.append(f"covariance_{i}{k}")
                    numbers.append(message.pose.covariance[6 * i + k])
            self.assertEqual([row[key] for key in keys], [f"{number:.9g}" for number in numbers])
        self.check_tf()
        self.check_observations()
        self.wait_until_told(0, "localized")

    def check_tf(self):
        """map_from_odom * odom_from_vehicle = map_from_vehicle, compared by positions; /odom is frequent enough for linear interpolation."""
        first = {}  # tf keeps the first transform of a stamp; later messages correct it
        for topic, message in self.messages:
            if topic == "/odom":
                first.setdefault(message.header.stamp, message)
        odometry = [first[stamp] for stamp in sorted(first)]
        stamps = [message.header.stamp.to_sec() for message in odometry]
        way = np.array([[getattr(message.pose.pose.position, axis) for axis in "xyz"] for message in odometry])
        transforms = {t.header.stamp: t for message in self.received["/tf"] for t in message.transforms
                      if (t.header.frame_id, t.child_frame_id) == ("map", "odom")}
        self.assertEqual(set(transforms), {pose.header.stamp for pose in self.poses()})
        for pose in self.poses():
            transform = transforms[pose.header.stamp].transform
            q = transform.rotation
            turn = np.array([q.x, q.y, q.z])
            point = np.array([np.interp(pose.header.stamp.to_sec(), stamps, way[:, i]) for i in range(3)])
            rotated = point + 2 * np.cross(turn, np.cross(turn, point) + q.w * point)
            found = rotated + [getattr(transform.translation, axis) for axis in "xyz"]
            expected = [getattr(pose.pose.pose.position, axis) for axis in "xyz"]
            np.testing.assert_allclose(found, expected, atol=2e-3)

    def check_observations(self):
        shown = [marker for marker in self.received["/localization/observations"] if marker.action == Marker.ADD]
        inliers = {status.header.stamp: status.num_inliers for status in self.statuses()}
        self.assertGreater(len(shown), 0.8 * len(self.rows))
        for marker in shown:
            self.assertEqual(marker.header.frame_id, "map")
            self.assertEqual(len(marker.points), 2 * inliers[marker.header.stamp])

    def seed(self, frame="map", shift_m=0.0):
        first = next(row for row in self.rows if row["tx"])
        message = PoseWithCovarianceStamped()
        message.header.frame_id = frame
        message.pose.pose.position.x = float(first["tx"]) + shift_m
        message.pose.pose.position.y = float(first["ty"])
        message.pose.pose.orientation.w = 1.0
        for i, variance in ((0, 0.25), (7, 0.25), (35, 0.0685)):  # what rviz sends
            message.pose.covariance[i] = variance
        wait_for(lambda: self.initial_pose.get_num_connections() > 0, "the nodelet to hear /initialpose")
        self.initial_pose.publish(message)
        time.sleep(0.5)

    def test_initialpose_seeds_and_a_wrong_one_is_not_believed(self):
        self.start()
        self.seed(frame="odom")
        self.wait_until_told(2, "/initialpose", "map", "odom")
        self.seed(shift_m=-0.2)
        self.publish()
        self.wait_for_frames(len(self.rows))
        self.assertEqual(self.statuses()[0].status, LocalizationStatus.LOCALIZED, "at once, not after two frames")
        self.assertLess(self.pose_errors_m().max(), MAX_ERROR_M)

        shift_s = 1000.0
        for messages in self.received.values():
            messages.clear()
        self.seed(shift_m=300.0)
        self.publish(later(shift_s))
        self.wait_for_frames(len(self.rows))
        fixed = {status.header.stamp for status in self.statuses() if status.status == LocalizationStatus.LOCALIZED}
        self.assertGreater(len(fixed), 0.7 * len(self.rows))
        errors = self.pose_errors_m(shift_s)
        for pose, error_m in zip(self.poses(), errors):
            if pose.header.stamp in fixed:
                self.assertLess(error_m, MAX_ERROR_M)

    def publish_half(self, second):
        """Publishes one half of the drive, and returns its statuses; at the end of the first, frames wait for odometry."""
        num_before = len(self.statuses())
        stamps = sorted({message.header.stamp for topic, message in self.messages if topic != "/odom"})
        middle = stamps[len(stamps) // 2]
        self.publish(lambda _topic, message: message if (message.header.stamp >= middle) == second else None)
        self.wait_for_frames(len(stamps) if second else len(stamps) // 2 - 10)
        time.sleep(0.0 if second else 1.0)
        return self.statuses()[num_before:]

    def test_reload_goes_on_with_the_newest_versions_of_the_map_and_of_the_rig(self):
        self.start()
        tell_rig_health(self.road.rig, moved="left")
        before = self.publish_half(second=False)
        left = before[0].camera_names.index("left")
        self.assertEqual({status.inliers_of_camera[left] for status in before}, {0}, "a camera that moved is left out")
        self.assertIn("left: left out, since it moved", before[-1].camera_warnings[0])
        reload = rospy.ServiceProxy("/localization/reload", Trigger)
        answer = reload()
        self.assertTrue(answer.success, answer.message)
        after = self.publish_half(second=True)
        self.assertEqual({status.status for status in after[:10]}, {LocalizationStatus.LOCALIZED}, "at once")
        self.assertGreater(max(status.inliers_of_camera[left] for status in after), 5)
        self.assertLess(self.pose_errors_m().max(), MAX_ERROR_M)

        rospy.set_param("/localization/map", "/none.vmap")
        answer = reload()
        self.assertFalse(answer.success)
        self.assertIn("/none.vmap", answer.message)

    def test_what_is_wrong_is_told_and_the_nodelet_lives_on(self):
        self.start()
        small = Image(height=48, width=64, step=64, encoding="mono8", data=bytes(48 * 64))
        small.header = copy.deepcopy(self.messages[0][1].header)
        self.publishers["/camera/left/image_raw"].publish(small)
        self.wait_until_told(2, "/camera/left/image_raw", "320x200", "64x48")

        noise = np.random.default_rng(1)

        def covered(topic, message):
            if topic == "/camera/left/image_raw":
                message = copy.copy(message)
                message.data = noise.integers(3, 6, len(message.data), dtype=np.uint8).tobytes()
            return message

        self.publish(covered)
        self.wait_for_frames(len(self.rows))
        self.assertIn("left: few features", self.statuses()[-1].camera_warnings[0])
        self.assertEqual(len(self.statuses()[-1].camera_warnings), 1)
        self.wait_until_told(1, "localized", "left: few features")
        self.assertLess(self.pose_errors_m().max(), MAX_ERROR_M)

        shift_s = 1000.0
        for messages in self.received.values():
            messages.clear()
        self.publish(later(shift_s))
        self.wait_for_frames(len(self.rows))
        self.assertEqual(self.statuses()[-1].camera_warnings, [])
        self.assertEqual(self.statuses()[-1].status, LocalizationStatus.LOCALIZED)
        self.assertLess(self.pose_errors_m(shift_s).max(), MAX_ERROR_M)

    def test_live_with_images_out_of_order_gives_no_wrong_pose(self):
        self.start(lossless=False)
        held = {}

        def disordered(topic, message):
            """Every second image of the rear camera comes after the next one."""
            if topic != "/camera/rear/image_raw":
                return message
            if held.get("next"):
                self.publishers[topic].publish(message)
                return held.pop("next")
            held["next"] = message
            return None

        self.publish(disordered, pause_s=0.005)
        self.wait_until_told(1, "/camera/rear/image_raw", "jumped back")
        wait_for(lambda: self.poses(), "a pose")
        time.sleep(1.0)
        self.assertTrue(any(status.status == LocalizationStatus.LOCALIZED for status in self.statuses()))
        stamps = [status.header.stamp for status in self.statuses()]
        self.assertEqual(stamps, sorted(stamps))
        self.assertLess(self.pose_errors_m().max(), MAX_ERROR_M)

    def test_bad_input_does_not_load_is_told_and_the_manager_lives_on(self):
        for name, map_path, rig, options, words in self.road.bad_inputs():
            rospy.set_param(f"/{name}/map", str(map_path or self.road.map))
            rospy.set_param(f"/{name}/rig", str(rig or self.road.rig))
            if options:
                rospy.set_param(f"/{name}/options", options)

            def refused_and_told(name=name, words=words):  # again where the log was not yet connected
                with self.assertRaises(rospy.ServiceException):
                    self.load(f"/{name}", NODELET, [], [], [], "")
                return any(all(word in text for word in words) for text in list(self.logged))

            wait_for(refused_and_told, f"{words} in the log")
            self.assertEqual(self.list().nodelets, [])


if __name__ == "__main__":
    rospy.init_node("localization_test")
    rostest.rosrun("vcharge_tests", "localization", LocalizationTest)
