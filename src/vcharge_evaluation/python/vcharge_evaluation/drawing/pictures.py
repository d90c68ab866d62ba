"""What the drawings have in common: reading images, writing pictures."""
import os

import cv2
import numpy as np
import rosbag


def save(path, picture):
    """Writes a picture; a file of this name is replaced once the new one is complete. SystemExit if that fails."""
    temporary = path.with_name(f".{path.name}.tmp{path.suffix}")
    if not cv2.imwrite(str(temporary), picture):
        raise SystemExit(f"{path}: cannot be written")
    os.replace(temporary, path)
    print(f"written: {path}")


def read_image(bag_path, camera, stamp_ns):
    """The camera's gray image of this stamp. SystemExit without one."""
    topic = f"/camera/{camera}/image_raw"
    with rosbag.Bag(str(bag_path)) as bag:
        for _, message, _ in bag.read_messages(topics=[topic, topic + "/compressed"]):
            if message.header.stamp.to_nsec() == stamp_ns:
                data = np.frombuffer(message.data, np.uint8)
                if hasattr(message, "format"):
                    return cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
                return data.reshape(message.height, message.step)[:, :message.width]
    raise SystemExit(f"{bag_path}: no image of camera '{camera}' at {stamp_ns} ns")
