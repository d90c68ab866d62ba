#!/usr/bin/env python3
"""Height maps of a simulated drive: the tool's bad input, the nodelet equals the tool, and saved maps are published."""
import os
import shutil
import sys
import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
import vcharge
import yaml
from nav_msgs.msg import OccupancyGrid
from octomap_msgs.msg import Octomap
from std_srvs.srv import Trigger
from vcharge_msgs.msg import HeightMap
from visualization_msgs.msg import Marker

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, run_tool, tool  # noqa: E402
from nodelet_fixture import Diagnostics, drive_publishers, manager_services, reach, wait_for  # noqa: E402

CAMERA = "left"


class HeightMapTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(duration_s=2.4, cameras=(CAMERA,), extra=(), image_scale=0.4)
        cls.options = {"range_maps": {"working_camera": {"image_scale": 1.0}, "cameras": [CAMERA]},
                       "fusion": {"max_range_m": 4.0}}
        cls.options_path = cls.drive.write_text("height_map.yaml", yaml.safe_dump(cls.options))
        cls.saved = cls.drive.folder / "saved"
        status, found, errors = cls.build(cls.saved)
        if status != 0:
            raise RuntimeError(f"build_height_map failed: {errors}")
        cls.hash = found["content_hash"]
        cls.load, cls.unload, cls.list = manager_services()

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    @classmethod
    def build(cls, output, options=None, extra=()):
        return run_tool([tool("vcharge_dense", "build_height_map"), "--bag", cls.drive.bag, "--rig", cls.drive.rig,
                         "--options", options or cls.options_path, "--output", output, *extra])

    def expect_failure(self, words, **arguments):
        output = self.drive.folder / "failed"
        shutil.rmtree(self.drive.folder / "failed.range_maps", ignore_errors=True)
        status, _, errors = self.build(output, **arguments)
        self.assertNotEqual(status, 0)
        self.assertEqual(len(errors), 1, errors)
        for word in words:
            self.assertIn(word, errors[0])
        self.assertFalse(output.exists())

    def test_poses_that_do_not_cover_the_drive_are_refused(self):
        lines = (self.drive.truth / "trajectory.tum").read_text().splitlines()
        short = self.drive.write_text("short.tum", "\n".join(lines[:12]) + "\n")
        self.expect_failure(["short.tum", "poses cover", "expected at least 90.0 %"], extra=["--trajectory", short])

    def test_a_grid_too_large_for_memory_is_refused(self):
        options = dict(self.options, fusion={"cell_size_m": 0.0001})
        path = self.drive.write_text("large.yaml", yaml.safe_dump(options))
        self.expect_failure([str(self.drive.bag), "max_memory_gb", "GB"], options=path)
        self.assertFalse((self.drive.folder / "failed.range_maps").exists())

    def test_poses_too_far_apart_are_refused_before_any_range_map(self):
        lines = []
        for i, line in enumerate((self.drive.truth / "trajectory.tum").read_text().splitlines()):
            words = line.split()
            if i == 15:
                words[1] = "1e7"
            lines.append(" ".join(words))
        apart = self.drive.write_text("apart.tum", "\n".join(lines) + "\n")
        self.expect_failure(["apart.tum", "max_memory_gb"], extra=["--trajectory", apart])
        self.assertFalse((self.drive.folder / "failed.range_maps").exists())

    def test_options_that_do_not_exist_are_refused(self):
        path = self.drive.write_text("unknown.yaml", "fusion: {cell_m: 1}\n")
        self.expect_failure(["unknown.yaml", "fusion.cell_m"], options=path)

    def test_a_file_in_the_place_of_the_folder_is_refused(self):
        path = self.drive.write_text("taken", "mine")
        status, _, errors = self.build(path)
        self.assertNotEqual(status, 0)
        self.assertIn("taken: expected a folder, is a file", errors[-1])
        self.assertEqual(path.read_text(), "mine")

    def painted_map(self, name, gray=True, cell_m=0.05):
        """A height map of level ground with five painted bays in 20 m by 20 m; the middle one holds a car."""
        folder = self.drive.folder / name
        folder.mkdir()
        heights, levels = np.zeros((400, 400), np.float32), np.full((400, 400), 90, np.uint8)
        for number in range(6):
            levels[200:296, 100 + 50 * number:103 + 50 * number] = 180
        heights[210:290, 208:246] = 1.2
        cv2.imwrite(str(folder / "height_map.tiff"), heights)
        cv2.imwrite(str(folder / "gray.png"), levels)
        (folder / "height_map.yaml").write_text(
            "file: height_map.tiff\nframe: map\norigin_m: [-5, -10]\nsize_cells: [400, 400]\n"
            f"cell_size_m: {cell_m}\n" + ("gray_file: gray.png\n" if gray else ""))
        return folder

    def test_bays_are_found_in_a_height_map(self):
        words = [tool("vcharge_dense", "map_bays"), "--height-map", self.painted_map("painted"), "--output"]
        path = self.drive.folder / "bays.yaml"
        status, found, errors = run_tool([*words, path])
        self.assertEqual((status, errors), (0, []))
        self.assertEqual([found[key] for key in ("num_bays", "num_rows", "num_free", "num_occupied", "num_unknown")],
                         [5, 1, 4, 1, 0])
        content = yaml.safe_load(path.read_text())
        self.assertEqual((content["frame"], content["content_hash"]), ("map", found["content_hash"]))
        middle = content["bays"][2]
        self.assertEqual((middle["kind"], middle["state"]), ("perpendicular", "occupied"))
        self.assertAlmostEqual(np.mean(middle["corners_m"], 0)[0], 6.3, delta=0.1)
        again = self.drive.folder / "again.yaml"
        run_tool([*words, again])
        self.assertEqual(again.read_bytes(), path.read_bytes())

        lanelets, back = self.drive.folder / "bays.osm", self.drive.folder / "back.yaml"
        convert = [tool("vcharge_dense", "convert_bays"), "--datum", "48.4", "10.9"]
        for source, target in ((path, lanelets), (lanelets, back)):
            status, found, errors = run_tool([*convert, "--input", source, "--output", target])
            self.assertEqual((status, errors, found["num_bays"]), (0, [], 5))
        read = yaml.safe_load(back.read_text())
        for bay, other in zip(read["bays"], content["bays"]):
            np.testing.assert_allclose(bay.pop("corners_m"), other.pop("corners_m"), atol=1e-5)
            self.assertEqual(bay, other)
        status, _, errors = run_tool([*convert, "--input", path, "--output", self.drive.folder / "no.yaml"])
        self.assertEqual((status, len(errors)), (1, 1))
        self.assertIn("no.yaml: expected a name that ends in .osm", errors[0])

    def test_a_map_without_paint_has_no_bays(self):
        status, found, _ = run_tool([tool("vcharge_dense", "map_bays"), "--height-map", self.saved, "--output",
                                     self.drive.folder / "none.yaml"])
        self.assertEqual((status, found["num_bays"]), (0, 0))

    def test_maps_in_which_lines_cannot_be_seen_are_refused(self):
        for name, words, arguments in (("no_gray", "gray_file: expected", {"gray": False}),
                                       ("coarse", "cell_size_m: expected at most 0.1 m", {"cell_m": 0.2})):
            folder, output = self.painted_map(name, **arguments), self.drive.folder / f"{name}.yaml"
            status, _, errors = run_tool([tool("vcharge_dense", "map_bays"), "--height-map", folder, "--output", output])
            self.assertEqual((status, len(errors)), (1, 1))
            self.assertIn(str(folder), errors[0])
            self.assertIn(words, errors[0])
            self.assertFalse(output.exists())

    def test_nodelet_equals_the_tool(self):
        output = self.drive.folder / "online"
        rospy.set_param("/height_map/rig", str(self.drive.rig))
        rospy.set_param("/height_map/output", str(output))
        rospy.set_param("/height_map/options", self.options)
        rospy.set_param("/height_map/lossless_replay", True)
        diagnostics = Diagnostics()
        publishers = drive_publishers((CAMERA,))
        self.assertTrue(self.load("/height_map", "vcharge_dense/height_map_nodelet", [], [], [], "").success)
        try:
            finish = rospy.ServiceProxy("/height_map/finish", Trigger)
            early = finish()
            self.assertFalse(early.success)
            self.assertIn("no range map could be made", early.message)
            self.assertFalse(output.exists())
            reach(publishers, diagnostics.heard)
            messages = [(topic, message) for topic, message in self.drive.messages() if topic in publishers]
            for topic, message in messages:
                publishers[topic].publish(message)
                time.sleep(0.002)
            # finish() ends the drive, so everything must have arrived.
            for topic in publishers:
                count = sum(other == topic for other, _ in messages)
                wait_for(lambda t=topic, c=count: diagnostics.num_good(t) >= c, f"{count} messages on {topic}", 120.0)
            answer = finish()
            self.assertTrue(answer.success, answer.message)
            self.assertIn(self.hash, answer.message)
            self.assertTrue((output / "octomap.bt").exists())
            self.assertEqual((output / "height_map.tiff").read_bytes(), (self.saved / "height_map.tiff").read_bytes())
        finally:
            diagnostics.subscriber.unregister()
            self.assertTrue(self.unload("/height_map").success)

    def test_saved_map_is_published(self):
        received = {}
        topics = (("/dense/height_map", HeightMap), ("/dense/height_map/grid", OccupancyGrid),
                  ("/dense/height_map/mesh", Marker), ("/dense/octomap", Octomap), ("/dense/octomap/occupied", Marker))
        rospy.set_param("/publisher/height_map", str(self.saved))
        self.assertTrue(self.load("/publisher", "vcharge_dense/height_map_publisher_nodelet", [], [], [], "").success)
        subscribers = [rospy.Subscriber(topic, kind, lambda message, t=topic: received.__setitem__(t, message))
                       for topic, kind in topics]
        try:
            wait_for(lambda: len(received) == len(topics), "all topics of a height map")
            heights = np.array(received["/dense/height_map"].height_m)
            self.assertEqual(heights.size, vcharge.read_height_map(self.saved).height_m.size)
            states = vcharge.read_occupancy_grid(self.saved / "drivable.yaml").state
            np.testing.assert_array_equal(received["/dense/height_map/grid"].data, states.flatten())
            self.assertGreater(np.sum(states == 0), 1000)
            self.assertGreater(len(received["/dense/height_map/mesh"].points), 1000)
            self.assertEqual(received["/dense/octomap"].id, "OcTree")
            self.assertGreater(len(received["/dense/octomap/occupied"].points), 100)
        finally:
            for subscriber in subscribers:
                subscriber.unregister()
            self.assertTrue(self.unload("/publisher").success)

    def test_publisher_without_a_map_does_not_load_and_the_manager_lives_on(self):
        rospy.set_param("/nothing/height_map", str(self.drive.folder / "nowhere"))
        with self.assertRaises(rospy.ServiceException):
            self.load("/nothing", "vcharge_dense/height_map_publisher_nodelet", [], [], [], "")
        self.assertEqual(self.list().nodelets, [])


if __name__ == "__main__":
    rospy.init_node("height_map_test")
    rostest.rosrun("vcharge_tests", "height_map", HeightMapTest)
