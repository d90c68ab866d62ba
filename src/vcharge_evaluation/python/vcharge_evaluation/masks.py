"""Masks of the car's own body: pixels of the body that are hidden, and pixels of the scene that are lost."""
import argparse

import cv2
import numpy as np
import yaml

import vcharge
from vcharge_evaluation.drives import MASK_SCALE, MASK_SEEDS, FoundMasks, loop_drive
from vcharge_evaluation.results import Figure, Results, add_arguments, figure, percent
from vcharge_evaluation.tools import run_tool, simulate

# The body has glossy paint of random brightness, mirror housings and soft edges.
GLOSSY, NO_BODY = ["--set", "body=glossy"], ["--set", "body=none"]
EIGHT = ["--drive", "figure_eight"]
DRIVES = {
    "lot": ["--scene", "lot", *EIGHT, "--rig", "golf", *GLOSSY],
    "lot_random_rig": ["--scene", "lot", *EIGHT, "--rig", "random", *GLOSSY],
    "lot_recessed_rig": ["--scene", "lot", "--drive", "loop", "--rig", "recessed", *GLOSSY],
    "garage_random_rig": ["--scene", "garage", *EIGHT, "--rig", "random", *GLOSSY],
    "two_levels_random_rig": ["--scene", "two_levels", "--drive", "loop", "--rig", "random", *GLOSSY],
    "lot_without_body": ["--scene", "lot", *EIGHT, "--rig", "random", *NO_BODY],
}
COMMON = ["--image-scale", 0.5, "--image-step", 8, "--duration-s", 40]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    add_arguments(parser, "mask_evaluation")
    parser.add_argument("--seed", type=int, default=205,
                        help="of scene, rig and drive; those below 50 serve to choose options")
    parser.add_argument("--drives", nargs="*", default=list(DRIVES), choices=DRIVES)
    parser.add_argument("--loops", nargs="*", default=[], metavar="SCENE:SEED",
                        help=f"loops of {', '.join(MASK_SEEDS)}, whose masks the other stages use")
    return parser.parse_args()


def field_of_view(camera):
    """True for the pixels inside the field of view."""
    width, height = camera.image_size_px
    angle, turn = 0.5 * camera.field_of_view_rad, np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    rim = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.full(turn.shape, np.cos(angle))], 1)
    inside = np.zeros((height, width), np.uint8)
    cv2.fillPoly(inside, [np.rint(camera.project(rim)).astype(np.int32)], 1)
    return inside > 0


def hidden_pixels(camera):
    """True where a camera is masked."""
    return np.zeros(camera.image_size_px[::-1], bool) if camera.mask is None else camera.mask == 0


class Pixels:
    """Counts of a camera's or a rig's pixels inside the field of view."""

    def __init__(self, body=0, hidden=0, scene=0, lost=0):
        self.body, self.hidden, self.scene, self.lost = body, hidden, scene, lost

    def __add__(self, other):
        return Pixels(self.body + other.body, self.hidden + other.hidden, self.scene + other.scene,
                      self.lost + other.lost)

    def hidden_percent(self):
        return percent(self.hidden, self.body) if self.body else None

    def lost_percent(self):
        return percent(self.lost, self.scene)


def compare(truth, found):
    """Pixels by camera name, inside the fields of view of both rigs. A missing rig or mask hides nothing."""
    pixels = {}
    for camera in truth:
        inside, body, hidden = field_of_view(camera), hidden_pixels(camera), False
        if found:
            inside &= field_of_view(found[camera.name])
            hidden = hidden_pixels(found[camera.name])
        pixels[camera.name] = Pixels(*(int(np.count_nonzero(inside & part)) for part in
                                (body, body & hidden, ~body, ~body & hidden)))
    return pixels


