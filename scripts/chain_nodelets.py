"""A drive through vcharge.launch without losses, compared with what the offline tools made of it."""
import csv
import os
import signal
import socket
import subprocess
import time

import cv2
import numpy as np

SILENCE_S = 20.0
START_S = 60.0


class Recorder:
    """Keeps what the nodelets publish; a process of its own would need a bag."""

    def __init__(self):
        import rospy
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from nav_msgs.msg import OccupancyGrid

        self.poses, self.grids, self.last_s = {}, {}, time.monotonic()
        rospy.init_node("chain_recorder", anonymous=True, disable_signals=True)
        rospy.Subscriber("/localization/pose", PoseWithCovarianceStamped, self.take_pose, queue_size=None)
        rospy.Subscriber("/obstacles/grid", OccupancyGrid, self.take_grid, queue_size=None)

    def take_pose(self, message):
        p, q = message.pose.pose.position, message.pose.pose.orientation
        self.poses[message.header.stamp.to_nsec()] = np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
        self.last_s = time.monotonic()

    def take_grid(self, message):
        # Several of one stamp where odometry ran ahead of the range maps.
        self.grids.setdefault(message.header.stamp.to_nsec(), []).append(
            np.array(message.data, np.int8).reshape(message.info.height, message.info.width))
        self.last_s = time.monotonic()


def stamp_of(text):
    seconds, _, fraction = text.partition(".")
    return int(seconds) * 10**9 + int((fraction + "0" * 9)[:9])


def offline_poses(path):
    with open(path, encoding="utf-8") as file:
        return {stamp_of(row["time_s"]): np.array([float(row[key]) for key in ("tx", "ty", "tz", "qx", "qy", "qz", "qw")])
                for row in csv.DictReader(file) if row["tx"]}


def offline_grids(folder):
    """map_server's picture, whose first row is the highest y, as a grid message has it."""
    grids = {}
    for path in sorted(folder.glob("*.pgm")):
        picture = cv2.flip(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), 0).astype(int)
        grids[int(path.stem)] = np.where(picture == 254, 0, np.where(picture == 0, 100, -1)).astype(np.int8)
    return grids


class Launch:
    """A launch file of vcharge_launch under a ROS master of its own, which this process talks to while it lasts."""

    def __init__(self, folder, name, *words):
        port = free_port()
        uri = f"http://localhost:{port}"
        os.environ.update({"ROS_MASTER_URI": uri, "ROS_HOSTNAME": "localhost", "ROS_HOME": str(folder / "ros_home")})
        with open(folder / "roslaunch.log", "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(["roslaunch", "-p", str(port), "vcharge_launch", name, *map(str, words)], stdout=log,
                                            stderr=subprocess.STDOUT, start_new_session=True)

    def __enter__(self):
        import rosgraph
        deadline = time.monotonic() + START_S
        while not rosgraph.is_master_online(os.environ["ROS_MASTER_URI"]):
            if time.monotonic() > deadline or not self.runs():
                self.stop()
                raise RuntimeError("roslaunch has brought up no master: see roslaunch.log")
            time.sleep(0.2)
        return self

    def __exit__(self, *_):
        self.stop()

    def runs(self):
        return self.process.poll() is None

    def stop(self):
        if not self.runs():
            return
        os.killpg(self.process.pid, signal.SIGINT)
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)


def free_port():
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def replay(work, map_path, bag, rig, folder):
    """Numbers of poses and grids that came, and of those that equal the offline tools'."""
    poses, grids = offline_poses(work / "localization" / "poses.tum.csv"), offline_grids(work / "obstacles" / "maps")
    with Launch(folder, "vcharge.launch", f"rig:={rig}", f"map:={map_path}", f"bag:={bag}",
                f"range_options:={work / 'obstacles' / 'range_options.yaml'}", "lossless_replay:=true") as launched:
        recorder = Recorder()
        start = time.monotonic()
        while not (grids.keys() <= recorder.grids.keys() and poses.keys() <= recorder.poses.keys()):
            time.sleep(0.5)
            silent_s = time.monotonic() - recorder.last_s
            if not launched.runs() or silent_s > (SILENCE_S if recorder.grids else START_S):
                break
        took_s = time.monotonic() - start
    equal_poses = sum(stamp in poses and np.allclose(pose, poses[stamp], rtol=0, atol=1e-7)
                      for stamp, pose in recorder.poses.items())
    equal_grids = sum(any(np.array_equal(grid, came) for came in recorder.grids.get(stamp, []))
                      for stamp, grid in grids.items())
    return {"poses": len(poses), "equal_poses": int(equal_poses), "grids": len(grids), "equal_grids": int(equal_grids),
            "took_s": took_s}
