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


class Plots(Case):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def draw(self, name, *arguments):
        self.answer(*arguments, "--plot", self.path(name))
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
