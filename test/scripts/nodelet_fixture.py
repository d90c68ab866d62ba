"""What the tests of nodelets share: waiting, and the camera model that results are compared with."""
import time

import rosgraph

TIMEOUT_S = 60.0


def wait_for(condition, what, timeout_s=TIMEOUT_S):
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError(f"waited {timeout_s} s in vain for {what}")


def wait_until_gone(manager, subscribers):
    """After unloading: returns once none of the subscribers is connected to the manager. A nodelet that advertises the same
    topics before that would not be heard: rospy takes the dying connection for the new one."""
    uri = rosgraph.Master("/" + __name__).lookupNode(manager)
    wait_for(lambda: all(connection.endpoint_id != uri
                         for subscriber in subscribers for connection in list(subscriber.impl.connections)),
             f"connections to {manager} to end")


def project_mei(rays, p):
    """Pixels (2 x N) of unit rays (3 x N); paper, section Camera Model."""
    z = rays[2] + p["xi"]
    x, y = rays[0] / z, rays[1] / z
    r = x * x + y * y
    radial = 1 + p["k1"] * r + p["k2"] * r * r
    return (p["gamma1"] * (x * radial + 2 * p["p1"] * x * y + p["p2"] * (r + 2 * x * x)) + p["u0"],
            p["gamma2"] * (y * radial + p["p1"] * (r + 2 * y * y) + 2 * p["p2"] * x * y) + p["v0"])
