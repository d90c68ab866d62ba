#!/usr/bin/env python3
"""What mapping reaches, as a Markdown table: accuracy, loops, time, memory, growth; see evaluate_mapping.sh."""
import argparse
import json
import math
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
import rosbag
import yaml

from tool_runs import ROOT, TOOLS, mark, run, say, simulate

MAX_ERROR_M = {"mapping_two_levels": 0.15}  # else:
USUAL_MAX_ERROR_M = 0.05
# Change of pitch and roll from frame to frame.
LEAVES_PLANE_DEGREES, IN_PLANE_DEGREES = 0.2, 0.05
FRAMES_OF_MEMORY_GOAL, MEMORY_GOAL_GB = 1500, 4.0


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/mapping_evaluation"),
                        help="folder for drives and maps; drives that are there are used again")
    parser.add_argument("--scenarios", nargs="*", default=["mapping_lot", "mapping_garage", "mapping_two_levels"],
                        help="files in config/scenarios")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--image-scale", type=float, default=1.0)
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the drives early; 0: whole drives")
    parser.add_argument("--options", type=pathlib.Path, default=ROOT / "config" / "mapping.yaml")
    parser.add_argument("--growth-s", type=float, default=12.0,
                        help="shortest of the three drives over which growth is measured; 0: not measured")
    parser.add_argument("--growth-scale", type=float, default=0.25)
    parser.add_argument("--no-front", action="store_true", help="not with the front camera alone")
    parser.add_argument("--no-hash", action="store_true", help="not a second time on one thread")
    parser.add_argument("--keep-maps", action="store_true", help="take maps that are there, with their times")
    return parser.parse_args()


def poses_of_odometry(bag_path, path):
    """Writes the odometry of a bag as TUM text; returns the drive's time and its number of stamps with images."""
    stamps = set()
    with rosbag.Bag(str(bag_path)) as bag, open(path, "w", encoding="utf-8") as file:
        for topic, message, _ in bag.read_messages():
            if topic == "/odom":
                p, q, s = message.pose.pose.position, message.pose.pose.orientation, message.header.stamp
                file.write(f"{s.secs}.{s.nsecs:09d} {p.x} {p.y} {p.z} {q.x} {q.y} {q.z} {q.w}\n")
            elif topic.endswith("/image_raw"):
                stamps.add(message.header.stamp.to_nsec())
    return (max(stamps) - min(stamps)) * 1e-9, len(stamps)


def build_map(folder, name, rig, args, prefix=()):
    """Builds a map and judges it; all figures as a dictionary, also kept beside the map."""
    kept = folder / f"{name}.json"
    if args.keep_maps and kept.exists():
        say(f"{folder}: map {name} taken as it is")
        return json.loads(kept.read_text())
    say(f"{folder}: building the map {name}")
    output, trajectory = folder / f"{name}.vmap", folder / f"{name}.tum"
    figures = run([*prefix, TOOLS / "vcharge_mapping" / "build_map", "--bag", folder / "drive.bag", "--rig", rig,
                   "--output", output, "--trajectory", trajectory, "--options", args.options,
                   "--report", folder / f"{name}_report"], folder / f"{name}.log")
    truth, report = folder / "drive_truth" / "trajectory.tum", folder / f"{name}_report"
    run([TOOLS / "vcharge_evaluation" / "evaluate_trajectory", "--estimate", trajectory, "--truth", truth,
         "--report", report], folder / f"{name}_trajectory.log")
    run([TOOLS / "vcharge_evaluation" / "evaluate_map", "--map", output, "--truth", truth, "--report", report],
        folder / f"{name}_map.log")
    errors = json.loads((report / "trajectory_errors.json").read_text())
    figures["rmse_m"] = errors["alignments"][2]["position_m"]["root_mean_square"]
    figures["scale_error"] = errors["scale_error"]
    figures["map"] = json.loads((report / "map_errors.json").read_text())
    for key in ("edges", "keyframes", "landmarks", "truth_path"):
        del figures["map"][key]
    figures["hash"] = re.search(r"^content hash: (\S+)$", figures["output"], re.M).group(1)
    figures["motions"] = re.search(r"^motions: (.*)$", figures["output"], re.M).group(1)
    figures["verdict"] = re.search(r"^verdict: (.*)$", figures["output"], re.M).group(1)
    kept.write_text(json.dumps(figures, indent=1))
    return figures


