#!/usr/bin/env python3
"""The evaluation module: drives, arithmetic on poses, benchmark comparison, arguments of the chain."""
import contextlib
import io
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree

import cv2
import genpy
import numpy as np
import rosbag
import rostest
import yaml
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "vcharge_evaluation" / "python"))
import vcharge  # noqa: E402
from vcharge_evaluation import __main__ as evaluation_main  # noqa: E402
from vcharge_evaluation import bays, consistency, drives, graphs, obstacles, pose_graphs, poses, results  # noqa: E402
from vcharge_evaluation import spoiled_drives, tools  # noqa: E402
from vcharge_evaluation.live import flame_graph, processes  # noqa: E402


def run_module(module, *words):
    """Exit status, standard output and standard error of python3 -m vcharge_evaluation.MODULE."""
    done = subprocess.run([sys.executable, "-m", f"vcharge_evaluation.{module}", *map(str, words)], capture_output=True,
                          text=True, check=False, cwd=ROOT / "src" / "vcharge_evaluation" / "python")
    return done.returncode, done.stdout, done.stderr


class FolderTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        self.addCleanup(shutil.rmtree, self.folder)


class DrivesTest(FolderTest):
    def rig(self, folder, sizes, masked):
        folder.mkdir()
        cameras = {}
        for name, (width, height) in sizes.items():
            cameras[name] = {"image_size_px": [width, height], "model": "mei"}
            if name in masked:
                cv2.imwrite(str(folder / f"{name}.png"), masked[name])
                cameras[name]["mask"] = f"{name}.png"
        (folder / "rig.yaml").write_text(yaml.safe_dump({"cameras": cameras}))
        return folder / "rig.yaml"

    def test_found_masks_replace_the_true_ones_in_the_size_of_the_images(self):
        found = np.full((40, 80), 255, np.uint8)
        found[:10, :21] = 0
        truth = self.rig(self.folder / "truth", {"left": (40, 20), "front": (40, 20)},
                         {"left": np.zeros((20, 40), np.uint8), "front": np.zeros((20, 40), np.uint8)})
        masked = self.rig(self.folder / "found", {"left": (80, 40), "front": (80, 40)}, {"left": found})
        path = drives.write_masked_rig(truth, masked, self.folder / "truth" / "rig_found.yaml")
        cameras = yaml.safe_load(path.read_text())["cameras"]
        self.assertNotIn("mask", cameras["front"], "no mask was found for this camera")
        pixels = cv2.imread(str(path.parent / cameras["left"]["mask"]), cv2.IMREAD_GRAYSCALE)
        self.assertEqual(pixels.shape, (20, 40))
        self.assertEqual(np.count_nonzero(pixels == 0), 5 * 11)

    def test_where_no_masks_were_found_the_rig_has_none(self):
        truth = self.rig(self.folder / "truth", {"left": (40, 20)}, {"left": np.zeros((20, 40), np.uint8)})
        path = drives.write_masked_rig(truth, None, self.folder / "truth" / "rig_found.yaml")
        self.assertNotIn("mask", yaml.safe_load(path.read_text())["cameras"]["left"])

    def test_a_scene_with_one_plan_has_only_its_surfaces_drawn(self):
        self.assertEqual(tools.drawn(["--scene", "garage", "--scene-seed", "7"]),
                         ["--set", "layout_seed=7", "--set", "surface_seed=7"])
        self.assertEqual(tools.drawn(["--scenario", str(tools.CONFIG / "scenarios" / "road_fast.yaml"), "--scene-seed", "7"]),
                         ["--set", "surface_seed=7"])
        self.assertEqual(tools.drawn([]), ["--set", "layout_seed=1", "--set", "surface_seed=1"])

    def test_reasons_in_results_name_no_paths(self):
        run = tools.Run(0, 0, 0, {"error": "/tmp/some/drive.bag: no range map could be made (front: stands)"})
        self.assertEqual(run.reason(), "no range map could be made (front: stands)")

    def test_a_tool_runs_once_until_its_words_change(self):
        tool = self.folder / "package" / "count_runs"
        tool.parent.mkdir()
        tool.write_text("#!/bin/sh\necho run >> \"$1\"\nshift 2; echo '{}' > \"$2\"\n")
        tool.chmod(0o755)
        self.addCleanup(setattr, tools, "TOOLS", tools.TOOLS)
        tools.TOOLS = self.folder
        runs = self.folder / "runs"
        for word in ("a", "a", "b"):
            tools.run_tool_once("count_runs", self.folder / "tool.log", runs, word)
        self.assertEqual(len(runs.read_text().splitlines()), 2)


