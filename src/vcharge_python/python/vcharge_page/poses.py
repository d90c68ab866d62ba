"""Poses of the vehicle between the keyframes of a map."""
import numpy as np

from vcharge import SparseMap, transforms

MAX_GAP_S = 5.0  # from a stamp to the nearest keyframe


class Timeline:
    """The keyframes of a map's sessions over time."""

    def __init__(self, sparse_map: SparseMap):
        self.trajectories = [sparse_map.trajectory(number) for number in range(len(sparse_map.sessions))]

    def session_at(self, stamp_ns):
        """The session whose keyframes are nearest in time, or None if all are more than MAX_GAP_S away."""
        gaps = [np.abs(one.stamps_ns - stamp_ns).min() if len(one) else np.inf for one in self.trajectories]
        return int(np.argmin(gaps)) if gaps and min(gaps) <= MAX_GAP_S * 1e9 else None

    def map_from_vehicle(self, session, stamp_ns):
        """Pose (4 x 4) at a stamp, between the keyframes around it; at the ends that of the last keyframe."""
        one = self.trajectories[session]
        right = int(np.clip(np.searchsorted(one.stamps_ns, stamp_ns), 1, max(len(one) - 1, 1)))
        if len(one) == 1:
            return one.world_from_vehicle[0]
        left = right - 1
        part = np.clip((stamp_ns - one.stamps_ns[left]) / (one.stamps_ns[right] - one.stamps_ns[left]), 0.0, 1.0)
        first, second = one.rotations_xyzw[left], one.rotations_xyzw[right]
        # Turns between keyframes are small: the chord serves.
        turn = (1 - part) * first + part * (second if first @ second >= 0 else -second)
        return transforms.transform_of((1 - part) * one.positions_m[left] + part * one.positions_m[right], turn)

    def ground_at(self, positions_m):
        """Heights (N) of the keyframes nearest to positions (N x 2): the vehicle's frame is on the ground."""
        known = np.concatenate([one.positions_m for one in self.trajectories])
        if not len(known):
            return np.zeros(len(positions_m))
        return np.array([known[((known[:, :2] - position) ** 2).sum(1).argmin(), 2] for position in positions_m])
