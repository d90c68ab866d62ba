"""Recordings and rigs with a mistake in them, to see whether calibration notices."""
import copy
import math

import rosbag
import yaml


def magnify(intrinsics, factor):
    """Changes the focal lengths of a camera of any model."""
    for key in {"gamma1", "gamma2", "fx", "fy"} & intrinsics.keys():
        intrinsics[key] *= factor


def write_heated_rig(rig_path, path, focal, shift_px):
    """Writes a rig of lenses that were cold: other focal lengths (relative) and principal points, with signs that alternate
    between the cameras. Returns what each camera's image deviates by: the focal length's logarithm, the shift."""
    rig = yaml.safe_load(rig_path.read_text())
    truth = {}
    for number, (name, camera) in enumerate(rig["cameras"].items()):
        signs = [1 - 2 * (number >> bit & 1) for bit in (0, 1)]
        values = camera["intrinsics"]
        magnify(values, 1 / (1 + signs[0] * focal))
        for keys, sign in ((("u0", "cx"), signs[1]), (("v0", "cy"), -signs[0])):
            values[next(key for key in keys if key in values)] -= sign * shift_px
        truth[name] = [math.log1p(signs[0] * focal), signs[1] * shift_px, -signs[0] * shift_px]
    path.write_text(yaml.safe_dump(rig, sort_keys=False))
    return truth


def write_timed_rig(source, path, readout_s, direction="down", stamp_tolerance_s=0.0):
    """A rig file whose cameras have rolling shutters, or stamps of their own. Returns its path."""
    rig = yaml.safe_load(source.read_text())
    rig["stamp_tolerance_s"] = stamp_tolerance_s
    for camera in rig["cameras"].values():
        camera.update(readout_s=readout_s, readout_direction=direction)
    path.write_text(yaml.safe_dump(rig, sort_keys=False))
    return path


def write_wrong_focal(source, target, camera="left", factor=1.05):
    """A rig file whose camera has a focal length that is too long."""
    rig = yaml.safe_load(source.read_text())
    magnify(rig["cameras"][camera]["intrinsics"], factor)
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
