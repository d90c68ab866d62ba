"""Replays a drive over and over through vcharge.launch and watches the memory of the nodelets' manager. Prints it once a
minute, and its growth over the second half; exit status 1 where it grows by more than 20 MB an hour or the manager dies."""
import argparse
import pathlib
import sys
import tempfile
import time

import numpy as np

from vcharge_evaluation.live.launch import START_S, Launch
from vcharge_evaluation.live.processes import manager_below, memory_mb

MAX_GROWTH_MB_PER_HOUR = 20.0
SAMPLE_S = 5.0


def watch(launched, minutes):
    """Times (s) and memory (MB). SystemExit where the manager dies."""
    deadline = time.monotonic() + START_S
    manager = None
    while manager is None and time.monotonic() < deadline:
        time.sleep(1.0)
        manager = manager_below(launched.pid)
    if manager is None:
        raise SystemExit("soak: roslaunch did not start a manager")
    start, samples = time.monotonic(), []
    while time.monotonic() - start < 60.0 * minutes:
        time.sleep(SAMPLE_S)
        try:
            samples.append((time.monotonic() - start, memory_mb(manager)))
        except OSError as error:
            raise SystemExit(f"soak: the manager died after {time.monotonic() - start:.0f} s") from error
        if int(samples[-1][0] // 60) != int((samples[-1][0] - SAMPLE_S) // 60):
            print(f"{samples[-1][0] / 60:5.1f} min  {samples[-1][1]:7.1f} MB", flush=True)
    return np.array(samples)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bag", type=pathlib.Path)
    parser.add_argument("rig", type=pathlib.Path)
    parser.add_argument("map", type=pathlib.Path)
    parser.add_argument("minutes", type=float, nargs="?", default=60.0)
    parser.add_argument("rate", type=float, nargs="?", default=1.0, help="speed of the replay")
    return parser.parse_args()


def main():
    args = arguments()
    with tempfile.TemporaryDirectory() as folder:
        with Launch(pathlib.Path(folder), "vcharge.launch", f"bag:={args.bag.resolve()}", f"rig:={args.rig.resolve()}",
                    f"map:={args.map.resolve()}", f"rate:={args.rate}", "loop:=true") as launched:
            samples = watch(launched.process, args.minutes)
    late = samples[samples[:, 0] >= samples[-1, 0] / 2]
    growth = np.polyfit(late[:, 0], late[:, 1], 1)[0] * 3600
    print(f"memory {late[:, 1].mean():.0f} MB, growth over the second half {growth:+.1f} MB an hour")
    sys.exit(0 if growth <= MAX_GROWTH_MB_PER_HOUR else 1)


if __name__ == "__main__":
    main()
