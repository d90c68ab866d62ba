"""The view from above: how well two cameras lie on one another at the seams, how equally bright they are there, and whether anything
that stands in an overlap appears twice. Drives are short; obstacle maps come from detect_obstacles."""
import argparse
import csv
import dataclasses

import cv2
import numpy as np
import yaml

from vcharge_evaluation.drawing.obstacles import Truth
from vcharge_evaluation.drives import Drive, condition_words
from vcharge_evaluation.poses import transform
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import CONFIG, run_tool, say

PIXEL_M, REACH_M = 0.025, 7.0  # as the defaults of SurroundViewOptions
BLEND = 253
CAR = yaml.safe_load((CONFIG / "vehicle.yaml").read_text(encoding="utf-8"))["vehicle"]
PATCH_PX, STEP_PX = 80, 40  # for the offset of two images of the ground
LEAST_TEXTURE, LEAST_PEAK = 2.0, 0.2
NEAR_SEAM_PX = 40
STEP_BLOCK_PX = 21  # brightness is compared as means over half a metre: of single pixels, noise would differ
LOWEST_M = 0.3  # lower obstacles, as kerbs, appear where they stand
PART_M = 0.2  # obstacles are judged in parts of this size: a long one may be shown by several cameras, one after the other
NEAR_CAR_M = 0.3
KNOWN_M = 0.25  # the obstacle map has a part if a cell this near is occupied
SHOWN_M2 = 0.05  # a camera shows a part twice if it shows more than this of it where the other one does not
RIG_ERRORS = {"as the drive's": (0.0, 0.0), "5 mm and 0.1 degrees off": (0.005, 0.1)}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "surround_view_evaluation")
    parser.add_argument("--drives", nargs="*", default=["lot:short:201", "garage:short:211", "obstacles:creep:201"],
                        metavar="SCENE:DRIVE:SEED")
    parser.add_argument("--conditions", nargs="*", default=["noon"], help="of lots")
    parser.add_argument("--image-scale", type=float, default=1.0)
    parser.add_argument("--duration-s", type=float, default=5.0)
    parser.add_argument("--every", type=int, default=6, help="judge every n-th picture")
    return parser.parse_args()


@dataclasses.dataclass
class Camera:
    index: int
    pose: np.ndarray  # vehicle_from_camera, 4 x 4


class Grid:
    """Positions of the pixels of a view in the vehicle's frame."""

    def __init__(self, shape):
        self.shape = shape
        front, rear = CAR["length_m"] - CAR["rear_overhang_m"], -CAR["rear_overhang_m"]
        self.corner = np.array([0.5 * (front + rear) + 0.5 * shape[0] * PIXEL_M, 0.5 * shape[1] * PIXEL_M])
        self.x = np.repeat((self.corner[0] - (np.arange(shape[0]) + 0.5) * PIXEL_M)[:, None], shape[1], 1)
        self.y = np.repeat((self.corner[1] - (np.arange(shape[1]) + 0.5) * PIXEL_M)[None], shape[0], 0)
        outside = np.maximum(np.maximum(self.x - front, rear - self.x), 0), np.maximum(np.abs(self.y) - CAR["width_m"] / 2, 0)
        self.to_car = np.hypot(*outside)

    def pixels_of(self, points):
        """Column and row of points (N x 2)."""
        return np.column_stack([self.corner[1] - points[:, 1], self.corner[0] - points[:, 0]]) / PIXEL_M - 0.5

    def polygon(self, points):
        """Mask of a convex hull, uint8."""
        mask = np.zeros(self.shape, np.uint8)
        hull = cv2.convexHull(np.clip(self.pixels_of(points), -4000, 4000).astype(np.float32))
        return cv2.fillConvexPoly(mask, np.rint(hull).astype(np.int32), 1)

    def factor(self, camera, row):
        """What equalizes the brightness of a camera, by a row of gains.csv."""
        points = np.stack([self.x, self.y, np.zeros(self.shape), np.ones(self.shape)], -1) @ np.linalg.inv(camera.pose).T
        angle = np.arctan2(np.hypot(points[..., 0], points[..., 1]), points[..., 2]) / (np.pi / 2)
        gain = float(list(row.values())[1 + camera.index])
        return gain * np.exp(-float(row["shading_1"]) * angle ** 2 - float(row["shading_2"]) * angle ** 4)


