"""lens-bench gallery: every file is there, small and well-formed, no label covers another, what is drawn is what the lecture's formulas
say (computed here anew), frames differ as they should, and the committed pictures are those that the command draws."""
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "daemon"))
from bench import rows_of  # noqa: E402

BENCH = sys.argv.pop(1)
ROOT = os.path.realpath(os.path.join(HERE, "..", ".."))
COMMITTED = os.path.join(ROOT, "docs", "images", "gallery")
SVG = "{http://www.w3.org/2000/svg}"
CHARTS = {"pinhole", "hole-and-lens", "conjugates", "rays", "signed-blur", "tilted-plane", "depth-of-field", "total-blur"}
FRAMES = {"small-pinhole", "wide-hole", "lens-wide-open", "lens-stopped-down", "tilted-plane"}
PALETTE = ["#0072b2", "#d55e00", "#009e73"]


def draw(folder, *words):
    return subprocess.run([BENCH, "gallery", "-o", folder, "--scenes", os.path.join(ROOT, "scenes"), *words],
                          capture_output=True, text=True, timeout=300, check=False)


def texts_of(root):
    return [text.text for text in root.iter(SVG + "text")]


class Panel:
    """One chart of a page, read back from its picture: px to values by the labels of its ticks."""

    def __init__(self, group, log=(False, False)):
        self.group = group
        frame = [r for r in group.iter(SVG + "rect") if r.get("fill") == "none"][0]
        self.bottom = float(frame.get("y")) + float(frame.get("height"))
        left = float(frame.get("x"))
        ticks = ([], [])
        for text in group.iter(SVG + "text"):
            x, y = float(text.get("x")), float(text.get("y"))
            if text.get("font-size") != "12.50" or text.get("transform") or not re.fullmatch(r"-?[\d.]+", text.text):
                continue
            if abs(y - self.bottom - 18.0) < 0.1 and text.get("text-anchor") == "middle":
                ticks[0].append((x, float(text.text)))
            if abs(x - left + 8.0) < 0.1 and text.get("text-anchor") == "end":
                ticks[1].append((y - 4.3, float(text.text)))
        self.maps = [self.map_of(*axis) for axis in zip(ticks, log)]

    @staticmethod
    def map_of(ticks, log):
        (p, a), (q, b) = min(ticks), max(ticks)
        if log:
            return lambda px: a * (b / a) ** ((px - p) / (q - p))
        return lambda px: a + (b - a) * (px - p) / (q - p)

    def curve(self, colour):
        """Points of the first line of this colour."""
        for path in self.group.iter(SVG + "path"):
            if path.get("stroke") == colour:
                numbers = [tuple(map(float, part.split())) for part in re.split("[ML]", path.get("d"))[1:]]
                return [(self.maps[0](x), self.maps[1](y)) for x, y in numbers]
        raise AssertionError(colour)


