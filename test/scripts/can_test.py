#!/usr/bin/env python3
"""From a DBC file and a CAN log to odometry: import_dbc describes the messages, decode_can reads a log with them."""
import csv
import math
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import rospkg
import rostest
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import counted_skips  # noqa: E402,F401
from drive_fixture import run, run_tool, tool  # noqa: E402

CONFIG = pathlib.Path(rospkg.RosPack().get_path("vcharge_config"))
DATA = os.environ.get("VCHARGE_DATA")
STEERING_RATIO = 16
TRACK_M = 1.6
# Wheels and steering as a Toyota sends them, and a car with multiplexed counters.
DBC = """VERSION ""
BO_ 170 WHEELS: 8 BRAKES
 SG_ FR : 7|16@0+ (0.01,-67.67) [0|250] "km/h" X
 SG_ FL : 23|16@0+ (0.01,-67.67) [0|250] "km/h" X
 SG_ RR : 39|16@0+ (0.01,-67.67) [0|250] "km/h" X
 SG_ RL : 55|16@0+ (0.01,-67.67) [0|250] "km/h" X
BO_ 37 STEERING: 8 STEER
 SG_ ANGLE : 3|12@0- (1.5,0) [-500|500] "deg" X
 SG_ FRACTION : 39|4@0- (0.1,0) [-0.7|0.7] "deg" X
 SG_ TORQUE : 47|8@0- (0.1,0) [-10|10] "Nm" X
BO_ 288 PULSES: 4 BRAKES
 SG_ SIDE M : 0|1@1+ (1,0) [0|1] "" X
 SG_ LEFT m0 : 8|16@1+ (0.02,0) [0|1311] "m" X
 SG_ RIGHT m1 : 8|16@1+ (0.02,0) [0|1311] "m" X
 SG_ CLASH : 12|16@1+ (0.01,0) [0|1] "m/s" X
 SG_ TOO_LONG : 24|16@1+ (0.01,0) [0|1] "m/s" X
"""
WHEELS = ("--rear-left", "WHEELS.RL", "--rear-right", "WHEELS.RR", "--front-left", "WHEELS.FL", "--front-right", "WHEELS.FR")
STEERING = ("--steering", "STEERING.ANGLE", "STEERING.FRACTION", "--steering-ratio", STEERING_RATIO)


def signed(value, bits):
    return value & ((1 << bits) - 1)


def wheels_frame(front_right, front_left, rear_right, rear_left):
    """Speeds in m/s."""
    return "0AA#" + "".join(f"{round((3.6 * speed + 67.67) / 0.01):04X}"
                            for speed in (front_right, front_left, rear_right, rear_left))


def steering_frame(degrees):
    tenths = round(10 * degrees)
    coarse = round(tenths / 15)
    word = signed(coarse, 12)
    return f"025#{word >> 8:02X}{word & 255:02X}0000{signed(tenths - 15 * coarse, 4) << 4:02X}000000"


class CanTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.dbc = cls.folder / "car.dbc"
        cls.dbc.write_text(DBC)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def import_dbc(self, *words):
        layout = self.folder / "layout.yaml"
        layout.unlink(missing_ok=True)
        status, found, errors = run_tool([tool("vcharge_camera_driver", "import_dbc"), "--dbc", self.dbc, "--output", layout,
                                          *words])
        self.assertEqual(layout.exists(), status == 0)
        return layout, found, errors

    def decode(self, log, layout, *words):
        output = self.folder / "decoded.csv"
        status, found, errors = run_tool([tool("vcharge_camera_driver", "decode_can"), "--log", log, "--layout", layout,
                                          "--output", output, *words])
        self.assertEqual(status, 0, errors)
        with open(output, encoding="utf-8") as file:
            return found, list(csv.DictReader(file))

    def write_drive(self, scale):
        """A minute at 10 m/s through bends; wheels that tell too little by `scale`, and the positions."""
        log, poses = self.folder / "can.log", self.folder / "poses.csv"
        x_m = y_m = yaw = 0.0
        frames, positions = [], ["t_s,east_m,north_m"]
        for i in range(6000):
            time_s = 1000 + 0.01 * i
            curvature = 0.02 * math.sin(0.3 * 0.01 * i)
            rear = [10 * (1 + side * 0.5 * TRACK_M * curvature) / scale for side in (1, -1)]  # right, left
            front = [math.hypot(speed, 10 * curvature * 2.66 / scale) for speed in rear]
            frames.append(f"({time_s:.6f}) can0 {steering_frame(math.degrees(math.atan(2.66 * curvature)) * STEERING_RATIO)}")
            frames.append(f"({time_s:.6f}) can0 {wheels_frame(*front, *rear)}")
            if i % 10 == 0:
                positions.append(f"{time_s:.6f},{x_m:.4f},{y_m:.4f}")
            yaw += 0.05 * curvature
            x_m, y_m = x_m + 0.1 * math.cos(yaw), y_m + 0.1 * math.sin(yaw)
            yaw += 0.05 * curvature
        log.write_text("\n".join(frames) + "\n")
        poses.write_text("\n".join(positions) + "\n")
        return log, poses

    def test_a_drive_is_decoded_and_its_wheels_are_calibrated(self):
        layout, found, errors = self.import_dbc(*WHEELS, *STEERING)
        self.assertEqual(errors, [])
        self.assertEqual(len(found["signals"]), 5)
        log, poses = self.write_drive(scale=1.01)
        found, rows = self.decode(log, layout, "--poses", poses, "--path", self.folder / "path.tum")
        self.assertEqual(found["measurements"], 6000)
        self.assertEqual(found["slips"], 0)
        self.assertAlmostEqual(found["distance_m"], 600 / 1.01, delta=0.2)
        self.assertAlmostEqual(float(rows[0]["rear_left_m_per_s"]), 10 / 1.01, delta=0.002)
        curvature = 0.02 * math.sin(0.3 * 10)
        self.assertAlmostEqual(float(rows[1000]["steering_angle_rad"]), math.atan(2.66 * curvature), delta=1e-4)
        calibration = found["calibration"]
        for name, truth in (("scale", 1.01), ("right_over_left", 1.0), ("track_width_m", TRACK_M)):
            self.assertTrue(calibration[name]["is_observable"], name)
            self.assertAlmostEqual(calibration[name]["value"], truth, delta=2 * calibration[name]["sigma"], msg=name)
        drift = found["drift"]
        self.assertGreater(drift["nominal"]["mean_m"], 0.9)
        self.assertLess(drift["calibrated"]["worst_m"], 0.3)
        self.assertGreater(drift["calibrated"]["num_sub_paths"], 1000)
        self.assertEqual(len((self.folder / "path.tum").read_text().splitlines()), 6001)

    def test_multiplexed_counters_without_steering(self):
        layout, _, errors = self.import_dbc("--left-ticks", "PULSES.LEFT", "--right-ticks", "PULSES.RIGHT")
        self.assertEqual(errors, [])
        described = yaml.safe_load(layout.read_text())
        self.assertEqual(described["odometry"], {"use_steering": False})
        self.assertEqual(described["can"]["right_ticks"]["multiplexor"]["value"], 1)
        log = self.folder / "pulses.log"
        log.write_text("".join(f"({0.02 * i + 0.01 * side:.6f}) can0 120#{side:02X}{count & 255:02X}{count >> 8:02X}00\n"
                               for i in range(100) for side, count in ((0, 65530 + 10 * i & 65535), (1, 12 * i))))
        found, rows = self.decode(log, layout)
        self.assertEqual(found["wraps"], 1)
        self.assertEqual((rows[-1]["left_ticks"], rows[-1]["right_ticks"]), ("990", "1188"))
        self.assertEqual(rows[-1]["steering_angle_rad"], "")

    def test_mistakes_are_named_in_one_line(self):
        for words, expected in (
                ((*WHEELS[:6], "--front-right", "WHEELS.RF"), f"{self.dbc}: message WHEELS, signal RF: expected one of FR, FL"),
                (("--rear-left", "BRAKES.RL"), f"{self.dbc}: message BRAKES: expected a message"),
                ((*WHEELS[:4], "--steering", "STEERING.TORQUE"), "STEERING.TORQUE: expected the unit deg or rad, got 'Nm'"),
                (("--rear-left", "PULSES.TOO_LONG"), "signal TOO_LONG: expected bits within the message's 4 bytes"),
                (("--left-ticks", "PULSES.LEFT", "--right-ticks", "PULSES.CLASH"), "must take other bits of message 0x120"),
                (WHEELS[:2], "both wheels must have a message"),
                ((), "expected --rear-left and --rear-right"),
                ((*WHEELS[:4], "--steering", "STEERING.ANGLE", "--steering-ratio", 0), "--steering-ratio"),
                ((*WHEELS[:4], "--steering", "STEERING.ANGLE", "WHEELS.FR", "--angle-unit", "deg"), "of the message of STEERING")):
            _, _, errors = self.import_dbc(*words)
            self.assertEqual(len(errors), 1, errors)
            self.assertIn(expected, errors[0])
        layout, _, _ = self.import_dbc(*WHEELS)
        log, poses = self.write_drive(scale=1.0)
        for change, words, expected in (
                ("can: {left_speed_m_per_s: {id: 1, length: 16}}", (), "both wheels must have a message"),
                ("can: {left_speed: {id: 1}}", (), "can.left_speed: unknown key"),
                ("odometry: {}", (), "can.left_ticks: must describe the wheels' messages"),
                (layout.read_text().replace("0x0aa", "0x0ab"), (), "has no frame with the wheels' messages"),
                (layout.read_text().replace("odometry:\n  use_steering: false", ""), (), "odometry.use_steering: must be false"),
                (layout.read_text(), ("--poses", self.dbc), "expected a first line with the columns t_s"),
                (layout.read_text(), ("--poses", log), "expected a first line with the columns t_s")):
            wrong = self.folder / "wrong.yaml"
            wrong.write_text(change)
            status, _, errors = run([tool("vcharge_camera_driver", "decode_can"), "--log", log, "--layout", wrong, *words])
            self.assertEqual((status, len(errors)), (1, 1), errors)
            self.assertIn(expected, errors[0])

    @unittest.skipUnless(DATA and (pathlib.Path(DATA) / "comma2k19_can").is_dir(),
                         "VCHARGE_DATA is not set or has no CAN log of a real car")
    def test_the_layout_of_a_real_car_is_that_of_its_dbc_file(self):
        log = pathlib.Path(DATA) / "comma2k19_can" / "can.log"
        layout, _, _ = self.import_dbc(*WHEELS, *STEERING)
        _, imported = self.decode(log, layout)
        found, shipped = self.decode(log, CONFIG / "driver" / "toyota_rav4.yaml")
        self.assertEqual(imported, shipped)
        self.assertEqual((found["gaps"], found["slips"], found["too_short"]), (0, 0, 0))


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "can", CanTest)