def front_rig(folder):
    """A rig file with the front camera alone."""
    rig = yaml.safe_load((folder / "rig_truth.yaml").read_text())
    rig["cameras"] = {"front": rig["cameras"]["front"]}
    path = folder / "rig_front.yaml"
    path.write_text(yaml.safe_dump(rig))
    return path


def drift_percent(folder):
    """Of the odometry over the longest distance that is judged: median and distance."""
    run([TOOLS / "vcharge_evaluation" / "evaluate_trajectory", "--estimate", folder / "odometry.tum", "--truth",
         folder / "drive_truth" / "trajectory.tum", "--report", folder / "odometry"], folder / "odometry.log")
    drift = json.loads((folder / "odometry" / "trajectory_errors.json").read_text())["drift"][-1]
    return drift["translation_percent"]["percentile_50"], drift["distance_m"]


def rotations(poses):
    x, y, z, w = poses[:, 4:].T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def planar_failure(folder):
    """Shares of the frames that were taken as motions in space, by the truth's change of pitch and roll since the frame
    before."""
    lines = (folder / "lot_report" / "frames.csv").read_text().splitlines()[1:]
    stamps = np.array([float(line.split(",")[0]) for line in lines])
    spatial = np.array([line.split(",")[1] == "spatial" for line in lines])
    truth = np.loadtxt(folder / "drive_truth" / "trajectory.tum")
    true_rotations = rotations(truth[[np.abs(truth[:, 0] - stamp).argmin() for stamp in stamps]])
    steps = np.einsum("nji,njk->nik", true_rotations[:-1], true_rotations[1:])
    tilts = np.degrees(np.hypot(steps[:, 2, 0], steps[:, 2, 1]))
    texts = []
    for name, chosen in ((f"> {LEAVES_PLANE_DEGREES:g} degrees", tilts > LEAVES_PLANE_DEGREES),
                         (f"< {IN_PLANE_DEGREES:g} degrees", tilts < IN_PLANE_DEGREES)):
        texts.append(f"{name}: {spatial[1:][chosen].sum()} of {chosen.sum()}")
    return "; ".join(texts)


def share(count):
    return f"{count['num_found']} of {count['num_keyframes']}" + (
        f" ({100 * count['share']:.1f} %)" if count["num_keyframes"] else "")


