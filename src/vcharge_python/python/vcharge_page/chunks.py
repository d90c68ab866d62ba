"""Points in chunks that can be drawn coarsely: the first n points of a chunk are a fair sample of all."""
import dataclasses

import numpy as np

MAX_POINTS = 40_000  # of a chunk
MAX_LEVELS = 20  # of the octree; points that lie together are not parted further
LARGEST = 32767


@dataclasses.dataclass(frozen=True, eq=False)
class Chunk:
    """Points in a box: `packed` is int16 (N x 4): x, y, z from the box's lower to its upper end, and a value, as -32767 to
    32767."""
    centre_m: np.ndarray
    half_size_m: np.ndarray
    packed: np.ndarray

    def points_m(self):
        """The points as they are drawn (N x 3)."""
        return self.centre_m + self.packed[:, :3] * (self.half_size_m / LARGEST)


def chunks_of(points_m, values, max_points=MAX_POINTS):
    """Chunks of points (N x 3) with values from 0 to 1 (N). Octants are split until they hold at most `max_points`; within a chunk
    the order is random."""
    points = np.asarray(points_m, float).reshape(-1, 3)
    if not len(points):
        return []
    order = np.random.default_rng(1).permutation(len(points))  # kept by every split
    low, high = points.min(0), points.max(0)
    chunks, waiting = [], [(order, 0.5 * (low + high), 0.5 * max(float((high - low).max()), 1e-3), 0)]
    while waiting:
        indices, centre, half_size, level = waiting.pop()
        if len(indices) <= max_points or level == MAX_LEVELS:
            chunks.append(_chunk_of(points[indices], np.asarray(values)[indices]))
            continue
        octant = (points[indices] >= centre) @ [1, 2, 4]
        for number in reversed(range(8)):
            inside = indices[octant == number]
            if len(inside):
                signs = np.array([number & 1, number >> 1 & 1, number >> 2 & 1]) - 0.5
                waiting.append((inside, centre + half_size * signs, 0.5 * half_size, level + 1))
    return chunks


def _chunk_of(points, values):
    low, high = points.min(0), points.max(0)
    centre, half_size = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-6)
    packed = np.empty((len(points), 4), np.int16)
    packed[:, :3] = np.clip(np.round((points - centre) / half_size * LARGEST), -LARGEST, LARGEST)
    packed[:, 3] = np.round((2.0 * np.clip(values, 0.0, 1.0) - 1.0) * LARGEST)
    return Chunk(centre, half_size, packed)
