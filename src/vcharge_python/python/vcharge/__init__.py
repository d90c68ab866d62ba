"""Reads what vcharge writes, as numpy arrays.

>>> import vcharge
>>> lot = vcharge.read_map("LOT.vmap")
>>> lot.landmarks.positions_m.shape                   # in the frame map
(19946, 3)
>>> front = lot.rig["front"]
>>> front.project(front.camera_from_vehicle([[5.0, 0.0, 0.0]]))   # pixel of a point on the ground

| function | reads |
|---|---|
| read_rig | rig.yaml with its masks |
| read_map | a sparse map (*.vmap) |
| read_trajectory | poses (TUM text) |
| read_range_map, list_range_maps, list_range_map_cameras | range maps of compute_range_maps |
| read_height_map | a height map of build_height_map |
| read_bays | parking bays of map_bays |
| read_obstacle_map, read_obstacle_scans, read_occupancy_grid, list_obstacle_maps | obstacle maps of detect_obstacles |
| read_objects | moving objects of detect_obstacles |
| read_images | images of a drive (needs rosbag) |

Each returns a whole result or raises InputError, which names the file, the key and what was expected. Lengths are metres, angles
radians, stamps integer nanoseconds. A transform `target_from_source` is a 4 x 4 matrix; frames are those of REP 105 (map, odom,
base_link: x forwards, y left, z up) and the optical frames of the cameras (x right, y down, z forwards). What is unknown is NaN.
"""
from vcharge.bays import ParkingBay, ParkingBays, read_bays
from vcharge.camera_models import CameraModel, KannalaBrandtCamera, MeiCamera, PinholeCamera
from vcharge.drives import read_images
from vcharge.errors import InputError
from vcharge.height_map import HeightMap, read_height_map
from vcharge.objects import ObjectFrame, TrackedObject, read_objects
from vcharge.obstacle_map import (ObstacleMap, ObstacleScan, OccupancyGrid, list_obstacle_maps, read_obstacle_map,
                                  read_obstacle_scans, read_occupancy_grid)
from vcharge.range_map import RangeMap, list_range_map_cameras, list_range_maps, read_range_map
from vcharge.rig import Camera, Rig, read_rig
from vcharge.sparse_map import Keyframes, Landmarks, Observations, Session, SparseMap, read_map
from vcharge.trajectory import Trajectory, read_trajectory
from vcharge.transforms import rotation_matrices, transform_of

__all__ = [
    "Camera", "CameraModel", "HeightMap", "InputError", "KannalaBrandtCamera", "Keyframes", "Landmarks", "MeiCamera", "ObjectFrame",
    "Observations", "ObstacleMap", "ObstacleScan", "OccupancyGrid", "ParkingBay", "ParkingBays", "PinholeCamera", "RangeMap", "Rig",
    "Session", "SparseMap", "TrackedObject", "Trajectory", "list_obstacle_maps", "list_range_map_cameras", "list_range_maps",
    "read_bays", "read_height_map", "read_images", "read_map", "read_objects", "read_obstacle_map", "read_obstacle_scans",
    "read_occupancy_grid", "read_range_map", "read_rig", "read_trajectory", "rotation_matrices", "transform_of"]
