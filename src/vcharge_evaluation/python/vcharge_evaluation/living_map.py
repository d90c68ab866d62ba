"""A map over many days: drives merged, maps updated day by day, localization on the next day, summaries, other car parks, maps
of many kilometres."""
import argparse
import shutil

import numpy as np
import rosbag
import rospy

import vcharge
from vcharge_evaluation.drives import Drive
from vcharge_evaluation.localization_errors import BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.poses import at_stamps
from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import CONFIG, build_map, run_tool, run_tool_once, say

OTHER_DAY = ("--drive", "other_day_beside", "--exposure-gain", 1.2)
DUSK, NIGHT = ("--set", "condition.kind=dusk"), ("--set", "condition.kind=night")
STARTS = ("--forget-every", 10)
FRAMES_WITHIN_5_M = 40  # at 1.5 m/s and 12.5 Hz
PARTS = ("days", "exchanged", "night", "summary", "merges", "other", "large")
# Parts of a drive that are mapped as sessions of their own, as fractions of its time.
STRETCHES = ((0.0, 0.4), (0.2, 0.6), (0.4, 0.8), (0.6, 1.0))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "living_map_evaluation")
    parser.add_argument("--parts", nargs="*", default=list(PARTS), choices=PARTS)
    parser.add_argument("--seeds", nargs="*", type=int, default=[201], help="seeds of the lots")
    parser.add_argument("--num-days", type=int, default=10, help="days after that of the first map")
    parser.add_argument("--image-scale", type=float, default=0.3)
    parser.add_argument("--length-km", type=float, default=20.0, help="of the large map, made of this lot and the next")
    parser.add_argument("--duration-s", type=float, default=0.0, help="end the drives early; 0: whole drives")
    return parser.parse_args()


class LivingMap(Map):
    """A map of several drives and the true poses of its keyframes."""

    def __init__(self, path, drives):
        self.path = path
        trajectories = {recording_of(drive.folder / "map.vmap"): drive.trajectory for drive in drives}
        poses, truth = [], []
        found = vcharge.read_map(path)
        self.components = [session.component for session in found.sessions]
        for number, session in enumerate(found.sessions):
            rows = found.trajectory(number).rows
            # A map of one drive does not name it.
            trajectory = trajectories[session.recording_hash] if session.recording_hash else drives[0].trajectory
            poses.append(rows)
            truth.append(at_stamps(trajectory, rows[:, 0]))
        self.num_landmarks = len(found.landmarks)
        self.fit(np.concatenate(poses), np.concatenate(truth))

    def figures(self):
        errors_m = np.linalg.norm(self.positions @ self.turn.T + self.shift - self.true_positions, axis=1)
        return [Figure("drives in the map", len(self.components)), Figure("keyframes", len(self.positions)),
                Figure("landmarks", self.num_landmarks), Figure("file", self.path.stat().st_size / 1e6, "MB"),
                figure("position of the keyframes, root mean square", 100 * float(np.sqrt((errors_m ** 2).mean())), "cm",
                       at_most=4),
                figure("scale error (absolute)", 100 * abs(self.scale - 1), "%", at_most=0.1)]


def recording_of(map_path):
    """The hash of the recording that a map was built from."""
    return vcharge.read_map(map_path).provenance["bag_hash"]


class Lot:
    """Drives through one lot and their maps."""

    def __init__(self, args, seed):
        self.args, self.seed = args, seed

    def drive(self, name, day, *words, exchanged=0.3):
        words = [*words, "--exchanged-cars", exchanged] if day else words
        made = Drive(self.args.work, name, "--scene", "lot", *words, "--day", day, "--scene-seed", self.seed, "--seed",
                     self.seed + 100 * day, "--image-scale", self.args.image_scale,
                     *(["--duration-s", self.args.duration_s] if self.args.duration_s else []))
        made.day = day
        _, _, made.mapping = made.map(made.true_rig)
        return made

    def first(self):
        return self.drive("first_day", 0, "--drive", "loop")

    def other(self, day, *words, exchanged=0.3):
        return self.drive("other_day", day, *OTHER_DAY, *words, exchanged=exchanged)

    def folder(self, name):
        folder = self.args.work / f"{name}_{self.seed}"
        folder.mkdir(parents=True, exist_ok=True)
        return folder


