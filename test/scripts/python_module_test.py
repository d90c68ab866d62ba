#!/usr/bin/env python3
"""The module vcharge: cameras, rigs, sparse maps and trajectories; what is damaged is refused with the file and the key."""
import pathlib
import sqlite3
import sys

import cv2
import numpy as np
import rostest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from drive_fixture import run, tool  # noqa: E402
from python_module_fixture import ROOT, FolderTest, vcharge  # noqa: E402
from vcharge import transforms  # noqa: E402

NAN = float("nan")
# Points in the camera's frame and pixels, and for them what CameraModel::project and CameraModel::unproject give.
POINTS = [[0.1, -0.2, 1.0], [1.0, 0.7, 0.4], [-2.0, 1.0, 0.1], [3.0, 0.5, -0.2], [0.0, 0.0, 2.0], [0.2, -0.1, -1.0]]
PIXELS = [[640.5, 400.25], [100.0, 700.0], [1200.0, 30.0], [10.0, 400.0], [5000.0, 5000.0]]
LENSES = {
    "mei": (dict(xi=1.15, gamma1=895.5, gamma2=894.7, u0=649.6, v0=398.7, k1=-0.33, k2=0.0865, p1=-0.00067, p2=-0.00004),
            [[690.570154527, 316.825822554], [1067.18031129, 690.50221283], [106.323189008, 669.664059676],
             [1285.45362866, 504.07839094], [649.6, 398.7], [NAN, NAN]],
            [[-0.0218464237348, 0.00372457601919, 0.999754400492], [-0.876289732186, 0.481591356245, -0.013640779145],
             [0.825322817526, -0.552494472436, -0.11658518259], [-0.998769192254, 0.00280369522608, -0.0495200959021],
             [NAN, NAN, NAN]]),
    "kannala_brandt": (dict(fx=340.0, fy=341.0, cx=640.0, cy=400.0, k1=0.05, k2=-0.01, k3=0.002, k4=-0.0005),
                       [[673.529912502, 332.742940217], [1009.80357748, 659.623864544], [142.134741028, 649.664784279],
                        [1229.92161918, 498.609447128], [640, 400], [NAN, NAN]],
                       [[0.00147058737496, 0.000733137401007, 0.99999864994], [-0.86859179558, 0.48113589198, -0.118560305756],
                        [0.802464238923, -0.528644748934, -0.276741530446], [-0.988020490451, 0, -0.154322747674],
                        [NAN, NAN, NAN]]),
    "pinhole": (dict(fx=700.0, fy=710.0, cx=640.0, cy=400.0, k1=-0.3, k2=0.1, p1=0.001, p2=-0.002),
                [[708.8415, 260.2436], [12652.9898438, 8945.09128906], [-347915460, 176443565], [NAN, NAN], [640, 400], [NAN, NAN]],
                [[0.000714288429883, 0.000352112755277, 0.999999682904], [-0.652790426012, 0.357654128655, 0.667793518959],
                 [0.653418550481, -0.425260544825, 0.626256869745], [-0.753463445981, -0.00110264938326, 0.657488874229],
                 [0.64753722408, 0.671418604292, 0.360406161491]])}
RIG = """vehicle_frame: base_link
cameras:
  left:
    image_size_px: [640, 400]
    model: pinhole
    intrinsics: {fx: 300, fy: 301, cx: 320, cy: 200, k1: 1e-05, k2: 0, p1: 0, p2: 0}
    mask: left.png
    vehicle_from_camera:
      translation_m: [1.5, 0.25, 1e-3]
      rotation_xyzw: [0, 0, 0.6, 0.8]
"""


