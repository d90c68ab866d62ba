"""Runs one evaluation: python3 -m vcharge_evaluation STAGE [arguments]."""
import importlib
import sys

STAGES = {
    "masks": "masks",
    "calibration": "calibration",
    "monitor": "monitor",
    "mapping": "mapping",
    "pose_graphs": "pose_graphs",
    "localization": "localization",
    "living_map": "living_map",
    "shutters": "shutters",
    "ranges": "ranges",
    "height_map": "height_map",
    "bays": "bays",
    "surround_view": "surround_view",
    "obstacles": "obstacles",
    "objects": "objects",
    "standing": "standing",
    "steps": "steps",
    "conditions": "conditions",
    "faults": "faults",
    "odometry": "odometry",
    "images": "images",
    "chain": "chain.cars",
    "online": "live.online",
    "soak": "live.soak",
}


def main():
    if len(sys.argv) < 2 or sys.argv[1] not in STAGES:
        asked_for_help = sys.argv[1:] in (["-h"], ["--help"])
        print(f"evaluate.sh STAGE [arguments; --help]: STAGE is one of {', '.join(STAGES)}",
              file=sys.stdout if asked_for_help else sys.stderr)
        return 0 if asked_for_help else 2
    stage = sys.argv.pop(1)
    sys.argv[0] = f"evaluate.sh {stage}"
    return importlib.import_module(f"vcharge_evaluation.{STAGES[stage]}").main()


if __name__ == "__main__":
    sys.exit(main())
