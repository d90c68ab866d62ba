#!/usr/bin/env python3
"""The judge of moving objects on a simulated drive: reports made from the truth are right, and spoiled ones are as wrong as they
were made."""
import argparse
import csv
import json
import math
import pathlib
import sys
import unittest

import cv2
import numpy as np
import rostest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from drive_fixture import CAMERAS, Drive, run, tool  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "vcharge_evaluation" / "python"))
from vcharge_evaluation import objects  # noqa: E402
from vcharge_evaluation.drawing import film  # noqa: E402
from vcharge_evaluation.drawing.moments import draw_objects  # noqa: E402
from vcharge_evaluation.drawing.objects import pixels_from_above  # noqa: E402
from vcharge_evaluation.drawing.obstacles import read_yaml, yaw_of  # noqa: E402
from vcharge_evaluation.poses import stamp_ns  # noqa: E402

SIGMA_M = 0.1
COVARIANCE = ("cov_x_x_m2", "cov_x_y_m2", "cov_x_vx_m2_per_s", "cov_x_vy_m2_per_s", "cov_y_y_m2", "cov_y_vx_m2_per_s",
              "cov_y_vy_m2_per_s", "cov_vx_vx_m2_per_s2", "cov_vx_vy_m2_per_s2", "cov_vy_vy_m2_per_s2")
COLUMNS = ("stamp_ns", "id", "class", "class_probability", "existence_probability", "x_m", "y_m", "yaw_rad", "vx_m_per_s",
           "vy_m_per_s", "is_standing", "height_m", *COVARIANCE, "footprint_m")
FRAME_COLUMNS = ("stamp_ns", "x_m", "y_m", "yaw_rad", "num_objects")
# The frame odom is the world's, turned and shifted.
YAW, SHIFT_M = 0.7, np.array([12.0, -5.0])
TURN = np.array([[math.cos(YAW), -math.sin(YAW)], [math.sin(YAW), math.cos(YAW)]])


