"""Range maps, as compute_range_maps writes them."""
import dataclasses

import numpy as np

from vcharge.camera_models import MeiCamera
from vcharge.files import read_floats, read_gray, read_yaml, require_folder, stamps_of_files


@dataclasses.dataclass(frozen=True, eq=False)
class RangeMap:
    """Distance along the ray of each pixel of a working camera, a Mei camera without distortion. All arrays are height x width.

    frame_id: optical frame of the camera
    camera: pixel to ray
    range_m: float32, metres along the ray, not depth along the axis; NaN where unknown
    standard_deviation_m: float32; NaN where unknown
    confidence: float32 from 0 (no support) to 1; 0 where unknown
    reference: uint8, the camera's image; None if it was not kept
    """

    stamp_ns: int
    camera_name: str
    frame_id: str
    camera: MeiCamera
    range_m: np.ndarray
    standard_deviation_m: np.ndarray
    confidence: np.ndarray
    reference: np.ndarray | None = None

    def rays(self) -> np.ndarray:
        """Unit rays of the pixels (height x width x 3) in the camera's frame; NaN where a pixel has none."""
        columns, rows = np.meshgrid(np.arange(self.range_m.shape[1]), np.arange(self.range_m.shape[0]))
        return self.camera.unproject(np.stack([columns, rows], -1))

    def points_in_camera(self) -> np.ndarray:
        """Points (height x width x 3, m) in the camera's frame; NaN where unknown."""
        return self.rays() * self.range_m[..., None]


def list_range_map_cameras(folder) -> list[str]:
    """Names of the cameras with range maps in a folder of compute_range_maps, sorted."""
    folder = require_folder(folder, "range maps")
    return sorted(path.name for path in folder.iterdir() if path.is_dir() and stamps_of_files(path))


def list_range_maps(folder, camera: str) -> list[int]:
    """Stamps (ns) of a camera's range maps, ascending."""
    return stamps_of_files(require_folder(require_folder(folder, "range maps") / camera, "range maps"))


def read_range_map(folder, camera: str, stamp_ns: int) -> RangeMap:
    """Reads FOLDER/<camera>/<stamp_ns>.yaml and the images beside it. InputError naming the file, for a missing key, a missing or
    damaged image, or images of different sizes."""
    stem = require_folder(folder, "range maps") / camera / str(int(stamp_ns))
    top = read_yaml(f"{stem}.yaml")
    frame_id, mei = top.required("frame_id").text(), top.required("mei")
    parameters = {key: mei.required(key).number() for key in MeiCamera.parameter_names}
    try:
        lens = MeiCamera(**parameters)
    except ValueError as error:
        mei.fail(f"a Mei camera: {error}")
    ranges = read_floats(f"{stem}_range.tiff")
    size = ranges.shape[::-1]
    reference = f"{stem}_reference.png"
    has_reference = (stem.parent / f"{stem.name}_reference.png").exists()
    return RangeMap(int(stamp_ns), camera, frame_id, lens, ranges, read_floats(f"{stem}_sigma.tiff", size),
                    read_floats(f"{stem}_confidence.tiff", size), read_gray(reference, size) if has_reference else None)
