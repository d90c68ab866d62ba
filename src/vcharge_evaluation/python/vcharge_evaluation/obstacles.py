"""Obstacles: range errors, obstacles missed, false cells, and cells inside obstacles that were free."""
import argparse

from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import CONFIG, judge, run_tool, simulate

# pitch is the lot's drive on a soft suspension. The other_day drives are those of the chain (chain/steps.py).
OTHER_DAY = ["--drive", "other_day", "--duration-s", 8, "--exposure-gain", 1.2, "--set", "odometer.scale_error=-0.0005",
             "--set", "odometer.left_right_error=0.0003"]
STOP_AND_GO = ["--scene", "lot", "--drive", "stop_and_go", "--duration-s", 6]
DRIVES = {
    "course": ["--scene", "obstacles", "--drive", "creep", "--duration-s", 19.5],
    "lot": STOP_AND_GO,
    "pitch": [*STOP_AND_GO, "--set", "faults.soft_suspension.pitch_factor=4"],
    "garage": ["--scene", "garage", "--drive", "short", "--duration-s", 4],
    "lot_other_day": ["--scene", "lot", *OTHER_DAY],
    "garage_other_day": ["--scene", "garage", *OTHER_DAY],
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "obstacle_evaluation")
    parser.add_argument("--small", action="store_true",
                        help="images of 512x320, which render faster; range maps have 384x240 pixels either way")
    parser.add_argument("--seed", type=int, default=108, help="those below 50 serve to choose options")
    parser.add_argument("--rig-seed", type=int, default=1, help="random rig of the other_day drives")
    parser.add_argument("--drives", nargs="*", default=["course", "lot", "pitch", "garage"], choices=DRIVES)
    return parser.parse_args()


def detect(args, name):
    """Errors of the obstacle maps of a drive."""
    if name.endswith("_other_day"):
        words = ["--seed", args.seed + 400, "--rig", "random", "--rig-seed", args.rig_seed, "--image-scale", 0.5]
        folder = args.work / f"{name}_seed{args.seed}_rig{args.rig_seed}"
    else:
        words = ["--seed", f"{args.seed}1", "--image-scale", 0.4 if args.small else 1.0]
        folder = args.work / (f"{name}_seed{args.seed}" + ("_small" if args.small else ""))
    simulate(folder, [*DRIVES[name], *words, "--scene-seed", args.seed, "--cameras", "front", "left", "right",
                      "--truth-range"])
    run_tool("detect_obstacles", folder / "detect.log", "--bag", folder / "drive.bag", "--rig", folder / "rig_truth.yaml",
             "--options", CONFIG / "obstacles.yaml", "--range-options", CONFIG / "dense_obstacles.yaml", "--output",
             folder / "obstacles")
    return judge("obstacles", folder / "report", "--obstacles", folder / "obstacles", "--truth", folder / "drive_truth")


def summary(errors):
    """The main figures of evaluate_obstacles's report."""
    fused = next(scan for scan in errors["scans"] if scan["name"] == "fused")["aside"]["error_m"]
    judged = errors["map"]["obstacles"]
    return {"mean_m": fused["mean"], "p95_m": fused["percentile_95"], "obstacles": len(judged),
            "missed": sum(not obstacle["reported"] for obstacle in judged),
            "false_per_10_m": errors["map"]["false_cells_per_10_m"], "free_inside": errors["map"]["free_inside"],
            "observed_inside": errors["map"]["observed_inside"]}


def figures(found):
    return [figure("range error within 5 m, mean", 100 * found["mean_m"], "cm", at_most=7),
            Figure("range error within 5 m, 95 %", 100 * found["p95_m"], "cm"),
            figure(f"obstacles missed, of {found['obstacles']}", found["missed"], equal=0),
            figure("false cells per 10 m", found["false_per_10_m"], at_most=1.0),
            figure("cells inside obstacles that were free", found["free_inside"], equal=0),
            Figure("cells inside obstacles that were observed", found["observed_inside"])]


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("obstacles", "Obstacles", args)
    for name in args.drives:
        results.add(f"Obstacles of 20 cm and more at 0.5 to 5 m{', small images' if args.small else ''}",
                    (f"{name}, seed {args.seed}", figures(summary(detect(args, name)))))
    results.end()


if __name__ == "__main__":
    main()
