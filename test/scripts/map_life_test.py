#!/usr/bin/env python3
"""Maps of several drives: merged, updated, compared, summarized; bad input, other writers, kills and a full disk lose nothing.
$VCHARGE_KILLS: kills per tool (2)."""
import fcntl
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import unittest

import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from drive_fixture import Drive, files_below, run, run_tool, tool  # noqa: E402

CAMERAS = ("front", "left", "rear", "right")
KILLS = int(os.environ.get("VCHARGE_KILLS", "2"))


def mapping(name):
    return tool("vcharge_mapping", name)


class MapLifeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.days = []
        for day, scene, duration_s in ((0, "lot", 16), (1, "lot", 16), (2, "lot", 16), (0, "garage", 4)):
            drive = Drive(drive="loop", duration_s=duration_s, cameras=CAMERAS, image_scale=0.25,
                          extra=("--scene", scene, "--image-step", 2, "--day", day, "--seed", day + 1))
            status, _, errors = run_tool([mapping("build_map"), "--bag", drive.bag, "--rig", drive.rig, "--output",
                                          drive.folder / "day.vmap"])
            if status != 0:
                raise RuntimeError(f"build_map failed: {errors}")
            cls.days.append(drive)
        *cls.maps, cls.garage = [drive.folder / "day.vmap" for drive in cls.days]
        cls.folder = cls.days[0].folder / "work"
        cls.folder.mkdir()

    @classmethod
    def tearDownClass(cls):
        for drive in cls.days:
            drive.remove()

    def merge(self, output, *sessions, extra=(), prefix=()):
        words = [word for session in sessions for word in ("--session", session)]
        return run_tool([*prefix, mapping("merge_maps"), "--map", self.maps[0], *words, "--output", output, *extra])

    def living(self, name):
        path = self.folder / name
        shutil.copy(self.maps[0], path)
        return path

    def digests(self):
        return {name: hashlib.sha256((self.folder / name).read_bytes()).hexdigest() for name in files_below(self.folder)}

    def assert_refused(self, words, *expected):
        """One line that holds the words; no file is changed or written, and what killed writers left is gone."""
        before = {name: digest for name, digest in self.digests().items() if not name.startswith(".")}
        status, _, errors = run(words)
        self.assertEqual((status, len(errors)), (1, 1), errors)
        for word in expected:
            self.assertIn(str(word), errors[0])
        self.assertEqual(self.digests(), before)

    def test_days_are_joined_with_a_history(self):
        output = self.folder / "joined.vmap"
        status, found, errors = self.merge(output, self.maps[1], self.maps[2])
        self.assertEqual((status, errors), (0, []))
        self.assertEqual([session["joined"] for session in found["sessions"]], [True, True])
        self.assertEqual(found["num_sessions"], 3)
        _, log, _ = run_tool([mapping("map_log"), "--map", output])
        self.assertEqual([version["number"] for version in log["versions"]], [1, 2, 3])
        self.assertEqual(log["versions"][1]["change"], "joined day.vmap")
        self.assertEqual(log["versions"][2]["content_hash"], found["content_hash"])
        _, difference, _ = run_tool([mapping("map_diff"), "--map", output, "--output", self.folder / "changes.csv"])
        self.assertEqual(difference["new_sessions"], ["drive.bag"])
        self.assertGreater(difference["num_appeared"], 100)
        self.assertTrue((self.folder / "changes.csv").read_text().startswith("change,id,x_m"))
        status, log, errors = run_tool([mapping("map_log"), "--map", output, "--back-to", 1])
        self.assertEqual((status, errors), (0, []))
        self.assertEqual(log["versions"][-1]["content_hash"], log["versions"][0]["content_hash"])
        _, one_core, _ = self.merge(self.folder / "one_core.vmap", self.maps[1], prefix=("taskset", "-c", "0"))
        self.assertEqual(one_core["content_hash"], log["versions"][1]["content_hash"])

    def test_an_updated_map_keeps_its_size(self):
        path = self.living("updated.vmap")
        for session in self.maps[1:]:
            status, found, errors = run_tool([mapping("update_map"), "--map", path, "--session", session])
            self.assertEqual((status, errors), (0, []))
        self.assertEqual(found["num_sessions"], 2)
        self.assertGreater(found["num_removed_keyframes"], 0)
        self.assertGreater(found["num_seen_landmarks"], 100)
        status, found, errors = run_tool([mapping("summarize_map"), "--map", path, "--output", self.folder / "small.vmap"])
        self.assertEqual((status, errors), (0, []))
        self.assertLess(found["num_landmarks"], found["num_landmarks_before"])

    def test_what_does_not_fit_is_refused(self):
        path = self.living("kept.vmap")
        update = [mapping("update_map"), "--map", path, "--session"]
        self.assert_refused([*update, self.maps[0]], self.maps[0], "has this drive already")
        self.assert_refused([*update, self.days[0].bag], self.days[0].bag, "no SQLite file")
        other = self.folder / "other.vmap"
        run([mapping("write_analytic_map"), "--output", other])
        self.assert_refused([*update, other], other, "another rig", "2 cameras, expected 4")
        whole = self.maps[1].read_bytes()
        cut, newer = self.folder / "cut.vmap", self.folder / "newer.vmap"
        cut.write_bytes(whole[:len(whole) // 2])
        newer.write_bytes(whole[:60] + b"\0\0\0\x09" + whole[64:])
        self.assert_refused([*update, cut], cut, "truncated")
        self.assert_refused([*update, newer], newer, "newer program")
        self.assert_refused([mapping("map_diff"), "--map", path], path, "expected two versions, holds one")
        self.assert_refused([mapping("map_log"), "--map", path, "--back-to", 7], path, "no version 7")
        merge = [mapping("merge_maps"), "--map", path, "--output", path, "--session"]
        self.assert_refused([*merge, other], other, "another rig")
        self.assert_refused([*merge, self.garage, "--require-overlap"], self.garage, "no common places")
        status, found, errors = run_tool([*merge, self.garage])
        self.assertEqual((status, errors, found["sessions"][0]["joined"]), (0, [], False))

    def test_one_writer_at_a_time(self):
        path = self.living("locked.vmap")
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            self.assert_refused([mapping("update_map"), "--map", path, "--session", self.maps[1]], path, "another process")
            status, _, _ = run_tool([mapping("map_info"), "--map", path])
            self.assertEqual(status, 0)

    def kill_and_fill_the_disk(self, path, words):
        """Runs a tool that changes the map at `path`, kills it at random moments, and lets it run out of disk."""
        words, old = [str(word) for word in words], self.maps[0].read_bytes()
        path.write_bytes(old)
        start = time.monotonic()
        status, found, errors = run_tool(words)
        took_s = time.monotonic() - start
        self.assertEqual((status, errors), (0, []))
        new, moments = found["content_hash"], random.Random(1)
        for _ in range(KILLS):
            path.write_bytes(old)
            with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                try:
                    process.wait(took_s * (1.0 - 0.5 * moments.random() ** 2))
                except subprocess.TimeoutExpired:
                    process.send_signal(signal.SIGKILL)
            if path.read_bytes() != old:
                _, info, _ = run_tool([mapping("map_info"), "--map", path])
                self.assertEqual(info["content_hash"], new)
        path.write_bytes(old)
        # A limit on the size of files fails like a full disk.
        self.assert_refused(["bash", "-c", 'trap "" XFSZ; ulimit -f 2000; exec "$@"', "bash", *words], path, "cannot be written")
        status, found, errors = run_tool(words)
        self.assertEqual((status, errors, found["content_hash"]), (0, [], new))
        self.assertEqual([name for name in files_below(self.folder) if name.startswith(f".{path.stem}.")], [])

    def test_kills_and_a_full_disk_leave_the_old_version(self):
        path = self.living("killed.vmap")
        self.kill_and_fill_the_disk(path, (mapping("update_map"), "--map", path, "--session", self.maps[1]))
        self.kill_and_fill_the_disk(path, (mapping("merge_maps"), "--map", path, "--session", self.maps[1], "--output", path))


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "map_life", MapLifeTest)
