"""Mapping: accuracy, loops, time, memory, and how these grow with the length of a drive."""
import argparse
import math
import pathlib

import cv2
import numpy as np
import yaml

import vcharge
from vcharge_evaluation import tools
from vcharge_evaluation.drives import LOOP_STEP, Drive
from vcharge_evaluation.long_drives import Place, gray_levels, join
from vcharge_evaluation.poses import at_stamps, rotations, write_odometry
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, import_published_images, judge, simulate

MAX_ERROR_CM = {"mapping_two_levels": 15.0}
USUAL_MAX_ERROR_CM = 5.0
# Change of pitch and roll from frame to frame with which a vehicle leaves the plane, or stays in it.
LEAVES_PLANE_DEG, IN_PLANE_DEG = 0.2, 0.05
FRAMES_OF_MEMORY_GOAL, MEMORY_GOAL_GB = 1500, 4.0


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "mapping_evaluation")
    parser.add_argument("--scenarios", nargs="*", default=["mapping_lot", "mapping_garage", "mapping_two_levels"],
                        help="files in config/scenarios")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--image-scale", type=float, default=1.0)
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the drives early; 0: whole drives")
    parser.add_argument("--options", type=pathlib.Path, default=CONFIG / "mapping.yaml")
    parser.add_argument("--growth-seeds", nargs="*", type=int, default=list(range(301, 309)),
                        help="seeds of the lots that long drives are made of; none: growth is not measured")
    parser.add_argument("--growth-scale", type=float, default=0.25)
    parser.add_argument("--no-front", action="store_true", help="leave out the map of the front camera alone")
    parser.add_argument("--no-hash", action="store_true", help="leave out the second map, on one thread")
    return parser.parse_args()


class BuiltMap:
    """A map of FOLDER/drive.bag with its errors."""

    def __init__(self, folder, name, args, rig=None, prefix=()):
        report = folder / f"{name}_report"
        self.run = tools.build_map(folder, name, "--report", report, rig=rig, options=args.options, prefix=prefix)
        truth = folder / "drive_truth" / "trajectory.tum"
        trajectory = judge("trajectory", report, "--estimate", folder / f"{name}.tum", "--truth", truth)
        self.map = judge("map", report, "--map", folder / f"{name}.vmap", "--truth", truth)
        self.rmse_cm = 100 * trajectory["alignments"][2]["position_m"]["root_mean_square"]
        self.scale_percent = 100 * trajectory["scale_error"]
        self.frames_csv = report / "frames.csv"

    def hash(self):
        return self.run.found["content_hash"]

    def found_percent(self, key):
        """Keyframes that passed a known place and got a right loop edge; None if there were none to find."""
        count = self.map[key]
        return percent(count["num_found"], count["num_keyframes"]) if count["num_keyframes"] else None


def front_rig(folder):
    """A rig file with the front camera alone."""
    rig = yaml.safe_load((folder / "rig_truth.yaml").read_text())
    rig["cameras"] = {"front": rig["cameras"]["front"]}
    path = folder / "rig_front.yaml"
    path.write_text(yaml.safe_dump(rig))
    return path


def odometry_drift(folder):
    """Median drift (%) over the longest distance that is judged, and this distance (m)."""
    drift = judge("trajectory", folder / "odometry", "--estimate", folder / "odometry.tum", "--truth",
                  folder / "drive_truth" / "trajectory.tum")["drift"][-1]
    return drift["translation_percent"]["percentile_50"], drift["distance_m"]


def spatial_motions(folder, frames_csv):
    """How many frames were taken as motions in space, by the truth's change of pitch and roll since the frame before."""
    lines = [line.split(",") for line in frames_csv.read_text().splitlines()[1:]]
    stamps = np.array([float(line[0]) for line in lines])
    spatial = np.array([line[1] == "spatial" for line in lines])
    true_rotations = rotations(at_stamps(folder / "drive_truth" / "trajectory.tum", stamps)[:, 4:])
    steps = np.einsum("nji,njk->nik", true_rotations[:-1], true_rotations[1:])
    tilts = np.degrees(np.hypot(steps[:, 2, 0], steps[:, 2, 1]))
    for name, chosen in (("leaves the plane", tilts > LEAVES_PLANE_DEG), ("stays in the plane", tilts < IN_PLANE_DEG)):
        yield Figure(f"taken as spatial where the vehicle {name}", percent(spatial[1:][chosen].sum(), chosen.sum()), "%")


