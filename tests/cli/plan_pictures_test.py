#!/usr/bin/env python3
"""What lensctl's plans draw and read: stacks, charts, numbers of any size, depth maps."""
import json
import math
import os
import random
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree
import zlib
from fractions import Fraction as Q

from lensctl_case import DOF, LENSCTL, Case, no_constant, run, vergence


class Stacks(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..8mm", "--stack"]

    def check(self, near, far, limit_um, tolerance_um, *extra):
        answer = self.answer(*self.LENS, "--sharp", f"{near}..{far}:{limit_um}um", "--sensor-tolerance",
                             f"{tolerance_um}um", *extra)
        self.assertEqual(set(answer), {"feasible", "shots"})
        f, shots = Q("0.05"), answer["shots"]
        for shot in shots:
            self.assertEqual(set(shot), {"fNumber", "extensionMm", "nearD", "farD", "magnification"})
            n, e = Q(shot["fNumber"]), Q(shot["extensionMm"]) / 1000
            self.near(shot["magnification"], e / f)
            # Both ends of what it claims are sharp wherever the sensor stands within its tolerance.
            for u in (Q(shot["nearD"]), Q(shot["farD"])):
                for error in (-1, 1):
                    stands = e + error * Q(tolerance_um) / 10**6
                    blur = abs(f / n * ((f + stands) * (1 / f - u) - 1)) * 10**6
                    self.assertLessEqual(blur, Q(limit_um) * (1 + Q("1e-9")))
        covered = sorted((Q(shot["farD"]), Q(shot["nearD"])) for shot in shots)
        self.near(covered[0][0], vergence(far), absolute=1e-12)
        self.near(covered[-1][1], vergence(near), absolute=1e-12)
        for (_, end), (start, _) in zip(covered, covered[1:]):
            self.assertLessEqual(start, end + Q("1e-12"))
        return shots

    def test_covers_everything_with_the_fewest(self):
        shots = self.check("0.5m", "2m", 20, 0)
        # With N at most 16 each shot covers at most 2 c N W/f² of vergence: fewer shots cannot reach.
        f, c = Q("0.05"), Q("20e-6")
        reach = 2 * c * 16 * (1 - f / 2) / f**2
        self.assertEqual(len(shots), math.ceil((Q(2) - Q("0.5")) / reach))
        self.assertGreater(len(self.check("0.5m", "2m", 20, 60)), len(shots))
        self.assertEqual(len(self.check("1m", "1.001m", 20, 0)), 1)
        self.check("1m", "inf", 30, 1, "--wavelength", "550nm")

    def test_refusals(self):
        answer = self.answer(*self.LENS, "--sharp", "1m..2m:10um", "--sensor-tolerance", "1mm", status=1)
        self.assertEqual((answer["feasible"], answer["shots"]), (False, []))
        self.assertTrue(answer["reason"])
        self.assertEqual(answer["cause"], "tolerance")
        self.refused(64, "blurred", *self.LENS, "--sharp", "1m:10um", "--blurred", "2m:10um")
        self.refused(64, "focus", *self.LENS, "--sharp", "1m:10um", "--focus", "1m")


class Plots(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..4", "--extension", "0mm..8mm", "--pixel", "50um"]

    def draw(self, status, *limits):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "plan.svg")
            self.answer(*self.LENS, *limits, "--plot", path, status=status)
            texts = [text.text for text in xml.etree.ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")]
            self.assertEqual(os.listdir(folder), ["plan.svg"])
            return texts

    def test_names_limits_and_axes(self):
        texts = self.draw(0, "--sharp", "near=2.1m..2.5m", "--blurred", "far=4.3m..inf:4px:behind")
        for text in ("f-number", "sensor distance from the lens centre [mm]", "blur diameter [px]", "near ≤ 1 px",
                     "near ≤ 1 px (near end)", "near ≤ 1 px (far end)", "far ≥ 4 px (behind)", "in focus", "infinity"):
            self.assertIn(text, texts)
        texts = self.draw(1, "--sharp", "near=2.1m..2.5m", "--sharp", "wall=5m")
        self.assertIn("50 mm: no setting meets every limit", texts)
        self.assertTrue(any(text.startswith("in conflict: near, wall") for text in texts), texts)
        self.assertIn("depth of field", self.draw(0, "--focus", "2m", "--objective", "depth", "--blur-limit", "1px"))

    def polygons(self, status, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "plan.svg")
            self.answer("plan", *arguments, "--plot", path, status=status)
            root = xml.etree.ElementTree.parse(path)
            svg = "{http://www.w3.org/2000/svg}"
            return [e.get("fill") for kind in ("polygon", "path") for e in root.iter(svg + kind)], \
                [text.text for text in root.iter(svg + "text")]

    def test_nothing_is_shaded_feasible_where_there_is_no_plan(self):
        lens = ["--focal-length", "50mm", "--f-number", "4..64", "--extension", "0mm..80mm", "--pixel", "3um",
                "--wavelength", "550nm", "--pupil-factor", "0.4"]
        for limit, status in (("a=0.100m..0.1000001m:18um", 1), ("a=0.100m..0.1000001m:40um", 0)):
            _, texts = self.polygons(status, *lens, "--sharp", limit)
            self.assertEqual("feasible" in texts, status == 0)
        self.assertTrue(any(text.startswith("with limits relaxed") for text in self.polygons(
            1, *lens, "--sharp", "a=0.100m..0.1000001m:18um")[1]))

    def test_the_plan_of_relaxed_limits_is_drawn_beside_those_it_breaks(self):
        texts = self.draw(1, "--sharp", "near=2.1m..2.5m", "--sharp", "wall=5m")
        self.assertIn("a limit that it breaks", texts)
        self.assertTrue(any(text.startswith("with limits relaxed ") for text in texts), texts)
        self.assertIn("near ≤ 1 px", texts)

    def test_tolerances_are_drawn_around_the_plan_and_its_blur(self):
        limits = ("--sharp", "near=2.1m..2.5m:2px")
        frame, band = "tolerance: ± 20 um, ± 1 % of f-number", "its tolerance"
        exact = self.draw(0, *limits)
        self.assertFalse({frame, band} & set(exact), exact)
        for status, more in ((0, ()), (1, ("--sharp", "wall=9m:0.1px"))):
            texts = self.draw(status, *limits, *more, "--sensor-tolerance", "20um", "--f-number-tolerance", "1%")
            self.assertLessEqual({frame, band}, set(texts), texts)

    def test_a_file_that_cannot_be_written(self):
        self.refused(73, "/nonexistent/plan.svg", *self.LENS, "--sharp", "2m", "--plot", "/nonexistent/plan.svg")


class Extremes(Case):
    """Whatever the sizes, the answer is JSON without NaN or infinity, or one line that says why not."""

    def number(self, rng):
        return f"{rng.choice(['', '', '', '-'])}{rng.uniform(0.1, 10):.3g}e{rng.choice([-320, -150, -12, -3, 0, 0, 0, 1, 6, 100, 308])}"

    def depth(self, rng):
        return rng.choice(["inf", self.number(rng) + "m", self.number(rng) + "D", f"{rng.uniform(0.01, 9):.3g}m"])

    def test_any_size(self):
        rng = random.Random(20)
        answered = 0
        for _ in range(150):
            f = rng.choice(["50mm", "50mm", self.number(rng) + "m"])
            lens = ["--focal-length", f, "--f-number", rng.choice(["2.8", self.number(rng)])]
            command = rng.choice([
                ["blur", *lens, "--focus", self.depth(rng), "--at", self.depth(rng), "--at", self.depth(rng)],
                ["blur", *lens, "--extension", self.number(rng) + "mm", "--at", self.depth(rng)],
                ["dof", *lens, "--focus", self.depth(rng), "--blur-limit", self.number(rng) + "um"],
                ["conjugate", "--focal-length", f, "--point", ",".join(self.number(rng) for _ in range(4))],
                ["plan", *lens, "--extension", "-1mm.." + self.number(rng) + "mm", "--sharp",
                 f"{self.depth(rng)}..{self.depth(rng)}:{self.number(rng)}um"],
                ["plan", *lens, "--extension", "0mm..8mm", "--focus", self.depth(rng), "--blurred",
                 f"{self.depth(rng)}:{self.number(rng)}um"],
            ])
            code, out, err = run(*command, "--json")
            if code in (0, 1):
                json.loads(out, parse_constant=no_constant)
                self.assertEqual((out.count("\n"), err), (1, ""), command)
                answered += 1
            else:
                self.assertEqual(code, 64, (command, err))
                self.assertRegex(err, r"^lensctl: [^\n]+\n$")
                self.check_error(64, out, err)
        self.assertGreater(answered, 15)

    def test_a_full_disk(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            done = subprocess.run([LENSCTL, "dof", *DOF], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(done.returncode, 73)
        self.assertIn("stdout", done.stderr)

    def test_negative_ends(self):
        answer = self.answer("plan", "--focal-length", "50mm", "--f-number", "2", "--extension", "-0.1mm..0.2mm",
                             "--focus", "-0.02D")
        self.near(answer["focalPlaneD"], Q("-0.02"))
        self.assertLess(answer["extensionMm"], 0)
        self.assertEqual((answer["focalPlaneM"], answer["focusFromSensorM"]), (None, None))


def write_png(path, rows, bits=16, colour=0):
    """A PNG of grey rows (or of RGB ones, their samples in a row)."""
    channels = 3 if colour == 2 else 1
    raw = b"".join(b"\0" + struct.pack(">" + ("H" if bits == 16 else "B") * len(row), *row) for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]) // channels, len(rows), bits, colour, 0, 0, 0)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)) +
                  chunk(b"IEND", b""))


class DepthMaps(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..8mm"]

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def png(self, name, rows, bits=16, colour=0):
        path = os.path.join(self.folder, name)
        write_png(path, rows, bits, colour)
        return path

    def test_classes_are_their_depths(self):
        depths = self.png("depths.png", [[0, 2000, 2100], [2300, 900, 9000], [65535, 0, 2500]])
        mask = self.png("mask.png", [[1, 1, 1], [1, 2, 3], [0, 3, 1]], bits=8)
        maps = ["--depth-map", depths, "--mask", mask]
        by_map = self.answer(*self.LENS, *maps, "--sharp", "@1:40um", "--blurred", "@3:40um:behind")
        by_range = self.answer(*self.LENS, "--sharp", "2000mm..2500mm:40um", "--blurred", "9m:40um:behind")
        self.assertEqual(by_map, by_range)
        without_mask = self.png("one.png", [[2000, 0], [2250, 2500]])
        self.assertEqual(self.answer(*self.LENS, "--depth-map", without_mask, "--sharp", "@1:40um"),
                         self.answer(*self.LENS, "--sharp", "2m..2.5m:40um"))

    def test_a_class_on_both_sides_of_the_subject(self):
        around = [1000 + 7 * i for i in range(60)] + [4000 + 50 * i for i in range(60)]
        depths = self.png("depths.png", [[2000, 2010] + around[:58], around[58:118]])
        mask = self.png("mask.png", [[1, 1] + [2] * 58, [2] * 60], bits=8)
        maps = ["--depth-map", depths, "--mask", mask]
        limits = ["--sharp", "@1:20um", "--blurred", "@2:200um"]
        self.assertEqual(self.answer(*self.LENS, "--sharp", "2m..2.01m:20um", "--blurred", "1m..6.85m:200um", status=1)
                         ["feasible"], False)
        answer = self.answer(*self.LENS, *maps, *limits)
        f, n, e = Q("0.05"), Q(answer["fNumber"]), Q(answer["extensionMm"]) / 1000
        for depth in around[:118]:
            blur = abs(f / n * ((f + e) * (1 / f - Q(1000, depth)) - 1))
            self.assertGreaterEqual(blur, Q("200e-6") * (1 - Q("1e-12")))
        for depth in (2000, 2010):
            blur = abs(f / n * ((f + e) * (1 / f - Q(1000, depth)) - 1))
            self.assertLessEqual(blur, Q("20e-6") * (1 + Q("1e-12")))

    def test_refusals(self):
        depths = self.png("depths.png", [[2000, 2100], [0, 0]])
        mask = self.png("mask.png", [[1, 1], [2, 2]], bits=8)
        sharp = ["--sharp", "@1:40um"]
        self.refused(64, "--depth-map", *self.LENS, *sharp)
        self.refused(64, "--depth-map", *self.LENS, "--mask", mask, "--sharp", "2m:40um")
        self.refused(64, "no limit uses it", *self.LENS, "--depth-map", depths, "--sharp", "2m:40um")
        plan = [*self.LENS, "--depth-map", depths, "--mask", mask]
        self.refused(65, "mask.png: class @3", *plan, "--sharp", "@3:40um")
        self.refused(65, "mask.png: class @2", *plan, "--sharp", "@2:40um")
        wide = self.png("wide.png", [[1, 1, 1], [1, 1, 1]], bits=8)
        self.refused(65, "wide.png: the mask is 3x2 px", *self.LENS, "--depth-map", depths, "--mask", wide, *sharp)
        self.refused(65, "mask.png: a depth map must be a grey PNG of 16 bits", *self.LENS, "--depth-map", mask, *sharp)
        self.refused(65, "depths.png: a mask must be a grey PNG of 8 bits", *self.LENS, "--depth-map", depths,
                     "--mask", depths, *sharp)
        colour = self.png("colour.png", [[1, 2, 3, 4, 5, 6]], colour=2)
        self.refused(65, "colour.png", *self.LENS, "--depth-map", colour, *sharp)
        full = self.png("full.png", [[65535, 2000]])
        self.refused(65, "full.png: class @1 holds 65535 mm", *self.LENS, "--depth-map", full, *sharp)
        text = os.path.join(self.folder, "text.png")
        with open(text, "w", encoding="ascii") as out:
            out.write("not a picture")
        self.refused(65, "text.png: not a PNG", *self.LENS, "--depth-map", text, *sharp)
        self.refused(66, "missing.png", *self.LENS, "--depth-map", os.path.join(self.folder, "missing.png"), *sharp)
        near = self.png("near.png", [[40, 2000]])
        self.refused(64, "focal length", *self.LENS, "--depth-map", near, *sharp)


if __name__ == "__main__":
    unittest.main()
