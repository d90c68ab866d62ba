"""Localization on another day: errors, consistency, time, starts without a prior, single cameras, and disturbances."""
import argparse
import pathlib

import cv2
import numpy as np

from vcharge_evaluation import consistency
from vcharge_evaluation.drives import SCENARIOS, Drive, found_masks, loop_drive, other_day_drive
from vcharge_evaluation.localization_errors import BOUND_DEG, BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, run_tool_once, say

FRAMES_OF_START = 5
START_EVERY = 10
MIN_FRAMES_OF_CONSISTENCY = 10  # fewer scatter too much for a goal
COVERED_S = (20.0, 30.0)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "mapping_evaluation")
    parser.add_argument("--scenes", nargs="*", default=["lot", "garage"])
    parser.add_argument("--seed", type=int, default=1, help="seed of the scene and its mapping drive; other days: 100 more")
    parser.add_argument("--image-scale", type=float, default=1.0)
    parser.add_argument("--map-duration-s", type=float, default=0.0, help="end mapping drives early; 0: whole drives")
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the other drives early; 0: whole drives")
    parser.add_argument("--options", type=pathlib.Path, default=CONFIG / "localization.yaml")
    parser.add_argument("--loops", action="store_true", help="map the scenes' loops, and localize on another day in these")
    parser.add_argument("--consistency", type=int, default=0, metavar="N",
                        help="only compare covariances with errors, over N short drives in the map of each scene's loop")
    parser.add_argument("--no-opposite", action="store_true", help="leave out drives against a mapped loop's direction")
    parser.add_argument("--no-experiments", action="store_true", help="leave out disturbances, starts and single cameras")
    return parser.parse_args()


def drive(args, scenario, seed, duration_s):
    return Drive(args.work, scenario, "--scenario", SCENARIOS / f"{scenario}.yaml", "--seed", seed, "--scene-seed", args.seed,
                 "--image-scale", args.image_scale, *(["--duration-s", duration_s] if duration_s else []))


def map_of(made, masks):
    """The map of a mapping drive. RuntimeError if there is none."""
    path, _, run = made.map(masks.rig_of(made.folder))
    if run.error():
        raise RuntimeError(f"{path}: {run.error()}")
    return Map(path, made.trajectory)


class Localization(LocalizationErrors):
    """A drive that was localized in a map with the masks of `mapped`, and its errors."""

    def __init__(self, args, made, mapped, name, *words):
        output = made.folder / f"{name}.tum"
        say(f"{made.folder}: {name}")
        self.run = run_tool_once("localize_drive", made.folder / f"{name}.log", "--bag", made.bag, "--rig",
                                 mapped.masks.rig_of(made.folder), "--map", mapped.path, "--options", args.options, "--output",
                                 output, *words)
        super().__init__(f"{output}.csv", made.trajectory, mapped)


def other_day_figures(result, min_percent):
    def centimetres(errors_m, which):
        return 100 * result.quantile(errors_m, which, BOUND_M)

    consistency, num_frames = result.consistency() if result.localized().any() else (None, 0)
    latency_ms = 1e3 * np.percentile(result.latency_s, [50, 95])
    return [
        Figure("frames", len(result.status)),
        figure("frames localized", 100 * result.ratio(), "%", at_least=min_percent),
        figure("position relative to the map, all frames (none: 50 cm), median", centimetres(result.error_m, 50), "cm",
               at_most=3),
        figure("position relative to the map, 95 %", centimetres(result.error_m, 95), "cm", at_most=8),
        Figure("position relative to the map, worst", centimetres(result.error_m, 100), "cm"),
        figure("heading, all frames (none: 2 degrees), median", result.quantile(result.heading_deg, 50, BOUND_DEG), "degrees",
               at_most=0.05),
        figure("heading, 95 %", result.quantile(result.heading_deg, 95, BOUND_DEG), "degrees", at_most=0.2),
        Figure("heading, worst", result.quantile(result.heading_deg, 100, BOUND_DEG), "degrees"),
        figure("absolute position, median", centimetres(result.absolute_m, 50), "cm", at_most=5),
        figure("localized, but over 0.5 m or 2 degrees off", result.num_false(), equal=0),
        figure(f"normalized error squared per degree of freedom ({num_frames} frames)", consistency,
               **(dict(at_least=0.5, at_most=2.0) if num_frames >= MIN_FRAMES_OF_CONSISTENCY else {})),
        Figure("time of a frame, median", float(latency_ms[0]), "ms"),
        figure("time of a frame, 95 %", float(latency_ms[1]), "ms", at_most=120),
        Figure("processor time of a frame", 1e3 * result.run.cpu_s / len(result.status), "ms"),
        figure("map ready after", result.run.found["map_ready_s"], "s", at_most=2.0),
    ]


def start_figures(results):
    """Starts without a prior: a right pose must be found within a few frames."""
    found = tried = 0
    for result in results:
        right = result.localized() & (result.error_m < 0.5) & (result.error_deg < 2.0)
        for begin in range(0, len(result.status) - FRAMES_OF_START + 1, START_EVERY):
            tried += 1
            found += bool(right[begin:begin + FRAMES_OF_START].any())
    return [Figure("starts", tried), figure("right pose within 5 frames", percent(found, tried), "%", at_least=95),
            figure("wrong frames", sum(result.num_false() for result in results), equal=0)]


