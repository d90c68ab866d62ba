"""Driving and light: each scenario through the causal chain, with the pose in a map that was built at noon on the same path,
range maps from earlier images alone, and obstacle maps from these. The masks of the own body are those of make_masks."""
import argparse

from vcharge_evaluation.drawing.moments import OBSTACLE_LEGEND, draw_obstacles
from vcharge_evaluation.drives import SCENARIOS, Drive, found_masks, scenario_drive, scene_and_drive
from vcharge_evaluation.localization_errors import BOUND_DEG, BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.obstacles import judge_obstacles, summary
from vcharge_evaluation.ranges import AS_ON_THE_CAR, RangeErrors
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, NoResult, run_tool_once, say

DRIVING_QUICK = ("movers_lot", "movers_garage", "movers_crossing", "standing_lot", "stop_and_go_lot", "bay_backwards_lot",
                 "bay_backwards_garage", "bay_forwards_lot", "three_point_turn_lot", "road_fast", "road_bumps")
DRIVING = (*DRIVING_QUICK, "stop_and_go_garage", "bay_forwards_garage", "three_point_turn_garage", "road_slow", "road_slope",
           "ramp_up", "ramp_down", "layout_lot", "layout_garage", "steps_lot",
           "standing_approached", "arrive_and_stand_lot", "wheel_speeds")
# A car that stands cannot map: the noon map of its place comes from another drive.
MAP_DRIVES = {"standing": "short"}
# The car needs 8 s to reach the ramp, and 25 s for a turn of it.
TIMES_LONGER = {"ramp": 3}
# Scenes whose levels lie above one another: the truth of an obstacle map, which is flat, mixes them.
LAYERED = ("ramp",)
OBSTACLE_BOUND_M, RANGE_BOUND = 0.5, 0.5  # errors of missed rays, and relative ones of unknown ranges
NOON = "noon_"  # before the name of a condition: its drive without it


def condition_scenarios():
    return sorted(path.stem for path in SCENARIOS.glob("condition_*.yaml"))


def all_scenarios(driving=DRIVING):
    """Driving, conditions of light and weather, and the drives of these at noon."""
    conditions, noons = condition_scenarios(), {}
    for name in conditions:
        noons.setdefault(scene_and_drive(name), NOON + name)
    return [*driving, *noons.values(), *conditions]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "condition_evaluation")
    parser.add_argument("--scenarios", nargs="*", default=all_scenarios(), help="files in config/scenarios; "
                        f"{NOON}NAME: the drive of NAME without its condition")
    parser.add_argument("--seed", type=int, default=130, help="seed of the scenes; their drives have the next two")
    parser.add_argument("--image-scale", type=float, default=0.5)
    parser.add_argument("--duration-s", type=float, default=12.0)
    return parser.parse_args()


