#!/usr/bin/env python3
"""Every launch file and every shipped YAML parses, and the nodes, files and topics that it names exist."""
import pathlib
import re
import sys
import os
import unittest
from xml.etree import ElementTree

import roslaunch.config
import rospkg
import rostest
import yaml
from roslib.packages import find_node

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import run, tool  # noqa: E402

PACKAGES = rospkg.RosPack()
LAUNCH = pathlib.Path(PACKAGES.get_path("vcharge_launch"))
CONFIG = pathlib.Path(PACKAGES.get_path("vcharge_config"))
NODELET_PACKAGES = ("vcharge_ros", "vcharge_calibration", "vcharge_camera_driver", "vcharge_dense", "vcharge_mapping",
                    "vcharge_localization", "vcharge_obstacles")


def nodelet_types():
    types = set()
    for package in NODELET_PACKAGES:
        plugins = ElementTree.parse(pathlib.Path(PACKAGES.get_path(package)) / "nodelet_plugins.xml")
        types.update(entry.get("name") for entry in plugins.iter("class"))
    return types


def all_arguments(path):
    return [arg.get("name") for arg in ElementTree.parse(path).getroot().findall("arg") if arg.get("value") is None]


def required_arguments(path):
    return [arg.get("name") for arg in ElementTree.parse(path).getroot().findall("arg")
            if arg.get("value") is None and arg.get("default") is None]


def load(path, **arguments):
    """The launch file's nodes and parameters; required arguments are paths that need not exist to parse it."""
    given = {name: f"/nowhere/{name}" for name in required_arguments(path)}
    if "map" in all_arguments(path):  # view_map.launch shows whichever maps it is given
        given["map"] = "/nowhere/map"
    if "options" in given:  # loaded while parsing
        given["options"] = str(CONFIG / "driver" / "example_car.yaml")
    if "driver" in all_arguments(path):
        given["driver"] = str(CONFIG / "driver" / "example_car.yaml")
    given.update(arguments)
    return roslaunch.config.load_config_default(
        [(str(path), [f"{name}:={value}" for name, value in given.items()])], None, verbose=False)


