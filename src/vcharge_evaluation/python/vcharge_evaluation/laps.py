"""Long drives from one lap: the same drive again and again, with new image noise and odometry that goes on."""
import copy

import numpy as np
import rosbag
import rospy

from vcharge_evaluation.poses import pose_of, transform

IMAGE_NOISE = 2.0  # gray levels, in addition to the lap's
# Between two laps the car moves from the end of a lap to its start without images.
GAP_SPEED_M_PER_S, GAP_STEP_S = 1.0, 0.02
MIN_GAP_S = 1.0


def planar(x_m, y_m, yaw_rad):
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    matrix[:2, 3] = x_m, y_m
    return matrix


def yaw_of(matrix):
    return float(np.arctan2(matrix[1, 0], matrix[0, 0]))


def place(message, matrix):
    """Sets the planar pose of an odometry message."""
    yaw_rad = yaw_of(matrix)
    message.pose.pose.position.x, message.pose.pose.position.y = map(float, matrix[:2, 3])
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = np.sin(yaw_rad / 2), np.cos(yaw_rad / 2)
    return message


def shifted(original, shift_s):
    """A copy of a message, so much later."""
    message = copy.deepcopy(original)
    message.header.stamp += rospy.Duration.from_sec(shift_s)
    return message


class Lap:
    """Messages of a drive, and how its end is followed by its start."""

    def __init__(self, drive):
        with rosbag.Bag(str(drive / "drive.bag")) as bag:
            self.messages = [(topic, message) for topic, message, _ in bag.read_messages()
                             if topic == "/odom" or topic.endswith("/image_raw")]
        odometry = [message for topic, message in self.messages if topic == "/odom"]
        self.first, self.last = (planar(*self.planar_pose(message)) for message in (odometry[0], odometry[-1]))
        self.template = odometry[-1]
        self.duration_s = (odometry[-1].header.stamp - odometry[0].header.stamp).to_sec()
        self.truth = np.loadtxt(drive / "drive_truth" / "trajectory.tum")
        start, end = (transform(row[1:4], row[4:8]) for row in (self.truth[0], self.truth[-1]))
        step = np.linalg.inv(end) @ start
        self.gap = (step[0, 3], step[1, 3], yaw_of(step))
        self.gap_s = MIN_GAP_S + np.hypot(*self.gap[:2]) / GAP_SPEED_M_PER_S
        self.length_m = np.linalg.norm(np.diff(self.truth[:, 1:4], axis=0), axis=1).sum() + np.hypot(*self.gap[:2])

    @staticmethod
    def planar_pose(message):
        (x_m, y_m, _), quaternion = pose_of(message)
        return x_m, y_m, yaw_of(transform([0, 0, 0], quaternion))


def drive_laps(lap, folder, laps):
    """Writes FOLDER/drive.bag and FOLDER/drive_truth/trajectory.tum of so many laps."""
    (folder / "drive_truth").mkdir(parents=True, exist_ok=True)
    noise, odom_from_lap, truth = np.random.default_rng(1), np.eye(4), []
    temporary = folder / "drive.bag.tmp"
    with rosbag.Bag(str(temporary), "w") as bag:
        for number in range(laps):
            shift_s = number * (lap.duration_s + lap.gap_s)
            for topic, original in lap.messages:
                message = shifted(original, shift_s)
                if topic == "/odom":
                    place(message, odom_from_lap @ planar(*Lap.planar_pose(message)))
                else:
                    pixels = np.frombuffer(message.data, np.uint8).astype(np.float32)
                    pixels += IMAGE_NOISE * noise.standard_normal(pixels.shape, np.float32)
                    message.data = np.clip(np.rint(pixels), 0, 255).astype(np.uint8).tobytes()
                bag.write(topic, message, message.header.stamp)
            truth.append(lap.truth + np.array([shift_s] + 7 * [0.0]))
            for step_s in np.arange(GAP_STEP_S, lap.gap_s, GAP_STEP_S):
                part = planar(*(step_s / lap.gap_s * value for value in lap.gap))
                message = shifted(lap.template, shift_s + step_s)
                bag.write("/odom", place(message, odom_from_lap @ lap.last @ part), message.header.stamp)
            odom_from_lap = odom_from_lap @ lap.last @ planar(*lap.gap) @ np.linalg.inv(lap.first)
    temporary.rename(folder / "drive.bag")
    np.savetxt(folder / "drive_truth" / "trajectory.tum", np.vstack(truth), fmt="%.9f")
