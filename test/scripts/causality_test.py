#!/usr/bin/env python3
"""What a live stage says of an instant does not change when everything received later is cut from the bag."""
import os
import re
import sys
import unittest

import rosbag
import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import run_tool  # noqa: E402
from whole_chain import WholeChain, without_times  # noqa: E402

LIVE = ("localize_drive", "compute_range_maps", "detect_obstacles")
# The last result before the cut may need the odometry of the next ticks, which are received this much later.
LATENCY_S = 0.1


def results_until(folder, end_ns):
    """The lines and files about instants up to `end_ns`: files by the stamp in their names, tables by their first column."""
    results = {}
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        stamp = re.match(r"(\d{19})", file.name)
        if stamp and int(stamp.group(1)) <= end_ns:
            results[str(file.relative_to(folder))] = file.read_bytes()
        elif file.suffix == ".csv" and not stamp:
            rows = without_times(file).decode().splitlines()[1:]
            results[file.name] = [row for row in rows if round(float(row.split(",")[0]) * 1e9) <= end_ns + 1000]
    return results


class CausalityTest(unittest.TestCase):
    def setUp(self):
        self.chain = WholeChain(image_step=1)

    def tearDown(self):
        self.chain.remove()

    def test_results_do_not_depend_on_later_messages(self):
        whole, cut = (self.chain.folder / name for name in ("whole", "cut"))
        whole.mkdir()
        cut.mkdir()
        self.maxDiff = None
        status, _, errors = run_tool(self.chain.words("build_map", whole, whole))
        self.assertEqual((status, errors), (0, []))
        for name in LIVE:
            status, _, errors = run_tool(self.chain.words(name, whole, whole, live=["--online"]))
            self.assertEqual((status, errors), (0, []), name)
        short = self.chain.folder / "cut" / self.chain.drive.bag.name
        with rosbag.Bag(str(self.chain.drive.bag)) as bag, rosbag.Bag(str(short), "w") as copy:
            begin = bag.get_start_time()
            end = rospy.Time.from_sec(begin + 0.7 * (bag.get_end_time() - begin))
            for topic, message, received in bag.read_messages(end_time=end + rospy.Duration.from_sec(LATENCY_S)):
                copy.write(topic, message, received)
        self.chain.drive.bag = short
        for name in LIVE:
            status, _, errors = run_tool(self.chain.words(name, cut, whole, live=["--online"]))
            self.assertEqual((status, errors), (0, []), name)
        expected, found = (results_until(folder, end.to_nsec()) for folder in (whole, cut))
        self.assertGreater(len(expected["poses.tum.csv"]), 20)
        self.assertGreater(sum("obstacles" in name for name in expected), 20)
        self.assertGreater(sum("range" in name for name in expected), 20)
        self.assertEqual(sorted(expected), sorted(found))
        self.assertEqual([name for name in expected if expected[name] != found[name]], [])


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "causality", CausalityTest)
