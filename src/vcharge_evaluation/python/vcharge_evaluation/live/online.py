"""Rate, latency, drops, processor time and memory of the nodelets on a drive that is replayed as fast as it was recorded, with
the machine's instruction set, with AVX2, and on one core. A result's latency is the time from the publication of its newest
image to the result's arrival here."""
import argparse
import json
import multiprocessing
import os
import pathlib
import tempfile
import threading
import time

import numpy as np

import vcharge
from vcharge_evaluation.live.flame_graph import Recording, by_stage, draw, shares
from vcharge_evaluation.live.launch import START_S, Launch
from vcharge_evaluation.live.processes import Usage, manager_below
from vcharge_evaluation.results import Figure, Results, add_arguments
from vcharge_evaluation.tools import NoResult

RESULTS = {"/obstacles/grid": "nav_msgs/OccupancyGrid", "/obstacles/objects": "vcharge_msgs/TrackedObjects",
           "/localization/pose": "geometry_msgs/PoseWithCovarianceStamped"}
# Name: what is put before roslaunch, environment, and processors. OpenCV and the kernels of the suite choose their instructions
# themselves.
MACHINES = {
    "as it is": ([], {}, os.cpu_count()),
    "AVX2": ([], {"VCHARGE_INSTRUCTIONS": "avx2", "OPENCV_CPU_DISABLE": "AVX512_COMMON,AVX512_SKX"}, os.cpu_count()),
    "one core": (["taskset", "-c", "0"], {}, 1),
}
# Stages by functions that only they call, for the profile.
STAGES = {
    "objects": ["ObjectTracker::", "ObjectCamera::", "FollowedPoints::", "PersonLikeness::", "lookForPeople"],
    "obstacles": ["ObstacleMapper::", "ObstacleDetector::", "GroundWatch::", "RangeMapReader::"],
    "localization": ["DriveLocalizer::", "MapLocalizer::"],
    "range maps": ["RangeMapper::", "PlaneSweep::", "SweepLevel::", "TileScorer::", "MotionRefinement::", "ScheduledSweeps::"],
}
QUIET_S = 5.0  # without a message the drive is over
BUDGET_WARNING = "the processor budget does not suffice"  # of StageSchedule


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "online_evaluation")
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--map", type=pathlib.Path, help="a map of the place: localization runs too")
    parser.add_argument("--no-objects", action="store_true", help="without what moves")
    parser.add_argument("--machines", nargs="*", default=list(MACHINES), choices=list(MACHINES))
    parser.add_argument("--no-budget", action="store_true", help="stages compete, instead of sharing the processors")
    parser.add_argument("--rate", type=float, default=1.0, help="speed of the replay")
    parser.add_argument("--range-options", type=pathlib.Path, help="instead of config/dense_obstacles.yaml")
    parser.add_argument("--json", type=pathlib.Path, help="write all figures to this file")
    parser.add_argument("--profile", type=pathlib.Path, metavar="SVG",
                        help="sample one more replay with perf, which slows it down, and draw a flame graph")
    args = parser.parse_args()
    for path in (args.bag, args.rig, args.map, args.range_options):
        if path is not None and not path.is_file():
            parser.error(f"{path}: there is no such file")
    for path in (args.json, args.profile):
        if path is not None and not path.resolve().parent.is_dir():
            parser.error(f"{path}: its folder does not exist")
    return args


class Listener:
    """Arrival (monotonic seconds) of the images and the results of each stamp, and what diagnostics say was dropped."""

    def __init__(self, cameras):
        import rospy
        from roslib.message import get_message_class
        self.images, self.lost, self.short_of_time = {}, {}, set()
        self.topics = {f"/dense/{camera}/range/camera_info": "sensor_msgs/CameraInfo" for camera in cameras} | RESULTS
        self.results = {topic: {} for topic in self.topics}
        self.lock, self.last_s = threading.Lock(), time.monotonic()
        self.subscribers = []
        rospy.init_node("measure_online", anonymous=True, disable_signals=True)

        def subscribe(topic, kind, take):
            self.subscribers.append(rospy.Subscriber(topic, get_message_class(kind), take, queue_size=None, tcp_nodelay=True))

        # camera_info is published with each image, and is small.
        subscribe(f"/camera/{cameras[0]}/camera_info", "sensor_msgs/CameraInfo", lambda message: self.take(self.images, message))
        for topic, kind in self.topics.items():
            subscribe(topic, kind, lambda message, came=self.results[topic]: self.take(came, message))
        subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", self.take_diagnostics)

    def take(self, came, message):
        now = time.monotonic()
        with self.lock:
            came.setdefault(message.header.stamp.to_nsec(), now)
            self.last_s = now

    def take_diagnostics(self, message):
        with self.lock:
            for status in message.status:
                if BUDGET_WARNING in status.message:
                    self.short_of_time.add(status.name.partition(":")[0])
                self.lost[status.name] = {pair.key: pair.value for pair in status.values
                                          if pair.key.startswith("dropped") or pair.key.endswith("left_out")}

    def end(self):
        for subscriber in self.subscribers:
            subscriber.unregister()


