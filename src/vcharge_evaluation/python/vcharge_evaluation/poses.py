"""Poses in files and bags, as arrays."""
import numpy as np
import rosbag

import vcharge


def rotations(quaternions):
    """Rotation matrices (N x 3 x 3) of quaternions (N x 4, x y z w)."""
    return vcharge.rotation_matrices(quaternions)


def transform(translation, quaternion):
    """4 x 4 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotations([quaternion])[0]
    matrix[:3, 3] = translation
    return matrix


def nearest(times, wanted):
    """Indices of the entries of `times` (ascending) nearest to the wanted ones."""
    right = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    return np.where(wanted - times[right - 1] < times[right] - wanted, right - 1, right)


def at_stamps(trajectory, times):
    """Rows of a TUM file (N x 8) nearest to the times."""
    rows = vcharge.read_trajectory(trajectory).rows
    return rows[nearest(rows[:, 0], times)]


def stamp_ns(text):
    """Nanoseconds of a decimal number of seconds, exactly."""
    seconds, _, fraction = text.partition(".")
    return int(seconds) * 10**9 + int((fraction + "0" * 9)[:9])


def pose_of(message):
    """Position and quaternion of an odometry or pose message."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    return [p.x, p.y, p.z], [q.x, q.y, q.z, q.w]


def write_odometry(bag_path, path):
    """Writes a bag's odometry as TUM text, the last message of a repeated stamp, which corrects those before; returns its
    duration (s) and its number of stamps with images."""
    stamps, lines = set(), {}
    with rosbag.Bag(str(bag_path)) as bag:
        for topic, message, _ in bag.read_messages():
            if topic == "/odom":
                stamp, (position, quaternion) = message.header.stamp, pose_of(message)
                lines[stamp.to_nsec()] = f"{stamp.secs}.{stamp.nsecs:09d} " + " ".join(map(str, [*position, *quaternion])) + "\n"
            elif topic.endswith("/image_raw"):
                stamps.add(message.header.stamp.to_nsec())
    path.write_text("".join(lines[stamp] for stamp in sorted(lines)), encoding="utf-8")
    return (max(stamps) - min(stamps)) * 1e-9, len(stamps)
