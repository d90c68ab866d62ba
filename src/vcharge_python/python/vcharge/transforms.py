"""Rotations and rigid transforms as matrices."""
import numpy as np


def rotation_matrices(quaternions_xyzw) -> np.ndarray:
    """Rotation matrices (N x 3 x 3) of unit quaternions (N x 4, x y z w)."""
    x, y, z, w = np.asarray(quaternions_xyzw, float).reshape(-1, 4).T
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
                     np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
                     np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def transform_of(translation_m, rotation_xyzw) -> np.ndarray:
    """The 4 x 4 matrix of a translation (3) and a quaternion (4, x y z w; its norm is made 1)."""
    return transforms_of([translation_m], [rotation_xyzw])[0]


def transforms_of(translations_m, rotations_xyzw) -> np.ndarray:
    """4 x 4 matrices (N x 4 x 4) of translations (N x 3) and quaternions (N x 4, x y z w; their norms are made 1)."""
    rotations = np.asarray(rotations_xyzw, float).reshape(-1, 4)
    matrices = np.tile(np.eye(4), (len(rotations), 1, 1))
    matrices[:, :3, :3] = rotation_matrices(rotations / np.linalg.norm(rotations, axis=1, keepdims=True))
    matrices[:, :3, 3] = translations_m
    return matrices


def planar_transform(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
    """The 4 x 4 matrix of a pose on the ground."""
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    matrix[:2, 3] = x_m, y_m
    return matrix


def inverse(transform) -> np.ndarray:
    """The inverse of a rigid transform (4 x 4)."""
    result = np.eye(4)
    result[:3, :3] = transform[:3, :3].T
    result[:3, 3] = -transform[:3, :3].T @ transform[:3, 3]
    return result


def apply(transform, points_m) -> np.ndarray:
    """Points (... x 3) carried by a transform (4 x 4)."""
    return np.asarray(points_m, float) @ transform[:3, :3].T + transform[:3, 3]
