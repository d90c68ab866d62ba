"""Pose graphs of simulated drives: a ring, the streets of a city, and a sphere."""
import math
import random

import numpy as np


def made_graphs(folder, seed):
    """Writes the graphs as g2o files; returns their paths by name."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for name, make in (("ring", make_ring), ("city10k", make_city), ("sphere2500", make_sphere)):
        paths[name] = folder / f"{name}.g2o"
        paths[name].write_text("\n".join(make(random.Random(seed))) + "\n", encoding="utf-8")
    return paths


def planar_edges(poses, loops, sigma_m, sigma_rad, draw):
    """Lines of a planar graph: noisy steps between consecutive poses (x, y, yaw), and noisy loops."""
    information = f"{sigma_m ** -2:.9g} 0 0 {sigma_m ** -2:.9g} 0 {sigma_rad ** -2:.9g}"
    for first, second in [*((i, i + 1) for i in range(len(poses) - 1)), *loops]:
        (x0, y0, yaw0), (x1, y1, yaw1) = poses[first], poses[second]
        c, s = math.cos(yaw0), math.sin(yaw0)
        x = c * (x1 - x0) + s * (y1 - y0) + draw.gauss(0, sigma_m)
        y = -s * (x1 - x0) + c * (y1 - y0) + draw.gauss(0, sigma_m)
        yaw = math.remainder(yaw1 - yaw0 + draw.gauss(0, sigma_rad), 2 * math.pi)
        yield f"EDGE_SE2 {first} {second} {x:.9g} {y:.9g} {yaw:.9g} {information}"


def make_ring(draw):
    """A ring of 434 nodes that ends with 26 loops to its beginning."""
    num_nodes, num_loops, radius_m = 434, 26, 40.0
    turn = 2 * math.pi / (num_nodes - num_loops)
    poses = [(radius_m * math.sin(i * turn), radius_m * (1 - math.cos(i * turn)), i * turn) for i in range(num_nodes)]
    loops = [(i, i + num_nodes - num_loops) for i in range(num_loops)]
    return list(planar_edges(poses, loops, 0.03, 0.003, draw))


def make_city(draw):
    """10,000 steps of 1 m through the streets of a city, a corner every 8 m, with a loop to earlier visits of a point."""
    block_m, size_blocks, num_nodes, max_loops = 8, 12, 10000, 2
    x = y = heading = 0
    poses, visits, loops = [], {}, []
    for node in range(num_nodes):
        poses.append((float(x), float(y), heading * math.pi / 2))
        earlier = [other for other in visits.get((x, y), []) if node - other > 3]
        loops += [(other, node) for other in draw.sample(earlier, min(max_loops, len(earlier)))]
        visits.setdefault((x, y), []).append(node)
        if x % block_m == 0 and y % block_m == 0:
            heading += draw.choice((-1, 0, 0, 1))
        dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[heading % 4]
        if not (0 <= x + dx <= block_m * size_blocks and 0 <= y + dy <= block_m * size_blocks):
            heading += 1 if (0 <= x - dy <= block_m * size_blocks and 0 <= y + dx <= block_m * size_blocks) else -1
            dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[heading % 4]
        x, y = x + dx, y + dy
    return list(planar_edges(poses, loops, 0.05, 0.01, draw))


def make_sphere(draw):
    """50 laps of 50 nodes around a sphere; each node has a loop to that of the lap before."""
    laps, per_lap, radius_m, sigma_m, sigma_rad = 50, 50, 50.0, 0.05, 0.005
    poses = []
    for i in range(laps * per_lap):
        along, up = 2 * math.pi * i / per_lap, math.pi * ((i + 0.5) / (laps * per_lap) - 0.5)
        out = np.array([math.cos(along) * math.cos(up), math.sin(along) * math.cos(up), math.sin(up)])
        forward = np.array([-math.sin(along), math.cos(along), 0.0])
        poses.append((np.column_stack([forward, np.cross(out, forward), out]), radius_m * out))
    loops = [(i - per_lap, i) for i in range(per_lap, len(poses))]
    # The vector part of a quaternion is half an angle.
    weights = [sigma_m ** -2] * 3 + [4 * sigma_rad ** -2] * 3
    information = " ".join(f"{weights[i]:.9g}" if i == j else "0" for i in range(6) for j in range(i, 6))
    lines = []
    for first, second in [*((i, i + 1) for i in range(len(poses) - 1)), *loops]:
        turn = poses[first][0].T @ poses[second][0]
        shift = poses[first][0].T @ (poses[second][1] - poses[first][1])
        shift = shift + [draw.gauss(0, sigma_m) for _ in range(3)]
        turn = turn @ small_rotation([draw.gauss(0, sigma_rad) for _ in range(3)])
        lines.append(" ".join([f"EDGE_SE3:QUAT {first} {second}", *(f"{value:.9g}" for value in [*shift, *quaternion_of(turn)]),
                               information]))
    return lines


def small_rotation(vector):
    x, y, z = vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    u, _, v = np.linalg.svd(np.eye(3) + cross)
    return u @ v


def quaternion_of(rotation):
    """x, y, z, w of a rotation matrix."""
    values, vectors = np.linalg.eigh(np.array([
        [rotation[0, 0] - rotation[1, 1] - rotation[2, 2], rotation[0, 1] + rotation[1, 0], rotation[0, 2] + rotation[2, 0],
         rotation[2, 1] - rotation[1, 2]],
        [rotation[0, 1] + rotation[1, 0], rotation[1, 1] - rotation[0, 0] - rotation[2, 2], rotation[1, 2] + rotation[2, 1],
         rotation[0, 2] - rotation[2, 0]],
        [rotation[0, 2] + rotation[2, 0], rotation[1, 2] + rotation[2, 1], rotation[2, 2] - rotation[0, 0] - rotation[1, 1],
         rotation[1, 0] - rotation[0, 1]],
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1],
         rotation[0, 0] + rotation[1, 1] + rotation[2, 2]]]))
    return vectors[:, np.argmax(values)]