class ConsistencyTest(unittest.TestCase):
    def test_interval_of_chi_square(self):
        for dof, expected in ((30, (16.79 / 30, 46.98 / 30)), (100, (0.7422, 1.2956))):
            np.testing.assert_allclose(consistency.chi_square_interval(dof), expected, rtol=2e-3)

    def test_probability_of_a_right_pose_follows_the_covariance(self):
        generator = np.random.default_rng(3)
        self.assertEqual(consistency.probability_right(np.diag([1e-6] * 6), generator), 1.0)
        self.assertLess(consistency.probability_right(np.diag([1.0] * 3 + [1e-6] * 3), generator), 0.01)
        # One direction alone: 68.3 % within a standard deviation.
        one = consistency.probability_right(np.diag([0.01, 0, 0, 0, 0, 0]), generator)
        self.assertAlmostEqual(one, 0.683, delta=4 * (0.683 * 0.317 / consistency.SAMPLES) ** 0.5)

    def test_calibration_error_is_what_is_claimed_too_much(self):
        found = consistency.calibration([0.95] * 10 + [1.0] * 10, [True] * 5 + [False] * 5 + [True] * 10)
        self.assertEqual([one["count"] for one in found["bins"]], [20])
        self.assertAlmostEqual(found["expected_calibration_error"], abs(0.975 - 0.75))
        figures = results.calibration_figures(found)
        self.assertIn("0.9 to 1", figures[1].name)
        self.assertEqual(consistency.calibration([], [])["bins"], [])

    def test_the_worst_drive_is_named(self):
        figures = consistency.squared_figures({"seed 1": [1.0, 1.0], "seed 2": [2.0, 3.0], "seed 3": []})
        self.assertEqual(figures[0].value, 1.75)
        self.assertIn("seed 2", figures[-1].value)
        self.assertFalse(consistency.squared_figures({"seed 1": []})[0].reached)


class ObstacleClassesTest(unittest.TestCase):
    def test_people_are_judged_apart_and_the_unreported_at_contact(self):
        judged = {"obstacles": [{"kind": "car", "reported": True}, {"kind": "car", "reported": False},
                                {"kind": "pole", "reported": True}],
                  "movers": [{"kind": "pedestrian", "maps": 10, "maps_reported": 9}]}
        reports = [{"kind": "pedestrian", "first_reported_m": 4.0, "contact_s": 2.0},
                   {"kind": "pedestrian", "first_reported_m": None, "contact_s": None}]
        classes = obstacles.recall_by_class(judged)
        self.assertEqual(json.loads(json.dumps(classes)), classes, "the chain keeps figures as JSON")
        figures = {one.name: one for one in obstacles.class_figures({"classes": classes, "reports": reports})}
        self.assertEqual(figures["cars, standing: reported, of those that are visible"].value, 50)
        self.assertFalse(figures["cars, standing: reported, of those that are visible"].reached)
        self.assertEqual(figures["people, moving: reported, of those images in which they are visible"].value, 90)
        self.assertEqual(figures["the same, least (people)"].value, 0)
        self.assertEqual(figures["the same time, least (people)"].value, 0)


