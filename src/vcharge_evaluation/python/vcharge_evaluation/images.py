"""Simulated images beside real ones: gradients, spectrum, density of features, and features found again after some metres.

A measure is easier where gradients are stronger, small details keep more of the contrast, features are denser, or more of
them are matched. The lot is held against the V-Charge car's street, the garage against its workshop (statistics of one
image) and its street (matches: no real indoor drive is published)."""
import argparse
import dataclasses
import os
import pathlib

import cv2
import numpy as np
import rosbag

import vcharge
from vcharge_evaluation.poses import pose_of, transform
from vcharge_evaluation.real_images import parking_lot_images, workshop_images
from vcharge_evaluation.results import Results, add_arguments, figure
from vcharge_evaluation.tools import import_published_images, run_tool, simulate

CAMERA = "left"
TYPES = {"FAST/BRIEF": "{max_features: 100000}",
         "RootSIFT": "{type: root_sift, max_features: 100000, sift_contrast_threshold: 0.04}"}
DISTANCES_M = (0.25, 0.5, 1.0, 2.0)
PAIRS, MAX_ERROR_RAD = 8, np.radians(0.5)
STRONG_GRADIENT = 0.2  # of the mean brightness, per pixel
PATCH_PX, SPECTRUM_PER_PX = 64, (0.03, 0.3)
MAX_EASIER = 1.1
TITLES = {"lot": "Lots beside the street of the V-Charge car", "garage": "Garages beside the workshop (matches: the street)"}


@dataclasses.dataclass
class ImageSet:
    """Gray images of one camera; masks are 0 where the own car or a calibration pattern is. A set without poses has no pairs."""
    name: str
    images: list
    masks: list  # one for all, or one per image
    camera: vcharge.Camera = None
    vehicle_poses: list = None  # world_from_vehicle, 4 x 4

    def mask(self, index):
        return self.masks[index if len(self.masks) > 1 else 0]


def drive_of(word):
    """Scene and seed of SCENE:SEED."""
    scene, _, seed = word.partition(":")
    if scene not in TITLES or not seed.isdigit():
        raise argparse.ArgumentTypeError(f"expected lot:SEED or garage:SEED, got '{word}'")
    return scene, seed


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "image_evaluation")
    parser.add_argument("--drives", nargs="*", type=drive_of, metavar="SCENE:SEED",
                        default=[drive_of(word) for word in ("lot:201", "lot:202", "garage:211", "garage:212")],
                        help="the seed draws plan and surfaces too")
    parser.add_argument("--duration-s", type=float, default=10.0, help="of the simulated drives")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="option of the simulated drives, as in layout_seed=0")
    return parser.parse_args()


def read_drive(name, bag_path, rig_path, pose_topic):
    """The set of a bag's images of CAMERA, with the poses of `pose_topic` nearest in time."""
    images, poses = {}, {}
    with rosbag.Bag(str(bag_path)) as bag:
        for topic, message, _ in bag.read_messages(topics=[f"/camera/{CAMERA}/image_raw", pose_topic]):
            stamp = message.header.stamp.to_nsec()
            if topic == pose_topic:
                poses[stamp] = transform(*pose_of(message))
            else:
                images[stamp] = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    camera = vcharge.read_rig(rig_path)[CAMERA]
    times = np.array(sorted(poses))
    nearest = [poses[times[np.argmin(np.abs(times - stamp))]] for stamp in sorted(images)]
    return ImageSet(name, [images[stamp] for stamp in sorted(images)], [camera.mask], camera, nearest)


def statistics(images):
    """Gradients relative to the mean brightness, and the slope of the power spectrum, means over the images."""
    rows, spectra = [], []
    for index in np.unique(np.linspace(0, len(images.images) - 1, 12).astype(int)):
        used = cv2.erode(images.mask(index), np.ones((9, 9), np.uint8)) > 0
        image = images.images[index].astype(np.float32)
        image /= image[used].mean()
        smooth = cv2.GaussianBlur(image, (0, 0), 1.0)  # less noise
        x, y = (cv2.Sobel(smooth, cv2.CV_32F, *order, scale=1 / 8) for order in ((1, 0), (0, 1)))
        gradient = np.hypot(x, y)[used]
        rows.append([np.median(gradient), np.quantile(gradient, 0.9), 100.0 * (gradient > STRONG_GRADIENT).mean()])
        spectra += patch_spectra(image, used)
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(PATCH_PX), np.fft.fftfreq(PATCH_PX)))
    rings = np.geomspace(*SPECTRUM_PER_PX, 9)
    power = np.mean(spectra, axis=0)
    means = [power[(frequency >= low) & (frequency < high)].mean() for low, high in zip(rings[:-1], rings[1:])]
    slope = np.polyfit(np.log(np.sqrt(rings[:-1] * rings[1:])), np.log(means), 1)[0]
    return {**dict(zip(("gradient, median", "gradient, 90 %", "strong gradients"), np.mean(rows, axis=0))),
            "decay of the spectrum": -slope}


def patch_spectra(image, used):
    """Power spectra of the patches that lie in the mask, each relative to its variance."""
    window = np.outer(np.hanning(PATCH_PX), np.hanning(PATCH_PX))
    found = []
    for y in range(0, image.shape[0] - PATCH_PX + 1, PATCH_PX):
        for x in range(0, image.shape[1] - PATCH_PX + 1, PATCH_PX):
            part = np.s_[y:y + PATCH_PX, x:x + PATCH_PX]
            if used[part].all():
                power = np.abs(np.fft.fft2((image[part] - image[part].mean()) * window)) ** 2
                found.append(power / max(power.sum(), 1e-12))
    return found


