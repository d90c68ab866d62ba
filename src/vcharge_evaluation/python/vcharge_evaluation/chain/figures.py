"""Figures of the chain's steps: what the tools found, and errors against the truth of a simulated drive."""
import math

import cv2
import matplotlib
import numpy as np
import yaml

import vcharge
from vcharge_evaluation import masks, obstacles, tools
from vcharge_evaluation.drawing.obstacles import FRONT_M
from vcharge_evaluation.drawing.pictures import label
from vcharge_evaluation.localization_errors import BOUND_DEG, BOUND_M, LocalizationErrors, Map
from vcharge_evaluation.poses import at_stamps, rotations

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402


def pick(result, *keys):
    """Some of the keys that a tool wrote with --json; None for those that it did not write."""
    return {key: result.found.get(key) for key in keys}


def lens_error(estimate, truth):
    """Angles from the axis (degrees) and distances (px) between the pixels of the same rays in two cameras, within the true
    image, after the rotation between the two that fits best: extrinsics absorb this rotation. Infinite for rays without a pixel in
    the estimated camera."""
    tilt, around = np.meshgrid(np.radians(np.arange(2.0, 92.5, 1.0)), np.radians(np.arange(0.0, 360.0, 5.0)))
    tilt, around = tilt.ravel(), around.ravel()
    rays = np.stack([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)], 1)
    wanted = truth.project(rays)
    inside = ((wanted >= 0) & (wanted < truth.image_size_px)).all(1)
    tilt, rays, wanted = tilt[inside], rays[inside], wanted[inside]

    def turned(angles):
        return estimate.project(rays @ cv2.Rodrigues(np.array(angles, float))[0].T)

    turn = np.zeros(3)
    for _ in range(5):
        residual = (turned(turn) - wanted).ravel()
        jacobian = np.stack([(turned(turn + step) - turned(turn)).ravel() / 1e-6 for step in 1e-6 * np.eye(3)], 1)
        known = np.isfinite(jacobian).all(1) & np.isfinite(residual)
        turn -= np.linalg.lstsq(jacobian[known], residual[known], rcond=None)[0]
    return np.degrees(tilt), np.nan_to_num(np.linalg.norm(turned(turn) - wanted, axis=1), nan=np.inf)


