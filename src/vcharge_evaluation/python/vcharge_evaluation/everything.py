"""Runs every evaluation on the test scenes and publishes the figures in doc/results and doc/results.md. A step that is done
is not run again while the code is the same, so that an interrupted run goes on where it ended."""
import argparse
import dataclasses
import json
import pathlib
import resource
import subprocess
import sys
import time

from vcharge_evaluation import page
from vcharge_evaluation.conditions import DRIVING_QUICK, all_scenarios
from vcharge_evaluation.drives import CONDITIONS
from vcharge_evaluation.results import RESULTS, commit, drop_others
from vcharge_evaluation.tools import ROOT, say

# Options are chosen on scenes and rigs with seeds below 100 alone, and are fixed before a test scene is rendered.
LOTS, GARAGES, COURSES, RIGS = (201, 202, 203), (211, 212, 213), (221, 222, 223), (231, 232, 233, 234)
NUM_RIGS = 20  # that are calibrated, each from a drive in a place of its own


@dataclasses.dataclass
class Step:
    stage: str  # as in evaluate.sh
    full: list
    quick: list = None  # None: left out of the quick run

    def words(self, quick):
        return [str(word) for word in (self.quick if quick else self.full)]


QUICK_SCALE, QUICK_S = 0.4, 6  # of the drives that the stages of a quick run share
CONDITIONS_SCALE, CONDITIONS_S = 0.3, 5  # of its drives in other conditions


