"""Rolling shutters: errors of the stages after calibration, against those of the same drives with a global shutter, with a rig
that tells the readout and with one that does not."""
import argparse

import numpy as np

from vcharge_evaluation.drives import found_masks, loop_drive, other_day_drive, shutter_words
from vcharge_evaluation.localization_errors import BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.obstacles import detect_obstacles, summary
from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.spoiled_drives import write_timed_rig
from vcharge_evaluation.tools import CONFIG, NoResult, judge, run_tool_once, say

READOUTS_MS = (10, 25)
MAX_RATIO = 1.3  # of an error with a readout that the rig tells, to that with a global shutter
STAGES = ("trajectory", "localization", "ranges", "obstacles")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "shutter_evaluation")
    parser.add_argument("--drives", nargs="*", default=["lot:5", "garage:6"], help="scene:seed of each")
    parser.add_argument("--stages", nargs="*", default=STAGES, choices=STAGES)
    parser.add_argument("--image-scale", type=float, default=0.4)
    parser.add_argument("--map-duration-s", type=float, default=24)
    parser.add_argument("--duration-s", type=float, default=8)
    return parser.parse_args()


def quantiles(name, errors, unit):
    return [(f"{name}, median", float(np.percentile(errors, 50)), unit), (f"{name}, 95 %", float(np.percentile(errors, 95)), unit)]


class Place:
    """A scene's drives by readout (ms; 0: global shutter), and what they are judged by: the drives with a global shutter."""

    def __init__(self, args, scene, seed):
        words = {readout_ms: shutter_words(readout_ms) for readout_ms in (0, *READOUTS_MS)}
        if {"trajectory", "localization"} & set(args.stages):
            self.loops = {readout_ms: loop_drive(args.work, scene, seed, args.image_scale, args.map_duration_s, more)
                          for readout_ms, more in words.items()}
        self.others = {readout_ms: other_day_drive(args.work, scene, seed, args.image_scale, args.duration_s, more)
                       for readout_ms, more in words.items()}
        self.masks = found_masks(args.work, scene)

    def rig(self, drive, readout_ms):
        """The rig of a drive, which tells a readout unless it is 0."""
        rig = self.masks.rig_of(drive.folder)
        if readout_ms == 0:
            return rig
        return write_timed_rig(rig, drive.folder / "rig_timed.yaml", readout_ms / 1000, "down")

    def trajectory(self, readout_ms, told_ms, name):
        drive = self.loops[readout_ms]
        trajectory = drive.folder / f"{name}.tum"
        run = run_tool_once("build_map", drive.folder / f"{name}.log", "--bag", drive.bag, "--rig", self.rig(drive, told_ms),
                            "--output", drive.folder / f"{name}.vmap", "--trajectory", trajectory, "--options",
                            CONFIG / "mapping.yaml", may_fail=True)
        if run.error():
            raise NoResult(run.reason())
        errors = judge("trajectory", drive.folder / f"{name}_report", "--estimate", trajectory, "--truth", drive.trajectory)
        drift = errors["drift"][-1]
        yield ("position after alignment, root mean square", 100 * errors["alignments"][2]["position_m"]["root_mean_square"], "cm")
        yield f"drift over {drift['distance_m']:g} m, median", drift["translation_percent"]["percentile_50"], "%"

    def localization(self, readout_ms, told_ms, name):
        """In the map of the loop with a global shutter."""
        mapping = self.loops[0]
        path, _, run = mapping.map(self.masks.rig_of(mapping.folder))
        if run.error():
            raise NoResult(run.reason())
        drive = self.others[readout_ms]
        output = drive.folder / f"{name}.tum"
        run_tool_once("localize_drive", drive.folder / f"{name}.log", "--bag", drive.bag, "--rig", self.rig(drive, told_ms), "--map",
                      path, "--options", CONFIG / "localization.yaml", "--output", output)
        errors = LocalizationErrors(f"{output}.csv", drive.trajectory, Map(path, mapping.trajectory))
        yield from quantiles("position in the map (none: 50 cm)", 100 * np.minimum(errors.error_m, BOUND_M), "cm")

    def ranges(self, readout_ms, told_ms, name):
        drive, sound = self.others[readout_ms], self.others[0]
        output = drive.folder / name
        run = run_tool_once("compute_range_maps", output.with_suffix(".log"), "--bag", drive.bag, "--rig",
                            self.rig(drive, told_ms), "--output", output, "--no-pictures", "--online", "--options",
                            CONFIG / "dense_obstacles.yaml", may_fail=True)
        if run.error():
            raise NoResult(run.reason())
        errors = judge("range", drive.folder / f"{name}_report", "--range", output, "--truth", sound.truth, "--bag", sound.bag,
                       "--rig", sound.true_rig)
        spread = next(one for one in errors["sets"] if one["label"] == "all cameras")["bounded_relative_error"]
        yield "error over the range (unknown: 50 %), mean", 100 * spread["mean"], "%"
        yield "error over the range, median", 100 * spread["percentile_50"], "%"

    def obstacles(self, readout_ms, told_ms, name):
        drive, sound = self.others[readout_ms], self.others[0]
        output = drive.folder / name
        if detect_obstacles(drive, self.rig(drive, told_ms), output) == 0:
            raise NoResult("no obstacle map could be made")
        errors = summary(judge("obstacles", drive.folder / f"{name}_report", "--obstacles", output, "--truth", sound.truth))
        yield "distance of the nearest obstacle (missed: 50 cm), mean error", 100 * errors["mean_m"], "cm"


def compare(place, stage, readout_ms):
    """Figures of a stage with this readout."""
    kinds = {"global shutter": (0, 0), "readout told": (readout_ms, readout_ms), "readout not told": (readout_ms, 0)}
    found = {}
    for kind, (readout, told) in kinds.items():
        say(f"{stage}, {readout_ms} ms, {kind}")
        found[kind] = list(getattr(place, stage)(readout, told, f"{stage}_told{told}"))
    for (name, least, unit), (_, told, _), (_, ignored, _) in zip(*found.values()):
        yield Figure(f"{stage}: {name}, global shutter", least, unit)
        yield Figure(f"{stage}: {name}, readout told", told, unit)
        yield Figure(f"{stage}: {name}, readout not told", ignored, unit)
        yield figure(f"{stage}: {name}, told over global", told / least, at_most=MAX_RATIO)


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("shutters", "Rolling shutters", args)
    for drive in args.drives:
        scene, seed = drive.split(":")
        place = Place(args, scene, int(seed))
        for readout_ms in READOUTS_MS:
            figures = []
            for stage in args.stages:
                try:
                    figures += compare(place, stage, readout_ms)
                except NoResult as error:
                    figures.append(figure(f"{stage}: result", str(error), equal="one"))
            results.add(f"Errors with a rolling shutter, image scale {args.image_scale:g}", (f"{drive}, {readout_ms} ms", figures))
    results.end()


if __name__ == "__main__":
    main()