def shadow(grid, camera, corners, top_m):
    """Where a camera shows something upright on the ground: its footprint, and what it hides."""
    centre, height = camera.pose[:2, 3], camera.pose[2, 3]
    stretch = height / (height - top_m) if top_m < height else np.inf
    away = corners - centre
    farthest = 40.0 / np.maximum(np.linalg.norm(away, axis=1), 0.1)
    return grid.polygon(np.vstack([corners, centre + away * np.minimum(stretch, np.maximum(farthest, 1.0))[:, None]]))


def parts_of(corners):
    """Squares of PART_M along the outline of a footprint; the footprint itself if it is small."""
    if np.ptp(corners, axis=0).max() < 2 * PART_M:
        yield corners
        return
    square = PART_M / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for begin, end in zip(corners, np.roll(corners, -1, axis=0)):
        count = max(1, int(np.linalg.norm(end - begin) / PART_M))
        for k in range(count):
            yield begin + (end - begin) * (k + 0.5) / count + square


def occupied_of(folder, stamp):
    """Positions of the occupied cells of the newest map of a stamp, in the vehicle's frame (N x 2). Maps are of the same stamps as
    pictures, except where one could not be made."""
    stamps = [known for known in (int(path.stem) for path in folder.glob("*.pgm")) if known <= stamp]
    if not stamps:
        return np.zeros((0, 2))
    meta = yaml.safe_load((folder / f"{max(stamps)}.yaml").read_text(encoding="utf-8"))
    rows, columns = np.nonzero(cv2.imread(str(folder / f"{max(stamps)}.pgm"), cv2.IMREAD_UNCHANGED)[::-1] == 0)
    cells = np.column_stack([columns, rows, np.zeros(len(rows))]) + [0.5, 0.5, 0]
    points = cells * meta["resolution"] + [*meta["origin"][:2], 0.0]
    pose = transform(meta["fixed_from_vehicle_translation_m"], meta["fixed_from_vehicle_rotation_xyzw"])
    return ((points - pose[:3, 3]) @ pose[:3, :3])[:, :2]


def turned_rig(path, output, shift_m, angle_deg, seed):
    """Writes a rig whose cameras are displaced and turned by these amounts, in random directions."""
    rig, random = yaml.safe_load(path.read_text(encoding="utf-8")), np.random.default_rng(seed)
    for camera in rig["cameras"].values():
        pose = camera["vehicle_from_camera"]
        shift, axis = (vector / np.linalg.norm(vector) for vector in random.normal(size=(2, 3)))
        half = np.radians(angle_deg) / 2
        x, y, z, w = *(axis * np.sin(half)), np.cos(half)
        a, b, c, d = pose["rotation_xyzw"]
        pose["translation_m"] = (np.array(pose["translation_m"]) + shift_m * shift).tolist()
        pose["rotation_xyzw"] = [float(value) for value in (
            w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c)]
    output.write_text(yaml.safe_dump(rig, sort_keys=False), encoding="utf-8")
    return output


def render(drive, rig, name, *words):
    """Folder of the pictures, and what the tool found."""
    folder = drive.folder / name
    found = run_tool("render_surround_view", drive.folder / f"{name}.log", "--bag", drive.bag, "--rig", rig, "--vehicle",
                     CONFIG / "vehicle.yaml", "--output", folder, "--labels", "--no-film", *words).found
    return folder, found


def picture(folder, stamp, suffix=""):
    return cv2.imread(str(folder / f"{stamp}{suffix}.png"), cv2.IMREAD_UNCHANGED)


def pairs_of(seen):
    """Pairs of cameras, and where both see the ground."""
    names = sorted(seen)
    for i, first in enumerate(names):
        for second in names[i + 1:]:
            both = seen[first] & seen[second]
            if both.sum() > PATCH_PX ** 2:
                yield first, second, both


