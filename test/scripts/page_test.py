#!/usr/bin/env python3
"""The page in three dimensions: what it is made of, bad input of make_page, and the page itself in a headless browser."""
import json
import pathlib
import sqlite3
import sys
import unittest

import cv2
import genpy
import numpy as np
import rosbag
import rostest
from sensor_msgs.msg import Image

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import counted_skips  # noqa: E402,F401
from browser_fixture import CHROMIUM, Browser  # noqa: E402
from drive_fixture import run, tool  # noqa: E402
from python_module_fixture import FolderTest, vcharge  # noqa: E402
from vcharge_page import chunks, pictures, poses, scene, surface, write  # noqa: E402

NUM_KEYFRAMES, RADIUS_M, STEP_S = 24, 20.0, 0.5  # of write_analytic_map: a circle to the left
CELL_M = 0.25


def write_map(folder, name="lot.vmap", *words):
    path = folder / name
    status, _, errors = run([tool("vcharge_mapping", "write_analytic_map"), "--output", path, *words])
    if status != 0:
        raise RuntimeError(f"write_analytic_map failed: {errors}")
    return path


def write_height_map(folder, frame="map"):
    """A slope of 1 cm per metre along x, 60 m x 60 m."""
    folder.mkdir(exist_ok=True)
    columns = np.indices((240, 240))[1]
    cv2.imwrite(str(folder / "height_map.tiff"), (0.01 * (-30 + CELL_M * columns)).astype(np.float32))
    (folder / "height_map.yaml").write_text(
        f"file: height_map.tiff\nframe: {frame}\norigin_m: [-30, -10]\ncell_size_m: {CELL_M}\nsize_cells: [240, 240]\n")
    return folder


def write_bays(path, frame="map"):
    path.write_text(f"frame: {frame}\nbays:\n  - {{id: 1, row: 0, kind: perpendicular, state: free, corners_m: [[-4, 14], "
                    "[4, 14], [4, 26], [-4, 26]], entry_sigma_m: 0.1, end_sigma_m: 0.1, confidence: 1}\n")
    return path


def write_objects(folder, stamps):
    """An adult who always stands 5 m in front of the car; the frame odom is another than map."""
    folder.mkdir(exist_ok=True)
    frames, rows = ["stamp_ns,x_m,y_m,yaw_rad,num_objects"], [vcharge.objects.OBJECTS_HEADER]
    for i, stamp in enumerate(stamps):
        yaw, x, y = 0.1 * i, 3.0 * i, -2.0
        frames.append(f"{stamp},{x},{y},{yaw},1")
        at = [x + 5 * np.cos(yaw), y + 5 * np.sin(yaw)]
        corners = ";".join(f"{at[0] + dx:.6f} {at[1] + dy:.6f}" for dx, dy in ((-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)))
        rows.append(f"{stamp},7,adult,1,1,{at[0]:.6f},{at[1]:.6f},0,0,0,1,1.8," + ",".join(["0.01"] * 10) + "," + corners)
    (folder / "objects_frames.csv").write_text("\n".join(frames) + "\n")
    (folder / "objects.csv").write_text("\n".join(rows) + "\n")
    return folder / "objects.csv"