def judge_intrinsics(path, truths, figures, picture):
    estimate = vcharge.read_rig(path)
    figure, axes = plt.subplots(figsize=(7, 3.2))
    for camera, truth in truths.items():
        tilt, error = lens_error(estimate[camera], vcharge.read_rig(truth)[camera])
        bins = np.arange(0, 96, 5)
        # No pixel beyond the calibrated field of view is used.
        known = tilt <= math.degrees(estimate[camera].field_of_view_rad) / 2
        figures[camera]["error_px"] = float(np.sqrt(np.mean(error[known] ** 2)))
        figures[camera]["max_error_px"] = float(error[known].max())
        which = np.digitize(tilt, bins)
        shown = [i for i in range(1, len(bins)) if (known & (which == i)).any()]
        axes.plot([bins[i] - 2.5 for i in shown], [error[known & (which == i)].mean() for i in shown], ".-", label=camera)
    axes.set_xlabel("angle from the axis (degrees)")
    axes.set_ylabel("error against the true lens (px)")
    axes.legend()
    save(figure, picture)


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_masks(report, picture):
    """The mean images of all cameras with the found body, from the pictures of make_masks."""
    drawn = {path.stem: cv2.imread(str(path)) for path in sorted(report.glob("*.png"))}
    if drawn:
        means = [label(cv2.resize(image[:, :image.shape[1] // 3], (640, 400), interpolation=cv2.INTER_AREA), name)
                 for name, image in drawn.items()]
        means += [np.zeros_like(means[0])] * (len(means) % 2)
        cv2.imwrite(str(picture), np.vstack([np.hstack(means[i:i + 2]) for i in range(0, len(means), 2)]))


def judge_masks(path, truth, figures):
    cameras = masks.compare(vcharge.read_rig(truth), vcharge.read_rig(path))
    total = sum(cameras.values(), masks.Pixels())
    figures.update({"hidden_percent": total.hidden_percent(), "lost_percent": total.lost_percent()})


def judge_rig(path, truth, figures, folder, picture):
    errors = tools.judge_rig(path, truth, folder / "rig_errors.json")["as_is"]
    figures["error_m"] = {camera["camera"]: float(np.linalg.norm(camera["error_m"])) for camera in errors}
    figures["error_deg"] = {camera["camera"]: math.degrees(np.linalg.norm(camera["error_rad"])) for camera in errors}
    figure, (translations, turns) = plt.subplots(1, 2, figsize=(9, 3))
    for i, axis in enumerate(("forwards", "left", "up")):
        translations.bar(np.arange(len(errors)) + 0.25 * (i - 1), [100 * camera["error_m"][i] for camera in errors], 0.22, label=axis)
    for i, axis in enumerate(("roll", "pitch", "yaw")):
        turns.bar(np.arange(len(errors)) + 0.25 * (i - 1), [math.degrees(camera["error_rad"][i]) for camera in errors], 0.22,
                  label=axis)
    for axes, unit in ((translations, "cm"), (turns, "degrees")):
        axes.set_xticks(range(len(errors)), [camera["camera"] for camera in errors])
        axes.set_ylabel(f"error ({unit})")
        axes.axhline(0, color="0.5", linewidth=0.8)
        axes.legend(fontsize=8)
    save(figure, picture)


def judge_map(path, truth, figures, report, picture):
    errors = tools.judge("map", report, "--map", path, "--truth", truth / "trajectory.tum")
    figures["position_rms_m"] = errors["position_m"]["root_mean_square"]
    figures["scale_error"] = errors["scale_error"]
    figures["wrong_loops"] = errors["num_wrong"]
    figures["length_m"] = errors["truth_length_m"]
    drawn = report / "map_errors_top_view.png"
    if drawn.exists():
        picture.write_bytes(drawn.read_bytes())


def judge_height_map(output, truth, rig, poses, figures, folder):
    errors = tools.judge("height_map", folder / "report", "--map", output, "--truth", truth, "--rig", rig, "--trajectory",
                         poses)
    figures.update({"mean_m": errors["height_m"]["mean"], "within_10_cm": errors["fraction_within_10_cm"],
                    "step_m": errors["step_position_m"]["mean"], "tape_m": errors["mean_measurement_m"],
                    "max_tape_m": errors["max_measurement_m"],
                    "tapes": len(errors["measurements"]) - errors["num_measurements_missing"],
                    "all_tapes": len(errors["measurements"])})


def judge_ranges(output, truth, bag, rig, folder):
    errors = tools.judge("range", folder / "report", "--range", output, "--truth", truth, "--bag", bag, "--rig", rig)
    whole = next((part for part in errors["sets"] if part["label"] == "all cameras"), errors["sets"][0])
    return {"within_5_percent": {f"{100 * row['density']:.0f} %": row["fraction_within_tolerance"] for row in whole["accuracy"]}}


def localization_figures(result, csv, map_path, truths, picture):
    figures = {"content_hash": result.found["content_hash"], "frames": result.found["num_frames"],
               "localized": result.found["num_frames_by_status"].get("localized", 0)}
    if truths is None:
        return figures
    mapping, other = truths
    errors = LocalizationErrors(csv, other / "trajectory.tum", Map(map_path, mapping / "trajectory.tum"))
    good = errors.localized()
    if good.any():
        figures.update({"median_m": errors.quantile(errors.error_m, 50, BOUND_M),
                        "p95_m": errors.quantile(errors.error_m, 95, BOUND_M),
                        "median_deg": errors.quantile(errors.error_deg, 50, BOUND_DEG),
                        "p95_deg": errors.quantile(errors.error_deg, 95, BOUND_DEG), "wrong": errors.num_false(),
                        "absolute_median_m": errors.quantile(errors.absolute_m, 50, BOUND_M),
                        "normalized": float(np.mean(errors.normalized[good]))})
        errors.plot(picture)
    return figures


def crossing_stamp(truth):
    """When a moving object is nearest to a point 4 m before the car's front, in ns."""
    images = yaml.safe_load((truth / "movers.yaml").read_text())["images"]
    poses = at_stamps(truth / "trajectory.tum", np.array([image["stamp_ns"] * 1e-9 for image in images]))
    ahead = poses[:, 1:4] + (FRONT_M + 4.0) * rotations(poses[:, 4:])[:, :, 0]
    distances = [min((np.linalg.norm(np.array(mover["translation_m"]) - point) for mover in image["movers"]), default=np.inf)
                 for image, point in zip(images, ahead)]
    return images[int(np.argmin(distances))]["stamp_ns"]


def judge_obstacles(output, truth, figures, folder):
    figures.update(obstacles.summary(tools.judge("obstacles", folder / "report", "--obstacles", output, "--truth", truth)))