class Condition:
    """A scenario's drive, and its noon map or None. Where a stage has no result, a remark says why."""

    def __init__(self, args, name):
        scene, driven = scene_and_drive(name.removeprefix(NOON))
        self.has_obstacle_truth = scene not in LAYERED
        duration_s = args.duration_s * TIMES_LONGER.get(scene, 1)
        size = ("--image-scale", args.image_scale, "--duration-s", duration_s)
        noon = ("--scene", scene, "--drive", MAP_DRIVES.get(driven, driven), "--scene-seed", args.seed)
        mapping = Drive(args.work, f"noon_{scene}_{driven}", *noon, "--seed", args.seed + 1, "--image-step", 2, *size)
        if name.startswith(NOON):
            self.drive = Drive(args.work, name, *noon[:2], "--drive", driven, "--scene-seed", args.seed, "--seed", args.seed + 2,
                               *size, "--truth-range")
        else:
            self.drive = scenario_drive(args.work, name, args.seed, args.image_scale, duration_s)
        self.masks = found_masks(args.work, scene)
        self.rig = self.masks.rig_of(self.drive.folder)
        path, _, run = mapping.map(self.masks.rig_of(mapping.folder))
        self.remarks = [self.masks.text(), *([f"map: {run.reason()}"] if run.error() else []), *self.log_remarks()]
        self.map = None if run.error() else Map(path, mapping.trajectory)
        self.badness, self.drawn = OBSTACLE_BOUND_M, False

    def log_remarks(self):
        """For a car without counters: what the driver's decoder makes of the log of its wheel speeds. The odometry in its bag is
        computed from the same speeds, by the same package."""
        log = self.drive.folder / "drive_can.log"
        if log.exists():
            run = run_tool_once("decode_can", self.drive.folder / "decode_can.log", "--log", log, "--layout",
                                CONFIG / "driver" / "simulated_car.yaml", may_fail=True)
            yield f"decode_can: {run.reason()}" if run.error() else (
                f"odometry from wheel speeds; decode_can reads {run.found['measurements']} of them, {run.found['distance_m']:.1f} m")

    def localization_figures(self):
        result, folder = None, self.drive.folder
        if self.map:
            output = folder / "localized.tum"
            run = run_tool_once("localize_drive", folder / "localized.log", "--bag", self.drive.bag, "--rig", self.rig, "--map",
                                self.map.path, "--options", CONFIG / "localization.yaml", "--output", output, may_fail=True)
            if run.error():
                self.remarks.append(f"localization: {run.reason()}")
            else:
                result = LocalizationErrors(f"{output}.csv", self.drive.trajectory, self.map)
        yield figure("frames localized", 100 * result.ratio() if result else 0.0, "%", at_least=90)
        yield figure("wrong poses reported as localized", result.num_false() if result else 0, equal=0)
        for name, which, goal in (("median", 50, 5), ("95 %", 95, None), ("worst", 100, None)):
            yield figure(f"position error (none: 50 cm), {name}",
                         100 * (result.quantile(result.error_m, which, BOUND_M) if result else BOUND_M), "cm", at_most=goal)
        yield Figure("heading error (none: 2 degrees), 95 %",
                     result.quantile(result.heading_deg, 95, BOUND_DEG) if result else BOUND_DEG, "degrees")

    def range_figures(self):
        known, right, spread = 0.0, 0.0, {"percentile_50": RANGE_BOUND, "percentile_95": RANGE_BOUND}
        try:
            judged = RangeErrors(self.drive, self.rig, "online_ranges", *AS_ON_THE_CAR).sets["all cameras"]
            known, spread = percent(judged["num_known"], judged["num_judged"]), judged["bounded_relative_error"]
            right = next(100 * one["fraction_within_tolerance"] for one in judged["accuracy"] if abs(one["density"] - 0.6) < 1e-6)
            self.range_words = ("--range", self.drive.folder / "online_ranges")
        except NoResult as error:
            self.remarks.append(f"ranges: {error}")
            self.range_words = ()
        yield Figure("pixels with a range", known, "%")
        yield figure("ranges within 5 % at 60 % density", right, "%", at_least=90)
        yield Figure("error over the range, all pixels (unknown: 50 %), median", 100 * spread["percentile_50"], "%")
        yield Figure("error over the range, 95 %", 100 * spread["percentile_95"], "%")

    def obstacle_figures(self):
        """None is reported where there are no maps: all rays are missed."""
        if not self.has_obstacle_truth:
            self.remarks.append("obstacles: not judged, since levels lie above one another")
            return
        found = None
        try:
            found = summary(judge_obstacles(self.drive, self.rig, *self.range_words))
            self.badness, self.drawn = found["mean_m"], True
        except NoResult as error:
            self.remarks.append(f"obstacles: {error}")
        yield figure("obstacles: range error within 5 m (missed: 50 cm), mean", 100 * self.badness, "cm", at_most=7)
        yield Figure("obstacles: range error, 95 %", 100 * (found["p95_m"] if found else OBSTACLE_BOUND_M), "cm")
        yield figure("obstacles missed", percent(found["missed"], found["obstacles"]) if found else 100.0, "%", at_most=0)
        for name in ("people", "cars"):
            moving = [entry for entry in found["classes"] if entry[:2] == [name, True]] if found else []
            reported, number = moving[0][2:] if moving else (0, 0)
            yield Figure(f"moving {name}: reported, of images that show them", percent(reported, number) if number else None, "%")
        yield figure("false cells per 10 m", found["false_per_10_m"] if found else 0.0, at_most=1.0)
        yield figure("cells inside obstacles that were free", found["free_inside"] if found else 0, equal=0)

    def figures(self):
        return [*self.localization_figures(), *self.range_figures(), *self.obstacle_figures(),
                Figure("remarks", "; ".join(self.remarks))]


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("conditions", "Conditions", args)
    for name in args.scenarios:
        say(name)
        condition = Condition(args, name)
        results.add(f"The causal chain in each condition, image scale {args.image_scale:g}, {args.duration_s:g} s",
                    (name, condition.figures()))
        if condition.drawn:
            results.show(draw_obstacles(condition.drive, condition.drive.folder / "obstacles"),
                         f"{name}: mean range error of obstacles {100 * condition.badness:.1f} cm. {OBSTACLE_LEGEND}",
                         condition.badness)
    results.end()


if __name__ == "__main__":
    main()
