#!/usr/bin/env python3
"""Rates and latencies of the nodelets on a drive that is replayed as fast as it was recorded:

    scripts/measure_online.py --bag DRIVE.bag --rig rig.yaml --map LOT.vmap [--launch vcharge.launch]

A result's latency is from the moment its newest image was published to the moment the result arrives here. Source
build/devel/setup.bash first."""
import argparse
import os
import pathlib
import tempfile
import threading
import time

import numpy as np
import yaml

from chain_nodelets import START_S, Launch

RESULTS = {"/localization/pose": "geometry_msgs/PoseWithCovarianceStamped", "/obstacles/grid": "nav_msgs/OccupancyGrid"}
NEEDS_MAP = ("vcharge.launch", "localization.launch")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
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
    """When images of each stamp were published, and when results of the stamp came (monotonic seconds)."""

    def __init__(self, camera):
        import roslib.message
        import rospy
        self.images, self.results = {}, {topic: {} for topic in RESULTS}
        self.lock, self.last_s = threading.Lock(), time.monotonic()
        rospy.init_node("measure_online", anonymous=True, disable_signals=True)
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
    print(f"load before: {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as folder, Launch(pathlib.Path(folder), args.launch, *words) as launched:
        listener = Listener(camera)
        while launched.runs() and time.monotonic() - listener.last_s < (5.0 if listener.images else START_S):
            time.sleep(0.5)
    stamps = sorted(listener.images)
    if len(stamps) < 2:
        raise SystemExit("measure_online: no images came")
    duration_s = (stamps[-1] - stamps[0]) * 1e-9 / args.rate
    print(f"images: {len(stamps)}, {(len(stamps) - 1) / duration_s:.1f} a second")
    for topic, came in listener.results.items():
        latencies = np.array([came[stamp] - listener.images[stamp] for stamp in came if stamp in listener.images])
        if len(latencies) > 1:
            came_s = (max(came) - min(came)) * 1e-9 / args.rate
            print(f"{topic}: {len(latencies)} of {len(stamps)} stamps, {(len(latencies) - 1) / came_s:.1f} a second from the first to "
                  f"the last; latency median, 95 %, largest: {1e3 * np.median(latencies):.0f}, "
                  f"{1e3 * np.percentile(latencies, 95):.0f}, {1e3 * latencies.max():.0f} ms")


if __name__ == "__main__":
    main()
