"""What the tests of localization share: a mapped part of a road, another day's drive there, and faults of this drive."""
import csv
import sqlite3

import numpy as np
import yaml

from drive_fixture import Drive, run, run_tool, tool
from mapping_fixture import positions, rigid_transform

CAMERAS = ("front", "left", "rear", "right")
OTHER_DAY = ("--seed", 101, "--scene-seed", 1)
EXPOSURE = ("--exposure-gain", 1.15)
MAP_DURATION_S, DURATION_S, SCALE = 5, 4, 0.25


class MappedRoad:
    """A map, and another day's drive through it, both with images of a quarter of the size. Faults need no new rendering."""

    def __init__(self):
        self.map_drive = Drive(drive="figure_eight", duration_s=MAP_DURATION_S, cameras=CAMERAS,
                               extra=("--image-step", 2), image_scale=SCALE)
        self.folder = self.map_drive.folder
        self.map = self.build("lot")
        self.world_from_map = self.align()
        self.rendered = Drive(drive="figure_eight", duration_s=DURATION_S, cameras=CAMERAS,
                              extra=(*OTHER_DAY, "--noise", "off"), image_scale=SCALE)
        self.bag = self.drive("other_day")
        self.rig = self.bag.parent / "rig_truth.yaml"
        self.stamps, self.truth = positions(self.bag.parent / "drive_truth" / "trajectory.tum")

    def remove(self):
        self.map_drive.remove()
        self.rendered.remove()

    def build(self, name, *words):
        path = self.folder / f"{name}.vmap"
        status, output, errors = run([tool("vcharge_mapping", "build_map"), "--bag", self.map_drive.bag, "--rig",
                                      self.map_drive.rig, "--output", path, *words])
        if status != 0:
            raise RuntimeError(f"build_map failed: {output} {errors}")
        return path

    def align(self):
        keyframes = self.folder / "keyframes.tum"
        run([tool("vcharge_mapping", "map_info"), "--map", self.map, "--trajectory", keyframes])
        stamps, points = positions(keyframes)
        true_stamps, truth = positions(self.map_drive.truth / "trajectory.tum")
        return rigid_transform(points, truth[np.abs(true_stamps[None, :] - stamps[:, None]).argmin(axis=1)])

    def drive(self, name, *settings):
        """The bag of the other day's drive with KEY=VALUE settings of the simulator."""
        folder = self.folder / name
        folder.mkdir()
        words = [word for setting in settings for word in ("--set", setting)]
        status, output, errors = run([
            tool("vcharge_simulation", "simulate_drive"), "--drive", "figure_eight", "--duration-s", DURATION_S,
            "--image-scale", SCALE, "--cameras", *CAMERAS, *OTHER_DAY, *EXPOSURE, "--images-from", self.rendered.bag,
            *words, "--output", folder / "drive.bag"])
        if status != 0:
            raise RuntimeError(f"simulate_drive failed: {output} {errors}")
        return folder / "drive.bag"

    def localize(self, bag=None, rig=None, map_path=None, words=(), prefix=()):
        """Exit status, findings and errors of localize_drive, and the rows of its table."""
        output = self.folder / "localized.tum"
        table = self.folder / "localized.tum.csv"
        for path in (output, table):
            path.unlink(missing_ok=True)
        status, found, errors = run_tool([
            *prefix, tool("vcharge_localization", "localize_drive"), "--bag", bag or self.bag, "--rig", rig or self.rig,
            "--map", map_path or self.map, "--output", output, *words])
        rows = []
        if table.exists():
            with open(table, encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        return status, found, errors, rows

    def errors_m(self, stamps, points):
        """Errors of positions in the map against the truth at the same stamps."""
        rotation, shift = self.world_from_map
        nearest = np.abs(self.stamps[None, :] - np.asarray(stamps)[:, None]).argmin(axis=1)
        return np.linalg.norm(np.asarray(points) @ rotation.T + shift - self.truth[nearest], axis=1)

    def errors_of_rows_m(self, rows):
        posed = [row for row in rows if row["tx"]]
        return self.errors_m([float(row["time_s"]) for row in posed],
                             [[float(row[key]) for key in ("tx", "ty", "tz")] for row in posed])

    def bad_inputs(self):
        """Name, map, rig, options, and expected words of the error."""
        folder = self.folder
        cut = folder / "cut.vmap"
        cut.write_bytes(self.map.read_bytes()[:50000])
        changed = folder / "changed.vmap"
        changed.write_bytes(self.map.read_bytes())
        with sqlite3.connect(str(changed)) as connection:
            cursor = connection.execute("UPDATE meta SET value = 'type: orb' WHERE key = 'feature_options'")
            if cursor.rowcount != 1:
                raise RuntimeError(f"{changed}: no feature_options to change")
        bare = self.rig.parent / "bare.yaml"

        def without_extrinsics(cameras):
            del cameras["left"]["vehicle_from_camera"]

        bare.write_text(rig_text(self.rig, without_extrinsics))
        return (("missing", folder / "none.vmap", None, None, ("none.vmap: no such file",)),
                ("cut", cut, None, None, ("cut.vmap: the map is truncated",)),
                ("changed", changed, None, None, ("changed.vmap: the map is damaged",)),
                ("bare", None, bare, None, ("bare.yaml", "vehicle_from_camera")),
                ("option", None, None, {"no_such_option": 1}, ("no_such_option",)))


def count(rows, status):
    return sum(row["status"] == status for row in rows)


def warnings(found):
    """The warnings about cameras that localize_drive found: (frames, text)."""
    return [(warning["num_frames"], warning["text"]) for warning in found["warnings"]]


def rig_text(rig, change):
    """The text of a rig.yaml after change(cameras) altered its dictionary of cameras."""
    content = yaml.safe_load(rig.read_text())
    content["cameras"] = change(content["cameras"]) or content["cameras"]
    return yaml.safe_dump(content, sort_keys=False)
