#!/usr/bin/env python3
"""drive_tf_nodelet under a simulated clock: TF and camera_info of a replayed drive, and when it does not publish them."""
import math
import os
import pathlib
import sys
import time
import unittest

import numpy as np
import rospkg
import rospy
import rostest
import tf2_ros
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from nodelet_fixture import (manager_services, project_mei, wait_for, wait_until_connected,  # noqa: E402
                             wait_until_gone)

NOW = rospy.Time(1342626147, 250000000)  # of the drive: far from the wall clock


def stamp(seconds):
    return NOW + rospy.Duration.from_sec(seconds)


def rotation_matrix(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def numbers(message):
    """Translation and quaternion of a transform or pose."""
    t = getattr(message, "translation", None) or message.position
    q = getattr(message, "rotation", None) or message.orientation
    return np.array([t.x, t.y, t.z]), np.array([q.x, q.y, q.z, q.w])


def odometry(seconds, frame="odom"):
    message = Odometry(child_frame_id="base_link")
    message.header.stamp = stamp(seconds)
    message.header.frame_id = frame
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    position.x, position.y, position.z = 3.0 + seconds, -4.0, 0.25
    orientation.x, orientation.y, orientation.z, orientation.w = 0.1, -0.3, 0.5, math.sqrt(1 - 0.35)
    return message


class DriveTfNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rig_path = pathlib.Path(rospkg.RosPack().get_path("vcharge_config")) / "rigs" / "golf_nominal.yaml"
        cls.cameras = yaml.safe_load(rig_path.read_text())["cameras"]
        cls.transforms, cls.statics, cls.infos, cls.diagnostics = [], {}, {}, []
        cls.subscribers = [
            rospy.Subscriber("/tf", TFMessage, lambda m: cls.transforms.extend(m.transforms), queue_size=100),
            rospy.Subscriber("/tf_static", TFMessage, cls.keep_statics, queue_size=100),
            rospy.Subscriber("/diagnostics", DiagnosticArray, cls.diagnostics.append, queue_size=100)]
        cls.clock = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
        cls.odometry = rospy.Publisher("/odom", Odometry, queue_size=100)
        cls.tf = rospy.Publisher("/tf", TFMessage, queue_size=100)
        cls.images, cls.compressed, cls.drivers = {}, {}, {}
        for camera in cls.cameras:
            topic = f"/camera/{camera}/image_raw"
            cls.images[camera] = rospy.Publisher(topic, Image, queue_size=100)
            cls.compressed[camera] = rospy.Publisher(f"{topic}/compressed", CompressedImage, queue_size=100)
            info_topic = f"/camera/{camera}/camera_info"
            cls.drivers[camera] = rospy.Publisher(info_topic, CameraInfo, queue_size=100)
            cls.infos[camera] = []
            cls.subscribers.append(rospy.Subscriber(info_topic, CameraInfo, cls.infos[camera].append, queue_size=100))
        rospy.set_param("/drive_tf/rig", str(rig_path))
        cls.load, cls.unload, _ = manager_services()
        cls.clock.publish(NOW)

    @classmethod
    def keep_statics(cls, message):
        cls.statics.update({transform.child_frame_id: transform for transform in message.transforms})

    def start(self):
        self.assertTrue(self.load("/drive_tf", "vcharge_ros/drive_tf_nodelet", [], [], [], "").success)
        wait_until_connected("/manager", self.subscribers)

    def stop(self):
        self.assertTrue(self.unload("/drive_tf").success)
        wait_until_gone("/manager", self.subscribers)

    def setUp(self):
        self.start()
        # Its diagnostics show which clock it uses.
        wait_for(self.lives_by_the_clock, "diagnostics in the drive's time")
        mine = [self.odometry, self.tf, *self.images.values(), *self.compressed.values(), *self.drivers.values()]
        wait_for(lambda: all(p.get_num_connections() > 0 for p in mine), "connections to the nodelet")
        # This script subscribes to these topics too.
        wait_for(lambda: all(p.get_num_connections() > 1 for p in [self.tf, *self.drivers.values()]), "both listeners")
        self.settle()
        self.transforms.clear()
        for infos in self.infos.values():
            infos.clear()

    def lives_by_the_clock(self):
        self.clock.publish(NOW)  # again and again: one message may go out while a listener is still connecting
        return any(m.header.stamp == NOW for m in self.diagnostics)

    def tearDown(self):
        self.stop()
        self.diagnostics.clear()

    def settle(self):
        """Returns when messages of the nodelet reach this script."""
        def heard():
            self.odometry.publish(odometry(-60.0 - time.monotonic() % 1.0))
            for publisher in self.images.values():
                publisher.publish(self.image(-60.0 - time.monotonic() % 1.0))
            return self.transforms and all(self.infos.values())
        wait_for(heard, "TF and camera_info")
        wait_for(self.is_quiet, "the end of the probes")

    def is_quiet(self):
        before = len(self.transforms), [len(infos) for infos in self.infos.values()]
        time.sleep(0.2)
        return before == (len(self.transforms), [len(infos) for infos in self.infos.values()])

    @staticmethod
    def image(seconds):
        message = Image(height=1, width=1, step=1, encoding="mono8", data=b"\0")
        message.header.stamp = stamp(seconds)
        return message

    @staticmethod
    def compressed_image(seconds):
        message = CompressedImage()
        message.header.stamp = stamp(seconds)
        return message

    def stamps(self, camera):
        return [info.header.stamp for info in self.infos[camera]]

    def test_broadcasts_the_odometry_with_its_stamps(self):
        sent = [odometry(0.02 * i) for i in range(5)]
        for message in sent:
            self.odometry.publish(message)
        self.odometry.publish(sent[-1])  # TF complains about repeated stamps
        self.odometry.publish(odometry(1.0, "odom_of_the_wheels"))
        wait_for(lambda: len(self.transforms) >= 6, "the transforms")
        self.assertTrue(self.is_quiet())
        self.assertEqual([t.header.stamp for t in self.transforms],
                         [m.header.stamp for m in sent] + [stamp(1.0)])
        for transform, message in zip(self.transforms, sent):
            self.assertEqual((transform.header.frame_id, transform.child_frame_id), ("odom", "base_link"))
            for value, expected in zip(numbers(transform.transform), numbers(message.pose.pose)):
                np.testing.assert_allclose(value, expected, atol=1e-12)
        self.assertEqual(self.transforms[-1].header.frame_id, "odom_of_the_wheels")

    def test_broadcasts_the_rigs_cameras_in_the_drives_time(self):
        frames = {camera["frame_id"]: camera["vehicle_from_camera"] for camera in self.cameras.values()}
        # Load again now that the manager has received the time.
        self.stop()
        self.statics.clear()
        self.start()
        wait_for(lambda: all(f in self.statics and self.statics[f].header.stamp == NOW for f in frames), "/tf_static")
        self.assertEqual(set(self.statics), set(frames))
        for frame, expected in frames.items():
            transform = self.statics[frame]
            self.assertEqual(transform.header.frame_id, "base_link")
            translation, rotation = numbers(transform.transform)
            np.testing.assert_allclose(translation, expected["translation_m"], atol=1e-9)
            np.testing.assert_allclose(rotation_matrix(rotation), rotation_matrix(expected["rotation_xyzw"]),
                                       atol=1e-9)

    def test_a_listener_finds_the_cameras_in_odom(self):
        buffer = tf2_ros.Buffer(rospy.Duration(100.0))
        listener = tf2_ros.TransformListener(buffer)
        sent = odometry(0.0)

        def look_up():
            self.odometry.publish(sent)
            sent.header.stamp += rospy.Duration(0, 1000)
            return buffer.can_transform("odom", "camera_left_optical", stamp(1e-6))
        wait_for(look_up, "odom -> camera_left_optical")
        found, _ = numbers(buffer.lookup_transform("odom", "camera_left_optical", stamp(1e-6)).transform)
        position, orientation = numbers(sent.pose.pose)
        expected = position + rotation_matrix(orientation) @ self.cameras["left"]["vehicle_from_camera"]["translation_m"]
        np.testing.assert_allclose(found, expected, atol=1e-9)
        listener.unregister()

    def test_camera_info_has_the_images_stamps_and_the_rigs_size_and_frame(self):
        sent = [stamp(0.08 * i) for i in range(4)]
        for i in range(4):
            for camera in self.cameras:
                self.images[camera].publish(self.image(0.08 * i))
        for camera, entry in self.cameras.items():
            wait_for(lambda c=camera: len(self.infos[c]) >= 4, f"camera_info of {camera}")
            self.assertEqual(self.stamps(camera), sent)
            for info in self.infos[camera]:
                self.assertEqual([info.width, info.height], entry["image_size_px"])
                self.assertEqual(info.header.frame_id, entry["frame_id"])
                self.assertEqual(info.distortion_model, "equidistant")

    def test_camera_info_projects_as_the_rig_does(self):
        self.images["front"].publish(self.image(0.0))
        info = wait_for(lambda: self.infos["front"], "camera_info")[0]
        angle, turn = np.meshgrid(np.linspace(0.01, 1.4, 30), np.linspace(0, 2 * math.pi, 24, endpoint=False))
        rays = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]).reshape(3, -1)
        u, v = project_mei(rays, self.cameras["front"]["intrinsics"])
        inside = (u > 0) & (v > 0) & (u < info.width) & (v < info.height)
        self.assertGreater(np.count_nonzero(inside), 300)
        theta, phi = angle.ravel(), turn.ravel()
        distorted = theta * (1 + sum(d * theta ** (2 * (k + 1)) for k, d in enumerate(info.D)))
        fitted_u = info.K[0] * distorted * np.cos(phi) + info.K[2]
        fitted_v = info.K[4] * distorted * np.sin(phi) + info.K[5]
        # Tangential distortion, 3 |p1| r^2 focal lengths or 1.8 px at r = 1, cannot be represented by an equidistant model.
        np.testing.assert_allclose(np.hypot(fitted_u - u, fitted_v - v)[inside], 0.0, atol=1.5)

    def test_camera_info_comes_with_compressed_images_and_once_where_there_are_both(self):
        self.compressed["left"].publish(self.compressed_image(0.0))
        wait_for(lambda: len(self.infos["left"]) == 1, "camera_info")
        self.images["left"].publish(self.image(0.0))
        self.images["left"].publish(self.image(0.08))
        wait_for(lambda: len(self.infos["left"]) > 1, "camera_info")
        self.assertTrue(self.is_quiet())
        self.assertEqual(self.stamps("left"), [stamp(0.0), stamp(0.08)])

    def test_pauses_while_a_driver_publishes_camera_info_and_resumes_after_it(self):
        driver = CameraInfo(width=1280, height=800, distortion_model="the driver's")

        def heard(seconds):
            """The camera_info messages for an image of the left and of the front camera."""
            for infos in self.infos.values():
                infos.clear()
            for camera in ("left", "front"):
                self.images[camera].publish(self.image(seconds))
            wait_for(lambda: self.infos["front"], "camera_info of the front camera")
            self.is_quiet()
            return [info.distortion_model for info in self.infos["left"]]

        def is_paused(t=iter(range(1, 10000))):
            # The nodelet may receive it later than this script; it ignores a repeated stamp.
            self.drivers["left"].publish(driver)
            wait_for(lambda: self.infos["left"], "the driver's camera_info")
            return heard(0.001 * next(t)) == []

        self.assertEqual(heard(0.0), ["equidistant"])
        self.infos["left"].clear()
        wait_for(is_paused, "the nodelet to pause")
        wait_for(lambda t=iter(range(10000)): heard(1.0 + 0.08 * next(t)) == ["equidistant"], "camera_info again")

    def test_pauses_while_another_node_broadcasts_the_odometry(self):
        other = TransformStamped(child_frame_id="trailer")
        other.header.frame_id = "base_link"
        other.transform.rotation.w = 1.0

        def own_transforms(seconds):
            """Whether the nodelet still broadcasts TF; waits for camera_info, which it always publishes."""
            self.transforms.clear()
            self.infos["front"].clear()
            self.odometry.publish(odometry(seconds))
            self.images["front"].publish(self.image(seconds))
            wait_for(lambda: self.infos["front"], "camera_info")
            self.is_quiet()
            return [t.header.stamp for t in self.transforms]

        self.tf.publish([other])
        wait_for(lambda: self.transforms, "the other transform")
        self.assertEqual(own_transforms(0.0), [stamp(0.0)], "a trailer is no odometry")
        other.header.frame_id, other.child_frame_id = "odom", "base_link"

        def is_paused(t=iter(range(1, 10000))):
            # The nodelet may receive it later than this script.
            self.transforms.clear()
            self.tf.publish([other])
            wait_for(lambda: self.transforms, "the other transform")
            return own_transforms(0.1 * next(t)) == []

        wait_for(is_paused, "the nodelet to pause")

    def test_bad_odometry_is_reported_and_skipped(self):
        bad = odometry(0.0)
        bad.pose.pose.orientation.w = float("nan")
        self.odometry.publish(bad)
        wait_for(lambda: any("/odom" in status.message and "quaternion" in status.message
                             for message in self.diagnostics for status in message.status), "a diagnostic")
        self.odometry.publish(odometry(0.1))
        wait_for(lambda: self.transforms, "the transform of good odometry")
        self.assertEqual([t.header.stamp for t in self.transforms], [stamp(0.1)])


if __name__ == "__main__":
    rospy.init_node("drive_tf_nodelet_test")
    rostest.rosrun("vcharge_tests", "drive_tf_nodelet", DriveTfNodeletTest)
