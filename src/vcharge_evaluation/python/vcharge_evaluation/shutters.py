"""Rolling shutters and cameras without a common trigger: errors of the stages after calibration, against those of the same
drives with global shutters and one trigger, with a rig that tells the timing and with one that does not."""
import argparse

import numpy as np

from vcharge_evaluation.drives import AT_ONCE, MAX_TIMED_RATIO, TIMINGS, found_masks, loop_drive, other_day_drive
from vcharge_evaluation.localization_errors import BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.obstacles import judge_obstacles, summary
from vcharge_evaluation.ranges import AS_ON_THE_CAR, RangeErrors
from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.spoiled_drives import write_timed_rig
from vcharge_evaluation.tools import CONFIG, NoResult, judge, run_tool_once, say

STAGES = ("trajectory", "localization", "ranges", "obstacles")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "shutter_evaluation")
    parser.add_argument("--drives", nargs="*", default=["lot:5", "garage:6"], help="scene:seed of each")
    parser.add_argument("--stages", nargs="*", default=STAGES, choices=STAGES)
    parser.add_argument("--timings", nargs="*", default=[one.name for one in TIMINGS], choices=[one.name for one in TIMINGS])
    parser.add_argument("--image-scale", type=float, default=0.4)
    parser.add_argument("--map-duration-s", type=float, default=24)
    parser.add_argument("--duration-s", type=float, default=8)
    return parser.parse_args()


def quantiles(name, errors, unit):
    return [(f"{name}, {label}", float(np.percentile(errors, which)), unit) for label, which in (("median", 50), ("95 %", 95))]


def name_of(stage, told):
    """Name of the files that a stage makes of a drive."""
    return f"{stage}_{'untimed' if told == AT_ONCE else 'timed'}"


class Place:
    """A scene's drives by timing, and what they are judged by: the drives that are exposed at once."""

    def __init__(self, args, scene, seed):
        self.args, self.scene, self.seed = args, scene, seed
        self.masks = found_masks(args.work, scene)

    def loop(self, timing):
        return loop_drive(self.args.work, self.scene, self.seed, self.args.image_scale, self.args.map_duration_s,
                          timing.words())

    def other(self, timing):
        return other_day_drive(self.args.work, self.scene, self.seed, self.args.image_scale, self.args.duration_s,
                               timing.words())

    def rig(self, drive, told):
        """The rig of a drive, with the timing that it tells."""
        rig = self.masks.rig_of(drive.folder)
        return rig if told == AT_ONCE else write_timed_rig(rig, drive.folder / "rig_timed.yaml", told.readout_ms / 1000,
                                                           stamp_tolerance_s=told.tolerance_ms / 1000)

    def trajectory(self, timing, told, name):
        drive = self.loop(timing)
        _, trajectory, run = drive.map(self.rig(drive, told), name)
        if run.error():
            raise NoResult(run.reason())
        errors = judge("trajectory", drive.folder / f"{name}_report", "--estimate", trajectory, "--truth", drive.trajectory)
        drift = errors["drift"][-1]
        aligned = errors["alignments"][2]["position_m"]
        yield "position after alignment, root mean square", 100 * aligned["root_mean_square"], "cm"
        yield f"drift over {drift['distance_m']:g} m, median", drift["translation_percent"]["percentile_50"], "%"

    def localization(self, timing, told, name):
        """In the map of the loop that is exposed at once."""
        mapping = self.loop(AT_ONCE)
        path, _, run = mapping.map(self.rig(mapping, AT_ONCE), name_of("trajectory", AT_ONCE))
        if run.error():
            raise NoResult(run.reason())
        drive = self.other(timing)
        output = drive.folder / f"{name}.tum"
        run_tool_once("localize_drive", drive.folder / f"{name}.log", "--bag", drive.bag, "--rig", self.rig(drive, told),
                      "--map", path, "--options", CONFIG / "localization.yaml", "--output", output)
        errors = LocalizationErrors(f"{output}.csv", drive.trajectory, Map(path, mapping.trajectory))
        yield from quantiles("position in the map (none: 50 cm)", 100 * np.minimum(errors.error_m, BOUND_M), "cm")

    def ranges(self, timing, told, name):
        if timing.shifts_ms and told == AT_ONCE:
            raise NoResult("its stamps have no true ranges")
        drive = self.other(timing)
        errors = RangeErrors(drive, self.rig(drive, told), name, *AS_ON_THE_CAR, sound=self.other(AT_ONCE))
        spread = errors.sets["all cameras"]["bounded_relative_error"]
        yield "error over the range (unknown: 50 %), mean", 100 * spread["mean"], "%"
        yield "error over the range, median", 100 * spread["percentile_50"], "%"

    def obstacles(self, timing, told, name):
        drive = self.other(timing)
        errors = summary(judge_obstacles(drive, self.rig(drive, told), name=name, sound=self.other(AT_ONCE)))
        yield "distance of the nearest obstacle (missed: 50 cm), mean error", 100 * errors["mean_m"], "cm"


def compare(place, stage, timing):
    """Figures of a stage with this timing. What fails has none."""
    found = {}
    for kind, of_drive, told in (("at once", AT_ONCE, AT_ONCE), ("told", timing, timing), ("not told", timing, AT_ONCE)):
        say(f"{stage}, {timing.name}, {kind}")
        try:
            found[kind] = list(getattr(place, stage)(of_drive, told, name_of(stage, told)))
        except NoResult as error:
            yield Figure(f"{stage}: {kind}", str(error))
        except RuntimeError:  # a judge finds no truth at the stamps
            yield Figure(f"{stage}: {kind}", "nothing to judge")
    for i, (name, least, unit) in enumerate(found.get("at once", [])):
        values = {kind: figures[i][1] for kind, figures in found.items()}
        for kind, value in values.items():
            yield Figure(f"{stage}: {name}, {kind}", value, unit)
        yield figure(f"{stage}: {name}, told over at once", values["told"] / least if "told" in values else None,
                     at_most=MAX_TIMED_RATIO)


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("shutters", "Rolling shutters and clocks", args)
    for drive in args.drives:
        scene, seed = drive.split(":")
        place = Place(args, scene, int(seed))
        for timing in (one for one in TIMINGS if one.name in args.timings):
            figures = [entry for stage in args.stages for entry in compare(place, stage, timing)]
            results.add(f"Errors with timing, image scale {args.image_scale:g}", (f"{drive}, {timing.name}", figures))
    results.end()


if __name__ == "__main__":
    main()
