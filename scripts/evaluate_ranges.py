#!/usr/bin/env python3
"""What range maps reach, as Markdown tables: accuracy at fixed density and honesty of sigma and confidence, of a drive with all
cameras, and by setting; see evaluate_ranges.sh."""
import argparse
import json
import os
import pathlib

import yaml

from tool_runs import TOOLS, run, say, simulate

DENSITIES = (0.4, 0.6, 0.8)
TRUE_POSES = {"refine_poses": False,
              "pose_noise": {"scale": 0.0, "translation_m": 0.001, "translation_m_per_sqrt_m": 0.0, "rotation_rad": 0.0002,
                             "rotation_rad_per_sqrt_m": 0.0}}
SETTINGS = {
    "`fast`": ("fast", {}),
    "`default`": ("default", {}),
    "`accurate`": ("accurate", {}),
    "`default`, filled from two levels": ("default", {"num_fill_levels": 2}),
    "`default`, all planes": ("default", {"coarse_pass": False}),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/range_evaluation"),
                        help="folder for drives and range maps; drives that are there are used again")
    parser.add_argument("--parts", nargs="*", default=["drive"], choices=["drive", "settings"],
                        help="drive: four cameras on 4 s in a lot; settings: two cameras on 1.7 s each in lot and garage")
    parser.add_argument("--drives", nargs="*", default=["lot:5", "garage:6"], help="scene:seed of the drives of the settings")
    parser.add_argument("--duration-s", type=float, default=1.7, help="of the settings' drives")
    return parser.parse_args()


def errors_of(folder, name, words):
    """Range maps of a drive and their errors: evaluate_range's JSON by set of cameras, maps, processor time of all of them."""
    bag, rig, truth = folder / "drive.bag", folder / "rig_truth.yaml", folder / "drive_truth"
    say(f"{folder}: {name}")
    made = run([TOOLS / "vcharge_dense" / "compute_range_maps", "--bag", bag, "--rig", rig, "--output", folder / name,
                "--no-pictures", *words], folder / f"{name}.log")
    run([TOOLS / "vcharge_evaluation" / "evaluate_range", "--range", folder / name, "--truth", truth, "--bag", bag, "--rig",
         rig, "--report", folder / f"{name}_report"], folder / f"{name}_errors.log")
    result = json.loads((folder / f"{name}_report" / "range_errors.json").read_text())
    sets = {errors["label"]: errors for errors in result["sets"]}
    return sets, made["cpu_s"]


def right_shares(errors):
    at = {round(entry["density"], 3): entry["share_within_tolerance"] for entry in errors["accuracy"]}
    return ", ".join(f"{100 * at[density]:.1f}" for density in DENSITIES)


def known_share(errors):
    return 100 * errors["num_known"] / max(1, errors["num_judged"])


def evaluate_drive(args):
    folder = args.work / "short"
    simulate(folder, ["--scene", "lot", "--drive", "short", "--truth-range"])
    odometry, _ = errors_of(folder, "odometry", [])
    true, _ = errors_of(folder, "truth", ["--cameras", "front", "left", "--trajectory", folder / "drive_truth" / "trajectory.tum"])
    print("\n| poses, camera | pixels with a range | right at 40, 60, 80 % density | within one, two sigma |\n|---|---|---|---|")
    for poses, sets in (("odometry", odometry), ("true, refined", true)):
        for label, errors in sets.items():
            print(f"| {poses}, {label} | {known_share(errors):.1f} % | {right_shares(errors)} % | "
                  f"{100 * errors['share_within_one_sigma']:.1f}, {100 * errors['share_within_two_sigma']:.1f} % |", flush=True)


def evaluate_settings(args):
    columns = []
    for drive in args.drives:
        scene, seed = drive.split(":")
        folder = args.work / f"{scene}_seed{seed}_{args.duration_s:g}s"
        simulate(folder, ["--scene", scene, "--drive", "figure_eight", "--seed", seed, "--duration-s", args.duration_s,
                          "--cameras", "front", "left", "--truth-range"])
        columns += [(f"{scene}, true poses", folder, True), (f"{scene}, odometry", folder, False)]
    results = {}
    for number, (setting, (preset, overrides)) in enumerate(SETTINGS.items()):
        for title, folder, true_poses in columns:
            sweep = {**overrides, **(TRUE_POSES if true_poses else {})}
            name = f"setting{number}_{'true' if true_poses else 'odometry'}"
            options = folder / f"{name}.yaml"
            options.write_text(yaml.safe_dump({"plane_sweep": sweep}))
            poses = ["--trajectory", folder / "drive_truth" / "trajectory.tum"] if true_poses else []
            results[setting, title] = errors_of(folder, name, ["--preset", preset, "--options", options, *poses])
    titles = [title for title, _, _ in columns]
    heading = "| setting | " + " | ".join(titles) + " |"
    print(f"\nPixels with a range; right at 40, 60, 80 % density (%); processor time per range map\n\n{heading} ms |\n"
          + "|---" * (len(titles) + 2) + "|")
    for setting in SETTINGS:
        cells, times = [], []
        for title in titles:
            sets, cpu_s = results[setting, title]
            cells.append(f"{known_share(sets['all cameras']):.1f}: {right_shares(sets['all cameras'])}")
            times.append(1000 * cpu_s / sets["all cameras"]["num_frames"])
        print(f"| {setting} | " + " | ".join(cells) + f" | {min(times):.0f}-{max(times):.0f} |")
    print(f"\nRanges within one sigma, front / left camera (%)\n\n{heading}\n" + "|---" * (len(titles) + 1) + "|")
    for setting in SETTINGS:
        cells = []
        for title in titles:
            sets, _ = results[setting, title]
            cells.append(" / ".join(f"{100 * sets[camera]['share_within_one_sigma']:.1f}" for camera in ("front", "left")))
        print(f"| {setting} | " + " | ".join(cells) + " |")
    print_confidence("`default`", [results["`default`", title][0]["all cameras"] for title in titles])


def print_confidence(setting, sets):
    bins = {}
    for errors in sets:
        for entry in errors["by_confidence"]:
            count, right = bins.get((entry["low"], entry["high"]), (0, 0.0))
            bins[entry["low"], entry["high"]] = (count + entry["count"], right + entry["count"] * entry["share_within_tolerance"])
    filled = sorted((key, value) for key, value in bins.items() if value[0])
    print(f"\nShare that is right, by confidence, {setting}\n\n| confidence | " +
          " | ".join(f"{low:g}-{high:g}" for (low, high), _ in filled) + " |\n" + "|---" * (len(filled) + 1) + "|")
    print("| right | " + " | ".join(f"{right / count:.3f}" for _, (count, right) in filled) + " |", flush=True)


def main():
    args = arguments()
    os.makedirs(args.work, exist_ok=True)
    if "drive" in args.parts:
        evaluate_drive(args)
    if "settings" in args.parts:
        evaluate_settings(args)


if __name__ == "__main__":
    main()
