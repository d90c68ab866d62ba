"""Height maps, as build_height_map and simulate_drive write them."""
import dataclasses
import pathlib

import numpy as np

from vcharge.files import read_floats, read_gray, read_yaml


@dataclasses.dataclass(frozen=True, eq=False)
class HeightMap:
    """Height of the surface seen from above, on a regular grid: rows along y, columns along x. All arrays have one shape.

    frame_id: "map", or "world" for the truth of a simulated drive
    origin_m: x, y of the centre of the cell in row 0, column 0
    height_m: float32, NaN where not observed
    confidence: float32 from 0 (not observed) to 1
    gray: uint8, brightness seen by the cameras
    solid: uint8, not 0 for obstacles without a known height (walls, pillars)
    """

    frame_id: str
    origin_m: np.ndarray
    cell_size_m: float
    height_m: np.ndarray
    confidence: np.ndarray | None = None
    gray: np.ndarray | None = None
    solid: np.ndarray | None = None

    def centres_m(self) -> np.ndarray:
        """x, y of the cells' centres (rows x columns x 2)."""
        rows, columns = np.indices(self.height_m.shape)
        return self.origin_m + self.cell_size_m * np.stack([columns, rows], -1)

    def height_at(self, positions_m) -> np.ndarray:
        """Heights (...) at positions (... x 2) by bilinear interpolation; NaN if one of the four cells around is outside or
        unknown."""
        cells = (np.asarray(positions_m, float) - self.origin_m) / self.cell_size_m
        with np.errstate(invalid="ignore"):
            low = np.floor(cells).astype(int)
        inside = ((low >= 0) & (low < np.array(self.height_m.shape[::-1]) - 1)).all(-1)
        low = np.where(inside[..., None], low, 0)
        (column, row), (x, y) = np.moveaxis(low, -1, 0), np.moveaxis(cells - low, -1, 0)
        if min(self.height_m.shape) < 2:
            return np.full(inside.shape, np.nan)
        at = self.height_m.astype(float)
        heights = (1 - y) * ((1 - x) * at[row, column] + x * at[row, column + 1]) + \
            y * ((1 - x) * at[row + 1, column] + x * at[row + 1, column + 1])
        return np.where(inside, heights, np.nan)


def read_height_map(path) -> HeightMap:
    """Reads a height map. `path` is its YAML file, or a folder with height_map.yaml. InputError naming the file and the key."""
    path = pathlib.Path(path)
    if path.is_dir():
        path = path / "height_map.yaml"
    top = read_yaml(path)
    origin = top.required("origin_m").numbers(2)
    cell_size = top.required("cell_size_m").number(1e-300, expected="a positive number of metres")
    size_entry = top.required("size_cells")
    size = [entry.integer(1, 2 ** 31 - 1, "two positive numbers of cells") for entry in size_entry.entries("two numbers of cells")]
    if len(size) != 2:
        size_entry.fail("two numbers of cells")
    heights = read_floats(path.parent / top.required("file").text("the name of a file"), size)

    def layer(key, read):
        return read(path.parent / top.required(key).text("the name of a file"), size) if top.has(key) else None
    return HeightMap(top.required("frame").text("the name of a frame"), origin, cell_size, heights,
                     layer("confidence_file", read_floats), layer("gray_file", read_gray), layer("solid_file", read_gray))