class LaunchFilesTest(unittest.TestCase):
    def setUp(self):
        self.launch_files = sorted(LAUNCH.glob("*.launch"))
        self.assertGreaterEqual(len(self.launch_files), 3)

    def test_every_launch_file_parses_and_names_nodes_that_exist(self):
        for path in self.launch_files:
            for arguments in ({}, {"rviz": "true"}, {"rviz": "false", "loop": "true"}):
                config = load(path, **{k: v for k, v in arguments.items() if k in all_arguments(path)})
                self.assertEqual(config.config_errors, [], path.name)
                self.assertTrue(config.nodes, path.name)
                for node in config.nodes:
                    self.assertTrue(find_node(node.package, node.type), f"{path.name}: {node.package}/{node.type}")

    def test_every_nodelet_is_known_and_loaded_into_a_manager_that_is_there(self):
        for path in self.launch_files:
            nodelets = [node.args.split() for node in load(path).nodes if node.type == "nodelet"]
            managers = [node.name for node in load(path).nodes if node.type == "nodelet" and node.args == "manager"]
            loads = [words for words in nodelets if words[0] == "load"]
            self.assertTrue(loads, path.name)
            for _, name, manager in loads:
                self.assertIn(name, nodelet_types(), path.name)
                self.assertIn(manager, managers, path.name)

    def test_arguments_reach_the_nodes(self):
        for path in self.launch_files:
            if "map" in required_arguments(path) and "rig" in required_arguments(path):  # localizes a drive
                config = load(path, rig="/rigs/rig.yaml", map="/maps/lot.vmap", bag="/drives/drive.bag",
                              lossless_replay="true")
                for name, value in (("/localization/rig", "/rigs/rig.yaml"), ("/localization/map", "/maps/lot.vmap"),
                                    ("/localization/lossless_replay", True), ("/map_publisher/map", "/maps/lot.vmap"),
                                    ("/drive_tf/rig", "/rigs/rig.yaml"), ("/use_sim_time", True)):
                    self.assertEqual(config.params[name].value, value, path.name)
                player = next(node for node in config.nodes if node.package == "rosbag")
                self.assertEqual(player.args.split()[-1], "/drives/drive.bag", path.name)
                live = load(path, rig="/rigs/rig.yaml", map="/maps/lot.vmap")
                self.assertFalse([node for node in live.nodes if node.package == "rosbag"], path.name)
                self.assertNotIn("/use_sim_time", live.params)
                self.assertNotIn("/mapping/map", live.params)
                if "session" in all_arguments(path):
                    kept = load(path, rig="/rigs/rig.yaml", map="/maps/lot.vmap", session="/maps/today.vmap")
                    for name, value in (("/mapping/rig", "/rigs/rig.yaml"), ("/mapping/map", "/maps/lot.vmap"),
                                        ("/mapping/output", "/maps/today.vmap"), ("/mapping/lossless_replay", False)):
                        self.assertEqual(kept.params[name].value, value, path.name)
                continue
            if "map" in all_arguments(path):  # shows what was saved, and replays nothing
                config = load(path, map="/maps/lot.vmap")
                self.assertEqual(config.params["/map_publisher/map"].value, "/maps/lot.vmap", path.name)
                continue
            if "options" in required_arguments(path):  # of the car itself
                config = load(path, rig="/rigs/rig.yaml")
                self.assertEqual(config.params["/camera_driver/rig"].value, "/rigs/rig.yaml", path.name)
                self.assertEqual(config.params["/camera_driver/options/can_interface"].value, "can0", path.name)
                continue
            if "output" in required_arguments(path) and "rig" in required_arguments(path):  # maps a drive, or calibrates
                nodelet = {"calibrate_rig": "/calibration", "monitor_rig": "/monitor",
                           "height_map": "/height_map"}.get(path.stem, "/mapping")
                config = load(path, rig="/rigs/rig.yaml", output="/maps/lot.vmap", bag="/drives/drive.bag",
                              lossless_replay="true")
                for name, value in ((f"{nodelet}/rig", "/rigs/rig.yaml"), (f"{nodelet}/output", "/maps/lot.vmap"),
                                    (f"{nodelet}/lossless_replay", True), ("/use_sim_time", True)):
                    self.assertEqual(config.params[name].value, value, path.name)
                player = next(node for node in config.nodes if node.package == "rosbag")
                self.assertEqual(player.args.split()[-1], "/drives/drive.bag", path.name)
                live = load(path, rig="/rigs/rig.yaml", output="/maps/lot.vmap")
                self.assertFalse([node for node in live.nodes if node.package == "rosbag"], path.name)
                self.assertNotIn("/use_sim_time", live.params)
                if nodelet == "/calibration":
                    itself = "/calibration/session/calibrates_itself"
                    self.assertIs(live.params[itself].value, False)
                    live = load(path, rig="/rigs/rig.yaml", output="/maps/lot.vmap", automatic="true")
                    self.assertIs(live.params[itself].value, True)
                continue
            if "camera" in required_arguments(path):  # listens to a camera, and replays nothing
                config = load(path, camera="front", output="/rigs/cameras.yaml")
                self.assertEqual(config.params["/intrinsic_calibration/camera"].value, "front", path.name)
                self.assertEqual(config.params["/intrinsic_calibration/output"].value, "/rigs/cameras.yaml", path.name)
                continue
            config = load(path, **({"folder": "/drives"} if "folder" in required_arguments(path) else
                                   {"bag": "/drives/drive.bag", "rig": "/drives/rig_truth.yaml"}))
            parameters = {name: parameter.value for name, parameter in config.params.items()}
            self.assertIs(parameters["/use_sim_time"], True, path.name)
            for nodelet in ("depth", "drive_tf"):
                self.assertEqual(parameters[f"/{nodelet}/rig"], "/drives/rig_truth.yaml", path.name)
            player = next(node for node in config.nodes if node.package == "rosbag")
            self.assertEqual(player.args.split()[-1], "/drives/drive.bag", path.name)
            self.assertIn("--clock", player.args, path.name)

    def test_files_that_launch_files_name_exist(self):
        for path in self.launch_files:
            for node in load(path, rviz="true").nodes:
                for word in node.args.split():
                    if word.startswith("/") and not word.startswith("/nowhere/"):
                        self.assertTrue(pathlib.Path(word).exists(), f"{path.name}: {word}")

    def test_options_of_the_nodelets_are_those_of_the_yaml(self):
        activities = {"mapping": ("mapping", "mapping"), "localization": ("localization", "localization"),
                      "calibration": ("calibration", "calibrate_rig"), "obstacles": ("obstacles", "obstacles")}
        for options in sorted(CONFIG.glob("*.yaml")):
            if options.stem in ("calibration_in_map", "vehicle"):  # of a tool alone; beside those of the obstacles
                continue
            nodelet, launch = activities.get(options.stem, ("depth", "drive_replay"))
            config = load(LAUNCH / f"{launch}.launch", options=str(options))
            expected = yaml.safe_load(options.read_text())
            if nodelet == "obstacles":
                expected.update(yaml.safe_load((CONFIG / "vehicle.yaml").read_text()))
            found = {}
            for name, parameter in config.params.items():
                if name.startswith(f"/{nodelet}/options/"):
                    found[name[len(f"/{nodelet}/options/"):]] = parameter.value
            flat = {}

            def flatten(prefix, value):
                for key, entry in value.items():
                    if isinstance(entry, dict):
                        flatten(f"{prefix}{key}/", entry)
                    else:
                        flat[prefix + key] = entry
            flatten("", expected)
            self.assertEqual(found, flat, options.name)

    def test_every_shipped_yaml_is_taken_by_the_option_reader(self):
        rigs = sorted((CONFIG / "rigs").glob("*.yaml"))
        analyzers = [CONFIG / "diagnostics.yaml"]  # diagnostic_aggregator reads them
        options = sorted(set(CONFIG.glob("*.yaml")) - set(analyzers))
        scenarios = sorted((CONFIG / "scenarios").glob("*.yaml"))  # faults_test.py loads them
        drivers = sorted((CONFIG / "driver").glob("*.yaml"))  # driver_test.py loads them
        self.assertEqual(sorted(CONFIG.rglob("*.yaml")), sorted(rigs + options + scenarios + drivers + analyzers),
                         "a YAML that nobody reads")
        self.assertTrue(rigs and options)
        readers = {"calibration": [tool("vcharge_calibration", "calibrate_rig")],
                   "calibration_in_map": [tool("vcharge_calibration", "calibrate_rig_from_map"), "--map", "/nowhere/drive.bag"],
                   "height_map": [tool("vcharge_dense", "build_height_map")],
                   "mapping": [tool("vcharge_mapping", "build_map")],
                   "localization": [tool("vcharge_localization", "localize_drive"), "--map", "/nowhere/drive.bag"],
                   "obstacles": [tool("vcharge_obstacles", "detect_obstacles")],
                   "vehicle": [tool("vcharge_obstacles", "detect_obstacles")]}
        dense = [tool("vcharge_dense", "compute_range_maps")]
        for rig, option in [(rig, options[0]) for rig in rigs] + [(rigs[0], option) for option in options]:
            # Bag and map are read last: an error about them shows that rig and options were accepted.
            status, _, errors = run([*readers.get(option.stem, dense), "--bag", "/nowhere/drive.bag", "--rig", rig, "--options", option,
                                     "--output", "/nowhere/output"])
            self.assertGreater(status, 0)
            self.assertEqual(len(errors), 1, errors)
            self.assertIn("/nowhere/drive.bag: no such file", errors[0])

    def test_rviz_configurations_show_topics_that_are_published(self):
        cameras = yaml.safe_load((CONFIG / "rigs" / "golf_nominal.yaml").read_text())["cameras"]
        published = re.compile(rf"/camera/({'|'.join(cameras)})/image_raw|"
                               rf"/dense/({'|'.join(cameras)})/(points|range/(image|confidence|standard_deviation))|"
                               r"/calibration/(image|landmarks|trajectory|cameras)|/mapping/(landmarks|trajectory|loop_edges|changes)|/localization/(pose|observations)|"
                               r"/obstacles/(grid|steps|scan|markers|object_markers)|/dense/height_map(/(points|grid|mesh))?|/dense/octomap/occupied")

        def topics(node):
            if isinstance(node, dict):
                for key, value in node.items():
                    if key in ("Topic", "Image Topic", "Marker Topic") and value:
                        yield value
                    else:
                        yield from topics(value)
            elif isinstance(node, list):
                for entry in node:
                    yield from topics(entry)

        files = sorted((CONFIG / "rviz").glob("*.rviz"))
        self.assertTrue(files)
        for path in files:
            shown = list(topics(yaml.safe_load(path.read_text())["Visualization Manager"]["Displays"]))
            self.assertTrue(shown, path.name)
            for topic in shown:
                self.assertTrue(published.fullmatch(topic), f"{path.name}: {topic}")


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "launch_files", LaunchFilesTest)
