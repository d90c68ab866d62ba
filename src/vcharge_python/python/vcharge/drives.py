"""Images of a drive."""
from collections.abc import Collection, Iterator

import cv2
import numpy as np

from vcharge.errors import InputError

TO_GRAY = {"bgr8": cv2.COLOR_BGR2GRAY, "rgb8": cv2.COLOR_RGB2GRAY}


def read_images(bag, cameras: Collection[str], stamps_ns: Collection[int] | None = None) -> Iterator[tuple[int, str, np.ndarray]]:
    """Stamp (ns), camera and gray image (uint8, height x width) of each image of these cameras in a bag, in its order, from
    /camera/<name>/image_raw or its compressed topic; with `stamps_ns` of these stamps only. InputError naming the bag and the
    topic. Needs the Python package rosbag."""
    import rosbag  # pylint: disable=import-outside-toplevel  # what reads files alone works without ROS

    names = {f"/camera/{camera}/image_raw{ending}": camera for camera in cameras for ending in ("", "/compressed")}
    try:
        with rosbag.Bag(str(bag)) as file:
            for topic, message, _ in file.read_messages(topics=list(names)):
                stamp = message.header.stamp.to_nsec()
                if stamps_ns is None or stamp in stamps_ns:
                    yield stamp, names[topic], _gray_of(message, f"{bag}: {topic}")
    except FileNotFoundError as error:
        raise InputError(f"{bag}: no such file") from error
    except (rosbag.ROSBagException, OSError) as error:
        raise InputError(f"{bag}: cannot be read as a bag: {error}") from error


def _gray_of(message, source):
    data = np.frombuffer(message.data, np.uint8)
    if hasattr(message, "format"):
        image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if data.size else None
        if image is None:
            raise InputError(f"{source}: expected a compressed image")
        return image
    channels = 3 if message.encoding in TO_GRAY else 1
    if message.encoding not in ("mono8", "8UC1", *TO_GRAY):
        raise InputError(f"{source}: encoding: expected mono8, bgr8 or rgb8, got '{message.encoding}'")
    if message.step < channels * message.width or data.size < message.height * message.step:
        raise InputError(f"{source}: expected {message.width} x {message.height} px, got {data.size} bytes")
    rows = data[:message.height * message.step].reshape(message.height, message.step)[:, :channels * message.width]
    return rows if channels == 1 else cv2.cvtColor(rows.reshape(message.height, message.width, 3), TO_GRAY[message.encoding])
