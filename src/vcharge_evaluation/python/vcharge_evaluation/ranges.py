"""Range maps: accuracy at fixed density, and whether standard deviation and confidence are honest."""
import argparse

import yaml

from vcharge_evaluation.drawing.moments import draw_range_map
from vcharge_evaluation.drives import Drive, found_masks, other_day_drive
from vcharge_evaluation.results import Figure, Results, add_arguments, calibration_figures, figure, percent
from vcharge_evaluation.tools import CONFIG, NoResult, judge, run_tool_once, say

DENSITIES = (0.4, 0.6, 0.8)
AS_ON_THE_CAR = ("--online", "--options", CONFIG / "dense_obstacles.yaml")
TRUE_POSES = {
              "pose_noise": {"scale": 0.0, "translation_m": 0.001, "translation_m_per_sqrt_m": 0.0, "rotation_rad": 0.0002,
                             "rotation_rad_per_sqrt_m": 0.0}}
# Name: preset, options of the plane sweep.
SETTINGS = {
    "fast": ("fast", {}),
    "default": ("default", {}),
    "accurate": ("accurate", {}),
    "filled from two levels": ("default", {"num_fill_levels": 2}),
    "all planes": ("default", {"coarse_pass": False}),
}
# Sweeps that do not remember the last range map: what they search instead, and their options.
FORGETFUL = {"a coarse pass": {}, "all planes": {"coarse_pass": False}}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "range_evaluation")
    parser.add_argument("--parts", nargs="*", default=["drive"], choices=["drive", "settings", "other_day", "online", "remembering"],
                        help="drive: four cameras on 4 s in a lot; settings: two cameras on 1.7 s each in lot and garage; "
                        "other_day: four cameras by camera and distance; online: the same as on the car, causal, with its options; "
                        "remembering: what the sweep that remembers loses against sweeps that do not")
    parser.add_argument("--drives", nargs="*", default=["lot:5", "garage:6"], help="scene:seed of the other parts' drives")
    parser.add_argument("--duration-s", type=float, default=1.7, help="duration of these drives")
    parser.add_argument("--image-scale", type=float, default=1.0, help="image size of the drives of another day over 1280x800")
    return parser.parse_args()


class RangeErrors:
    """Range maps of a drive with a rig file, and their errors, by camera and over "all cameras"; `sound` is a drive with the
    true ranges, if not this one."""

    def __init__(self, drive, rig, name, *words, sound=None):
        self.drive, self.output, sound = drive, drive.folder / name, sound or drive
        say(f"{drive.folder}: {name}")
        self.run = run_tool_once("compute_range_maps", drive.folder / f"{name}.log", "--bag", drive.bag, "--rig",
                                 rig, "--output", self.output, "--no-pictures", *words, may_fail=True)
        if self.run.error():
            raise NoResult(self.run.reason())
        errors = judge("range", drive.folder / f"{name}_report", "--range", self.output, "--truth", sound.truth, "--bag",
                       sound.bag, "--rig", sound.true_rig)
        self.sets = {one["label"]: one for one in errors["sets"]}

    def figures(self, label="all cameras"):
        errors = self.sets[label]
        at = {round(entry["density"], 3): entry["fraction_within_tolerance"] for entry in errors["accuracy"]}
        yield Figure("pixels with a range", percent(errors["num_known"], errors["num_judged"]), "%")
        for density in DENSITIES:
            yield Figure(f"within 5 % of the truth, at {100 * density:.0f} % density", 100 * at[density], "%")
        yield from relative_errors(errors)
        yield Figure("within one standard deviation", 100 * errors["fraction_within_one_sigma"], "%")
        yield Figure("within two standard deviations", 100 * errors["fraction_within_two_sigma"], "%")

    def near_figures(self, label):
        """Ranges of what is nearer than 4 m, and how long it stays without."""
        near = self.sets[label]["near"]
        yield Figure("nearer than 4 m: known", 100 * near["fraction_known"], "%")
        yield Figure("nearer than 4 m: unknown for over 5 range maps", percent(near["num_gap_cells"], near["num_cells"]), "%")
        yield Figure("nearer than 4 m: longest gap", near["longest_gap"], "range maps")

    def distance_figures(self):
        """By true distance: unknown ranges count as wrong."""
        for one in self.sets["all cameras"]["by_truth"]:
            if one["num_judged"]:
                name = f"from {one['low']:g} to {min(one['high'], 20):g} m"
                yield Figure(f"{name}: pixels with a range", percent(one["count"], one["num_judged"]), "%")
                yield Figure(f"{name}: within 5 %", percent(one["fraction_within_tolerance"] * one["count"],
                                                            one["num_judged"]), "%")

    def processor_ms(self):
        return 1000 * self.run.cpu_s / self.sets["all cameras"]["num_frames"]


def relative_errors(errors):
    """Errors over all pixels that were judged."""
    spread = errors["bounded_relative_error"]
    yield Figure("error over the range, all pixels (unknown: 50 %), median", 100 * spread["percentile_50"], "%")
    yield Figure("the same, 95 %", 100 * spread["percentile_95"], "%")
    yield Figure("the same, worst", 100 * spread["max"], "%")


def other_day_drives(args):
    """Scene, seed, drive and masks of each of the drives, on another day."""
    for drive in args.drives:
        scene, seed = drive.split(":")
        yield (scene, seed, other_day_drive(args.work, scene, int(seed), args.image_scale, args.duration_s),
               found_masks(args.work, scene))


