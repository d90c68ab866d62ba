"""Poses over time: TUM text."""
import dataclasses
import math
import re

import numpy as np

from vcharge import transforms
from vcharge.errors import InputError
from vcharge.files import parse_number, read_text

COLUMNS = "time_s tx ty tz qx qy qz qw"
TIME = re.compile(r"(-?)(\d{1,10})(?:\.(\d{0,9}))?")


@dataclasses.dataclass(frozen=True, eq=False)
class Trajectory:
    """Poses of the vehicle in a world frame (map, odom or that of the truth), by increasing stamps.

    stamps_ns: int64 (N)
    positions_m: N x 3
    rotations_xyzw: N x 4, world_from_vehicle, as written
    """

    stamps_ns: np.ndarray
    positions_m: np.ndarray
    rotations_xyzw: np.ndarray

    def __len__(self) -> int:
        return len(self.stamps_ns)

    @property
    def times_s(self) -> np.ndarray:
        """Stamps in seconds (N), the nearest floating-point numbers: exact to about 0.2 microseconds for present-day dates."""
        return np.array([stamp / 10 ** 9 for stamp in self.stamps_ns.tolist()])

    @property
    def rows(self) -> np.ndarray:
        """Time in seconds, position and quaternion (N x 8), as numpy.loadtxt reads the file."""
        return np.column_stack([self.times_s, self.positions_m, self.rotations_xyzw])

    @property
    def world_from_vehicle(self) -> np.ndarray:
        """Transforms (N x 4 x 4)."""
        return transforms.transforms_of(self.positions_m, self.rotations_xyzw)


def read_trajectory(path) -> Trajectory:
    """Reads lines 'time_s tx ty tz qx qy qz qw'; '#' starts a comment. InputError naming the line for other lines, stamps that do
    not increase, quaternions whose norm differs from 1 by more than 1e-3, or a file without poses."""
    stamps, values = [], []
    for number, line in enumerate(read_text(path).split("\n"), 1):
        fields = line.split("#")[0].split()
        if not fields:
            continue
        where = f"{path}: line {number}"
        numbers = [parse_number(field) for field in fields[1:]]
        if len(numbers) != 7 or None in numbers:
            raise InputError(f"{where}: expected '{COLUMNS}'")
        stamp = _stamp_of(fields[0])
        if stamp is None:
            raise InputError(f"{where}: time_s: expected a time in seconds with up to nine decimals, got '{fields[0]}'")
        if stamps and stamp <= stamps[-1]:
            raise InputError(f"{where}: time_s: expected increasing stamps, {fields[0]} does not come after the line before")
        if abs(math.sqrt(sum(value ** 2 for value in numbers[3:])) - 1) > 1e-3:
            raise InputError(f"{where}: qx qy qz qw: expected a unit quaternion")
        stamps.append(stamp)
        values.append(numbers)
    if not stamps:
        raise InputError(f"{path}: expected lines '{COLUMNS}', got none")
    poses = np.array(values)
    return Trajectory(np.array(stamps, np.int64), poses[:, :3], poses[:, 3:])


def _stamp_of(text):
    """Nanoseconds of a time in seconds, exactly; None for another text."""
    match = TIME.fullmatch(text)
    if not match or int(match[2]) > 9_000_000_000:
        return None
    nanoseconds = int(match[2]) * 10 ** 9 + int(((match[3] or "") + "0" * 9)[:9])
    return -nanoseconds if match[1] else nanoseconds
