#!/usr/bin/env python3
"""What height maps reach, as a Markdown table: heights, kerbs, steps, tape-measure distances, time; see
evaluate_height_map.sh."""
import argparse
import json
import os
import pathlib
import re

from tool_runs import ROOT, TOOLS, mark, run, say, simulate


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/height_map_evaluation"),
                        help="folder for drives and maps; drives that are there are used again")
    parser.add_argument("--scenes", nargs="*", default=["lot", "garage"])
    parser.add_argument("--drive", default="loop")
    parser.add_argument("--seed", type=int, default=101, help="of scene and drive; below 100 is for choosing options")
    parser.add_argument("--duration-s", type=float, default=25.0)
    parser.add_argument("--image-scale", type=float, default=1.0, help="of the cameras' own size, 1280x800")
    parser.add_argument("--image-step", type=int, default=1)
    parser.add_argument("--options", type=pathlib.Path, default=ROOT / "config" / "height_map.yaml")
    parser.add_argument("--true-poses", action="store_true", help="the truth's poses in place of build_map's")
    return parser.parse_args()


def evaluate(args, scene):
    folder = args.work / f"{scene}_seed{args.seed}_scale{args.image_scale:g}_{args.duration_s:g}s"
    simulate(folder, ["--scene", scene, "--drive", args.drive, "--seed", args.seed, "--image-scale", args.image_scale,
                      "--image-step", args.image_step, "--duration-s", args.duration_s, "--height-cell-m", 0.025])
    bag, rig, truth = folder / "drive.bag", folder / "rig_truth.yaml", folder / "drive_truth"
    trajectory = truth / "trajectory.tum"
    if not args.true_poses:
        say(f"{folder}: mapping")
        trajectory = folder / "mapped.tum"
        run([TOOLS / "vcharge_mapping" / "build_map", "--bag", bag, "--rig", rig, "--output", folder / "lot.vmap",
             "--trajectory", trajectory, "--options", ROOT / "config" / "mapping.yaml"], folder / "build_map.log")
    say(f"{folder}: height map")
    made = run([TOOLS / "vcharge_dense" / "build_height_map", "--bag", bag, "--rig", rig, "--trajectory", trajectory,
                "--options", args.options, "--output", folder / "height_map"], folder / "height_map.log")
    print(f"\n### {scene}\n\n```\n{made['output']}```\n")
    result = run([TOOLS / "vcharge_evaluation" / "evaluate_height_map", "--map", folder / "height_map", "--truth", truth,
                  "--rig", rig, "--trajectory", trajectory, "--report", folder / "report"], folder / "evaluate.log")
    print(f"```\n{result['output']}```\n")
    return json.loads((folder / "report" / "height_map_errors.json").read_text()), made


def centimetres(value):
    return f"{100 * value:.1f} cm"


def kerb_text(errors):
    if not errors["num_kerbs_seen"]:
        return "the scene has none"
    text = f"{centimetres(errors['kerb_height_m']['mean'])} ({errors['num_kerbs']} of {errors['num_kerbs_seen']} places in the map"
    for reach in (3, 5):
        near = [abs(kerb["error_m"]) for kerb in errors["kerbs"] if kerb["nearest_view_m"] <= reach]
        if near:
            text += f"; seen from {reach} m or nearer: {centimetres(sum(near) / len(near))}, {len(near)} places"
    return text + ")"


def kerb_mark(errors):
    return mark(errors["num_kerbs"] > 0 and errors["kerb_height_m"]["mean"] <= 0.03) if errors["num_kerbs_seen"] else ""


def drivability_rows(errors):
    def percent(part, whole):
        return f"{100 * part / max(1, whole):.1f} %"

    faces = errors["num_faces"]
    yield ("drivable grid: faces of rigid things over 30 cm, seen from in front, that are obstacles (open)", "",
           f"{percent(errors['num_faces_blocked'], faces)} of {faces} places ({percent(len(errors['open_faces']), faces)})", "")
    yield ("open ground that is seen: drivable", "", percent(errors["num_open_drivable"], errors["num_open_ground"]), "")
    yield ("drivable cells inside of things over 30 cm", "",
           f"{percent(errors['num_drivable_inside'], errors['num_drivable'])} of {errors['num_drivable']}", "")
    yield ("solid cells, without a height (on open ground)", "", f"{errors['num_solid']} ({errors['num_solid_on_ground']})", "")


def stage_times(output):
    counts = re.search(r"^range maps: (\d+) .*\ngrid: (.*) in the frame", output, re.MULTILINE)
    times = re.findall(r"^([a-z ]+): ([0-9.]+) s$", output, re.MULTILINE)
    return f"{counts[1]} range maps, {counts[2]}: " + ", ".join(f"{stage} {time} s" for stage, time in times)


def table(scene, errors, made):
    height, steps = errors["height_m"], errors["step_position_m"]
    shown = len(errors["measurements"]) - errors["num_measurements_missing"]
    mapped = errors["num_mapped"] / max(1, errors["num_seen"])
    rows = [
        ("cells seen in 3 frames, apart from steps: mean error", "<= 4 cm", centimetres(height["mean"]),
         mark(height["mean"] <= 0.04)),
        ("within 10 cm", ">= 95 %", f"{100 * errors['share_within_10_cm']:.1f} % of the {100 * mapped:.0f} % mapped",
         mark(errors["share_within_10_cm"] >= 0.95)),
        ("kerbs: mean error of the height", "<= 3 cm", kerb_text(errors), kerb_mark(errors)),
        ("steps: mean horizontal error", "<= 5 cm",
         f"{centimetres(steps['mean'])} ({errors['num_steps_found']} of {errors['num_steps_mapped']} places)",
         mark(steps["mean"] <= 0.05)),
        ("tape measure: mean error of those that the map shows", "<= 5 cm",
         f"{centimetres(errors['mean_measurement_m'])} (largest {centimetres(errors['max_measurement_m'])}; shown: "
         f"{shown} of {len(errors['measurements'])})", mark(shown >= 20 and errors["mean_measurement_m"] <= 0.05)),
        *drivability_rows(errors["drivability"]),
        ("peak memory", "< 2 GB", f"{made['peak_gb']:.2f} GB", mark(made["peak_gb"] < 2.0)),
        ("all: processor time, wall time", "", f"{made['cpu_s']:.0f} s, {made['wall_s']:.0f} s", ""),
        ("of these, wall time", "", stage_times(made["output"]), ""),
    ]
    print(f"\nHeight map of the {scene}\n\n| what | goal | figure | reached |\n|---|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def main():
    args = arguments()
    os.makedirs(args.work, exist_ok=True)
    for scene in args.scenes:
        table(scene, *evaluate(args, scene))


if __name__ == "__main__":
    main()
