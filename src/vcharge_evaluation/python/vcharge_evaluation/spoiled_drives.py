"""Recordings and rigs with a mistake in them, to see whether calibration notices."""
import copy
import math

import rosbag
import yaml


def write_wrong_focal(source, target, camera="left", factor=1.05):
    """A rig file whose camera has a focal length that is too long."""
    rig = yaml.safe_load(source.read_text())
    intrinsics = rig["cameras"][camera]["intrinsics"]
    for key in ("gamma1", "gamma2", "fx", "fy"):
        if key in intrinsics:
            intrinsics[key] *= factor
    target.write_text(yaml.safe_dump(rig, sort_keys=False))


class NegativeOdometry:
    """Integrates odometry again with the sign of its distance or its turn changed, as a wheel counter or a gyro that was
    wired the wrong way round gives it."""

    def __init__(self, field):
        self.turn_sign, self.length_sign = (-1, 1) if field == "turn" else (1, -1)
        self.last, self.x, self.y, self.yaw = None, 0.0, 0.0, 0.0

    def change(self, message):
        pose = message.pose.pose
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        x, y = pose.position.x, pose.position.y
        if self.last is not None:
            last_x, last_y, last_yaw = self.last
            turn = math.remainder(yaw - last_yaw, 2.0 * math.pi)
            middle = last_yaw + 0.5 * turn
            length = self.length_sign * ((x - last_x) * math.cos(middle) + (y - last_y) * math.sin(middle))
            turn *= self.turn_sign
            self.x += length * math.cos(self.yaw + 0.5 * turn)
            self.y += length * math.sin(self.yaw + 0.5 * turn)
            self.yaw += turn
        self.last = (x, y, yaw)
        message = copy.deepcopy(message)
        message.pose.pose.position.x, message.pose.pose.position.y = self.x, self.y
        message.pose.pose.orientation.z = math.sin(0.5 * self.yaw)
        message.pose.pose.orientation.w = math.cos(0.5 * self.yaw)
        return message


def write_negative_odometry(source, target, field):
    """Writes a bag whose odometry has the wrong sign of 'turn' or 'distance', without wheel ticks."""
    odometry = NegativeOdometry(field)
    with rosbag.Bag(str(source)) as bag, rosbag.Bag(str(target), "w") as output:
        for topic, message, stamp in bag.read_messages():
            if topic == "/odom":
                output.write(topic, odometry.change(message), stamp)
            elif topic != "/wheel_ticks":
                output.write(topic, message, stamp)