def evaluate_other_day(args, results):
    """All cameras on another day, by camera, by distance and by confidence."""
    for scene, seed, made, masks in other_day_drives(args):
        errors = RangeErrors(made, masks.rig_of(made.folder), "ranges")
        size = f"image scale {args.image_scale:g}"
        results.add(f"By camera, {size}", *((f"{scene} {seed}, {label}", [
            figure("pixels with a range", percent(one["num_known"], one["num_judged"]), "%", at_least=70),
            *list(errors.figures(label))[1:], Figure("masks", masks.text())]) for label, one in errors.sets.items()))
        results.add(f"By distance, {size}", (f"{scene} {seed}", list(errors.distance_figures())))
        results.add(f"Confidence against ranges within 10 %, {size}",
                    (f"{scene} {seed}", calibration_figures(errors.sets["all cameras"]["calibration"])))
        worst = max((label for label in errors.sets if label != "all cameras"),
                    key=lambda label: errors.sets[label]["bounded_relative_error"]["mean"])
        badness = errors.sets[worst]["bounded_relative_error"]["mean"]
        results.show(draw_range_map(errors.drive.bag, errors.output, worst),
                     f"{scene}, seed {seed}, camera {worst}: mean error {100 * badness:.1f} % of the range (unknown: 50 %). Image "
                     "and ranges, red near, blue far, black unknown", badness)


def evaluate_online(args, results):
    """All cameras as on the car: from earlier images only, with the options of the obstacles' launch file."""
    for scene, seed, made, masks in other_day_drives(args):
        errors = RangeErrors(made, masks.rig_of(made.folder), "online", *AS_ON_THE_CAR)
        results.add(f"On the car, image scale {args.image_scale:g}",
                    *((f"{scene} {seed}, {label}", [*errors.figures(label), *errors.near_figures(label)])
                      for label in errors.sets if label != "all cameras"))


def evaluate_remembering(args, results):
    """Range maps as on the car against those of sweeps that search every range map in full."""
    options = yaml.safe_load((CONFIG / "dense_obstacles.yaml").read_text())
    for scene, seed, made, masks in other_day_drives(args):
        rig = masks.rig_of(made.folder)
        found = RangeErrors(made, rig, "online", *AS_ON_THE_CAR)
        for name, sweep in FORGETFUL.items():
            path = made.folder / f"{name.replace(' ', '_')}.yaml"
            path.write_text(yaml.safe_dump({**options, "remember": False,
                                            "plane_sweep": {**options.get("plane_sweep", {}), **sweep}}))
            other = RangeErrors(made, rig, f"online_{path.stem}", "--online", "--options", path)
            results.add(f"Remembering against {name}, image scale {args.image_scale:g}",
                        *((f"{scene} {seed}, {label}", list(losses(found, other, label))) for label in found.sets))


def losses(found, other, label):
    """Relative differences of the figures that are better the larger they are; None where the other sweep has nothing."""
    before = {one.name: one.value for one in other.figures(label)}
    for one in found.figures(label):
        if one.name.startswith(("pixels with", "within 5 %")):
            reference = before[one.name]
            yield figure(one.name, 100 * (one.value / reference - 1) if reference else None, "%", at_least=-3)


def evaluate_drive(args, results):
    drive, masks = Drive(args.work, "short", "--scene", "lot", "--drive", "short", "--truth-range"), found_masks(args.work, "lot")
    rig = masks.rig_of(drive.folder)
    odometry = RangeErrors(drive, rig, "odometry")
    true = RangeErrors(drive, rig, "truth", "--cameras", "front", "left", "--trajectory", drive.trajectory)
    results.add("Range maps of a simulated lot", *((f"{poses}, {label}", errors.figures(label)) for poses, errors in
                                                   (("odometry", odometry), ("true poses, refined", true))
                                                   for label in errors.sets))


def evaluate_settings(args, results):
    drives = []
    for drive in args.drives:
        scene, seed = drive.split(":")
        made = Drive(args.work, f"{scene}_figure_eight", "--scene", scene, "--drive", "figure_eight", "--seed", seed,
                     "--duration-s", args.duration_s, "--cameras", "front", "left", "--truth-range")
        masks = found_masks(args.work, scene)
        drives += [(f"{scene}, true poses", made, masks, True), (f"{scene}, odometry", made, masks, False)]
    for title, made, masks, true_poses in drives:
        columns = []
        for number, (setting, (preset, overrides)) in enumerate(SETTINGS.items()):
            name = f"setting{number}_{'true' if true_poses else 'odometry'}"
            options = made.folder / f"{name}.yaml"
            options.write_text(yaml.safe_dump({"plane_sweep": {**overrides, **(TRUE_POSES if true_poses else {})}}))
            poses = ["--trajectory", made.trajectory] if true_poses else []
            errors = RangeErrors(made, masks.rig_of(made.folder), name, "--preset", preset, "--options", options, *poses)
            columns.append((setting, [*errors.figures(), Figure("processor time per range map", errors.processor_ms(),
                                                                "ms")]))
            if setting == "default":
                bins = [entry for entry in errors.sets["all cameras"]["by_confidence"] if entry["count"]]
        results.add(f"Settings, {title}", *columns)
        results.add(f"Within 5 % of the truth by confidence, {title}", ("default", [
            Figure(f"confidence {entry['low']:g} to {entry['high']:g}", 100 * entry["fraction_within_tolerance"], "%")
            for entry in bins]))


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("ranges", "Range maps", args)
    for part in args.parts:
        globals()[f"evaluate_{part}"](args, results)
    results.end()


if __name__ == "__main__":
    main()
