"""A self-contained HTML page of a chain: a picture and the verdict of every stage, errors against the truth beside the
paper's figures, and times."""
import base64
import html
import math

import cv2

MAX_WIDTH_PX = 1100
STYLE = """body{font:15px/1.5 sans-serif;max-width:1150px;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid #ddd}
table{border-collapse:collapse;margin:.8em 0}td,th{border:1px solid #ccc;padding:.25em .7em;text-align:left;vertical-align:top}
img{max-width:100%;display:block;margin:.6em 0}.grey{color:#777}.bad{color:#b00020;font-weight:bold}"""


def centimetres(value):
    return f"{100 * value:.1f} cm"


def embedded(path, caption):
    if not path.exists():
        return ""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image.shape[1] > MAX_WIDTH_PX:
        image = cv2.resize(image, None, fx=MAX_WIDTH_PX / image.shape[1], fy=MAX_WIDTH_PX / image.shape[1],
                           interpolation=cv2.INTER_AREA)
    data = base64.b64encode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes()).decode()
    return f'<img alt="{html.escape(caption)}" src="data:image/jpeg;base64,{data}"><p class="grey">{html.escape(caption)}</p>'


def table(headings, rows):
    text = "<table><tr>" + "".join(f"<th>{html.escape(heading)}</th>" for heading in headings) + "</tr>"
    for row in rows:
        text += "<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>"
    return text + "</table>"


def listed(values, unit, digits):
    return ", ".join(f"{name} {value:.{digits}f}" for name, value in values.items()) + f" {unit}"


def summary_rows(figures):
    """Rows of what was measured, the figure here, and the paper's."""
    rows = []
    lenses = figures.get("intrinsics")
    if lenses and all("error_px" in camera for camera in lenses.values()):
        rows.append(("intrinsics: rms against the true lens, where pixels are used",
                     listed({name: camera["error_px"] for name, camera in lenses.items()}, "px", 2), "not given"))
    masks = figures.get("masks", {})
    if masks.get("hidden_percent") is not None:
        rows.append(("masks: of the own body hidden; of the scene lost",
                     f"{masks['hidden_percent']:.1f} %; {masks['lost_percent']:.1f} %", "drawn by hand"))
    rig = figures.get("extrinsics", {})
    if "error_m" in rig:
        rows.append(("extrinsics: error",
                     listed({name: 100 * value for name, value in rig["error_m"].items()}, "cm", 2) + "; " +
                     listed(rig["error_deg"], "degrees", 3),
                     "no truth; repeats within about 8 cm and 1 degree, as users report"))
    mapped = figures.get("map", {})
    if "position_rms_m" in mapped:
        rows.append((f"sparse map: keyframes' positions over {mapped['length_m']:.0f} m, rms; scale",
                     f"{centimetres(mapped['position_rms_m'])}; {100 * mapped['scale_error']:+.2f} %", "not given"))
    heights = figures.get("height_map", {})
    if "mean_m" in heights:
        rows.append(("height map: mean error of heights; steps aside", f"{centimetres(heights['mean_m'])}; "
                     f"{centimetres(heights['step_m'])}", "not given"))
        rows.append(("height map: tape-measure distances, mean, largest",
                     f"{centimetres(heights['tape_m'])}, {centimetres(heights['max_tape_m'])} ({heights['tapes']} of "
                     f"{heights['all_tapes']} shown by the map)", "7.1 cm, 16 cm (9 distances)"))
    ranges = figures.get("ranges", {})
    if "within_5_percent" in ranges:
        rows.append(("ranges within 5 %, by density", ", ".join(f"{density}: {100 * ratio:.1f} %" for density, ratio in
                                                               ranges["within_5_percent"].items()), "not given"))
    pose = figures.get("localization", {})
    if "median_m" in pose:
        rows.append(("pose in the map: position, median, 95 %; angle, median",
                     f"{centimetres(pose['median_m'])}, {centimetres(pose['p95_m'])}; {pose['median_deg']:.3f} degrees; "
                     f"{pose['wrong']} wrong", "not given"))
        if "normalized" in pose:
            rows.append(("the same: normalized error squared per degree of freedom (1 where the covariance is right)",
                         f"{pose['normalized']:.2f}", "no covariance"))
    obstacles = figures.get("obstacles", {})
    if "mean_m" in obstacles:
        rows.append(("obstacles of 20 cm and more within 5 m: range error, mean, 95 %",
                     f"{centimetres(obstacles['mean_m'])}, {centimetres(obstacles['p95_m'])}", "below 10 cm"))
        rows.append(("obstacles missed; false cells on open ground",
                     f"{obstacles['missed']} of {obstacles['obstacles']}; {obstacles['false_per_10_m']:.1f} per 10 m",
                     "not given"))
    for one in (one for one in obstacles.get("reports", []) if one["moves"]):
        reported = "never" if one["first_reported_m"] is None else f"{one['first_reported_m']:.1f} m"
        rows.append((f"{one['kind']} who comes as near as {one['nearest_m']:.1f} m: least distance until first reported", reported,
                     "not given"))
    nodelets = figures.get("nodelets", {})
    if nodelets:
        rows.append(("nodelets give what the offline tools give", f"{nodelets['equal_poses']} of {nodelets['poses']} poses, "
                     f"{nodelets['equal_grids']} of {nodelets['grids']} obstacle maps", ""))
    return rows