def offsets(first, second, usable, seam):
    """Distances in metres between the ground in two images, in patches near the seam."""
    window = cv2.createHanningWindow((PATCH_PX, PATCH_PX), cv2.CV_64F)
    found = []
    for row in range(0, first.shape[0] - PATCH_PX, STEP_PX):
        for column in range(0, first.shape[1] - PATCH_PX, STEP_PX):
            part = np.s_[row:row + PATCH_PX, column:column + PATCH_PX]
            if not usable[part].all() or not seam[part][20:-20, 20:-20].any():
                continue
            sharp = [image[part] - cv2.GaussianBlur(image[part], (0, 0), 8) for image in (first, second)]
            if min(one.std() for one in sharp) < LEAST_TEXTURE:
                continue
            shift, peak = cv2.phaseCorrelate(sharp[0] * window, sharp[1] * window)
            if peak > LEAST_PEAK:
                found.append(float(np.hypot(*shift)) * PIXEL_M)
    return found


def judge_ground(drive, rig, name, cameras, stamps, grid, full):
    """Offsets and differences of the brightness of two cameras at the seams, over ground that no obstacle hides."""
    single = {camera: render(drive, rig, f"{name}_{camera}", "--cameras", camera)[0] for camera in cameras}
    with open(full / "gains.csv", encoding="utf-8") as file:
        gains = {int(row["stamp_ns"]): row for row in csv.DictReader(file)}
    errors, steps = [], []
    for stamp in stamps:
        truth = Truth(drive.truth, stamp)
        hidden = np.zeros(grid.shape, np.uint8)
        for one in [*truth.standing, *truth.moving]:
            corners = truth.footprint(one)
            if one["top_z_m"] - one["base_z_m"] > 0.05 and np.linalg.norm(corners.mean(0)) < 25:
                for camera in cameras.values():
                    hidden |= shadow(grid, camera, corners, one["top_z_m"])
        hidden = cv2.dilate(hidden, np.ones((9, 9), np.uint8)) > 0
        seen = {one: picture(single[one], stamp, "_labels") == camera.index for one, camera in cameras.items()}
        images = {one: picture(single[one], stamp).astype(float) * grid.factor(camera, gains[stamp])
                  for one, camera in cameras.items()}
        at_seam = (picture(full, stamp, "_labels") == BLEND).astype(np.uint8)
        near = cv2.dilate(at_seam, np.ones((NEAR_SEAM_PX, NEAR_SEAM_PX), np.uint8)) > 0
        for first, second, both in pairs_of(seen):
            usable = both & ~hidden & (grid.to_car > NEAR_CAR_M)
            errors += offsets(images[first], images[second], usable, near)
            part = cv2.blur(usable.astype(float), (STEP_BLOCK_PX, STEP_BLOCK_PX))
            difference = cv2.blur(np.where(usable, images[first] - images[second], 0.0), (STEP_BLOCK_PX, STEP_BLOCK_PX))
            chosen = (part > 0.8) & (at_seam > 0)
            steps.append((difference[chosen] / part[chosen])[::7])
    return errors, np.abs(np.concatenate(steps)) if steps else np.zeros(0)


def judge_obstacles(drive, cameras, stamps, grid, full, seen):
    """For each part of an obstacle in an overlap, over all pictures: whether the obstacle map has it, and whether two cameras show it
    at two places."""
    found = []
    for stamp in stamps:
        truth, labels = Truth(drive.truth, stamp), picture(full, stamp, "_labels")
        occupied = occupied_of(drive.folder / "obstacles", stamp)
        shown = {name: (labels == camera.index) | (labels == BLEND) for name, camera in cameras.items()}
        for one in [*truth.standing, *truth.moving]:
            corners = truth.footprint(one)
            if one["top_z_m"] - one["base_z_m"] < LOWEST_M or np.linalg.norm(corners, axis=1).min() > 12:
                continue
            for part in parts_of(corners):
                column, row = np.rint(grid.pixels_of(part.mean(0)[None])[0]).astype(int)
                if not (0 <= row < grid.shape[0] and 0 <= column < grid.shape[1]) or grid.to_car[row, column] < NEAR_CAR_M:
                    continue
                both = [name for name in cameras if seen[name][row, column]]
                if len(both) < 2:
                    continue
                is_known = bool((np.linalg.norm(occupied - part.mean(0), axis=1) < KNOWN_M).any())
                areas = {name: shadow(grid, cameras[name], part, one["top_z_m"]) > 0 for name in both}
                alone = [(areas[name] & shown[name] & ~np.any([areas[other] for other in both if other != name], axis=0)).sum()
                         for name in both]
                found.append((is_known, sum(pixels * PIXEL_M ** 2 > SHOWN_M2 for pixels in alone) > 1))
    return np.array(found, bool).reshape(-1, 2)


