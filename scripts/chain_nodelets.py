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
        self.grids[message.header.stamp.to_nsec()] = np.array(message.data, np.int8).reshape(message.info.height,
                                                                                             message.info.width)
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


def free_port():
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def replay(work, map_path, bag, rig, folder):
    """Numbers of poses and grids that came, and of those that equal the offline tools'."""
    poses, grids = offline_poses(work / "localization" / "poses.tum.csv"), offline_grids(work / "obstacles" / "maps")
    port = free_port()
    uri = f"http://localhost:{port}"
    os.environ.update({"ROS_MASTER_URI": uri, "ROS_HOSTNAME": "localhost", "ROS_HOME": str(folder / "ros_home")})
    words = ["roslaunch", "-p", str(port), "vcharge_launch", "vcharge.launch", f"rig:={rig}", f"map:={map_path}", f"bag:={bag}",
             f"range_options:={work / 'obstacles' / 'range_options.yaml'}", "lossless_replay:=true"]
    with open(folder / "roslaunch.log", "w", encoding="utf-8") as log:
        launched = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
    try:
        wait_for_master(uri)
        recorder = Recorder()
        start = time.monotonic()
        while len(recorder.grids) < len(grids) or len(recorder.poses) < len(poses):
            time.sleep(0.5)
            silent_s = time.monotonic() - recorder.last_s
            if launched.poll() is not None or silent_s > (SILENCE_S if recorder.grids else START_S):
                break
        took_s = time.monotonic() - start
    finally:
        os.killpg(launched.pid, signal.SIGINT)
        try:
            launched.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(launched.pid, signal.SIGKILL)
    equal_poses = sum(stamp in poses and np.allclose(pose, poses[stamp], rtol=0, atol=1e-7)
                      for stamp, pose in recorder.poses.items())
    equal_grids = sum(stamp in grids and np.array_equal(grid, grids[stamp]) for stamp, grid in recorder.grids.items())
    return {"poses": len(poses), "equal_poses": int(equal_poses), "grids": len(grids), "equal_grids": int(equal_grids),
            "took_s": took_s}


def wait_for_master(uri):
    import rosgraph
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline:
        if rosgraph.is_master_online(uri):
            return
        time.sleep(0.2)
    raise RuntimeError(f"{uri}: roslaunch has brought up no master")
