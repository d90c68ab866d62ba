"""The calibrated cameras of a vehicle: rig.yaml."""
import dataclasses
import math
import pathlib
import re

import numpy as np

from vcharge import transforms
from vcharge.camera_models import MODELS, CameraModel
from vcharge.errors import InputError
from vcharge.files import Entry, parse_yaml, read_gray, read_text

MAX_READOUT_S, MAX_CLOCK_OFFSET_S, MAX_STAMP_TOLERANCE_S = 0.2, 1.0, 0.1
DIRECTIONS = ("down", "up", "right", "left")


@dataclasses.dataclass(frozen=True, eq=False)
class Camera:
    """One camera of a rig.

    image_size_px: width, height
    field_of_view_rad: pixels whose ray leaves this cone (full angle) are not used
    mask: uint8 (height x width), 0 where the vehicle itself is seen; None without a mask
    vehicle_from_camera: 4 x 4; None before extrinsic calibration
    covariance: of vehicle_from_camera, 6 x 6 over [dt, dphi] in the vehicle's frame (m, rad), or None
    focal_sigma: relative; 0: unknown
    principal_point_sigma_px: 0: unknown
    readout_s: between the first and the last line of an image
    clock_offset_s: the vehicle's clock minus the camera's
    """

    name: str
    frame_id: str
    image_size_px: tuple[int, int]
    model: CameraModel
    field_of_view_rad: float = math.pi
    mask: np.ndarray | None = dataclasses.field(default=None, repr=False)
    vehicle_from_camera: np.ndarray | None = None
    covariance: np.ndarray | None = None
    focal_sigma: float = 0.0
    principal_point_sigma_px: float = 0.0
    readout_s: float = 0.0
    readout_direction: str = "down"
    clock_offset_s: float = 0.0

    @property
    def intrinsics(self) -> dict[str, float]:
        """Parameters of the model by their names in rig.yaml."""
        return self.model.parameters

    def project(self, points_in_camera) -> np.ndarray:
        """Pixels (... x 2) of points (... x 3, m) in the camera's frame; NaN where the lens has no image of the point. Pixels can
        lie outside the image."""
        return self.model.project(points_in_camera)

    def unproject(self, pixels) -> np.ndarray:
        """Unit rays (... x 3) in the camera's frame of pixels (... x 2); NaN where no ray has that image."""
        return self.model.unproject(pixels)

    def camera_from_vehicle(self, points_in_vehicle) -> np.ndarray:
        """Points (... x 3, m) of the vehicle's frame in the camera's frame. ValueError before extrinsic calibration."""
        if self.vehicle_from_camera is None:
            raise ValueError(f"camera {self.name} has no vehicle_from_camera")
        return transforms.apply(transforms.inverse(self.vehicle_from_camera), points_in_vehicle)


@dataclasses.dataclass(frozen=True, eq=False)
class Rig:
    """The cameras of a vehicle, by name, in the order of rig.yaml.

    scale_sigma: relative standard deviation of the scale that all translations have in common; 0: unknown
    stamp_tolerance_s: images whose stamps differ by at most this are one frame
    """

    cameras: dict[str, Camera]
    vehicle_frame: str = "base_link"
    scale_sigma: float = 0.0
    stamp_tolerance_s: float = 0.0
    provenance: dict[str, str] = dataclasses.field(default_factory=dict)

    def __getitem__(self, name: str) -> Camera:
        """A camera. KeyError that lists the names if there is none of this name."""
        if name not in self.cameras:
            raise KeyError(f"camera '{name}': the cameras of the rig are {', '.join(self.cameras)}")
        return self.cameras[name]

    def __iter__(self):
        """The cameras in order."""
        return iter(self.cameras.values())

    def __len__(self) -> int:
        return len(self.cameras)


def read_rig(path) -> Rig:
    """Reads rig.yaml and its masks, whose paths are relative to it. InputError naming the file, the key and what was expected: for
    unknown keys, numbers that are not finite, a rotation whose norm differs from 1 by more than 1e-3, a mask of another size."""
    path = pathlib.Path(path)
    return parse_rig(read_text(path), str(path), path.parent)


