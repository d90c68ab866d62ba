"""Figures of the chain's steps: what the tools say of themselves, and errors against a simulated drive's truth."""
import json
import math
import re

import cv2
import matplotlib
import numpy as np
import yaml

from camera_models import project
from localization_errors import LocalizationErrors, Map
from tool_runs import TOOLS, run

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402

MASK_MARGIN_PX = 4


def first(pattern, text, default=""):
    found = re.search(pattern, text, re.MULTILINE)
    return found.group(1) if found else default


def verdict_of(output):
    """PASS, WARN or FAIL, and the remarks below it."""
    lines = output.splitlines()
    at = next((i for i, line in enumerate(lines) if line in ("PASS", "WARN", "FAIL")), None)
    return ("none", []) if at is None else (lines[at], [line.strip() for line in lines[at + 1:] if line.startswith("  ")])


def json_of(path):
    return json.loads(path.read_text())


# Lenses.

def intrinsics_figures(output):
    verdict, remarks = verdict_of(output)
    return {"verdict": verdict, "remarks": remarks, "views": int(first(r"^(\d+) images used", output, "0")),
            "rms_px": float(first(r"error (\S+) px RMS", output, "nan"))}


def lens_error(estimate, truth):
    """Angle from the axis (degrees) and distance (px) between the pixels of the same rays in two cameras, in the true image
    alone; the turn between the two that fits best is no error: extrinsics take it up."""
    tilt, around = np.meshgrid(np.radians(np.arange(2.0, 92.5, 1.0)), np.radians(np.arange(0.0, 360.0, 5.0)))
    tilt, around = tilt.ravel(), around.ravel()
    rays = np.stack([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)], 1)
    wanted = project(rays, truth)
    inside = ((wanted >= 0) & (wanted < truth["image_size_px"])).all(1)
    tilt, rays, wanted = tilt[inside], rays[inside], wanted[inside]

    def turned(angles):
        return project(rays @ cv2.Rodrigues(np.array(angles, float))[0].T, estimate)

    turn = np.zeros(3)
    for _ in range(5):
        residual = (turned(turn) - wanted).ravel()
        jacobian = np.stack([(turned(turn + step) - turned(turn)).ravel() / 1e-6 for step in 1e-6 * np.eye(3)], 1)
        turn -= np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    return np.degrees(tilt), np.linalg.norm(turned(turn) - wanted, axis=1)


def judge_intrinsics(path, truths, figures, picture):
    estimate = yaml.safe_load(path.read_text())["cameras"]
    figure, axes = plt.subplots(figsize=(7, 3.2))
    for camera, truth in truths.items():
        true_camera = yaml.safe_load(truth.read_text())["cameras"][camera]
        tilt, error = lens_error(estimate[camera], true_camera)
        bins = np.arange(0, 96, 5)
        # Beyond the field of view that the calibration states no pixel is used.
        known = tilt <= math.degrees(estimate[camera]["field_of_view_rad"]) / 2
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


def copy_mask(source, target, margin):
    mask = cv2.imread(str(source), cv2.IMREAD_GRAYSCALE)
    if margin:
        size = 2 * MASK_MARGIN_PX + 1
        mask = cv2.erode(mask, np.ones((size, size), np.uint8))
    cv2.imwrite(str(target), mask)


# The cameras' places.

def rig_figures(output, checked):
    verdict, remarks = verdict_of(output)
    return {"verdict": verdict, "remarks": remarks, "drive": first(r"^(.* m, .* turn .*?);", output),
            "check": first(r"^verdict: (\S+)", checked)}


def judge_rig(path, truth, figures, folder, picture):
    report = folder / "rig_errors.json"
    run([TOOLS / "vcharge_evaluation" / "evaluate_rig", "--estimate", path, "--truth", truth, "--json", report],
        folder / "evaluate.log")
    errors = json_of(report)["as_is"]
    figures["error_m"] = {camera["camera"]: float(np.linalg.norm(camera["error_m"])) for camera in errors}
    figures["error_deg"] = {camera["camera"]: math.degrees(np.linalg.norm(camera["error_rad"])) for camera in errors}
    figure, (places, turns) = plt.subplots(1, 2, figsize=(9, 3))
    for i, axis in enumerate(("forwards", "left", "up")):
        places.bar(np.arange(len(errors)) + 0.25 * (i - 1), [100 * camera["error_m"][i] for camera in errors], 0.22, label=axis)
    for i, axis in enumerate(("roll", "pitch", "yaw")):
        turns.bar(np.arange(len(errors)) + 0.25 * (i - 1), [math.degrees(camera["error_rad"][i]) for camera in errors], 0.22,
                  label=axis)
    for axes, unit in ((places, "cm"), (turns, "degrees")):
        axes.set_xticks(range(len(errors)), [camera["camera"] for camera in errors])
        axes.set_ylabel(f"error ({unit})")
        axes.axhline(0, color="0.5", linewidth=0.8)
        axes.legend(fontsize=8)
    save(figure, picture)