def disturbance_figures(args, folder, mapped):
    begin_s, end_s = COVERED_S
    covered = Localization(args, folder, mapped, "covered", "--cover-s", begin_s, end_s)
    since_s = covered.time_s - covered.time_s[0]
    dark = (since_s >= begin_s) & (since_s < end_s)
    bridged = dark & covered.has_pose
    worst_m = float(np.max(covered.error_m[bridged])) if bridged.any() else None
    ratio = float(np.max(covered.error_m[bridged] / covered.sigma_m[bridged])) if bridged.any() else None
    carried = Localization(args, folder, mapped, "carried_away", "--carry-away-s", begin_s, end_s)
    after = carried.time_s - carried.time_s[0] >= end_s
    right = after & carried.localized() & (carried.error_m < 0.3)
    recovery_s = float(carried.time_s[right][0] - carried.time_s[after][0]) if right.any() else None
    return [figure("all cameras covered for 10 s: frames bridged", percent(bridged.sum(), dark.sum()), "%", at_least=100),
            Figure("the same: largest error", None if worst_m is None else 100 * worst_m, "cm"),
            figure("the same: largest error over its standard deviation", ratio, at_most=3),
            figure("carried away by 10 s of driving: right again after", recovery_s, "s", at_most=2.0),
            figure("the same: wrong frames", carried.num_false(), equal=0)]


def camera_columns(args, folder, mapped):
    for cameras in (["front"], ["front", "left"], ["left", "rear", "right"], ["front", "left", "rear", "right"]):
        result = Localization(args, folder, mapped, "cameras_" + "_".join(cameras), "--cameras", *cameras)
        kept = ("frames localized", "position", "heading", "localized, but over 0.5 m or 2 degrees off")
        yield ", ".join(cameras), [one for one in other_day_figures(result, 0) if one.name.startswith(kept)]


def evaluate_scene(args, scene, mapped, other, results):
    """Adds the scene's tables; returns its drives that started again and again without a prior."""
    size, starts = f"image scale {args.image_scale:g}", []
    result = Localization(args, other, mapped, "localized")
    masks = Figure("masks", mapped.masks.text())
    columns = [(f"{scene}, seed {args.seed}", [*other_day_figures(result, 97), masks])]
    show(results, result, other, f"{scene}, seed {args.seed}")
    if not args.no_opposite:
        opposite = drive(args, f"opposite_direction_{scene}", args.seed + 100, args.duration_s)
        result = Localization(args, opposite, mapped, "localized")
        columns.append((f"{scene}, seed {args.seed}, opposite direction", [*other_day_figures(result, 90), masks]))
        show(results, result, opposite, columns[-1][0])
        starts.append(Localization(args, opposite, mapped, "starts", "--forget-every", START_EVERY))
    results.add(f"Another day, {size}", *columns)
    if not args.no_experiments:
        starts.append(Localization(args, other, mapped, "starts", "--forget-every", START_EVERY))
        results.add(f"Disturbances, {size}", (scene, disturbance_figures(args, other, mapped)))
        results.add(f"Cameras in the {scene}, {size}", *camera_columns(args, other, mapped))
    return starts


def show(results, result, made, name):
    """Errors over time, if they are the worst so far."""
    path = made.folder / "localized.png"
    result.plot(path)
    worst_m = result.quantile(result.error_m, 95, BOUND_M)
    results.show(cv2.imread(str(path)), f"{name}: 95 % of the position errors are below {100 * worst_m:.1f} cm (no pose: 50 cm)",
                 worst_m)


def drives_of(args, scene):
    """Mapping drive of a scene, and the drive on another day."""
    if args.loops or args.consistency:
        return (loop_drive(args.work, scene, args.seed, args.image_scale),
                other_day_drive(args.work, scene, args.seed, args.image_scale, args.duration_s or 6) if args.loops else None)
    return (drive(args, f"mapping_{scene}", args.seed, args.map_duration_s),
            drive(args, f"other_day_{scene}", args.seed + 100, args.duration_s))


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("localization", "Localization", args)
    maps, others, starts = {}, {}, []
    for scene in args.scenes:
        mapping, others[scene] = drives_of(args, scene)
        masks = found_masks(args.work, scene)
        maps[scene] = map_of(mapping, masks)
        maps[scene].masks = masks
    if args.consistency:
        consistency.evaluate(args, maps, Localization, results)
        results.end()
        return
    for scene, mapped in maps.items():
        starts += evaluate_scene(args, scene, mapped, others[scene], results)
    if starts:
        results.add("Starts without a prior", (" ".join(args.scenes), start_figures(starts)))
    if len(maps) > 1 and not args.no_experiments:
        scenes = list(maps)
        figures = []
        for scene, other in zip(scenes, scenes[1:] + scenes[:1]):
            foreign = Localization(args, others[other], maps[scene], f"in_the_{scene}")
            figures.append(figure(f"frames of the {other} refused in the map of the {scene}", 100 * (1 - foreign.ratio()),
                                  "%", at_least=99))
        results.add("Unmapped scenes", ("", figures))
    results.end()


if __name__ == "__main__":
    main()
