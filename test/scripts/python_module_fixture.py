"""What the tests of the module vcharge share."""
import pathlib
import shutil
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "vcharge_python" / "python"))
import vcharge  # noqa: E402


class FolderTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vcharge_tests_"))
        self.addCleanup(shutil.rmtree, self.folder)

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def refuses(self, words, read, *args):
        """The reader raises InputError with these words."""
        with self.assertRaises(vcharge.InputError) as caught:
            read(*args)
        for word in words if isinstance(words, tuple) else (words,):
            self.assertIn(word, str(caught.exception))