def localize(made, mapped, name, *words):
    """Errors of a drive in a map."""
    output = made.folder / f"{name}.tum"
    say(f"{made.folder}: {name}")
    run_tool_once("localize_drive", made.folder / f"{name}.log", "--bag", made.bag, "--rig", made.true_rig, "--map", mapped.path,
                  "--options", CONFIG / "localization.yaml", "--output", output, *words)
    return LocalizationErrors(f"{output}.csv", made.trajectory, mapped)


def localization_figures(result, least_percent, most_cm):
    consistency = result.consistency()[0] if result.localized().any() else None
    return [figure("frames localized", 100 * result.ratio(), "%", at_least=least_percent),
            figure("position, all frames (none: 50 cm), median", 100 * result.quantile(result.error_m, 50, BOUND_M), "cm",
                   at_most=most_cm),
            Figure("position, 95 %", 100 * result.quantile(result.error_m, 95, BOUND_M), "cm"),
            figure("localized, but over 0.5 m or 2 degrees off", result.num_false(), equal=0),
            figure("normalized error squared per degree of freedom", consistency, at_least=0.5, at_most=2.0),
            Figure("time of a frame, median", 1e3 * float(np.median(result.latency_s)), "ms")]


def start_figures(result):
    """Starts from nothing: whether the right pose is found within 5 m of driving, or until the next start."""
    right = result.localized() & (result.error_m < 0.5) & (result.error_deg < 2.0)
    step = STARTS[1]
    found = [bool(right[begin:begin + min(step, FRAMES_WITHIN_5_M)].any())
             for begin in range(0, len(result.status) - step + 1, step)]
    return [Figure("starts", len(found)), figure("starts with the right pose", 100 * float(np.mean(found)), "%", at_least=95),
            figure("starts with a wrong pose", result.num_false(), equal=0)]


def update(path, made):
    """Updates a map file by a drive."""
    return run_tool("update_map", made.folder / f"{path.parent.name}_update.log", "--map", path, "--session",
                    made.folder / "map.vmap", "--max-versions", 2)


def days(lot, results):
    """Localizes each day's drive in the map of the days before, and then updates the map by it."""
    path = lot.folder("days") / "living.vmap"
    drives = [lot.first()]
    shutil.copy(drives[0].folder / "map.vmap", path)
    columns = []
    for day in range(1, lot.args.num_days + 1):
        mapped = LivingMap(path, drives)
        made = lot.other(day)
        found = [*mapped.figures(), *localization_figures(localize(made, mapped, "in_living_map"), 98, 1.0)]
        updated = update(path, made)
        drives.append(made)
        columns.append((f"lot {lot.seed}, day {day}", [
            *found, Figure("common landmarks in view", 100 * updated.found["common_ratio"], "%"),
            Figure("landmarks removed", updated.found["num_removed_landmarks"]), Figure("update", updated.wall_s, "s"),
            Figure("memory of the update", updated.peak_gb, "GB")]))
    results.add(f"Days in a row, image scale {lot.args.image_scale:g}", *columns)


def exchanged(lot, results):
    """A day on which all cars are others."""
    mapped = LivingMap(lot.first().folder / "map.vmap", [lot.first()])
    made = lot.other(50, exchanged=1.0)  # of the bays, all have other cars
    results.add(f"All cars exchanged, image scale {lot.args.image_scale:g}", (f"lot {lot.seed}", [
        *localization_figures(localize(made, mapped, "in_first_map"), 95, 2.5),
        *start_figures(localize(made, mapped, "starts_in_first_map", *STARTS))]))