class Gallery(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-gallery-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.done = draw(cls.folder.name)

    def page(self, name, folder=None):
        with open(os.path.join(folder or self.folder.name, name + ".svg"), encoding="utf-8") as file:
            return xml.etree.ElementTree.fromstring(file.read())

    def panels(self, name, *logs):
        groups = list(self.page(name).findall(SVG + "g"))
        self.assertEqual(len(groups), len(logs))
        return [Panel(group, log) for group, log in zip(groups, logs)]

    def frame(self, name):
        with open(os.path.join(self.folder.name, name + ".png"), "rb") as file:
            return rows_of(file.read())

    def near(self, values, truth, relative):
        self.assertGreater(len(values), 1)
        for x, y in values:
            self.assertLessEqual(abs(y - truth(x)), relative * abs(truth(x)), (x, y, truth(x)))

    def test_draws_every_file_small_and_says_so(self):
        self.assertEqual((self.done.returncode, self.done.stderr), (0, ""))
        expected = {name + ".svg" for name in CHARTS} | {name + ".png" for name in FRAMES}
        self.assertEqual(set(os.listdir(self.folder.name)), expected)
        self.assertEqual(self.done.stdout.count("\n"), len(expected))
        for name in expected:
            self.assertLess(os.path.getsize(os.path.join(self.folder.name, name)), (60 if name.endswith("svg") else 150) * 1024, name)

    def test_every_chart_names_its_topic_and_says_how_to_read_it_and_what_it_means(self):
        for name in CHARTS:
            lines = texts_of(self.page(name))
            for begins in ("In the lecture: ", "How to read it: ", "What it means: "):
                self.assertEqual(sum(line.startswith(begins) for line in lines), 1, (name, begins))

    def test_no_text_covers_another_or_leaves_the_picture(self):
        for name in CHARTS:
            page, boxes = self.page(name), []
            width, height = (float(number) for number in page.get("viewBox").split()[2:])
            for group in [page, *page.findall(SVG + "g")]:
                dx, dy = map(float, re.findall(r"[\d.]+", group.get("transform", "0 0")))
                for text in group.findall(SVG + "text"):
                    if text.get("transform"):
                        continue
                    size, x, y = (float(text.get(key)) for key in ("font-size", "x", "y"))
                    wide = (0.56 if len(text.text) < 60 else 0.52) * size * len(text.text)  # long lines of DejaVu Sans: 0.47 to 0.51
                    left = dx + x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.get("text-anchor")] * wide
                    boxes.append((text.text, left, dy + y - 0.75 * size, left + wide, dy + y + 0.2 * size))
            for i, (text, left, top, right, bottom) in enumerate(boxes):
                self.assertTrue(left >= 0 and top >= 0 and right <= width and bottom <= height, (name, text))
                for other, left2, top2, right2, bottom2 in boxes[:i]:
                    self.assertFalse(left < right2 and left2 < right and top < bottom2 and top2 < bottom, (name, text, other))

    def test_the_sharpest_pinhole(self):
        # b = A (1 + d/Z) and 2.44 L d/A together are least where both are alike: A^2 = 2.44 L d/(1 + d/Z).
        wavelength, d, z = 550e-9, 0.05, 2.0
        best = math.sqrt(2.44 * wavelength * d / (1 + d / z))
        least = math.sqrt(2.0) * best * (1 + d / z)
        said = [text for text in texts_of(self.page("pinhole")) if text.startswith("sharpest: ")]
        um, mm = map(float, re.fullmatch(r"sharpest: ([\d.]+) um at A = ([\d.]+) mm", said[0]).groups())
        self.assertAlmostEqual(um, least * 1e6, delta=0.5)
        self.assertAlmostEqual(mm, best * 1e3, delta=0.0006)
        total, geometric, diffraction = (self.panels("pinhole", (True, True))[0].curve(colour) for colour in PALETTE)
        self.near(geometric, lambda a: a * 1e3 * (1 + d / z), 0.005)
        self.near(diffraction, lambda a: 2.44 * wavelength * d / a * 1e9, 0.005)
        self.near(total, lambda a: math.hypot(a * 1e3 * (1 + d / z), 2.44 * wavelength * d / a * 1e9), 0.005)
        x, y = min(total, key=lambda point: point[1])
        self.assertAlmostEqual(y, least * 1e6, delta=2.0)
        self.assertAlmostEqual(x, best * 1e3, delta=0.02)

    def test_hyperfocal_distance_and_the_ends_of_the_depth_of_field(self):
        f, n, c = 0.05, 8.0, 30e-6
        h = f + f * f / (n * c)
        self.assertTrue(any(f"H = {h:.2f} m" in text for text in texts_of(self.page("depth-of-field"))))
        self.assertTrue(any(f"= {h / 2:.3f} m" in text for text in texts_of(self.page("depth-of-field"))))
        far, near, focus = (self.panels("depth-of-field", (True, True))[0].curve(colour) for colour in PALETTE)
        self.near(focus, lambda x: x, 0.01)

        def end(x, sign):  # D f^2 / (f^2 -+ N c (D - f))
            d = x * h
            return d * f * f / (f * f + sign * n * c * (d - f)) / h
        self.near(near, lambda x: end(x, 1), 0.01)
        self.near([point for point in far if point[0] < 0.8], lambda x: end(x, -1), 0.01)

    def test_image_distances_and_both_asymptotes(self):
        panel = self.panels("conjugates", (False, False))[0]
        for colour in PALETTE[:2]:
            points = [point for point in panel.curve(colour) if abs(point[1]) < 290]
            self.assertGreater(len(points), 20)
            for x, y in points:
                # The law itself, 1/Z_o + 1/Z_i = 1/f, and half a px of what is drawn.
                self.assertAlmostEqual((x - 50.0) * (y - 50.0) / 2500.0, 1.0, delta=0.01 * (1 + abs(x - 50.0) + abs(y - 50.0)) / 5)
        for text in ("Z_o = f", "Z_i = f", "real images", "virtual images"):
            self.assertIn(text, texts_of(panel.group))

    def test_blur_is_straight_over_vergence_and_a_v_across_a_tilted_plane(self):
        over_vergence, over_distance = self.panels("signed-blur", (False, False), (False, False))
        for colour, n in zip(PALETTE, (2.0, 4.0, 8.0)):
            a, sensor = 50.0 / n, 50.0 / (1 - 0.05)  # mm, focused at 1 m

            def signed(u):
                return a * sensor * (1.0 - u)  # um
            for x, y in over_vergence.curve(colour):
                self.assertAlmostEqual(y, signed(x), delta=5.0)
            for x, y in over_distance.curve(colour):
                self.assertAlmostEqual(y, signed(1 / x), delta=25.0)
        plane = self.panels("tilted-plane", (False, False))[0]
        for colour, n in zip(PALETTE, (2.8, 5.6, 11.2)):
            (x1, y1), (tip, zero), (x2, y2) = plane.curve(colour)
            slope = 25.0 / n * 25.0 / (1 - 0.025 * 0.9) * 0.5
            self.assertAlmostEqual(zero, 0.0, delta=0.5)
            self.assertAlmostEqual(tip, 0.2, delta=0.005)
            self.assertAlmostEqual(y1, slope * (tip - x1), delta=0.6)
            self.assertAlmostEqual(y2, slope * (x2 - tip), delta=0.6)

    def test_stopping_down_turns_at_diffraction(self):
        said = [text for text in texts_of(self.page("total-blur")) if text.startswith("least: ")]
        um, n = map(float, re.fullmatch(r"least: ([\d.]+) um at f/([\d.]+)", said[0]).groups())
        sensor = 0.05 / (1 - 0.05 * 0.5)
        defocus, airy = 0.05 * sensor * 0.02, 2.44 * 550e-9 * sensor / 0.05  # over N, times N
        self.assertAlmostEqual(n, math.sqrt(defocus / airy), delta=0.06)
        self.assertAlmostEqual(um, math.sqrt(2 * defocus * airy) * 1e6, delta=0.06)

    def test_a_hole_lights_and_sees_what_its_geometry_says(self):
        forward, reverse = self.panels("hole-and-lens", (True, True), (True, True))
        a, d = 3.125, 0.05 / (1 - 0.05 * 0.5)
        self.near(forward.curve(PALETTE[0]), lambda z: a * (1 + d / z), 0.02)
        self.near(reverse.curve(PALETTE[0]), lambda z: a * (z + d) / d, 0.02)
        away = [point for point in reverse.curve(PALETTE[1]) if abs(math.log(point[0] / 2.0)) > 0.3]
        self.near(away, lambda z: a * abs(z - 2.0) / 2.0, 0.03)  # the opening, seen from the point in focus at 2 m

    def test_frames_are_as_sharp_as_their_disks_are_small(self):
        def detail(rows):
            steps = [abs(b - a) for row in rows for a, b in zip(row, row[1:])]
            return sum(steps) / len(steps)
        sharp, pinhole, wide_open, hole = (detail(self.frame(name)) for name in (
            "lens-stopped-down", "small-pinhole", "lens-wide-open", "wide-hole"))
        self.assertGreater(sharp, 1.2 * wide_open)
        self.assertGreater(wide_open, 1.2 * pinhole)
        self.assertGreater(pinhole, 2.0 * hole)
        rows = self.frame("tilted-plane")  # sharpest where the V is 0: at 0.2, six tenths of the way
        width = len(rows[0])
        parts = [detail([row[i * width // 10:(i + 1) * width // 10] for row in rows]) for i in range(10)]
        self.assertIn(max(range(10), key=parts.__getitem__), (5, 6))
        self.assertGreater(max(parts), 2.0 * parts[0])

    def test_the_theme_and_what_is_wrong(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(draw(folder, "--theme", "dark").returncode, 0)
            with open(os.path.join(folder, "pinhole.svg"), encoding="utf-8") as file:
                self.assertNotIn("#ffffff", file.read())
        wrong = subprocess.run([BENCH, "gallery", "-o", os.path.join(self.folder.name, "pinhole.svg", "x"), "--scenes", "/nowhere"],
                               capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((wrong.returncode, wrong.stderr.count("\n")), (74, 1), wrong.stderr)
        self.assertEqual(draw(self.folder.name, "--theme", "blue").returncode, 64)

    def test_the_committed_pictures_are_these(self):
        self.assertEqual(set(os.listdir(COMMITTED)), set(os.listdir(self.folder.name)))
        with open(os.path.join(ROOT, "docs", "gallery.md"), encoding="utf-8") as file:
            page = file.read()
        for name in CHARTS:
            self.assertEqual(texts_of(self.page(name, COMMITTED)), texts_of(self.page(name)), name)
            self.assertIn(f"images/gallery/{name}.svg", page)
        for name in FRAMES:
            with open(os.path.join(COMMITTED, name + ".png"), "rb") as file:
                committed = rows_of(file.read())
            off = [abs(a - b) for row, other in zip(committed, self.frame(name)) for a, b in zip(row, other)]
            self.assertLessEqual(sum(off) / len(off), 0.5, name)
            self.assertIn(f"images/gallery/{name}.png", page)


if __name__ == "__main__":
    unittest.main()
