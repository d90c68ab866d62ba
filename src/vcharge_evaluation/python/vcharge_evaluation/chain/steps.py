"""The whole chain on one car, step by step: boards -> intrinsics; a drive -> masks of the own body, and extrinsics; a drive ->
a sparse map, range maps, a height map and an OctoMap; another day's drive -> the pose in the map and obstacles, offline and
through the nodelets. Ends with report.html. A step that an earlier run finished with the same input is kept, and an
interrupted one is resumed. The truth of simulated drives only judges the results."""
import concurrent.futures
import os
import shutil
import sys

import yaml

import vcharge
from vcharge_evaluation.chain import figures, nodelets, report
from vcharge_evaluation.chain.arguments import arguments
from vcharge_evaluation.chain.step_folders import StepFolders, fingerprint
from vcharge_evaluation.drives import OTHER_DAY
from vcharge_evaluation.tools import CONFIG, ROOT, drawn, import_published_images, run, run_tool, say, tool_path

RVIZ_SCREENSHOT = ROOT / "src" / "vcharge_evaluation" / "scripts" / "rviz_screenshot.sh"
CAMERAS = ("front", "left", "rear", "right")
# Metres per tick are known to 0.05 %, as doc/bring_up.md asks for.
WHEELS = ("--set", "odometer.scale_error=0.0005", "--set", "odometer.left_right_error=0.0002")
# Paint that reflects, and people who walk through the other day's drive, one of them in front of the car.
BODY = ("--set", "body=glossy")
PEOPLE = ("--set", "movers.people=2", "--set", "movers.crossing=true")


def settings(name):
    """Path and text of an options file in config/; the text decides whether a step must run again."""
    return CONFIG / name, (CONFIG / name).read_text()