def night(lot, results):
    """A night drive in the map of a day, and after a dusk and two nights were merged. Without the dusk the nights stay apart."""
    path = lot.folder("night") / "living.vmap"
    drives = [lot.first()]
    shutil.copy(drives[0].folder / "map.vmap", path)
    made = lot.other(73, *NIGHT)
    columns = [(f"lot {lot.seed}, map of a day",
                localization_figures(localize(made, LivingMap(path, drives), "in_day_map"), 98, 2.5))]
    joined = []
    for day, condition in ((70, DUSK), (71, NIGHT), (72, NIGHT)):
        drives.append(lot.other(day, *condition))
        found = run_tool("merge_maps", path.parent / f"merge_{day}.log", "--map", path, "--session",
                         drives[-1].folder / "map.vmap", "--output", path).found
        joined.append(found["sessions"][0]["joined"])
    mapped = LivingMap(path, drives)
    columns.append((f"lot {lot.seed}, with a dusk and two nights", [
        figure("drives joined, of 3", sum(joined), equal=3), *mapped.figures(),
        *localization_figures(localize(made, mapped, "in_night_map"), 98, 2.5)]))
    results.add(f"Night, image scale {lot.args.image_scale:g}", *columns)


def summary(lot, results):
    """Localization in summaries of a map that was updated day by day."""
    folder = lot.folder("summary")
    path, drives = folder / "whole.vmap", [lot.first()]
    shutil.copy(drives[0].folder / "map.vmap", path)
    for day in range(1, lot.args.num_days + 1):
        drives.append(lot.other(day))
        update(path, drives[-1])
    made = lot.other(lot.args.num_days + 1)
    (folder / "tenth.yaml").write_text("max_sigma_factor: 1\nmax_landmark_ratio: 0.1\n")
    whole = localize(made, LivingMap(path, drives), "in_whole_map")
    columns = [("all landmarks", [Figure("landmarks", LivingMap(path, drives).num_landmarks),
                                  *localization_figures(whole, 98, 1.0)])]
    most_cm = 1.2 * 100 * whole.quantile(whole.error_m, 50, BOUND_M)
    for name, options in (("as few as needed", []), ("10 % of the landmarks", ["--options", folder / "tenth.yaml"])):
        small = folder / f"{name.split(' ', maxsplit=1)[0]}.vmap"
        found = run_tool("summarize_map", small.with_suffix(".log"), "--map", path, "--output", small, *options).found
        result = localize(made, LivingMap(small, drives), f"in_summary_{small.stem}")
        columns.append((name, [Figure("landmarks", found["num_landmarks"]),
                               Figure("file per 100 m of drive", found["kilobytes_per_100_m"] / 1e3, "MB"),
                               Figure("deviation of a pose over that with all, worst", found["worst_sigma_factor"]),
                               Figure("the same, mean", found["mean_sigma_factor"]),
                               Figure("the same, of any choice of as many landmarks at least", found["least_sigma_factor"]),
                               *localization_figures(result, 100 * whole.ratio() - 1.0, most_cm)]))
    results.add(f"Summaries, lot {lot.seed}, image scale {lot.args.image_scale:g}", *columns)


class Stretch:
    """A part of a drive and its map."""

    def __init__(self, made, number):
        self.folder, self.trajectory = made.folder / f"stretch_{number}", made.trajectory
        self.folder.mkdir(exist_ok=True)
        bag_path = self.folder / "drive.bag"
        with rosbag.Bag(str(made.bag)) as bag, rosbag.Bag(str(bag_path), "w") as output:
            start_s, end_s = bag.get_start_time(), bag.get_end_time()
            window = [rospy.Time.from_sec(start_s + fraction * (end_s - start_s)) for fraction in STRETCHES[number]]
            for topic, message, stamp in bag.read_messages(start_time=window[0], end_time=window[1], raw=True):
                output.write(topic, message, stamp, raw=True)
        build_map(self.folder, "map", rig=made.true_rig)
        bag_path.unlink()


