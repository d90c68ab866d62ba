#!/usr/bin/env python3
"""Every fault of the simulator, measured in the bag: it affects its interval and its camera, and nothing else."""
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import cv2
import numpy as np
import rosbag
import rospkg
import rostest
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import files_below, run, tool  # noqa: E402

CAMERAS = ("front", "left", "rear", "right")
DRIVE = {"drive": "short", "duration_s": 1, "image_scale": 0.1}
START_NS = 1400000000 * 10**9


class Recording:
    """The messages of a bag and the truth beside it, times in milliseconds since the drive's start."""

    def __init__(self, path):
        self.images = {camera: [] for camera in CAMERAS}  # (stamp, received, pixels)
        self.odometry, self.ticks, self.truth = {}, {}, {}
        with rosbag.Bag(str(path)) as bag:
            for topic, message, time in bag.read_messages():
                stamp = self.milliseconds(message.header.stamp)
                received = self.milliseconds(time)
                if topic == "/odom":
                    self.odometry[stamp] = (message.pose.pose.position.x, message.pose.pose.position.y)
                elif topic == "/wheel_ticks":
                    self.ticks[stamp] = (message.left_ticks, message.right_ticks)
                elif topic == "/ground_truth":
                    self.truth[stamp] = str(message.pose)
                elif topic.endswith("/image_raw"):
                    pixels = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width)
                    self.images[topic.split("/")[2]].append((stamp, received, pixels.astype(np.float32)))
        for images in self.images.values():
            images.sort(key=lambda image: image[0])
        self.folder = path.parent / (path.stem + "_truth")
        self.faults = yaml.safe_load((self.folder / "faults.yaml").read_text())["faults"]

    @staticmethod
    def milliseconds(stamp):
        return (stamp.to_nsec() - START_NS) // 10**6

    def stamps(self, camera):
        return [stamp for stamp, _, _ in self.images[camera]]

    def pixels(self, camera):
        return {stamp: pixels for stamp, _, pixels in self.images[camera]}


def sharpness(image):
    return cv2.Laplacian(image, cv2.CV_32F).var()


class FaultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.simulate("clean", noise="off")
        cls.simulate("base", images_from=cls.folder / "clean.bag")
        cls.clean = Recording(cls.folder / "clean.bag")
        cls.base = Recording(cls.folder / "base.bag")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def try_to_simulate(cls, name, settings=(), **options):
        arguments = {**DRIVE, "output": cls.folder / f"{name}.bag", **options}
        words = [word for key, value in arguments.items() for word in ("--" + key.replace("_", "-"), value)]
        for setting in settings:
            words += ["--set", setting]
        return run([tool("vcharge_simulation", "simulate_drive"), *words])

    @classmethod
    def simulate(cls, name, settings=(), **options):
        status, output, errors = cls.try_to_simulate(name, settings, **options)
        if status != 0 or errors:
            raise RuntimeError(f"simulate_drive failed: {output} {errors}")

    def fault(self, kind, *settings):
        """A recording with the fault from the base drive's noise-free images, and the fault's truth."""
        self.simulate(kind, [f"faults.{kind}.{setting}" for setting in settings],
                      images_from=self.folder / "clean.bag")
        recording = Recording(self.folder / f"{kind}.bag")
        self.assertEqual([fault["kind"] for fault in recording.faults], [kind])
        return recording, recording.faults[0]

    def assert_same(self, recording, *, cameras=CAMERAS, motion=True):
        """Asserts that images, odometry and counters equal the base drive's."""
        for camera in cameras:
            self.assertEqual(recording.stamps(camera), self.base.stamps(camera), camera)
            for (_, received, pixels), (_, base_received, base_pixels) in zip(recording.images[camera],
                                                                              self.base.images[camera]):
                self.assertEqual(received, base_received)
                np.testing.assert_array_equal(pixels, base_pixels)
        if motion:
            self.assertEqual(recording.odometry, self.base.odometry)
            self.assertEqual(recording.ticks, self.base.ticks)
        self.assertEqual(recording.truth, self.base.truth)

    def differing(self, recording, camera):
        """Stamps at which the camera's pixels differ from the base drive's."""
        base = self.base.pixels(camera)
        return [stamp for stamp, pixels in recording.pixels(camera).items() if (pixels != base[stamp]).any()]

    def acting(self, camera, start, end=10**6):
        return [stamp for stamp in self.base.stamps(camera) if start <= stamp < end]

    def test_nothing_changes_without_a_fault(self):
        self.assertEqual(self.base.faults, [])
        self.assertNotIn("rig_after.yaml", files_below(self.base.folder))
        self.simulate("none", ["faults.bumped_camera.rotation_rad=[1, 0, 0]", "faults.exposure_step.gain=4"],
                      images_from=self.folder / "clean.bag")
        self.assertEqual((self.folder / "none.bag").read_bytes(), (self.folder / "base.bag").read_bytes())

    def test_dead_camera(self):
        recording, truth = self.fault("dead_camera", "cameras=[left]", "start_s=0.3", "end_s=0.6")
        self.assert_same(recording, cameras=("front", "rear", "right"))
        missing = sorted(set(self.base.stamps("left")) - set(recording.stamps("left")))
        self.assertEqual(missing, self.acting("left", 300, 600))
        self.assertEqual((truth["cameras"], truth["start_stamp_ns"], truth["end_stamp_ns"]),
                         (["left"], START_NS + 300 * 10**6, START_NS + 600 * 10**6))

    def test_frozen_camera(self):
        recording, _ = self.fault("frozen_camera", "cameras=[left]", "start_s=0.3")
        self.assert_same(recording, cameras=("front", "rear", "right"))
        self.assertEqual(self.differing(recording, "left"), self.acting("left", 300))
        last = self.base.pixels("left")[247]
        for stamp in self.acting("left", 300):
            np.testing.assert_array_equal(recording.pixels("left")[stamp], last)

    def test_sun_glare(self):
        recording, _ = self.fault("sun_glare", "cameras=[front]", "start_s=0.5", "x=0.5", "y=0.5")
        self.assert_same(recording, cameras=("left", "rear", "right"))
        self.assertEqual(self.differing(recording, "front"), self.acting("front", 500))
        for stamp in self.acting("front", 500):
            pixels = recording.pixels("front")[stamp]
            self.assertGreaterEqual(pixels[37:43, 61:67].min(), 250)  # white, but for the sensor's noise
            self.assertGreater(pixels.mean(), self.base.pixels("front")[stamp].mean() + 20)

    def test_dirty_lens(self):
        recording, _ = self.fault("dirty_lens", "cameras=[left]")
        self.assert_same(recording, cameras=("front", "rear", "right"))
        self.assertEqual(self.differing(recording, "left"), self.base.stamps("left"))
        difference = np.array([recording.pixels("left")[stamp] - self.base.pixels("left")[stamp]
                               for stamp in self.base.stamps("left")])
        # The line brightens dark pixels at the same position in every image.
        always_brighter = (difference > 15).all(axis=0)
        self.assertGreater(always_brighter.any(axis=0).mean(), 0.5)
        self.assertLess(always_brighter.mean(), 0.3)
        self.assertTrue((difference < -10).all(axis=0).any(), "no blob darkens")

    def test_faults_of_one_lens_or_sensor(self):
        for kind, *settings in (("vignetting",), ("water_drop",), ("auto_exposure", "target_gray=120", "time_constant_s=0"),
                                ("camera_gains", "gains=[2]"), ("bright_lamps", "image_positions=[0.5, 0.4]")):
            with self.subTest(kind):
                recording, truth = self.fault(kind, "cameras=[left]", *settings)
                self.assert_same(recording, cameras=("front", "rear", "right"))
                self.assertEqual(self.differing(recording, "left"), self.base.stamps("left"))
                self.assertEqual(truth["cameras"], ["left"])
                if kind == "auto_exposure":
                    self.assertEqual([(image["stamp_ns"] - START_NS) // 10**6 for image in truth["exposures"]["left"]],
                                     self.base.stamps("left"))
                    for pixels in recording.pixels("left").values():
                        self.assertAlmostEqual(pixels.mean(), 120, delta=2)

    def test_low_light(self):
        recording, _ = self.fault("low_light", "level=0.02")
        for camera in CAMERAS:
            for stamp, pixels in recording.pixels(camera).items():
                self.assertLess(pixels.mean(), 0.2 * self.base.pixels(camera)[stamp].mean())

    def test_swapped_cameras(self):
        recording, _ = self.fault("swapped_cameras", "cameras=[left, right]", "start_s=0.5")
        self.assert_same(recording, cameras=("front", "rear"))
        for camera, other in (("left", "right"), ("right", "left")):
            self.assertEqual(recording.stamps(camera), self.base.stamps(camera))
            for stamp, pixels in recording.pixels(camera).items():
                source = other if stamp >= 500 else camera
                np.testing.assert_array_equal(pixels, self.base.pixels(source)[stamp])
        before, after = (yaml.safe_load((recording.folder / f"rig_{when}.yaml").read_text())["cameras"]
                         for when in ("before", "after"))
        self.assertEqual(after["left"]["intrinsics"], before["right"]["intrinsics"])
        self.assertEqual(after["right"]["vehicle_from_camera"], before["left"]["vehicle_from_camera"])
        self.assertEqual(after["front"]["vehicle_from_camera"], before["front"]["vehicle_from_camera"])

    def test_dropped_images(self):
        recording, truth = self.fault("dropped_images", "cameras=[all]", "probability=0.3")
        dropped = 0
        for camera in CAMERAS:
            missing = sorted(set(self.base.stamps(camera)) - set(recording.stamps(camera)))
            told = [(stamp - START_NS) // 10**6 for stamp in truth["images_ns"].get(camera, [])]
            self.assertEqual(missing, told)
            self.assertEqual(self.differing(recording, camera), [])
            dropped += len(missing)
        total = sum(len(self.base.stamps(camera)) for camera in CAMERAS)
        self.assertGreater(dropped, 0.1 * total)
        self.assertLess(dropped, 0.5 * total)

    def test_late_images(self):
        recording, truth = self.fault("late_images", "cameras=[rear]", "probability=0.4", "delay_s=0.17")
        self.assert_same(recording, cameras=("front", "left", "right"))
        self.assertEqual(recording.stamps("rear"), self.base.stamps("rear"))
        late = [stamp for stamp, received, _ in recording.images["rear"] if received != stamp]
        self.assertEqual(late, [(stamp - START_NS) // 10**6 for stamp in truth["images_ns"]["rear"]])
        self.assertTrue(0 < len(late) < len(recording.stamps("rear")))
        for stamp, received, _ in recording.images["rear"]:
            self.assertIn(received - stamp, (0, 170))

    def test_image_stamp_shift(self):
        recording, _ = self.fault("image_stamp_shift", "cameras=[left]", "start_s=0.3", "shifts_s=[0.02]")
        self.assert_same(recording, cameras=("front", "rear", "right"))
        for (stamp, received, pixels), (true_stamp, _, base_pixels) in zip(recording.images["left"],
                                                                           self.base.images["left"]):
            self.assertEqual(stamp - true_stamp, 20 if true_stamp >= 300 else 0)
            self.assertEqual(received, true_stamp)
            np.testing.assert_array_equal(pixels, base_pixels)

    def test_exposure_step(self):
        recording, _ = self.fault("exposure_step", "cameras=[left]", "start_s=0.3", "end_s=0.6", "gain=2.5")
        self.assert_same(recording, cameras=("front", "rear", "right"))
        self.assertEqual(self.differing(recording, "left"), self.acting("left", 300, 600))
        for stamp in self.acting("left", 300, 600):
            self.assertGreater(recording.pixels("left")[stamp].mean(), 1.25 * self.base.pixels("left")[stamp].mean())

    def test_odometry_stamp_shift(self):
        recording, _ = self.fault("odometry_stamp_shift", "shift_s=0.03", "drift_ppm=10000")
        self.assert_same(recording, motion=False)
        for values, base in ((recording.odometry, self.base.odometry), (recording.ticks, self.base.ticks)):
            self.assertEqual(values, {stamp + 30 + stamp // 100: value for stamp, value in base.items()})

    def test_odometry_scale(self):
        recording, _ = self.fault("odometry_scale", "factor=1.2")
        self.assert_same(recording, motion=False)
        last = max(self.base.ticks)
        for wheel in (0, 1):
            self.assertAlmostEqual(recording.ticks[last][wheel], 1.2 * self.base.ticks[last][wheel], delta=2)
        self.assertAlmostEqual(recording.odometry[last][0], 1.2 * self.base.odometry[last][0], delta=0.03)

    def test_wheel_slip(self):
        recording, _ = self.fault("wheel_slip", "wheel=right", "start_s=0.4", "end_s=0.6", "ratio=0.5")
        self.assert_same(recording, motion=False)
        grown = {stamp: recording.ticks[stamp][1] - right for stamp, (_, right) in self.base.ticks.items()}
        self.assertEqual({stamp: left for stamp, (left, _) in recording.ticks.items()},
                         {stamp: left for stamp, (left, _) in self.base.ticks.items()})
        self.assertTrue(all(ticks == 0 for stamp, ticks in grown.items() if stamp < 400))
        driven = self.base.ticks[600][1] - self.base.ticks[400][1]
        self.assertTrue(all(abs(ticks - 0.5 * driven) <= 1 for stamp, ticks in grown.items() if stamp >= 600))

    def test_missing_ticks(self):
        recording, _ = self.fault("missing_ticks", "start_s=0.4", "end_s=0.6")
        self.assert_same(recording, motion=False)
        self.assertEqual(recording.ticks, {stamp: ticks for stamp, ticks in self.base.ticks.items()
                                           if not 400 <= stamp < 600})
        extrapolated = 407  # the image within 0.1 s of the last ticks
        self.assertEqual(sorted(recording.odometry), [stamp for stamp in sorted(self.base.odometry)
                                                      if not 400 <= stamp < 600 or stamp == extrapolated])
        last = max(self.base.odometry)
        self.assertAlmostEqual(recording.odometry[last][0], self.base.odometry[last][0], delta=0.02)

    def test_counter_reset(self):
        recording, truth = self.fault("counter_reset", "time_s=0.5")
        self.assert_same(recording, motion=False)
        self.assertEqual(truth["start_stamp_ns"], START_NS + 500 * 10**6)
        offset = self.base.ticks[500]
        for stamp, (left, right) in self.base.ticks.items():
            expected = (left - offset[0], right - offset[1]) if stamp >= 500 else (left, right)
            self.assertEqual(recording.ticks[stamp], expected)
        self.assertEqual(recording.odometry[500], (0.0, 0.0))
        self.assertEqual(recording.odometry[460], self.base.odometry[460])

    def test_faults_that_change_what_is_rendered(self):
        """In one rendering: the left camera is turned, the front camera's images blur, the rear camera's rows roll."""
        angle_rad = 0.2
        settings = ["faults.bumped_camera.cameras=[left]", "faults.bumped_camera.start_s=0.5",
                    f"faults.bumped_camera.rotation_rad=[0, 0, {angle_rad}]",
                    "faults.motion_blur.cameras=[front]", "faults.motion_blur.exposure_time_s=0.08",
                    "faults.rolling_shutter.cameras=[rear]", "faults.rolling_shutter.readout_time_s=0.03"]
        self.simulate("rendered", settings, noise="off")
        recording = Recording(self.folder / "rendered.bag")
        self.simulate("partly", settings, noise="off", images_from=self.folder / "clean.bag")
        partly = Recording(self.folder / "partly.bag")
        for camera in recording.images:
            np.testing.assert_array_equal(list(partly.pixels(camera).values()), list(recording.pixels(camera).values()))
        self.assertEqual([fault["kind"] for fault in recording.faults], ["bumped_camera", "rolling_shutter", "motion_blur"])
        for stamp, pixels in recording.pixels("right").items():
            np.testing.assert_array_equal(pixels, self.clean.pixels("right")[stamp])
        for stamp, pixels in recording.pixels("rear").items():
            difference = np.abs(pixels - self.clean.pixels("rear")[stamp]).mean(axis=1)
            self.assertLess(difference[38:42].mean(), 0.5 * difference[60:].mean(), "the middle rows are at the stamp")
        for stamp, pixels in recording.pixels("left").items():
            self.assertAlmostEqual(self.turn_about_axis(self.clean.pixels("left")[stamp], pixels),
                                   angle_rad if stamp >= 500 else 0.0, delta=0.011)
        for stamp, pixels in recording.pixels("front").items():
            sharp = self.clean.pixels("front")[stamp]
            self.assertLess(sharpness(pixels), 0.9 * sharpness(sharp))
            self.assertLess(abs(pixels.mean() - sharp.mean()), 2.0, "the same light, only spread")
        rigs = [yaml.safe_load((recording.folder / f"rig_{when}.yaml").read_text())["cameras"]
                for when in ("before", "after")]
        before, after = (np.array(rig["left"]["vehicle_from_camera"]["rotation_xyzw"]) for rig in rigs)
        self.assertAlmostEqual(2.0 * np.arccos(abs(before @ after)), angle_rad, places=6)
        for camera in ("front", "rear", "right"):
            self.assertEqual(rigs[0][camera]["vehicle_from_camera"], rigs[1][camera]["vehicle_from_camera"])

    def test_images_that_are_all_changed_are_not_taken_from_another_drive(self):
        status, _, errors = self.try_to_simulate("refused", ["faults.soft_suspension.pitch_factor=3"],
                                                 images_from=self.folder / "clean.bag")
        self.assertNotEqual(status, 0)
        self.assertIn("faults.soft_suspension", errors[0])

    def turn_about_axis(self, before, after):
        """Rotation angle about the principal point that aligns the two images."""
        rig = yaml.safe_load((self.folder / "rig_truth.yaml").read_text())["cameras"]["left"]["intrinsics"]
        centre = np.array([rig["u0"], rig["v0"]])
        rows, columns = np.indices(before.shape)
        inside = np.hypot(columns - centre[0], rows - centre[1]) < 35

        def difference(angle_rad):
            turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad)], [np.sin(angle_rad), np.cos(angle_rad)]])
            matrix = np.column_stack([turn, centre - turn @ centre])
            turned = cv2.warpAffine(before, matrix, before.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
            return np.abs(turned - after)[inside].mean()

        return min(np.arange(-0.3, 0.301, 0.01), key=difference)

    def test_scenario_files_load_and_name_faults_there_are(self):
        folder = pathlib.Path(rospkg.RosPack().get_path("vcharge_config")) / "scenarios"
        program = tool("vcharge_simulation", "simulate_drive")
        kinds = set(yaml.safe_load(run([program, "--show-options"])[1])["faults"])
        with_fault = set()
        for path in sorted(folder.glob("*.yaml")):
            status, output, errors = run([program, "--scenario", path, "--show-options"])
            self.assertEqual((status, errors), (0, []), path)
            given, read = yaml.safe_load(path.read_text()), yaml.safe_load(output)
            for key in ("scene", "drive", "rig"):
                self.assertEqual(read[key], given.get(key, "golf"), path)
            faults = given.get("faults", {})
            # Darkness needs long exposures, which blur.
            is_condition = path.stem.startswith("condition_")
            self.assertTrue(not faults or is_condition or any(path.stem.startswith(f"fault_{kind}") for kind in faults), path)
            for kind, fields in faults.items():
                with_fault.update([] if is_condition else [kind])
                for key, value in fields.items():
                    self.assertEqual(read["faults"][kind][key], value, path)
        self.assertEqual(with_fault, kinds)

    def test_list_shows_what_there_is(self):
        status, output, errors = run([tool("vcharge_simulation", "simulate_drive"), "--list"])
        self.assertEqual((status, errors), (0, []))
        for word in ("lot:", "short:", "golf:", "random:", "dead_camera:", "soft_suspension:"):
            self.assertIn(word, output)

    def test_faults_of_unknown_cameras_and_keys_are_named(self):
        for setting in ("faults.dead_camera.cameras=[roof]", "faults.dead_camera.cam=[left]", "faults.flood.depth_m=1"):
            status, _, errors = self.try_to_simulate("wrong", [setting], images_from=self.folder / "clean.bag")
            self.assertNotEqual(status, 0, setting)
            self.assertEqual(len(errors), 1, errors)
            self.assertIn(setting.split("=")[0].rsplit(".", 1)[0], errors[0])
        self.assertNotIn("wrong.bag", files_below(self.folder))


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "faults", FaultsTest)
