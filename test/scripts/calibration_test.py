#!/usr/bin/env python3
"""Intrinsic calibration end to end: a bag through tool and nodelet, and bad input of the tools."""
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import cv2
import numpy as np
import rosbag
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import CompressedImage, Image
from std_srvs.srv import Trigger
from vcharge_msgs.msg import CalibrationStatus

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import run, tool  # noqa: E402
from nodelet_fixture import manager_services, wait_for  # noqa: E402

WIDTH, HEIGHT = 640, 400
FOCAL_PX, CENTRE = 210.0, (325.0, 195.0)  # equidistant: radius = focal length x angle
SQUARE_M = 0.05
NUM_VIEWS = 14


def rotation(axis, angle):
    return cv2.Rodrigues(np.array(axis, float) * angle)[0]


def render(camera_from_board, middle):
    """Draws a chessboard of 9x6 inner corners centred at `middle` through an equidistant lens, with 2 x 2 rays per pixel."""
    u, v = np.meshgrid((np.arange(2 * WIDTH) + 0.5) / 2 - 0.5, (np.arange(2 * HEIGHT) + 0.5) / 2 - 0.5)
    x, y = (u - CENTRE[0]) / FOCAL_PX, (v - CENTRE[1]) / FOCAL_PX
    theta = np.hypot(x, y)
    scale = np.sinc(theta / np.pi)
    rays = np.stack([x * scale, y * scale, np.cos(theta)], -1) @ camera_from_board
    eye = -camera_from_board.T @ middle
    along = np.where(rays[..., 2] > 1e-6, -eye[2] / np.maximum(rays[..., 2], 1e-6), np.nan)
    column = (eye[0] + along * rays[..., 0]) / SQUARE_M + 5.0
    row = (eye[1] + along * rays[..., 1]) / SQUARE_M + 3.5
    image = np.full(u.shape, 110.0)
    image[(column > -0.5) & (row > -0.5) & (column < 10.5) & (row < 7.5)] = 215.0
    inside = (column >= 0) & (row >= 0) & (column < 10) & (row < 7)
    dark = inside & ((np.floor(np.nan_to_num(column)) + np.floor(np.nan_to_num(row))) % 2 == 0)
    image[dark] = 25.0
    return image.reshape(HEIGHT, 2, WIDTH, 2).mean((1, 3))


def render_views():
    random = np.random.default_rng(4)
    images = []
    for i in range(NUM_VIEWS):
        azimuth = 2.4 * i
        angle = 0.15 + 0.75 * np.sqrt((i + 0.5) / NUM_VIEWS) * abs(np.cos(azimuth)) + 0.25 * abs(np.sin(azimuth))
        turn = rotation((-np.sin(azimuth), np.cos(azimuth), 0), angle)
        tilt = rotation((1, 0, 0), random.uniform(-0.5, 0.5)) @ rotation((0, 1, 0), random.uniform(-0.5, 0.5))
        image = render(turn @ tilt, turn @ np.array([0, 0, random.uniform(0.45, 0.7)]))
        images.append(np.clip(np.round(image + random.normal(0, 1.5, image.shape)), 0, 255).astype(np.uint8))
    return images


class CalibrationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.images = render_views()
        (cls.folder / "images").mkdir()
        cls.messages = []
        for i, pixels in enumerate(cls.images):
            cv2.imwrite(str(cls.folder / "images" / f"{i:02}.png"), pixels)
            message = Image(height=HEIGHT, width=WIDTH, step=WIDTH, encoding="mono8", data=pixels.tobytes())
            message.header.stamp = rospy.Time(100 + i)
            message.header.frame_id = "camera_front_optical"
            cls.messages.append(message)
        with rosbag.Bag(str(cls.folder / "raw.bag"), "w") as raw, \
                rosbag.Bag(str(cls.folder / "compressed.bag"), "w") as compressed:
            for message, pixels in zip(cls.messages, cls.images):
                raw.write("/camera/front/image_raw", message, message.header.stamp)
                packed = CompressedImage(header=message.header, format="png",
                                         data=cv2.imencode(".png", pixels)[1].tobytes())
                compressed.write("/camera/front/image_raw/compressed", packed, message.header.stamp)
        cls.tool = tool("vcharge_calibration", "calibrate_intrinsics")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.work = self.folder / self.id().split(".")[-1]
        self.work.mkdir()
        self.rig = self.work / "rig.yaml"

    def calibrate(self, *arguments):
        return run([self.tool, "--square-m", SQUARE_M, "--model", "kannala_brandt", "--output", self.rig, *arguments])

    def check_rig(self, path, tolerance_px=0.1):
        """RMS per coordinate over the image, up to a rotation: from the angles between the pixels' rays."""
        camera = yaml.safe_load(path.read_text())["cameras"]["front"]
        self.assertEqual(camera["image_size_px"], [WIDTH, HEIGHT])
        p = camera["intrinsics"]
        theta = np.linspace(0.02, 1.2, 60)
        radius = theta * (1 + p["k1"] * theta**2 + p["k2"] * theta**4 + p["k3"] * theta**6 + p["k4"] * theta**8)
        self.assertLess(np.sqrt(np.mean((p["fx"] * radius - FOCAL_PX * theta) ** 2)), 3 * tolerance_px)
        self.assertLess(np.sqrt(np.mean((p["fy"] * radius - FOCAL_PX * theta) ** 2)), 3 * tolerance_px)
        self.assertLess(abs(p["cx"] - CENTRE[0]), 5 * tolerance_px)
        self.assertLess(abs(p["cy"] - CENTRE[1]), 5 * tolerance_px)

    def fail_with(self, words, *arguments):
        status, _, errors = self.calibrate(*arguments)
        self.assertGreater(status, 0)
        self.assertEqual(len(errors), 1, errors)
        for word in words:
            self.assertIn(str(word), errors[0])
        self.assertFalse(self.rig.exists())

    def test_folder_and_bags_give_the_same_camera(self):
        report = self.work / "report.html"
        texts = set()
        for source in (("--images", self.folder / "images", "--report", report), ("--bag", self.folder / "raw.bag"),
                       ("--bag", self.folder / "compressed.bag", "--topic", "/camera/front/image_raw")):
            status, output, errors = self.calibrate(*source)
            self.assertEqual((status, errors), (0, []), output)
            self.check_rig(self.rig)
            texts.add(self.rig.read_text())
        self.assertEqual(len(texts), 1)
        self.assertIn("class=\"verdict", report.read_text())

    def test_bad_input_is_named_and_nothing_is_written(self):
        none = self.work / "none"
        self.fail_with([none, "folder"], "--images", none)
        self.fail_with(["--images or --bag"])
        self.fail_with([none, "no such file"], "--bag", none)
        self.fail_with(["/other", "/camera/front/image_raw"], "--bag", self.folder / "raw.bag", "--topic", "/other")
        folder = self.work / "images"
        folder.mkdir()
        self.fail_with([folder, "found none"], "--images", folder)
        (folder / "a.png").write_text("no image")
        self.fail_with(["a.png", "cannot be read"], "--images", folder)
        cv2.imwrite(str(folder / "a.png"), self.images[0])
        self.fail_with(["FAIL", "1 of 1 images"], "--images", folder)
        self.fail_with(["FAIL", "8x5", "9x6"], "--images", folder, "--board", "8x5")
        cv2.imwrite(str(folder / "b.png"), self.images[0].T)
        self.fail_with(["b.png", "640x400", "400x640"], "--images", folder)
        cv2.imwrite(str(folder / "a.png"), np.full((HEIGHT, WIDTH), 90, np.uint8))
        (folder / "b.png").unlink()
        self.fail_with(["FAIL", "no image shows"], "--images", folder)
        target = self.work / "target.yaml"
        target.write_text("{target_type: aprilgrid, tagCols: 6, tagRows: 6, tagSize: 0.088}")
        self.fail_with([target, "tagSpacing"], "--images", folder, "--target", target)
        target.write_text("{target_type: circles}")
        self.fail_with([target, "aprilgrid"], "--images", folder, "--target", target)
        options = self.work / "options.yaml"
        options.write_text("min_views: 1")
        self.fail_with([options, "min_views"], "--images", folder, "--options", options)

    def test_intrinsics_are_converted_and_bad_files_named(self):
        convert = tool("vcharge_calibration", "convert_intrinsics")
        status, _, errors = self.calibrate("--images", self.folder / "images")
        self.assertEqual((status, errors), (0, []))
        for name, steps in (("kalibr", ("kalibr", "rig")), ("camodocal", ("camodocal", "rig"))):
            source = self.rig
            for step in steps:
                result = self.work / f"{name}_{step}.yaml"
                status, _, errors = run([convert, "--input", source, "--format", step, "--output", result])
                self.assertEqual((status, errors), (0, []))
                source = result
            there = next(iter(yaml.safe_load(source.read_text())["cameras"].values()))["intrinsics"]
            here = yaml.safe_load(self.rig.read_text())["cameras"]["front"]["intrinsics"]
            self.assertEqual(there, here)
        status, output, errors = run([convert, "--input", self.rig, "--model", "mei", "--output", self.work / "mei.yaml"])
        self.assertEqual((status, errors), (0, []))
        self.assertIn("px RMS", output)
        bad = self.work / "bad.yaml"
        bad.write_text("model_type: NONE")
        for words, arguments in ((["bad.yaml", "KANNALA_BRANDT"], ["--input", bad]),
                                 (["opencv"], ["--input", self.rig, "--format", "opencv"]),
                                 (["fish"], ["--input", self.rig, "--model", "fish"]),
                                 (["roof", "front"], ["--input", self.rig, "--camera", "roof"])):
            status, _, errors = run([convert, "--output", self.work / "new.yaml", *arguments])
            self.assertGreater(status, 0)
            self.assertEqual(len(errors), 1, errors)
            for word in words:
                self.assertIn(word, errors[0])
            self.assertFalse((self.work / "new.yaml").exists())

    def test_nodelet_says_what_is_missing_and_calibrates(self):
        states, diagnostics = [], []
        subscribers = [rospy.Subscriber("/calibration/status", CalibrationStatus, states.append),
                       rospy.Subscriber("/diagnostics", DiagnosticArray, diagnostics.append)]
        publisher = rospy.Publisher("/camera/front/image_raw", Image, queue_size=10)
        rospy.set_param("/calibration", {
            "camera": "front", "output": str(self.rig), "square_m": SQUARE_M, "options": {"model": "kannala_brandt"},
            "collector": {"enough_views": 8, "enough_coverage": 0.5, "enough_tilted": 1}})
        load, _, _ = manager_services()
        self.assertTrue(load("/calibration", "vcharge_calibration/intrinsic_calibration_nodelet", [], [], [], "").success)
        wait_for(lambda: publisher.get_num_connections() > 0, "a subscriber")
        calibrate = rospy.ServiceProxy("/calibration/calibrate", Trigger)
        early = calibrate()
        self.assertFalse(early.success)
        self.assertFalse(self.rig.exists())
        stamp = 1000.0
        for message in self.messages:
            for _ in range(2):  # held still
                count = len(states)
                stamp += 0.1
                message.header.stamp = rospy.Time.from_sec(stamp)
                publisher.publish(message)
                wait_for(lambda n=count: len(states) > n, "a status")
        wait_for(lambda: states[-1].num_views >= 8, "views")
        self.assertEqual(states[-1].state, CalibrationStatus.READY, states[-1])
        self.assertTrue(any(state.missing and state.state == CalibrationStatus.COLLECTING for state in states))
        wait_for(lambda: any(status.values for array in diagnostics for status in array.status), "diagnostics")
        bad = Image(height=3, width=4, step=4, encoding="mono8", data=bytes(12))
        bad.header.stamp = rospy.Time(5000)
        publisher.publish(bad)
        wait_for(lambda: any("4x3" in status.message for array in diagnostics for status in array.status),
                 "a diagnostic of the bad image")
        answer = calibrate()
        self.assertTrue(answer.success, answer.message)
        wait_for(lambda: states[-1].state == CalibrationStatus.DONE, "the end")
        self.assertLess(states[-1].rms_px, 0.2)
        self.check_rig(self.rig)
        for subscriber in subscribers:
            subscriber.unregister()


if __name__ == "__main__":
    rospy.init_node("calibration_test")
    rostest.rosrun("vcharge_tests", "calibration", CalibrationTest)
