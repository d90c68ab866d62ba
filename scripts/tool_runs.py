"""How the evaluation scripts run the suite's tools."""
import os
import pathlib
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
TOOLS = ROOT / "build" / "devel" / "lib"


def mark(reached):
    return "yes" if reached else "**no**"


def run(words, log, may_fail=False):
    """Runs a tool; returns its output, wall time, processor time and peak memory. Its progress goes into the log."""
    words = [str(word) for word in words]
    log.parent.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    with open(log, "w", encoding="utf-8") as errors:
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=errors, text=True)
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
    if status != 0 and not may_fail:
        raise RuntimeError(f"{' '.join(words)} failed ({status}): see {log}")
    return {"output": output, "wall_s": time.monotonic() - start, "cpu_s": usage.ru_utime + usage.ru_stime,
            "peak_gb": usage.ru_maxrss * 1024 / 1e9}


def say(text):
    print(time.strftime("%H:%M:%S"), text, file=sys.stderr, flush=True)


def simulate(folder, words):
    """A drive in a folder of its own; one that is complete and made with the same words is taken as it is."""
    words = [str(word) for word in words]
    done = folder / "simulated.txt"
    if done.exists() and done.read_text() == " ".join(words):
        say(f"{folder}: drive taken as it is")
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    say(f"{folder}: simulating")
    run([TOOLS / "vcharge_simulation" / "simulate_drive", *words, "--output", folder / "drive.bag"],
        folder / "simulate.log")
    done.write_text(" ".join(words))
