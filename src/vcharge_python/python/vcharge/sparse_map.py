"""Sparse maps (*.vmap), which are SQLite files."""
import dataclasses
import pathlib
import sqlite3
import urllib.parse

import cv2
import numpy as np

from vcharge import transforms
from vcharge.errors import InputError
from vcharge.rig import Rig, parse_rig
from vcharge.trajectory import Trajectory

MAGIC, APPLICATION_ID = b"SQLite format 3\0", 0x76636d70
OLDEST_SCHEMA, SCHEMA = 2, 3


@dataclasses.dataclass(frozen=True, eq=False)
class Session:
    """One drive in a map.

    name: of the recording; empty if unknown
    recording_hash: of the recording's file; empty if unknown
    component: sessions with one number were joined; the relative pose of components is unknown
    """

    name: str
    recording_hash: str
    component: int


@dataclasses.dataclass(frozen=True, eq=False)
class Keyframes:
    """Poses of the vehicle whose images are part of the map, grouped by session, ordered by id. K of them.

    ids: int64 (K), the same in all versions of a map
    sessions: int64 (K), indices into the map's sessions
    stamps_ns: int64 (K), increasing within a session
    positions_m: K x 3, in the frame map
    rotations_xyzw: K x 4, unit quaternions of map_from_vehicle
    covariances: K x 6 x 6 over [dt, dphi] in the frame map (m, rad); NaN if unknown
    """

    ids: np.ndarray
    sessions: np.ndarray
    stamps_ns: np.ndarray
    positions_m: np.ndarray
    rotations_xyzw: np.ndarray
    covariances: np.ndarray

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def map_from_vehicle(self) -> np.ndarray:
        """Transforms (K x 4 x 4)."""
        return transforms.transforms_of(self.positions_m, self.rotations_xyzw)


@dataclasses.dataclass(frozen=True, eq=False)
class Landmarks:
    """Points, ordered by id. L of them.

    ids: int64 (L), the same in all versions of a map
    positions_m: L x 3, in the frame map
    covariances_m2: L x 3 x 3; NaN if unknown
    presence_log_odds: L, evidence of later drives that the point is still there; 0 without any
    num_observations: int64 (L), at least 1
    """

    ids: np.ndarray
    positions_m: np.ndarray
    covariances_m2: np.ndarray
    presence_log_odds: np.ndarray
    num_observations: np.ndarray

    def __len__(self) -> int:
        return len(self.ids)


@dataclasses.dataclass(frozen=True, eq=False)
class Observations:
    """Landmarks seen in images, ordered by keyframe and camera. O of them.

    keyframes: int32 (O), indices into the map's keyframes
    cameras: int32 (O), indices into the rig's cameras
    landmarks: int32 (O), indices into the map's landmarks
    positions_px: float32 (O x 2)
    """

    keyframes: np.ndarray
    cameras: np.ndarray
    landmarks: np.ndarray
    positions_px: np.ndarray

    def __len__(self) -> int:
        return len(self.keyframes)


@dataclasses.dataclass(frozen=True, eq=False)
class SparseMap:
    """A metric map of landmarks. Its frame is the vehicle's at the first keyframe, unless the map was moved.

    version: the version that was read
    versions: the versions that the file holds; the newest is the map
    provenance: how the map was made, by keys such as "program" and "bag"
    """

    rig: Rig
    sessions: list[Session]
    keyframes: Keyframes
    landmarks: Landmarks
    observations: Observations
    version: int
    versions: list[int]
    provenance: dict[str, str]

    @property
    def components(self) -> np.ndarray:
        """The component of each keyframe (K): where the numbers differ, the relative pose is unknown."""
        return np.array([self.sessions[session].component for session in self.keyframes.sessions], np.int64)

    def trajectory(self, session: int | None = None) -> Trajectory:
        """Poses of the keyframes, or of those of one session, by their stamps."""
        chosen = np.arange(len(self.keyframes)) if session is None else np.flatnonzero(self.keyframes.sessions == session)
        order = chosen[np.argsort(self.keyframes.stamps_ns[chosen], kind="stable")]
        return Trajectory(self.keyframes.stamps_ns[order], self.keyframes.positions_m[order], self.keyframes.rotations_xyzw[order])


