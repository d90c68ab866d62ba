"""Height maps: heights, kerbs, steps, tape-measure distances, drivable cells, time and memory."""
import argparse
import pathlib
import sys

import cv2

from vcharge_evaluation.drives import LOOP_S, found_masks, loop_drive
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, judge, run, run_tool, say


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "height_map_evaluation")
    parser.add_argument("--scenes", nargs="*", default=["lot", "garage"])
    parser.add_argument("--seed", type=int, default=101,
                        help="seed of scene and drive; those below 100 serve to choose options")
    parser.add_argument("--duration-s", type=float, default=LOOP_S, help="of the scene's loop, with half of its images")
    parser.add_argument("--image-scale", type=float, default=1.0, help="image size over 1280x800")
    parser.add_argument("--options", type=pathlib.Path, default=CONFIG / "height_map.yaml")
    parser.add_argument("--true-poses", action="store_true", help="use the truth's poses in place of build_map's")
    return parser.parse_args()


def evaluate(args, scene):
    """Errors of a scene's height map, the run that made it, the folder of the drive, and its masks."""
    drive = loop_drive(args.work, scene, args.seed, args.image_scale, args.duration_s)
    folder, masks = drive.folder, found_masks(args.work, scene)
    rig = masks.rig_of(folder)
    trajectory = drive.trajectory if args.true_poses else drive.map(rig)[1]
    say(f"{folder}: height map")
    made = run_tool("build_height_map", folder / "height_map.log", "--bag", drive.bag, "--rig", rig, "--trajectory",
                    trajectory, "--options", args.options, "--output", folder / "height_map")
    errors = judge("height_map", folder / "report", "--map", folder / "height_map", "--truth", drive.truth, "--rig",
                   drive.true_rig, "--trajectory", trajectory)
    return errors, made, folder, masks


def kerb_figures(errors):
    """None where the scene has no kerbs."""
    if not errors["num_kerbs_seen"]:
        return
    mean_m = errors["kerb_height_m"]["mean"] if errors["num_kerbs"] else None
    yield figure("kerbs: mean error of the height", None if mean_m is None else 100 * mean_m, "cm", at_most=3)
    yield Figure("kerbs in the map", percent(errors["num_kerbs"], errors["num_kerbs_seen"]), "%")
    for reach_m in (3, 5):
        near = [abs(kerb["error_m"]) for kerb in errors["kerbs"] if kerb["nearest_view_m"] <= reach_m]
        if near:
            yield Figure(f"kerbs seen from {reach_m} m or nearer: mean error", 100 * sum(near) / len(near), "cm")


def drivability_figures(errors):
    yield Figure("faces over 30 cm seen from in front that are obstacles",
                 percent(errors["num_faces_blocked"], errors["num_faces"]), "%")
    yield Figure("open ground that is drivable", percent(errors["num_open_drivable"], errors["num_open_ground"]), "%")
    yield Figure("drivable cells inside things over 30 cm", percent(errors["num_drivable_inside"], errors["num_drivable"]),
                 "%")


def figures(errors, made):
    shown = len(errors["measurements"]) - errors["num_measurements_missing"]
    return [
        figure("mean height error of cells seen in 3 frames, apart from steps", 100 * errors["height_m"]["mean"], "cm",
               at_most=4),
        Figure("the same, 95 %", 100 * errors["height_m"]["percentile_95"], "cm"),
        Figure("the same, worst", 100 * errors["height_m"]["max"], "cm"),
        figure("cells within 10 cm", 100 * errors["fraction_within_10_cm"], "%", at_least=95),
        Figure("cells mapped", percent(errors["num_mapped"], errors["num_seen"]), "%"),
        *kerb_figures(errors),
        figure("steps: mean horizontal error", 100 * errors["step_position_m"]["mean"], "cm", at_most=5),
        figure("tape measures: mean error", 100 * errors["mean_measurement_m"], "cm", at_most=5),
        Figure("tape measures: largest error", 100 * errors["max_measurement_m"], "cm"),
        figure(f"tape measures shown, of {len(errors['measurements'])}", shown, at_least=20),
        *drivability_figures(errors["drivability"]),
        figure("peak memory", made.peak_gb, "GB", at_most=2.0),
        Figure("processor time", made.cpu_s, "s"),
        Figure("wall time", made.wall_s, "s"),
        *(Figure(f"wall time, {stage}", seconds, "s") for stage, seconds in made.found["stage_s"].items()),
    ]


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("height_map", "Height maps", args)
    poses = "true poses" if args.true_poses else "poses of build_map"
    for scene in args.scenes:
        errors, made, folder, masks = evaluate(args, scene)
        results.add(f"Height maps, {poses}, image scale {args.image_scale:g}",
                    (f"{scene}, seed {args.seed}", [*figures(errors, made), Figure("masks", masks.text())]))
        picture = folder / "height_map.png"
        run([sys.executable, "-m", "vcharge_evaluation.drawing.height_map", "--map", folder / "height_map", "--output", picture],
            folder / "draw.log")
        mean_m = errors["height_m"]["mean"]
        results.show(cv2.imread(str(picture)), f"{scene}, seed {args.seed}: mean height error {100 * mean_m:.1f} cm", mean_m)
    results.end()


if __name__ == "__main__":
    main()