def pairs_at(images, distance_m):
    """Pairs of images this far apart along the path, spread over the drive."""
    positions = np.array([pose[:3, 3] for pose in images.vehicle_poses])
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    ends = [int(np.argmin(np.abs(travelled - start - distance_m))) for start in travelled]
    good = [(i, j) for i, j in enumerate(ends) if abs(travelled[j] - travelled[i] - distance_m) < 0.12]
    return [good[k] for k in np.unique(np.linspace(0, len(good) - 1, PAIRS).astype(int))] if good else []


def right_matches(matches, images, pair):
    """How many matches of a pair are within MAX_ERROR_RAD of the epipolar plane of its poses."""
    if not matches:
        return 0
    pixels = np.array(matches)
    first, second = images.camera.unproject(pixels[:, :2]), images.camera.unproject(pixels[:, 2:])
    world_from_camera = [images.vehicle_poses[k] @ images.camera.vehicle_from_camera for k in pair]
    second_from_first = np.linalg.inv(world_from_camera[1]) @ world_from_camera[0]
    turned, baseline = first @ second_from_first[:3, :3].T, second_from_first[:3, 3]
    errors = []
    for one, other in ((turned, second), (second, turned)):
        normals = np.cross(baseline, one)
        errors.append(np.abs((normals * other).sum(1)) / np.linalg.norm(normals, axis=1))
    return int((np.maximum(*errors) < np.sin(MAX_ERROR_RAD)).sum())


def features(images, folder):
    """Density of features, and the part of them that is matched rightly after each distance."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for kind, whole in (("image", images.images), ("mask", images.masks)):
        paths.append([folder / f"{kind}{i:03d}.png" for i in range(len(whole))])
        for path, image in zip(paths[-1], whole):
            cv2.imwrite(str(path), image)
    pairs = {distance: pairs_at(images, distance) if images.vehicle_poses else [] for distance in DISTANCES_M}
    used = sorted({i for some in pairs.values() for pair in some for i in pair}) or range(len(images.images))
    numbers = {image: k for k, image in enumerate(used)}
    masks = [paths[1][i] for i in used] if len(paths[1]) > 1 else paths[1]
    words = [f"{numbers[i]}:{numbers[j]}" for some in pairs.values() for i, j in some]
    measures = {}
    for name, options in TYPES.items():
        (folder / "options.yaml").write_text(options)
        found = run_tool("match_images", folder / f"{name[:4]}.log", "--images", *(paths[0][i] for i in used), "--masks", *masks,
                         *(["--pairs", *words] if words else []), "--options", folder / "options.yaml").found
        measures[f"{name} features per 10,000 px"] = 1e4 * np.sum(found["features"]) / np.sum(found["area_px"])
        matches = iter(found["matches"])
        for distance, some in pairs.items():
            right = [100.0 * right_matches(next(matches), images, pair) / max(1, found["features"][numbers[pair[0]]])
                     for pair in some]
            measures[f"{name} matched after {distance:g} m"] = float(np.mean(right)) if right else None
    return measures


def figures(measures, reference):
    """`reference`: measures of real images, None for those without a goal. Only the decay is easier where it is smaller."""
    entries = []
    for name, value in measures.items():
        real = reference.get(name)
        goal = {} if real is None else {"at_least": real / MAX_EASIER} if name.startswith("decay") else {"at_most": real * MAX_EASIER}
        unit = "%" if name.startswith("strong") or "matched" in name else ""
        entries.append(figure(name, None if value is None else float(value), unit, **{k: float(v) for k, v in goal.items()}))
    if reference:
        entries.append(figure("measures easier by more than 10 %", float(sum(entry.reached is False for entry in entries)), at_most=0.0))
    return entries


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("images", "Simulated images beside real ones", args)
    real = {}

    def measure(scene, images, reference):
        measures = {**statistics(images), **features(images, args.work / images.name.replace(":", "_") / "images")}
        results.add(TITLES[scene], (images.name, figures(measures, reference)))
        return measures

    street = args.work / "street"
    street.mkdir(exist_ok=True)
    if import_published_images(street):
        data = pathlib.Path(os.environ["VCHARGE_DATA"])
        real["lot"] = measure("lot", read_drive("real street", street / "drive.bag", street / "rig.yaml", "/odom"), {})
        workshop = measure("garage", ImageSet("real workshop", *workshop_images(data / "chessboard_vcharge")), {})
        real["garage"] = {name: value if "matched" not in name else real["lot"][name] for name, value in workshop.items()}
        measure("lot", ImageSet("real parking lot", *parking_lot_images(data / "surround_avm")), {})
    for scene, seed in args.drives:
        folder = args.work / f"{scene}_{seed}"
        seeds = [word for option in ("--scene-seed", "--seed") for word in (option, seed)]
        settings = [word for setting in args.set for word in ("--set", setting)]
        simulate(folder, ["--scene", scene, "--drive", "loop", "--cameras", CAMERA, "--duration-s", args.duration_s, *seeds,
                          *settings])
        measure(scene, read_drive(f"{scene}:{seed}", folder / "drive.bag", folder / "rig_truth.yaml", "/ground_truth"), real.get(scene, {}))
    results.end()


if __name__ == "__main__":
    main()
