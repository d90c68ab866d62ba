#!/usr/bin/env python3
"""Figures, their goals, and the page that is made from them."""
import contextlib
import io
import pathlib
import re
import shutil
import sys
import tempfile
import types
import unittest

import numpy as np
import rostest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "vcharge_evaluation" / "python"))
from vcharge_evaluation import __main__ as evaluation_main  # noqa: E402
from vcharge_evaluation import conditions, drives, everything, faults, page, results  # noqa: E402


class ResultsTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        self.addCleanup(shutil.rmtree, self.folder)

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

    def test_many_conditions_have_a_row_each_worst_first(self):
        lines = results.table([results.Measurement("t", f"drive {i}", [results.figure("error", float(i), "cm", at_most=6)])
                               for i in range(results.MAX_COLUMNS + 1)]).splitlines()
        self.assertEqual(lines[0], "|what|error|")
        self.assertEqual(lines[2:7], ["|goal|<= 6|", "|median|3 cm|", "|95 %|6 cm|", "|worst|6 cm (drive 6)|", "|drive 6|6 cm|"])
        self.assertEqual(lines[-1], "|drive 0|0 cm|")

    def test_spread_counts_misses_at_the_bound(self):
        figures = results.spread("error", [0.01, 0.02, None, float("inf"), float("nan")], 0.5, "cm", 100, at_most=1)
        self.assertEqual([one.value for one in figures], [50, 50, 50])
        self.assertFalse(figures[0].reached)
        median, upper, worst = results.spread("error", [i / 100 for i in range(101)], 5.0)
        self.assertAlmostEqual(median.value, 0.5)
        self.assertAlmostEqual(upper.value, 0.95)
        self.assertAlmostEqual(worst.value, 1.0)
        self.assertIsNone(results.spread("error", [], 1.0)[2].value)

    def test_the_picture_of_a_stage_is_that_of_its_worst_case(self):
        args = types.SimpleNamespace(work=self.folder, publish=True)
        published = results.PICTURES
        self.addCleanup(setattr, results, "PICTURES", published)
        results.PICTURES = self.folder / "doc" / "pictures"
        stage = results.Results("stage", "Stage", args)
        noise = np.random.default_rng(1).integers(0, 256, (800, 1400, 3), dtype=np.uint8)
        for badness in (2.0, 3.0, 1.0):
            stage.show(noise, f"badness {badness:g}", badness)
        for folder in (self.folder / "pictures", results.PICTURES):
            self.assertEqual(results.read_caption(folder / "stage.json")["caption"], "badness 3")
            self.assertLessEqual((folder / "stage.jpg").stat().st_size, 60_000)
        results.write(self.folder / "doc" / "stage.json", "Stage", [results.Measurement("t", "lot", [results.Figure("error", 1)])])
        self.assertIn("![worst case](doc/pictures/stage.jpg)", page.make_page(self.folder / "doc"))

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

    def test_measurements_of_other_commits_are_dropped_on_request(self):
        path = self.folder / "stage.json"
        results.write(path, "Stage", [results.Measurement("t", name, [], "command", "2026-01-02", name) for name in ("old", "new")])
        results.drop_others(path, "new")
        self.assertEqual([one.condition for one in results.read(path)[1]], ["new"])

    def test_the_command_of_a_figure_leaves_out_where_it_was_kept(self):
        self.assertEqual(results.words_that_matter(["--seed", "2", "--work", "/tmp/somewhere", "--publish", "--small"]),
                         ["--seed", "2", "--small"])
        self.assertEqual(results.words_that_matter(["--bag", "/tmp/somewhere/drives/a.bag", "--work", "/tmp/somewhere"]),
                         ["--bag", "WORK/drives/a.bag"])

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

    def test_no_two_figures_of_a_row_have_one_name(self):
        for path in results.RESULTS.glob("*.json"):
            for measurement in results.read(path)[1]:
                names = [figure.name for figure in measurement.figures]
                self.assertEqual(len(names), len(set(names)), f"{path.name}: {measurement.title}, {measurement.condition}")

    def test_one_table_holds_what_several_commands_measured(self):
        both = [results.Measurement("t", scene, [results.Figure("error", 1)], f"measure {scene}", "2026-01-02", "abc")
                for scene in ("lot", "garage")]
        self.assertEqual(page.show(both).splitlines()[-4:], ["|error|1|1|", "", "- `measure lot` (2026-01-02, abc)",
                                                             "- `measure garage` (2026-01-02, abc)"])
        both[1].figures[0].name = "time"
        self.assertIn("|garage: time|1||`measure garage` (2026-01-02, abc)|", page.show(both))

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


# Scenarios of other stages, and the short one of the tests.
OTHER_STAGES = ("condition_", "fault_", "mapping_", "other_day_", "opposite_direction_", "calibration_", "random_rig", "short_drive")


class CompletenessTest(unittest.TestCase):
    def test_every_fault_and_condition_scenario_has_a_row(self):
        stage = {one.condition for one in results.read(results.RESULTS / "faults.json")[1]}
        self.assertEqual({f"fault_{name}" for name in faults.all_faults()},
                         {path.stem for path in drives.SCENARIOS.glob("fault_*.yaml")})
        self.assertLessEqual(set(faults.all_faults()), stage)
        self.assertLessEqual({path.stem for path in drives.SCENARIOS.glob("condition_*.yaml")}, set(conditions.all_scenarios()))

    def test_every_driving_scenario_has_a_row_in_the_full_run(self):
        driving = {path.stem for path in drives.SCENARIOS.glob("*.yaml") if not path.stem.startswith(OTHER_STAGES)}
        self.assertEqual(driving, set(conditions.DRIVING))
        full, quick = (next(step.words(is_quick) for step in everything.steps() if step.stage == "conditions")
                       for is_quick in (False, True))
        self.assertNotIn("--scenarios", full)
        self.assertLessEqual(set(quick[quick.index("--scenarios") + 1:]), set(conditions.all_scenarios()))

    def test_every_scenario_of_the_conditions_exists(self):
        for name in conditions.DRIVING:
            self.assertTrue((drives.SCENARIOS / f"{name}.yaml").exists(), name)
            self.assertEqual(len(conditions.scene_and_drive(name)), 2)

    def test_the_quick_run_has_every_stage_that_it_can_measure(self):
        quick = {step.stage for step in everything.steps() if step.quick is not None}
        self.assertLessEqual({"masks", "ranges", "obstacles", "height_map", "localization", "objects", "conditions", "faults",
                              "chain"}, quick)
        self.assertLessEqual(quick, set(evaluation_main.STAGES))


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "results", "__main__")
