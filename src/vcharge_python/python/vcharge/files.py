"""Reading text, YAML and images with errors that name the file."""
import math
import pathlib
import re

import cv2
import numpy as np
import yaml

from vcharge.errors import InputError

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def read_text(path) -> str:
    """The content of a file."""
    path = pathlib.Path(path)
    if path.is_dir():
        raise InputError(f"{path}: expected a file, is a folder")
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: expected text, byte {error.start} is not UTF-8") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


class TextLoader(yaml.CBaseLoader):
    """Scalars stay texts, so that what a number is does not depend on YAML 1.1; keys that are given twice are errors."""

    def construct_mapping(self, node, deep=False):
        keys = [key.value for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(None, None, f"the key {key} is given twice", node.start_mark)
        return super().construct_mapping(node, deep)


def parse_yaml(text: str, source: str) -> "Entry":
    """The root of a YAML text; `source` names it in errors."""
    try:
        return Entry(yaml.load(text, Loader=TextLoader), source, "")
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise InputError(f"{source}: line {line}: not valid YAML: {error.problem}") from error
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError(f"{source}: not valid YAML: {error}") from error


def read_yaml(path) -> "Entry":
    """The root of a YAML file."""
    return parse_yaml(read_text(path), str(path))


class Entry:
    """A node of a YAML file with its key, so that every error names both."""

    def __init__(self, node, source, key):
        self.node, self.source, self.key = node, source, key

    def fail(self, expected):
        got = "" if isinstance(self.node, (dict, list)) or self.node is None else f", got '{self.node}'"
        raise InputError(f"{self.source}: {self.key + ': ' if self.key else ''}expected {expected}{got}")

    def has(self, key):
        return isinstance(self.node, dict) and key in self.node

    def required(self, key):
        if not isinstance(self.node, dict):
            self.fail(f"a map with the key {key}")
        name = f"{self.key}.{key}" if self.key else key
        if key not in self.node:
            raise InputError(f"{self.source}: {name}: missing")
        return Entry(self.node[key], self.source, name)

    def check_keys(self, known):
        """Unknown keys are errors."""
        if not isinstance(self.node, dict):
            self.fail("a map with the keys " + ", ".join(known))
        for key in self.node:
            if key not in known:
                raise InputError(f"{self.source}: {self.key + '.' if self.key else ''}{key}: unknown key, expected one of "
                                 + ", ".join(known))

    def items(self, expected):
        """Name and entry of each item of a map that is not empty."""
        if not isinstance(self.node, dict) or not self.node or not all(isinstance(key, str) for key in self.node):
            self.fail(expected)
        return [(key, self.required(key)) for key in self.node]

    def entries(self, expected):
        """The entries of a list."""
        if not isinstance(self.node, list):
            self.fail(expected)
        return [Entry(node, self.source, f"{self.key}[{i}]") for i, node in enumerate(self.node)]

    def text(self, expected="a text"):
        if not isinstance(self.node, str) or not self.node:
            self.fail(expected)
        return self.node

    def number(self, low=-math.inf, high=math.inf, expected="a finite number"):
        value = parse_number(self.node)
        if value is None or not low <= value <= high:
            self.fail(expected)
        return value

    def integer(self, low=0, high=2 ** 63 - 1, expected="a whole number"):
        if not isinstance(self.node, str) or not re.fullmatch(r"[+-]?\d+", self.node) or not low <= int(self.node) <= high:
            self.fail(expected)
        return int(self.node)

    def numbers(self, count, expected=None):
        """An array of finite numbers."""
        expected = expected or f"a list of {count} finite numbers"
        if not isinstance(self.node, list) or len(self.node) != count:
            self.fail(expected)
        values = [parse_number(node) for node in self.node]
        if None in values:
            self.fail(expected)
        return np.array(values)

    def choice(self, names):
        if self.node not in names:
            self.fail(" or ".join([", ".join(names[:-1]), names[-1]]))
        return self.node


def parse_number(text):
    """A finite number, or None."""
    if not isinstance(text, str) or not NUMBER.fullmatch(text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def read_image(path, dtype, expected, size=None) -> np.ndarray:
    """An image of one channel (rows x columns); `size` is (width, height)."""
    path = pathlib.Path(path)
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) if path.is_file() and is_whole_png(path) else None
    if image is None or image.ndim != 2 or image.dtype != dtype or (size and image.shape[::-1] != tuple(size)):
        size_text = f" of {size[0]} x {size[1]}" if size else ""
        problem = "" if path.is_file() else ", no such file"
        raise InputError(f"{path}: expected {expected}{size_text}{problem}")
    return image


def is_whole_png(path):
    """False for a PNG file without its end, which OpenCV would read in part."""
    with open(path, "rb") as file:
        if file.read(8) != b"\x89PNG\r\n\x1a\n":
            return True
        file.seek(-min(12, file.seek(0, 2)), 2)
        return file.read() == b"\0\0\0\0IEND\xaeB`\x82"


def read_floats(path, size=None) -> np.ndarray:
    """A TIFF of 32-bit floats (rows x columns)."""
    return read_image(path, np.float32, "a TIFF of 32-bit floats", size)


def read_gray(path, size=None) -> np.ndarray:
    """An 8-bit gray image (rows x columns)."""
    return read_image(path, np.uint8, "an 8-bit gray image", size)


def require_folder(path, what) -> pathlib.Path:
    path = pathlib.Path(path)
    if not path.is_dir():
        raise InputError(f"{path}: expected a folder of {what}")
    return path


def stamps_of_files(folder) -> list[int]:
    """Stamps (ns) of the YAML files that are named by one, ascending."""
    return sorted(int(path.stem) for path in folder.glob("*.yaml") if re.fullmatch(r"\d{1,19}", path.stem))
