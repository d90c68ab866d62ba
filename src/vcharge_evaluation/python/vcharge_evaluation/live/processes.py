"""Processor time and memory of processes, from /proc."""
import os
import pathlib
import time


def manager_below(pid):
    """Process number of the nodelet manager that roslaunch started; None without one."""
    for path in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            command = (path / "cmdline").read_bytes().split(b"\0")
            parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            continue
        if parent == pid and b"manager" in command and command[0].endswith(b"nodelet"):
            return int(path.name)
    return None


def memory_mb(pid, kind="VmRSS"):
    """Memory of a process, by its name in /proc/PID/status: VmRSS now, VmHWM the most so far. OSError after its end."""
    for line in pathlib.Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith(f"{kind}:"):
            return int(line.split()[1]) / 1024
    raise OSError(f"process {pid} has no memory")


def processor_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Usage:
    """Processor time over a while, and the largest memory, of a process that is sampled."""

    def __init__(self):
        self.first, self.last, self.peak_mb = None, None, 0.0

    def sample(self, pid):
        """Nothing where there is no such process."""
        try:
            now = (time.monotonic(), processor_s(pid))
            self.peak_mb = max(self.peak_mb, memory_mb(pid))
        except OSError:
            return
        self.first, self.last = self.first or now, now

    @property
    def load(self):
        """Processor seconds per second; None before two samples."""
        if self.first is None or self.last[0] == self.first[0]:
            return None
        return (self.last[1] - self.first[1]) / (self.last[0] - self.first[0])
