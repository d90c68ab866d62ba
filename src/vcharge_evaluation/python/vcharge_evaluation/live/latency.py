"""Rates and latencies of the nodelets on a drive that is replayed as fast as it was recorded. A result's latency is the
time from the publication of its newest image to the result's arrival here."""
import argparse
import os
import pathlib
import tempfile
import threading
import time

import numpy as np
import yaml

from vcharge_evaluation.live.launch import START_S, Launch
from vcharge_evaluation.results import Figure, Results, add_arguments

RESULTS = {"/localization/pose": "geometry_msgs/PoseWithCovarianceStamped", "/obstacles/grid": "nav_msgs/OccupancyGrid"}
NEEDS_MAP = ("vcharge.launch", "localization.launch")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "latency_evaluation")
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--map", type=pathlib.Path, help="for vcharge.launch and localization.launch")
    parser.add_argument("--launch", default="vcharge.launch", help="vcharge.launch, localization.launch or obstacles.launch")
    parser.add_argument("--rate", type=float, default=1.0, help="speed of the replay")
    parser.add_argument("--range-options", type=pathlib.Path, help="instead of config/dense_obstacles.yaml")
    args = parser.parse_args()
    if args.launch in NEEDS_MAP and args.map is None:
        parser.error(f"{args.launch} needs --map")
    return args


class Listener:
    """Arrival (monotonic seconds) of the images and the results of each stamp."""

    def __init__(self, camera):
        import roslib.message
        import rospy
        self.images, self.results = {}, {topic: {} for topic in RESULTS}
        self.lock, self.last_s = threading.Lock(), time.monotonic()
        rospy.init_node("measure_latency", anonymous=True, disable_signals=True)
        # camera_info is published with each image, and is small.
        info = roslib.message.get_message_class("sensor_msgs/CameraInfo")
        rospy.Subscriber(f"/camera/{camera}/camera_info", info, lambda message: self.take(self.images, message), queue_size=None)
        for topic, kind in RESULTS.items():
            rospy.Subscriber(topic, roslib.message.get_message_class(kind),
                             lambda message, came=self.results[topic]: self.take(came, message), queue_size=None)

    def take(self, came, message):
        now = time.monotonic()
        with self.lock:
            came.setdefault(message.header.stamp.to_nsec(), now)
            self.last_s = now


def main():
    args = arguments()
    camera = next(iter(yaml.safe_load(args.rig.read_text())["cameras"]))
    words = [f"bag:={args.bag.resolve()}", f"rig:={args.rig.resolve()}", f"rate:={args.rate}"]
    words += [f"map:={args.map.resolve()}"] if args.launch in NEEDS_MAP else []
    words += [f"range_options:={args.range_options.resolve()}"] if args.range_options else []
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder, Launch(pathlib.Path(folder), args.launch, *words) as launched:
        listener = Listener(camera)
        while launched.runs() and time.monotonic() - listener.last_s < (5.0 if listener.images else START_S):
            time.sleep(0.5)
    stamps = sorted(listener.images)
    if len(stamps) < 2:
        raise SystemExit("no images came")
    duration_s = (stamps[-1] - stamps[0]) * 1e-9 / args.rate
    figures = [Figure("load of the machine before", load),
               Figure("images per second", (len(stamps) - 1) / duration_s)]
    for topic, came in listener.results.items():
        latencies = np.array([came[stamp] - listener.images[stamp] for stamp in came if stamp in listener.images])
        if len(latencies) > 1:
            span_s = (max(came) - min(came)) * 1e-9 / args.rate
            figures += [Figure(f"{topic}: per second, first to last", (len(latencies) - 1) / span_s),
                        Figure(f"{topic}: stamps with a result, of {len(stamps)}", len(latencies)),
                        Figure(f"{topic}: latency, median", 1e3 * float(np.median(latencies)), "ms"),
                        Figure(f"{topic}: latency, 95 %", 1e3 * float(np.percentile(latencies, 95)), "ms"),
                        Figure(f"{topic}: latency, largest", 1e3 * float(latencies.max()), "ms")]
    results = Results("latency", "Rates and latencies of the nodelets", args)
    results.add(f"Replay through {args.launch}", (f"{args.bag.name}, speed {args.rate:g}", figures))
    results.end()


if __name__ == "__main__":
    main()
