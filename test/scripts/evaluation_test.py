#!/usr/bin/env python3
"""The evaluation module: figures and their page, arithmetic on poses, benchmark comparison, arguments of the chain."""
import contextlib
import io
import json
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np
import rostest
import yaml
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import Odometry

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "vcharge_evaluation" / "python"))
from vcharge_evaluation import __main__ as evaluation_main  # noqa: E402
from vcharge_evaluation import page, poses, results, spoiled_drives  # noqa: E402
from vcharge_evaluation.camera_models import project  # noqa: E402


def run_module(module, *words):
    """Exit status, standard output and standard error of python3 -m vcharge_evaluation.MODULE."""
    done = subprocess.run([sys.executable, "-m", f"vcharge_evaluation.{module}", *map(str, words)], capture_output=True,
                          text=True, check=False, cwd=ROOT / "src" / "vcharge_evaluation" / "python")
    return done.returncode, done.stdout, done.stderr


class FolderTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        self.addCleanup(shutil.rmtree, self.folder)


class ResultsTest(FolderTest):
    def test_goals_are_bounds_ranges_and_values(self):
        self.assertTrue(results.figure("error", 3.0, "cm", at_most=3).reached)
        self.assertFalse(results.figure("error", 3.1, "cm", at_most=3).reached)
        self.assertFalse(results.figure("square", 0.2, at_least=0.3, at_most=2.5).reached)
        self.assertEqual(results.figure("square", 0.2, at_least=0.3, at_most=2.5).goal, "<= 2.5 and >= 0.3")
        self.assertTrue(results.figure("wrong", 0, equal=0).reached)
        self.assertIsNone(results.figure("time", 2.0, "s").reached)

    def test_what_was_not_measured_misses_its_goal(self):
        for missing in (None, float("nan")):
            self.assertFalse(results.figure("error", missing, "cm", at_most=3).reached)
            self.assertIsNone(results.figure("error", missing, "cm", at_most=3).value)

    def test_table_tells_the_median_and_the_worst_condition_first(self):
        def measurement(condition, error_cm, ratio):
            return results.Measurement("t", condition, [results.figure("error", error_cm, "cm", at_most=2),
                                                        results.figure("found", ratio, at_least=0.5),
                                                        results.Figure("time", 1, "s")])

        lines = results.table([measurement("lot", 1.0, 0.9), measurement("garage", 3.0, 0.4),
                               measurement("ramp", None, 0.8)]).splitlines()
        self.assertEqual(lines[0], "|what|goal|median|worst|garage|ramp|lot|")
        self.assertEqual(lines[2], "|error|<= 2|**3 cm**|**-** (ramp)|**3 cm**|**-**|1 cm|")
        self.assertEqual(lines[3], "|found|>= 0.5|0.8|**0.4** (garage)|**0.4**|0.8|0.9|")
        self.assertEqual(lines[4], "|time||||1 s|1 s|1 s|")

    def test_table_has_a_column_per_condition(self):
        table = results.table([results.Measurement("t", "lot", [results.figure("error", 1.25, "cm", at_most=1)]),
                               results.Measurement("t", "garage", [results.figure("error", 0.5, "cm", at_most=1)])])
        self.assertEqual(table.splitlines(), ["|what|goal|lot|garage|", "|---|---|---|---|",
                                              "|error|<= 1|**1.25 cm**|0.5 cm|"])

    def test_files_give_back_what_was_written(self):
        measurements = [results.Measurement("t", "lot", [results.figure("error", 1.25, "cm", at_most=1)], "command",
                                            "2026-01-02", "abc")]
        results.write(self.folder / "new" / "stage.json", "Stage", measurements)
        self.assertEqual(results.read(self.folder / "new" / "stage.json"), ("Stage", measurements))
        self.assertEqual(sorted(path.name for path in (self.folder / "new").iterdir()), ["stage.json"])

    def test_new_measurements_replace_those_of_the_same_condition(self):
        old = [results.Measurement("t", "lot", []), results.Measurement("t", "garage", [])]
        new = [results.Measurement("t", "lot", [results.Figure("error", 1)]), results.Measurement("u", "lot", [])]
        self.assertEqual(results.merge(old, new), [new[0], old[1], new[1]])

    def test_results_are_published_on_request_only(self):
        args = types.SimpleNamespace(work=self.folder / "work", publish=False)
        published = results.RESULTS
        self.addCleanup(setattr, results, "RESULTS", published)
        results.RESULTS = self.folder / "doc"
        for args.publish in (False, True):
            with contextlib.redirect_stdout(io.StringIO()):
                results.Results("stage", "Stage", args).add("t", ("lot", [results.Figure("error", 1)]))
            self.assertEqual((self.folder / "doc" / "stage.json").exists(), args.publish)
        self.assertEqual(results.read(self.folder / "work" / "stage.json")[1][0].condition, "lot")


