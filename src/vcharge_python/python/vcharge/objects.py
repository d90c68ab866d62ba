"""Moving objects, as detect_obstacles writes them."""
import dataclasses
import pathlib

import numpy as np

from vcharge import transforms
from vcharge.errors import InputError
from vcharge.files import parse_number
from vcharge.tables import read_table

CLASSES = ("unknown", "adult", "child", "car", "bicycle")
FRAMES_HEADER = "stamp_ns,x_m,y_m,yaw_rad,num_objects"
COVARIANCES = ("cov_x_x_m2", "cov_x_y_m2", "cov_x_vx_m2_per_s", "cov_x_vy_m2_per_s", "cov_y_y_m2", "cov_y_vx_m2_per_s",
               "cov_y_vy_m2_per_s", "cov_vx_vx_m2_per_s2", "cov_vx_vy_m2_per_s2", "cov_vy_vy_m2_per_s2")
OBJECTS_HEADER = ("stamp_ns,id,class,class_probability,existence_probability,x_m,y_m,yaw_rad,vx_m_per_s,vy_m_per_s,is_standing,"
                  "height_m,"
                  + ",".join(COVARIANCES) + ",footprint_m")


@dataclasses.dataclass(frozen=True, eq=False)
class TrackedObject:
    """An object that can move, at one time, in the frame odom.

    id: the same as long as the object is followed
    object_class: "unknown", "adult", "child", "car" or "bicycle"
    position_m: x, y of its middle
    velocity_m_per_s: vx, vy over the ground, along the axes of odom
    covariance: 4 x 4, of x, y, vx, vy
    footprint_m: N x 2, convex, counter-clockwise
    """

    id: int
    object_class: str
    class_probability: float
    existence_probability: float
    position_m: np.ndarray
    yaw_rad: float
    velocity_m_per_s: np.ndarray
    is_standing: bool
    height_m: float
    covariance: np.ndarray
    footprint_m: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class ObjectFrame:
    """The objects at one stamp.

    odom_from_vehicle: 4 x 4, a pose on the ground
    yaw_rad: that of odom_from_vehicle
    """

    stamp_ns: int
    odom_from_vehicle: np.ndarray
    yaw_rad: float
    objects: list[TrackedObject]


def read_objects(path) -> list[ObjectFrame]:
    """Reads objects.csv and objects_frames.csv. `path` is their folder, or objects.csv there. Frames have increasing stamps, also
    those without objects. InputError naming file, line and column."""
    path = pathlib.Path(path)
    folder = path if path.is_dir() or path.suffix != ".csv" else path.parent
    frames_path, frames, counts = folder / "objects_frames.csv", {}, []
    for row in read_table(frames_path, FRAMES_HEADER):
        stamp = row.integer("stamp_ns", -2 ** 63)
        if frames and stamp <= next(reversed(frames)):
            row.fail("stamp_ns", "increasing stamps")
        x, y, yaw = (row.number(key) for key in ("x_m", "y_m", "yaw_rad"))
        frames[stamp] = ObjectFrame(stamp, transforms.planar_transform(x, y, yaw), yaw, [])
        counts.append(row.integer("num_objects"))
    for row in read_table(path if path.suffix == ".csv" else folder / "objects.csv", OBJECTS_HEADER):
        stamp = row.integer("stamp_ns", -2 ** 63)
        if stamp not in frames:
            row.fail("stamp_ns", "a stamp of objects_frames.csv")
        found = _object_of(row)
        if any(other.id == found.id for other in frames[stamp].objects):
            row.fail("id", "each id once at a stamp")
        frames[stamp].objects.append(found)
    for number, (frame, count) in enumerate(zip(frames.values(), counts), 2):
        if len(frame.objects) != count:
            raise InputError(f"{frames_path}:{number}: num_objects: expected the {len(frame.objects)} of objects.csv, got {count}")
    return list(frames.values())


def _object_of(row):
    if row.text("class") not in CLASSES:
        row.fail("class", ", ".join(CLASSES[:-1]) + " or " + CLASSES[-1])
    upper = [row.number(key) for key in COVARIANCES]
    covariance = np.zeros((4, 4))
    covariance[np.triu_indices(4)] = upper
    covariance = np.triu(covariance) + np.triu(covariance, 1).T
    if (covariance.diagonal() < 0).any():
        row.fail(COVARIANCES[0], "variances that are not negative")
    corners = [[parse_number(part) for part in corner.split(" ")] for corner in row.text("footprint_m").split(";")]
    if len(corners) < 3 or any(len(corner) != 2 or None in corner for corner in corners):
        row.fail("footprint_m", "three or more corners 'x y;x y;...'")
    return TrackedObject(
        row.integer("id", 0, 2 ** 32 - 1), row.text("class"), row.number("class_probability", 0, 1),
        row.number("existence_probability", 0, 1), np.array([row.number("x_m"), row.number("y_m")]), row.number("yaw_rad"),
        np.array([row.number("vx_m_per_s"), row.number("vy_m_per_s")]), bool(row.integer("is_standing", 0, 1)),
        row.number("height_m", 0), covariance, np.array(corners))