class CameraTest(FolderTest):
    def test_models_project_as_the_library_does(self):
        for name, (parameters, pixels, rays) in LENSES.items():
            lens = vcharge.camera_models.MODELS[name](**parameters)
            np.testing.assert_allclose(lens.project(POINTS), pixels, rtol=1e-10, atol=1e-9, err_msg=name)
            np.testing.assert_allclose(lens.unproject(PIXELS), rays, atol=1e-11, err_msg=name)

    def test_rays_come_back_to_their_pixels(self):
        grid = np.stack(np.meshgrid(np.arange(0, 1280, 40.0), np.arange(0, 800, 40.0)), -1)
        for name, (parameters, _, _) in LENSES.items():
            lens = vcharge.camera_models.MODELS[name](**parameters)
            rays = lens.unproject(grid)
            self.assertEqual(rays.shape, (20, 32, 3))
            known = np.isfinite(rays).all(-1)
            self.assertGreater(known.mean(), 0.8, name)
            np.testing.assert_allclose(np.linalg.norm(rays[known], axis=1), 1.0, atol=1e-12)
            np.testing.assert_allclose(lens.project(7.0 * rays[known]), grid[known], atol=1e-8, err_msg=name)

    def test_points_without_an_image_are_not_numbers(self):
        for name, (parameters, _, _) in LENSES.items():
            lens = vcharge.camera_models.MODELS[name](**parameters)
            self.assertTrue(np.isnan(lens.project([[0, 0, 0], [NAN, 0, 1], [np.inf, 0, 1], [0, 0, -1]])).all(), name)
            self.assertTrue(np.isnan(lens.unproject([[NAN, 0], [np.inf, 3]])).all(), name)
            self.assertEqual(lens.project(np.zeros((0, 3))).shape, (0, 2))


class RigTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.mask = np.full((400, 640), 255, np.uint8)
        self.mask[300:] = 0
        cv2.imwrite(str(self.folder / "left.png"), self.mask)

    def test_reads_numbers_transforms_and_masks(self):
        rig = vcharge.read_rig(self.write("rig.yaml", RIG))
        camera = rig["left"]
        self.assertEqual((list(rig.cameras), camera.frame_id, camera.image_size_px, camera.intrinsics["k1"]),
                         (["left"], "camera_left_optical", (640, 400), 1e-5))
        np.testing.assert_array_equal(camera.mask, self.mask)
        np.testing.assert_allclose(camera.vehicle_from_camera @ [1, 0, 0, 1], [1.5 + 0.28, 0.25 + 0.96, 1e-3, 1])
        np.testing.assert_allclose(camera.camera_from_vehicle([[1.5, 0.25, 1e-3]]), [[0, 0, 0]], atol=1e-15)
        with self.assertRaisesRegex(KeyError, "the cameras of the rig are left"):
            rig["front"]  # pylint: disable=pointless-statement

    def test_reads_the_nominal_rig(self):
        self.assertEqual(len(vcharge.read_rig(ROOT / "config" / "rigs" / "golf_nominal.yaml")), 4)

    def test_refuses_bad_rigs_with_the_key(self):
        for old, new, words in (
                ("fx: 300", "fz: 300", ("cameras.left.intrinsics.fz", "unknown key")), ("fx: 300, ", "", "intrinsics.fx: missing"),
                ("fx: 300", "fx: .nan", "intrinsics.fx: expected a finite number"),
                ("fx: 300", "fx: -3", "intrinsics.fx: expected a positive"),
                ("model: pinhole", "model: orthographic", "cameras.left.model: expected mei, kannala_brandt or pinhole"),
                ("0.6, 0.8", "0.6, 0.9", "rotation_xyzw: expected a unit quaternion"),
                ("[640, 400]", "[640, 4.5]", "image_size_px"),
                ("[640, 400]", "[64, 40]", ("left.mask", "left.png", "64 x 40")),
                ("mask: left.png", "mask: right.png", "right.png"),
                ("cameras:\n  left:", "cameras:\n  left: {}\n  left:", "left is given twice"),
                ("left:", "le ft:", "cameras.le ft: expected"),
                ("vehicle_frame", "vehicle", "vehicle: unknown key"), ("cameras:", "cameras: [", "line 4: not valid YAML"),
                ("translation_m: [1.5", "translation_m: [nan", "translation_m: expected a list of 3")):
            self.assertIn(old, RIG)
            path = self.write("rig.yaml", RIG.replace(old, new, 1))
            self.refuses(words, vcharge.read_rig, path)
            self.refuses(str(path), vcharge.read_rig, path)
        self.refuses("expected a rig", vcharge.read_rig, self.write("rig.yaml", ""))
        self.refuses("none.yaml: no such file", vcharge.read_rig, self.folder / "none.yaml")
        self.refuses("expected a file, is a folder", vcharge.read_rig, self.folder)
        (self.folder / "rig.yaml").write_bytes(b"\xff\xfe\x00")
        self.refuses("not UTF-8", vcharge.read_rig, self.folder / "rig.yaml")

    def test_a_truncated_mask_is_refused(self):
        path = self.write("rig.yaml", RIG)
        whole = (self.folder / "left.png").read_bytes()
        for size in (0, 8, 40, len(whole) - 4):
            (self.folder / "left.png").write_bytes(whole[:size])
            self.refuses("left.png: expected an 8-bit gray image", vcharge.read_rig, path)