class Chain(StepFolders):
    """The steps in their order."""

    def __init__(self, args):
        super().__init__(args.work.resolve())
        self.args = args
        self.simulated = args.bag is None
        self.pictures = self.work / "pictures"
        self.pictures.mkdir(parents=True, exist_ok=True)
        scale = 0.5 if args.quick else 1.0
        self.simulator_arguments = ["--scene-seed", args.seed, "--rig", "random", "--rig-seed", args.rig_seed,
                                    "--image-scale", scale, *BODY]

    def simulate(self, name, title, *words):
        words = ["--scene", self.args.scene, *self.simulator_arguments, *words]
        words = [*drawn(words), *words]

        def work(folder):
            run_tool("simulate_drive", folder / "simulate.log", *words, "--output", folder / "drive.bag")
            return {}

        return self.step(name, title, [], words, work)

    def link_recording(self, name, title, bag):
        """A step that only links a bag of the user."""
        def work(folder):
            (folder / "drive.bag").symlink_to(bag.resolve())
            return {}

        return self.step(name, title, [], [fingerprint(bag)], work)

    def truth_of(self, drive):
        """Folder of a simulated drive's truth; None for a recording."""
        return drive / "drive_truth" if self.simulated else None

    def boards(self):
        """Folder or bag of each camera's pictures."""
        if not self.simulated:
            entries = {}
            for entry in sorted(self.args.boards.iterdir()):
                if entry.is_dir() or entry.suffix == ".bag":
                    entries[entry.stem] = entry
            if not entries:
                raise SystemExit(f"{self.args.boards}: no folder CAMERA and no CAMERA.bag in it")
            self.keys["boards"] = fingerprint(self.args.boards)
            return entries
        words = [*self.simulator_arguments, "--scene", "chessboard", "--seed", self.args.seed + 100, "--image-step", 8]

        def work(folder):
            for camera in CAMERAS:
                run_tool("simulate_drive", folder / f"{camera}.log", *words, "--drive", f"board_{camera}", "--cameras",
                         camera, "--output", folder / f"{camera}.bag")
            return {}

        folder = self.step("boards", "a chessboard before each camera", [], words, work)
        return {camera: folder / f"{camera}.bag" for camera in CAMERAS}

    def intrinsics(self):
        boards = self.boards()

        def work(folder):
            output, found = folder / "cameras.yaml", {}
            for camera, source in boards.items():
                words = ["--bag", source] if source.suffix == ".bag" else ["--images", source]
                result = run_tool("calibrate_intrinsics", folder / f"{camera}.log", *words, "--board", self.args.board,
                                  "--square-m", self.args.square_m, "--camera", camera, "--output", output, "--keep-others",
                                  "--report", folder / f"{camera}.html")
                found[camera] = figures.pick(result, "verdict", "remarks", "num_images", "rms_px")
            if self.args.rig:
                self.add_given_masks(output)
            if self.simulated:
                truths = {camera: source.parent / f"{camera}_truth" / "rig.yaml" for camera, source in boards.items()}
                figures.judge_intrinsics(output, truths, found, self.pictures / "intrinsics.png")
            return found

        given = [self.args.board, self.args.square_m, fingerprint(self.args.rig) if self.args.rig else ""]
        return self.step("intrinsics", "intrinsics from the boards", ["boards"], given, work) / "cameras.yaml"

    def add_given_masks(self, path):
        """Adds the masks of --rig to a rig file."""
        rig, given = yaml.safe_load(path.read_text()), yaml.safe_load(self.args.rig.read_text())["cameras"]
        for camera, entry in rig["cameras"].items():
            if "mask" in given.get(camera, {}):
                entry["mask"] = f"{camera}_mask.png"
                shutil.copyfile(self.args.rig.parent / given[camera]["mask"], path.parent / entry["mask"])
        path.write_text(yaml.safe_dump(rig, sort_keys=False))

    def masks(self, cameras, drive, needs):
        """The rig with masks of the own body, found in a drive. Masks that it has already are kept."""
        if any(camera.mask is not None for camera in vcharge.read_rig(cameras)):
            self.keys["masks"] = self.keys["intrinsics"]
            return cameras

        def work(folder):
            output = folder / "cameras.yaml"
            result = run_tool("make_masks", folder / "masks.log", "--bag", drive / "drive.bag", "--rig", cameras, "--output",
                              output, "--report", folder / "report", may_fail=True)
            if not output.exists():
                shutil.copyfile(cameras, output)
            figures.draw_masks(folder / "report", self.pictures / "masks.png")
            found = {**figures.pick(result, "verdict", "cameras"), "error": result.error()}
            if self.simulated:
                figures.judge_masks(output, drive / "rig_truth.yaml", found)
            return found

        return self.step("masks", "masks of the own body from the same drive", needs, [], work) / "cameras.yaml"

    def extrinsics(self, cameras, drive, needs):
        def work(folder):
            bag, rig = drive / "drive.bag", folder / "rig.yaml"
            checked = run_tool("check_bag", folder / "check.log", "--bag", bag, "--rig", cameras, may_fail=True)
            options, _ = settings("calibration.yaml")
            result = run_tool("calibrate_rig", folder / "calibrate.log", "--bag", bag, "--rig", cameras, "--output", rig,
                              "--options", options, "--report", folder / "report", may_fail=True)
            if not rig.exists():
                raise SystemExit(f"{result.error()}\nno calibration: see {folder / 'calibrate.log'}")
            found = {**figures.pick(result, "verdict", "remarks", "distance_m", "left_turn_rad", "right_turn_rad"),
                     "check": checked.found.get("verdict")}
            if self.simulated:
                figures.judge_rig(rig, drive / "rig_truth.yaml", found, folder, self.pictures / "rig.png")
            return found

        return self.step("extrinsics", "extrinsics from a drive", needs, settings("calibration.yaml")[1:],
                         work) / "rig.yaml"

    def sparse_map(self, drive, rig, needs, name="map", title="a sparse map"):
        truth = self.truth_of(drive)

        def work(folder):
            path = folder / "map.vmap"
            options, _ = settings("mapping.yaml")
            result = run_tool("build_map", folder / "map.log", "--bag", drive / "drive.bag", "--rig", rig, "--output", path,
                              "--trajectory", folder / "map.tum", "--options", options, "--report", folder / "report")
            found = figures.pick(result, "verdict", "num_keyframes", "num_landmarks", "num_loop_edges", "content_hash")
            camera = next(iter(vcharge.read_rig(rig))).name
            run([tool_path("draw_landmarks"), "--map", path, "--bag", drive / "drive.bag", "--camera", camera,
                 "--output", self.pictures / f"{name}_landmarks.png"], folder / "draw.log")
            if truth:
                figures.judge_map(path, truth, found, folder / "report", self.pictures / f"{name}.png")
            return found

        return self.step(name, title, needs, settings("mapping.yaml")[1:], work)

    def height_map(self, drive, rig, poses, needs, name="height_map", title="a height map and an OctoMap"):
        truth = self.truth_of(drive) if name != "real_height_map" else None
        # The odometry of the published images is too coarse for range maps of full resolution: they use the defaults.
        options, text = settings("height_map.yaml") if poses else (None, "")

        def work(folder):
            output = folder / "map"
            words = ["--trajectory", poses, "--options", options] if poses else []
            result = run_tool("build_height_map", folder / "build.log", "--bag", drive / "drive.bag", "--rig", rig,
                              "--output", output, *words)
            found = {**figures.pick(result, "num_range_maps", "content_hash"), "peak_gb": result.peak_gb}
            self.draw("height_map", f"{name}.png", folder, "--map", output)
            self.draw("octomap", f"{name}_octomap.png", folder, "--octomap", output / "octomap.bt")
            if truth:
                figures.judge_height_map(output, truth, rig, poses, found, folder)
            return found

        return self.step(name, title, needs, [text], work)

    def draw(self, module, output, folder, *words):
        """Draws into the folder of pictures by a module of vcharge_evaluation.drawing."""
        run([sys.executable, "-m", f"vcharge_evaluation.drawing.{module}", *words, "--output", self.pictures / output],
            folder / f"draw_{module}.log")

    def ranges(self, drive, rig, needs):
        truth = self.truth_of(drive)
        options, text = settings("dense.yaml")

        def work(folder):
            output = folder / "range"
            run_tool("compute_range_maps", folder / "ranges.log", "--bag", drive / "drive.bag", "--rig", rig, "--options",
                     options, "--output", output)
            self.draw("ranges", "", folder, "--bag", drive / "drive.bag", "--rig", rig, "--range", output,
                      *(["--truth", truth, "--stamp-ns", figures.crossing_stamp(truth)] if truth else []))
            return figures.judge_ranges(output, truth, drive / "drive.bag", rig, folder) if truth else {}

        return self.step("ranges", "range maps", needs, [text], work)

    def localization(self, mapped, drive, rig, mapping_drive, needs, name="localization",
                     title="the pose in the map, on another day"):
        options, text = settings("localization.yaml")
        truths = (self.truth_of(mapping_drive), self.truth_of(drive)) if self.simulated else None

        def work(folder):
            result = run_tool("localize_drive", folder / "localize.log", "--bag", drive / "drive.bag", "--rig", rig, "--map",
                              mapped / "map.vmap", "--options", options, "--output", folder / "poses.tum")
            return figures.localization_figures(result, folder / "poses.tum.csv", mapped / "map.vmap", truths,
                                                self.pictures / f"{name}.png")

        return self.step(name, title, needs, [text], work)

    def obstacles(self, drive, rig, needs, name="obstacles", title="obstacles and free ground around the vehicle"):
        truth = self.truth_of(drive) if name != "real_obstacles" else None
        (ranges, range_text), (options, text) = settings("dense_obstacles.yaml"), settings("obstacles.yaml")

        def work(folder):
            # The options name cameras that another rig may not have.
            cameras = set(vcharge.read_rig(rig).cameras)
            words = ["--options", options] if {"front", "left", "rear", "right"} <= cameras else []
            result = run_tool("detect_obstacles", folder / "detect.log", "--bag", drive / "drive.bag", "--rig", rig, *words,
                              "--range-options", self.range_options(ranges, cameras, folder), "--output", folder / "maps")
            found = figures.pick(result, "num_maps", "content_hash", "processor_ms_per_range_map")
            self.draw("obstacles", f"{name}.png", folder, "--bag", drive / "drive.bag", "--rig", rig, "--obstacles", folder / "maps",
                      *(["--truth", truth, "--camera", "front", "--stamp-ns", figures.crossing_stamp(truth)] if truth else []))
            if truth:
                figures.judge_obstacles(folder / "maps", truth, found, folder)
            return found

        return self.step(name, title, needs, [range_text, text], work)

    @staticmethod
    def range_options(path, cameras, folder):
        """The options with the rig's own cameras alone."""
        options = yaml.safe_load(path.read_text())
        options["cameras"] = [camera for camera in options.get("cameras", []) if camera in cameras]
        if not options["cameras"]:
            del options["cameras"]
        output = folder / "range_options.yaml"
        output.write_text(yaml.safe_dump(options))
        return output

    def nodelets(self, mapped, drive, rig, needs):
        """The same drive through vcharge.launch without losses: must give what the offline tools gave."""
        def work(folder):
            return nodelets.replay(self.work, mapped / "map.vmap", drive / "drive.bag", rig, folder)

        return self.step("nodelets", "the same drive through the nodelets", needs, [], work)

    def rviz(self, mapped, drive, rig, heights, needs):
        def work(folder):
            del folder

            def take(view, before, after=()):
                """Takes the picture of a view; `before` and `after` are rviz_screenshot.sh's arguments around its path."""
                picture = self.pictures / f"rviz_{view}.png"
                run([RVIZ_SCREENSHOT, *before, picture, *after], self.work / "rviz" / f"{view}.log")

            replay = [drive / "drive.bag", rig]
            # Mostly waiting for rviz: the height map's picture, without a replay, is taken meanwhile.
            with concurrent.futures.ThreadPoolExecutor(max_workers=1) as pool:
                height_map = pool.submit(take, "height_map", [heights / "map"])
                take("ranges", replay)
                take("pose", replay, [mapped / "map.vmap"])
                take("obstacles", replay, [mapped / "map.vmap", "obstacles"])
                height_map.result()
            return {}

        return self.step("rviz", "pictures of rviz", needs, [], work)

    def real_images(self):
        """The published images of the V-Charge car, if VCHARGE_DATA has them."""
        if not os.environ.get("VCHARGE_DATA"):
            say("   VCHARGE_DATA is not set: the published images are left out")
            return

        def work(folder):
            return {"imported": import_published_images(folder)}

        drive = self.step("real", "the published images of the V-Charge car", [], [], work)
        if not self.steps["real"]["figures"]["imported"]:
            return
        self.height_map(drive, drive / "rig.yaml", None, ["real"], "real_height_map", "their height map")
        self.obstacles(drive, drive / "rig.yaml", ["real"], "real_obstacles", "their obstacles")

    def drives(self):
        """For calibration, for the map, and on another day."""
        if not self.simulated:
            mapping = self.link_recording("mapping_drive", "your drive", self.args.bag)
            other = self.link_recording("other_day", "your other drive", self.args.other_bag) if self.args.other_bag else mapping
            return mapping, mapping, other
        args = self.args
        calibration = self.simulate("calibration_drive", "a drive to calibrate from", "--drive", "figure_eight", "--seed",
                                    args.seed + 200, "--image-step", 2, "--duration-s", 80, *WHEELS)
        mapping = self.simulate("mapping_drive", "a drive to map", "--drive", "loop", "--seed", args.seed + 300, "--image-step",
                                2, "--height-cell-m", 0.025, "--duration-s", 24 if args.quick else 48, *WHEELS)
        other = self.simulate("other_day", "another day: other light, other cars, people", *OTHER_DAY, "--seed",
                              args.seed + 400, "--truth-range", "--duration-s", 8 if args.quick else 16, *PEOPLE)
        return calibration, mapping, other

    def rig(self, calibration):
        """Intrinsics from boards, masks and extrinsics from a drive, unless --rig has them."""
        given = self.args.rig
        if given and not self.args.boards:
            cameras = vcharge.read_rig(given)
            self.keys["intrinsics"] = fingerprint(given)
            if all(camera.vehicle_from_camera is not None for camera in cameras):
                self.keys["extrinsics"] = fingerprint(given)
                return given.resolve()
            path = given.resolve()
        else:
            path = self.intrinsics()
        path = self.masks(path, calibration, ["intrinsics", calibration.name])
        return self.extrinsics(path, calibration, ["masks", calibration.name])

    def stages(self):
        """All stages from recordings to results, each with the output of those before."""
        calibration, mapping, other = self.drives()
        rig = self.rig(calibration)
        mapped = self.sparse_map(mapping, rig, ["extrinsics", mapping.name])
        heights = self.height_map(mapping, rig, mapped / "map.tum", ["map"])
        self.ranges(other, rig, ["extrinsics", other.name])
        self.localization(mapped, other, rig, mapping, ["map", other.name])
        self.obstacles(other, rig, ["extrinsics", other.name])
        return mapping, other, rig, mapped, heights

    def stages_from_truth(self, mapping, other):
        """The stages after calibration with the true rig, and heights with true poses too, which shows what the errors of
        earlier stages add."""
        rig, poses = mapping / "rig_truth.yaml", mapping / "drive_truth" / "trajectory.tum"
        mapped = self.sparse_map(mapping, rig, [mapping.name], "map_true_rig", "a sparse map, true rig")
        self.localization(mapped, other, rig, mapping, ["map_true_rig", other.name], "localization_true_rig",
                          "the pose, true rig")
        self.obstacles(other, rig, [other.name], "obstacles_true_rig", "obstacles, true rig")
        self.height_map(mapping, rig, mapped / "map.tum", ["map_true_rig"], "height_map_true_rig", "a height map, true rig")
        self.height_map(mapping, rig, poses, [mapping.name], "height_map_truth", "a height map, true rig and poses")

    def run_all(self):
        _, other, rig, mapped, heights = self.stages()
        if not self.args.no_nodelets:
            self.nodelets(mapped, other, rig, ["localization", "obstacles"])
        if not self.args.no_rviz and not self.args.no_nodelets:
            self.rviz(mapped, other, rig, heights, ["nodelets", "height_map"])
        if self.simulated:
            self.real_images()
        report.write(self.work / "report.html", self)
        say(f"written: {self.work / 'report.html'}")


def main():
    Chain(arguments(__doc__)).run_all()


if __name__ == "__main__":
    main()
