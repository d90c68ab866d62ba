"""Parking bays, as map_bays and simulate_drive write them."""
import dataclasses

import numpy as np

from vcharge.files import read_yaml

KINDS = ("perpendicular", "angled", "parallel")
STATES = ("free", "occupied", "unknown")


@dataclasses.dataclass(frozen=True, eq=False)
class ParkingBay:
    """A marked parking bay, between the middles of its lines.

    row: bays side by side are of one row
    kind: "perpendicular", "angled" or "parallel"
    state: "free", "occupied" or "unknown"
    corners_m: 4 x 2, x and y, counter-clockwise from above; the first two are the ends of the entry
    entry_sigma_m: standard deviation per axis of the first two corners
    end_sigma_m: standard deviation per axis of the last two corners
    confidence: from 0 to 1
    """

    id: int
    row: int
    kind: str
    state: str
    corners_m: np.ndarray
    entry_sigma_m: float
    end_sigma_m: float
    confidence: float


@dataclasses.dataclass(frozen=True, eq=False)
class ParkingBays:
    """The bays of a car park.

    frame_id: "map", or "world" for the truth of a simulated drive
    """

    frame_id: str
    bays: list[ParkingBay]


def read_bays(path) -> ParkingBays:
    """Reads bays.yaml. InputError naming the file and the key."""
    top = read_yaml(path)
    frame_id = top.required("frame").text("the name of a frame")
    return ParkingBays(frame_id, [_bay_of(entry) for entry in top.required("bays").entries("parking bays as a list")])


def _bay_of(entry):
    corners_entry = entry.required("corners_m")
    corners = [corner.numbers(2, "[x, y] in metres") for corner in corners_entry.entries("four corners [x, y]")]
    if len(corners) != 4:
        corners_entry.fail("four corners [x, y]")
    metres = "a number of metres from 0"
    return ParkingBay(entry.required("id").integer(expected="a number from 0"),
                      entry.required("row").integer(expected="a number from 0"),
                      entry.required("kind").choice(KINDS), entry.required("state").choice(STATES), np.array(corners),
                      entry.required("entry_sigma_m").number(0, expected=metres),
                      entry.required("end_sigma_m").number(0, expected=metres),
                      entry.required("confidence").number(0, 1, "a number from 0 to 1"))
