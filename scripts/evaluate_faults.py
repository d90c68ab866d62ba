#!/usr/bin/env python3
"""The simulator's fault drives through check_bag, localization and obstacle detection: what each says and when, and that no
wrong pose is called good and no cell inside an obstacle free; a Markdown table. See evaluate_faults.sh."""
import argparse
import collections
import csv
import json
import pathlib
import re

from localization_errors import LocalizationErrors, Map
from tool_runs import ROOT, TOOLS, mark, run, say, simulate

SCENARIOS = ROOT / "config" / "scenarios"
# Rendered with the fault in the light or the lens' place: not from the images of the sound drive.
RENDERED = ("motion_blur", "sun_glare", "bumped_camera", "soft_suspension")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build/fault_evaluation"),
                        help="folder for drives; those that are there are used again")
    parser.add_argument("--faults", nargs="*", default=sorted(path.stem[len("fault_"):] for path in
                                                              SCENARIOS.glob("fault_*.yaml")))
    parser.add_argument("--seed", type=int, default=120, help="of the scene; the drive to map and the fault drives have others")
    return parser.parse_args()


class Place:
    """A stretch of the lot with its map, and the drive over it on which faults befall the car."""

    def __init__(self, args):
        self.args = args
        self.common = ["--scene-seed", args.seed, "--image-scale", 0.5]
        mapping = args.work / "mapping"
        simulate(mapping, ["--scene", "lot", "--drive", "short", *self.common, "--seed", args.seed + 1])
        self.map = mapping / "lot.vmap"
        if not self.map.exists():
            run([TOOLS / "vcharge_mapping" / "build_map", "--bag", mapping / "drive.bag", "--rig", mapping / "rig_truth.yaml",
                 "--output", self.map, "--options", ROOT / "config" / "mapping.yaml"], mapping / "map.log")
        self.mapped = Map(self.map, mapping / "drive_truth" / "trajectory.tum")
        self.sound = args.work / "sound_rendered"
        simulate(self.sound, ["--scene", "lot", "--drive", "short", *self.common, "--seed", args.seed + 2, "--truth-range",
                              "--noise", "off"])

    def drive(self, fault):
        folder = self.args.work / fault
        words = ["--seed", self.args.seed + 2, *self.common]
        if fault == "none":
            simulate(folder, ["--scene", "lot", "--drive", "short", *words, "--images-from", self.sound / "drive.bag"])
            return folder, self.sound / "drive_truth"
        words = ["--scenario", SCENARIOS / f"fault_{fault}.yaml", *words]
        if fault in RENDERED:
            simulate(folder, [*words, "--truth-range"])
            return folder, folder / "drive_truth"
        simulate(folder, [*words, "--images-from", self.sound / "drive.bag"])
        return folder, self.sound / "drive_truth"


def check(folder):
    output = run([TOOLS / "vcharge_camera_driver" / "check_bag", "--bag", folder / "drive.bag", "--rig",
                  folder / "rig_truth.yaml", "--quiet"], folder / "check.log", may_fail=True)["output"]
    lines = [re.split(r"\s{2,}", line)[1] for line in output.splitlines() if line.startswith(("WARN", "FAIL"))]
    return f"{(re.findall('verdict: (.*)', output) or ['?'])[0]}: {'; '.join(lines)}" if lines else "PASS"


def localize(folder, place):
    result = run([TOOLS / "vcharge_localization" / "localize_drive", "--bag", folder / "drive.bag", "--rig",
                  folder / "rig_truth.yaml", "--map", place.map, "--options", ROOT / "config" / "localization.yaml", "--output",
                  folder / "poses.tum"], folder / "localize.log", may_fail=True)
    if not (folder / "poses.tum.csv").exists():
        return {"says": (folder / "localize.log").read_text().strip().splitlines()[-1], "share": 0.0, "wrong": 0,
                "median_m": None}
    errors = LocalizationErrors(folder / "poses.tum.csv", folder / "drive_truth" / "trajectory.tum", place.mapped)
    good = errors.localized()
    states, last = [], None
    for time_s, status in zip(errors.time_s, errors.status):
        if status != last:
            states.append(f"{status} from {time_s - errors.time_s[0]:.1f} s")
            last = status
    warnings = re.findall(r"^warning in (\d+ frames: .*)$", result["output"], re.M)
    return {"says": "; ".join([*(states if len(states) < 6 else [f"{len(states)} changes of state"]), *warnings]),
            "share": good.mean(), "wrong": errors.num_false(),
            "median_m": float(sorted(errors.error_m[good])[good.sum() // 2]) if good.any() else None}


def obstacles(folder, truth):
    output = folder / "obstacles"
    detected = run([TOOLS / "vcharge_obstacles" / "detect_obstacles", "--bag", folder / "drive.bag", "--rig",
                    folder / "rig_truth.yaml", "--options", ROOT / "config" / "obstacles.yaml", "--range-options",
                    ROOT / "config" / "dense_obstacles.yaml", "--output", output], folder / "obstacles.log", may_fail=True)
    if not (output / "status.csv").exists():
        return {"says": (folder / "obstacles.log").read_text().strip().splitlines()[-1], "free_inside": 0, "observed": 0}
    with open(output / "status.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    start_ns, seen = int(rows[0]["stamp_ns"]), collections.OrderedDict()
    for row in rows:
        for state in (row["state"], f"ground {row['ground_state']}"):
            if state not in ("mapping", "ground measured"):
                seen.setdefault((row["camera"], state), (int(row["stamp_ns"]) - start_ns) * 1e-9)
    jumps = re.findall(r"odometry jumps: ([1-9]\d*)", detected["output"])
    says = [f"{camera} {state} at {time_s:.1f} s" for (camera, state), time_s in seen.items()]
    report = folder / "obstacle_report"
    run([TOOLS / "vcharge_evaluation" / "evaluate_obstacles", "--obstacles", output, "--truth", truth, "--report", report],
        folder / "evaluate.log")
    judged = json.loads((report / "obstacle_errors.json").read_text())["map"]
    return {"says": "; ".join([*says, *(f"{jumps[0]} odometry jumps" for _ in jumps[:1])]) or "-",
            "free_inside": judged["free_inside"], "observed": judged["observed_inside"]}


def main():
    args = arguments()
    place = Place(args)
    print("| fault | check_bag | localization: frames localized; median; **wrong** | it says | obstacles: **free inside an "
          "obstacle**, of cells observed | it says |\n|---|---|---|---|---|---|")
    wrong = free = 0
    for fault in ["none", *args.faults]:
        say(fault)
        folder, truth = place.drive(fault)
        pose, ground = localize(folder, place), obstacles(folder, truth)
        wrong, free = wrong + pose["wrong"], free + ground["free_inside"]
        median = "-" if pose["median_m"] is None else f"{100 * pose['median_m']:.1f} cm"
        print(f"| {fault} | {check(folder)} | {100 * pose['share']:.0f} %; {median}; {pose['wrong']} | {pose['says']} | "
              f"{ground['free_inside']} of {ground['observed']} | {ground['says']} |", flush=True)
    print(f"\nwrong poses called good: {wrong} ({mark(wrong == 0)}); cells inside obstacles that were free: {free} "
          f"({mark(free == 0)})")


if __name__ == "__main__":
    main()
