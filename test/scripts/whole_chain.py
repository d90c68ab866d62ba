"""The offline tools in order on one short drive, for tests of all of them."""
import hashlib

from drive_fixture import Drive, tool

CAMERAS = ("front", "left", "rear", "right")
OBSTACLE_RANGES = "preset: fast\ncameras: [front, left, right]\nworking_camera: {image_scale: 1.0}\n"
HEIGHTS = "fusion: {cell_size_m: 0.1}\nrange_maps: {working_camera: {image_scale: 1.0}}\n"


class WholeChain:
    """A drive with images of a quarter of the size, and the arguments of each tool."""

    def __init__(self, duration_s=4.0, image_step=2):
        self.drive = Drive(drive="figure_eight", duration_s=duration_s, cameras=CAMERAS, extra=("--image-step", image_step),
                           image_scale=0.25)
        self.folder = self.drive.folder
        self.ranges = self.drive.write_text("ranges.yaml", OBSTACLE_RANGES)

    def words(self, name, output, source, live=()):
        """Command of a tool that writes below `output` and reads earlier results below `source`; `live`: what range maps need
        to be computed as by the nodelet."""
        given = ["--bag", self.drive.bag, "--rig", self.drive.rig]
        heights = self.drive.write_text("heights.yaml", HEIGHTS)
        return {
            "build_map": [tool("vcharge_mapping", "build_map"), *given, "--output", output / "lot.vmap", "--trajectory",
                          output / "lot.tum"],
            "localize_drive": [tool("vcharge_localization", "localize_drive"), *given, "--map", source / "lot.vmap",
                               "--output", output / "poses.tum"],
            "compute_range_maps": [tool("vcharge_dense", "compute_range_maps"), *given, *live, "--options", self.ranges, "--output",
                                   output / "range", "--no-pictures"],
            "build_height_map": [tool("vcharge_dense", "build_height_map"), *given, "--trajectory", source / "lot.tum",
                                 "--options", heights, "--output", output / "heights"],
            "detect_obstacles": [tool("vcharge_obstacles", "detect_obstacles"), *given, "--range-options", self.ranges,
                                 "--output", output / "obstacles"],
        }[name]

    TOOLS = ("build_map", "localize_drive", "compute_range_maps", "build_height_map", "detect_obstacles")

    def remove(self):
        self.drive.remove()


def digest(path):
    """Hash of a file, or of a folder's names and files; None if it does not exist."""
    if not path.exists():
        return None
    hasher = hashlib.sha1()
    for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
        if file.is_file():
            hasher.update(str(file.relative_to(path)).encode())
            hasher.update(without_times(file))
    return hasher.hexdigest()


def without_times(file):
    """Content without a localization log's last column, the time of each frame."""
    data = file.read_bytes()
    if file.suffix != ".csv" or b"latency_s" not in data.split(b"\n", 1)[0]:
        return data
    return b"\n".join(line.rpartition(b",")[0] for line in data.split(b"\n"))
