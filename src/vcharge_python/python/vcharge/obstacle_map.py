"""Obstacle maps and scans, as detect_obstacles writes them, and occupancy grids of map_server."""
import dataclasses
import math
import pathlib

import numpy as np

from vcharge import transforms
from vcharge.errors import InputError
from vcharge.files import read_floats, read_gray, read_yaml, require_folder, stamps_of_files
from vcharge.tables import read_table

UNOBSERVED, FREE, OCCUPIED = -1, 0, 100  # the values of nav_msgs/OccupancyGrid
GRAY_LEVELS = {0: OCCUPIED, 254: FREE, 205: UNOBSERVED}
SCAN_HEADER = "name,origin_x_m,origin_y_m,max_range_m,angle_rad,range_m,free_m,range_sigma_m,height_m,height_sigma_m"


@dataclasses.dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """Free and occupied cells on a regular grid: rows along y, columns along x.

    state: int8 (rows x columns): -1 unobserved, 0 free, 100 occupied
    origin_m: x, y of the corner of the cell in row 0, column 0
    stamp_ns: None for a grid without a time, such as drivable.yaml of a height map
    frame_id: "odom" or "map"
    fixed_from_vehicle: 4 x 4
    """

    state: np.ndarray
    cell_size_m: float
    origin_m: np.ndarray
    stamp_ns: int | None = None
    frame_id: str | None = None
    fixed_from_vehicle: np.ndarray | None = None

    def centres_m(self) -> np.ndarray:
        """x, y of the cells' centres (rows x columns x 2)."""
        rows, columns = np.indices(self.state.shape)
        return self.origin_m + self.cell_size_m * (np.stack([columns, rows], -1) + 0.5)


@dataclasses.dataclass(frozen=True, eq=False)
class ObstacleMap(OccupancyGrid):
    """An occupancy grid around the vehicle with what is known of each occupied cell. All arrays are rows x columns, float32.

    point_m: rows x columns x 2: the obstacle in an occupied cell, relative to origin_m; else NaN
    point_sigma_m: standard deviation of point_m
    height_m: above the ground; NaN where not occupied
    age_s: since the cell was last observed; NaN: never
    """

    point_m: np.ndarray | None = None
    point_sigma_m: np.ndarray | None = None
    height_m: np.ndarray | None = None
    height_sigma_m: np.ndarray | None = None
    age_s: np.ndarray | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class ObstacleScan:
    """Nearest obstacles around a point on the ground, one per direction (N), in the vehicle's frame.

    name: "fused", or the camera's name
    origin_m: x, y
    angle_rad: counter-clockwise from the vehicle's x axis
    range_m: NaN if no obstacle is known, which does not mean free
    free_m: the ray is observed to be free up to this range; 0: nothing is
    height_m: of the obstacle above the ground; NaN without one
    """

    stamp_ns: int
    name: str
    origin_m: np.ndarray
    max_range_m: float
    angle_rad: np.ndarray
    range_m: np.ndarray
    free_m: np.ndarray
    range_sigma_m: np.ndarray
    height_m: np.ndarray
    height_sigma_m: np.ndarray


def read_occupancy_grid(path) -> OccupancyGrid:
    """Reads a YAML file and its image in the format of map_server, with the gray levels 0 (occupied), 205 (unobserved) and 254
    (free). InputError naming the file and the key."""
    return OccupancyGrid(**_grid_of(pathlib.Path(path)))


def _grid_of(path):
    """The members of an OccupancyGrid."""
    top = read_yaml(path)
    image = path.parent / top.required("image").text("the name of a file")
    gray = read_gray(image)[::-1]
    state = np.full(gray.shape, 1, np.int8)
    for level, value in GRAY_LEVELS.items():
        state[gray == level] = value
    if (state == 1).any():
        raise InputError(f"{image}: expected the gray levels 0, 205 and 254, got {gray[state == 1][0]}")
    members = {"state": state, "cell_size_m": top.required("resolution").number(1e-300, expected="a positive number of metres"),
               "origin_m": top.required("origin").numbers(3)[:2]}
    if top.has("stamp_ns"):
        rotation_entry = top.required("fixed_from_vehicle_rotation_xyzw")
        rotation = rotation_entry.numbers(4)
        if abs(np.linalg.norm(rotation) - 1) > 1e-3:
            rotation_entry.fail("a unit quaternion")
        members.update(stamp_ns=top.required("stamp_ns").integer(), frame_id=top.required("frame_id").text(),
                       fixed_from_vehicle=transforms.transform_of(
                           top.required("fixed_from_vehicle_translation_m").numbers(3), rotation))
    return members


def list_obstacle_maps(folder) -> list[int]:
    """Stamps (ns) of the obstacle maps in a folder of detect_obstacles, ascending."""
    return stamps_of_files(require_folder(folder, "obstacle maps"))


def read_obstacle_map(folder, stamp_ns: int) -> ObstacleMap:
    """Reads FOLDER/<stamp_ns>.yaml and the images beside it. InputError naming the file that is missing, damaged or of another
    size."""
    stem = require_folder(folder, "obstacle maps") / str(int(stamp_ns))
    members = _grid_of(pathlib.Path(f"{stem}.yaml"))
    if "stamp_ns" not in members:
        raise InputError(f"{stem}.yaml: stamp_ns: missing")
    size = members["state"].shape[::-1]
    layers = {name: read_floats(f"{stem}_{name}.tiff", size) for name in ("x", "y", "point_sigma", "height", "height_sigma", "age")}
    return ObstacleMap(**members, point_m=np.stack([layers["x"], layers["y"]], -1), point_sigma_m=layers["point_sigma"],
                       height_m=layers["height"], height_sigma_m=layers["height_sigma"], age_s=layers["age"])


def read_obstacle_scans(folder, stamp_ns: int) -> dict[str, ObstacleScan]:
    """Reads the scans of a stamp by their names ("fused" and the cameras'). InputError naming file, line and column."""
    rows = {}
    for row in read_table(require_folder(folder, "obstacle maps") / f"{int(stamp_ns)}_scans.csv", SCAN_HEADER):
        rows.setdefault(row.text("name"), []).append(row)

    def column(name, key):
        return np.array([row.number_or_nan(key) for row in rows[name]])
    scans = {}
    for name, (first, *_) in rows.items():
        scans[name] = ObstacleScan(int(stamp_ns), name, np.array([first.number("origin_x_m"), first.number("origin_y_m")]),
                                   first.number("max_range_m", 0), *(column(name, key) for key in SCAN_HEADER.split(",")[4:]))
        if not np.isfinite(scans[name].angle_rad).all() or math.isnan(scans[name].max_range_m):
            first.fail("angle_rad", "finite angles")
    return scans