def read_map(path, version: int | None = None) -> SparseMap:
    """Reads a sparse map: the newest version, or an earlier one that the file still holds. InputError naming the file for what is
    no map, is truncated or damaged, or has a file format that is not read. SQLite's check of its pages and all relations between
    the tables are checked; the hash of the content is not."""
    path = pathlib.Path(path)
    schema = check_header(path)
    try:
        database = sqlite3.connect(f"file://{urllib.parse.quote(str(path.absolute()))}?immutable=1", uri=True)
        try:
            return _Reader(path, schema, database, version).read()
        finally:
            database.close()
    except sqlite3.Error as error:
        raise InputError(f"{path}: cannot be read as a map: {error}") from error


def check_header(path: pathlib.Path) -> int:
    """The version of the file format, from the first bytes (SQLite's file format, section 1.3)."""
    if path.is_dir():
        raise InputError(f"{path}: expected a map file, is a folder")
    try:
        with open(path, "rb") as file:
            header = file.read(100)
        size = path.stat().st_size
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if not header:
        raise InputError(f"{path}: expected a map file, is empty")
    if not header.startswith(MAGIC[:len(header)]):
        raise InputError(f"{path}: expected a map file, is no SQLite file")
    if len(header) < 100:
        raise InputError(f"{path}: the map is truncated: it ends after {len(header)} bytes")
    if int.from_bytes(header[68:72], "big") != APPLICATION_ID:
        raise InputError(f"{path}: expected a map file, is the SQLite file of another program")
    schema = int.from_bytes(header[60:64], "big")
    if not OLDEST_SCHEMA <= schema <= SCHEMA:
        raise InputError(f"{path}: the map has version {schema} of the file format, expected versions {OLDEST_SCHEMA} to {SCHEMA}: "
                         + ("it was written by a newer program" if schema > SCHEMA else "build it again"))
    page_size = int.from_bytes(header[16:18], "big")
    expected = (65536 if page_size == 1 else page_size) * int.from_bytes(header[28:32], "big")
    if size < expected:
        raise InputError(f"{path}: the map is truncated: it has {size} of {expected} bytes")
    return schema