def steps():
    """All steps, the cheap ones first. Stages use the same drives where they can, and the masks that make_masks found in them."""
    loops = [f"lot:{LOTS[0]}", f"garage:{GARAGES[0]}"]
    yield Step("masks", ["--loops", *loops], ["--drives", "--loops", *loops])
    other_day = ["--parts", "other_day", "--drives"]
    yield Step("ranges", [*other_day, *loops, "--duration-s", 8, "--image-scale", 0.5],
               [*other_day, *loops, "--duration-s", QUICK_S, "--image-scale", QUICK_SCALE])
    yield Step("ranges", ["--parts", "settings", "--drives", *(f"lot:{seed}" for seed in LOTS),
                          *(f"garage:{seed}" for seed in GARAGES)])
    for lot, garage, course in zip(LOTS, GARAGES, COURSES):
        first = lot == LOTS[0]
        for drive, seed in (("lot", lot), ("garage", garage), ("course", course)):
            quick = ["--seed", seed, "--small"]
            quick += ["--drives", "course", "--duration-s", 10] if drive == "course" else [
                "--drives", f"{drive}_other_day", "--duration-s", QUICK_S]
            yield Step("obstacles", ["--seed", seed, "--drives", drive], quick if first else None)
        for scene, seed in (("lot", lot), ("garage", garage)):
            words = ["--seed", seed, "--scenes", scene]
            yield Step("height_map", words, [*words, "--image-scale", QUICK_SCALE] if first else None)
            yield Step("localization", [*words, "--image-scale", 0.5],
                       [*words, "--image-scale", QUICK_SCALE, "--loops", "--duration-s", QUICK_S, "--no-opposite",
                        "--no-experiments"] if first else None)
            yield Step("localization", [*words, "--image-scale", 0.25, "--consistency", 20],
                       [*words, "--image-scale", QUICK_SCALE, "--consistency", 5] if first else None)
    yield Step("bays", ["--drives", *(f"lot:{seed}" for seed in LOTS), *(f"garage:{seed}" for seed in GARAGES), "--conditions",
                        *CONDITIONS])
    yield Step("surround_view", ["--drives", *(f"lot:short:{seed}" for seed in LOTS), *(f"garage:short:{seed}" for seed in GARAGES),
                                 f"obstacles:creep:{LOTS[0]}"])
    yield Step("standing", ["--seeds", LOTS[0]])
    yield Step("steps", ["--seeds", *LOTS])
    # The quick run's drives are those of its conditions.
    moving = ["movers_crossing", "movers_lot", "standing_lot"]
    yield Step("objects", ["--seeds", *LOTS, "--drives", *moving, "standing_approached", "stop_and_go_lot", "bay_backwards_lot"],
               ["--seeds", LOTS[0], "--drives", *moving, "--image-scale", CONDITIONS_SCALE, "--duration-s", CONDITIONS_S])
    yield Step("objects", ["--seeds", *GARAGES, "--drives", "movers_garage"])
    yield Step("objects", ["--seeds", LOTS[0], "--drives", "movers_lot", "--conditions", "dusk", "wet"])
    conditions = ["--seed", LOTS[0]]
    yield Step("conditions", conditions, [*conditions, "--image-scale", CONDITIONS_SCALE, "--duration-s", CONDITIONS_S,
                                          "--scenarios", *all_scenarios(DRIVING_QUICK)])
    faults = ["--seed", LOTS[0]]
    yield Step("faults", faults, [*faults, "--image-scale", 0.3])
    yield Step("mapping", ["--seeds", *LOTS, "--image-scale", 0.5])
    seeds = [(scene, first + i) for i in range(NUM_RIGS // 2) for scene, first in (("lot", LOTS[0]), ("garage", GARAGES[0]))]
    yield Step("calibration", ["--parts", "rigs", "--image-scale", 0.5, "--rigs", *(
        f"{scene}:{seed}:{RIGS[0] + seed - LOTS[0]}" for scene, seed in seeds)])
    cars = [*(f"lot:{seed}:{rig}" for seed, rig in zip(LOTS, RIGS)),
            *(f"garage:{seed}:{rig}" for seed, rig in zip(GARAGES, RIGS))]
    yield Step("chain", ["--cars", *cars], ["--cars", cars[0], "--no-truth"])


class Journal:
    """Which steps are done, in WORK/done.json."""

    def __init__(self, path):
        self.path = path
        self.done = json.loads(path.read_text()) if path.exists() else {}

    def has(self, stage, words):
        entry = self.done.get(" ".join([stage, *words]))
        return entry is not None and entry["commit"] == commit() and "dirty" not in entry["commit"]

    def add(self, stage, words, wall_s, cpu_s):
        self.done[" ".join([stage, *words])] = {"commit": commit(), "wall_s": round(wall_s), "cpu_s": round(cpu_s)}
        self.path.write_text(json.dumps(self.done, indent=1) + "\n")


def run_step(args, step, journal):
    """Whether the step succeeded, now or before."""
    words = step.words(args.quick)
    if journal.has(step.stage, words):
        say(f"{step.stage} {' '.join(words)}: done before")
        return True
    say(f"{step.stage} {' '.join(words)}")
    start, cpu_s = time.monotonic(), processor_s()
    status = subprocess.run([sys.executable, "-m", "vcharge_evaluation", step.stage, *words, "--work",
                             str(args.work), *([] if args.no_publish else ["--publish"])], check=False).returncode
    if status == 0:
        journal.add(step.stage, words, time.monotonic() - start, processor_s() - cpu_s)
    return status == 0


def processor_s():
    """Processor time of all programs that ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small images and short drives: 40 minutes on two cores")
    parser.add_argument("--stages", nargs="*", help="these stages only")
    parser.add_argument("--drop-old", action="store_true", help="remove what other commits measured from the stages that ran")
    parser.add_argument("--no-publish", action="store_true", help="leave doc/results as it is")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "build" / "evaluation", help="folder for drives and results")
    args = parser.parse_args()
    args.work = args.work.resolve() / ("quick" if args.quick else "full")
    args.work.mkdir(parents=True, exist_ok=True)
    journal = Journal(args.work / "done.json")
    chosen = [step for step in steps() if (step.quick is not None or not args.quick) and
              (not args.stages or step.stage in args.stages)]
    failed = [step for step in chosen if not run_step(args, step, journal)]
    if args.drop_old and not args.no_publish and not failed:
        for stage in {step.stage for step in chosen}:
            drop_others(RESULTS / f"{stage}.json", commit())
    if not args.no_publish:
        page.main([])
    for step in failed:
        print(f"failed: {step.stage} {' '.join(step.words(args.quick))}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
