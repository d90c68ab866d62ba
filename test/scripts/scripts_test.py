#!/usr/bin/env python3
"""What the scripts conclude and refuse: bench_compare, and the whole chain's arguments."""
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import unittest

import rostest

SCRIPTS = pathlib.Path(os.path.realpath(__file__)).parents[2] / "scripts"


def run(script, *words):
    result = subprocess.run([sys.executable, str(SCRIPTS / script), *map(str, words)], capture_output=True,
                            text=True, check=False)
    return result.returncode, result.stdout, result.stderr


class ScriptsTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.random = random.Random(4)

    def bench(self, name, factors, machine=1.0):
        cases = {f"case{i}": {"times_ns": [1e6 * machine * factor * self.random.uniform(1.0, 1.02) for _ in range(5)]}
                 for i, factor in enumerate(factors)}
        path = self.folder / name
        path.write_text(json.dumps({"benchmarks": {"some_benchmark": cases}}))
        return path

    def test_a_slower_machine_is_no_regression(self):
        status, output, _ = run("bench_compare.py", self.bench("a", [1, 2, 3, 4, 5]),
                                self.bench("b", [1, 2, 3, 4, 5], machine=1.7))
        self.assertEqual(status, 0, output)
        self.assertIn("took 1.7", output)

    def test_one_that_became_slower_is_named_and_no_other(self):
        status, output, _ = run("bench_compare.py", self.bench("a", [1, 2, 3, 4, 5]),
                                self.bench("b", [1, 2, 4.2, 4, 5], machine=0.6))
        self.assertEqual(status, 1, output)
        slower = [line for line in output.splitlines() if line.startswith("slower")]
        self.assertEqual(len(slower), 1, output)
        self.assertIn("some_benchmark: case2", slower[0])

    def test_one_that_became_faster_is_no_regression(self):
        status, output, _ = run("bench_compare.py", self.bench("a", [1, 2, 3, 4, 5]), self.bench("b", [1, 2, 1.5, 4, 5]))
        self.assertEqual(status, 0, output)
        self.assertIn("faster", output)

    def test_a_file_that_is_none_is_named(self):
        broken = self.folder / "broken.json"
        broken.write_text("{")
        status, _, errors = run("bench_compare.py", broken, self.bench("b", [1]))
        self.assertEqual(status, 1)
        self.assertIn("broken.json", errors)

    # --- the whole chain's arguments

    def expect_refused(self, words, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            work = pathlib.Path(folder) / "work"
            status, _, errors = run("chain.py", "--work", work, *arguments)
            self.assertEqual(status, 2)
            self.assertFalse(work.exists())
        for word in words:
            self.assertIn(word, errors.splitlines()[-1])

    def test_recordings_that_do_not_go_together(self):
        self.expect_refused(["--bag", "--boards", "--rig"], "--bag", __file__)
        self.expect_refused(["--bag"], "--rig", __file__)
        self.expect_refused(["no_such.bag"], "--bag", "no_such.bag", "--rig", __file__)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "scripts", ScriptsTest)
