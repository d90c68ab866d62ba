#!/usr/bin/env python3
"""camera_driver_nodelet on emulated cameras and on images of a folder: stamps, odometry, TF, diagnostics, bad options."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

import cv2
import numpy as np
import rosbag
import rospkg
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from nav_msgs.msg import Odometry
from roslib.packages import find_node
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage
from vcharge_msgs.msg import WheelTicks

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from nodelet_fixture import manager_services, wait_for  # noqa: E402

WIDTH, HEIGHT = 320, 200
CAMERAS = ("front", "left", "rear", "right")
RATE_HZ = 10.0
CONFIG = pathlib.Path(rospkg.RosPack().get_path("vcharge_config"))
EMULATED = f"width={WIDTH}\nheight={HEIGHT}\nrate_hz={RATE_HZ}\nformats=GREY\njitter_us=2000\n"


def pulse_in(image):
    """The number of the trigger pulse that the emulator wrote into the first pixels."""
    return sum(1 << bit for bit in range(32) if image.data[bit] > 127)


class DriverTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        rig = yaml.safe_load((CONFIG / "rigs" / "golf_nominal.yaml").read_text())
        for camera in rig["cameras"].values():
            camera["image_size_px"] = [WIDTH, HEIGHT]
            for name in ("gamma1", "gamma2", "u0", "v0"):
                camera["intrinsics"][name] /= 4.0
        cls.rig = cls.folder / "rig.yaml"
        cls.rig.write_text(yaml.safe_dump(rig))
        cls.devices = [cls.folder / f"video{i}" for i in range(4)]
        environment = dict(os.environ, LD_PRELOAD="libvcharge_v4l2_emulator.so", VCHARGE_EMULATED_CAMERAS=str(cls.folder))
        cls.manager = subprocess.Popen([find_node("nodelet", "nodelet")[0], "manager", "__name:=manager",
                                        "_num_worker_threads:=4"], env=environment)
        cls.load_service, cls.unload_service, _ = manager_services()
        cls.images = {camera: {} for camera in CAMERAS}  # by stamp: pulse
        cls.infos = {camera: {} for camera in CAMERAS}
        cls.odometry, cls.transforms, cls.statics, cls.diagnostics = [], [], {}, {}
        for camera in CAMERAS:
            rospy.Subscriber(f"/camera/{camera}/image_raw", Image, cls.keep_image, camera, queue_size=50, buff_size=1 << 24)
            rospy.Subscriber(f"/camera/{camera}/camera_info", CameraInfo, cls.keep_info, camera, queue_size=50)
        rospy.Subscriber("/odom", Odometry, cls.odometry.append, queue_size=500)
        rospy.Subscriber("/tf", TFMessage, lambda m: cls.transforms.extend(m.transforms), queue_size=500)
        rospy.Subscriber("/tf_static", TFMessage, lambda m: cls.statics.update(
            {t.child_frame_id: t for t in m.transforms}), queue_size=10)
        rospy.Subscriber("/diagnostics", DiagnosticArray, lambda m: cls.diagnostics.update(
            {status.name.split(":")[0].split("/")[-1]: status for status in m.status}), queue_size=100)
        cls.ticks = rospy.Publisher("/wheel_ticks", WheelTicks, queue_size=10)
        cls.stop = threading.Event()
        cls.wheels = threading.Thread(target=cls.drive)
        cls.wheels.start()

    @classmethod
    def keep_image(cls, message, camera):
        cls.images[camera][message.header.stamp] = message

    @classmethod
    def keep_info(cls, message, camera):
        cls.infos[camera][message.header.stamp] = message

    @classmethod
    def drive(cls):
        """Publishes wheel ticks of straight driving at 2 m/s, 50 times a second."""
        start = rospy.Time.now()
        while not cls.stop.wait(0.02):
            message = WheelTicks(metres_per_tick=0.01)
            message.header.stamp = rospy.Time.now()
            message.left_ticks = message.right_ticks = int((message.header.stamp - start).to_sec() * 2.0 / 0.01)
            cls.ticks.publish(message)

    @classmethod
    def tearDownClass(cls):
        cls.stop.set()
        cls.wheels.join()
        cls.manager.terminate()
        cls.manager.wait()
        shutil.rmtree(cls.folder)

    def setUp(self):
        for device in self.devices:
            self.plug(device)

    def tearDown(self):
        self.unload()
        rospy.delete_param("/driver")

    def plug(self, device, config=EMULATED):
        (self.folder / "new").write_text(config)
        (self.folder / "new").rename(device)

    def load(self, rig=None, **options):
        defaults = {"devices": [str(device) for device in self.devices],
                    "v4l2": {"capture": {"frame_rate_hz": RATE_HZ}, "reconnect_s": 0.2, "timeout_s": 5.0}}
        rospy.set_param("/driver", {"rig": str(rig or self.rig), "options": {**defaults, **options}})
        for store in (*self.images.values(), *self.infos.values(), self.odometry, self.transforms, self.diagnostics):
            store.clear()
        try:
            return self.load_service("/driver", "vcharge_camera_driver/camera_driver_nodelet", [], [], [], "").success
        except rospy.ServiceException:
            self.assertIsNone(self.manager.poll(), "the manager died")
            return False

    def unload(self):
        """False if it was not loaded."""
        try:
            return self.unload_service("/driver").success
        except rospy.ServiceException:
            return False

    def groups(self, cameras=CAMERAS):
        """Stamps at which all of these cameras have an image."""
        return sorted(set.intersection(*(set(self.images[camera]) for camera in cameras)))

    def level(self, name):
        return self.diagnostics[name].level if name in self.diagnostics else None

    def test_four_cameras_have_equal_stamps_and_odometry_at_each(self):
        self.assertTrue(self.load())
        wait_for(lambda: self.odometry and len(self.groups()) >= 5, "groups of all cameras, and odometry")
        first = self.odometry[0].header.stamp  # the groups before may be older than the first ticks
        wait_for(lambda: len([stamp for stamp in self.groups() if stamp > first]) >= 20, "groups with odometry")
        stamps = [stamp for stamp in self.groups() if stamp > first][:20]
        for stamp in stamps:
            self.assertEqual(len({pulse_in(self.images[camera][stamp]) for camera in CAMERAS}), 1)
            for camera in CAMERAS:
                image = self.images[camera][stamp]
                self.assertEqual((image.width, image.height, image.encoding), (WIDTH, HEIGHT, "mono8"))
                self.assertEqual(image.header.frame_id, f"camera_{camera}_optical")
        wait_for(lambda: all(stamp in self.infos[camera] for stamp in stamps for camera in CAMERAS), "camera_info")
        wait_for(lambda: {m.header.stamp for m in self.odometry} >= set(stamps), "odometry at the stamps")
        odometry = [m.header.stamp for m in self.odometry]
        self.assertEqual(odometry, sorted(odometry))
        self.assertLessEqual(max(odometry.count(stamp) for stamp in odometry), 2, "an estimate and its correction")
        wait_for(lambda: {t.header.stamp for t in self.transforms if t.child_frame_id == "base_link"} >= set(stamps),
                 "odom -> base_link at the stamps")
        at = {m.header.stamp: m for m in self.odometry}
        seconds = (stamps[-1] - stamps[5]).to_sec()
        way = at[stamps[-1]].pose.pose.position.x - at[stamps[5]].pose.pose.position.x
        self.assertLess(abs(way - 2.0 * seconds), 0.05)
        self.assertGreater(at[stamps[-1]].pose.covariance[0], 0.0)
        self.assertEqual(set(self.statics), {f"camera_{camera}_optical" for camera in CAMERAS})
        wait_for(lambda: all(self.level(name) == 0 for name in (*CAMERAS, "sync", "odometry")), "good diagnostics")

    def test_cameras_without_a_common_trigger_keep_their_stamps(self):
        rig = self.folder / "free_running.yaml"
        rig.write_text(yaml.safe_dump({**yaml.safe_load(self.rig.read_text()), "stamp_tolerance_s": 0.03}))
        for i, device in enumerate(self.devices):
            self.plug(device, EMULATED + f"exposure_us={5000 + 9000 * i}\nreadout_us=40000\n")
        self.assertTrue(self.load(rig))
        wait_for(lambda: all(len(self.images[camera]) >= 20 for camera in CAMERAS), "images of all cameras")
        stamps = {camera: {pulse_in(image): stamp.to_sec() for stamp, image in list(self.images[camera].items())}
                  for camera in CAMERAS}
        for i, camera in enumerate(CAMERAS):
            later = [stamps[camera][pulse] - stamps["front"][pulse] for pulse in set(stamps[camera]) & set(stamps["front"])]
            self.assertLess(max(abs(each - 0.009 * i) for each in later), 0.005)  # twice the jitter
        told = {message.header.stamp for message in list(self.odometry)}
        for camera in CAMERAS:
            self.assertGreater(len(told & set(self.images[camera])), 10, f"odometry at the stamps of {camera}")
        wait_for(lambda: all(self.level(name) == 0 for name in CAMERAS), "good diagnostics")
        self.assertNotIn("sync", self.diagnostics)

    def test_nodelets_of_the_manager_share_the_drivers_images(self):
        """Depth, localization and obstacles receive the driver's own buffer: its address is the same for all."""
        probes = {name: {} for name in ("probe_of_depth", "probe_of_localization")}
        for name, buffers in probes.items():
            rospy.Subscriber(f"/{name}/buffers", KeyValue, lambda m, b=buffers: b.__setitem__(m.key, m.value), queue_size=100)
            self.assertTrue(self.load_service(f"/{name}", "vcharge_ros/buffer_probe_nodelet", ["/image"],
                                              ["/camera/front/image_raw"], [], "").success)
        try:
            self.assertTrue(self.load())
            first, second = probes.values()
            wait_for(lambda: len(set(first) & set(second)) >= 15, "images at both probes")
            common = sorted(set(first) & set(second))[:15]
            self.assertEqual([first[stamp] for stamp in common], [second[stamp] for stamp in common])
            self.assertGreater(len({first[stamp] for stamp in common}), 10, "addresses that say nothing")
        finally:
            for name in probes:
                self.unload_service(f"/{name}")

    def test_a_camera_is_unplugged_and_plugged_in_again(self):
        self.assertTrue(self.load())
        wait_for(lambda: len(self.groups()) >= 5, "groups of all cameras")
        self.devices[2].unlink()
        wait_for(lambda: self.level("rear") == 2 and str(self.devices[2]) in self.diagnostics["rear"].message,
                 "an error that names the device")
        wait_for(lambda: self.level("sync") in (1, 2), "a diagnostic of the groups")
        before = len(self.groups(("front", "left", "right")))
        wait_for(lambda: len(self.groups(("front", "left", "right"))) >= before + 10, "groups of the others")
        self.assertNotIn(self.groups(("front", "left", "right"))[-1], self.images["rear"])
        self.plug(self.devices[2])
        whole = len(self.groups())
        wait_for(lambda: len(self.groups()) >= whole + 5, "groups of all cameras again")
        wait_for(lambda: self.level("rear") == 0, "a good diagnostic")

    def test_bad_options_are_refused_and_the_manager_lives_on(self):
        self.assertFalse(self.load(devices=["/dev/video0"]))
        self.assertFalse(self.load(odometry_source="gps"))
        self.assertFalse(self.load(cameras=["roof"], devices=["/dev/video0"]))
        self.assertFalse(self.load(source="folder", folder=str(self.folder / "none")))
        self.assertTrue(self.load(odometry_source="none"))
        wait_for(lambda: len(self.groups()) >= 5, "groups after all that")
        self.assertEqual(self.odometry, [])

    def test_the_shipped_options_are_taken_and_a_car_without_devices_is_reported(self):
        for path in sorted((CONFIG / "driver").glob("*.yaml")):
            self.assertTrue(self.load(**yaml.safe_load(path.read_text())), path.name)
            for name in (*CAMERAS, "can", "sync"):
                wait_for(lambda n=name: self.level(n) == 2, f"an error of {name}")
            self.assertIn("/dev/vcharge_front", self.diagnostics["front"].message)
            self.assertIn("can0", self.diagnostics["can"].message)
            self.assertTrue(self.unload())

    def test_images_of_a_folder_come_in_real_time(self):
        random = np.random.default_rng(1)
        for camera in CAMERAS:
            (self.folder / "images" / camera).mkdir(parents=True)
            for i in range(12):
                pixels = random.integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8)
                cv2.imwrite(str(self.folder / "images" / camera / f"{10**18 + i * 10**8}.png"), pixels)
        began = rospy.Time.now()
        self.assertTrue(self.load(source="folder", folder=str(self.folder / "images"), loop=True))
        wait_for(lambda: len(self.groups()) >= 20, "groups")
        stamps = self.groups()
        self.assertGreater(stamps[0], began)
        steps = {round((b - a).to_sec() * RATE_HZ, 3) for a, b in zip(stamps, stamps[1:])}
        self.assertEqual(steps, {1.0})
        first = cv2.imread(str(self.folder / "images" / "rear" / f"{10**18 + 5 * 10**8}.png"), 0)
        self.assertTrue(any(message.data == first.tobytes() for message in self.images["rear"].values()))

    def write_bag(self, seconds):
        """A drive at 2 m/s: images at RATE_HZ and, at the same instants and between them, wheel ticks and odometry."""
        path = self.folder / "drive.bag"
        with rosbag.Bag(str(path), "w") as bag:
            for i in range(int(seconds * 50)):
                stamp = rospy.Time(10**9, 0) + rospy.Duration(0, i * 2 * 10**7)
                ticks = WheelTicks(metres_per_tick=0.01, left_ticks=4 * i, right_ticks=4 * i)
                odometry = Odometry(child_frame_id="base_link")
                odometry.pose.pose.orientation.w = 1.0
                messages = [("/wheel_ticks", ticks), ("/odom", odometry)]
                if i % int(50 / RATE_HZ) == 0:
                    messages += [(f"/camera/{camera}/image_raw", Image(
                        height=HEIGHT, width=WIDTH, step=WIDTH, encoding="mono8",
                        data=bytes([i % 256]) * (WIDTH * HEIGHT))) for camera in CAMERAS]
                for topic, message in messages:
                    message.header.stamp = stamp
                    bag.write(topic, message, stamp)
        return path

    def test_a_bag_comes_in_real_time_and_its_stamps_may_be_shifted(self):
        bag, offset_s, count = self.write_bag(4.0), -0.007, 30
        began = rospy.Time.now()
        self.assertTrue(self.load(source="bag", bag=str(bag), stamp_offset_s=offset_s))
        wait_for(lambda: len(self.groups()) >= count, "groups")
        stamps = self.groups()
        self.assertGreater(stamps[0], began)
        self.assertGreater(rospy.Time.now() - began, rospy.Duration((count - 1) / RATE_HZ), "in real time")
        self.assertEqual({round((b - a).to_sec() * RATE_HZ, 3) for a, b in zip(stamps, stamps[1:])}, {1.0})
        gray = [self.images["left"][stamp].data[0] for stamp in stamps]
        self.assertEqual(gray, list(range(gray[0], gray[0] + 5 * len(gray), 5)))
        # The wheels' stamps are not shifted: every image has a tick and an odometry message of its instant.
        told = {message.header.stamp for message in self.odometry}
        beside = [stamp for stamp in stamps[5:-5] if stamp - rospy.Duration(offset_s) in told]
        self.assertGreater(len(beside), 15)
        self.assertTrue(told.issuperset(stamps[5:-5]), "odometry at the images' own stamps")


if __name__ == "__main__":
    rospy.init_node("driver_test")
    rostest.rosrun("vcharge_tests", "driver", DriverTest)
