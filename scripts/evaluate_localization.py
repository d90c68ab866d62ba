#!/usr/bin/env python3
"""What localization reaches, as a Markdown table: share of frames, errors, consistency, starts, cameras, time, mishaps;
see evaluate_localization.sh."""
import argparse
import pathlib
import re
import sys

import numpy as np

from tool_runs import ROOT, TOOLS, mark, run, say, simulate
from localization_errors import LocalizationErrors, Map

FRAMES_OF_START = 5
START_EVERY = 10


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/mapping_evaluation"),
                        help="folder for drives and maps; those that are there are used again")
    parser.add_argument("--scenes", nargs="*", default=["lot", "garage"])
    parser.add_argument("--seed", type=int, default=1, help="of the scene and its mapping drive; other days: 100 more")
    parser.add_argument("--image-scale", type=float, default=1.0)
    parser.add_argument("--map-duration-s", type=float, default=0.0, help="end mapping drives early; 0: whole drives")
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the other drives early; 0: whole drives")
    parser.add_argument("--options", type=pathlib.Path, default=ROOT / "config" / "localization.yaml")
    parser.add_argument("--no-opposite", action="store_true", help="not against the direction of a mapped loop")
    parser.add_argument("--no-experiments", action="store_true", help="other days alone: no mishaps, starts, cameras")
    return parser.parse_args()


def folder_of(args, scenario, duration_s):
    return args.work / (f"{scenario}_seed{args.seed}_scale{args.image_scale:g}" +
                        (f"_{duration_s:g}s" if duration_s else ""))


def drive(args, scenario, seed, duration_s):
    folder = folder_of(args, scenario, duration_s)
    words = ["--scenario", ROOT / "config" / "scenarios" / f"{scenario}.yaml", "--seed", seed, "--scene-seed", args.seed,
             "--image-scale", args.image_scale]
    if duration_s:
        words += ["--duration-s", duration_s]
    simulate(folder, words)
    return folder


def map_of(folder):
    """The map of a mapping drive; one that is there is taken as it is."""
    path = folder / "lot.vmap"
    if not path.exists():
        say(f"{folder}: building the map")
        run([TOOLS / "vcharge_mapping" / "build_map", "--bag", folder / "drive.bag", "--rig", folder / "rig_truth.yaml",
             "--output", path, "--options", ROOT / "config" / "mapping.yaml"], folder / "lot.log")
    return Map(path, folder / "drive_truth" / "trajectory.tum")


class Run(LocalizationErrors):
    """A drive that was localized, and its errors."""

    def __init__(self, args, folder, place, name, words=()):
        output = folder / f"{name}.tum"
        say(f"{folder}: {name}")
        result = run([TOOLS / "vcharge_localization" / "localize_drive", "--bag", folder / "drive.bag", "--rig",
                      folder / "rig_truth.yaml", "--map", place.path, "--options", args.options, "--output", output,
                      *words], folder / f"{name}.log")
        self.map_ready_s = float(re.search(r"map ready after (\S+) s", result["output"]).group(1))
        self.hash = re.search(r"content hash: (\S+)", result["output"]).group(1)
        self.cpu_s = result["cpu_s"]
        super().__init__(f"{output}.csv", folder / "drive_truth" / "trajectory.tum", place)


def other_day_rows(result, min_share):
    good = result.localized()
    if not good.any():
        return [("frames localized", f">= {100 * min_share:.0f} %", "none", mark(False))]
    position, heading = np.percentile(result.error_m[good], [50, 95]), np.percentile(result.heading_deg[good], [50, 95])
    consistency, num_frames = result.consistency()
    absolute = np.median(result.absolute_m[good])
    return [
        ("frames localized", f">= {100 * min_share:.0f} %", f"{100 * result.share():.1f} % of {len(good)}",
         mark(result.share() >= min_share)),
        ("position relative to the map, median, 95 %", "<= 3, 8 cm",
         f"{100 * position[0]:.1f}, {100 * position[1]:.1f} cm", mark(position[0] <= 0.03 and position[1] <= 0.08)),
        ("heading, median, 95 %", "<= 0.05, 0.2 deg", f"{heading[0]:.3f}, {heading[1]:.3f} deg",
         mark(heading[0] <= 0.05 and heading[1] <= 0.2)),
        ("absolute position, median", "<= 5 cm", f"{100 * absolute:.1f} cm", mark(absolute <= 0.05)),
        ("localized but over 0.5 m or 2 degrees off", "0", f"{result.num_false()}", mark(result.num_false() == 0)),
        ("normalized error squared per degree of freedom", "0.5 to 2", f"{consistency:.2f} ({num_frames} frames)",
         mark(0.5 <= consistency <= 2.0)),
        ("time of a frame, median, 95 %; processor time", "< 120 ms (95 %)",
         f"{1e3 * np.median(result.latency_s):.0f}, {1e3 * np.percentile(result.latency_s, 95):.0f} ms; "
         f"{1e3 * result.cpu_s / len(good):.0f} ms", mark(np.percentile(result.latency_s, 95) < 0.12)),
        ("map ready after", "< 2 s", f"{result.map_ready_s:.2f} s", mark(result.map_ready_s < 2.0)),
    ]