class MapTest(FolderTest):
    def analytic(self, name, *words):
        path = self.folder / name
        status, _, errors = run([tool("vcharge_mapping", "write_analytic_map"), "--output", path, *words])
        self.assertEqual((status, errors), (0, []))
        return path

    def test_reads_what_the_library_writes(self):
        found = vcharge.read_map(self.analytic("lot.vmap"))
        angle = 2 * np.pi * np.arange(24) / 24  # a circle of 20 m
        np.testing.assert_allclose(found.keyframes.positions_m[:, :2], 20 * np.stack([np.sin(angle), 1 - np.cos(angle)], 1),
                                   atol=1e-9)
        self.assertEqual(found.keyframes.stamps_ns[1] - found.keyframes.stamps_ns[0], 500_000_000)
        self.assertEqual((found.sessions[0].component, found.version, found.versions), (0, 1, [1]))
        self.assertEqual(found.provenance["bag"], "analytic.bag")
        self.assertEqual(found.components.tolist(), [0] * 24)
        self.assertEqual(found.landmarks.num_observations.sum(), len(found.observations))
        # The observations are exact.
        cameras, seen = list(found.rig), found.observations
        for k in range(0, len(seen), 7):
            map_from_camera = found.keyframes.map_from_vehicle[seen.keyframes[k]] @ cameras[seen.cameras[k]].vehicle_from_camera
            point = transforms.apply(transforms.inverse(map_from_camera), found.landmarks.positions_m[seen.landmarks[k]])
            np.testing.assert_allclose(cameras[seen.cameras[k]].project(point), seen.positions_px[k], atol=1e-3)

    def test_reads_the_trajectory_that_map_info_writes(self):
        path = self.analytic("lot.vmap")
        run([tool("vcharge_mapping", "map_info"), "--map", path, "--trajectory", self.folder / "lot.tum"])
        written, read = vcharge.read_trajectory(self.folder / "lot.tum"), vcharge.read_map(path).trajectory()
        np.testing.assert_array_equal(read.stamps_ns, written.stamps_ns)
        np.testing.assert_array_equal(read.times_s, np.loadtxt(self.folder / "lot.tum")[:, 0])
        np.testing.assert_allclose(read.rows[:, 1:], written.rows[:, 1:], atol=1e-9)

    def test_reads_versions_and_sessions(self):
        first, other, path = self.analytic("first.vmap", "--descriptor-bytes", 32), self.analytic(
            "other.vmap", "--keyframes", 12, "--descriptor-bytes", 32), self.folder / "merged.vmap"
        run([tool("vcharge_mapping", "merge_maps"), "--map", first, "--session", other, "--output", path])
        newest, oldest = vcharge.read_map(path), vcharge.read_map(path, 1)
        self.assertEqual((newest.versions, len(newest.sessions), len(oldest.sessions)), ([1, 2], 2, 1))
        self.assertEqual((len(newest.keyframes), len(oldest.keyframes)), (36, 24))
        self.assertEqual(len(newest.trajectory(1)), 12)
        self.assertEqual(len(oldest.landmarks), len(vcharge.read_map(first).landmarks))
        self.assertGreater(len(newest.landmarks), len(oldest.landmarks))
        self.refuses("no version 7, expected 1 to 2", vcharge.read_map, path, 7)

    def test_reads_the_oldest_format(self):
        found = vcharge.read_map(ROOT / "src/vcharge_core/src/sparse_map/testing_data/schema_2.vmap")
        self.assertEqual((len(found.sessions), len(found.keyframes), len(found.landmarks)), (1, 6, 20))

    def test_refuses_what_is_no_map(self):
        self.refuses("none.vmap: no such file", vcharge.read_map, self.folder / "none.vmap")
        self.refuses("is a folder", vcharge.read_map, self.folder)
        self.refuses("is empty", vcharge.read_map, self.write("bad.vmap", ""))
        self.refuses("is no SQLite file", vcharge.read_map, self.write("bad.vmap", "not a map" * 30))
        self.refuses("ends after 12 bytes", vcharge.read_map, self.write("bad.vmap", "SQLite forma"))
        path = self.folder / "other.db"
        with sqlite3.connect(path) as database:
            database.execute("CREATE TABLE meta (key TEXT)")
        self.refuses("another program", vcharge.read_map, path)

    def test_refuses_other_versions_and_truncated_files(self):
        whole, path = self.analytic("lot.vmap").read_bytes(), self.folder / "bad.vmap"
        for version, words in ((1, "build it again"), (9, "newer program")):
            path.write_bytes(whole[:60] + version.to_bytes(4, "big") + whole[64:])
            self.refuses((f"has version {version} of the file format, expected versions 2 to 3", words), vcharge.read_map, path)
        for size in (100, 5000, len(whole) - 1):
            path.write_bytes(whole[:size])
            self.refuses("the map is truncated", vcharge.read_map, path)

    def test_refuses_damage(self):
        whole = self.analytic("lot.vmap").read_bytes()
        for change, words in (
                ("DROP TABLE landmark", "no such table: landmark"),
                ("UPDATE keyframe SET qw = 2.0 WHERE id = 3", "unit quaternions"),
                ("UPDATE keyframe SET session = 4 WHERE id = 3", "no such session"),
                ("DELETE FROM keyframe WHERE id = 3", "no such keyframe"),
                ("DELETE FROM landmark WHERE id = 3", "no such landmark"),
                ("UPDATE image SET camera = 8 WHERE id = 0", "no such camera"),
                ("UPDATE image SET num_observations = 1 WHERE id = 0", "as many landmarks"),
                ("DELETE FROM version", "holds no version"),
                ("UPDATE landmark SET covariance_3x3_f64 = x'00'", "covariance"),
                ("DELETE FROM meta WHERE key = 'rig'", "rig is missing"),
                ("UPDATE meta SET value = 'cameras: {}' WHERE key = 'rig'", "cameras: expected"),
                ("UPDATE camera SET mask_png = x'0102'", "its mask differs"),
                ("INSERT INTO landmark SELECT 99999, 0, 0, 0, NULL, NULL, 0, 1", "without an observation")):
            path = self.folder / "damaged.vmap"
            path.write_bytes(whole)
            database = sqlite3.connect(path)
            database.execute(change)
            database.commit()
            database.close()
            self.refuses(("damaged.vmap", words), vcharge.read_map, path)

    def test_overwritten_bytes_raise_nothing_but_input_errors(self):
        whole = self.analytic("lot.vmap").read_bytes()
        path, generator = self.folder / "damaged.vmap", np.random.default_rng(3)
        refused = 0
        for offset in generator.integers(100, len(whole) - 4000, 30):
            path.write_bytes(whole[:offset] + bytes(generator.integers(0, 256, 4000, np.uint8)) + whole[offset + 4000:])
            try:
                vcharge.read_map(path)
            except vcharge.InputError:
                refused += 1
        self.assertGreater(refused, 10)


