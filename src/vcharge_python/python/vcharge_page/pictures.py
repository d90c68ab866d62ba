"""Small pictures of a drive at the keyframes of a map."""
import sys

import cv2
import numpy as np

from vcharge import InputError, Rig, SparseMap, read_images

MAX_BYTES = 24_000_000  # of all pictures
JPEG_QUALITY = 60


class NearStamps:
    """The stamps within a tolerance of wanted ones."""

    def __init__(self, wanted_ns, tolerance_ns):
        self.wanted, self.tolerance_ns = np.unique(wanted_ns), tolerance_ns

    def nearest(self, stamp_ns):
        """The wanted stamp that a stamp belongs to, or None."""
        at = np.searchsorted(self.wanted, stamp_ns)
        near = [int(one) for one in self.wanted[max(0, at - 1):at + 1] if abs(int(one) - stamp_ns) <= self.tolerance_ns]
        return min(near, key=lambda one: abs(one - stamp_ns)) if near else None

    def __contains__(self, stamp_ns):
        return self.nearest(stamp_ns) is not None


def pictures_of(sparse_map: SparseMap, rig: Rig, bag, width_px):
    """JPEG files of the keyframes, by stamp (ns) and camera; of every second, third, ... keyframe if all would be too large.
    InputError if the bag has no image of a keyframe."""
    stamps = NearStamps(sparse_map.keyframes.stamps_ns, round(rig.stamp_tolerance_s * 1e9))
    found, told = {}, 0
    for stamp, camera, image in read_images(bag, list(rig.cameras), stamps):
        scale = min(1.0, width_px / image.shape[1])
        small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        found.setdefault(stamps.nearest(stamp), {})[camera] = jpeg.tobytes()
        if len(found) > told:
            told = len(found)
            print(f"\rimages of {told} keyframes", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    if not found:
        raise InputError(f"{bag}: expected images of the cameras {', '.join(rig.cameras)} at stamps of the map's keyframes: "
                         "is it the drive that was mapped?")
    step = -(-sum(len(jpeg) for images in found.values() for jpeg in images.values()) // MAX_BYTES)
    return {stamp: found[stamp] for stamp in sorted(found)[::step]}