def write_bag(path, rig, stamps):
    with rosbag.Bag(str(path), "w") as bag:
        for i, stamp in enumerate(stamps):
            for camera in rig:
                width, height = camera.image_size_px
                message = Image(height=height, width=width, step=width, encoding="mono8",
                                data=bytes([10 * i % 250]) * (width * height))
                message.header.stamp = genpy.Time.from_sec(0) + genpy.Duration(stamp // 10 ** 9, stamp % 10 ** 9)
                bag.write(f"/camera/{camera.name}/image_raw", message, genpy.Time(1 + i))
    return path


class PartsTest(FolderTest):
    def test_chunks_hold_all_points_to_the_millimetre(self):
        generator = np.random.default_rng(5)
        points = generator.normal(0, [60, 40, 2], (30000, 3))
        found = chunks.chunks_of(points, generator.random(len(points)), 2000)
        self.assertLessEqual(max(len(one.packed) for one in found), 2000)
        drawn = np.concatenate([one.points_m() for one in found])
        self.assertEqual(len(drawn), len(points))
        for axis in range(3):
            np.testing.assert_allclose(np.sort(drawn[:, axis]), np.sort(points[:, axis]), atol=0.002)

    def test_the_first_points_of_a_chunk_are_a_sample(self):
        points = np.column_stack([np.linspace(0, 100, 20000), np.zeros(20000), np.zeros(20000)])
        chunk, = chunks.chunks_of(points, np.zeros(20000))
        first = np.sort(chunk.points_m()[:1000, 0])
        # The largest difference of the distributions of 1000 uniform numbers is below 0.06 in 999 of 1000 cases (Kolmogorov).
        self.assertLess(np.abs(first / 100 - np.arange(1000) / 1000).max(), 0.06)

    def test_points_at_one_place_and_no_points_are_chunks_too(self):
        found = chunks.chunks_of(np.ones((500, 3)), np.zeros(500), 100)
        self.assertEqual(sum(len(one.packed) for one in found), 500)
        np.testing.assert_allclose(found[0].points_m(), 1.0, atol=1e-5)
        self.assertEqual(chunks.chunks_of(np.zeros((0, 3)), np.zeros(0)), [])

    def test_a_surface_has_the_heights_of_the_map(self):
        found = vcharge.read_height_map(write_height_map(self.folder / "heights"))
        given, packed, _ = surface.surface_of(found)
        heights = given["lowM"] + (packed.astype(float) + 32767) / 65534 * (given["highM"] - given["lowM"])
        x = given["originM"][0] + given["cellM"] * np.arange(given["columns"])
        np.testing.assert_allclose(heights, np.broadcast_to(0.01 * x, heights.shape), atol=1e-4)

    def test_a_large_surface_is_drawn_coarsely_and_an_unknown_one_not_at_all(self):
        heights = np.full((1500, 1100), np.nan, np.float32)
        heights[100:1400, 50:1051] = 1.5
        heights[300, 300] = np.nan
        given, packed, _ = surface.surface_of(vcharge.HeightMap("map", np.zeros(2), 0.1, heights))
        self.assertLessEqual(packed.size, surface.MAX_VERTICES)
        self.assertTrue((packed != surface.UNKNOWN).all(), "a block with known cells is known")
        self.assertAlmostEqual(given["pictureSizeM"][0], 100.1)
        self.assertIsNone(surface.surface_of(vcharge.HeightMap("map", np.zeros(2), 0.1, np.full((4, 4), np.nan, np.float32))))

    def test_stamps_within_the_tolerance_belong_to_a_keyframe(self):
        near = pictures.NearStamps([100, 200, 1000], 10)
        self.assertEqual([near.nearest(stamp) for stamp in (89, 90, 100, 106, 209, 211, 1005)],
                         [None, 100, 100, 100, 200, None, 1000])


class SceneTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.map = vcharge.read_map(write_map(self.folder))

    def test_objects_are_where_the_car_sees_them(self):
        path = write_objects(self.folder / "objects", self.map.keyframes.stamps_ns.tolist())
        found = scene.scene_of("lot", self.map, objects=vcharge.read_objects(path)).description["objects"]
        self.assertEqual(len(found), NUM_KEYFRAMES)
        for frame, pose in zip(found, self.map.keyframes.map_from_vehicle):
            np.testing.assert_allclose(np.mean(frame["objects"][0]["footprintM"], 0), (pose @ [5, 0, 0, 1])[:2], atol=0.02)

    def test_objects_of_another_drive_are_refused(self):
        path = write_objects(self.folder / "objects", [10 ** 9, 2 * 10 ** 9])
        self.refuses("expected stamps of the map's drives", scene.scene_of, "lot", self.map, None, None, vcharge.read_objects(path))

    def test_poses_between_keyframes_lie_between_them(self):
        timeline, stamps = poses.Timeline(self.map), self.map.keyframes.stamps_ns
        pose = timeline.map_from_vehicle(0, int(stamps[3] + stamps[4]) // 2)
        angle = 2 * np.pi * 3.5 / NUM_KEYFRAMES
        np.testing.assert_allclose(pose[:2, 3], [RADIUS_M * np.sin(angle), RADIUS_M * (1 - np.cos(angle))],
                                   atol=0.2)  # chord and arc
        np.testing.assert_allclose(pose[:2, 0], [np.cos(angle), np.sin(angle)], atol=1e-9)
        self.assertIsNone(timeline.session_at(0))

    def test_no_text_ends_the_page_early(self):
        text = write.page_text(scene.scene_of("</script><b>", self.map))
        self.assertNotIn("<b>", text)
        description = text.split('id="scene">')[1].split("</script>")[0]
        self.assertEqual(json.loads(description)["title"], "</script><b>")


class ToolTest(FolderTest):
    def setUp(self):
        super().setUp()
        self.map = write_map(self.folder)
        self.before = set(self.folder.iterdir())

    def make(self, *words, output="page.html"):
        return run([tool("vcharge_python", "make_page"), *words, "--output", self.folder / output])

    def fails(self, words, *arguments, output="page.html"):
        status, _, errors = self.make(*arguments, output=output)
        self.assertNotEqual(status, 0)
        self.assertIn(words, errors[-1])
        self.assertEqual(set(self.folder.iterdir()), self.before)

    def test_bad_input_is_one_line_and_nothing_is_written(self):
        heights, bays = write_height_map(self.folder / "heights", "world"), write_bays(self.folder / "bays.yaml", "world")
        other = write_objects(self.folder / "objects", [10 ** 9])
        self.before = set(self.folder.iterdir())
        given = ("--map", self.map)
        self.fails("none.vmap: no such file", "--map", self.folder / "none.vmap")
        self.fails("page.html: cannot be written", *given, output="nowhere/page.html")
        self.fails("heights: frame: expected map, got world", *given, "--height-map", heights)
        self.fails("bays.yaml: frame: expected map, got world", *given, "--bays", bays)
        self.fails("objects: expected stamps of the map's drives", *given, "--objects", other)
        self.fails("none.bag: no such file", *given, "--bag", self.folder / "none.bag")
        self.fails("--rig: expected --bag", *given, "--rig", self.folder / "rig.yaml")
        self.fails("--image-width-px", *given, "--image-width-px", 4)
        bag = write_bag(self.folder / "other.bag", vcharge.read_map(self.map).rig, [5 * 10 ** 9])
        self.before.add(bag)
        self.fails("is it the drive that was mapped?", *given, "--bag", bag)

    def test_help_names_every_argument(self):
        status, output, _ = run([tool("vcharge_python", "make_page"), "--help"])
        self.assertEqual(status, 0)
        for word in ("--map", "--height-map", "--bays", "--objects", "--bag", "--rig", "--output"):
            self.assertIn(word, output)


@unittest.skipUnless(CHROMIUM, "chromium is not installed: the page is not shown")
class BrowserTest(FolderTest):
    @classmethod
    def setUpClass(cls):
        cls.browser = Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def show(self, *words):
        """Makes a page and opens it; there must be no problem and no request."""
        path = self.folder / "page.html"
        status, _, errors = run([tool("vcharge_python", "make_page"), *words, "--output", path])
        self.assertEqual(status, 0, errors)
        self.browser.show(path)
        self.check()

    def check(self):
        self.assertEqual(self.browser.problems, [])
        self.assertEqual([url for url in self.browser.requests if not url.startswith(("data:", f"file://{self.folder}/"))], [])

    def picture(self):
        """What the page shows, BGR, once it is at rest."""
        self.browser.run("new Promise((done) => setTimeout(done, 700))")
        path = self.folder / "shown.png"
        self.browser.picture(path)
        return cv2.imread(str(path)).astype(int)

    def show_everything(self):
        found = vcharge.read_map(write_map(self.folder))
        stamps = found.keyframes.stamps_ns.tolist()
        self.show("--map", self.folder / "lot.vmap", "--height-map", write_height_map(self.folder / "heights"), "--bays",
                  write_bays(self.folder / "bays.yaml"), "--objects", write_objects(self.folder / "objects", stamps), "--bag",
                  write_bag(self.folder / "drive.bag", found.rig, stamps))
        return found

    def test_layers_are_shown_and_hidden(self):
        self.show_everything()
        names = self.browser.run("[...document.querySelectorAll('#layers input')].map((box) => box.dataset.layer)")
        self.assertEqual(names, ["landmarks", "path", "keyframes", "car", "surface", "bays", "objects"])
        self.browser.run("vchargePage.view.lookFromAbove()")
        for number, name in enumerate(names):
            before = self.picture()
            self.browser.key(str(number + 1))
            changed = np.abs(self.picture() - before).sum(2)[:, 270:] > 30
            self.assertGreater(changed.sum(), 10, name)
        self.assertFalse(self.browser.run("document.querySelectorAll('#layers input:checked').length"))
        fine = self.browser.run("[false, true].map((isAtRest) => { vchargePage.isFast = false; vchargePage.drawStill(isAtRest);"
                                " return vchargePage.surface.fine.visible; })")
        self.assertEqual(fine, [False, True], "a slow computer draws the surface coarsely while the view moves")
        dark = self.picture()[100:600, 300:850]
        self.assertLess(dark.max() - dark.min(), 20, "nothing is shown")
        self.check()

    def test_bays_have_the_color_of_their_state(self):
        self.show_everything()
        self.browser.run("for (const i of [0, 1, 2, 3, 4, 6]) vchargePage.layers.toggle(i); vchargePage.view.lookFromAbove()")
        blue, green, red = np.moveaxis(self.picture()[100:600, 300:850], 2, 0)
        self.assertGreater(((green > 40) & (green > 1.5 * red) & (green > 1.2 * blue)).sum(), 500)

    def test_the_slider_moves_the_car_and_shows_objects_and_images(self):
        found = self.show_everything()
        for index in (0, 7, 23):
            self.browser.run(f"vchargePage.bar.set({STEP_S * index})")
            place = self.browser.run("vchargePage.car.position.toArray()")
            np.testing.assert_allclose(place, found.keyframes.positions_m[index], atol=0.01)
            self.assertEqual(self.browser.run("document.getElementById('told').textContent"), "adult 7")
            shown = self.browser.run("Promise.all([...document.querySelectorAll('#pictures img')].map(async (image) => {"
                                     "await image.decode(); return [image.alt, image.naturalWidth]; }))")
            self.assertEqual(len(shown), len(found.rig))
            self.assertTrue(all(0 < width <= 200 for _, width in shown), shown)
        self.browser.run("document.getElementById('slider').focus()")
        before = self.browser.run("vchargePage.bar.time_s")
        self.browser.key("ArrowLeft")
        self.assertAlmostEqual(self.browser.run("vchargePage.bar.time_s"), before - 0.2, delta=0.03)
        self.check()

    def test_mouse_keys_and_fingers_move_the_view(self):
        self.show_everything()

        def state():
            return np.array(self.browser.run("(({heading_rad, slope_rad, distance_m, target}) => [heading_rad, slope_rad, "
                                             "distance_m, target.x, target.y])(vchargePage.view)"))

        def drag(button, buttons):
            self.browser.mouse("mousePressed", 600, 350, button=button, buttons=buttons, clickCount=1)
            self.browser.mouse("mouseMoved", 700, 380, button=button, buttons=buttons)
            self.browser.mouse("mouseReleased", 700, 380, button=button, clickCount=1)

        def fingers():
            self.browser.touch("touchStart", [(500, 300), (700, 300)])
            self.browser.touch("touchMove", [(400, 300), (800, 300)])
            self.browser.touch("touchEnd", [])
        for action, changes in ((lambda: drag("left", 1), [0, 1]), (lambda: drag("right", 2), [3, 4]), (fingers, [2]),
                                (lambda: self.browser.mouse("mouseWheel", 600, 350, deltaX=0, deltaY=200), [2]),
                                (lambda: self.browser.key("w"), [3]), (lambda: self.browser.key("q"), [0]),
                                (lambda: self.browser.key("t"), [1])):
            before = state()
            action()
            moved = np.abs(state() - before) > 1e-3
            self.assertTrue(moved[changes].all(), (changes, before, state()))
        self.check()

    def test_measures_between_clicked_points(self):
        self.show_everything()
        self.browser.run("vchargePage.layers.toggle(0); vchargePage.view.lookFromAbove()")  # the surface, without landmarks
        self.browser.key("m")

        def click(x, y):
            for kind in ("mousePressed", "mouseReleased"):
                self.browser.mouse(kind, x, y, button="left", clickCount=1)
        click(560, 300)
        click(760, 420)
        text = self.browser.run("document.getElementById('told').textContent")
        # Pixels of the view from above, whose middle is the target.
        per_pixel = self.browser.run("(({distance_m, camera}) => 2 * distance_m * Math.tan(camera.fov * Math.PI / 360) / 720)"
                                     "(vchargePage.view)")
        self.assertAlmostEqual(float(text.split(" m")[0]), per_pixel * np.hypot(200, 120), delta=0.02 * per_pixel * 233)

    def test_fewer_points_are_drawn_while_the_view_moves(self):
        found = vcharge.read_map(write_map(self.folder))
        generator = np.random.default_rng(4)
        number = 400_000
        spread = vcharge.Landmarks(np.arange(number), generator.uniform([-100, -60, 0], [100, 60, 2], (number, 3)),
                                   np.full((number, 3, 3), np.nan), np.zeros(number), np.full(number, 3))
        many = vcharge.SparseMap(found.rig, found.sessions, found.keyframes, spread, found.observations, 1, [1], {})
        write.write_page(scene.scene_of("many", many), self.folder / "many.html")
        self.browser.show(self.folder / "many.html")
        moving = self.browser.run("vchargePage.drawStill(false), [vchargePage.points.drawn, vchargePage.points.budget]")
        resting = self.browser.run("vchargePage.drawStill(true), vchargePage.points.drawn")
        self.assertLessEqual(moving[0], moving[1])
        self.assertGreater(moving[0], 0.8 * moving[1])
        self.assertGreater(resting, 2 * moving[0])
        # Slow frames lower the budget, fast ones raise it again.
        budgets = self.browser.run("[0.2, 0.2, 5, 5].map((factor) => { vchargePage.drawStill(false);"
                                   " vchargePage.points.adapt(factor); return vchargePage.points.budget; })")
        self.assertLess(budgets[1], budgets[0])
        self.assertGreater(budgets[3], budgets[1])
        # What is near and large on the screen gets more of its points.
        parts = self.browser.run("(() => { const {view, points} = vchargePage; view.target.set(-100, 0, 0); view.distance_m = 20; "
                                 "view.slope_rad = 0.3; view.heading_rad = 0; view.change(); vchargePage.drawStill(false); "
                                 "return points.chunks.filter((one) => one.mesh.visible).map((one) => "
                                 "[one.centre.x, one.mesh.geometry.drawRange.count / one.count]); })()")
        x, drawn = np.array(parts).T
        self.assertGreater(drawn[x < -50].mean(), 2 * drawn[x > 50].mean())
        self.check()

    def test_the_page_can_ask_nobody(self):
        self.show("--map", write_map(self.folder))
        self.assertEqual(self.browser.run("fetch('http://127.0.0.1:9/').then(() => 'asked', (error) => error.name)"), "TypeError")
        self.browser.run("0")
        self.assertTrue(any("Content Security Policy" in problem for problem in self.browser.problems), self.browser.problems)

    def test_an_empty_map_says_so(self):
        path = write_map(self.folder)
        with sqlite3.connect(path) as database:
            for table in ("keyframe", "landmark", "image", "loop_edge"):
                database.execute(f"DELETE FROM {table}")
        self.show("--map", path)
        self.assertEqual(self.browser.run("document.getElementById('note').innerText"),
                         "This map is empty: it has neither keyframes nor landmarks.")


if __name__ == "__main__":
    rostest.rosrun("vcharge_tests", "page", "__main__")
