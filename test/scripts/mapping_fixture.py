"""What the tests of mapping share: reading trajectories and maps, and comparing them with the truth."""
import sqlite3

import numpy as np
import vcharge


def positions(path):
    """Stamps (N) and positions (N x 3) of a TUM file."""
    trajectory = vcharge.read_trajectory(path)
    return trajectory.times_s, trajectory.positions_m


def rigid_transform(points, targets):
    """Rotation and translation that align points with targets (Umeyama 1991, without scale)."""
    centre, target_centre = points.mean(axis=0), targets.mean(axis=0)
    u, _, v = np.linalg.svd((targets - target_centre).T @ (points - centre))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    return rotation, target_centre - rotation @ centre


def align(points, targets):
    rotation, shift = rigid_transform(points, targets)
    return points @ rotation.T + shift


def errors_m(trajectory, truth):
    """Position errors of a TUM file after alignment with the truth at the same stamps."""
    stamps, estimate = positions(trajectory)
    truth_stamps, true_positions = positions(truth)
    nearest = np.abs(truth_stamps[None, :] - stamps[:, None]).argmin(axis=1)
    return np.linalg.norm(align(estimate, true_positions[nearest]) - true_positions[nearest], axis=1)


def numbers_of_map(path):
    """All columns of a map whose numbers must be finite, as arrays."""
    poses = "x_m y_m z_m qx qy qz qw"
    columns = {}
    with sqlite3.connect(str(path)) as connection:
        for table, names in (("keyframe", poses), ("landmark", "x_m y_m z_m"), ("loop_edge", poses)):
            for name in names.split():
                rows = connection.execute(f"SELECT {name} FROM {table}").fetchall()
                columns[f"{table}.{name}"] = np.array([row[0] for row in rows])
        for table, name, kind in (("image", "positions_px_f32", np.float32), ("landmark", "covariance_3x3_f64", float)):
            blobs = [np.frombuffer(row[0], kind) for row in connection.execute(
                f"SELECT {name} FROM {table} WHERE {name} IS NOT NULL")]
            columns[f"{table}.{name}"] = np.concatenate(blobs)
    return columns