# Maps.

def map_figures(output):
    return {"verdict": first(r"^verdict: (\S+)", output), "keyframes": int(first(r"keyframes: (\d+)", output, "0")),
            "landmarks": int(first(r"landmarks: (\d+)", output, "0")), "loops": int(first(r"loop edges: (\d+)", output, "0")),
            "hash": first(r"^content hash: (\S+)", output)}


def judge_map(path, truth, figures, report, picture):
    run([TOOLS / "vcharge_evaluation" / "evaluate_map", "--map", path, "--truth", truth / "trajectory.tum", "--report", report],
        report / "evaluate.log")
    errors = json_of(report / "map_errors.json")
    figures["position_rms_m"] = errors["position_m"]["root_mean_square"]
    figures["scale_error"] = errors["scale_error"]
    figures["wrong_loops"] = errors["num_wrong"]
    figures["length_m"] = errors["truth_length_m"]
    drawn = report / "map_errors_top_view.png"
    if drawn.exists():
        picture.write_bytes(drawn.read_bytes())


def height_map_figures(result):
    return {"grid": first(r"^grid: (.*?) in the frame", result["output"]),
            "hash": first(r"^content hash: (\S+)", result["output"]),
            "range_maps": int(first(r"^range maps: (\d+)", result["output"], "0")),
            "peak_gb": result["peak_gb"]}


def judge_height_map(output, truth, rig, poses, figures, folder):
    run([TOOLS / "vcharge_evaluation" / "evaluate_height_map", "--map", output, "--truth", truth, "--rig", rig, "--trajectory",
         poses, "--report", folder / "report"], folder / "evaluate.log")
    errors = json_of(folder / "report" / "height_map_errors.json")
    figures.update({"mean_m": errors["height_m"]["mean"], "within_10_cm": errors["share_within_10_cm"],
                    "step_m": errors["step_position_m"]["mean"], "tape_m": errors["mean_measurement_m"],
                    "max_tape_m": errors["max_measurement_m"],
                    "tapes": len(errors["measurements"]) - errors["num_measurements_missing"],
                    "all_tapes": len(errors["measurements"])})


# Another day.

def judge_ranges(output, truth, bag, rig, folder):
    result = run([TOOLS / "vcharge_evaluation" / "evaluate_range", "--range", output, "--truth", truth, "--bag", bag,
                  "--rig", rig, "--report", folder / "report"], folder / "evaluate.log")
    (folder / "errors.txt").write_text(result["output"])
    errors = json_of(folder / "report" / "range_errors.json")
    whole = next((part for part in errors["sets"] if part["label"] == "all cameras"), errors["sets"][0])
    return {"within_5_percent": {f"{100 * row['density']:.0f} %": row["share_within_tolerance"] for row in whole["accuracy"]}}


def localization_figures(result, csv, map_path, truths, picture):
    figures = {"hash": first(r"^content hash: (\S+)", result["output"]),
               "frames": int(first(r"^frames: (\d+)", result["output"])),
               "localized": int(first(r"^  localized: (\d+)", result["output"], "0"))}
    if truths is None:
        return figures
    mapping, other = truths
    errors = LocalizationErrors(csv, other / "trajectory.tum", Map(map_path, mapping / "trajectory.tum"))
    good = errors.localized()
    if good.any():
        figures.update({"median_m": float(np.median(errors.error_m[good])),
                        "p95_m": float(np.percentile(errors.error_m[good], 95)),
                        "median_deg": float(np.median(errors.error_deg[good])),
                        "p95_deg": float(np.percentile(errors.error_deg[good], 95)), "wrong": errors.num_false(),
                        "absolute_median_m": float(np.median(errors.absolute_m[good])),
                        "normalized": float(np.mean(errors.normalized[good]))})
        errors.plot(picture)
    return figures


def obstacle_figures(output):
    return {"maps": int(first(r"^obstacle maps: (\d+)", output, "0")), "hash": first(r"^content hash: (\S+)", output),
            "cpu_ms_per_range_map": float(first(r"processor time per range map: (\S+) ms", output, "nan"))}


def judge_obstacles(output, truth, figures, folder):
    result = run([TOOLS / "vcharge_evaluation" / "evaluate_obstacles", "--obstacles", output, "--truth", truth, "--report",
                  folder / "report"], folder / "evaluate.log")
    (folder / "errors.txt").write_text(result["output"])
    errors = json_of(folder / "report" / "obstacle_errors.json")
    fused = next(scan for scan in errors["scans"] if scan["name"] == "fused")["aside"]
    judged = errors["map"]["obstacles"]
    figures.update({"mean_m": fused["error_m"]["mean"], "p95_m": fused["error_m"]["percentile_95"],
                    "obstacles": len(judged), "missed": sum(not obstacle["reported"] for obstacle in judged),
                    "false_per_10_m": errors["map"]["false_cells_per_10_m"], "free_inside": errors["map"]["free_inside"],
                    "observed_inside": errors["map"]["observed_inside"]})