def write_table(path, columns, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


class ObjectsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive(drive="standing", duration_s=4.0, image_scale=0.2, cameras=CAMERAS, extra=(
            "--truth-range", *(word for name, number in (("people", 8), ("children", 4), ("bicycles", 3), ("cars", 3))
                               for word in ("--set", f"movers.{name}={number}"))))
        cls.drive.true_rig = cls.drive.rig
        cls.poses = {}
        for line in (cls.drive.truth / "trajectory.tum").read_text().splitlines():
            if not line.startswith("#"):
                time, *pose = line.split()
                cls.poses[stamp_ns(time)] = [float(value) for value in pose]
        cls.images = read_yaml(cls.drive.truth / "movers.yaml")["images"]

    @classmethod
    def tearDownClass(cls):
        cls.drive.remove()

    def report(self, number, mover, stamp):
        """The row of a true mover."""
        velocity = TURN @ mover["velocity_m_per_s"][:2]
        centre = TURN @ mover["translation_m"][:2] + SHIFT_M
        corners = np.array(mover["footprint_m"]) @ TURN.T + SHIFT_M
        return {"stamp_ns": stamp, "id": number + 1, "class": mover["class"], "class_probability": 1, "existence_probability": 1,
                "x_m": centre[0], "y_m": centre[1], "yaw_rad": yaw_of(mover["rotation_xyzw"]) + YAW, "vx_m_per_s": velocity[0],
                "vy_m_per_s": velocity[1], "is_standing": int(mover["is_standing"]), "height_m": mover["height_m"],
                **{key: SIGMA_M ** 2 if key in ("cov_x_x_m2", "cov_y_y_m2") else 0 for key in COVARIANCE},
                "footprint_m": ";".join(f"{x} {y}" for x, y in corners)}

    def write(self, name, change=lambda index, rows: rows):
        """A folder with reports of all movers, each image's after change(index of the image, rows)."""
        folder = self.drive.folder / name
        folder.mkdir()
        rows, frames = [], []
        for index, image in enumerate(self.images):
            stamp = image["stamp_ns"]
            here = change(index, [self.report(number, mover, stamp) for number, mover in enumerate(image["movers"])])
            x, y = TURN @ self.poses[stamp][:2] + SHIFT_M
            frames.append({"stamp_ns": stamp, "x_m": x, "y_m": y, "yaw_rad": yaw_of(self.poses[stamp][3:]) + YAW,
                           "num_objects": len(here)})
            rows += here
        write_table(folder / "objects.csv", COLUMNS, rows)
        write_table(folder / "objects_frames.csv", FRAME_COLUMNS, frames)
        return folder

    def judge(self, name, *change):
        return objects.judge_objects(self.drive, self.write(name, *change))

    def test_reports_equal_to_the_truth_have_no_errors(self):
        errors = self.judge("right")
        self.assertGreater(errors["all"]["due"], 20)
        for key in ("found", "good", "right_class"):
            self.assertEqual(errors["all"][key], errors["all"]["due"], key)
        for key in ("position_error_m", "centre_error_m", "velocity_error_m_per_s"):
            # yaw_of leaves out the little roll and pitch of the vehicle.
            self.assertLess(errors["all"][key]["max"], 1e-4, key)
        self.assertTrue(errors["crossings"])
        self.assertTrue(all(one["kept"] for one in errors["crossings"]))
        self.assertEqual(errors["false_objects"], [])
        self.assertEqual({one["delay_s"] for one in errors["first_reports"]}, {0.0})
        self.assertEqual(sum(one["due"] for one in errors["by_class"]), errors["all"]["due"])
        self.assertEqual(sum(one["due"] for one in errors["by_distance"]), errors["all"]["due"])
        figures = list(objects.drive_figures(errors))
        self.assertEqual([one.reached for one in figures if one.goal], [True] * 4)
        self.assertEqual(json.loads(json.dumps(errors)), errors)

    def test_a_drive_without_reports_misses_every_bar_but_that_of_false_objects(self):
        errors = self.judge("nothing", lambda index, rows: [])
        self.assertEqual(errors["all"]["found"], 0)
        self.assertEqual(errors["all"]["position_error_m"]["mean"], 1.0)
        reached = {one.name: one.reached for one in objects.drive_figures(errors) if one.goal}
        self.assertEqual(sorted(reached.values()), [False, False, False, True], reached)
        bars = {one.name for one in objects.failed_figures() if one.goal}
        self.assertLess(bars, set(reached), "a failed run has the same rows")

    def test_known_errors_ids_and_false_objects_are_found(self):
        def spoil(index, rows):
            for row in rows:
                row["vx_m_per_s"] += 0.5
                row["id"] += 100 * (index // 4)
            ghost = {**rows[0], "id": 9999, "is_standing": 0, "vx_m_per_s": 1.0}
            x, y = TURN @ self.poses[rows[0]["stamp_ns"]][:2] + SHIFT_M  # where the vehicle itself is
            return [*rows, {**ghost, "x_m": x, "y_m": y, "footprint_m": f"{x} {y};{x + 0.1} {y};{x} {y + 0.1}"}]

        errors = self.judge("spoiled", spoil)
        self.assertAlmostEqual(errors["all"]["velocity_error_m_per_s"]["percentile_50"], 0.5, places=4)
        self.assertEqual(errors["all"]["good_position"], errors["all"]["due"])
        self.assertEqual(errors["all"]["good"], 0)
        self.assertFalse(any(one["kept"] for one in errors["crossings"]))
        self.assertEqual([one["id"] for one in errors["false_objects"]], [9999])

    def test_reports_of_another_drive_are_refused(self):
        folder = self.write("other")
        frames = folder / "objects_frames.csv"
        frames.write_text(frames.read_text().replace(f"\n{self.images[0]['stamp_ns']},", "\n17,", 1))
        table = folder / "objects.csv"
        table.write_text(table.read_text().replace(f"\n{self.images[0]['stamp_ns']},", "\n17,"))
        status, _, lines = run([tool("vcharge_evaluation", "evaluate_objects"), "--objects", folder, "--truth", self.drive.truth])
        self.assertNotEqual(status, 0)
        self.assertIn("objects_frames.csv: stamp_ns", lines[-1])

    def test_the_picture_shows_true_and_reported_objects(self):
        stamp = self.images[len(self.images) // 2]["stamp_ns"]
        picture = draw_objects(self.drive, self.write("drawn"), stamp)
        self.assertGreater(np.count_nonzero((picture == (0, 255, 255)).all(2)), 20, "reported objects are yellow")
        empty = draw_objects(self.drive, self.write("empty", lambda index, rows: []), stamp)
        self.assertEqual(np.count_nonzero((empty == (0, 255, 255)).all(2)), 0)
        self.assertGreater(np.count_nonzero((empty == (255, 0, 255)).all(2)), 20, "true objects are magenta")

    def film(self, folder, bag=None):
        output = folder / "film"
        film.write_film(argparse.Namespace(bag=bag or self.drive.bag, rig=self.drive.true_rig, obstacles=folder, truth=self.drive.truth,
                                           rate_hz=12.5, output=output))
        return output

    def test_the_film_has_a_picture_of_each_stamp(self):
        folder = self.write("filmed")
        stamps = [image["stamp_ns"] for image in self.images]
        write_table(folder / "corridor.csv", ("stamp_ns", "direction", "known_free_m", "crossing_id", "crossing_time_s"),
                    [{"stamp_ns": stamps[0], "direction": "forward", "known_free_m": 1.5, "crossing_id": 4, "crossing_time_s": 2.0}])
        self.assertEqual(film.read_corridor(folder), {stamps[0]: "forward free 1.5 m, 4 crosses in 2.0 s"})
        output = self.film(folder)
        pictures = cv2.VideoCapture(str(output / "film.webm"))
        count = 0
        while pictures.read()[0]:
            count += 1
        self.assertEqual(count, len(stamps))
        self.assertIn("film.webm", (output / "index.html").read_text())
        # Objects of another drive: an error, and the film that is there stays.
        before = (output / "film.webm").read_bytes()
        write_table(folder / "objects_frames.csv", FRAME_COLUMNS, [])
        write_table(folder / "objects.csv", COLUMNS, [])
        with self.assertRaises(SystemExit) as failure:
            self.film(folder)
        self.assertIn("objects_frames.csv", str(failure.exception))
        self.assertEqual((output / "film.webm").read_bytes(), before)

    def test_the_map_of_the_film_is_turned_with_the_vehicle(self):
        folder = self.drive.folder / "map"
        folder.mkdir()
        gray = np.full((200, 200), 205, np.uint8)
        gray[200 - 1 - 150, 100] = 0  # x 0 m, y 5 m
        cv2.imwrite(str(folder / "5.pgm"), gray)
        (folder / "5.yaml").write_text("image: 5.pgm\nresolution: 0.1\norigin: [-10.05, -10.05, 0.0]\n")
        picture = film.Maps(folder).draw(5, [0.0, 0.0, math.pi / 2])
        rows, columns = np.nonzero((picture == film.COLOURS[film.OCCUPIED]).all(2))
        expected = pixels_from_above([[5.0, 0.0]])[0]
        self.assertLess(math.hypot(columns.mean() - expected[0], rows.mean() - expected[1]), 2.0)
        self.assertIsNone(film.Maps(folder).draw(4, [0.0, 0.0, 0.0]))

    def test_settings_name_movers_and_the_condition(self):
        self.assertEqual(objects.settings("movers_lot", "noon"), [])
        self.assertEqual(objects.settings("movers_lot", "wet"), ["--set", "condition.kind=wet"])
        self.assertIn("movers.people=6", objects.settings("bay_backwards_lot", "dusk"))


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "objects", "__main__")
