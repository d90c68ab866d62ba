"""Projection by the camera models of rig.yaml; the same as vcharge_core's, in Python."""
import numpy as np


def project_mei(unit, mei):
    """Paper, section Camera Model."""
    x, y = unit[:, 0] / (unit[:, 2] + mei["xi"]), unit[:, 1] / (unit[:, 2] + mei["xi"])
    return distorted(x, y, mei) * [mei["gamma1"], mei["gamma2"]] + [mei["u0"], mei["v0"]]


def project_pinhole(unit, lens):
    x, y = unit[:, 0] / unit[:, 2], unit[:, 1] / unit[:, 2]
    return distorted(x, y, lens) * [lens["fx"], lens["fy"]] + [lens["cx"], lens["cy"]]


def distorted(x, y, lens):
    """Radial-tangential distortion (Brown)."""
    r = x * x + y * y
    radial = 1 + lens["k1"] * r + lens["k2"] * r * r
    return np.stack([x * radial + 2 * lens["p1"] * x * y + lens["p2"] * (r + 2 * x * x),
                     y * radial + lens["p1"] * (r + 2 * y * y) + 2 * lens["p2"] * x * y], 1)


def project_kannala_brandt(unit, lens):
    """Kannala and Brandt, PAMI 2006, as OpenCV's fisheye model."""
    across = np.hypot(unit[:, 0], unit[:, 1])
    theta = np.arctan2(across, unit[:, 2])
    radius = theta * (1 + sum(lens[f"k{i}"] * theta ** (2 * i) for i in (1, 2, 3, 4)))
    scale = radius / np.maximum(across, 1e-12)
    return unit[:, :2] * scale[:, None] * [lens["fx"], lens["fy"]] + [lens["cx"], lens["cy"]]


MODELS = {"mei": project_mei, "kannala_brandt": project_kannala_brandt, "pinhole": project_pinhole}


def project(points, camera):
    """Pixels (N x 2) of points (N x 3) in the frame of a camera of rig.yaml. Points behind a pinhole camera are not valid."""
    unit = np.asarray(points, float) / np.linalg.norm(points, axis=1, keepdims=True)
    return MODELS[camera["model"]](unit, camera["intrinsics"])


def unproject(pixels, camera):
    """Unit rays (N x 3) of pixels (N x 2) of a Mei camera; NaN outside its image."""
    mei = camera["intrinsics"]
    seen = (np.asarray(pixels, float) - [mei["u0"], mei["v0"]]) / [mei["gamma1"], mei["gamma2"]]
    plane = seen.copy()
    for _ in range(100):  # fixed-point iteration: the distortion is a contraction inside the image circle
        plane += seen - distorted(plane[:, 0], plane[:, 1], mei)
    r = (plane ** 2).sum(1)
    with np.errstate(invalid="ignore"):
        scale = (mei["xi"] + np.sqrt(1 + (1 - mei["xi"] ** 2) * r)) / (r + 1)
    return np.column_stack([scale[:, None] * plane, scale - mei["xi"]])
