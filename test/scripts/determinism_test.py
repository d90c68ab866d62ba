#!/usr/bin/env python3
"""The same bag gives the same content hash at every stage, on one core and on all of them."""
import os
import sys
import unittest

import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import run_tool  # noqa: E402
from whole_chain import WholeChain  # noqa: E402


class DeterminismTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.chain = WholeChain()

    @classmethod
    def tearDownClass(cls):
        cls.chain.remove()

    def test_every_stage_has_one_hash_on_any_number_of_cores(self):
        hashes = {}
        for cores, prefix in (("all", []), ("one", ["taskset", "-c", str(min(os.sched_getaffinity(0)))])):
            output = self.chain.folder / cores
            output.mkdir()
            for name in WholeChain.TOOLS:
                status, found, errors = run_tool([*prefix, *self.chain.words(name, output, output)])
                self.assertEqual((status, errors), (0, []), name)
                hashes.setdefault(name, []).append(found["content_hash"])
        for name, (with_all, with_one) in hashes.items():
            self.assertEqual(with_all, with_one, name)
        self.assertEqual(len(set(with_all for with_all, _ in hashes.values())), len(hashes), "different results have the same hash")

    def test_another_drive_has_other_hashes(self):
        """A constant hash would pass the test above."""
        output = self.chain.folder / "shorter"
        (output / "other").mkdir(parents=True)
        other = WholeChain(duration_s=3.2)
        try:
            for name in ("build_map", "compute_range_maps", "detect_obstacles"):
                _, whole, _ = run_tool(self.chain.words(name, output, output))
                _, part, _ = run_tool(other.words(name, output / "other", output / "other"))
                self.assertNotEqual(whole["content_hash"], part["content_hash"], name)
        finally:
            other.remove()


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "determinism", DeterminismTest)
