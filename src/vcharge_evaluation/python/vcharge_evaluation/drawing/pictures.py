"""What the drawings have in common: reading images, writing pictures."""
import os

import cv2

import vcharge


def save(path, picture):
    """Writes a picture; a file of this name is replaced once the new one is complete. SystemExit if that fails."""
    temporary = path.with_name(f".{path.name}.tmp{path.suffix}")
    if not cv2.imwrite(str(temporary), picture):
        raise SystemExit(f"{path}: cannot be written")
    os.replace(temporary, path)
    print(f"written: {path}")


MAX_BYTES, MAX_WIDTH_PX = 60_000, 900


def save_small(path, picture):
    """Writes a JPEG of at most MAX_BYTES: first of lower quality, then smaller."""
    scale = min(1.0, MAX_WIDTH_PX / picture.shape[1])
    while True:
        smaller = picture if scale == 1.0 else cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        for quality in (85, 70, 55):
            done, data = cv2.imencode(".jpg", smaller, [cv2.IMWRITE_JPEG_QUALITY, quality])
            if done and len(data) <= MAX_BYTES:
                path.write_bytes(data.tobytes())
                return
        scale *= 0.8


def read_image(bag_path, camera, stamp_ns):
    """The camera's gray image of this stamp. SystemExit without one."""
    for _, _, image in vcharge.read_images(bag_path, [camera], [stamp_ns]):
        return image
    raise SystemExit(f"{bag_path}: no image of camera '{camera}' at {stamp_ns} ns")


def label(image, text):
    """A copy in colours with a text in its upper left corner."""
    image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    cv2.putText(image, text, (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (0, 0, 0), 4, cv2.LINE_AA)
    cv2.putText(image, text, (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (255, 255, 255), 1, cv2.LINE_AA)
    return image


def add_moment_arguments(parser, default):
    """Adds --stamp-ns and --moment, which `chosen_stamp` reads."""
    parser.add_argument("--stamp-ns", type=int, help="draws what is nearest to this time")
    parser.add_argument("--moment", type=float, default=default, help="without --stamp-ns: fraction of what there is to draw")


def chosen_stamp(arguments, stamps):
    """The stamp to draw, of those (ns, sorted) of which something is there."""
    if arguments.stamp_ns is not None:
        return min(stamps, key=lambda stamp: abs(stamp - arguments.stamp_ns))
    return stamps[int(arguments.moment * (len(stamps) - 1))]