def drive_figures(scenario, folder, args, drive):
    """Figures of the whole map of a drive, and the map."""
    drive_s, num_frames = drive
    drift, over_m = odometry_drift(folder)
    whole = BuiltMap(folder, "lot", args)
    errors = whole.map
    figures = [
        Figure("drive's length", errors["truth_length_m"], "m"),
        Figure("drive's duration", drive_s, "s"),
        figure(f"drift of the odometry over {over_m:.0f} m", drift, "%", at_least=1.0),
        figure("trajectory error, SE(3)-aligned, RMSE", whole.rmse_cm, "cm",
               at_most=MAX_ERROR_CM.get(scenario, USUAL_MAX_ERROR_CM)),
        figure("scale error (absolute)", abs(whole.scale_percent), "%", at_most=0.1),
        Figure("accepted loop edges", errors["num_accepted"]),
        figure("wrong ones among them", errors["num_wrong"], equal=0),
        Figure("error of accepted edges, median", 100 * errors["accepted_m"]["percentile_50"], "cm"),
        Figure("error of accepted edges, 90 %", 100 * errors["accepted_m"]["percentile_90"], "cm"),
        figure("revisits with a right loop edge", whole.found_percent("revisits"), "%",
               at_least=80 if errors["revisits"]["num_keyframes"] else None),
        Figure("the same, in the same heading", whole.found_percent("same_heading"), "%"),
        Figure("the same, in the opposite heading", whole.found_percent("opposite_heading"), "%"),
        *spatial_motions(folder, whole.frames_csv),
        figure("wall time over the drive's", whole.run.wall_s / drive_s, at_most=1.0),
        Figure("processor time", whole.run.cpu_s, "s"),
        figure("peak memory", whole.run.peak_gb, "GB",
               at_most=MEMORY_GOAL_GB * max(1.0, num_frames / FRAMES_OF_MEMORY_GOAL)),
        Figure("verdict of the tool", whole.run.found["verdict"]),
    ]
    return whole, figures


def evaluate_drive(scenario, seed, args, is_first, results):
    name = f"{scenario}_seed{seed}_scale{args.image_scale:g}" + (f"_{args.duration_s:g}s" if args.duration_s else "")
    folder = args.work / name
    simulate(folder, ["--scenario", CONFIG / "scenarios" / f"{scenario}.yaml", "--seed", seed, "--scene-seed", seed,
                      "--image-scale", args.image_scale,
                      *(["--duration-s", args.duration_s] if args.duration_s else [])])
    drive = write_odometry(folder / "drive.bag", folder / "odometry.tum")
    whole, figures = drive_figures(scenario, folder, args, drive)
    if is_first and not args.no_hash:
        one = BuiltMap(folder, "lot_one_thread", args, prefix=("taskset", "-c", "0"))
        figures.append(figure("same content hash on one thread", one.hash() == whole.hash(), equal=True))
    if is_first and not args.no_front:
        front = BuiltMap(folder, "lot_front", args, rig=front_rig(folder))
        figures += [Figure("front camera alone: trajectory error, RMSE", front.rmse_cm, "cm"),
                    Figure("front camera alone: revisits with a right loop edge", front.found_percent("revisits"), "%"),
                    Figure("front camera alone: wrong loop edges", front.map["num_wrong"])]
    results.add(f"Maps of simulated drives, image scale {args.image_scale:g}", (f"{scenario}, seed {seed}", figures))
    results.show(cv2.imread(str(folder / "lot_report" / "map_errors_top_view.png")),
                 f"{scenario}, seed {seed}: root mean square error of the trajectory {whole.rmse_cm:.1f} cm", whole.rmse_cm)