def starts_row(results):
    found = tried = 0
    for result in results:
        for begin in range(0, len(result.status) - FRAMES_OF_START + 1, START_EVERY):
            tried += 1
            frames = slice(begin, begin + FRAMES_OF_START)
            found += bool((result.localized()[frames] & (result.error_m[frames] < 0.5) &
                           (result.error_deg[frames] < 2.0)).any())
    false = sum(result.num_false() for result in results)
    return ("right pose within 5 frames from nothing", ">= 95 %", f"{found} of {tried} ({100 * found / tried:.1f} %), "
            f"{false} wrong frames", mark(found >= 0.95 * tried and false == 0))


def mishap_rows(args, folder, place):
    rows = []
    half_s = 20.0
    covered = Run(args, folder, place, "covered", ["--cover-s", half_s, half_s + 10.0])
    dark = (covered.time_s - covered.time_s[0] >= half_s) & (covered.time_s - covered.time_s[0] < half_s + 10.0)
    bridged = dark & covered.has_pose
    worst = np.max(covered.error_m[bridged]) if bridged.any() else np.inf
    ratio = np.max(covered.error_m[bridged] / covered.sigma_m[bridged]) if bridged.any() else np.inf
    rows.append(("all cameras covered for 10 s: largest error; over its sigma", "bridged, <= 3 sigma",
                 f"{100 * worst:.1f} cm; {ratio:.1f}", mark(bridged.sum() == dark.sum() and ratio <= 3.0)))
    carried = Run(args, folder, place, "carried_away", ["--carry-away-s", half_s, half_s + 10.0])
    after = carried.time_s - carried.time_s[0] >= half_s + 10.0
    right = after & carried.localized() & (carried.error_m < 0.3)
    recovery_s = carried.time_s[right][0] - carried.time_s[after][0] if right.any() else np.inf
    rows.append(("carried away: right again after; wrong frames", "< 2 s; 0", f"{recovery_s:.2f} s; {carried.num_false()}",
                 mark(recovery_s < 2.0 and carried.num_false() == 0)))
    return rows


def camera_rows(args, folder, place):
    rows = []
    for cameras in (["front"], ["front", "left"], ["left", "rear", "right"], ["front", "left", "rear", "right"]):
        result = Run(args, folder, place, "cameras_" + "_".join(cameras), ["--cameras", *cameras])
        good = result.localized()
        position = np.percentile(result.error_m[good], [50, 95]) if good.any() else [np.inf, np.inf]
        heading = np.median(result.heading_deg[good]) if good.any() else np.inf
        rows.append((", ".join(cameras), "", f"{100 * result.share():.1f} %; {100 * position[0]:.1f}, "
                     f"{100 * position[1]:.1f} cm; {heading:.3f} deg; {result.num_false()} wrong", ""))
    return rows


def print_table(title, rows):
    print(f"\n{title}\n\n| what | goal | figure | reached |\n|---|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |")
    sys.stdout.flush()


def main():
    args = arguments()
    places, others, starts = {}, {}, []
    for scene in args.scenes:
        mapped = drive(args, f"mapping_{scene}", args.seed, args.map_duration_s)
        places[scene] = map_of(mapped)
        others[scene] = drive(args, f"other_day_{scene}", args.seed + 100, args.duration_s)
    for scene, place in places.items():
        result = Run(args, others[scene], place, "localized")
        result.plot(others[scene] / "localized.png")
        print_table(f"Another day in the {scene}", other_day_rows(result, 0.97))
        if not args.no_opposite:
            opposite = drive(args, f"opposite_direction_{scene}", args.seed + 100, args.duration_s)
            result = Run(args, opposite, place, "localized")
            result.plot(opposite / "localized.png")
            print_table(f"Another day in the {scene}, in the opposite direction of a loop", other_day_rows(result, 0.9))
            starts.append(Run(args, opposite, place, "starts", ["--forget-every", START_EVERY]))
        if not args.no_experiments:
            starts.append(Run(args, others[scene], place, "starts", ["--forget-every", START_EVERY]))
            print_table(f"Mishaps in the {scene}", mishap_rows(args, others[scene], place))
            print_table(f"Cameras in the {scene}: frames localized; position, median and 95 %; heading, median",
                        camera_rows(args, others[scene], place))
    if starts:
        print_table("From nothing", [starts_row(starts)])
    if len(places) > 1 and not args.no_experiments:
        scenes = list(places)
        rows = []
        for scene, other in zip(scenes, scenes[1:] + scenes[:1]):
            foreign = Run(args, others[other], places[scene], f"in_the_{scene}")
            refused = 1.0 - np.mean(foreign.status == "localized")
            rows.append((f"the {other} refused in the map of the {scene}, frame by frame", ">= 99 %",
                         f"{100 * refused:.1f} %", mark(refused >= 0.99)))
        print_table("Unmapped places", rows)


if __name__ == "__main__":
    main()