def parse_rig(text: str, source: str, mask_folder: pathlib.Path | None, masks: dict | None = None) -> Rig:
    """Reads a rig from text. `source` names it in errors; masks come from a folder, or by the cameras' names from a dict."""
    top = parse_yaml(text, source)
    if not isinstance(top.node, dict):
        top.fail("a rig with the keys vehicle_frame and cameras")
    top.check_keys(("vehicle_frame", "provenance", "scale_sigma", "stamp_tolerance_s", "cameras"))
    cameras = {}
    for name, entry in top.required("cameras").items("a map from camera names to cameras"):
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
            raise InputError(f"{source}: cameras.{name}: expected a name of letters, digits and underscores")
        cameras[name] = _camera_of(name, entry, mask_folder, masks)
    provenance = top.required("provenance").items("a map of texts") if top.has("provenance") else []
    return Rig(cameras, top.required("vehicle_frame").text() if top.has("vehicle_frame") else "base_link",
               _optional(top, "scale_sigma", 0.0, 0.0, math.inf, "a number from 0"),
               _optional(top, "stamp_tolerance_s", 0.0, 0.0, MAX_STAMP_TOLERANCE_S, f"seconds from 0 to {MAX_STAMP_TOLERANCE_S}"),
               {key: str(entry.node) for key, entry in provenance})


def _optional(entry: Entry, key, default, low, high, expected):
    return entry.required(key).number(low, high, expected) if entry.has(key) else default


def _camera_of(name, entry, mask_folder, masks):
    entry.check_keys(("frame_id", "image_size_px", "model", "intrinsics", "field_of_view_rad", "mask", "vehicle_from_camera",
                      "focal_sigma", "principal_point_sigma_px", "readout_s", "readout_direction", "clock_offset_s"))
    size_entry = entry.required("image_size_px")
    size = [part.integer(1, 32767, "[width, height] as whole numbers from 1 to 32767") for part in
            size_entry.entries("[width, height] as whole numbers from 1 to 32767")]
    if len(size) != 2:
        size_entry.fail("[width, height] as whole numbers from 1 to 32767")
    model = MODELS[entry.required("model").choice(tuple(MODELS))]
    intrinsics = entry.required("intrinsics")
    intrinsics.check_keys(model.parameter_names)
    values = {key: intrinsics.required(key).number() for key in model.parameter_names}
    try:
        lens = model(**values)
    except ValueError as error:
        raise InputError(f"{intrinsics.source}: {intrinsics.key}.{error}") from error
    mask = (masks or {}).get(name)
    if entry.has("mask") and masks is None:
        file = entry.required("mask")
        try:
            mask = read_gray(mask_folder / file.text(), size)
        except InputError as error:
            raise InputError(f"{file.source}: {file.key}: {error}") from error
    pose, covariance = _extrinsics_of(entry.required("vehicle_from_camera")) if entry.has("vehicle_from_camera") else (None, None)
    return Camera(
        name, entry.required("frame_id").text() if entry.has("frame_id") else f"camera_{name}_optical", tuple(size), lens,
        _optional(entry, "field_of_view_rad", math.pi, 1e-300, 2 * math.pi, "an angle in (0, 2 pi]"), mask, pose, covariance,
        _optional(entry, "focal_sigma", 0.0, 0.0, math.inf, "a number from 0"),
        _optional(entry, "principal_point_sigma_px", 0.0, 0.0, math.inf, "a number from 0"),
        _optional(entry, "readout_s", 0.0, 0.0, MAX_READOUT_S, f"seconds from 0 to {MAX_READOUT_S}"),
        entry.required("readout_direction").choice(DIRECTIONS) if entry.has("readout_direction") else "down",
        _optional(entry, "clock_offset_s", 0.0, -MAX_CLOCK_OFFSET_S, MAX_CLOCK_OFFSET_S,
                  f"seconds from -{MAX_CLOCK_OFFSET_S} to {MAX_CLOCK_OFFSET_S}"))


def _extrinsics_of(entry):
    entry.check_keys(("translation_m", "rotation_xyzw", "covariance"))
    translation, rotation_entry = entry.required("translation_m").numbers(3), entry.required("rotation_xyzw")
    rotation = rotation_entry.numbers(4)
    if abs(np.linalg.norm(rotation) - 1) > 1e-3:
        rotation_entry.fail("a unit quaternion")
    covariance = None
    if entry.has("covariance"):
        covariance = entry.required("covariance").numbers(36).reshape(6, 6)
        if not np.allclose(covariance, covariance.T, rtol=1e-6, atol=1e-6 * np.abs(covariance).max()) or \
                (covariance.diagonal() < 0).any():
            entry.required("covariance").fail("a symmetric 6 x 6 matrix with a diagonal that is not negative")
    return transforms.transform_of(translation, rotation), covariance
