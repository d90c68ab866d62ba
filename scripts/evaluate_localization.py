#!/usr/bin/env python3
"""What localization reaches, as a Markdown table: share of frames, errors, consistency, starts, cameras, time, mishaps;
see evaluate_localization.sh."""
import argparse
import csv
import pathlib
import re
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402

from evaluate_mapping import ROOT, TOOLS, mark, run, say, simulate  # noqa: E402

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


def rotations(quaternions):
    x, y, z, w = quaternions.T
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
                     np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
                     np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def nearest(times, wanted):
    """Indices of the entries of `times` (ascending) that are nearest to the wanted ones."""
    right = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    return np.where(wanted - times[right - 1] < times[right] - wanted, right - 1, right)


class Map:
    """A map and the true poses of its keyframes."""

    def __init__(self, folder, args):
        self.path = folder / "lot.vmap"
        if not self.path.exists():
            say(f"{folder}: building the map")
            run([TOOLS / "vcharge_mapping" / "build_map", "--bag", folder / "drive.bag", "--rig",
                 folder / "rig_truth.yaml", "--output", self.path, "--options", ROOT / "config" / "mapping.yaml"],
                folder / "lot.log")
        keyframes_path = folder / "lot_keyframes.tum"
        run([TOOLS / "vcharge_mapping" / "map_info", "--map", self.path, "--trajectory", keyframes_path],
            folder / "lot_info.log")
        poses = np.loadtxt(keyframes_path)
        truth = np.loadtxt(folder / "drive_truth" / "trajectory.tum")
        truth = truth[nearest(truth[:, 0], poses[:, 0])]
        self.positions, self.rotations = poses[:, 1:4], rotations(poses[:, 4:])
        self.true_positions, self.true_rotations = truth[:, 1:4], rotations(truth[:, 4:])
        # world_from_map by all keyframes.
        centre, true_centre = self.positions.mean(0), self.true_positions.mean(0)
        u, _, v = np.linalg.svd((self.true_positions - true_centre).T @ (self.positions - centre))
        self.turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
        self.shift = true_centre - self.turn @ centre

    def carry(self, positions, turns):
        """True poses of the world into the map, by the nearest keyframe."""
        keyframe = ((positions[:, None, :] - self.true_positions[None, :, :]) ** 2).sum(-1).argmin(1)
        back = self.true_rotations[keyframe].transpose(0, 2, 1)
        between = np.einsum("nij,nj->ni", back, positions - self.true_positions[keyframe])
        return (self.positions[keyframe] + np.einsum("nij,nj->ni", self.rotations[keyframe], between),
                self.rotations[keyframe] @ back @ turns)


