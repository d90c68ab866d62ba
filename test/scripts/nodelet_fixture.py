"""What the tests of nodelets share: waiting, and the camera model that results are compared with."""
import time

import rosgraph
import rospy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Quaternion, Transform, Vector3
from nav_msgs.msg import Odometry
from nodelet.srv import NodeletList, NodeletLoad, NodeletUnload
from sensor_msgs.msg import Image
from vcharge_msgs.msg import CameraHealth, RigHealth

TIMEOUT_S = 60.0


def wait_for(condition, what, timeout_s=TIMEOUT_S):
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError(f"waited {timeout_s} s in vain for {what}")


def manager_services(manager="/manager"):
    """The manager's services to load, unload and list nodelets; waits for them."""
    services = (("load_nodelet", NodeletLoad), ("unload_nodelet", NodeletUnload), ("list", NodeletList))
    for name, _ in services:
        rospy.wait_for_service(f"{manager}/{name}", TIMEOUT_S)
    return [rospy.ServiceProxy(f"{manager}/{name}", kind) for name, kind in services]


def drive_publishers(cameras):
    """Publishers of a drive's odometry and images, by topic."""
    publishers = {"/odom": rospy.Publisher("/odom", Odometry, queue_size=10000)}
    for camera in cameras:
        topic = f"/camera/{camera}/image_raw"
        publishers[topic] = rospy.Publisher(topic, Image, queue_size=10000)
    return publishers


def replay(messages, publishers):
    """Publishes (topic, message) pairs in their own time."""
    begin, first = time.monotonic(), messages[0][1].header.stamp.to_sec()
    for topic, message in messages:
        time.sleep(max(0.0, begin + message.header.stamp.to_sec() - first - time.monotonic()))
        publishers[topic].publish(message)


class Diagnostics:
    """Collects /diagnostics: the newest status by name, and (level, message) of all."""

    def __init__(self):
        self.status, self.told = {}, []
        self.subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, self._keep, queue_size=100)

    def _keep(self, message):
        for status in message.status:
            self.status[status.name] = status
            self.told.append((status.level, status.message))

    def clear(self):
        self.status.clear()
        self.told.clear()

    def status_of(self, name):
        """The newest status whose name contains this, or None."""
        return next((status for key, status in list(self.status.items()) if name in key), None)

    def values(self, name):
        """Keys and values of this status."""
        status = self.status_of(name)
        return {value.key: value.value for value in status.values} if status else {}

    def heard(self):
        """Topics about which a nodelet reported bad messages; for reach()."""
        return {value.key for status in list(self.status.values()) for value in status.values if ", 0 bad" not in value.value}

    def num_good(self, topic):
        """Number of good messages of a topic that the nodelet reports."""
        told = next((value.value for status in list(self.status.values()) for value in status.values if value.key == topic), "")
        return int(told.split(" good, ")[0]) if " good, " in told else 0

    def tells(self, *words, level=None):
        """Whether a message since the last clear() has all the words, and the level if given."""
        return any((level is None or at == level) and all(word in text for word in words) for at, text in list(self.told))


def connections_to(uri, subscriber):
    """A subscriber's connections to a node. Removes ended ones: rospy keeps a connection that the node refused because the
    nodelet had stopped publishing, and then does not connect to the node's next publisher."""
    connections = [connection for connection in list(subscriber.impl.connections) if connection.endpoint_id == uri]
    for connection in connections:
        if connection.done:
            subscriber.impl.remove_connection(connection)
    return [connection for connection in connections if not connection.done]


def wait_until_gone(manager, subscribers):
    """Call after unloading: returns when no subscriber is connected to the manager. Otherwise rospy would keep the ending
    connection instead of connecting to the next nodelet on the same topics."""
    uri = rosgraph.Master("/" + __name__).lookupNode(manager)
    wait_for(lambda: sum(len(connections_to(uri, subscriber)) for subscriber in subscribers) == 0,
             f"connections to {manager} to end")


def wait_until_connected(manager, subscribers):
    """Call after loading: returns when all subscribers are connected to the manager; announces its topics again if needed."""
    uri = rosgraph.Master("/" + __name__).lookupNode(manager)

    def all_connected():
        time.sleep(0.5)
        missing = [subscriber for subscriber in subscribers if not connections_to(uri, subscriber)]
        for subscriber in missing:
            announce_again(subscriber.name, subscriber.data_class)
        return not missing
    wait_for(all_connected, f"connections to {manager}")


def reach(publishers, heard, subscribers=()):
    """Call after loading: returns when the subscribers are connected to the manager and the nodelet receives all topics.
    Publishes messages without a stamp until the nodelet reports them for every topic, since a connection may belong to an
    unloaded nodelet. `heard()` returns the topics with reports."""
    wait_until_connected("/manager", subscribers)

    def all_heard():
        for topic in set(publishers) - set(heard()):
            publishers[topic].publish(publishers[topic].data_class())
        time.sleep(0.3)
        return set(heard()) >= set(publishers)

    wait_for(all_heard, "the nodelet to hear all topics")


def expect_bad_rig_is_refused(test, nodelet, rig):
    """Asserts that the nodelet does not load with a missing rig file, and that the manager keeps its other nodelets."""
    loaded = test.list().nodelets
    rospy.set_param("/other/rig", str(rig))
    with test.assertRaises(rospy.ServiceException):
        test.load("/other", nodelet, [], [], [], "")
    test.assertEqual(test.list().nodelets, loaded)


def tell_rig_health(rig, moved):
    """Tells the nodelets on /calibration/health that a camera of a rig.yaml moved by a degree."""
    message = RigHealth()
    for name, camera in yaml.safe_load(rig.read_text())["cameras"].items():
        health = CameraHealth(camera=name, state=CameraHealth.MOVED if name == moved else CameraHealth.OK)
        pose = camera["vehicle_from_camera"]
        health.vehicle_from_camera = Transform(Vector3(*pose["translation_m"]), Quaternion(*pose["rotation_xyzw"]))
        health.deviation[5] = 0.0175 if name == moved else 0.0
        message.cameras.append(health)
    publisher = rospy.Publisher("/calibration/health", RigHealth, queue_size=1)
    wait_for(lambda: publisher.get_num_connections() > 0, "a nodelet to hear /calibration/health")
    publisher.publish(message)
    time.sleep(0.5)
    publisher.unregister()


def announce_again(topic, kind):
    """Makes the master send all subscribers the publishers of a topic again. When a nodelet is unloaded and loaded at once,
    rospy may receive the two updates in the wrong order. Uses a node name of its own, so that this script's own
    registration as a publisher stays."""
    master = rosgraph.Master(rospy.get_name() + "_announcer")
    master.registerPublisher(topic, kind._type, rospy.get_node_uri())
    master.unregisterPublisher(topic, rospy.get_node_uri())


def project_mei(rays, p):
    """Pixels (2 x N) of unit rays (3 x N); paper, section Camera Model."""
    z = rays[2] + p["xi"]
    x, y = rays[0] / z, rays[1] / z
    r = x * x + y * y
    radial = 1 + p["k1"] * r + p["k2"] * r * r
    return (p["gamma1"] * (x * radial + 2 * p["p1"] * x * y + p["p2"] * (r + 2 * x * x)) + p["u0"],
            p["gamma2"] * (y * radial + p["p1"] * (r + 2 * y * y) + 2 * p["p2"] * x * y) + p["v0"])
