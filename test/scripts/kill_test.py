#!/usr/bin/env python3
"""Tools killed (SIGKILL) at any moment leave either the older result or the complete new one.
$VCHARGE_KILLS: kills per tool (3)."""
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import unittest

import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import run, tool  # noqa: E402
from whole_chain import CAMERAS, WholeChain, digest  # noqa: E402

KILLS = int(os.environ.get("VCHARGE_KILLS", "3"))
# Outputs that appear as a whole. A range map is a set of files whose YAML is written last.
RESULTS = {
    "build_map": ("lot.vmap", "lot.tum"),
    "localize_drive": ("poses.tum", "poses.tum.csv"),
    "build_height_map": ("heights",),
    "simulate_drive": ("drive.bag", "drive_truth"),
}


class KillTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.chain = WholeChain(duration_s=2.4)
        cls.source = cls.chain.folder / "source"
        cls.source.mkdir()
        status, _, errors = run(cls.chain.words("build_map", cls.source, cls.source))
        if status != 0:
            raise RuntimeError(f"build_map failed: {errors}")

    @classmethod
    def tearDownClass(cls):
        cls.chain.remove()

    def variants(self, name):
        """Two commands with the same outputs and different results."""
        output = self.chain.folder / name
        output.mkdir()
        if name == "simulate_drive":
            words = [tool("vcharge_simulation", "simulate_drive"), "--duration-s", 0.8, "--cameras", "front",
                     "--image-scale", 0.25, "--output", output / "drive.bag"]
            return output, [*words, "--seed", 1], [*words, "--seed", 2]
        words = self.chain.words(name, output, self.source)
        other_bag = self.chain.folder / f"{name}_other.bag"
        if not other_bag.exists():
            status, _, errors = run([tool("vcharge_simulation", "simulate_drive"), "--drive", "figure_eight",
                                     "--duration-s", 2.4, "--cameras", *CAMERAS, "--image-step", 2, "--image-scale", 0.25,
                                     "--images-from", self.chain.drive.bag, "--sensor-seed", 9, "--output", other_bag])
            if status != 0:
                raise RuntimeError(f"simulate_drive failed: {errors}")
        other = [other_bag if word == self.chain.drive.bag else word for word in words]
        return output, words, other

    def results(self, name, output):
        return {part: digest(output / part) for part in RESULTS[name]}

    def check(self, name):
        output, first, second = self.variants(name)
        whole = []
        for words in (second, first):
            start = time.monotonic()
            status, _, errors = run(words)
            took_s = time.monotonic() - start
            self.assertEqual(status, 0, errors)
            whole.append(self.results(name, output))
        self.assertTrue(all(whole[0][part] != whole[1][part] for part in RESULTS[name]), "two runs with one result")
        moments = random.Random(name)
        for i in range(KILLS):
            # Mostly late, when results are written.
            after_s = took_s * (1.0 - 0.6 * moments.random() ** 2)
            process = subprocess.Popen([str(word) for word in (second, first)[i % 2]], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            try:
                process.wait(after_s)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
            now = self.results(name, output)
            for part, found in now.items():
                self.assertIn(found, (whole[0][part], whole[1][part]), f"{name}: {part} after a kill at {after_s:.2f} s")
        status, _, errors = run(second)
        self.assertEqual(status, 0, f"{name} after kills: {errors}")
        self.assertEqual(self.results(name, output), whole[0])
        shutil.rmtree(output)

    def test_build_map(self):
        self.check("build_map")

    def test_localize_drive(self):
        self.check("localize_drive")

    def test_build_height_map(self):
        self.check("build_height_map")

    def test_simulate_drive(self):
        self.check("simulate_drive")

    def test_range_maps_are_complete_where_their_yaml_is(self):
        output = self.chain.folder / "ranges"
        output.mkdir()
        words = [str(word) for word in self.chain.words("compute_range_maps", output, self.source)]
        start = time.monotonic()
        status, _, errors = run(words)
        took_s = time.monotonic() - start
        self.assertEqual(status, 0, errors)
        whole = {path.relative_to(output): digest(path) for path in output.rglob("*.*") if path.is_file()}
        moments = random.Random(5)
        for _ in range(KILLS):
            shutil.rmtree(output / "range")
            process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                process.wait(took_s * moments.uniform(0.3, 0.95))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
            for description in output.rglob("*.yaml"):
                for path in description.parent.glob(f"{description.stem}*"):
                    if ".tmp" not in path.name:
                        self.assertEqual(digest(path), whole.get(path.relative_to(output)), path)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "kill", KillTest)
