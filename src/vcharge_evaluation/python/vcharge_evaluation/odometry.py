"""Wheel odometry of a real car from its CAN log: decoded values, and drift of the path against reference poses."""
import argparse
import csv
import math
import os
import pathlib
import sys

from vcharge_evaluation.results import Figure, Results, add_arguments, figure
from vcharge_evaluation.tools import CONFIG, run_tool

WHEELS = ("front_left_m_per_s", "front_right_m_per_s", "rear_left_m_per_s", "rear_right_m_per_s")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "odometry_evaluation")
    parser.add_argument("--drive", type=pathlib.Path, default=pathlib.Path(os.environ.get("VCHARGE_DATA", "")) / "comma2k19_can",
                        help="folder with can.log, decoded.csv and poses.csv; default: comma2k19_can in $VCHARGE_DATA")
    parser.add_argument("--layout", type=pathlib.Path, default=CONFIG / "driver" / "toyota_rav4.yaml")
    args = parser.parse_args()
    if not (args.drive / "can.log").exists():
        sys.exit(f"{args.drive}: expected can.log, decoded.csv and poses.csv (is VCHARGE_DATA set?)")
    return args


def read(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(file))


def decoding_figures(decoded, authors):
    """The authors' file has six decimals. Steering angles are compared by the drive's test, message by message."""
    pairs = [(row[name], other[name]) for row, other in zip(decoded, authors) for name in WHEELS]
    equal = sum(math.isclose(float(ours), float(theirs), rel_tol=0, abs_tol=1e-9) for ours, theirs in pairs)
    yield figure("wheel messages", len(decoded), equal=len(authors))
    yield figure(f"wheel speeds equal to the authors' in all six decimals, of {len(WHEELS) * len(authors)}", equal,
                 equal=len(WHEELS) * len(authors))


def drift_figures(drift):
    yield Figure("position, mean of all sub-paths", drift["mean_m"], "m per 100 m")
    yield Figure("position, worst", drift["worst_m"], "m per 100 m")
    yield Figure("heading, mean", drift["mean_deg"], "deg per 100 m")
    yield Figure("heading, worst", drift["worst_deg"], "deg per 100 m")
    yield Figure("sub-paths", drift["num_sub_paths"])


def calibration_figures(calibration):
    for name, key in (("scale of both wheels", "scale"), ("right over left wheel", "right_over_left"),
                      ("track width (m)", "track_width_m")):
        found = calibration[key]
        held = "" if found["is_observable"] else ": not observable, held by its prior"
        yield Figure(name, f"{found['value']:.5f} +- {found['sigma']:.5f}{held}")


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("odometry", "Wheel odometry", args)
    run = run_tool("decode_can", args.work / "decode.log", "--log", args.drive / "can.log", "--layout", args.layout, "--poses",
                   args.drive / "poses.csv", "--output", args.work / "decoded.csv")
    found = run.found
    results.add("CAN of a real car (Toyota RAV4, four wheel speeds, 60 s, 1 km)",
                ("", list(decoding_figures(read(args.work / "decoded.csv"), read(args.drive / "decoded.csv")))))
    results.add("Calibration of the wheels on its first half, which hardly turns",
                ("", list(calibration_figures(found["calibration"]))))
    results.add("Drift over all 100 m of its second half, against GNSS and vision",
                ("nominal car", list(drift_figures(found["drift"]["nominal"]))),
                ("calibrated on the first half", list(drift_figures(found["drift"]["calibrated"]))))
    results.end()


if __name__ == "__main__":
    main()
