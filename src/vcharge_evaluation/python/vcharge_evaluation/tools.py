"""Runs the suite's tools and reads what they write with --json."""
import contextlib
import dataclasses
import fcntl
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import yaml

from vcharge_evaluation.live.processes import memory_mb

ROOT = pathlib.Path(__file__).resolve().parents[4]
TOOLS = ROOT / "build" / "devel" / "lib"
CONFIG = ROOT / "config"
SCENES_WITH_PLANS = ("lot", "garage")  # whose plan a seed draws


class NoResult(RuntimeError):
    """A tool's error where it found no result, as on a drive that stands."""


@dataclasses.dataclass
class Run:
    """What a program needed, and what it found: the content of its --json file, if it has one."""
    wall_s: float
    cpu_s: float
    peak_gb: float
    found: dict = dataclasses.field(default_factory=dict)

    def error(self):
        """The error's text, or None after success."""
        return self.found.get("error")

    def reason(self):
        """The error's text without the paths of files, for results."""
        return re.sub(r"\S*/\S+: ", "", self.error() or "")


def say(text):
    print(time.strftime("%H:%M:%S"), text, file=sys.stderr, flush=True)


def run(words, log, may_fail=False):
    """Runs a program; its output goes into the log. RuntimeError if it fails, unless it may."""
    words = [str(word) for word in words]
    log.parent.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    with open(log, "w", encoding="utf-8") as output:
        with subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT) as process:
            ended, peak_mb = 0, 0.0
            while not ended:
                with contextlib.suppress(OSError):  # ru_maxrss would count what this process had when it started the program
                    peak_mb = max(peak_mb, memory_mb(process.pid, "VmHWM"))
                ended, status, usage = os.wait4(process.pid, os.WNOHANG)
                time.sleep(0 if ended else 0.02)
            process.returncode = os.waitstatus_to_exitcode(status)
    if status != 0 and not may_fail:
        raise RuntimeError(f"{' '.join(words)} failed ({status}): see {log}")
    return Run(time.monotonic() - start, usage.ru_utime + usage.ru_stime, peak_mb * 1024 ** 2 / 1e9)


def tool_path(name):
    """The built tool of this name, whatever its package."""
    found = sorted(TOOLS.glob(f"*/{name}"))
    if not found:
        raise RuntimeError(f"{TOOLS}: there is no tool {name}; scripts/build.sh makes it")
    return found[0]


def run_tool(name, log, *words, prefix=(), may_fail=False):
    """Runs a tool that has --json, which goes beside the log, and reads what it found."""
    report = log.with_suffix(".json")
    report.unlink(missing_ok=True)
    result = run([*prefix, tool_path(name), *words, "--json", report], log, may_fail)
    if report.exists():
        result.found = json.loads(report.read_text())
    else:
        result.found = {"error": f"{name} wrote no {report.name}: see {log}"}
    return result


def state_of(name, words):
    """Text that changes with a tool, the libraries, its words and the option files among them."""
    options = [pathlib.Path(str(word)) for word in words if str(word).endswith(".yaml") and pathlib.Path(str(word)).exists()]
    programs = [tool_path(name), *(path for path in TOOLS.glob("*.so") if "evaluation" not in path.name)]
    newest = max((path.stat().st_mtime_ns for path in programs), default=0)
    texts = [*(str(word) for word in words), *(path.read_text() for path in options), str(newest)]
    return hashlib.sha1("\n".join(texts).encode()).hexdigest()


def run_tool_once(name, log, *words, may_fail=False):
    """run_tool, unless an earlier call with the same log, words, options and programs finished: stages share its output."""
    kept, state = log.with_suffix(".kept.json"), state_of(name, words)
    if kept.exists():
        entry = json.loads(kept.read_text())
        if entry["state"] == state:
            return Run(**entry["run"])
    kept.unlink(missing_ok=True)
    result = run_tool(name, log, *words, may_fail=may_fail)
    kept.write_text(json.dumps({"state": state, "run": dataclasses.asdict(result)}))
    return result


def judge(name, report, *words):
    """Runs an evaluate_* tool; returns the errors that it writes into its report folder."""
    run([tool_path(f"evaluate_{name}"), *words, "--report", report], report / "evaluate.log")
    return json.loads((report / f"{name.rstrip('s')}_errors.json").read_text())


def judge_rig(estimate, truth, report):
    """Errors of a rig file; `report` is the JSON file to write."""
    run([tool_path("evaluate_rig"), "--estimate", estimate, "--truth", truth, "--json", report],
        report.with_suffix(".log"))
    return json.loads(report.read_text())


def drawn(words):
    """Words that draw the plan and the surfaces of a drive's scene, both with the seed of the scene."""
    words = [str(word) for word in words]
    given = dict(zip(words, words[1:]))
    scenario = yaml.safe_load(pathlib.Path(given["--scenario"]).read_text()) if "--scenario" in given else {}
    scene, seed = given.get("--scene", scenario.get("scene", "lot")), given.get("--scene-seed", "1")
    keys = ("layout_seed", "surface_seed") if scene in SCENES_WITH_PLANS else ("surface_seed",)
    return [word for key in keys for word in ("--set", f"{key}={seed}")]


def simulate(folder, words):
    """Simulates FOLDER/drive.bag in a scene with drawn plan and surfaces. A complete drive that was made with the same words is
    kept."""
    words = [str(word) for word in [*drawn(words), *words]]
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another evaluation in the same folder may be making this drive
        done = folder / "simulated.txt"
        if done.exists() and done.read_text() == " ".join(words):
            say(f"{folder}: drive kept")
            return
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        say(f"{folder}: simulating")
        run_tool("simulate_drive", folder / "simulate.log", *words, "--output", folder / "drive.bag")
        done.write_text(" ".join(words))


def build_map(folder, name, *words, rig=None, options=CONFIG / "mapping.yaml", prefix=()):
    """FOLDER/NAME.vmap and NAME.tum of FOLDER/drive.bag."""
    say(f"{folder}: building the map {name}")
    return run_tool("build_map", folder / f"{name}.log", "--bag", folder / "drive.bag", "--rig",
                    rig or folder / "rig_truth.yaml", "--output", folder / f"{name}.vmap", "--trajectory",
                    folder / f"{name}.tum", "--options", options, *words, prefix=prefix)


def import_published_images(folder):
    """FOLDER/drive.bag and rig.yaml of the published V-Charge images; False where VCHARGE_DATA does not have them."""
    source = pathlib.Path(os.environ.get("VCHARGE_DATA", "")) / "vcharge_left"
    if not os.environ.get("VCHARGE_DATA") or not source.is_dir():
        say("VCHARGE_DATA names no folder with vcharge_left: the published images are left out")
        return False
    run_tool("import_vcharge_images", folder / "import.log", "--folder", source, "--output", folder / "drive.bag",
             "--rig", folder / "rig.yaml")
    return True
