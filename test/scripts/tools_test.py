#!/usr/bin/env python3
"""Bad arguments and bad files of every tool: one line that names the mistake; no file is written, changed or removed."""
import os
import pathlib
import shutil
import sqlite3
import sys
import tempfile
import unittest

import cv2
import numpy as np
import rostest
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import files_below, run, tool  # noqa: E402

SIZE = (80, 50)
NUM_IMAGES = 8
GARBAGE = bytes(range(1, 256)) * 8


def write_recording(folder):
    """Writes a small recording for import_vcharge_images: a textured wall passes by at 2.5 m/s."""
    folder.mkdir()
    (folder / "calib.txt").write_text("89 0 39.5 89 24.5 1.15 -0.33 0.086 -0.0006 -0.00003\n"
                                      "1 0 0 1.9\n0 0 1 1.4\n0 -1 0 0.067\n")
    names = [f"mono_left_{1000000 + 80000 * i}.png" for i in range(NUM_IMAGES)]
    (folder / "images.txt").write_text("\n".join(names) + "\n")
    (folder / "system_poses.txt").write_text(
        "".join(f"{800000 + 40000 * i} 0 0 0 {0.1 * i:.3f} 0 0\n" for i in range(40)))
    noise = np.random.default_rng(1).integers(0, 256, (SIZE[1], SIZE[0] + 4 * NUM_IMAGES)).astype(np.uint8)
    wall = cv2.GaussianBlur(noise, (5, 5), 1.0)
    for i, name in enumerate(names):
        cv2.imwrite(str(folder / name), wall[:, 4 * i:4 * i + SIZE[0]])


