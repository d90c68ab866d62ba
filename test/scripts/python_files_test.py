#!/usr/bin/env python3
"""The module vcharge: range maps, height maps, bays, obstacle maps, objects and images; what is damaged is refused with the file
and the key."""
import pathlib
import sys

import cv2
import genpy
import numpy as np
import rosbag
import rostest
from sensor_msgs.msg import CompressedImage, Image

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from drive_fixture import CAMERAS, Drive, run, tool  # noqa: E402
from python_module_fixture import FolderTest, vcharge  # noqa: E402

STAMP = 1700000000123456789
RANGE_YAML = ("stamp_ns: 1700000000123456789\ncamera: left\nframe_id: camera_left_optical\ncontent_hash: 12\nmei:\n"
              "  xi: 1.5\n  gamma1: 40\n  gamma2: 41\n  u0: 15.5\n  v0: 9.5\n  k1: 0\n  k2: 0\n  p1: 0\n  p2: 0\n")
HEIGHT_YAML = ("file: height_map.tiff\nconfidence_file: height_map_confidence.tiff\ngray_file: height_map_gray.png\nframe: map\n"
               "origin_m: [-1, 2.5]\ncell_size_m: 0.5\nsize_cells: [6, 4]\ncontent_hash: 123\n")
GRID_YAML = (f"image: {STAMP}.pgm\nresolution: 0.1\norigin: [-2, 1, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
             f"stamp_ns: {STAMP}\nframe_id: odom\nfixed_from_vehicle_translation_m: [1, 2, 0]\n"
             "fixed_from_vehicle_rotation_xyzw: [0, 0, 0.6, 0.8]\n")
BAYS_YAML = ("frame: map\ncontent_hash: 1e5\nbays:\n  - {id: 3, row: 1, kind: angled, state: free, corners_m: [[0, 0], [2.5, 0], "
             "[2.5, -5], [0, -5]], entry_sigma_m: 0.02, end_sigma_m: 1e-05, confidence: 0.9}\n")
FRAMES = "stamp_ns,x_m,y_m,yaw_rad,num_objects\n100,1,2,0.5,1\n200,1.5,2,0.5,0\n"
OBJECTS = (vcharge.objects.OBJECTS_HEADER + "\n100,7,adult,0.9,0.8,3,4,0.1,1,-1,0,1.8,0.01,0.001,0.002,0.003,0.02,0.004,0.005,0.03,"
           "0.006,0.04,2.8 3.8;3.2 3.8;3 4.3\n")
SCANS = (vcharge.obstacle_map.SCAN_HEADER + "\nfused,0,0,20,-0.5,3,2.5,0.1,0.5,0.05\nfused,0,0,20,0.5,nan,4,nan,nan,nan\n"
         "left,1,0.5,20,0.5,-nan,4,nan,nan,nan\n")


def write_image(path, image):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)