def evaluate_drive(scenario, seed, args, is_first):
    name = f"{scenario}_seed{seed}_scale{args.image_scale:g}" + (f"_{args.duration_s:g}s" if args.duration_s else "")
    folder = args.work / name
    words = ["--scenario", ROOT / "config" / "scenarios" / f"{scenario}.yaml", "--seed", seed, "--scene-seed", seed,
             "--image-scale", args.image_scale]
    if args.duration_s:
        words += ["--duration-s", args.duration_s]
    simulate(folder, words)
    drive_s, num_frames = poses_of_odometry(folder / "drive.bag", folder / "odometry.tum")
    drift, over_m = drift_percent(folder)
    whole = build_map(folder, "lot", folder / "rig_truth.yaml", args)
    judged = whole["map"]
    bound_m = MAX_ERROR_M.get(scenario, USUAL_MAX_ERROR_M)
    rows = [
        ("drive", "", f"{judged['truth_length_m']:.0f} m, {drive_s:.0f} s, {num_frames} frames", ""),
        ("odometry's drift", ">= 1 %", f"{drift:.2f} % over {over_m:.0f} m", mark(drift >= 1.0)),
        ("trajectory error, SE(3)-aligned, RMSE", f"<= {100 * bound_m:.0f} cm", f"{100 * whole['rmse_m']:.2f} cm",
         mark(whole["rmse_m"] <= bound_m)),
        ("scale error", "<= 0.1 %", f"{100 * whole['scale_error']:+.3f} %", mark(abs(whole["scale_error"]) <= 0.001)),
        ("loop edges accepted, of these wrong", "0 wrong", f"{judged['num_accepted']}, {judged['num_wrong']}",
         mark(judged["num_wrong"] == 0)),
        ("error of accepted edges, median, 90 %", "", f"{100 * judged['accepted_m']['percentile_50']:.1f} cm, "
         f"{100 * judged['accepted_m']['percentile_90']:.1f} cm", ""),
        ("revisits that got a right edge", ">= 80 %", share(judged["revisits"]),
         mark(judged["revisits"]["share"] >= 0.8) if judged["revisits"]["num_keyframes"] else "none to find"),
        ("of these in the same heading", "", share(judged["same_heading"]), ""),
        ("in the opposite heading", "", share(judged["opposite_heading"]), ""),
        ("in the opposite heading alone", "", share(judged["only_opposite_heading"]), ""),
        ("motions", "", whole["motions"], ""),
        ("taken as spatial: where the vehicle leaves the plane; where it does not", "failure detected",
         planar_failure(folder), ""),
        ("time over the drive's; processor time", "<= 1", f"{whole['wall_s']:.0f} s / {drive_s:.0f} s = "
         f"{whole['wall_s'] / drive_s:.2f}; {whole['cpu_s']:.0f} s", mark(whole["wall_s"] <= drive_s)),
        ("peak memory", f"< {MEMORY_GOAL_GB:g} GB for {FRAMES_OF_MEMORY_GOAL} frames", f"{whole['peak_gb']:.2f} GB",
         mark(whole["peak_gb"] < MEMORY_GOAL_GB * max(1.0, num_frames / FRAMES_OF_MEMORY_GOAL))),
        ("verdict of the report", "", whole["verdict"], ""),
    ]
    if is_first and not args.no_hash:
        one = build_map(folder, "lot_one_thread", folder / "rig_truth.yaml", args, prefix=("taskset", "-c", "0"))
        rows.append(("content hash on one thread", "equal", whole["hash"][:8], mark(one["hash"] == whole["hash"])))
    if is_first and not args.no_front:
        front = build_map(folder, "lot_front", front_rig(folder), args)
        rows.append(("front camera alone: revisits with a right edge; in the opposite heading; wrong edges", "",
                     f"{share(front['map']['revisits'])}; {share(front['map']['opposite_heading'])}; "
                     f"{front['map']['num_wrong']}", ""))
        rows.append(("front camera alone: RMSE", "", f"{100 * front['rmse_m']:.1f} cm", ""))
    return f"{scenario}, seed {seed}", rows


