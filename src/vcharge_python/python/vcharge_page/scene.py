"""What a page shows, as a description in JSON and blocks of bytes."""
import base64
import dataclasses

import numpy as np

from vcharge import HeightMap, InputError, ObjectFrame, ParkingBays, SparseMap, transforms
from vcharge_page.chunks import chunks_of
from vcharge_page.poses import Timeline
from vcharge_page.surface import surface_of

MANY_OBSERVATIONS = 20  # of a landmark that is drawn brightest


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """`description` becomes JSON; `blocks` are bytes by name."""
    description: dict
    blocks: dict[str, bytes]


def rounded(values, digits=3):
    return np.round(np.asarray(values, float), digits).tolist()


def points_block(points_m, values):
    """Descriptions of the chunks of points, and their bytes one after the other."""
    chunks = chunks_of(points_m, values)
    return ([{"centreM": rounded(one.centre_m, 6), "halfM": rounded(one.half_size_m, 6), "count": len(one.packed)}
             for one in chunks],
            b"".join(one.packed.astype("<i2").tobytes() for one in chunks))


def scene_of(title: str, sparse_map: SparseMap, height_map: HeightMap | None = None, bays: ParkingBays | None = None,
             objects: list[ObjectFrame] | None = None, pictures: dict | None = None) -> Scene:
    """The scene of a map and what belongs to it, all in the frame map. InputError for objects of another drive."""
    timeline = Timeline(sparse_map)
    chunks, points = points_block(sparse_map.landmarks.positions_m,
                                  np.log1p(sparse_map.landmarks.num_observations) / np.log1p(MANY_OBSERVATIONS))
    blocks = {"points": points}
    description = {"title": title, "numLandmarks": len(sparse_map.landmarks), "chunks": chunks, "cameras": _cameras(sparse_map),
                   "sessions": _sessions(sparse_map, timeline),
                   "numComponents": len({one.component for one in sparse_map.sessions}),
                   "view": _view(sparse_map), "program": sparse_map.provenance.get("program", "")}
    surface = surface_of(height_map) if height_map else None
    if surface:
        description["surface"], heights, picture = surface
        blocks.update(heights=heights.astype("<i2").tobytes(), surfacePicture=picture)
    if bays and bays.bays:
        description["bays"] = _bays(bays, height_map, timeline)
    if objects:
        description["objects"] = _objects(objects, timeline, title)
    if pictures:
        description["pictures"] = _pictures(pictures, timeline, blocks)
    return Scene(description, blocks)


def _seconds(stamp_ns, session, timeline):
    """Since the first keyframe of a session."""
    return round((int(stamp_ns) - int(timeline.trajectories[session].stamps_ns[0])) / 1e9, 4)


def _sessions(sparse_map, timeline):
    return [{"name": f"{number + 1} {found.name}".rstrip(), "component": found.component,
             "timesS": [_seconds(stamp, number, timeline) for stamp in one.stamps_ns], "positionsM": rounded(one.positions_m),
             "rotationsXyzw": rounded(one.rotations_xyzw, 6)}
            for number, (found, one) in enumerate(zip(sparse_map.sessions, timeline.trajectories))]


def _cameras(sparse_map):
    return [{"name": camera.name, "vehicleFromCamera": rounded(camera.vehicle_from_camera.T.ravel(), 5)}  # column by column
            for camera in sparse_map.rig if camera.vehicle_from_camera is not None]


def _view(sparse_map):
    """A box with the keyframes and most landmarks: some lie far away."""
    positions, landmarks = sparse_map.keyframes.positions_m, sparse_map.landmarks.positions_m
    corners = [positions.min(0), positions.max(0)] if len(positions) else []
    if len(landmarks):
        corners += [np.quantile(landmarks, 0.05, axis=0), np.quantile(landmarks, 0.95, axis=0)]
    return {"lowM": rounded(np.min(corners, axis=0)), "highM": rounded(np.max(corners, axis=0))} if corners else None


def _bays(bays, height_map, timeline):
    centres = [bay.corners_m.mean(0) for bay in bays.bays]
    ground = timeline.ground_at(centres)
    if height_map and centres:
        heights = height_map.height_at(centres)
        # A car on a bay is higher than the ground.
        ground = np.where(np.abs(heights - ground) < 0.3, heights, ground)
    return [{"id": bay.id, "state": bay.state, "kind": bay.kind, "cornersM": rounded(bay.corners_m), "zM": round(float(z), 3)}
            for bay, z in zip(bays.bays, ground)]


def _objects(frames, timeline, title):
    """The objects of each frame in the frame map: the pose in the map places the vehicle, around which they are known."""
    shown = []
    for frame in frames:
        session = timeline.session_at(frame.stamp_ns)
        if session is None:
            continue
        map_from_odom = timeline.map_from_vehicle(session, frame.stamp_ns) @ transforms.inverse(frame.odom_from_vehicle)
        entries = []
        for one in frame.objects:
            corners = transforms.apply(map_from_odom, np.column_stack([one.footprint_m, np.zeros(len(one.footprint_m))]))
            velocity = map_from_odom[:2, :2] @ one.velocity_m_per_s
            entries.append({"id": one.id, "kind": one.object_class, "footprintM": rounded(corners[:, :2], 2),
                            "zM": round(float(corners[:, 2].mean()), 2), "heightM": round(one.height_m, 2),
                            "velocityMPerS": rounded(velocity, 2)})
        shown.append({"session": session, "timeS": _seconds(frame.stamp_ns, session, timeline), "objects": entries})
    if frames and not shown:
        raise InputError(f"{title}: objects: expected stamps of the map's drives, got {frames[0].stamp_ns} ns and later")
    return shown


def _pictures(pictures, timeline, blocks):
    """Where the picture of each keyframe and camera lies in the block `pictures`."""
    entries, parts, offset = [], [], 0
    for stamp, images in pictures.items():
        session, places = timeline.session_at(stamp), {}
        for camera, jpeg in images.items():
            padded = jpeg + bytes(-len(jpeg) % 3)  # each part of the base64 text stands alone
            places[camera] = [offset, len(jpeg)]
            offset += len(padded)
            parts.append(padded)
        entries.append({"session": session, "timeS": _seconds(stamp, session, timeline), "images": places})
    blocks["pictures"] = b"".join(parts)
    return entries


def text_of(block):
    return base64.b64encode(block).decode("ascii")