class PageTest(unittest.TestCase):
    def test_results_page_is_made_from_the_results(self):
        self.assertEqual(page.PAGE.read_text(encoding="utf-8"), page.make_page(),
                         "doc/results.md is stale or edited by hand: run scripts/in_build.sh python3 -m vcharge_evaluation.page")

    def test_figures_of_the_readme_are_results(self):
        rows = (ROOT / "README.md").read_text().split("A few [results]")[1].split("##")[0].splitlines()
        quoted = [row.split("|")[2] for row in rows if row.startswith("|")][2:]
        self.assertGreater(len(quoted), 3)
        text = page.PAGE.read_text(encoding="utf-8")
        for number in re.findall(r"\d+(?:\.\d+)?", " ".join(quoted)):
            self.assertRegex(text, rf"(?<![\d.]){re.escape(number)}(?![\d.]*\d)", f"README.md quotes {number}")

    def test_pages_are_short(self):
        for name, limit in (("README.md", 900), ("doc/architecture.md", 1500), ("doc/bring_up.md", 1150),
                            ("doc/faults.md", 1000), ("test/README.md", 200), ("launch/README.md", 200),
                            ("config/README.md", 200)):
            self.assertLessEqual(len((ROOT / name).read_text().split()), limit, name)

    def test_every_figure_has_command_date_and_commit(self):
        for path in results.RESULTS.glob("*.json"):
            for one in results.read(path)[1]:
                self.assertTrue(one.command and one.date and one.commit and one.figures, f"{path}: {one.title}")


class PosesTest(FolderTest):
    def test_rotations_turn_axes(self):
        half = np.sqrt(0.5)
        np.testing.assert_allclose(poses.rotations([[0, 0, half, half]])[0] @ [1, 0, 0], [0, 1, 0], atol=1e-12)

    def test_nearest_finds_both_neighbours_and_ends(self):
        np.testing.assert_array_equal(poses.nearest(np.array([0.0, 1.0, 2.0]), np.array([-1.0, 0.4, 0.6, 5.0])), [0, 0, 1, 2])

    def test_stamps_are_exact(self):
        self.assertEqual(poses.stamp_ns("1700000000.123456789"), 1700000000123456789)
        self.assertEqual(poses.stamp_ns("5.1"), 5100000000)

    def test_projection_of_the_axis_is_the_principal_point(self):
        camera = {"model": "mei", "intrinsics": {"xi": 1.1, "gamma1": 800, "gamma2": 810, "u0": 640, "v0": 400, "k1": -0.3,
                                                 "k2": 0.1, "p1": 0, "p2": 0}}
        np.testing.assert_allclose(project([[0, 0, 2.0]], camera), [[640, 400]])


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


class ArgumentsTest(FolderTest):
    def test_every_stage_has_help(self):
        for stage in ("masks", "calibration", "mapping", "localization", "ranges", "height_map", "obstacles", "faults", "chain",
                      "latency", "soak"):
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


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "evaluation", "__main__")