class TrajectoryTest(FolderTest):
    LINE = "1700000000.123456789 1 2 3 0 0 0.6 0.8\n"

    def test_stamps_are_exact(self):
        found = vcharge.read_trajectory(self.write("t.tum", "# a comment\n\n" + self.LINE + "1700000001.5 1 2 3 0 0 0 1 # end\n"))
        self.assertEqual(found.stamps_ns.tolist(), [1700000000123456789, 1700000001500000000])
        np.testing.assert_allclose(found.world_from_vehicle[0] @ [1, 0, 0, 1], [1.28, 2.96, 3, 1])
        np.testing.assert_array_equal(found.rows, np.loadtxt(self.folder / "t.tum"))

    def test_refuses_bad_lines(self):
        for text, words in (("", "got none"), ("1 2 3\n", "line 1: expected 'time_s"), (self.LINE + self.LINE, "line 2: time_s"),
                            (self.LINE.replace("0.8", "0.9"), "unit quaternion"), (self.LINE.replace(" 3 ", " nan "), "line 1"),
                            (self.LINE.replace("1700000000.", "1e9"), "time_s"), (self.LINE.replace("0.8", "0.8 4"), "line 1")):
            self.refuses(("t.tum", words), vcharge.read_trajectory, self.write("t.tum", text))


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "python_module", "__main__")