class PosesTest(FolderTest):
    def test_rotations_turn_axes(self):
        half = np.sqrt(0.5)
        np.testing.assert_allclose(poses.rotations([[0, 0, half, half]])[0] @ [1, 0, 0], [0, 1, 0], atol=1e-12)

    def test_nearest_finds_both_neighbours_and_ends(self):
        np.testing.assert_array_equal(poses.nearest(np.array([0.0, 1.0, 2.0]), np.array([-1.0, 0.4, 0.6, 5.0])), [0, 0, 1, 2])

    def test_a_repeated_stamp_corrects_the_odometry_before(self):
        with rosbag.Bag(str(self.folder / "drive.bag"), "w") as bag:
            for received, (stamp, x) in enumerate(((1, 0.1), (2, 0.2), (2, 0.25), (3, 0.3))):
                message = Odometry()
                message.header.stamp = genpy.Time(stamp)
                message.pose.pose.position.x = x
                bag.write("/odom", message, genpy.Time(10 + received))
            image = Image()
            image.header.stamp = genpy.Time(2)
            bag.write("/camera/left/image_raw", image, genpy.Time(20))
        self.assertEqual(poses.write_odometry(self.folder / "drive.bag", self.folder / "odometry.tum"), (0.0, 1))
        np.testing.assert_allclose(np.loadtxt(self.folder / "odometry.tum")[:, :2], [[1, 0.1], [2, 0.25], [3, 0.3]])

    def test_stamps_are_exact(self):
        self.assertEqual(poses.stamp_ns("1700000000.123456789"), 1700000000123456789)
        self.assertEqual(poses.stamp_ns("5.1"), 5100000000)


class SpoiledDrivesTest(FolderTest):
    @staticmethod
    def message(x, y, yaw):
        message = Odometry()
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation = Quaternion(0, 0, np.sin(yaw / 2), np.cos(yaw / 2))
        return message

    def test_wrong_sign_mirrors_a_turn_and_reverses_a_distance(self):
        for field, expected in (("turn", (1.0, -0.5)), ("distance", (-1.0, -0.5))):
            odometry = spoiled_drives.NegativeOdometry(field)
            odometry.change(self.message(0, 0, 0))
            pose = odometry.change(self.message(1.0, 0.5, 2 * np.arctan2(0.5, 1.0))).pose.pose
            np.testing.assert_allclose((pose.position.x, pose.position.y), expected, atol=1e-9)

    def test_only_the_focal_length_of_one_camera_changes(self):
        rig = {"cameras": {name: {"intrinsics": {"gamma1": 100.0, "xi": 1.0}} for name in ("left", "front")}}
        (self.folder / "rig.yaml").write_text(yaml.safe_dump(rig))
        spoiled_drives.write_wrong_focal(self.folder / "rig.yaml", self.folder / "wrong.yaml")
        rig["cameras"]["left"]["intrinsics"]["gamma1"] = 105.0
        self.assertEqual(yaml.safe_load((self.folder / "wrong.yaml").read_text()), rig)


class BenchmarkComparisonTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.random = random.Random(4)

    def bench(self, name, factors, machine=1.0):
        cases = {f"case{i}": {"times_ns": [1e6 * machine * factor * self.random.uniform(1.0, 1.02) for _ in range(5)]}
                 for i, factor in enumerate(factors)}
        path = self.folder / name
        path.write_text(json.dumps({"benchmarks": {"some_benchmark": cases}}))
        return path

    def compare(self, before, after):
        return run_module("benchmarks.compare", before, after)

    def test_a_slower_machine_is_no_regression(self):
        status, output, _ = self.compare(self.bench("a", [1, 2, 3, 4, 5]), self.bench("b", [1, 2, 3, 4, 5], machine=1.7))
        self.assertEqual(status, 0, output)
        self.assertIn("took 1.7", output)

    def test_only_the_benchmark_that_became_slower_is_named(self):
        status, output, _ = self.compare(self.bench("a", [1, 2, 3, 4, 5]), self.bench("b", [1, 2, 4.2, 4, 5], machine=0.6))
        self.assertEqual(status, 1, output)
        slower = [line for line in output.splitlines() if line.startswith("slower")]
        self.assertEqual(len(slower), 1, output)
        self.assertIn("some_benchmark: case2", slower[0])

    def test_a_faster_benchmark_is_no_regression(self):
        status, output, _ = self.compare(self.bench("a", [1, 2, 3, 4, 5]), self.bench("b", [1, 2, 1.5, 4, 5]))
        self.assertEqual(status, 0, output)
        self.assertIn("faster", output)

    def test_a_broken_file_is_named(self):
        broken = self.folder / "broken.json"
        broken.write_text("{")
        status, _, errors = self.compare(broken, self.bench("b", [1]))
        self.assertEqual(status, 1)
        self.assertIn("broken.json", errors)


