"""The error of bad input."""


class InputError(ValueError):
    """A file that cannot be read as what it should be. The text names the file, the key or line, and what was expected."""