def evaluate_real(args, results):
    """The published images of one camera against their given poses."""
    folder = args.work / "real"
    if not import_published_images(folder):
        return
    write_odometry(folder / "drive.bag", folder / "odometry.tum")
    tools.build_map(folder, "real", rig=folder / "rig.yaml", options=args.options)
    tools.run([tools.tool_path("draw_landmarks"), "--map", folder / "real.vmap", "--bag", folder / "drive.bag", "--camera", "left",
               "--output", folder / "landmarks.png"], folder / "draw.log")
    errors = judge("trajectory", folder / "report", "--estimate", folder / "real.tum", "--truth", folder / "odometry.tum")
    estimate = vcharge.read_trajectory(folder / "real.tum").rows
    given = at_stamps(folder / "odometry.tum", estimate[:, 0])
    lengths = [np.linalg.norm(np.diff(poses[:, 1:4], axis=0), axis=1).sum() for poses in (estimate, given)]
    rotation = math.degrees(errors["alignments"][1]["rotation_rad"]["max"])  # aligned at the first pose
    results.add("Map of the published images", ("one camera", [
        Figure("length of the path", lengths[0], "m"),
        figure("error of this length (absolute)", 100 * abs(lengths[0] / lengths[1] - 1), "%", at_most=2.0),
        figure("largest rotation error against the first pose", rotation, "degrees", at_most=1.0)]))


def linear_fit(lengths, values):
    """R2 of a straight line through the values."""
    line = np.polyval(np.polyfit(lengths, values, 1), lengths)
    return 1.0 - ((values - line) ** 2).sum() / ((values - np.mean(values)) ** 2).sum()


def evaluate_growth(args, results):
    """A drive through one, two, four, ... places, none of them twice, with mapping's time and memory over its length."""
    drives = [Drive(args.work, "growth", "--scene", "lot", "--drive", "loop", "--scene-seed", seed, "--seed", seed, "--image-step",
                    LOOP_STEP, "--image-scale", args.growth_scale) for seed in args.growth_seeds]
    lots = [Place(drive) for drive in drives]
    places = [lot.with_levels(levels) for levels in gray_levels() for lot in lots]
    columns, lengths, builds = [], [], []
    for count in [*(2**i for i in range(len(places).bit_length() - 1)), len(places)]:
        folder = args.work / "growth" / f"{count}_places"
        length_m, drive_s = join(places[:count], folder)
        build = tools.build_map(folder, "map", rig=drives[0].true_rig, options=args.options)
        lengths.append(length_m)
        builds.append(build)
        columns.append((f"{length_m:.0f} m", [
            Figure("duration", drive_s, "s"),
            Figure("keyframes", build.found["num_keyframes"]),
            figure("wall time over the drive's", build.wall_s / drive_s, at_most=1.0),
            Figure("processor time", build.cpu_s, "s"),
            *(Figure(f"wall time, {stage}", seconds, "s") for stage, seconds in build.found["stage_s"].items()),
            Figure("peak memory", build.peak_gb, "GB"),
            Figure("map file", (folder / "map.vmap").stat().st_size * 1e-6, "MB")]))
        (folder / "drive.bag").unlink()
    title = f"Growth with the drive, image scale {args.growth_scale:g}"
    results.add(title, *columns)
    results.add(f"{title}: linear fit over the length", ("R2", [
        figure("processor time", linear_fit(lengths, np.array([build.cpu_s for build in builds])), at_least=0.99),
        figure("peak memory", linear_fit(lengths, np.array([build.peak_gb for build in builds])), at_least=0.99)]))


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("mapping", "Mapping", args)
    for scenario in args.scenarios:
        for seed in args.seeds:
            evaluate_drive(scenario, seed, args, seed == args.seeds[0], results)
    evaluate_real(args, results)
    if args.growth_seeds:
        evaluate_growth(args, results)
    results.end()


if __name__ == "__main__":
    main()