class UsageTest(unittest.TestCase):
    def test_a_busy_process_takes_its_share_of_a_core(self):
        usage = processes.Usage()
        self.assertIsNone(usage.load)
        usage.sample(os.getpid())
        end = time.process_time() + 0.3
        while time.process_time() < end:
            pass
        usage.sample(os.getpid())
        self.assertGreater(usage.load, 0.0)
        self.assertLess(usage.load, 1.5)
        self.assertGreater(usage.peak_mb, 1.0)
        usage.sample(None)  # no process: nothing changes
        self.assertGreater(usage.load, 0.0)


class FlameGraphTest(unittest.TestCase):
    SAMPLES = """
manager 1 2.0: 5 cycles:
\tffff1 vcharge::PlaneSweep::sweep(cv::Mat const&)+0x1f (/x/libvcharge_dense.so)
\tffff2 tbb::detail::run() (/x/libtbb.so)
\tffff3 start_thread (/lib/libc.so.6)

manager 1 2.1: 5 cycles:
\tffff1 [unknown] (/usr/lib/libopencv_core.so)
\tffff2 vcharge::PlaneSweep::sweep(cv::Mat const&)+0x2f (/x/libvcharge_dense.so)

manager 1 2.2: 5 cycles:
\tffff4 poll (/lib/libc.so.6)
"""

    def test_stacks_begin_with_their_stage(self):
        stacks = flame_graph.by_stage(flame_graph.fold(self.SAMPLES.splitlines()), {"range maps": ["PlaneSweep::"]})
        self.assertEqual(stacks, {("range maps", "vcharge::PlaneSweep::sweep"): 1, ("other", "poll"): 1,
                                  ("range maps", "vcharge::PlaneSweep::sweep", "[libopencv_core.so]"): 1})
        shares = flame_graph.shares(stacks)
        self.assertEqual(list(shares), ["range maps", "other"])
        self.assertAlmostEqual(shares["range maps"], 2 / 3)

    def test_the_graph_names_functions_and_their_parts(self):
        graph = flame_graph.draw({("<a>", "b"): 3, ("c",): 1}, "title")
        self.assertIn("<title>&lt;a&gt;: 75.0 %</title>", graph)
        xml.etree.ElementTree.fromstring(graph)


