"""Pose graphs with false loops, single, in groups, and between neighbours: what the robust optimization keeps and reaches."""
import argparse
import os
import pathlib
import random

from vcharge_evaluation.graphs import made_graphs
from vcharge_evaluation.results import Results, add_arguments, figure, percent
from vcharge_evaluation.tools import run_tool, say

# Public graphs of $VCHARGE_DATA/pose_graphs.
FILES = {"manhattan": "manhattanOlson3500", "intel": "intel_vertigo", "garage": "parking-garage"}
# Number of groups of false loops, edges of a group, and whether they join neighbours.
SPOILED = {"none": (0, 1, False), "1 random": (1, 1, False), "10 random": (10, 1, False), "100 random": (100, 1, False),
           "500 random": (500, 1, False), "1000 random": (1000, 1, False), "20 x 25 grouped": (20, 25, False),
           "500 local": (500, 1, True), "20 x 25 local grouped": (20, 25, True)}
MAX_LOCAL_STEPS = 20


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "pose_graph_evaluation")
    parser.add_argument("--graphs", nargs="*", help="default: all; public ones need VCHARGE_DATA")
    parser.add_argument("--spoiled", nargs="*", default=list(SPOILED), choices=list(SPOILED))
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def base_graphs(args):
    """Paths of the graphs without false loops, by name."""
    graphs = made_graphs(args.work / "graphs", args.seed)
    folder = pathlib.Path(os.environ.get("VCHARGE_DATA", "")) / "pose_graphs"
    if os.environ.get("VCHARGE_DATA") and folder.is_dir():
        graphs = {**{name: folder / f"{file}.g2o" for name, file in FILES.items()}, **graphs}
    else:
        say("VCHARGE_DATA names no folder with pose_graphs: the public graphs are left out")
    return {name: path for name, path in graphs.items() if not args.graphs or name in args.graphs}


def spoil(source, target, num_groups, group_size, local, seed):
    """Appends false loops to a graph after the recipe of Vertigo's data sets: ends drawn from all nodes, or within 20 steps; a
    relative pose near zero, the same along a group; the information of the first loop. Returns their number."""
    lines = source.read_text(encoding="utf-8").splitlines()
    edges = [line.split() for line in lines if line.startswith("EDGE")]
    planar = edges[0][0] == "EDGE_SE2"
    num_nodes = 1 + max(max(int(edge[1]), int(edge[2])) for edge in edges)
    information = next(edge[3 + (3 if planar else 7):] for edge in edges if abs(int(edge[1]) - int(edge[2])) != 1)
    draw = random.Random(seed)
    for _ in range(num_groups):
        first = second = 0
        while first == second:
            last = num_nodes - 1 - group_size
            first = draw.randint(0, last)
            second = draw.randint(first, min(last, first + MAX_LOCAL_STEPS)) if local else draw.randint(0, last)
            first, second = min(first, second), max(first, second)
            if second == first + 1:
                second += 1
        pose = [draw.gauss(0, 0.3) for _ in range(2 if planar else 3)]
        turn = [draw.gauss(0, 0.1745) for _ in range(1 if planar else 3)]
        pose += turn if planar else quaternion(*turn)
        for step in range(group_size):
            lines.append(" ".join([edges[0][0], str(first + step), str(second + step), *(f"{value:.9g}" for value in pose),
                                   *information]))
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return num_groups * group_size


def quaternion(x_rad, y_rad, z_rad):
    """x, y, z, w of a small rotation vector."""
    half = [0.5 * x_rad, 0.5 * y_rad, 0.5 * z_rad]
    norm = (1.0 + sum(value * value for value in half)) ** 0.5
    return [value / norm for value in half] + [1.0 / norm]


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("pose_graphs", "Pose graphs", args)
    for name, path in base_graphs(args).items():
        columns = []
        for spoiled in args.spoiled:
            stem = f"{name}_{spoiled.replace(' ', '_')}"
            graph = args.work / "graphs" / f"{stem}.g2o"
            num_false = spoil(path, graph, *SPOILED[spoiled], args.seed)
            found = run_tool("evaluate_pose_graph", args.work / f"{stem}.log", "--graph", graph, "--num-false", num_false).found
            # Both end within the tolerance of the least squares.
            excess = max(0.0, 100.0 * (found["chi_squared"] / found["optimum"] - 1.0))
            columns.append((spoiled, [
                figure("squared error above the optimum without false loops", excess, "%", at_most=5),
                figure("false loops kept", found["num_false_kept"], equal=0),
                figure("true edges rejected", percent(found["num_true_rejected"], found["num_edges"] - num_false), "%"),
                figure("time", found["seconds"], "s")]))
        results.add(f"False loops in {name}", *columns)
    results.end()


if __name__ == "__main__":
    main()
