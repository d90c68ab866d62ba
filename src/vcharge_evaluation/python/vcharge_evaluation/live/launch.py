"""Launch files of vcharge_launch under a ROS master of their own."""
import os
import signal
import socket
import subprocess
import time

START_S = 60.0


class Launch:
    """A running launch file of vcharge_launch, as a context; this process uses its ROS master. `prefix` is put before roslaunch,
    `environment` added to its own."""

    def __init__(self, folder, name, *words, prefix=(), environment=None):
        port = free_port()
        uri = f"http://localhost:{port}"
        os.environ.update({"ROS_MASTER_URI": uri, "ROS_HOSTNAME": "localhost", "ROS_HOME": str(folder / "ros_home")})
        with open(folder / "roslaunch.log", "w", encoding="utf-8") as log:
            self.process = subprocess.Popen([*prefix, "roslaunch", "-p", str(port), "vcharge_launch", name, *map(str, words)],
                                            stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
                                            env={**os.environ, **(environment or {})})

    def __enter__(self):
        import rosgraph
        deadline = time.monotonic() + START_S
        while not rosgraph.is_master_online(os.environ["ROS_MASTER_URI"]):
            if time.monotonic() > deadline or not self.runs():
                self.stop()
                raise RuntimeError("roslaunch did not start a master: see roslaunch.log")
            time.sleep(0.2)
        return self

    def __exit__(self, *_):
        self.stop()

    def runs(self):
        return self.process.poll() is None

    def stop(self):
        if not self.runs():
            return
        os.killpg(self.process.pid, signal.SIGINT)
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)


def free_port():
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]