def name_of(topic):
    return topic.replace("/camera_info", "")


def figures_of(listener, usage, rate):
    """Figures of one replay. NoResult without images."""
    stamps = sorted(listener.images)
    if len(stamps) < 2:
        raise NoResult("no images came")
    duration_s = (stamps[-1] - stamps[0]) * 1e-9 / rate
    yield Figure("images of a camera per second", (len(stamps) - 1) / duration_s)
    for topic, came in listener.results.items():
        latencies = np.array([came[stamp] - listener.images[stamp] for stamp in came if stamp in listener.images])
        if len(latencies) < 2:
            continue
        yield Figure(f"{name_of(topic)}: per second", (len(latencies) - 1) / ((max(came) - min(came)) * 1e-9 / rate))
        yield Figure(f"{name_of(topic)}: stamps without a result, of {len(stamps)}", len(stamps) - len(latencies))
        for what, value in (("median", np.median(latencies)), ("95 %", np.percentile(latencies, 95)), ("worst", latencies.max())):
            yield Figure(f"{name_of(topic)}: latency, {what}", 1e3 * float(value), "ms")
    for name, lost in sorted(listener.lost.items()):
        for key, value in lost.items():
            yield Figure(f"{name}: {key}", int(value))
    yield Figure("stages that warn that their budget does not suffice", ", ".join(sorted(listener.short_of_time)) or "none")
    yield Figure("manager: processor seconds per second", usage.load)
    yield Figure("manager: memory, largest", usage.peak_mb, "MB")


def measure(args, cameras, machine, is_sampled):
    """Replays the drive once. Returns figures: of a sampled replay, the stages' parts of the processor time."""
    prefix, environment, processors = MACHINES[machine]
    words = [f"bag:={args.bag.resolve()}", f"rig:={args.rig.resolve()}", f"rate:={args.rate}",
             f"objects:={'false' if args.no_objects else 'true'}", f"processors:={0 if args.no_budget else processors}"]
    words += [f"map:={args.map.resolve()}"] if args.map else []
    words += [f"range_options:={args.range_options.resolve()}"] if args.range_options else []
    launch = "vcharge.launch" if args.map else "obstacles.launch"
    with tempfile.TemporaryDirectory() as folder, Launch(pathlib.Path(folder), launch, *words, prefix=prefix,
                                                         environment=environment) as launched:
        listener, usage, recording = Listener(cameras), Usage(), None
        while launched.runs() and time.monotonic() - listener.last_s < (QUIET_S if listener.images else START_S):
            time.sleep(0.5)
            if listener.images and time.monotonic() - listener.last_s < 1.0:  # not after the drive
                manager = manager_below(launched.process.pid)
                usage.sample(manager)
                if is_sampled and recording is None and manager is not None:
                    recording = Recording(manager, f"{folder}/perf.data")
        listener.end()
        return profile(recording, args.profile) if recording else list(figures_of(listener, usage, args.rate))


def profile(recording, path):
    """Draws the flame graph. Returns the stages' shares of the processor time as figures."""
    recording.stop()
    stacks = by_stage(recording.stacks(), STAGES)
    path.write_text(draw(stacks, "Processor time of the nodelets while they run together"))
    return [Figure(f"processor time, part of {name}", 100 * part, "%") for name, part in shares(stacks).items()]


def main():
    args = arguments()
    cameras = list(vcharge.read_rig(args.rig).cameras)
    load = Figure("load of the machine before", os.getloadavg()[0])
    results, found = Results("online", "The nodelets online", args), {}
    for machine in args.machines:
        # A process uses one ROS master.
        with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as apart:
            try:
                figures = apart.apply(measure, (args, cameras, machine, False))
                figures += apart.apply(measure, (args, cameras, machine, True)) if args.profile and not found else []
            except NoResult as error:
                raise SystemExit(f"{args.bag}: {error}") from error
        results.add(f"Replay, speed {args.rate:g}", (machine, [load, *figures]))
        found[machine] = {figure.name: figure.value for figure in [load, *figures]}
    if args.json:
        args.json.write_text(json.dumps(found, indent=1) + "\n")
    results.end()


if __name__ == "__main__":
    main()
