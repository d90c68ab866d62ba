"""Replays a drive through vcharge.launch without losses and compares the results with the offline tools'."""
import csv
import time

import numpy as np

import vcharge
from vcharge_evaluation.live.launch import START_S, Launch
from vcharge_evaluation.poses import pose_of, stamp_ns

SILENCE_S = 20.0


class Recorder:
    """Keeps the poses and grids that the nodelets publish."""

    def __init__(self):
        import rospy
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from nav_msgs.msg import OccupancyGrid

        self.poses, self.grids, self.last_s = {}, {}, time.monotonic()
        rospy.init_node("chain_recorder", anonymous=True, disable_signals=True)
        rospy.Subscriber("/localization/pose", PoseWithCovarianceStamped, self.take_pose, queue_size=None)
        rospy.Subscriber("/obstacles/grid", OccupancyGrid, self.take_grid, queue_size=None)

    def take_pose(self, message):
        self.poses[message.header.stamp.to_nsec()] = np.concatenate(pose_of(message))
        self.last_s = time.monotonic()

    def take_grid(self, message):
        # A stamp has several grids where odometry was ahead of the range maps.
        self.grids.setdefault(message.header.stamp.to_nsec(), []).append(
            np.array(message.data, np.int8).reshape(message.info.height, message.info.width))
        self.last_s = time.monotonic()


def offline_poses(path):
    with open(path, encoding="utf-8") as file:
        return {stamp_ns(row["time_s"]): np.array([float(row[key]) for key in ("tx", "ty", "tz", "qx", "qy", "qz", "qw")])
                for row in csv.DictReader(file) if row["tx"]}


def offline_grids(folder):
    """Grid messages' arrays of the obstacle maps in a folder, by stamp."""
    return {stamp: vcharge.read_occupancy_grid(folder / f"{stamp}.yaml").state for stamp in vcharge.list_obstacle_maps(folder)}


def replay(work, map_path, bag, rig, folder):
    """Numbers of offline poses and grids, and of those that the nodelets published equal."""
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
