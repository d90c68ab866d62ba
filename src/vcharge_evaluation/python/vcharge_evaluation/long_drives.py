"""Long drives from short ones: one place after the other, each several times with other gray levels, which show other features."""
import copy

import numpy as np
import rosbag
import rospy

import vcharge
from vcharge_evaluation.poses import pose_of, transform

# From the end of one place to the start of the next, so far away, the car sees nothing: its images are black.
SPACING_M, GAP_S, GAP_STEP_S, BLACK_IMAGES_STEP_S = 100.0, 8.0, 0.02, 1.0


def gray_levels():
    """Tables of gray levels that order the pixels differently. Continuous: each goes up and down in one to three slopes."""
    levels = np.arange(256)
    for num_slopes in (1, 2, 3):
        rising = 255 - np.abs(255 - num_slopes * levels % 510)
        yield from (rising.astype(np.uint8), (255 - rising).astype(np.uint8))


def planar(x_m, y_m, yaw_rad):
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    matrix[:2, 3] = x_m, y_m
    return matrix


def planar_values(matrix):
    return matrix[0, 3], matrix[1, 3], float(np.arctan2(matrix[1, 0], matrix[0, 0]))


def odometry_pose(message):
    (x_m, y_m, _), quaternion = pose_of(message)
    return planar(x_m, y_m, planar_values(transform([0, 0, 0], quaternion))[2])


def moved_odometry(original, shift_s, odom_from_vehicle):
    """A copy of an odometry message, so much later, at another pose."""
    message = later(original, shift_s)
    x_m, y_m, yaw_rad = planar_values(odom_from_vehicle)
    message.pose.pose.position.x, message.pose.pose.position.y = float(x_m), float(y_m)
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = np.sin(yaw_rad / 2), np.cos(yaw_rad / 2)
    return message


def later(original, shift_s):
    message = copy.deepcopy(original)
    message.header.stamp += rospy.Duration.from_sec(shift_s)
    return message


class Place:
    """A drive through one place: its messages and its truth."""

    def __init__(self, drive):
        self.levels = np.arange(256, dtype=np.uint8)
        with rosbag.Bag(str(drive.bag)) as bag:
            self.messages = [(topic, message) for topic, message, _ in bag.read_messages()
                             if topic == "/odom" or topic.endswith("/image_raw")]
        odometry = [message for topic, message in self.messages if topic == "/odom"]
        self.last_odometry = odometry[-1]
        self.last_images = dict((topic, message) for topic, message in self.messages if topic != "/odom")
        self.first, self.last = odometry_pose(odometry[0]), odometry_pose(odometry[-1])
        self.start_s = odometry[0].header.stamp.to_sec()
        self.duration_s = odometry[-1].header.stamp.to_sec() - self.start_s
        self.truth = vcharge.read_trajectory(drive.trajectory).rows

    def with_levels(self, levels):
        """The same place with other gray levels; the messages are shared."""
        place = copy.copy(self)
        place.levels = levels
        return place

    def true_pose(self, row):
        """World from vehicle, as a planar pose."""
        return planar(*planar_values(transform(self.truth[row, 1:4], self.truth[row, 4:8])))

    def image(self, original, shift_s):
        message = later(original, shift_s)
        message.data = self.levels[np.frombuffer(message.data, np.uint8)].tobytes()
        return message


def join(places, folder):
    """Writes FOLDER/drive.bag and FOLDER/drive_truth/trajectory.tum of a drive through all places; returns its length (m) and
    duration (s)."""
    (folder / "drive_truth").mkdir(parents=True, exist_ok=True)
    temporary = folder / "drive.bag.tmp"
    odom_from_place, shift_s, truth = np.eye(4), 0.0, []
    with rosbag.Bag(str(temporary), "w") as bag:
        for number, place in enumerate(places):
            for topic, message in place.messages:
                moved = (moved_odometry(message, shift_s, odom_from_place @ odometry_pose(message)) if topic == "/odom" else
                         place.image(message, shift_s))
                bag.write(topic, moved, moved.header.stamp)
            truth.append(place.truth + np.array([shift_s, number * SPACING_M] + 6 * [0.0]))
            if number + 1 == len(places):
                break
            following = places[number + 1]
            gap = np.linalg.inv(place.true_pose(-1)) @ planar(SPACING_M, 0, 0) @ following.true_pose(0)
            for step_s in np.arange(GAP_STEP_S, GAP_S, GAP_STEP_S):
                part = planar(*(step_s / GAP_S * value for value in planar_values(gap)))
                moved = moved_odometry(place.last_odometry, shift_s + step_s, odom_from_place @ place.last @ part)
                bag.write("/odom", moved, moved.header.stamp)
            for step_s in np.arange(BLACK_IMAGES_STEP_S, GAP_S, BLACK_IMAGES_STEP_S):
                for topic, message in place.last_images.items():
                    black = later(message, shift_s + step_s)
                    black.data = bytes(len(message.data))
                    bag.write(topic, black, black.header.stamp)
            odom_from_place = odom_from_place @ place.last @ gap @ np.linalg.inv(following.first)
            shift_s += place.start_s + place.duration_s + GAP_S - following.start_s
    temporary.rename(folder / "drive.bag")
    truth = np.vstack(truth)
    np.savetxt(folder / "drive_truth" / "trajectory.tum", truth, fmt="%.9f")
    length_m = np.linalg.norm(np.diff(truth[:, 1:4], axis=0), axis=1).sum()
    return length_m, truth[-1, 0] - truth[0, 0]
