#!/usr/bin/env python3
"""--plot of the commands that need no daemon: what is in the chart, in which colours, and that it is written whole or not at all."""
import os
import re
import stat
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree
import zlib

from lensctl_case import DOF, LENSCTL, Case, run

SVG = "{http://www.w3.org/2000/svg}"
BLUR = ["blur", "--focal-length", "50mm", "--f-number", "2.8", "--focus", "2m", "--at", "1m..4m"]
STACK = ["plan", "--focal-length", "50mm", "--f-number", "2.8..16", "--extension", "0mm..8mm", "--stack", "--sharp", "0.6m..2m:20um"]
WHITE, DARK = (255, 255, 255), (0x14, 0x18, 0x1b)


def png_of(data):
    """Width, height and the colour of the upper left pixel, by a program that shares nothing with lensctl."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    at, pixels = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        pixels += data[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += length + 12
    assert data[24] == 8 and data[25] in (2, 6)  # RGB or RGBA
    return width, height, tuple(zlib.decompress(pixels)[1:4])  # the first pixel of a row is its filter's own value


def lines_of(svg, width):
    """The polylines of this width, as lists of points in px; two numbers a point, a new list at every M."""
    lines = []
    for path in xml.etree.ElementTree.fromstring(svg).iter(SVG + "path"):
        if path.get("stroke-width") != width:
            continue
        for part in path.get("d").split("M")[1:]:
            lines.append([tuple(map(float, point.split())) for point in part.split("L")])
    return lines


def crossing(a, b):
    """Where the lines through the last two points of both cross."""
    (x1, y1), (x2, y2), (x3, y3), (x4, y4) = *a[-2:], *b[-2:]
    part = ((x3 - x1) * (y4 - y3) - (y3 - y1) * (x4 - x3)) / ((x2 - x1) * (y4 - y3) - (y2 - y1) * (x4 - x3))
    return x1 + part * (x2 - x1), y1 + part * (y2 - y1)


def text_boxes(svg):
    """Text and box of each text that is not turned: as wide as 0.56 of its size a letter."""
    boxes = []
    for text in xml.etree.ElementTree.fromstring(svg).iter(SVG + "text"):
        if text.get("transform"):
            continue
        size, x, y = (float(text.get(key)) for key in ("font-size", "x", "y"))
        width = 0.56 * size * len(text.text)
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.get("text-anchor")] * width
        boxes.append((text.text, left, y - 0.75 * size, left + width, y + 0.2 * size))
    return boxes


class Plots(Case):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def draw(self, name, *arguments, option="--plot"):
        self.answer(*arguments, option, self.path(name))
        self.assertEqual(os.listdir(self.folder), [name])
        with open(self.path(name), "rb") as file:
            data = file.read()
        os.remove(self.path(name))
        return data

    def texts(self, *arguments):
        return [text.text for text in xml.etree.ElementTree.fromstring(self.draw("e.svg", *arguments)).iter(SVG + "text")]

    def test_titles_say_the_lens_and_what_axes_have_units(self):
        for arguments, titles in (
                (["dof", *DOF], ["50 mm f/2.8: sharp from 1.966 m to 2.036 m", "limit 8 um", "in focus", "blur diameter [um]"]),
                (["dof", *DOF[:-1], "1px", "--pixel", "8um"], ["limit 1 px", "blur diameter [px]"]),
                (["dof", *DOF[:4], *DOF[6:]], ["focused at the hyperfocal distance 111.7 m"]),
                (BLUR, ["50 mm f/2.8: blur over depth", "458 um", "229 um", "blur diameter [um]"]),
                (["blur", "--model", "aperture", "--sensor-distance", "50mm", "--aperture-diameter", "0.3mm", "--at", "1m"],
                 ["hole 300 um wide, sensor at 50 mm: blur over depth", "315 um"]),
                (STACK, ["50 mm: sharp from shot to shot of a stack of 5", "shot", "f/15.4"])):
            with self.subTest(arguments=arguments):
                texts = self.texts(*arguments)
                for title in titles:
                    self.assertIn(title, texts)
                self.assertIn("vergence of the subject [D], its distance below", texts)

    def clear(self, svg):
        """No text leaves the picture or covers another."""
        boxes = text_boxes(svg)
        width, height = (float(number) for number in xml.etree.ElementTree.fromstring(svg).get("viewBox").split()[2:])
        for i, (text, left, top, right, bottom) in enumerate(boxes):
            self.assertTrue(left >= 0 and top >= 0 and right <= width and bottom <= height, text)
            for other, left2, top2, right2, bottom2 in boxes[:i]:
                self.assertFalse(left < right2 and left2 < right and top < bottom2 and top2 < bottom, (text, other))
        return [text for text, *_ in boxes]

    def test_a_point_and_its_image_are_drawn_with_rays_that_meet(self):
        # f 50 mm: 1/Z_i = 1/50 - 1/Z_o. Rays through both edges and the centre of the lens; the centre's goes straight on.
        for point, says in (("0mm,10mm,2m", ["object at 2 m", "image at 51.28 mm"]),
                            ("0mm,10mm,80mm", ["object at 80 mm", "image at 133.3 mm"]),
                            ("5mm,0mm,55mm", ["object at 55 mm", "image at 550 mm"]),
                            ("0mm,10mm,inf", ["object infinitely far", "image at 50 mm"]),
                            ("0,0.3,1,0", ["object infinitely far", "image at 50 mm"]),
                            ("0mm,10mm,30mm", ["object at 30 mm", "virtual image 75 mm before the lens"]),
                            ("0mm,10mm,-40mm", ["object 40 mm behind the lens", "image at 22.22 mm"])):
            with self.subTest(point=point):
                svg = self.draw("e.svg", "conjugate", "--focal-length", "50mm", "--point", point)
                texts = self.clear(svg)
                for text in ["50 mm lens: a point and its image", "lens, f = 50 mm", *says]:
                    self.assertIn(text, texts)
                self.assertTrue(any("to scale" in text.lower() for text in texts))
                upper, lower = lines_of(svg, "1.80")[-2:] if len(lines_of(svg, "1.80")) == 2 else (None, None)
                (centre,) = lines_of(svg, "1.30")
                self.assertTrue(upper and lower)
                slopes = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(centre, centre[1:]) if abs(b[0] - a[0]) > 1.0]
                self.assertLess(max(slopes) - min(slopes), 2e-3)
                dot = [(float(c.get("cx")), float(c.get("cy"))) for c in
                       xml.etree.ElementTree.fromstring(svg).iter(SVG + "circle")][-1]
                for pair in ((upper, lower), (upper, centre), (lower, centre)):
                    for met, drawn in zip(crossing(*pair), dot):
                        self.assertAlmostEqual(met, drawn, delta=0.5)

    def test_a_point_in_the_focal_plane_has_parallel_rays_and_one_in_the_lens_none(self):
        svg = self.draw("e.svg", "conjugate", "--focal-length", "50mm", "--point", "0mm,10mm,50mm")
        self.assertIn("image infinitely far", self.clear(svg))
        slopes = [(ray[-1][1] - ray[-2][1]) / (ray[-1][0] - ray[-2][0]) for ray in lines_of(svg, "1.80") + lines_of(svg, "1.30")]
        self.assertEqual(len(slopes), 3)
        self.assertLess(max(slopes) - min(slopes), 2e-3)
        self.refused(64, "in the plane of the lens", "conjugate", "--focal-length", "50mm", "--point", "0mm,1mm,0mm",
                     "--plot", self.path("e.svg"))

    def test_rays_leave_disks_in_the_ratio_of_their_blur(self):
        # 50 mm f/2.8 focused at 2 m: s = A Z_s (U_s - U) is linear in 1/Z.
        for at, farthest in (("4m", 4.0), ("8m", 8.0), ("inf", float("inf"))):
            with self.subTest(at=at):
                svg = self.draw("e.svg", *BLUR[:-1], "1m.." + at, option="--rays")
                texts = self.clear(svg)
                for text in ("50 mm f/2.8: the way of the light", "lens, f = 50 mm, 17.86 mm wide", "sensor at 51.28 mm",
                             "subject at 1 m", "subject at 2 m", "image at 52.63 mm", "image at 51.28 mm", "disk 458 um"):
                    self.assertIn(text, texts)
                near, far = (abs(bar[0][1] - bar[1][1]) for bar in lines_of(svg, "4.00"))
                self.assertAlmostEqual(far / near, (0.5 - 1.0 / farthest) / 0.5, delta=0.01)
        for arguments, says in ((["--model", "pinhole", "--sensor-distance", "50mm", "--at", "1m"], "pinhole"),
                                (["--model", "aperture", "--sensor-distance", "50mm", "--aperture-diameter", "0.3mm",
                                  "--at", "1m", "--at", "inf"], "hole, 300 um wide"),
                                ([*BLUR[1:-2], "--at", "4cm"], "virtual image 200 mm before the lens")):
            with self.subTest(arguments=arguments):
                self.assertIn(says, self.clear(self.draw("e.svg", "blur", *arguments, option="--rays")))

    def test_images_behind_the_sensor_are_drawn_there_also_focused_at_infinity(self):
        svg = self.draw("e.svg", *BLUR[:5], "--focus", "inf", "--at", "2m", "--at", "inf", option="--rays")
        self.assertIn("image at 51.28 mm", self.clear(svg))
        (sensor,) = lines_of(svg, "2.60")
        circles = [float(circle.get("cx")) for circle in xml.etree.ElementTree.fromstring(svg).iter(SVG + "circle")]
        self.assertEqual(len(circles), 3)  # the subject at 2 m and both images
        self.assertEqual(sum(x > sensor[0][0] + 20.0 for x in circles), 1)
        self.assertEqual(sum(abs(x - sensor[0][0]) < 1.0 for x in circles), 1)

    def test_rays_of_a_plan_name_its_limits(self):
        plan = ["plan", "--focal-length", "50mm", "--f-number", "2..16", "--extension", "0mm..8mm", "--sharp", "face=1m..1.2m:30um"]
        texts = self.clear(self.draw("e.svg", *plan, "--blurred", "wall=4m..inf:60um", option="--rays"))
        self.assertIn("50 mm: the way of the light at the plan", texts)
        self.assertTrue(any(text.startswith("face at ") for text in texts) and any(text.startswith("wall at ") for text in texts), texts)
        impossible = [*plan[:-1], "face=1m..1.2m:1um", "--rays", self.path("e.svg"), "--json"]
        self.assertEqual(run(*impossible)[0], 1)
        with open(self.path("e.svg"), encoding="utf-8") as file:
            self.assertIn("the plan that relaxed limits allow", file.read())
        os.remove(self.path("e.svg"))
        self.refused(64, "a stack has several", *STACK, "--rays", self.path("e.svg"))

    def test_both_drawings_at_once_share_a_theme(self):
        self.answer(*BLUR, "--plot", self.path("a.svg"), "--rays", self.path("b.svg"), "--plot-theme", "dark")
        for name in ("a.svg", "b.svg"):
            with open(self.path(name), encoding="utf-8") as file:
                self.assertNotIn("#ffffff", file.read())
            os.remove(self.path(name))
        self.refused(64, "--rays 'e.jpg': charts are SVG or PNG", *BLUR, "--rays", "e.jpg")
        self.refused(64, "name its file with --plot or --rays", *BLUR, "--plot-theme", "dark")

    def test_an_svg_follows_its_viewer_unless_told(self):
        viewer = self.draw("e.svg", *BLUR).decode()
        self.assertIn("prefers-color-scheme: dark", viewer)
        self.assertIn('fill="#ffffff"', viewer)
        light = self.draw("e.svg", *BLUR, "--plot-theme", "light").decode()
        self.assertNotIn("prefers-color-scheme", light)
        dark = self.draw("e.svg", *BLUR, "--plot-theme", "dark").decode()
        self.assertNotIn("#ffffff", dark)
        self.assertNotIn("#222222", dark)
        # Every colour that is drawn has its rule.
        for kind, colour in set(re.findall(r'(fill|stroke)="(#[0-9a-f]{6})"', viewer)):
            self.assertIn(f'[{kind}="{colour}"]', viewer)

    def test_a_png_is_light_and_twice_as_large_unless_told(self):
        width, height, ground = png_of(self.draw("e.png", *BLUR))
        self.assertEqual((width, height, ground), (1720, 960, WHITE))
        self.assertEqual(png_of(self.draw("e.png", *BLUR, "--plot-theme", "dark"))[2], DARK)
        self.assertEqual(png_of(self.draw("plan.png", *STACK[:7], "--sharp", "2m:20um"))[:2], (1720, 2160))

    def test_what_cannot_be_written_is_refused_and_nothing_is_there(self):
        for name in ("e.jpg", "e", "e.svgz", "e.PNG", "svg"):
            self.refused(64, "has to end in .svg or .png", *BLUR, "--plot", self.path(name))
        self.refused(64, "say light or dark", *BLUR, "--plot", self.path("e.svg"), "--plot-theme", "blue")
        self.refused(73, "/nonexistent/e.png", *BLUR, "--plot", "/nonexistent/e.png")
        self.assertEqual(run("dof", *DOF[:-1], "1um", "--wavelength", "550nm", "--plot", self.path("e.svg"))[0], 1)
        self.assertEqual(os.listdir(self.folder), [])

    def with_program(self, script):
        """lensctl where rsvg-convert is this script; None: there is none."""
        tools = self.path("tools")
        os.makedirs(tools, exist_ok=True)
        if script is not None:
            with open(os.path.join(tools, "rsvg-convert"), "w", encoding="utf-8") as file:
                file.write("#!/bin/sh\n" + script)
            os.chmod(file.name, stat.S_IRWXU)
        return subprocess.run([LENSCTL, *BLUR, "--plot", self.path("e.png")], capture_output=True, text=True, check=False,
                              timeout=120, env={**os.environ, "PATH": tools})

    def test_without_the_program_or_where_it_fails_nothing_is_written(self):
        for script, says in ((None, "apt install librsvg2-bin"), ("echo half; exit 1\n", "rsvg-convert failed"),
                             ("echo no PNG\n", "rsvg-convert failed"), ("echo 'no fonts' >&2; exit 3\n", "no fonts"),
                             ("kill -9 $$\n", "rsvg-convert failed")):
            with self.subTest(script=script):
                done = self.with_program(script)
                self.assertEqual((done.returncode, done.stdout), (73, ""), done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1)
                self.assertIn(says, done.stderr)
                self.assertEqual(os.listdir(self.folder), ["tools"])


if __name__ == "__main__":
    unittest.main()
