"""Steps of a long computation, each in a folder of its own. Those that an earlier run finished with the same input are kept."""
import hashlib
import json
import os
import shutil
import time

from vcharge_evaluation.tools import say


def fingerprint(path):
    """Text that changes with a file or folder: its files with their sizes and times of modification."""
    path = path.resolve()
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return " ".join(f"{file}:{file.stat().st_size}:{file.stat().st_mtime_ns}" for file in files if file.is_file())


class StepFolders:
    """Folders of steps below the folder `work`."""

    def __init__(self, work):
        self.work = work
        # By name of the step: the hash of its input, and what it found (title, figures, times).
        self.keys, self.steps, self.number = {}, {}, 0

    def step(self, name, title, needs, given, work):
        """Calls `work(folder)`, which returns figures, unless an earlier run did with the same `given` (texts) after the same
        steps `needs` (names)."""
        self.number += 1
        folder = self.work / name
        key = hashlib.sha1(repr([[str(word) for word in given], [self.keys[need] for need in needs]]).encode()).hexdigest()
        self.keys[name] = key
        begun, done = folder / "begun", folder / "done.json"
        if done.exists() and json.loads(done.read_text())["key"] == key:
            say(f"{self.number:2d} {title}: kept")
        else:
            say(f"{self.number:2d} {title}")
            if not begun.exists() or begun.read_text() != key:
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir(parents=True)
                begun.write_text(key)
            start, cpu_s = time.monotonic(), sum(os.times()[2:4])
            found = work(folder)
            temporary = folder / "done.json.tmp"
            temporary.write_text(json.dumps({"key": key, "title": title, "figures": found,
                                             "wall_s": time.monotonic() - start,
                                             "cpu_s": sum(os.times()[2:4]) - cpu_s}, indent=1))
            temporary.rename(done)
        self.steps[name] = json.loads(done.read_text())
        return folder
