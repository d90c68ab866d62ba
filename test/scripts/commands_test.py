#!/usr/bin/env python3
"""Runs the commands of README.md and doc/bring_up.md as they are typed there, in an empty folder with relative paths. Short
simulated drives replace the recordings; launch files, which need the car, are only resolved with their arguments."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import rostest
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import run, tool  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Commands that need a running car.
LIVE = ("rostopic", "rosservice")
# Commands of the first steps, which the test suite itself was built with.
SET_UP = ("scripts/", "source build/")
SCALE = ("--image-scale", 0.25)
DRIVES = {
    "calibration.bag": ("--drive", "figure_eight", "--duration-s", 80, "--image-step", 3),
    "mapping.bag": ("--drive", "loop", "--duration-s", 8, "--image-step", 2),
    "other_day.bag": ("--drive", "other_day", "--duration-s", 3),
}
RESULTS = {"rig.yaml", "report/rig_report.html", "lot.vmap", "lot.tum", "report_map/map_report.html", "other_day.tum",
           "other_day.tum.csv", "obstacles/status.csv", "map/height_map.yaml", "map/octomap.bt"}


def commands(path):
    """The page's commands: lines in ```bash fences, and indented lines after an empty line."""
    found, fence, before = [], None, ""
    for line in path.read_text().splitlines():
        if line.startswith("```"):
            fence = line if fence is None else None
        elif fence == "```bash" or (fence is None and line.startswith("    ") and before[:4].strip() == ""):
            found.append(line.strip())
        before = line
    return [line for line in found if line]


class CommandsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        recordings = cls.folder / "recordings"
        recordings.mkdir()
        cls.work = cls.folder / "empty"
        cls.work.mkdir()
        for name, words in DRIVES.items():
            status, _, errors = run([tool("vcharge_simulation", "simulate_drive"), *words, *SCALE, "--output",
                                     recordings / name])
            if status != 0:
                raise RuntimeError(f"simulate_drive failed: {errors}")
            (cls.work / name).symlink_to(recordings / name)
        truth = recordings / "calibration_truth"
        rig = yaml.safe_load((truth / "rig.yaml").read_text())
        for camera in rig["cameras"].values():
            del camera["vehicle_from_camera"]
            if "mask" in camera:
                shutil.copy(truth / camera["mask"], cls.work)
                camera["mask"] = pathlib.Path(camera["mask"]).name
        (cls.work / "cameras.yaml").write_text(yaml.safe_dump(rig, sort_keys=False))
        shutil.copy(ROOT / "config" / "driver" / "example_car.yaml", cls.work / "my_car.yaml")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def run_command(self, command):
        done = subprocess.run(["bash", "-c", command], cwd=self.work, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
        return done.stdout

    def run_page(self, page):
        """Runs the page's commands; returns how many."""
        number = 0
        for command in commands(page):
            if command.startswith(SET_UP):
                script = re.split(r"\s", command)[0]
                self.assertTrue(script == "source" or os.access(ROOT / script, os.X_OK), command)
            elif command.startswith("roslaunch "):
                nodes = self.run_command(command.replace("roslaunch ", "roslaunch --nodes ", 1))
                self.assertTrue(nodes.strip(), f"{command}: launches nothing")
            elif command.startswith("rosrun "):
                if "VCHARGE_DATA" in os.environ or not ("VCHARGE_DATA" in command or "real.bag" in command):
                    self.run_command(command)
            else:
                self.assertTrue(command.startswith(LIVE), f"{page.name}: no rule for testing '{command}'")
            number += 1
        return number

    def test_the_commands_of_the_pages_work_as_typed(self):
        self.assertGreater(self.run_page(ROOT / "doc" / "bring_up.md"), 15)
        self.assertGreaterEqual(self.run_page(ROOT / "README.md"), 8)
        missing = sorted(name for name in RESULTS if not (self.work / name).exists())
        self.assertEqual(missing, [])


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "commands", CommandsTest)