class Run:
    """A drive that was localized, and its errors."""

    def __init__(self, args, folder, place, name, words=()):
        self.log = folder / f"{name}.log"
        output = folder / f"{name}.tum"
        say(f"{folder}: {name}")
        result = run([TOOLS / "vcharge_localization" / "localize_drive", "--bag", folder / "drive.bag", "--rig",
                      folder / "rig_truth.yaml", "--map", place.path, "--options", args.options, "--output", output,
                      *words], self.log)
        self.map_ready_s = float(re.search(r"map ready after (\S+) s", result["output"]).group(1))
        self.hash = re.search(r"content hash: (\S+)", result["output"]).group(1)
        self.cpu_s = result["cpu_s"]
        with open(f"{output}.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.time_s = np.array([float(row["time_s"]) for row in rows])
        self.status = np.array([row["status"] for row in rows])
        self.latency_s = np.array([float(row["latency_s"]) for row in rows])
        self.has_pose = np.array([row["tx"] != "" for row in rows])
        size = len(rows)
        self.error_m, self.error_deg = np.full(size, np.inf), np.full(size, np.inf)
        self.heading_deg, self.absolute_m = np.full(size, np.inf), np.full(size, np.inf)
        self.normalized, self.sigma_m = np.full(size, np.nan), np.full(size, np.nan)
        if self.has_pose.any():
            self.judge([row for row in rows if row["tx"] != ""], folder, place)

    def judge(self, rows, folder, place):
        truth = np.loadtxt(folder / "drive_truth" / "trajectory.tum")
        truth = truth[nearest(truth[:, 0], self.time_s[self.has_pose])]
        estimated = np.array([[float(row[key]) for key in ("tx", "ty", "tz", "qx", "qy", "qz", "qw")] for row in rows])
        true_positions, true_turns = place.carry(truth[:, 1:4], rotations(truth[:, 4:]))
        shift = estimated[:, :3] - true_positions
        turn = rotations(estimated[:, 3:]) @ true_turns.transpose(0, 2, 1)
        axis = 0.5 * np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0],
                               turn[:, 1, 0] - turn[:, 0, 1]], -1)
        cosine = np.clip((np.trace(turn, axis1=1, axis2=2) - 1) / 2, -1, 1)
        covariance = np.zeros((len(rows), 6, 6))
        for i in range(6):
            for k in range(i, 6):
                covariance[:, i, k] = covariance[:, k, i] = [float(row[f"covariance_{i}{k}"]) for row in rows]
        planar = np.ix_(range(len(rows)), [0, 1, 5], [0, 1, 5])
        errors = np.stack([shift[:, 0], shift[:, 1], axis[:, 2]], -1)
        self.error_m[self.has_pose] = np.linalg.norm(shift, axis=1)
        self.error_deg[self.has_pose] = np.degrees(np.arccos(cosine))
        self.heading_deg[self.has_pose] = np.degrees(np.abs(axis[:, 2]))
        world = estimated[:, :3] @ place.turn.T + place.shift
        self.absolute_m[self.has_pose] = np.linalg.norm(world - truth[:, 1:4], axis=1)
        self.normalized[self.has_pose] = np.einsum(
            "ni,ni->n", errors, np.linalg.solve(covariance[planar], errors[..., None])[..., 0]) / 3
        self.sigma_m[self.has_pose] = np.sqrt(np.trace(covariance[:, :3, :3], axis1=1, axis2=2))

    def localized(self):
        return self.status == "localized"

    def share(self):
        return self.localized().mean()

    def num_false(self):
        return int((self.localized() & ((self.error_m > 0.5) | (self.error_deg > 2.0))).sum())

    def consistency(self):
        """Mean normalized error squared per degree of freedom, of localized frames two seconds apart."""
        values, last_s = [], -np.inf
        for i in np.flatnonzero(self.localized()):
            if self.time_s[i] - last_s >= 2.0:
                last_s = self.time_s[i]
                values.append(self.normalized[i])
        return float(np.mean(values)), len(values)

    def plot(self, path):
        figure, axes = plt.subplots(3, 1, figsize=(9, 8), sharex=True)
        time_s = self.time_s - self.time_s[0]
        good = self.localized()
        axes[0].plot(time_s[self.has_pose], 100 * self.error_m[self.has_pose], ".", color="0.6", label="bridged")
        axes[0].plot(time_s[good], 100 * self.error_m[good], ".", label="localized")
        axes[0].plot(time_s[self.has_pose], 100 * self.sigma_m[self.has_pose], "-", linewidth=0.8, label="sigma")
        axes[0].set_ylabel("position (cm)")
        axes[0].legend(loc="upper right")
        axes[1].plot(time_s[good], self.heading_deg[good], ".")
        axes[1].set_ylabel("heading (deg)")
        axes[2].plot(time_s[good], self.normalized[good], ".")
        axes[2].axhline(1.0, color="0.5", linewidth=0.8)
        axes[2].set_ylabel("normalized error\nsquared per degree\nof freedom")
        axes[2].set_xlabel("time (s)")
        figure.tight_layout()
        figure.savefig(path, dpi=110)
        plt.close(figure)


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
        places[scene] = Map(mapped, args)
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
