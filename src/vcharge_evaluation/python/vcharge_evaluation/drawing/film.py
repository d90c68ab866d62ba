"""Makes a film of a drive that detect_obstacles has processed: from above, the map (green free, red occupied, dark unknown), what
moves (yellow, with its number and the way of its next second) and, if the truth is given, true outlines; beside it, the images. Writes
film.webm, index.html that shows it, and poster.jpg."""
import argparse
import csv
import html
import os
import pathlib

import cv2
import numpy as np

import vcharge
from vcharge_evaluation.drawing.objects import (MAGENTA, SIZE_PX, YELLOW, Reports, draw_from_above, draw_moment,
                                                pixels_from_above, read_truth, rotation)
from vcharge_evaluation.drawing.obstacles import Truth
from vcharge_evaluation.drawing.pictures import label, save
from vcharge.obstacle_map import FREE, OCCUPIED, UNOBSERVED

COLOURS = {FREE: (0, 110, 0), OCCUPIED: (0, 0, 200), UNOBSERVED: (40, 40, 40)}
# At an image's stamp, a map of at most this age is shown.
MAX_MAP_AGE_NS = 500_000_000
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: sans-serif; margin: 2em; max-width: 1700px }} video {{ width: 100% }}</style></head>
<body><h1>{title}</h1>
<video controls loop muted poster="poster.jpg" src="film.webm"></video>
<p>From above, the car in the middle and its x axis upwards: green is known to be free, red occupied, dark unknown. Yellow: what moves, with
its number and the way of its next second. {truth}The line below tells how far the arc of the present steering is known to be free.</p>
</body></html>
"""


class Maps:
    """The obstacle maps of a folder, drawn from above."""

    def __init__(self, folder):
        self.folder = folder
        self.stamps = vcharge.list_obstacle_maps(folder)

    def draw(self, stamp, pose):
        """The newest map of a stamp around the vehicle's pose (x, y, yaw) in the map's frame; None without one."""
        earlier = [known for known in self.stamps if 0 <= stamp - known <= MAX_MAP_AGE_NS]
        if not earlier:
            return None
        grid = vcharge.read_occupancy_grid(self.folder / f"{earlier[-1]}.yaml")
        picture = np.zeros((*grid.state.shape, 3), np.uint8)
        for state, colour in COLOURS.items():
            picture[grid.state[::-1] == state] = colour
        # Where three points of the vehicle's frame are in the map and in the view.
        points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        cells = (points @ rotation(pose[2]).T + pose[:2] - grid.origin_m) / grid.cell_size_m
        cells[:, 1] = len(grid.state) - cells[:, 1]
        view_from_map = cv2.getAffineTransform((cells - 0.5).astype(np.float32), pixels_from_above(points).astype(np.float32))
        return cv2.warpAffine(picture, view_from_map, (SIZE_PX, SIZE_PX), flags=cv2.INTER_NEAREST, borderValue=COLOURS[UNOBSERVED])


def read_corridor(folder):
    """Text of each stamp."""
    texts = {}
    with open(folder / "corridor.csv", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            text = f"{row['direction']} free {float(row['known_free_m']):.1f} m"
            if row["crossing_id"]:
                text += f", {row['crossing_id']} crosses in {float(row['crossing_time_s']):.1f} s"
            texts.setdefault(int(row["stamp_ns"]), []).append(text)
    return {stamp: "; ".join(words) for stamp, words in texts.items()}


def moments(bag, cameras):
    """Stamp and images by camera of each moment of which all images are there."""
    waiting = {}
    for stamp, camera, image in vcharge.read_images(bag, cameras):
        images = waiting.setdefault(stamp, {})
        images[camera] = image
        if len(images) == len(cameras):
            yield stamp, {name: images[name] for name in cameras}
            waiting = {later: found for later, found in waiting.items() if later > stamp}


def pictures(arguments):
    """Stamp and picture of each moment."""
    cameras = vcharge.read_rig(arguments.rig).cameras
    reports, maps, corridor = Reports(arguments.obstacles), Maps(arguments.obstacles), read_corridor(arguments.obstacles)
    words = ""
    for stamp, images in moments(arguments.bag, cameras):
        if stamp not in reports.poses:
            continue
        groups, standing = [(YELLOW, reports.at(stamp))], []
        if arguments.truth:
            truth = Truth(arguments.truth, stamp)
            groups.insert(0, (MAGENTA, read_truth(truth)))
            standing = [truth.footprint(obstacle) for obstacle in truth.standing]
        words = corridor.get(stamp, words)
        above = draw_from_above(standing, groups, maps.draw(stamp, reports.poses[stamp]))
        yield stamp, draw_moment(label(above, words), images, cameras, groups)


def write_film(arguments):
    """Writes all files; SystemExit if there is nothing to show."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    temporary, film, poster, count = arguments.output / ".film.tmp.webm", None, None, 0
    for _, picture in pictures(arguments):
        size = (picture.shape[1], picture.shape[0])
        film = film or cv2.VideoWriter(str(temporary), cv2.VideoWriter_fourcc(*"VP80"), arguments.rate_hz, size)
        if not film.isOpened():
            raise SystemExit(f"{temporary}: cannot be written")
        film.write(picture)
        poster, count = picture, count + 1
        print(f"\rfilm: {count} pictures", end="", flush=True)
    if film is None:
        raise SystemExit(f"{arguments.bag}: expected images of all cameras of {arguments.rig} at stamps of "
                         f"{arguments.obstacles}/objects_frames.csv")
    film.release()
    print()
    os.replace(temporary, arguments.output / "film.webm")
    save(arguments.output / "poster.jpg", poster)
    (arguments.output / "index.html").write_text(PAGE.format(
        title=html.escape(f"What the car sees: {arguments.bag.name}"),
        truth="Magenta: what truly moves; cyan: what truly stands. " if arguments.truth else ""))
    print(f"written: {arguments.output / 'index.html'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bag", type=pathlib.Path, required=True)
    parser.add_argument("--rig", type=pathlib.Path, required=True)
    parser.add_argument("--obstacles", type=pathlib.Path, required=True, help="folder that detect_obstacles wrote")
    parser.add_argument("--truth", type=pathlib.Path, help="truth folder of a simulated drive")
    parser.add_argument("--rate-hz", type=float, default=12.5, help="pictures per second of the film")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder to write")
    write_film(parser.parse_args())


if __name__ == "__main__":
    main()