def merges(lot, results):
    """Twenty sessions of five drives, one after the other: of two days, a dusk and two nights, each in stretches."""
    path = lot.folder("merges") / "living.vmap"
    sessions, joined, runs = [lot.first()], [], []
    shutil.copy(sessions[0].folder / "map.vmap", path)
    for made in (lot.other(1), lot.other(50, exchanged=1.0), lot.other(70, *DUSK), lot.other(71, *NIGHT), lot.other(72, *NIGHT)):
        for number in range(len(STRETCHES)):
            sessions.append(Stretch(made, number))
            say(f"{path}: merging {sessions[-1].folder}")
            runs.append(run_tool("merge_maps", path.parent / f"merge_{len(runs)}.log", "--map", path, "--session",
                                 sessions[-1].folder / "map.vmap", "--output", path, "--max-versions", 2))
            joined.append(runs[-1].found["sessions"][0]["joined"])
    # With three more drives than the first, every place has as many as the map keeps.
    filling = 3 * len(STRETCHES)
    memory_gb = [max(run.peak_gb for run in part) for part in (runs[:filling], runs[filling:])]
    mapped = LivingMap(path, sessions)
    results.add(f"Many sessions merged, image scale {lot.args.image_scale:g}", (f"lot {lot.seed}", [
        figure("sessions joined, of 20", sum(joined), equal=len(runs)), *mapped.figures(),
        Figure("memory, most, until four drives are in", memory_gb[0], "GB"),
        figure("the same, later over earlier", memory_gb[1] / memory_gb[0], at_most=1.1),
        Figure("time of a merge, median", float(np.median([run.wall_s for run in runs])), "s"),
        *localization_figures(localize(lot.other(73, *NIGHT), mapped, "in_merged_map"), 98, 2.5)]))


def other_car_park(lot, results):
    """A drive of another car park must be kept apart."""
    other = Lot(lot.args, lot.seed + 1).first()
    path = lot.folder("other") / "merged.vmap"
    found = run_tool("merge_maps", path.with_suffix(".log"), "--map", lot.first().folder / "map.vmap", "--session",
                     other.folder / "map.vmap", "--output", path).found["sessions"][0]
    results.add(f"Another car park, image scale {lot.args.image_scale:g}", (f"lots {lot.seed} and {lot.seed + 1}", [
        figure("joined", int(found["joined"]), equal=0), Figure("loops rejected", found["num_rejected_loops"]),
        Figure("loops undecided", found["num_undecided_loops"])]))


def large(lot, results):
    """Localization in a map of many kilometres, which is made of copies of two lots' maps, and in that of one lot."""
    folder, maps = lot.folder("large"), [lot.first().folder / "map.vmap", Lot(lot.args, lot.seed + 1).first().folder / "map.vmap"]
    made, columns = lot.other(1), []
    for name, length_m in (("one lot", 1.0), (f"{lot.args.length_km:g} km", 1e3 * lot.args.length_km)):
        path = folder / f"{name.split(' ', maxsplit=1)[0]}.vmap"
        repeated = run_tool("repeat_map", path.with_suffix(".log"), "--maps", *maps, "--length-m", length_m, "--output", path)
        mapped = LivingMap(maps[0], [lot.first()])  # the first copy is where the lot was mapped
        mapped.path = path
        words = ("--bag", made.bag, "--rig", made.true_rig, "--map", path, "--options", CONFIG / "localization.yaml")
        output = folder / f"{path.stem}.tum"
        run = run_tool("localize_drive", output.with_suffix(".log"), *words, "--output", output, *STARTS)
        result = LocalizationErrors(f"{output}.csv", made.trajectory, mapped)
        seconds = result.latency_s[::STARTS[1]]
        columns.append((name, [
            Figure("length", repeated.found["length_m"] / 1e3, "km"), Figure("keyframes", repeated.found["num_keyframes"]),
            Figure("file per 100 m of drive", path.stat().st_size / repeated.found["length_m"] / 1e4, "MB"),
            figure("until the map is open", run.found["map_ready_s"], "s", at_most=0.2),
            figure("memory of localization", 1e3 * run.peak_gb, "MB", at_most=500), *start_figures(result),
            Figure("time of a frame, median", 1e3 * float(np.median(result.latency_s)), "ms"),
            Figure("time of a start's first frame, median", 1e3 * float(np.median(seconds)), "ms"),
            figure("the same, most", float(seconds.max()), "s", at_most=1.0)]))
        path.unlink()
    results.add(f"A large map, lots {lot.seed} and {lot.seed + 1}, image scale {lot.args.image_scale:g}", *columns)


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("living_map", "Living maps", args)
    steps = {"days": days, "exchanged": exchanged, "night": night, "summary": summary, "merges": merges,
             "other": other_car_park, "large": large}
    for seed in args.seeds:
        for part in args.parts:
            steps[part](Lot(args, seed), results)
    results.end()


if __name__ == "__main__":
    main()