class DamageTest(FolderTest):
    def refuses_cut_files(self, paths, read):
        """Each file, cut anywhere or missing, is refused by its name."""
        for path in paths:
            whole = path.read_bytes()
            for size in (0, 8, len(whole) // 3, len(whole) // 2, len(whole) - 5):
                path.write_bytes(whole[:size])
                self.refuses(path.name, read)
            path.unlink()
            self.refuses(path.name, read)
            path.write_bytes(whole)
        read()

    def refuses_changes(self, path, changes, read):
        """Each change of a text file, (old, new, words of the error)."""
        whole = path.read_text()
        for old, new, words in changes:
            self.assertIn(old, whole)
            path.write_text(whole.replace(old, new, 1))
            self.refuses((path.name, words), read)
        path.write_text(whole)


class RangeMapTest(DamageTest):
    def setUp(self):
        super().setUp()
        self.stem = self.folder / "left" / str(STAMP)
        columns, rows = np.meshgrid(np.arange(32), np.arange(20))
        self.ranges = (2 + 0.1 * columns + rows).astype(np.float32)
        self.ranges[3, 4] = np.nan
        for name, image in (("range", self.ranges), ("sigma", 0.01 * self.ranges), ("confidence", np.full_like(self.ranges, 0.5))):
            write_image(self.stem.parent / f"{STAMP}_{name}.tiff", image)
        write_image(self.stem.parent / f"{STAMP}_reference.png", np.full((20, 32), 90, np.uint8))
        self.yaml = self.write(f"left/{STAMP}.yaml", RANGE_YAML)

    def read(self):
        return vcharge.read_range_map(self.folder, "left", STAMP)

    def test_points_are_at_their_ranges_along_the_rays(self):
        self.assertEqual((vcharge.list_range_map_cameras(self.folder), vcharge.list_range_maps(self.folder, "left")),
                         (["left"], [STAMP]))
        found = self.read()
        np.testing.assert_array_equal(found.range_m, self.ranges)
        points = found.points_in_camera()
        self.assertTrue(np.isnan(points[3, 4]).all())
        np.testing.assert_allclose(np.linalg.norm(points, axis=-1), self.ranges, rtol=1e-12)
        np.testing.assert_allclose(found.camera.project(points[7, 9]), [9, 7], atol=1e-9)
        self.assertEqual(found.reference[0, 0], 90)

    def test_refuses_missing_and_damaged_files(self):
        self.refuses_cut_files([self.stem.parent / f"{STAMP}_{name}" for name in
                                ("range.tiff", "sigma.tiff", "confidence.tiff")], self.read)
        self.refuses_changes(self.yaml, [("  xi: 1.5\n", "", "mei.xi: missing"), ("gamma1: 40", "gamma1: -1", "gamma1"),
                                         ("frame_id: camera_left_optical\n", "", "frame_id: missing"),
                                         ("mei:", "mei: 3\nx:", "mei")],
                             self.read)
        write_image(self.stem.parent / f"{STAMP}_sigma.tiff", self.ranges[:5])
        self.refuses(("_sigma.tiff", "of 32 x 20"), self.read)
        write_image(self.stem.parent / f"{STAMP}_sigma.tiff", self.ranges.astype(float))
        self.refuses("32-bit floats", self.read)
        self.refuses("no such file", vcharge.read_range_map, self.folder, "left", 5)
        self.refuses("expected a folder of range maps", vcharge.list_range_maps, self.folder, "right")


class HeightMapTest(DamageTest):
    def setUp(self):
        super().setUp()
        columns, rows = np.meshgrid(np.arange(6), np.arange(4))
        self.heights = (0.1 * columns + 0.2 * rows).astype(np.float32)
        self.heights[3, 5] = np.nan
        write_image(self.folder / "height_map.tiff", self.heights)
        write_image(self.folder / "height_map_confidence.tiff", np.ones_like(self.heights))
        write_image(self.folder / "height_map_gray.png", np.full((4, 6), 70, np.uint8))
        self.yaml = self.write("height_map.yaml", HEIGHT_YAML)

    def read(self):
        return vcharge.read_height_map(self.folder)

    def test_heights_are_interpolated(self):
        found = self.read()
        np.testing.assert_allclose(found.centres_m()[2, 3], [-1 + 1.5, 2.5 + 1.0])
        np.testing.assert_allclose(found.height_at([[-0.9, 2.8], [0.6, 3.4]]), [0.02 + 0.12, 0.32 + 0.36], atol=1e-6)
        self.assertTrue(np.isnan(found.height_at([[-1.01, 2.5], [1.4, 3.9], [np.nan, 0]])).all())
        self.assertEqual((found.frame_id, found.gray[0, 0], found.solid), ("map", 70, None))

    def test_refuses_missing_and_damaged_files(self):
        names = ("height_map.tiff", "height_map_confidence.tiff", "height_map_gray.png")
        self.refuses_cut_files([self.folder / name for name in names], self.read)
        self.refuses_changes(self.yaml, [("cell_size_m: 0.5\n", "", "cell_size_m: missing"),
                                         ("0.5", "-0.5", "a positive number of metres"),
                                         ("size_cells: [6, 4]", "size_cells: [6]", "size_cells"),
                                         ("[-1, 2.5]", "[-1, .inf]", "origin_m"), ("frame: map\n", "", "frame: missing")],
                             self.read)
        self.yaml.write_text(HEIGHT_YAML.replace("[6, 4]", "[6, 5]"))
        self.refuses(("height_map.tiff", "of 6 x 5"), self.read)
        self.refuses("height_map.yaml: no such file", vcharge.read_height_map, self.folder / "none" / "height_map.yaml")


class BaysTest(DamageTest):
    def test_reads_and_refuses_bays(self):
        path = self.write("bays.yaml", BAYS_YAML)
        bay, = vcharge.read_bays(path).bays
        self.assertEqual((bay.id, bay.row, bay.kind, bay.state, bay.end_sigma_m, bay.confidence),
                         (3, 1, "angled", "free", 1e-5, 0.9))
        np.testing.assert_array_equal(bay.corners_m, [[0, 0], [2.5, 0], [2.5, -5], [0, -5]])
        self.refuses_changes(path, [("kind: angled, ", "", "bays[0].kind: missing"), ("free", "full", "free, occupied or unknown"),
                                    (", [0, -5]]", "]", "four corners"), ("0.9", "1.9", "from 0 to 1"),
                                    ("id: 3", "id: x", "bays[0].id"),
                                    ("[2.5, 0]", "[2.5]", "corners_m[1]"), ("bays:", "bay:", "bays: missing")],
                             lambda: vcharge.read_bays(path))
        self.assertEqual(vcharge.read_bays(self.write("none.yaml", "frame: map\nbays: []\n")).bays, [])


class ObstacleMapTest(DamageTest):
    def setUp(self):
        super().setUp()
        gray = np.full((5, 7), 205, np.uint8)
        gray[4, 1], gray[0, 6] = 0, 254  # the picture's last row has the smallest y
        write_image(self.folder / f"{STAMP}.pgm", gray)
        for number, name in enumerate(("x", "y", "point_sigma", "height", "height_sigma", "age")):
            write_image(self.folder / f"{STAMP}_{name}.tiff", np.full((5, 7), number, np.float32))
        self.yaml = self.write(f"{STAMP}.yaml", GRID_YAML)
        self.scans = self.write(f"{STAMP}_scans.csv", SCANS)

    def read(self):
        return vcharge.read_obstacle_map(self.folder, STAMP)

    def test_rows_go_along_y(self):
        found = self.read()
        self.assertEqual(vcharge.list_obstacle_maps(self.folder), [STAMP])
        self.assertEqual((found.state[0, 1], found.state[4, 6], found.state[2, 2]), (100, 0, -1))
        np.testing.assert_allclose(found.centres_m()[0, 1], [-1.85, 1.05])
        np.testing.assert_allclose(found.fixed_from_vehicle @ [1, 0, 0, 1], [1.28, 2.96, 0, 1])
        self.assertEqual((found.point_m[0, 0].tolist(), found.age_s[0, 0], found.stamp_ns, found.frame_id),
                         ([0, 1], 5, STAMP, "odom"))
        plain = vcharge.read_occupancy_grid(self.write("grid.yaml", GRID_YAML.split("stamp_ns")[0]))
        self.assertEqual((plain.stamp_ns, plain.state[0, 1]), (None, 100))

    def test_reads_scans_by_name(self):
        scans = vcharge.read_obstacle_scans(self.folder, STAMP)
        np.testing.assert_array_equal(scans["fused"].range_m, [3, np.nan])
        np.testing.assert_array_equal(scans["left"].origin_m, [1, 0.5])
        self.refuses_changes(self.scans, [("-0.5,3", "-0.5,x", ":2: range_m"), ("fused,0", "fused,0,0", ":2: expected 10 columns"),
                                          ("name,", "Name,", ":1: expected the header"), ("20,-0.5", "20,nan", "angle_rad")],
                             lambda: vcharge.read_obstacle_scans(self.folder, STAMP))
        self.scans.write_text(SCANS[:-5])
        self.refuses("the file is truncated", vcharge.read_obstacle_scans, self.folder, STAMP)

    def test_refuses_missing_and_damaged_files(self):
        self.refuses_cut_files([self.folder / f"{STAMP}_{name}.tiff" for name in ("x", "age")], self.read)
        self.refuses_changes(self.yaml, [("resolution: 0.1\n", "", "resolution: missing"),
                                         ("frame_id: odom\n", "", "frame_id: missing"),
                                         ("0.6, 0.8", "0.6, 0.9", "unit quaternion"),
                                         (f"stamp_ns: {STAMP}\n", "", "stamp_ns: missing")],
                             self.read)
        write_image(self.folder / f"{STAMP}.pgm", np.full((5, 7), 100, np.uint8))
        self.refuses("gray levels 0, 205 and 254, got 100", self.read)


class ObjectsTest(DamageTest):
    def test_reads_and_refuses_objects(self):
        frames_path, path = self.write("objects_frames.csv", FRAMES), self.write("objects.csv", OBJECTS)
        first, second = vcharge.read_objects(path)
        one, = first.objects
        self.assertEqual((first.stamp_ns, second.stamp_ns, second.objects, one.id, one.object_class, one.is_standing),
                         (100, 200, [], 7, "adult", False))
        np.testing.assert_allclose(first.odom_from_vehicle @ [1, 0, 0, 1], [1 + np.cos(0.5), 2 + np.sin(0.5), 0, 1])
        np.testing.assert_array_equal(one.covariance[0], [0.01, 0.001, 0.002, 0.003])
        np.testing.assert_array_equal(one.covariance, one.covariance.T)
        np.testing.assert_array_equal(one.footprint_m, [[2.8, 3.8], [3.2, 3.8], [3, 4.3]])
        self.assertEqual(len(vcharge.read_objects(self.folder)), 2)

        def read():
            return vcharge.read_objects(self.folder)
        self.refuses_changes(frames_path, [("200,", "100,", ":3: stamp_ns: expected increasing"),
                                           (",0.5,1", ",0.5,2", "num_objects"),
                                           ("yaw_rad", "yaw", ":1: expected the header"), ("200,1.5", "200,nan", ":3: x_m")], read)
        self.refuses_changes(path, [("100,7", "101,7", "a stamp of objects_frames.csv"), ("adult", "ghost", "unknown, adult"),
                                    (";3 4.3", "", "footprint_m"), ("0.9,0.8", "1.9,0.8", "class_probability"),
                                    (",0.01,", ",-0.01,", "cov_x_x"),
                                    ("100,7", "100,-7", ":2: id"), (OBJECTS.split("\n")[1], OBJECTS.split("\n")[1] * 2, "columns")],
                             read)
        path.write_text(OBJECTS + OBJECTS.split("\n")[1] + "\n")
        self.refuses("each id once", read)
        path.unlink()
        self.refuses("objects.csv: no such file", read)


class ImagesTest(FolderTest):
    def test_reads_gray_images_of_any_encoding(self):
        gray = np.arange(48, dtype=np.uint8).reshape(6, 8)
        with rosbag.Bag(str(self.folder / "drive.bag"), "w") as bag:
            for second, (encoding, data) in enumerate((("mono8", gray), ("bgr8", np.dstack([gray] * 3)), ("16UC1", gray)), 1):
                message = Image(height=6, width=8, encoding=encoding, step=data[0].size + 2)
                message.header.stamp = genpy.Time(second)
                message.data = np.pad(data.reshape(6, -1), ((0, 0), (0, 2))).tobytes()
                bag.write("/camera/left/image_raw", message, genpy.Time(second))
            packed = CompressedImage(format="png", data=cv2.imencode(".png", gray)[1].tobytes())
            packed.header.stamp = genpy.Time(4)
            bag.write("/camera/rear/image_raw/compressed", packed, genpy.Time(4))
        found = list(vcharge.read_images(self.folder / "drive.bag", ["left", "rear"], [10 ** 9, 2 * 10 ** 9, 4 * 10 ** 9]))
        self.assertEqual([(stamp, camera) for stamp, camera, _ in found],
                         [(10 ** 9, "left"), (2 * 10 ** 9, "left"), (4 * 10 ** 9, "rear")])
        for _, _, image in found:
            np.testing.assert_array_equal(image, gray)
        self.refuses(("drive.bag: /camera/left/image_raw", "16UC1"), list, vcharge.read_images(self.folder / "drive.bag", ["left"]))
        self.refuses("no such file", list, vcharge.read_images(self.folder / "none.bag", ["left"]))
        self.refuses("cannot be read as a bag", list, vcharge.read_images(self.write("bad.bag", "not a bag"), ["left"]))


class ToolsTest(FolderTest):
    """What the tools write of a short simulated drive is read."""

    def test_reads_what_the_tools_write(self):
        drive = Drive(image_scale=0.3, cameras=CAMERAS)
        self.addCleanup(drive.remove)
        rig, truth = vcharge.read_rig(drive.rig), vcharge.read_trajectory(drive.truth / "trajectory.tum")
        self.assertEqual(tuple(rig.cameras), CAMERAS)
        images = list(vcharge.read_images(drive.bag, CAMERAS))
        self.assertEqual({image.shape[::-1] for _, _, image in images}, {rig["left"].image_size_px})
        surface = vcharge.read_height_map(drive.truth)
        self.assertAlmostEqual(float(surface.height_at(truth.positions_m[0, :2])), truth.positions_m[0, 2], delta=0.05)
        self.assertGreater(len(vcharge.read_bays(drive.truth / "bays.yaml").bays), 10)

        ranges = self.folder / "ranges"
        self.assertEqual(drive.compute_range_maps(ranges)[0], 0)
        stamp = vcharge.list_range_maps(ranges, "left")[3]
        found = vcharge.read_range_map(ranges, "left", stamp)
        # Confident points lie on the true surface or on what stands on it, as far as both are known.
        vehicle = truth.world_from_vehicle[np.argmin(np.abs(truth.stamps_ns - stamp))]
        points = vcharge.transforms.apply(vehicle @ rig["left"].vehicle_from_camera,
                                          found.points_in_camera()[found.confidence > 0.5])
        below = points[np.isfinite(points).all(1)]
        heights = surface.height_at(below[:, :2])
        known = np.isfinite(heights) & (below[:, 2] < 0.1)
        self.assertGreater(known.sum(), 300)
        self.assertLess(np.median(np.abs(heights - below[:, 2])[known]), 0.05)

        obstacles = self.folder / "obstacles"
        status, _, errors = run([tool("vcharge_obstacles", "detect_obstacles"), "--bag", drive.bag, "--rig", drive.rig, "--output",
                                 obstacles])
        self.assertEqual((status, errors), (0, []))
        stamp = vcharge.list_obstacle_maps(obstacles)[-1]
        grid, scans = vcharge.read_obstacle_map(obstacles, stamp), vcharge.read_obstacle_scans(obstacles, stamp)
        self.assertEqual(grid.stamp_ns, stamp)
        self.assertEqual(set(scans), {"fused", *CAMERAS})
        np.testing.assert_array_equal(np.isfinite(grid.height_m), grid.state == 100)
        frames = vcharge.read_objects(obstacles)
        self.assertEqual(frames[-1].stamp_ns, max(frame.stamp_ns for frame in frames))

        heights = self.folder / "heights"
        status, _, errors = run([tool("vcharge_dense", "build_height_map"), "--bag", drive.bag, "--rig", drive.rig, "--trajectory",
                                 drive.truth / "trajectory.tum", "--output", heights])
        self.assertEqual((status, errors), (0, []))
        built = vcharge.read_height_map(heights)
        states = vcharge.read_occupancy_grid(heights / "drivable.yaml")
        self.assertEqual(states.state.shape, built.height_m.shape)
        np.testing.assert_allclose(states.centres_m()[0, 0], built.origin_m, atol=1e-9)


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "python_files", "__main__")