class BaysTest(unittest.TestCase):
    @staticmethod
    def row(shift_m, states, first=0.0):
        """Bays of 2.5 m by 5 m north of a lane along x."""
        found = []
        for number, state in enumerate(states):
            left = first + 2.5 * number
            corners = [[left, 3.0], [left + 2.5, 3.0], [left + 2.5, 8.0], [left, 8.0]]
            found.append(bays.Bay(vcharge.ParkingBay(number, 0, "perpendicular", state, np.array(corners) + [shift_m, 0.0], 0.05, 0.05,
                                                     1.0)))
        return found

    def figures_of(self, found, true, drive_y=0.0):
        positions = np.column_stack([np.arange(0.0, 10.0, 0.1), np.full(100, drive_y)])
        return {one.name: one.value for one in bays.figures(found, true, positions)}

    def test_bays_are_compared_corner_by_corner(self):
        figures = self.figures_of(self.row(0.1, ["free", "occupied", "unknown"]), self.row(0.0, ["free"] * 4))
        self.assertEqual(figures["bays that the drive passes"], 4)
        self.assertEqual(figures["of them found"], 75)
        self.assertEqual(figures["bays found that there are"], 100)
        self.assertAlmostEqual(figures["corners, 95 %"], 10)
        self.assertAlmostEqual(figures["corners, normalized error squared"], 2)  # 4 across, 0 along
        self.assertEqual(figures["free or occupied right, of those known"], 50)
        self.assertAlmostEqual(figures["free or occupied not known"], 100 / 3)

    def test_other_markings_and_bays_seen_from_behind_do_not_count_as_found(self):
        figures = self.figures_of(self.row(1.4, ["free"] * 2), self.row(0.0, ["free"]))
        self.assertEqual((figures["of them found"], figures["bays found that there are"]), (0, 0))
        self.assertEqual(self.figures_of([], self.row(0.0, ["free"]), drive_y=11.0)["bays that the drive passes"], 0)
        self.assertIsNone(self.figures_of([], [])["corners, median"])


class ArgumentsTest(FolderTest):
    def test_every_stage_has_help(self):
        for stage in ("masks", "calibration", "mapping", "localization", "living_map", "ranges", "height_map", "bays", "surround_view",
                      "obstacles", "objects", "conditions", "faults", "chain", "online", "soak"):
            output, arguments = io.StringIO(), sys.argv
            self.addCleanup(setattr, sys, "argv", arguments)
            sys.argv = ["evaluate.sh", stage, "--help"]
            with contextlib.redirect_stdout(output), self.assertRaises(SystemExit) as end:
                evaluation_main.main()
            self.assertEqual(end.exception.code, 0)
            self.assertIn(f"evaluate.sh {stage}", output.getvalue())

    def test_an_unknown_stage_is_refused(self):
        status, _, errors = run_module("__main__", "no_such_stage")
        self.assertEqual(status, 2)
        self.assertIn("calibration", errors)

    def test_the_chain_refuses_recordings_that_do_not_go_together(self):
        work = self.folder / "work"
        for words, arguments in ((["--bag", "--boards", "--rig"], ["--bag", __file__]), (["--bag"], ["--rig", __file__]),
                                 (["no_such.bag"], ["--bag", "no_such.bag", "--rig", __file__])):
            status, _, errors = run_module("chain.steps", "--work", work, *arguments)
            self.assertEqual(status, 2)
            self.assertFalse(work.exists())
            for word in words:
                self.assertIn(word, errors.splitlines()[-1])


class PoseGraphsTest(unittest.TestCase):
    def test_false_loops_follow_the_recipe(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            ring = graphs.made_graphs(folder, 1)["ring"]
            base = ring.read_text().splitlines()
            for local in (False, True):
                spoiled = folder / "spoiled.g2o"
                self.assertEqual(pose_graphs.spoil(ring, spoiled, 7, 5, local, 3), 35)
                lines = spoiled.read_text().splitlines()
                self.assertEqual(lines[:len(base)], base)
                edges = [line.split() for line in lines[len(base):]]
                self.assertEqual(len(edges), 35)
                for group in range(7):
                    of_group = edges[5 * group:5 * group + 5]
                    steps = {int(edge[2]) - int(edge[1]) for edge in of_group}
                    self.assertEqual(len(steps), 1)
                    self.assertTrue(2 <= steps.pop() <= (20 if local else 433))
                    self.assertEqual(len({tuple(edge[3:]) for edge in of_group}), 1)
                pose_graphs.spoil(ring, folder / "again.g2o", 7, 5, local, 3)
                self.assertEqual((folder / "again.g2o").read_text(), spoiled.read_text())


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "evaluation", "__main__")
