"""The simulator's fault drives through check_bag, localization and obstacle detection: what each reports and when, and
that no wrong pose is reported as localized and no cell inside an obstacle as free."""
import argparse
import collections
import csv

from vcharge_evaluation.drawing.moments import OBSTACLE_LEGEND, draw_obstacles
from vcharge_evaluation.drives import SCENARIOS, Drive, found_masks
from vcharge_evaluation.localization_errors import BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import CONFIG, judge, run_tool, say

# The fault needs the renderer: these drives cannot reuse the images of the sound drive.
RENDERED = ("motion_blur", "rolling_shutter", "sun_glare", "bright_lamps", "bumped_camera", "soft_suspension", "loaded_boot")
MAX_LISTED_STATES = 5


def all_faults():
    return sorted(path.stem[len("fault_"):] for path in SCENARIOS.glob("fault_*.yaml"))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "fault_evaluation")
    parser.add_argument("--faults", nargs="*", default=all_faults())
    parser.add_argument("--image-scale", type=float, default=0.5)
    parser.add_argument("--seed", type=int, default=120, help="seed of the scene; its drives have the next two")
    return parser.parse_args()


class Scene:
    """A part of the lot with its map, the masks of the car, and a drive through it with faults."""

    def __init__(self, args):
        self.args = args
        self.common = ["--scene-seed", args.seed, "--image-scale", args.image_scale]
        self.sound_words = ["--scene", "lot", "--drive", "short", *self.common]
        self.masks = found_masks(args.work, "lot")
        mapping = Drive(args.work, "fault_map", *self.sound_words, "--seed", args.seed + 1)
        path, _, run = mapping.map(self.masks.rig_of(mapping.folder))
        if run.error():
            raise RuntimeError(f"{path}: {run.error()}")
        self.mapped = Map(path, mapping.trajectory)
        self.sound = Drive(args.work, "fault_sound", *self.sound_words, "--seed", args.seed + 2, "--truth-range", "--noise", "off")

    def drive(self, fault):
        """The drive with a fault ("none": without), and the folder of its true ranges."""
        seed, reused = ["--seed", self.args.seed + 2], ["--images-from", self.sound.bag]
        if fault == "none":
            return Drive(self.args.work, "fault_none", *self.sound_words, *seed, *reused), self.sound.truth
        words = ["--scenario", SCENARIOS / f"fault_{fault}.yaml", *seed, *self.common]
        if fault in RENDERED:
            drive = Drive(self.args.work, f"fault_{fault}", *words, "--truth-range")
            return drive, drive.truth
        return Drive(self.args.work, f"fault_{fault}", *words, *reused), self.sound.truth


def check(folder):
    """check_bag's verdict, with the subjects that do not pass."""
    found = run_tool("check_bag", folder / "check.log", "--bag", folder / "drive.bag", "--rig", folder / "rig_truth.yaml",
                     may_fail=True).found
    subjects = [finding["subject"] for finding in found.get("findings", []) if finding["grade"] != "PASS"]
    return found.get("verdict", found.get("error")) + (f": {'; '.join(subjects)}" if subjects else "")


def localize(folder, scene):
    """Figures of localization, and how many poses were wrong."""
    result = run_tool("localize_drive", folder / "localize.log", "--bag", folder / "drive.bag", "--rig",
                      scene.masks.rig_of(folder), "--map", scene.mapped.path, "--options", CONFIG / "localization.yaml", "--output",
                      folder / "poses.tum", may_fail=True)
    if result.error():
        return [Figure("localization reports", result.reason())]
    errors = LocalizationErrors(folder / "poses.tum.csv", folder / "drive_truth" / "trajectory.tum", scene.mapped)
    states, last = [], None
    for time_s, status in zip(errors.time_s, errors.status):
        if status != last:
            states.append(f"{status} from {time_s - errors.time_s[0]:.1f} s")
            last = status
    if len(states) > MAX_LISTED_STATES:
        states = [f"{len(states)} changes of state"]
    warnings = [f"{one['num_frames']} frames: {one['text']}" for one in result.found["warnings"]]
    return [Figure("frames localized", 100 * errors.ratio(), "%"),
            Figure("position error of all frames (none: 50 cm), median",
                   100 * errors.quantile(errors.error_m, 50, BOUND_M), "cm"),
            Figure("position error, 95 %", 100 * errors.quantile(errors.error_m, 95, BOUND_M), "cm"),
            Figure("position error, worst", 100 * errors.quantile(errors.error_m, 100, BOUND_M), "cm"),
            figure("wrong poses reported as localized", errors.num_false(), equal=0),
            Figure("localization reports", "; ".join([*states, *warnings]))]


def obstacles(folder, truth, scene):
    output = folder / "obstacles"
    result = run_tool("detect_obstacles", folder / "obstacles.log", "--bag", folder / "drive.bag", "--rig",
                      scene.masks.rig_of(folder), "--options", CONFIG / "obstacles.yaml", "--range-options",
                      CONFIG / "dense_obstacles.yaml", "--output", output, may_fail=True)
    if result.error():
        return [Figure("obstacle detection reports", result.reason())]
    with open(output / "status.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    start_ns, seen = int(rows[0]["stamp_ns"]), collections.OrderedDict()
    for row in rows:
        for state in (row["state"], f"ground {row['ground_state']}"):
            if state not in ("mapping", "ground measured"):
                seen.setdefault((row["camera"], state), (int(row["stamp_ns"]) - start_ns) * 1e-9)
    reports = [f"{camera} {state} at {time_s:.1f} s" for (camera, state), time_s in seen.items()]
    if result.found["num_odometry_jumps"]:
        reports.append(f"{result.found['num_odometry_jumps']} odometry jumps")
    errors = judge("obstacles", folder / "obstacle_report", "--obstacles", output, "--truth", truth)
    judged = errors["map"]
    fused = next(scan for scan in errors["scans"] if scan["name"] == "fused")["all"]["error_m"]
    return [Figure("obstacles: range error within 5 m (missed: 50 cm), mean", 100 * fused["mean"], "cm"),
            Figure("obstacles: range error, 95 %", 100 * fused["percentile_95"], "cm"),
            figure("cells inside obstacles that were free", judged["free_inside"], equal=0),
            Figure("cells inside obstacles that were observed", judged["observed_inside"]),
            Figure("obstacle detection reports", "; ".join(reports) or "-")]


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("faults", "Faults", args)
    scene = Scene(args)
    for fault in ["none", *args.faults]:
        say(fault)
        drive, truth = scene.drive(fault)
        folder = drive.folder
        figures = [Figure("check_bag", check(folder)), *localize(folder, scene), *obstacles(folder, truth, scene)]
        results.add(f"Faults through the online path, image scale {args.image_scale:g}, {scene.masks.text()}", (fault, figures))
        means = [one.value for one in figures if one.name.startswith("obstacles: range error within")]
        if means:
            drive.truth = truth
            results.show(draw_obstacles(drive, folder / "obstacles"), f"{fault}: mean range error of obstacles {means[0]:.1f} cm. "
                         f"{OBSTACLE_LEGEND}", means[0])
    results.end()


if __name__ == "__main__":
    main()