def describe_drive(rig):
    if rig["distance_m"] is None:
        return ""
    return (f"{rig['distance_m']:.0f} m, {math.degrees(rig['left_turn_rad']):.0f} degrees of turn to the left, "
            f"{math.degrees(rig['right_turn_rad']):.0f} to the right. ")


def verdict_rows(figures):
    rows = [(f"intrinsics, {name}", camera["verdict"], f"{camera['num_images']} images, {camera['rms_px']:.3f} px rms. " +
             " ".join(camera["remarks"])) for name, camera in figures.get("intrinsics", {}).items()]
    masks = figures.get("masks")
    if masks:
        remarks = [f"{camera['name']}: {remark}" for camera in masks["cameras"] or [] for remark in camera["remarks"]]
        rows.append(("masks of the own body", masks["verdict"], " ".join(remarks) or masks["error"] or ""))
    rig = figures.get("extrinsics")
    if rig:
        rows.append(("the drive to calibrate from (check_bag)", rig["check"], ""))
        rows.append(("extrinsics", rig["verdict"], describe_drive(rig) + " ".join(rig["remarks"] or [])))
    mapped = figures.get("map")
    if mapped:
        rows.append(("sparse map", mapped["verdict"], f"{mapped['num_keyframes']} keyframes, {mapped['num_landmarks']} landmarks, "
                     f"{mapped['num_loop_edges']} loop edges"))
    pose = figures.get("localization")
    if pose:
        rows.append(("pose in the map", f"{pose['localized']} of {pose['frames']} frames", ""))
    return rows


PICTURES = (
    ("Lenses", (("intrinsics.png", "How far the calibrated lens is from the true one, by the angle from its axis"),)),
    ("The own body", (("masks.png", "Mean images of the drive; red: the own body, hidden from all stages"),)),
    ("Extrinsics", (("rig.png", "Errors of the extrinsics along and about the vehicle's axes"),)),
    ("The sparse map", (("map.png", "Its landmarks from above (dots), loop edges, and the true drive (black)"),
                        ("map_landmarks.png", "Landmarks in one image: coloured by distance, larger where seen more often"))),
    ("Range maps", (("input_frames.png", "What the cameras see on another day"),
                    ("range_maps.png", "Range along each pixel's ray (red near, blue far, black unknown)"),
                    ("rviz_ranges.png", "Images, range maps and clouds in rviz"),
                    ("cloud_from_above.png", "The points of all cameras from above, blue low, red high; white: the drive; gray: the true "
                     "heights if known"))),
    ("Height map", (("height_map.png", "Heights, brightness in the images, drivable cells"),
                    ("height_map_octomap.png", "Occupied voxels of the OctoMap by height"),
                    ("rviz_height_map.png", "Mesh and drivable grid in rviz"))),
    ("The pose on another day", (("localization.png", "Errors frame by frame, and the standard deviation (sigma) that the "
                                   "tool gives"), ("rviz_pose.png", "In rviz"))),
    ("Obstacles", (("obstacles.png", "Left: what one camera reports, in its image (red: obstacles; green: free ground) and from "
                    "above (white: obstacles; gray: free ground). Right: the map of all cameras (red: occupied; green: free; dark: "
                    "unknown). White: the car. Where the truth is known: cyan stands, magenta moves, reported or not"),
                   ("rviz_obstacles.png", "Obstacle map (black: occupied; light: free) and scan (red dots) in rviz"))),
    ("The published images of the V-Charge car", (("real_height_map.png", "Height map: cobbles, kerb, hedge"),
                                                  ("real_obstacles.png", "Obstacles: kerb and hedge; the cobbles are free"))),
)


def write(path, chain):
    figures = {name: step["figures"] for name, step in chain.steps.items()}
    size = "640x400" if chain.args.quick else "1280x800"
    origin = (f"A simulated {chain.args.scene}, seed {chain.args.seed}, rig {chain.args.rig_seed}, images of {size}: "
              "only the simulator knows lenses and mounting of the cameras; truth only judges the results." if chain.simulated else
              f"The recording {chain.args.bag}; there is no truth to judge it by.")
    parts = ['<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>vcharge: the whole chain</title>',
             f"<style>{STYLE}</style></head><body><h1>From unknown cameras to a drive in its own map</h1>",
             f"<p>{html.escape(origin)}</p>"]
    rows = summary_rows(figures)
    if rows:
        parts.append("<h2>Errors against the truth</h2>" + table(("what", "here", "the paper"), rows))
    parts.append("<h2>Verdicts of the tools</h2>" + table(("step", "verdict", "why"), verdict_rows(figures)))
    for title, pictures in PICTURES:
        shown = "".join(embedded(chain.pictures / name, caption) for name, caption in pictures)
        if shown:
            parts.append(f"<h2>{html.escape(title)}</h2>{shown}")
    parts.append("<h2>Time</h2>" + table(("step", "wall time", "processor time"), [
        (step["title"], f"{step['wall_s']:.0f} s", f"{step['cpu_s']:.0f} s") for step in chain.steps.values()] + [
        ("all", f"{sum(step['wall_s'] for step in chain.steps.values()):.0f} s",
         f"{sum(step['cpu_s'] for step in chain.steps.values()):.0f} s")]))
    parts.append("</body></html>")
    temporary = path.with_suffix(".tmp")
    temporary.write_text("\n".join(parts), encoding="utf-8")
    temporary.rename(path)
