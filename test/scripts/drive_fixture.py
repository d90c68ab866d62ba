"""The simulated drive of the integration tests, how they run tools, and how they change bags."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import rosbag
from roslib.packages import find_node

CAMERAS = ("front", "left")


def tool(package, name):
    return find_node(package, name)[0]


def run(command):
    """Runs a tool; returns exit status, standard output, and the lines of standard error without progress."""
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    errors = [line for line in result.stderr.splitlines() if line.strip() and not is_progress(line)]
    return result.returncode, result.stdout, errors


def run_tool(command):
    """Runs a tool with --json; returns exit status, what it found, and the lines of standard error without progress."""
    with tempfile.TemporaryDirectory(prefix="vcharge_tests_") as folder:
        report = pathlib.Path(folder) / "found.json"
        status, _, errors = run([*command, "--json", report])
        return status, json.loads(report.read_text()) if report.exists() else {}, errors


def is_progress(line):
    return line.rstrip().endswith(" s)") and "%" in line


def inputs_of(messages):
    """The (topic, message) pairs that a car publishes: odometry and images."""
    return [(topic, message) for topic, message in messages if topic == "/odom" or topic.endswith("/image_raw")]


class Drive:
    """A drive at half resolution with truth: two cameras on the first 1.6 s of the short drive by default."""

    def __init__(self, drive="short", duration_s=1.6, cameras=CAMERAS, extra=("--truth-range",), image_scale=0.5):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        self.bag = self.folder / "drive.bag"
        self.rig = self.folder / "rig_truth.yaml"
        self.truth = self.folder / "drive_truth"
        status, output, errors = run([
            tool("vcharge_simulation", "simulate_drive"), "--drive", drive, "--duration-s", duration_s,
            "--image-scale", image_scale, "--cameras", *cameras, *extra, "--output", self.bag])
        if status != 0:
            raise RuntimeError(f"simulate_drive failed: {output} {errors}")

    def remove(self):
        shutil.rmtree(self.folder)

    def messages(self):
        with rosbag.Bag(str(self.bag)) as bag:
            return [(topic, message) for topic, message, _ in bag.read_messages()]

    def rewrite(self, name, change):
        """Writes a bag of what change(topic, message) returns for each message: a list of (topic, message)."""
        path = self.folder / name
        with rosbag.Bag(str(path), "w") as bag:
            for topic, message in self.messages():
                for new_topic, new_message in change(topic, message):
                    bag.write(new_topic, new_message, new_message.header.stamp)
        return path

    def write_text(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def compute_range_maps(self, output, bag=None, rig=None, extra=()):
        return run_tool([tool("vcharge_dense", "compute_range_maps"), "--bag", bag or self.bag, "--rig", rig or self.rig,
                         "--output", output, "--no-pictures", *extra])


def files_below(folder):
    return sorted(os.path.relpath(os.path.join(root, name), folder)
                  for root, _, names in os.walk(folder) for name in names)
