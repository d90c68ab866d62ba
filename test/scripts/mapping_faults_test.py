#!/usr/bin/env python3
"""build_map on drives with faults: it reports what was skipped, and never damages an existing map."""
import copy
import os
import random
import sys
import unittest

import numpy as np
import rosbag
import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, run_tool, tool  # noqa: E402
from mapping_fixture import errors_m, numbers_of_map  # noqa: E402

CAMERAS = ("front", "left", "rear", "right")
MAX_ODOMETRY_GAP_S = 0.25  # that is interpolated
STANDING_S = 30


def is_image(topic):
    return topic.endswith("/image_raw")


def limited_to(kilobytes):
    """Prefix that lets a command write no larger file: writing fails with an error, as on a full disk."""
    return ("bash", "-c", f'trap "" XFSZ; ulimit -f {kilobytes}; exec "$@"', "bash")


class MappingFaultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(drive="figure_eight", duration_s=9, cameras=CAMERAS, extra=("--image-step", "2"),
                          image_scale=0.25)
        cls.start_s = cls.drive.messages()[0][1].header.stamp.to_sec()
        cls.map = cls.drive.folder / "lot.vmap"
        status, cls.found, errors = cls.build(cls.drive.bag, cls.map)
        if (status, errors) != (0, []):
            raise RuntimeError(f"build_map failed: {errors}")

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def setUp(self):
        self.name = self.id().split(".")[-1]
        self.output_map = self.drive.folder / f"{self.name}.vmap"

    @classmethod
    def command(cls, bag, output, *extra, rig=None):
        return [str(word) for word in (tool("vcharge_mapping", "build_map"), "--bag", bag, "--rig",
                                       rig or cls.drive.rig, "--output", output, *extra)]

    @classmethod
    def build(cls, bag, output, *extra, prefix=(), rig=None):
        return run_tool([*prefix, *cls.command(bag, output, *extra, rig=rig)])

    def rewritten(self, change):
        """The drive's bag with each message replaced by change(seconds since the start, topic, message)."""
        return self.drive.rewrite(f"{self.name}.bag", lambda topic, message: change(
            message.header.stamp.to_sec() - self.start_s, topic, message))

    def build_bad(self, bag, max_error_m=0.15):
        """Builds a map, which must still be finite and accurate; returns what the tool found."""
        trajectory = self.drive.folder / f"{self.name}.tum"
        status, found, errors = self.build(bag, self.output_map, "--trajectory", trajectory)
        self.assertEqual((status, errors), (0, []))
        for column, values in numbers_of_map(self.output_map).items():
            self.assertTrue(np.isfinite(values).all(), column)
        self.assertTrue(np.isfinite(np.loadtxt(trajectory)).all())
        errors = errors_m(trajectory, self.drive.truth / "trajectory.tum")
        self.assertLess(np.sqrt(np.mean(errors ** 2)), max_error_m)
        return found

    def image_stamps(self, bag=None):
        """Stamps of a bag's images, a set by topic."""
        stamps = {}
        for topic, message in self.drive.messages() if bag is None else self.read(bag):
            if is_image(topic):
                stamps.setdefault(topic, set()).add(message.header.stamp.to_nsec())
        return stamps

    @staticmethod
    def read(bag):
        with rosbag.Bag(str(bag)) as opened:
            return [(topic, message) for topic, message, _ in opened.read_messages()]

    def check_bag(self, bag, rig=None):
        """Exit status, grades of the subjects that did not pass, and the errors."""
        status, found, errors = run_tool([tool("vcharge_recordings", "check_bag"), "--bag", bag, "--rig",
                                          rig or self.drive.rig])
        return status, {finding["subject"]: finding["grade"] for finding in found.get("findings", [])
                        if finding["grade"] != "PASS"}, errors

    def test_check_bag_judges_a_recording_before_it_is_used(self):
        self.assertEqual(self.check_bag(self.drive.bag), (0, {}, []))
        bag = self.rewritten(lambda _, topic, message: [] if topic == "/odom" else [(topic, message)])
        status, found, errors = self.check_bag(bag)
        self.assertEqual((status, found), (1, {"odometry": "FAIL"}))
        self.assertEqual(len(errors), 1)
        self.assertIn(str(bag), errors[0])

        def garbled(_, topic, message):
            if topic == "/camera/rear/image_raw":
                message = copy.copy(message)
                message.data = message.data[:100]
            return [(topic, message)]

        status, found, _ = self.check_bag(self.rewritten(garbled))
        self.assertEqual((status, found), (1, {"/camera/rear/image_raw": "FAIL", "rear": "FAIL"}))
        swapped = {"front": "rear", "rear": "front"}
        bag = self.rewritten(lambda _, topic, message: [
            ("/".join(swapped.get(part, part) for part in topic.split("/")), message)])
        status, found, _ = self.check_bag(bag)
        self.assertEqual(status, 1)
        self.assertEqual({found.get("front: direction"), found.get("rear: direction")}, {"FAIL"})
        truncated = self.drive.folder / f"{self.name}_truncated.bag"
        truncated.write_bytes(self.drive.bag.read_bytes()[:200000])
        for path, word in ((truncated, "truncated"), (self.drive.folder / "none.bag", "no such file")):
            status, _, errors = self.check_bag(path)
            self.assertEqual((status, len(errors)), (1, 1), errors)
            self.assertIn(str(path), errors[0])
            self.assertIn(word, errors[0])

    def test_a_camera_that_pauses_for_long_is_named_with_its_frames(self):
        bag = self.rewritten(lambda time_s, topic, message: (
            [] if topic == "/camera/left/image_raw" and 3.0 < time_s < 6.5 else [(topic, message)]))
        before, after = (stamps["/camera/left/image_raw"] for stamps in (self.image_stamps(), self.image_stamps(bag)))
        missing = len(before) - len(after)
        self.assertGreater(missing, 10)
        found = self.build_bad(bag)
        self.assertEqual(found["num_incomplete_frames"], missing)
        self.assertEqual(found["num_missing_images"], {"front": 0, "left": missing, "rear": 0, "right": 0})

    def test_a_tenth_of_all_frames_and_images_may_be_lost(self):
        chance = random.Random(3)
        stamps = sorted(set().union(*self.image_stamps().values()))
        lost_frames = {stamp for stamp in stamps if chance.random() < 0.1}

        def change(_time_s, topic, message):
            if is_image(topic) and (message.header.stamp.to_nsec() in lost_frames or chance.random() < 0.1):
                return []
            return [(topic, message)]

        bag = self.rewritten(change)
        left = self.image_stamps(bag)
        frames = set().union(*left.values())
        incomplete = sum(1 for stamp in frames if any(stamp not in of_camera for of_camera in left.values()))
        self.assertLess(len(frames), len(stamps))
        found = self.build_bad(bag)
        self.assertEqual(found["num_frames"], len(frames))
        self.assertEqual(found["num_incomplete_frames"], incomplete)

    def test_frames_in_gaps_of_the_odometry_are_counted(self):
        gaps = ((2.0, 2.7), (6.0, 6.9))
        bag = self.rewritten(lambda time_s, topic, message: (
            [] if topic == "/odom" and any(first < time_s < last for first, last in gaps) else [(topic, message)]))
        odometry = np.array(sorted(message.header.stamp.to_nsec() for topic, message in self.read(bag)
                                   if topic == "/odom"))
        without = 0
        for stamp in set().union(*self.image_stamps(bag).values()):
            after = int(np.searchsorted(odometry, stamp))
            inside = 0 < after < len(odometry) and odometry[after] != stamp
            without += bool(inside and odometry[after] - odometry[after - 1] > MAX_ODOMETRY_GAP_S * 1e9)
        self.assertGreater(without, 5)
        self.assertEqual(self.build_bad(bag)["num_frames_without_odometry"], without)

    def test_odometry_that_ends_early_leaves_a_map_of_what_it_covers(self):
        bag = self.rewritten(lambda time_s, topic, message: (
            [] if topic == "/odom" and time_s > 6.0 else [(topic, message)]))
        uncovered = sum(1 for stamp in set().union(*self.image_stamps().values())
                        if stamp * 1e-9 - self.start_s > 6.03)
        self.assertGreaterEqual(self.build_bad(bag)["num_frames_without_odometry"], uncovered)

    def test_standing_for_long_is_told_and_changes_little(self):
        stand_s = 4.0
        frozen = {}
        for topic, message in self.drive.messages():
            if message.header.stamp.to_sec() - self.start_s <= stand_s:
                frozen[topic] = message
        for_odometry, for_images = 0.02, 0.16

        def later(message, seconds):
            message = copy.copy(message)
            message.header = copy.deepcopy(message.header)
            message.header.stamp += rospy.Duration.from_sec(seconds)
            return message

        def change(time_s, topic, message):
            if time_s > stand_s:
                return [(topic, later(message, STANDING_S))]
            if message.header.stamp != frozen[topic].header.stamp:
                return [(topic, message)]
            period_s = for_images if is_image(topic) else for_odometry
            stays = later(message, 0.0)
            if topic == "/odom":
                stays.twist = copy.deepcopy(stays.twist)
                stays.twist.twist.linear.x = stays.twist.twist.angular.z = 0.0
            count = int(STANDING_S / period_s) - 1
            return [(topic, message)] + [(topic, later(stays, (i + 1) * period_s)) for i in range(count)]

        bag = self.rewritten(change)
        trajectory = self.drive.folder / "standing.tum"
        status, found, errors = self.build(bag, self.output_map, "--trajectory", trajectory)
        self.assertEqual((status, errors), (0, []))
        self.assertGreater(found["num_standing_frames"], 0.9 * STANDING_S / for_images)
        keyframes = len(numbers_of_map(self.output_map)["keyframe.x_m"])
        self.assertLessEqual(abs(keyframes - len(numbers_of_map(self.map)["keyframe.x_m"])), 2)
        for column, values in numbers_of_map(self.output_map).items():
            self.assertTrue(np.isfinite(values).all(), column)

    def test_an_odometer_that_starts_over_is_told(self):
        origin = None

        def change(time_s, topic, message):
            nonlocal origin
            if topic != "/odom" or time_s < 5.0:
                return [(topic, message)]
            message = copy.deepcopy(message)
            position = message.pose.pose.position
            origin = origin or (position.x + 100.0, position.y - 50.0)
            position.x, position.y = position.x - origin[0], position.y - origin[1]
            return [(topic, message)]

        self.assertEqual(self.build_bad(self.rewritten(change))["num_odometry_resets"], 1)

    def test_a_drive_without_odometry_or_without_motion_makes_no_map(self):
        before = self.map.read_bytes()
        first = {}

        def stand(_time_s, topic, message):
            first.setdefault(topic, message)
            if topic != "/odom":
                return [(topic, message)]
            stays = copy.deepcopy(message)
            stays.pose, stays.twist = first[topic].pose, copy.deepcopy(first[topic].twist)
            stays.twist.twist.linear.x = stays.twist.twist.angular.z = 0.0
            return [(topic, stays)]

        silent = self.rewritten(lambda time_s, topic, message: (
            [] if topic == "/odom" and time_s < 8.9 else [(topic, message)]))
        for bag, words in ((silent, ("no map", "without odometry")), (self.rewritten(stand), ("no map", "standing"))):
            status, _, errors = self.build(bag, self.map)
            self.assertNotEqual(status, 0)
            self.assertEqual(len(errors), 1, errors)
            for word in words:
                self.assertIn(word, errors[0])
        self.assertEqual(self.map.read_bytes(), before)

    def test_a_full_disk_is_one_error_and_leaves_the_old_map(self):
        before = self.map.read_bytes()
        status, _, errors = self.build(self.drive.bag, self.map, prefix=limited_to(100))
        self.assertNotEqual(status, 0)
        self.assertEqual(len(errors), 1, errors)
        self.assertIn(f"{self.map}: cannot be written", errors[0])
        self.assertEqual(self.map.read_bytes(), before)
        self.assertEqual([path.name for path in self.drive.folder.iterdir() if ".tmp" in path.name], [])

    def test_a_trajectory_that_cannot_be_written_is_refused_before_the_work(self):
        trajectory = self.drive.bag / "lot.tum"
        status, _, errors = self.build(self.drive.bag, self.output_map, "--trajectory", trajectory)
        self.assertNotEqual(status, 0)
        self.assertEqual(len(errors), 1, errors)
        self.assertIn(str(trajectory), errors[0])
        self.assertFalse(self.output_map.exists())


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "mapping_faults", MappingFaultsTest)
