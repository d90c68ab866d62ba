"""Errors of a localized drive against the truth, relative to the map in which it was localized."""
import csv

import matplotlib
import numpy as np

import vcharge
from vcharge_evaluation.poses import at_stamps, rotations

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402

# Frames without a pose count with these errors, and no frame counts with a larger one.
BOUND_M, BOUND_DEG = 0.5, 2.0


class Map:
    """A map and the true poses of its keyframes."""

    def __init__(self, path, true_trajectory):
        self.path = path
        poses = vcharge.read_map(path).trajectory().rows
        self.fit(poses, at_stamps(true_trajectory, poses[:, 0]))

    def fit(self, poses, truth):
        """Takes the poses of the keyframes and the true ones, as rows of TUM files."""
        self.positions, self.rotations = poses[:, 1:4], rotations(poses[:, 4:])
        self.true_positions, self.true_rotations = truth[:, 1:4], rotations(truth[:, 4:])
        # world_from_map, fitted to all keyframes.
        centre, true_centre = self.positions.mean(0), self.true_positions.mean(0)
        u, _, v = np.linalg.svd((self.true_positions - true_centre).T @ (self.positions - centre))
        self.turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
        # The map's lengths over the true ones.
        turned, true = (self.positions - centre) @ self.turn.T, self.true_positions - true_centre
        self.scale = float((turned * true).sum() / (true ** 2).sum())
        self.shift = true_centre - self.turn @ centre

    def carry(self, positions, turns):
        """Transforms true poses in the world into the map, relative to the nearest keyframe."""
        keyframe = ((positions[:, None, :] - self.true_positions[None, :, :]) ** 2).sum(-1).argmin(1)
        back = self.true_rotations[keyframe].transpose(0, 2, 1)
        between = np.einsum("nij,nj->ni", back, positions - self.true_positions[keyframe])
        return (self.positions[keyframe] + np.einsum("nij,nj->ni", self.rotations[keyframe], between),
                self.rotations[keyframe] @ back @ turns)


class LocalizationErrors:
    """Errors of each frame of localize_drive's output. Where a frame has no pose they are infinite or not a number."""

    def __init__(self, csv_path, true_trajectory, mapped):
        with open(csv_path, encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.time_s = np.array([float(row["time_s"]) for row in rows])
        self.status = np.array([row["status"] for row in rows])
        self.latency_s = np.array([float(row["latency_s"]) for row in rows])
        self.has_pose = np.array([row["tx"] != "" for row in rows])
        size = len(rows)
        self.error_m, self.error_deg = np.full(size, np.inf), np.full(size, np.inf)
        self.heading_deg, self.absolute_m = np.full(size, np.inf), np.full(size, np.inf)
        self.normalized, self.sigma_m = np.full(size, np.nan), np.full(size, np.nan)
        self.covariance = np.full((size, 6, 6), np.nan)
        if self.has_pose.any():
            self.judge([row for row in rows if row["tx"] != ""], true_trajectory, mapped)

    def judge(self, rows, true_trajectory, mapped):
        truth = at_stamps(true_trajectory, self.time_s[self.has_pose])
        estimated = np.array([[float(row[key]) for key in ("tx", "ty", "tz", "qx", "qy", "qz", "qw")] for row in rows])
        true_positions, true_turns = mapped.carry(truth[:, 1:4], rotations(truth[:, 4:]))
        shift = estimated[:, :3] - true_positions
        turn = rotations(estimated[:, 3:]) @ true_turns.transpose(0, 2, 1)
        axis = 0.5 * np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0],
                               turn[:, 1, 0] - turn[:, 0, 1]], -1)
        cosine = np.clip((np.trace(turn, axis1=1, axis2=2) - 1) / 2, -1, 1)
        covariance = np.zeros((len(rows), 6, 6))
        for i in range(6):
            for k in range(i, 6):
                covariance[:, i, k] = covariance[:, k, i] = [float(row[f"covariance_{i}{k}"]) for row in rows]
        self.covariance[self.has_pose] = covariance
        planar = np.ix_(range(len(rows)), [0, 1, 5], [0, 1, 5])
        errors = np.stack([shift[:, 0], shift[:, 1], axis[:, 2]], -1)
        self.error_m[self.has_pose] = np.linalg.norm(shift, axis=1)
        self.error_deg[self.has_pose] = np.degrees(np.arccos(cosine))
        self.heading_deg[self.has_pose] = np.degrees(np.abs(axis[:, 2]))
        world = estimated[:, :3] @ mapped.turn.T + mapped.shift
        self.absolute_m[self.has_pose] = np.linalg.norm(world - truth[:, 1:4], axis=1)
        self.normalized[self.has_pose] = np.einsum(
            "ni,ni->n", errors, np.linalg.solve(covariance[planar], errors[..., None])[..., 0]) / 3
        self.sigma_m[self.has_pose] = np.sqrt(np.trace(covariance[:, :3, :3], axis1=1, axis2=2))

    def localized(self):
        return self.status == "localized"

    def ratio(self):
        """Localized frames over all."""
        return float(self.localized().mean())

    def num_false(self):
        """Frames reported as localized that are more than 0.5 m or 2 degrees off."""
        return int((self.localized() & ((self.error_m > BOUND_M) | (self.error_deg > BOUND_DEG))).sum())

    @staticmethod
    def quantile(errors, which, bound):
        """Percentile over all frames."""
        return float(np.percentile(np.minimum(errors, bound), which))

    def apart(self):
        """Normalized errors squared per degree of freedom of localized frames two seconds apart."""
        values, last_s = [], -np.inf
        for i in np.flatnonzero(self.localized()):
            if self.time_s[i] - last_s >= 2.0:
                last_s = self.time_s[i]
                values.append(self.normalized[i])
        return values

    def consistency(self):
        """Mean normalized error squared per degree of freedom over localized frames two seconds apart, and their number."""
        values = self.apart()
        return float(np.mean(values)), len(values)

    def plot(self, path):
        figure, axes = plt.subplots(3, 1, figsize=(9, 8), sharex=True)
        time_s = self.time_s - self.time_s[0]
        good = self.localized()
        axes[0].plot(time_s[self.has_pose], 100 * self.error_m[self.has_pose], ".", color="0.6", label="bridged")
        axes[0].plot(time_s[good], 100 * self.error_m[good], ".", label="localized")
        axes[0].plot(time_s[self.has_pose], 100 * self.sigma_m[self.has_pose], "-", linewidth=0.8, label="sigma")
        axes[0].set_ylabel("position (cm)")
        axes[0].legend(loc="upper right")
        axes[1].plot(time_s[good], self.heading_deg[good], ".")
        axes[1].set_ylabel("heading (deg)")
        axes[2].plot(time_s[good], self.normalized[good], ".")
        axes[2].axhline(1.0, color="0.5", linewidth=0.8)
        axes[2].set_ylabel("normalized error\nsquared per degree\nof freedom")
        axes[2].set_xlabel("time (s)")
        figure.tight_layout()
        figure.savefig(path, dpi=110)
        plt.close(figure)
