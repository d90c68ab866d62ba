"""Reading tables of comma-separated values with errors that name file, line and column."""
import math
import re

from vcharge.errors import InputError
from vcharge.files import parse_number, read_text


class Row:
    """One line of a table."""

    def __init__(self, where, values):
        self.where, self.values = where, values

    def fail(self, column, expected):
        raise InputError(f"{self.where}: {column}: expected {expected}, got '{self.values[column]}'")

    def text(self, column):
        return self.values[column]

    def integer(self, column, low=0, high=2 ** 63 - 1):
        if not re.fullmatch(r"-?\d+", self.values[column]) or not low <= int(self.values[column]) <= high:
            self.fail(column, f"a whole number from {low}")
        return int(self.values[column])

    def number(self, column, low=-math.inf, high=math.inf):
        value = parse_number(self.values[column])
        if value is None or not low <= value <= high:
            self.fail(column, f"a finite number from {low:g} to {high:g}")
        return value

    def number_or_nan(self, column):
        return math.nan if self.values[column].lstrip("-") == "nan" else self.number(column)


def read_table(path, header):
    """The rows of a table; `header` is its first line."""
    lines = read_text(path).split("\n")
    names = header.split(",")
    if lines[0] != header:
        raise InputError(f"{path}:1: expected the header {header}")
    if lines[-1]:
        raise InputError(f"{path}:{len(lines)}: expected an end of line, the file is truncated")
    rows = []
    for number, line in enumerate(lines[1:-1], 2):
        fields = line.split(",")
        if len(fields) != len(names):
            raise InputError(f"{path}:{number}: expected {len(names)} columns, got {len(fields)}")
        rows.append(Row(f"{path}:{number}", dict(zip(names, fields))))
    return rows