class ToolsTest(unittest.TestCase):
    """Reads good input from `good`, which no test changes; each test writes into a `work` folder of its own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        cls.good = cls.folder / "good"
        cls.good.mkdir()
        write_recording(cls.good / "recording")
        cls.tools = {
            "import": (tool("vcharge_recordings", "import_vcharge_images"), {
                "--folder": cls.good / "recording", "--output": cls.good / "drive.bag", "--rig": cls.good / "rig.yaml"}),
            "compute": (tool("vcharge_dense", "compute_range_maps"), {
                "--bag": cls.good / "drive.bag", "--rig": cls.good / "rig.yaml", "--output": cls.good / "maps"}),
            "evaluate_range": (tool("vcharge_evaluation", "evaluate_range"), {
                "--range": cls.good / "maps", "--truth": cls.good / "truth", "--bag": cls.good / "drive.bag",
                "--rig": cls.good / "rig.yaml"}),
            "evaluate_trajectory": (tool("vcharge_evaluation", "evaluate_trajectory"), {
                "--estimate": cls.good / "truth" / "trajectory.tum", "--truth": cls.good / "truth" / "trajectory.tum"}),
            "evaluate_map": (tool("vcharge_evaluation", "evaluate_map"), {
                "--map": cls.good / "map.vmap", "--truth": cls.good / "map.tum"}),
            "map_info": (tool("vcharge_mapping", "map_info"), {"--map": cls.good / "map.vmap"}),
            "simulate": (tool("vcharge_simulation", "simulate_drive"), {"--output": cls.good / "simulated.bag"}),
        }
        cls.succeed("import")
        cls.succeed("compute")
        stamps = sorted(int(path.stem) for path in (cls.good / "maps" / "left").glob("*.yaml"))
        truth = cls.good / "truth"
        (truth / "range" / "left").mkdir(parents=True)
        for stamp in stamps:
            cv2.imwrite(str(truth / "range" / "left" / f"{stamp}.tiff"), np.full(SIZE[::-1], 3.0, np.float32))
        (truth / "trajectory.tum").write_text("".join(
            f"{stamp // 10**9}.{stamp % 10**9:09d} {2.5e-9 * stamp:.6f} 0 0 0 0 0 1\n" for stamp in stamps))
        cls.succeed("evaluate_range")
        cls.succeed("evaluate_trajectory")
        run([tool("vcharge_mapping", "write_analytic_map"), "--output", cls.good / "map.vmap"])
        cls.succeed("map_info")
        run([tool("vcharge_mapping", "map_info"), "--map", cls.good / "map.vmap", "--trajectory", cls.good / "map.tum"])
        cls.succeed("evaluate_map")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.work = self.folder / self.id().split(".")[-1]
        self.work.mkdir()

    @classmethod
    def command(cls, name, changes):
        program, arguments = cls.tools[name]
        arguments = {**arguments, **changes}
        words = [program]
        for option, value in arguments.items():
            if value is not None:  # None leaves an option out
                words += [option, value]
        return words

    @classmethod
    def succeed(cls, name):
        status, output, errors = run(cls.command(name, {}))
        if status != 0 or errors:
            raise RuntimeError(f"{name} failed: {output} {errors}")

    def fail_with(self, name, words, **changes):
        """The tool fails with one line that holds `words`; --option_name is given as option_name=value."""
        changes = {"--" + key.replace("_", "-"): value for key, value in changes.items()}
        if name == "import":
            changes = {"--output": self.work / "new.bag", "--rig": self.work / "new.yaml", **changes}
        elif name == "compute":
            changes = {"--output": self.work / "new", **changes}
        elif name == "simulate":
            changes = {"--output": self.work / "new.bag", **changes}
        told = f"{name} {changes}"
        before = self.contents()
        status, _, errors = run(self.command(name, changes))
        self.assertGreater(status, 0, f"{told}: expected an exit status, not a signal")
        self.assertEqual(len(errors), 1, f"{told}: {errors}")
        for word in words:
            self.assertIn(str(word), errors[0], told)
        self.assertEqual(self.contents(), before, f"{told}: something was written, changed or removed")

    def contents(self):
        """Every file below the folder with its bytes, and every empty folder."""
        files = {name: (self.folder / name).read_bytes() for name in files_below(self.folder)}
        empty = sorted(root for root, folders, names in os.walk(self.folder) if not folders and not names)
        return files, empty

    def garbage(self, name):
        path = self.work / name
        path.write_bytes(GARBAGE)
        return path

    def text(self, name, text):
        path = self.work / name
        path.write_text(text)
        return path

    def copy(self, folder):
        shutil.copytree(self.good / folder, self.work / folder, dirs_exist_ok=True)
        return self.work / folder

    def changed_rig(self, name, change):
        """good/rig.yaml with one entry of its camera changed."""
        rig = yaml.safe_load((self.good / "rig.yaml").read_text())
        change(rig["cameras"]["left"])
        rig["cameras"]["left"]["mask"] = str(self.good / "left_mask.png")
        return self.text(name, yaml.safe_dump(rig))

    def test_help_is_no_error(self):
        for name, (program, _) in self.tools.items():
            status, output, errors = run([program, "--help"])
            self.assertEqual((status, errors), (0, []), name)
            expected = {"import": "--output", "compute": "--output", "simulate": "--output", "map_info": "--map"}
            self.assertIn(expected.get(name, "--truth"), output)

    def test_options_are_shown_without_any_other_argument(self):
        for package, program in (("vcharge_calibration", "calibrate_rig"), ("vcharge_calibration", "calibrate_rig_from_map"),
                                 ("vcharge_dense", "build_height_map"), ("vcharge_dense", "compute_range_maps"),
                                 ("vcharge_localization", "localize_drive"),
                                 ("vcharge_mapping", "build_map"), ("vcharge_obstacles", "detect_obstacles"),
                                 ("vcharge_simulation", "simulate_drive")):
            status, output, errors = run([tool(package, program), "--show-options"])
            self.assertEqual((status, errors), (0, []), program)
            self.assertGreater(len(yaml.safe_load(output)), 2, program)

    def test_objects_do_without_cameras_that_have_no_images_or_extrinsics(self):
        rig = yaml.safe_load((self.good / "rig.yaml").read_text())
        left = {key: value for key, value in rig["cameras"]["left"].items() if key != "mask"}
        rig["cameras"] = {"front": {key: value for key, value in left.items() if key != "vehicle_from_camera"}, "left": left,
                          "rear": left}
        (self.work / "rig.yaml").write_text(yaml.safe_dump(rig, sort_keys=False))
        (self.work / "options.yaml").write_text("cameras: [left]\n")
        words = [tool("vcharge_obstacles", "detect_obstacles"), "--bag", self.good / "drive.bag", "--rig",
                 self.work / "rig.yaml", "--output", self.work / "obstacles"]
        status, output, errors = run([*words, "--options", self.work / "options.yaml"])
        self.assertEqual((status, errors), (0, []))
        self.assertIn("warning: objects are detected without front (no vehicle_from_camera), rear (no images in the bag)",
                      str(output))
        for name in ("front", "rear"):
            status, _, errors = run([*words, "--cameras", "left", name])
            self.assertEqual(status, 1)
            self.assertIn(name, errors[0])

    def test_missing_required_options_are_named(self):
        for name in ("import", "compute", "evaluate_range", "evaluate_trajectory", "evaluate_map", "map_info"):
            for option in self.tools[name][1]:
                self.fail_with(name, [option, "required"], **{option[2:]: None})

    def test_unknown_options_and_words_for_numbers_are_named(self):
        for name in ("import", "compute", "evaluate_range", "evaluate_trajectory", "evaluate_map", "map_info"):
            self.fail_with(name, ["--no-such-option"], no_such_option="1")
        self.fail_with("import", ["--ground-height-m", "low"], ground_height_m="low")

    def test_missing_input_files_are_named(self):
        none = self.work / "none"
        self.fail_with("import", [none, "images.txt"], folder=none)
        self.fail_with("compute", [none], bag=none)
        self.fail_with("compute", [none], rig=none)
        self.fail_with("compute", [none], trajectory=none)
        self.fail_with("compute", [none], options=none)
        for option in ("range", "truth", "bag", "rig", "options"):
            self.fail_with("evaluate_range", [none], **{option: none})
        self.fail_with("evaluate_trajectory", [none], estimate=none)
        self.fail_with("evaluate_trajectory", [none], truth=none)
        self.fail_with("evaluate_map", [none], map=none)
        self.fail_with("evaluate_map", [none], truth=none)

    def test_corrupt_input_files_are_named(self):
        garbage = self.garbage("garbage")
        self.fail_with("compute", [garbage, "expected a ROS bag"], bag=garbage)
        self.fail_with("compute", [garbage, "expected"], rig=garbage)
        self.fail_with("compute", [garbage, "time_s tx ty tz"], trajectory=garbage)
        self.fail_with("compute", [garbage, "expected"], options=garbage)
        self.fail_with("evaluate_range", [garbage, "expected a ROS bag"], bag=garbage)
        self.fail_with("evaluate_range", [garbage, "expected"], rig=garbage)
        self.fail_with("evaluate_range", [garbage, "expected a folder"], range=garbage)
        self.fail_with("evaluate_trajectory", [garbage, "time_s tx ty tz"], estimate=garbage)
        self.fail_with("evaluate_trajectory", [garbage, "time_s tx ty tz"], truth=garbage)

    def test_bad_files_of_a_recording_are_named(self):
        recording = self.copy("recording")
        for name, content in (("mono_left_1160000.png", "no image"), ("calib.txt", "nan 0 1"),
                              ("system_poses.txt", "800000 nan 0 0 0 0 0"), ("images.txt", "")):
            good = (recording / name).read_bytes()
            (recording / name).write_text(content)
            self.fail_with("import", [recording / name, "expected"], folder=recording)
            (recording / name).write_bytes(good)

    def test_bad_range_maps_and_truth_are_named(self):
        maps, truth = self.copy("maps"), self.copy("truth")
        stamp = min(path.stem for path in (maps / "left").glob("*.yaml"))
        for folder, name, option in ((maps / "left", f"{stamp}_range.tiff", "range"),
                                     (maps / "left", f"{stamp}.yaml", "range"),
                                     (truth / "range" / "left", f"{stamp}.tiff", "truth"),
                                     (truth, "trajectory.tum", "truth")):
            good = (folder / name).read_bytes()
            for content in (b"garbage", good[:len(good) // 3], b""):
                (folder / name).write_bytes(content)
                self.fail_with("evaluate_range", [folder / name, "expected"],
                               **{option: maps if option == "range" else truth})
            (folder / name).write_bytes(good)
        shutil.rmtree(truth / "range")
        self.fail_with("evaluate_range", [truth / "range", "no truth"], truth=truth)

    def test_bad_maps_are_named(self):
        self.fail_with("map_info", ["none.vmap", "no such file"], map=self.work / "none.vmap")
        self.fail_with("map_info", [self.garbage("garbage.vmap"), "SQLite"], map=self.work / "garbage.vmap")
        self.fail_with("map_info", [self.work, "folder"], map=self.work)
        self.fail_with("evaluate_map", [self.work / "garbage.vmap", "SQLite"], map=self.work / "garbage.vmap")
        whole = (self.good / "map.vmap").read_bytes()
        for name, content, words in (
                ("empty.vmap", b"", ["is empty"]),
                ("cut.vmap", whole[:len(whole) // 2], ["truncated", len(whole)]),
                ("newer.vmap", whole[:60] + b"\0\0\0\x09" + whole[64:], ["version 9", "newer"])):
            (self.work / name).write_bytes(content)
            self.fail_with("map_info", [name, *words], map=self.work / name, trajectory=self.work / "new.tum")
        for name, sql, words in (("moved.vmap", "UPDATE landmark SET z_m = z_m + 1", ["damaged", "hash"]),
                                 ("index.vmap", "UPDATE loop_edge SET first = 24", ["loop_edge 0", "no such id: 24"])):
            shutil.copy(self.good / "map.vmap", self.work / name)
            connection = sqlite3.connect(str(self.work / name))
            with connection:
                connection.execute(sql)
            connection.close()
            self.fail_with("map_info", [name, *words], map=self.work / name)

    def test_numbers_out_of_range_are_named(self):
        for value in ("nan", "-1", "0", "inf"):
            self.fail_with("import", ["field_of_view_rad", value], field_of_view_rad=value)
        for key, value in (("duration_s", "nan"), ("duration_s", "-1"), ("image_scale", "2"), ("seed", "-1"),
                           ("exposure_gain", "0"), ("height_cell_m", "nan")):
            self.fail_with("simulate", [key, value], **{key: value})
        self.fail_with("import", ["ground_height_m", "nan"], ground_height_m="nan")
        self.fail_with("import", ["ground_slope_x", "-2"], ground_slope_x="-2")
        for key, value in (("plane_sweep.min_texture", ".nan"), ("frames.max_speed_m_per_s", "-1"),
                           ("plane_sweep.min_distance_m", "-0.3"), ("plane_sweep.max_distance_m", ".inf"),
                           ("working_camera.focal_scale", ".nan"), ("neighbours.num_neighbours", "-4"),
                           ("frames.max_odometry_gap_s", "0"), ("plane_sweep.num_planes", "many")):
            outer, _, inner = key.rpartition(".")
            line = f"{outer}: {{{inner}: {value}}}\n" if outer else f"{inner}: {value}\n"
            options = self.text("options.yaml", line)
            self.fail_with("compute", [options, key, value.lstrip(".")], options=options)
        for key, value in (("tolerance", ".nan"), ("max_truth_m", "-1"), ("pixel_step", "0")):
            options = self.text("options.yaml", f"{key}: {value}\n")
            self.fail_with("evaluate_range", [options, key, value.lstrip(".")], options=options)
        options = self.text("options.yaml", "opposite_rad: 4\n")
        self.fail_with("evaluate_map", [options, "opposite_rad", "4"], options=options)
        rig = self.changed_rig("nan.yaml", lambda camera: camera.update(field_of_view_rad=float("nan")))
        self.fail_with("compute", [rig, "cameras.left.field_of_view_rad", "finite"], rig=rig)
        rig = self.changed_rig("size.yaml", lambda camera: camera.update(image_size_px=[-80, 50]))
        self.fail_with("compute", [rig, "cameras.left.image_size_px", "-80"], rig=rig)

    def test_unknown_and_impossible_camera_names_are_named(self):
        self.fail_with("compute", ["roof", "left"], cameras="roof")
        rig = yaml.safe_load((self.good / "rig.yaml").read_text())
        other = self.text("other.yaml", yaml.safe_dump({"cameras": {"roof": {
            **rig["cameras"]["left"], "mask": str(self.good / "left_mask.png")}}}))
        self.fail_with("evaluate_range", ["left", "roof"], rig=other)
        for name in ("", "a b", "../left"):
            self.fail_with("import", ["camera_name", f"'{name}'"], camera=name)

    def test_range_maps_of_another_rig_are_refused(self):
        rig = self.changed_rig("other.yaml", lambda camera: camera["intrinsics"].update(u0=45.0))
        self.fail_with("evaluate_range", ["left", "another rig"], rig=rig)

    def test_trajectories_without_common_time_are_named(self):
        other = self.text("other.tum", "".join(f"{5000 + i} 0 0 0 0 0 0 1\n" for i in range(5)))
        self.fail_with("evaluate_trajectory", [other, "trajectory.tum", "0 of 5 poses"], estimate=other)
        self.fail_with("evaluate_map", ["map.vmap", other, "0 of"], truth=other)
        empty = self.text("empty.tum", "")
        self.fail_with("evaluate_trajectory", [empty, "got none"], truth=empty)

    def test_outputs_that_cannot_be_written_are_named(self):
        blocked = self.text("blocked", "a file, not a folder")
        self.fail_with("import", [blocked / "new.bag"], output=blocked / "new.bag")
        self.fail_with("import", [blocked / "new.yaml"], rig=blocked / "new.yaml")
        self.fail_with("compute", [blocked], output=blocked)
        self.fail_with("compute", [blocked / "new"], output=blocked / "new")
        self.fail_with("evaluate_range", [blocked / "new"], report=blocked / "new")
        self.fail_with("evaluate_trajectory", [blocked / "new"], report=blocked / "new")
        self.fail_with("evaluate_map", [blocked / "new"], report=blocked / "new")
        self.fail_with("map_info", [blocked / "new"], trajectory=blocked / "new")
        folder = self.work / "folder.bag"
        folder.mkdir()
        self.fail_with("import", [folder, "folder"], output=folder)
        for name, option in (("import", "output"), ("import", "rig"), ("compute", "output"),
                             ("evaluate_range", "report"), ("evaluate_trajectory", "report"),
                             ("map_info", "map"), ("map_info", "trajectory")):
            self.fail_with(name, [f"--{option}", "expected a path"], **{option: ""})

    def test_existing_outputs_outlive_a_failure(self):
        bag, rig, maps = self.work / "new.bag", self.work / "new.yaml", self.copy("maps")
        shutil.copy(self.good / "drive.bag", bag)
        shutil.copy(self.good / "rig.yaml", rig)
        recording = self.copy("recording")
        (recording / "mono_left_1160000.png").write_text("no image")
        self.fail_with("import", ["mono_left_1160000.png"], folder=recording)
        whole = (self.good / "drive.bag").read_bytes()
        (self.work / "cut.bag").write_bytes(whole[:len(whole) // 2])
        self.fail_with("compute", ["cut.bag"], bag=self.work / "cut.bag", output=maps)

    def test_the_simulator_names_unknown_scenes_drives_and_cameras(self):
        self.fail_with("simulate", ["drive", "moon", "figure_eight"], drive="moon")
        self.fail_with("simulate", ["scene", "mars", "lot"], scene="mars")
        self.fail_with("simulate", ["rig", "tractor", "random"], rig="tractor")

    def test_bad_scenario_files_are_named_with_their_key(self):
        for name, text, words in (
                ("key.yaml", "{drive: short, colour: red}", ["colour", "unknown key"]),
                ("inner.yaml", "faults: {wheel_slip: {wheels: left}}", ["faults.wheel_slip.wheels", "wheel"]),
                ("value.yaml", "image_scale: large", ["image_scale", "a number", "large"]),
                ("range.yaml", "faults: {wheel_slip: {ratio: -3}}", ["faults.wheel_slip.ratio", "-3"]),
                ("syntax.yaml", "drive: [short", ["YAML"])):
            self.fail_with("simulate", [name, *words], scenario=self.text(name, text))
        self.fail_with("simulate", ["missing.yaml"], scenario=self.work / "missing.yaml")

    def test_the_simulator_asks_for_its_output(self):
        # Its command line adds a hint to --help.
        status, _, errors = run(self.command("simulate", {"--output": None}))
        self.assertGreater(status, 0)
        self.assertIn("--output", errors[0])


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "tools", ToolsTest)
