#!/usr/bin/env python3
"""bay_nodelet: free and occupied bays of a map from grids of obstacles, with and without a certain pose."""
import os
import pathlib
import sys
import tempfile
import time
import unittest

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import OccupancyGrid
from tf2_msgs.msg import TFMessage
from vcharge_msgs.msg import LocalizationStatus, ParkingBay, ParkingBays

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from nodelet_fixture import Diagnostics, manager_services, wait_for, wait_until_connected, wait_until_gone  # noqa: E402

CELL_M, HALF_M = 0.1, 10.0
MAP_FROM_ODOM_M = (100.0, -50.0)  # no turn
BAYS = """frame: map
bays:
  - {id: 7, row: 2, kind: parallel, state: occupied, corners_m: [[102.5, -47], [100, -47], [100, -42], [102.5, -42]],
     entry_sigma_m: 0.05, end_sigma_m: 0.4, confidence: 0.75}
  - {id: 8, row: 2, kind: parallel, state: free, corners_m: [[300, -47], [297.5, -47], [297.5, -42], [300, -42]],
     entry_sigma_m: 0.05, end_sigma_m: 0.4, confidence: 1}
"""


class BayNodeletTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.work.name) / "bays.yaml"
        cls.path.write_text(BAYS, encoding="utf-8")
        cls.grids = rospy.Publisher("/obstacles/grid", OccupancyGrid, queue_size=1)
        cls.status = rospy.Publisher("/localization/status", LocalizationStatus, queue_size=1)
        cls.tf = rospy.Publisher("/tf", TFMessage, queue_size=10)
        cls.diagnostics = Diagnostics()
        cls.load, cls.unload, cls.list = manager_services()

    def setUp(self):
        self.heard = []
        self.subscriber = rospy.Subscriber("/parking/bays", ParkingBays, self.heard.append, queue_size=100)
        rospy.set_param("/parking/bays", str(self.path))
        self.assertTrue(self.load("/parking", "vcharge_obstacles/bay_nodelet", [], [], [], "").success)
        wait_until_connected("/manager", [self.subscriber])

    def tearDown(self):
        self.assertTrue(self.unload("/parking").success)
        wait_until_gone("/manager", [self.subscriber])
        self.subscriber.unregister()

    def drive(self, cells, sigma_m=0.02):
        """Publishes one grid with the pose's status and the transform, as the other nodelets do."""
        now = rospy.Time.now()
        transform = TransformStamped(child_frame_id="odom")
        transform.header.stamp, transform.header.frame_id = now, "map"
        transform.transform.translation.x, transform.transform.translation.y = MAP_FROM_ODOM_M
        transform.transform.rotation.w = 1.0
        self.tf.publish(TFMessage([transform]))
        status = LocalizationStatus(position_sigma_m=sigma_m)
        status.header.stamp = now
        self.status.publish(status)
        grid = OccupancyGrid()
        grid.header.stamp, grid.header.frame_id = now, "odom"
        grid.info.resolution = CELL_M
        grid.info.height, grid.info.width = cells.shape
        grid.info.origin.position.x = grid.info.origin.position.y = -HALF_M
        grid.info.origin.orientation.w = 1.0
        grid.data = cells.ravel().tolist()
        self.grids.publish(grid)
        time.sleep(0.08)

    def drive_until(self, cells, state):
        def told():
            self.drive(cells)
            return self.heard and self.heard[-1].bays[0].state == state
        wait_for(told, f"state {state}")
        return self.heard[-1].bays

    def ground(self):
        cells = np.full((int(2 * HALF_M / CELL_M),) * 2, -1, np.int8)
        cells[:170, :] = 0  # up to 7 m to the left
        return cells

    def test_tells_which_bays_are_free_and_since_when(self):
        wait_for(lambda: self.heard, "the bays at once")
        first = self.heard[0]
        self.assertEqual(first.header.frame_id, "map")
        self.assertEqual([(bay.id, bay.row, bay.kind, bay.state) for bay in first.bays],
                         [(7, 2, ParkingBay.PARALLEL, ParkingBay.UNKNOWN), (8, 2, ParkingBay.PARALLEL, ParkingBay.UNKNOWN)])
        self.assertAlmostEqual(first.bays[0].corners[0].x, 102.5, places=4)
        self.assertTrue(first.bays[0].since.is_zero())

        free, distant = self.drive_until(self.ground(), ParkingBay.FREE)
        self.assertEqual(distant.state, ParkingBay.UNKNOWN)
        self.assertGreaterEqual(free.observed, free.since + rospy.Duration(0.4))
        cells = self.ground()
        cells[140, 104:121] = 100  # the front of a car, 4 m to the left
        occupied, _ = self.drive_until(cells, ParkingBay.OCCUPIED)
        self.assertGreater(occupied.since, free.since)

    def test_keeps_the_states_while_the_pose_is_not_certain(self):
        since = self.drive_until(self.ground(), ParkingBay.FREE)[0].since
        cells = self.ground()
        cells[140, 104:121] = 100
        for _ in range(20):
            self.drive(cells, sigma_m=0.5)
        wait_for(lambda: self.diagnostics.tells("no certain pose"), "diagnostics")
        self.drive(cells, sigma_m=0.5)
        self.assertEqual(self.heard[-1].bays[0].state, ParkingBay.FREE)
        self.assertEqual(self.heard[-1].bays[0].since, since)

    def test_refuses_files_that_are_not_bays_and_lives_on_after_bad_grids(self):
        bad = pathlib.Path(self.work.name) / "bad.yaml"
        bad.write_text("frame: map\nbays: [{id: 1}]\n", encoding="utf-8")
        loaded = self.list().nodelets
        rospy.set_param("/other/bays", str(bad))
        with self.assertRaises(rospy.ServiceException):
            self.load("/other", "vcharge_obstacles/bay_nodelet", [], [], [], "")
        self.assertEqual(self.list().nodelets, loaded)
        self.grids.publish(OccupancyGrid())
        self.drive_until(self.ground(), ParkingBay.FREE)


if __name__ == "__main__":
    rospy.init_node("bay_nodelet_test")
    rostest.rosrun("vcharge_tests", "bay_nodelet", BayNodeletTest)
