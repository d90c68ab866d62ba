"""A rig that is calibrated by the nodelet while its drive is replayed as fast as it was recorded."""
import shutil
import threading
import time

from vcharge_evaluation.live.launch import START_S, Launch
from vcharge_evaluation.live.processes import Usage, manager_below

SOON_S = 5.0  # after the end of the drive, when a rig should be there
REST_S = 240.0  # in which the last calibration must end
SETTLED_S = 15.0  # without a calibration that begins


class Follower:
    """What the nodelet tells, and when the drive ended; times are monotonic seconds."""

    def __init__(self):
        import rospy
        from nav_msgs.msg import Odometry
        from vcharge_msgs.msg import CalibrationStatus
        self.lock, self.status, self.done_s, self.busy_s, self.odometry_s = threading.Lock(), None, None, None, None
        rospy.init_node("follow_calibration", anonymous=True, disable_signals=True)
        self.subscribers = [rospy.Subscriber("/calibration/status", CalibrationStatus, self.take_status, queue_size=None),
                            rospy.Subscriber("/odom", Odometry, self.take_odometry, queue_size=None)]

    def take_status(self, message):
        now = time.monotonic()
        with self.lock:
            if message.state == message.CALIBRATING:
                self.busy_s = now
            elif message.state == message.DONE and (self.status is None or self.status.state != message.DONE):
                self.done_s = now
            self.status = message

    def take_odometry(self, _):
        self.odometry_s = time.monotonic()

    def is_settled(self):
        """Whether a result came after the end of the drive, and none is being made. An early one is made silently."""
        with self.lock:
            return self.done_s is not None and self.done_s > self.odometry_s and (
                time.monotonic() - max(self.done_s, self.busy_s or 0.0) > SETTLED_S)


def replay(folder, bag, rig):
    """Replays a drive. Returns the seconds from its end to the last result (None without one), the most memory in MB, the last
    message, and the rig files that were there soon after the end and at last."""
    folder.mkdir(parents=True, exist_ok=True)
    output, soon = folder / "rig.yaml", folder / "rig_soon.yaml"
    for path in (output, soon):
        path.unlink(missing_ok=True)
    usage, is_soon_over = Usage(), False
    words = (f"rig:={rig}", f"output:={output}", f"bag:={bag}", "automatic:=true")
    with Launch(folder, "calibrate_rig.launch", *words) as launched:
        follower, begin_s = Follower(), time.monotonic()
        while launched.runs():
            time.sleep(0.2)
            usage.sample(manager_below(launched.process.pid))
            now, odometry_s = time.monotonic(), follower.odometry_s
            if odometry_s is None:
                if now - begin_s > START_S:
                    break
                continue
            if not is_soon_over and now - odometry_s > SOON_S:
                is_soon_over = True
                if output.exists():
                    shutil.copy(output, soon)
            if follower.is_settled() or now - odometry_s > REST_S:
                break
    after_s = follower.done_s - follower.odometry_s if follower.done_s else None
    message = follower.status.message if follower.status else "the nodelet told nothing"
    return after_s, usage.peak_mb, message, soon if soon.exists() else None, output if output.exists() else None