def evaluate_real(args):
    """The published images with one camera: rows, or None where they are not there."""
    data = os.environ.get("VCHARGE_DATA")
    if not data:
        return None
    folder = args.work / "real"
    folder.mkdir(parents=True, exist_ok=True)
    run([TOOLS / "vcharge_ros" / "import_vcharge_images", "--folder", pathlib.Path(data) / "vcharge_left", "--output",
         folder / "drive.bag", "--rig", folder / "rig.yaml"], folder / "import.log")
    poses_of_odometry(folder / "drive.bag", folder / "odometry.tum")
    run([TOOLS / "vcharge_mapping" / "build_map", "--bag", folder / "drive.bag", "--rig", folder / "rig.yaml",
         "--output", folder / "real.vmap", "--trajectory", folder / "real.tum", "--options", args.options],
        folder / "build.log")
    run([TOOLS / "vcharge_mapping" / "draw_landmarks", "--map", folder / "real.vmap", "--bag", folder / "drive.bag",
         "--camera", "left", "--output", folder / "landmarks.png"], folder / "draw.log")
    run([TOOLS / "vcharge_evaluation" / "evaluate_trajectory", "--estimate", folder / "real.tum", "--truth",
         folder / "odometry.tum", "--report", folder / "report"], folder / "evaluate.log")
    report = json.loads((folder / "report" / "trajectory_errors.json").read_text())
    estimate, given = np.loadtxt(folder / "real.tum"), np.loadtxt(folder / "odometry.tum")
    given = given[[np.abs(given[:, 0] - stamp).argmin() for stamp in estimate[:, 0]]]
    lengths = [np.linalg.norm(np.diff(poses[:, 1:4], axis=0), axis=1).sum() for poses in (estimate, given)]
    error = lengths[0] / lengths[1] - 1
    degrees = math.degrees(report["alignments"][1]["rotation_rad"]["max"])  # aligned at the first pose
    return "real images (data/vcharge_left, one camera)", [
        ("length of the path", "within 2 %", f"{lengths[0]:.2f} m, {100 * error:+.2f} %", mark(abs(error) <= 0.02)),
        ("rotation against the first pose, most", "<= 1 degree", f"{degrees:.2f} degrees", mark(degrees <= 1.0)),
        ("landmarks over an image", "", str(folder / "landmarks.png"), "")]


def evaluate_growth(args):
    """The lot's loop, of which no part is a loop, to once, twice and four times a length."""
    rows, first = [], None
    for times in (1, 2, 4):
        folder = args.work / f"growth_{args.growth_s:g}s_x{times}_scale{args.growth_scale:g}"
        simulate(folder, ["--scene", "lot", "--drive", "loop", "--image-scale", args.growth_scale, "--duration-s",
                          times * args.growth_s])
        figures = build_map(folder, "lot", folder / "rig_truth.yaml", args)
        first = first or figures
        ratios = [figures[key] / first[key] for key in ("cpu_s", "wall_s", "peak_gb")]
        # By keyframes: a drive begins slowly. A tenth more than linear is the scatter of such short runs.
        keyframes = figures["map"]["num_keyframes"] / first["map"]["num_keyframes"]
        rows.append((f"{times} x {args.growth_s:g} s: {figures['map']['truth_length_m']:.0f} m, "
                     f"{figures['map']['num_keyframes']} keyframes (x {keyframes:.2f}), "
                     f"{figures['map']['revisits']['num_keyframes']} revisits",
                     "no worse than linear", f"{figures['cpu_s']:.1f} s of processor (x {ratios[0]:.2f}), "
                     f"{figures['wall_s']:.1f} s (x {ratios[1]:.2f}), {figures['peak_gb']:.2f} GB (x {ratios[2]:.2f})",
                     mark(max(ratios[0], ratios[2]) <= 1.1 * keyframes) if times > 1 else ""))
    return f"growth at {args.growth_scale:g} of the resolution", rows


def table(title, rows):
    lines = [f"### {title}", "", "| what | goal | figure | reached |", "|---|---|---|---|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    commit = subprocess.run(["git", "-C", str(ROOT), "describe", "--always", "--dirty"], capture_output=True, text=True,
                            check=False).stdout.strip()
    parts = [f"Mapping at {args.image_scale:g} of 1280x800, code {commit}, {os.cpu_count()} cores, options "
             f"{args.options.name}.\n"]

    def add(part):
        if part is not None:
            parts.append(table(*part))
            (args.work / "table.md").write_text("\n".join(parts))
            print(parts[-1], flush=True)

    print(parts[0])
    for scenario in args.scenarios:
        for seed in args.seeds:
            add(evaluate_drive(scenario, seed, args, seed == args.seeds[0]))
    add(evaluate_real(args))
    if args.growth_s > 0:
        add(evaluate_growth(args))
    say(f"written: {args.work / 'table.md'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