def evaluate(args, scene, course, seed, condition):
    drive = Drive(args.work, f"{scene}_{course}_surround", "--scene", scene, "--drive", course, "--scene-seed", seed, "--seed", seed,
                  "--image-scale", args.image_scale, "--duration-s", args.duration_s,
                  *(condition_words(condition) if scene == "lot" else ()))
    say(f"{drive.folder}: obstacles and views")
    obstacles = drive.folder / "obstacles"
    run_tool("detect_obstacles", drive.folder / "obstacles.log", "--bag", drive.bag, "--rig", drive.true_rig, "--no-objects",
             "--options", CONFIG / "obstacles.yaml", "--range-options", CONFIG / "dense_obstacles.yaml", "--output", obstacles)
    figures = []
    for error, (shift_m, angle_deg) in RIG_ERRORS.items():
        name = "view" if shift_m == 0 else "view_off"
        rig = drive.true_rig if shift_m == 0 else turned_rig(drive.true_rig, drive.true_rig.with_name("rig_off.yaml"), shift_m, angle_deg,
                                                                             seed)
        cameras = {camera: Camera(index, transform(entry["vehicle_from_camera"]["translation_m"],
                                                   entry["vehicle_from_camera"]["rotation_xyzw"]))
                   for index, (camera, entry) in enumerate(yaml.safe_load(rig.read_text(encoding="utf-8"))["cameras"].items())}
        full, found = render(drive, rig, name, "--obstacles", obstacles)
        stamps = sorted(int(path.stem) for path in full.glob("*.png") if path.stem.isdigit())[2::args.every]
        grid = Grid(picture(full, stamps[0]).shape)
        errors, steps = judge_ground(drive, rig, name, cameras, stamps, grid, full)
        goal = {"at_most": 3.0} if shift_m == 0 else {}
        figures += [figure(f"offset at the seams, rig {error}, median", 100 * float(np.median(errors)) if errors else None, "cm",
                           **goal),
                    Figure(f"offset at the seams, rig {error}, 95 %", 100 * float(np.percentile(errors, 95)) if errors else None, "cm")]
        if shift_m == 0:
            seen = {camera: picture(drive.folder / f"{name}_{camera}", stamps[0], "_labels") == entry.index
                    for camera, entry in cameras.items()}
            plain, _ = render(drive, rig, f"{name}_plain")
            parts, without = (judge_obstacles(drive, cameras, stamps, grid, folder, seen) for folder in (full, plain))
            known = parts[:, 0]
            figures += [Figure("patches of ground compared", len(errors)),
                        figure("step of the brightness at the seams, mean", float(steps.mean()) if len(steps) else None, "gray levels",
                               at_most=3.0),
                        Figure("parts of obstacles in overlaps", len(parts)),
                        Figure("of them in the obstacle map", percent(known.sum(), len(parts)), "%"),
                        figure("of these shown twice", percent(parts[known, 1].sum(), known.sum()), "%", equal=0.0),
                        Figure("of these shown twice without an obstacle map", percent(without[known, 1].sum(), known.sum()), "%"),
                        Figure("of all shown twice", percent(parts[:, 1].sum(), len(parts)), "%"),
                        Figure("never seen", 100 * found["unknown_ratio"], "% of the view"),
                        figure("processor time", found["processor_ms_per_frame"], "ms per frame", at_most=10.0)]
    return figures


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("surround_view", "The view from above", args)
    for name in args.drives:
        scene, course, seed = name.split(":")
        for condition in args.conditions if scene == "lot" else ["noon"]:
            results.add("The view from above", (f"{scene} {course} {seed}" + (f", {condition}" if condition != "noon" else ""),
                                                evaluate(args, scene, course, int(seed), condition)))
    results.end()


if __name__ == "__main__":
    main()
