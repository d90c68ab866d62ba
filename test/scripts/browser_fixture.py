"""A headless Chromium that a test steers through the pipe of its DevTools protocol."""
import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

CHROMIUM = shutil.which("chromium")
START_S = 60


class Browser:
    """Shows one page from a file; `problems` are errors and warnings of the page, `requests` the addresses that it asked for."""

    def __init__(self, width=1280, height=720):
        self.folder = tempfile.mkdtemp(prefix="vcharge_tests_")
        self.problems, self.requests, self.number, self.rest = [], [], 0, b""
        commands, self.answers = os.pipe(), os.pipe()
        self.write_end, self.read_end = commands[1], self.answers[0]

        def connect():  # the browser reads from 3 and writes to 4
            os.dup2(commands[0], 13)
            os.dup2(self.answers[1], 14)
            os.dup2(13, 3)
            os.dup2(14, 4)
        self.process = subprocess.Popen(  # pylint: disable=consider-using-with,subprocess-popen-preexec-fn
            [CHROMIUM, "--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--no-first-run",
             "--disable-background-networking",
             "--disable-component-update", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--disable-dev-shm-usage", f"--user-data-dir={self.folder}", f"--window-size={width},{height}", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=connect, close_fds=False)
        os.close(commands[0])
        os.close(self.answers[1])
        target = next(one for one in self.call("Target.getTargets", timeout_s=START_S)["targetInfos"] if one["type"] == "page")
        self.session = self.call("Target.attachToTarget", {"targetId": target["targetId"], "flatten": True})["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable", session=self.session)
        self.call("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
                  self.session)

    def close(self):
        self.process.terminate()
        self.process.wait()
        os.close(self.write_end)
        os.close(self.read_end)
        shutil.rmtree(self.folder, ignore_errors=True)

    def call(self, method, parameters=None, session=None, timeout_s=120):
        """Sends a command and returns its result; events that come before are kept."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters or {}}
        if session:
            message["sessionId"] = session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        end_s = time.monotonic() + timeout_s
        while True:
            answer = self.receive(end_s)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.take(answer)

    def receive(self, end_s):
        parts = [self.rest]
        while b"\0" not in parts[-1]:
            if not select.select([self.read_end], [], [], max(0.0, end_s - time.monotonic()))[0]:
                raise RuntimeError("the browser does not answer")
            part = os.read(self.read_end, 1 << 20)
            if not part:
                raise RuntimeError("the browser has ended")
            parts.append(part)
        message, _, self.rest = b"".join(parts).partition(b"\0")
        return json.loads(message)

    def take(self, event):
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.problems.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.problems.append(" ".join(str(one.get("value", one.get("description"))) for one in parameters["args"]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.problems.append(parameters["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])

    def show(self, path, timeout_s=60):
        """Opens a file and waits until its first picture is drawn; returns the time that this took by the page's own clock (ms)."""
        self.problems, self.requests = [], []
        self.call("Page.navigate", {"url": f"file://{path}"}, self.session)
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s:
            ready = self.run("document.documentElement?.dataset.readyMs || ''")
            if ready:
                return int(ready)
            time.sleep(0.05)
        raise RuntimeError(f"{path}: no picture after {timeout_s} s: {self.problems}")

    def run(self, script, timeout_s=120):
        """The value of a script; a promise is awaited."""
        result = self.call("Runtime.evaluate", {"expression": script, "returnByValue": True, "awaitPromise": True}, self.session,
                           timeout_s)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", "the script failed"))
        return result["result"].get("value")

    def key(self, key, code=None):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", {"type": kind, "key": key, "code": code or key}, self.session)

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, **more}, self.session)

    def touch(self, kind, points):
        self.call("Input.dispatchTouchEvent", {"type": kind,
                                               "touchPoints": [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]},
                  self.session)

    def picture(self, path):
        """Writes a PNG of what the page shows."""
        data = self.call("Page.captureScreenshot", {"format": "png"}, self.session)["data"]
        path.write_bytes(base64.b64decode(data))