def make_masks(args, name):
    """Verdict of make_masks on a drive, and its pixels by camera. The rig that it gets has neither extrinsics nor masks."""
    folder = args.work / f"{name}_seed{args.seed}"
    seeds = [word for option in ("--scene-seed", "--rig-seed", "--seed") for word in (option, args.seed)]
    simulate(folder, [*DRIVES[name], *seeds, *COMMON])
    truth = yaml.safe_load((folder / "rig_truth.yaml").read_text())
    cameras = {key: {field: value for field, value in camera.items() if field not in ("mask", "vehicle_from_camera")}
               for key, camera in truth["cameras"].items()}
    (folder / "cameras.yaml").write_text(yaml.safe_dump({**truth, "cameras": cameras}, sort_keys=False))
    output = folder / "masked" / "cameras.yaml"
    result = run_tool("make_masks", folder / "make_masks.log", "--bag", folder / "drive.bag", "--rig",
                      folder / "cameras.yaml", "--output", output, "--report", folder / "report", may_fail=True)
    found = None if result.error() else vcharge.read_rig(output)
    return result, compare(vcharge.read_rig(folder / "rig_truth.yaml"), found), folder


def draw_worst(folder, output, pixels):
    """A camera's image with the found mask red and the outline of the true one yellow, for the camera that shows most of its body."""
    name = min(pixels, key=lambda one: pixels[one].hidden_percent() if pixels[one].body else 100.0)
    truth = vcharge.read_rig(folder / "rig_truth.yaml")[name]
    _, _, image = next(vcharge.read_images(folder / "drive.bag", [name]))
    picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if output.exists():
        hidden = hidden_pixels(vcharge.read_rig(output)[name])
        picture[hidden] = (0.5 * picture[hidden] + 0.5 * np.array([0, 0, 255])).astype(np.uint8)
    outlines, _ = cv2.findContours(hidden_pixels(truth).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(picture, outlines, -1, (0, 255, 255), 1)
    return picture, name


def show(results, folder, output, pixels, condition):
    """The picture of a drive, if its masks are the worst so far."""
    total = sum(pixels.values(), Pixels())
    badness = (100.0 - total.hidden_percent() if total.body else 0.0) + total.lost_percent()
    picture, camera = draw_worst(folder, output, pixels)
    results.show(picture, f"{condition}, camera {camera}: {100 - (pixels[camera].hidden_percent() or 100.0):.1f} % of its own body is "
                 "not hidden. Found mask red, outline of the true one yellow", badness)


def evaluate_loop(args, loop, results):
    scene, seed = loop.split(":")
    drive = loop_drive(args.work, scene, int(seed), MASK_SCALE)
    masks = FoundMasks(drive)
    output = drive.folder / "masked" / "cameras.yaml"
    pixels = compare(vcharge.read_rig(drive.true_rig), vcharge.read_rig(masks.rig) if masks.rig else None)
    results.add("Masks that the other stages use, from a loop of 24 s", (f"{scene}, seed {seed}", figures(masks.run, pixels)))
    show(results, drive.folder, output, pixels, f"{scene}, seed {seed}")


def figures(result, pixels):
    total = sum(pixels.values(), Pixels())
    entries = [Figure("verdict", result.found.get("verdict", result.error()))]
    if total.body:
        worst = min((name for name in pixels if pixels[name].body), key=lambda name: pixels[name].hidden_percent())
        entries += [figure("body hidden", total.hidden_percent(), "%", at_least=97.0),
                    Figure("body hidden, worst camera", f"{pixels[worst].hidden_percent():.1f} % ({worst})")]
    most = max(pixels, key=lambda name: pixels[name].lost_percent())
    entries += [figure("scene lost", total.lost_percent(), "%", at_most=2.0 if total.body else 0.0),
                Figure("scene lost, worst camera", f"{pixels[most].lost_percent():.2f} % ({most})"),
                Figure("processor time", result.cpu_s, "s")]
    return entries


def main():
    args = arguments()
    args.work.mkdir(parents=True, exist_ok=True)
    results = Results("masks", "Masks of the own body", args)
    for name in args.drives:
        result, pixels, folder = make_masks(args, name)
        results.add("Masks from a drive of 40 s", (f"{name}, seed {args.seed}", figures(result, pixels)))
        show(results, folder, folder / "masked" / "cameras.yaml", pixels, f"{name}, seed {args.seed}")
    for loop in args.loops:
        evaluate_loop(args, loop, results)
    results.end()


if __name__ == "__main__":
    main()