class _Reader:
    """Reads one version of an open map."""

    def __init__(self, path, schema, database, version):
        self.path, self.database, self.has_versions = path, database, schema > OLDEST_SCHEMA
        database.execute("PRAGMA trusted_schema = OFF")
        check = database.execute("PRAGMA quick_check(1)").fetchone()[0]
        if check != "ok":
            self.damaged(check)
        self.versions = [1]  # without a table of versions there is one
        if self.has_versions:
            self.versions = [row[0] for row in database.execute("SELECT number FROM version ORDER BY number")]
            if not self.versions:
                self.damaged("it holds no version")
        self.version = self.versions[-1] if version is None else version
        if self.version not in self.versions:
            raise InputError(f"{path}: the map has no version {version}, expected {self.versions[0]} to {self.versions[-1]}")

    def damaged(self, what):
        raise InputError(f"{self.path}: the map is damaged: {what}")

    def rows(self, table, columns, rest=""):
        source = table
        if self.version != self.versions[-1]:
            source = (f"(SELECT {columns} FROM {table} WHERE since_version <= {self.version} UNION ALL "
                      f"SELECT {columns} FROM past_{table} WHERE since_version <= {self.version} "
                      f"AND until_version >= {self.version})")
        return self.database.execute(f"SELECT {columns} FROM {source} {rest}").fetchall()

    def read(self):
        provenance = dict(self.rows("provenance", "key, value"))
        sessions = [Session("", "", 0)]
        if self.has_versions:
            sessions = [Session(*row[1:]) for row in self.rows("session", "id, name, recording_hash, component", "ORDER BY id")]
        keyframes, landmarks = self.keyframes(), self.landmarks()
        rig = self.rig()
        observations = self.observations(keyframes.ids, landmarks[0], len(rig))
        counts = np.bincount(observations.landmarks, minlength=len(landmarks[0]))
        if (counts == 0).any():
            self.damaged("a landmark without an observation")
        if len(keyframes) and not (keyframes.sessions.min() >= 0 and keyframes.sessions.max() < len(sessions)):
            self.damaged("keyframe: there is no such session")
        return SparseMap(rig, sessions, keyframes, Landmarks(*landmarks, counts), observations, self.version, self.versions,
                         provenance)

    def rig(self):
        text = dict(self.rows("meta", "key, value")).get("rig")
        if not isinstance(text, str):
            self.damaged("meta: rig is missing")
        masks, cameras = {}, self.rows("camera", "id, name, mask_png", "ORDER BY id")
        for _, name, png in cameras:
            if png:
                masks[name] = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_GRAYSCALE)
        rig = parse_rig(text, f"{self.path}: rig", None, masks)
        if [name for _, name, _ in cameras] != list(rig.cameras):
            self.damaged("rig and table camera have different cameras")
        for name, mask in masks.items():
            if mask is None or mask.shape[::-1] != rig[name].image_size_px:
                self.damaged(f"camera {name}: its mask differs from the rig")
        return rig

    def keyframes(self):
        rows = self.rows("keyframe", "id, " + ("session" if self.has_versions else "0") +
                         ", stamp_ns, x_m, y_m, z_m, qx, qy, qz, qw, covariance_6x6_f64", "ORDER BY id")
        whole = np.array([row[:3] for row in rows], np.int64).reshape(-1, 3)
        poses = np.array([row[3:10] for row in rows], float).reshape(-1, 7)
        if not np.isfinite(poses).all() or (np.abs(np.linalg.norm(poses[:, 3:], axis=1) - 1) > 1e-9).any():
            self.damaged("keyframe: expected finite translations and unit quaternions")
        return Keyframes(*whole.T, poses[:, :3], poses[:, 3:], self.covariances("keyframe", [row[10] for row in rows], 6))

    def landmarks(self):
        """The members of Landmarks apart from the counts."""
        rows = self.rows("landmark",
                         "id, x_m, y_m, z_m, covariance_3x3_f64, " + ("presence_log_odds" if self.has_versions else "0"),
                         "ORDER BY id")
        positions = np.array([row[1:4] for row in rows], float).reshape(-1, 3)
        if not np.isfinite(positions).all():
            self.damaged("landmark: expected finite positions")
        return (np.array([row[0] for row in rows], np.int64), positions, self.covariances("landmark", [row[4] for row in rows], 3),
                np.array([row[5] for row in rows], float))

    def covariances(self, table, blobs, size):
        """NaN where there is none."""
        unknown = np.full(size * size, np.nan).tobytes()
        if any(blob is not None and len(blob) != len(unknown) for blob in blobs):
            self.damaged(f"{table}: a covariance has another size than {size} x {size}")
        whole = b"".join(unknown if blob is None else blob for blob in blobs)
        return np.frombuffer(whole, "<f8").reshape(-1, size, size)

    def observations(self, keyframe_ids, landmark_ids, num_cameras):
        rows = self.rows("image", "id, keyframe, camera, num_observations, landmarks_i32, positions_px_f32", "ORDER BY id")
        for _, _, _, count, landmarks, positions in rows:
            if len(landmarks) != 4 * count or len(positions) != 8 * count:
                self.damaged("image: expected as many landmarks and positions as observations")
        counts = np.array([row[3] for row in rows], np.int64)
        cameras = np.repeat(np.array([row[2] for row in rows], np.int32), counts)
        if len(cameras) and not (cameras.min() >= 0 and cameras.max() < num_cameras):
            self.damaged("image: there is no such camera")
        return Observations(
            np.repeat(self.indices(keyframe_ids, np.array([row[1] for row in rows], np.int64), "keyframe"), counts), cameras,
            self.indices(landmark_ids, np.frombuffer(b"".join(row[4] for row in rows), "<i4"), "landmark"),
            np.frombuffer(b"".join(row[5] for row in rows), "<f4").reshape(-1, 2))

    def indices(self, ids, wanted, what):
        """Indices of records by their ids, which ascend."""
        found = np.searchsorted(ids, wanted)
        if len(wanted) and (not len(ids) or (ids[np.minimum(found, len(ids) - 1)] != wanted).any()):
            self.damaged(f"image: there is no such {what}")
        return found.astype(np.int32)
