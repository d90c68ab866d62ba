#!/usr/bin/env python3
"""The tools on a simulated drive: reproducible, independent of the truth, and one clear error for each bad input."""
import copy
import json
import os
import sys
import unittest

import numpy as np
import rosbag
import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, files_below, run, tool  # noqa: E402


class OfflineTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive()
        status, found, errors = cls.drive.compute_range_maps(cls.drive.folder / "reference")
        if status != 0:
            raise RuntimeError(f"compute_range_maps failed: {errors}")
        cls.reference_hash = found["content_hash"]

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def test_removing_the_ground_truth_changes_nothing(self):
        bag = self.drive.rewrite("blind.bag", lambda topic, message: (
            [] if topic.startswith("/ground_truth") else [(topic, message)]))
        status, found, errors = self.drive.compute_range_maps(self.drive.folder / "blind", bag)
        self.assertEqual((status, errors), (0, []))
        self.assertEqual(found["content_hash"], self.reference_hash)

    def test_odometry_that_runs_on_after_the_images_changes_nothing(self):
        path = self.drive.rewrite("runs_on.bag", lambda topic, message: [(topic, message)])
        last = [message for topic, message in self.drive.messages() if topic == "/odom"][-1]
        with rosbag.Bag(str(path), "a") as bag:
            for i in range(1, 250):
                standing = copy.deepcopy(last)
                standing.header.stamp += rospy.Duration.from_sec(0.02 * i)
                bag.write("/odom", standing, standing.header.stamp)
        status, found, errors = self.drive.compute_range_maps(self.drive.folder / "runs_on", path)
        self.assertEqual((status, errors), (0, []))
        self.assertEqual(found["content_hash"], self.reference_hash)

    def test_ranges_agree_with_the_truth(self):
        report = self.drive.folder / "report"
        status, output, errors = run([
            tool("vcharge_evaluation", "evaluate_range"), "--range", self.drive.folder / "reference", "--truth",
            self.drive.truth, "--bag", self.drive.bag, "--rig", self.drive.rig, "--report", report])
        self.assertEqual((status, errors), (0, []), output)
        accuracy = json.loads((report / "range_errors.json").read_text())["sets"][0]["accuracy"]
        right = next(entry["fraction_within_tolerance"] for entry in accuracy if round(entry["density"], 3) == 0.4)
        # The drive has a quarter of the sensor's pixels, and short baselines in its first half.
        self.assertGreater(right, 0.8)
        self.assertIn("range_errors_accuracy.png", files_below(report))

    def expect_error(self, words, bag=None, rig=None, extra=()):
        output = self.drive.folder / "bad_output"
        output.mkdir(exist_ok=True)
        (output / "kept.txt").write_text("kept")
        status, _, errors = self.drive.compute_range_maps(output, bag, rig, extra)
        self.assertNotEqual(status, 0)
        self.assertEqual(len(errors), 1, f"expected one message: {errors}")
        for word in words:
            self.assertIn(word, errors[0])
        self.assertEqual((output / "kept.txt").read_text(), "kept")
        names = set(files_below(output))
        self.assertFalse([name for name in names if ".tmp" in name], names)
        for name in names:
            if name.endswith(".yaml"):  # written last: the map is complete
                for part in ("range", "sigma", "confidence"):
                    self.assertIn(f"{name[:-len('.yaml')]}_{part}.tiff", names)

    def test_missing_bag(self):
        self.expect_error(["no_such.bag"], bag=self.drive.folder / "no_such.bag")

    def test_corrupt_bag(self):
        bag = self.drive.folder / "corrupt.bag"
        bag.write_bytes(b"this is no bag" * 1000)
        self.expect_error(["corrupt.bag"], bag=bag)

    def test_truncated_bag(self):
        data = self.drive.bag.read_bytes()
        bag = self.drive.folder / "truncated.bag"
        bag.write_bytes(data[:len(data) // 2])
        self.expect_error(["truncated.bag"], bag=bag)

    def test_wrong_topic(self):
        bag = self.drive.rewrite("wrong_topic.bag", lambda topic, message: (
            [(topic.replace("/camera/left/", "/cam_left/"), message)]))
        self.expect_error(["wrong_topic.bag", "/camera/left/image_raw", "/cam_left/image_raw"], bag=bag)

    def test_image_size_unlike_the_rig(self):
        rig = self.drive.write_text("big_rig.yaml", self.drive.rig.read_text().replace(
            "[640, 400]", "[1280, 800]").replace("    mask: rig_truth_masks/front_mask.png\n", "").replace(
                "    mask: rig_truth_masks/left_mask.png\n", ""))
        self.expect_error(["image_raw", "1280x800", "640x400"], rig=rig)

    def test_unknown_key_in_the_options(self):
        options = self.drive.write_text("options.yaml", "plane_sweep: {num_plains: 32}\n")
        self.expect_error(["options.yaml", "plane_sweep.num_plains", "num_planes"], extra=["--options", options])

    def test_unknown_key_in_the_rig(self):
        rig = self.drive.write_text("key_rig.yaml", self.drive.rig.read_text().replace("model: mei", "modell: mei", 1))
        self.expect_error(["key_rig.yaml", "cameras.front.modell", "model"], rig=rig)

    def rig_with_rotation(self, name, rotation):
        lines = self.drive.rig.read_text().splitlines()
        at = next(i for i, line in enumerate(lines) if "rotation_xyzw" in line)
        lines[at] = f"      rotation_xyzw: {rotation}"
        return self.drive.write_text(name, "\n".join(lines) + "\n")

    def test_nan_rotation_in_the_rig(self):
        self.expect_error(["nan_rig.yaml", "cameras.front.vehicle_from_camera.rotation_xyzw", "finite"],
                          rig=self.rig_with_rotation("nan_rig.yaml", "[.nan, 0, 0, 1]"))

    def test_rotation_that_is_no_unit_quaternion(self):
        self.expect_error(["unit_rig.yaml", "cameras.front.vehicle_from_camera.rotation_xyzw", "unit quaternion"],
                          rig=self.rig_with_rotation("unit_rig.yaml", "[0.5, 0, 0, 1]"))

    def test_stamps_that_jump_back(self):
        start = self.drive.messages()[0][1].header.stamp

        def jump(topic, message):
            if (message.header.stamp - start).to_sec() < 0.8:
                return [(topic, message)]
            message = copy.copy(message)
            message.header.stamp = message.header.stamp - rospy.Duration(5.0)
            return [(topic, message)]

        # Messages keep their recorded order, as after a clock step while recording.
        path = self.drive.folder / "jump.bag"
        with rosbag.Bag(str(path), "w") as bag:
            for topic, message in self.drive.messages():
                stamp = message.header.stamp
                for new_topic, new_message in jump(topic, message):
                    bag.write(new_topic, new_message, stamp)
        self.expect_error(["jump.bag", "back"], bag=path)

    def test_camera_that_stops(self):
        messages = self.drive.messages()
        start = messages[0][1].header.stamp
        odometry = [message for topic, message in messages if topic == "/odom"][-1]
        left = [message for topic, message in messages if topic == "/camera/left/image_raw"][-1]

        def stop_front(topic, message):
            stopped = topic.startswith("/camera/front/") and (message.header.stamp - start).to_sec() > 0.4
            return [] if stopped else [(topic, message)]

        path = self.drive.rewrite("stopped.bag", stop_front)
        with rosbag.Bag(str(path), "a") as bag:
            for i in range(1, 60):
                later = left.header.stamp + rospy.Duration.from_sec(0.08 * i)
                for topic, message in (("/odom", odometry), ("/camera/left/image_raw", left)):
                    message = copy.deepcopy(message)
                    message.header.stamp = later
                    bag.write(topic, message, later)
        self.expect_error(["stopped.bag", "/camera/front/image_raw"], bag=path)

    def test_output_that_cannot_be_written(self):
        blocked = self.drive.write_text("blocked", "a file, not a folder")
        status, _, errors = self.drive.compute_range_maps(blocked / "output")
        self.assertNotEqual(status, 0)
        self.assertEqual(len(errors), 1, errors)
        self.assertIn("blocked/output", errors[0])

    def test_simulator_rejects_unknown_drives(self):
        status, _, errors = run([tool("vcharge_simulation", "simulate_drive"), "--drive", "to_the_moon", "--output",
                                 self.drive.folder / "moon.bag"])
        self.assertNotEqual(status, 0)
        self.assertTrue(any("to_the_moon" in line for line in errors), errors)
        self.assertNotIn("moon.bag", files_below(self.drive.folder))

    def simulate(self, name, **changes):
        bag = self.drive.folder / "simulated" / name
        bag.parent.mkdir(exist_ok=True)
        arguments = {"drive": "short", "duration_s": 0.5, "image_scale": 0.1, "cameras": "left", "output": bag, **changes}
        words = [word for key, value in arguments.items() for word in ("--" + key.replace("_", "-"), value)]
        status, _, errors = run([tool("vcharge_simulation", "simulate_drive"), *words])
        return bag, status, errors

    def test_noise_and_ticks_of_another_seed_need_no_second_rendering(self):
        clean, status, errors = self.simulate("clean.bag", noise="off")
        self.assertEqual(status, 0, errors)
        noisy, status, errors = self.simulate("noisy.bag")
        self.assertEqual(status, 0, errors)
        again, status, errors = self.simulate("again.bag", images_from=clean)
        self.assertEqual(status, 0, errors)
        self.assertEqual(noisy.read_bytes(), again.read_bytes())
        other, status, errors = self.simulate("other.bag", images_from=clean, sensor_seed=7, exposure_gain=1.5)
        self.assertEqual(status, 0, errors)
        first, second = (self.drive_contents(bag) for bag in (noisy, other))
        self.assertGreater(second["image"].mean(), 1.15 * first["image"].mean())
        self.assertTrue((first["ticks"] != second["ticks"]).any())
        self.assertLessEqual(abs(first["ticks"] - second["ticks"]).max(), 1)

    @staticmethod
    def drive_contents(path):
        with rosbag.Bag(str(path)) as bag:
            images = [np.frombuffer(message.data, np.uint8) for _, message, _ in bag.read_messages(
                topics=["/camera/left/image_raw"])]
            ticks = [[message.left_ticks, message.right_ticks] for _, message, _ in bag.read_messages(
                topics=["/wheel_ticks"])]
        return {"image": np.array(images).astype(float), "ticks": np.array(ticks)}

    def test_images_of_another_drive_are_not_taken(self):
        clean, status, errors = self.simulate("clean_of_seed_1.bag", noise="off")
        self.assertEqual(status, 0, errors)
        before = files_below(clean.parent)
        for change in ({"seed": 2}, {"drive": "loop"}, {"cameras": "front"}, {"duration_s": 0.7}):
            _, status, errors = self.simulate("mixed.bag", images_from=clean, **change)
            self.assertNotEqual(status, 0, change)
            self.assertEqual(len(errors), 1, errors)
            self.assertIn("clean_of_seed_1.bag", errors[0])
        self.assertEqual(files_below(clean.parent), before)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "offline", OfflineTest)
