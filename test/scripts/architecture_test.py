#!/usr/bin/env python3
"""The structure of the source tree: floors, sizes of files and folders, words of the pages, options and their page."""
import pathlib
import re
import subprocess
import unittest

import rostest

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Packages by floor, from the bottom up (doc/architecture.md). Code may include packages of lower floors only, and of its
# own floor only where ALLOWED_BESIDE says so.
FLOORS = [
    {"vcharge_core"},
    {"vcharge_geometry", "vcharge_features", "vcharge_wheel_odometry", "vcharge_ros"},
    {"vcharge_reconstruction", "vcharge_recordings"},
    {"vcharge_calibration", "vcharge_mapping", "vcharge_localization", "vcharge_dense", "vcharge_obstacles",
     "vcharge_camera_driver"},
]
BESIDE = {"vcharge_simulation", "vcharge_evaluation"}  # no stage includes them
STAGES = FLOORS[-1]
KNOWS_ROS = {"vcharge_ros", "vcharge_recordings"}  # libraries of these may include ROS
ROS_HEADER = re.compile(r"#\s*include <((?:ros|rosbag|nodelet|pluginlib|tf2_ros|tf2|diagnostic_updater|std_srvs|"
                        r"octomap_msgs|\w+_msgs)/[^>]+)>")
OWN_HEADER = re.compile(r'#\s*include "((vcharge_\w+)/[^"]+)"')
NODE_SUBSCRIBES = re.compile(r"(?:\.|->)(?:template )?subscribe<")
RIDDLE = re.compile(r"^\s*//[/!]?<?\s*(Of|And|That|Which|Else|Whom)\b|\S.*\s///?<?\s+(of|which|whom)\b")

MAX_FILE_LINES = 400
MAX_FOLDER_SOURCES = 20
MAX_RECIPE_LINES = 250
MAX_NODELET_LINES = 120
RECIPES = ["sparse_mapper", "rig_calibrator", "map_rig_calibrator"]
MAX_OPTIONS = 400
MAX_WORDS_README = 900
MAX_WORDS_PACKAGE_README = 400
MAX_WORDS_ALL = 14000


def tracked(*patterns):
    """Files of the source tree, by git where it is a checkout."""
    listed = subprocess.run(["git", "-C", str(ROOT), "ls-files", "--", *patterns], capture_output=True, text=True,
                            check=False)
    if listed.returncode == 0:
        return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).exists()]
    return [path for pattern in patterns for path in ROOT.rglob(pattern) if "build" not in path.parts[:-1]]


def package_of(path):
    for part in path.relative_to(ROOT).parts:
        if part.startswith("vcharge_") or part in ("fuzz", "test"):
            return part
    return None


def is_top_floor(path):
    """Tools, nodelets, benchmarks and tests are what a user starts: they may use every floor."""
    return any(part in ("tools", "nodelets", "benchmark", "fuzz", "test") for part in path.parts) or \
        path.stem.endswith("_test")


def words(path):
    return len(path.read_text(encoding="utf-8").split())


def lines(path):
    return path.read_text(encoding="utf-8").count("\n")


def relative(path):
    return str(path.relative_to(ROOT))


class ArchitectureTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.sources = tracked("*.cpp", "*.h")
        assert len(cls.sources) > 300, f"no source tree at {ROOT}"

    def check(self, findings, rule):
        self.assertFalse(findings, rule + ":\n" + "\n".join(sorted(findings)))

    def test_no_stage_includes_another_stage(self):
        findings = []
        for path in self.sources:
            package = package_of(path)
            if package not in STAGES or "tools" in path.parts:
                continue
            for header, other in OWN_HEADER.findall(path.read_text(encoding="utf-8")):
                if other in STAGES - {package} or other in BESIDE:
                    findings.append(f"{relative(path)}: {header}")
        self.check(findings, "a stage includes another stage, or what judges it")

    def test_includes_go_down(self):
        floor_of = {package: i for i, floor in enumerate(FLOORS) for package in floor}
        findings = []
        for path in self.sources:
            package = package_of(path)
            if package not in floor_of or is_top_floor(path):
                continue
            for header, other in OWN_HEADER.findall(path.read_text(encoding="utf-8")):
                if other != package and floor_of.get(other, len(FLOORS)) >= floor_of[package]:
                    findings.append(f"{relative(path)}: {header}")
        self.check(findings, "includes of a floor that is not below")

    def test_libraries_know_no_ros(self):
        findings = []
        for path in self.sources:
            if package_of(path) in KNOWS_ROS or is_top_floor(path):
                continue
            for header in ROS_HEADER.findall(path.read_text(encoding="utf-8")):
                findings.append(f"{relative(path)}: {header}")
        self.check(findings, "ROS in a library")

    def test_packages_of_libraries_without_ros_name_no_ros_package(self):
        findings = []
        for package in ("core", "geometry", "features", "wheel_odometry", "reconstruction"):
            path = ROOT / "src" / f"vcharge_{package}" / "package.xml"
            for name in re.findall(r"<\w*depend>([^<]+)</", path.read_text(encoding="utf-8")):
                if re.fullmatch(r"roscpp|rosbag|nodelet|vcharge_ros|.*_msgs|tf2.*", name):
                    findings.append(f"{relative(path)}: {name}")
        self.check(findings, "ROS packages")

    def test_subscriptions_ask_for_prompt_messages(self):
        """The first subscription of a process to a topic decides for all of them whether messages are held back."""
        findings = [relative(path) for path in tracked("*.h", "*.cpp")
                    if path.name != "nodelet_support.h" and NODE_SUBSCRIBES.search(path.read_text(encoding="utf-8"))]
        self.check(findings, "subscriptions that are not made by subscribePromptly()")

    def test_files_and_folders_have_one_job(self):
        findings = [f"{relative(path)}: {lines(path)} lines" for path in self.sources + tracked("*.py")
                    if lines(path) > MAX_FILE_LINES]
        folders = {}
        for path in self.sources:
            folders.setdefault(path.parent, []).append(path)
        findings += [f"{relative(folder)}: {len(files)} sources" for folder, files in folders.items()
                     if len(files) > MAX_FOLDER_SOURCES]
        for path in self.sources:
            limit = None
            if path.suffix == ".cpp" and path.stem in RECIPES:
                limit = MAX_RECIPE_LINES
            elif path.stem.endswith("_nodelet") and path.parent.name == "nodelets":
                limit = MAX_NODELET_LINES
            if limit and lines(path) >= limit:
                findings.append(f"{relative(path)}: {lines(path)} lines, limit {limit}")
        self.check(findings, "too large")

    def test_pages_are_short(self):
        pages = tracked("*.md")
        findings = []
        for path in pages:
            limit = None
            if path == ROOT / "README.md":
                limit = MAX_WORDS_README
            elif path.name == "README.md":
                limit = MAX_WORDS_PACKAGE_README
            if limit and words(path) > limit:
                findings.append(f"{relative(path)}: {words(path)} words, limit {limit}")
        # Pages made from data and declarations are looked up in, not read.
        total = sum(words(path) for path in pages if path.name not in ("options.md", "results.md"))
        if total > MAX_WORDS_ALL:
            findings.append(f"all pages: {total} words, limit {MAX_WORDS_ALL}")
        self.check(findings, "too long to be read")

    def test_comments_begin_with_a_subject(self):
        findings = []
        for path in self.sources:
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if RIDDLE.match(line) and not self.continues_a_sentence(path, number):
                    findings.append(f"{relative(path)}:{number}: {line.strip()}")
        self.check(findings, "comments that begin like the rest of a sentence")

    @staticmethod
    def continues_a_sentence(path, number):
        before = path.read_text(encoding="utf-8").splitlines()[number - 2].strip() if number > 1 else ""
        return before.startswith("//") and not before.endswith((".", ":"))

    def test_options_are_declared_once(self):
        declared = 0
        findings = []
        for path in self.sources:
            if path.stem in ("option_declaration", "options_test"):
                continue
            text = path.read_text(encoding="utf-8")
            declared += len(re.findall(r"^\s*VCHARGE_OPTION\(", text, re.M))
            if re.search(r"void visitFields\(", text):
                findings.append(f"{relative(path)}: visitFields")
        self.assertGreater(declared, 100)
        if declared > MAX_OPTIONS:
            findings.append(f"{declared} options, limit {MAX_OPTIONS}")
        self.check(findings, "options")

    def test_page_of_options_is_made_from_the_declarations(self):
        made = subprocess.run(["rosrun", "vcharge_tests", "write_option_reference"], capture_output=True, text=True,
                              check=True).stdout
        page = (ROOT / "doc" / "options.md").read_text(encoding="utf-8")
        self.assertEqual(made, page, "doc/options.md is stale: "
                                     "rosrun vcharge_tests write_option_reference > doc/options.md")


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "architecture", ArchitectureTest)
