#!/usr/bin/env python3
"""lensctl verify: verdicts on pictures whose blur is known. Pictures are sums of sinusoids, of which a disk leaves a part that is
integrated here, chord by chord; others come of the simulated camera, whose blur follows from the lens equation."""
import json
import math
import operator
import os
import random
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

from lensctl_case import LENSCTL, Case, run

os.environ.setdefault("LENSD_BIN", os.path.dirname(os.path.abspath(LENSCTL)))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "daemon"))
from harness import DaemonTest  # noqa: E402

CASES = 100 if os.environ.get("LENSD_TEST_LEVEL") == "long" else 4
WIDTH, HEIGHT, NEAR_M, FAR_M = 192, 128, 1.5, 3.0  # the left half is near, the right one far


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(rows, bits=16, f_number=None, channels=1, lens="cam"):
    """A PNG file; each row has width * channels samples. Lens and f-number stand where lensctl snapshot writes them."""
    height, width = len(rows), len(rows[0]) // channels
    pack = struct.Struct((">%dH" if bits == 16 else "%dB") % (width * channels)).pack
    notes = b""
    if f_number is not None:
        xmp = f'<rdf:Description xmlns:lensd="urn:io.lensd.Lens:1.0/" lensd:Lens="{lens}" lensd:FNumber="{f_number!r}"/>'
        notes = chunk(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + xmp.encode())
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2 if channels == 3 else 0, 0, 0, 0))
            + notes + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + pack(*row) for row in rows), 1)) + chunk(b"IEND", b""))


def kept_by(diameter, frequency):
    """What a disk leaves of a sinusoid: the mean of cos(2 pi f x) over its chords."""
    total = 0.0
    for i in range(32):
        t = math.pi * ((i + 0.5) / 32 - 0.5)
        total += math.cos(t) ** 2 * math.cos(math.pi * frequency * diameter * math.sin(t))
    return 2 * total / 32


class Texture:
    """One surface for both depths."""

    def __init__(self, draw):
        self.waves = []
        for _ in range(32):
            f, angle = draw.uniform(0.02, 0.35), draw.uniform(0, math.pi)
            self.waves.append((f * math.cos(angle), f * math.sin(angle), draw.uniform(0, 2 * math.pi), 60 / f))
        self.columns = [[part for fx, _, phase, _ in self.waves for part in (math.cos(2 * math.pi * fx * x + phase),
                                                                            -math.sin(2 * math.pi * fx * x + phase))] for x in range(WIDTH)]

    def seen(self, draw, near_px, far_px, gain=1.0, noise=15.0):
        """Rows of the picture whose halves are blurred by disks so large."""
        halves = []
        for diameter in (near_px, far_px):
            halves.append([gain * amplitude * kept_by(diameter, math.hypot(fx, fy)) for fx, fy, _, amplitude in self.waves])
        rows = []
        for y in range(HEIGHT):
            turns = [2 * math.pi * fy * y for _, fy, _, _ in self.waves]
            sides = [[part for turn, kept in zip(turns, half) for part in (kept * math.cos(turn), kept * math.sin(turn))] for half in halves]
            row = [sum(map(operator.mul, sides[x >= WIDTH // 2], self.columns[x])) for x in range(WIDTH)]
            rows.append([min(max(round(gain * 6000 + level + draw.gauss(0, noise)), 0), 65535) for level in row])
        return rows


class Pictures(Case):
    """Files in a folder of the class."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lensd-verify-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name

    def write(self, name, data):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            file.write(data)
        return path

    def depth_map(self, name="depth.png"):
        row = [round(1000 * NEAR_M)] * (WIDTH // 2) + [round(1000 * FAR_M)] * (WIDTH - WIDTH // 2)
        return self.write(name, png([row] * HEIGHT))


class Verdicts(Pictures):
    def case(self, draw, name):
        """Files of a case, its blurs, and the options that say which frames there are."""
        texture = Texture(draw)
        blurs = {NEAR_M: draw.uniform(0.8, 7.0), FAR_M: draw.uniform(0.8, 7.0)}
        opening = draw.choice([0.0, draw.uniform(0.05, 0.4)])
        f_number = draw.uniform(1.2, 4.0)
        noted = opening > 0 and draw.random() < 0.5
        picture = self.write(f"{name}.png", png(texture.seen(draw, *blurs.values(), gain=3.0), f_number=f_number if noted else None))
        words = [picture, "--depth-map", self.depth_map()]
        for i in range(draw.choice([2, 2, 3])):
            reference = png(texture.seen(draw, *(opening * blur for blur in blurs.values())), f_number=f_number / opening if noted else None)
            words += ["--reference", self.write(f"{name}-{i}.png", reference)]
        return words + ([] if noted else ["--reference-opening", f"{opening:.9f}"]), blurs

    def limits(self, draw, blurs):
        """Options for some limits, and by name whether each holds."""
        words, truth = [], {}
        for depth, blur in blurs.items():
            for kind in draw.sample(["sharp", "blurred"], draw.choice([1, 2])):
                name, loose = f"{kind}-{depth:g}".replace(".", "-"), draw.random() < 0.7
                larger = loose == (kind == "sharp")
                limit = blur * (draw.uniform(1.3, 1.6) if larger else draw.uniform(0.5, 0.75))
                ends = ["%gm" % (depth - draw.uniform(0.1, 0.7)), draw.choice(["%gm" % (depth + draw.uniform(0.1, 0.7))] +
                                                                              ["inf"] * (depth == FAR_M))]
                draw.shuffle(ends)  # in either order
                in_um = draw.random() < 0.5
                size = f"{limit * 4:.4f}um" if in_um else f"{limit:.5f}px"
                words += [f"--{kind}", f"{name}={'..'.join(ends)}:{size}"]
                truth[name] = "holds" if loose else "broken"
        return [*words, "--pixel", "4um"], truth

    def test_of_pictures_drawn_at_random_are_right(self):
        draw = random.Random(2711)
        right = asked = 0
        for number in range(CASES):
            frames, blurs = self.case(draw, "drawn")
            limits, truth = self.limits(draw, blurs)
            with self.subTest(case=number, blurs=blurs, limits=limits):
                holds = all(answer == "holds" for answer in truth.values())
                found = self.answer("verify", *frames, *limits, status=0 if holds else 1)
                self.assertEqual(found["holds"], holds)
                self.assertEqual({limit["name"]: limit["answer"] for limit in found["limits"]}, truth)
                self.assertEqual(len(found["slices"]), 2)
                for slice_, (depth, blur) in zip(found["slices"], blurs.items()):
                    self.assertAlmostEqual(slice_["meanM"], depth, places=5)
                    self.assertAlmostEqual(slice_["diameterPx"], blur, delta=0.1 + 0.02 * blur)
                    self.assertAlmostEqual(slice_["gain"], 3.0, delta=0.1)
                right += len(truth)
            asked += len(truth)
        print(f"verdicts of {asked} limits on {CASES} pictures: {right} right")

    def test_what_is_told_to_people_and_programs(self):
        draw = random.Random(3)
        texture = Texture(draw)
        frames = [self.write("p.png", png(texture.seen(draw, 1.5, 5.0))), "--depth-map", self.depth_map(), "--reference-opening", "0"]
        for name in ("a", "b"):
            frames += ["--reference", self.write(f"{name}.png", png(texture.seen(draw, 0.0, 0.0)))]
        limits = ["--sharp", "1m..2m:2px", "--blurred", "wall=2m..inf:3px:behind", "--sharp", "nothing=10m..20m"]
        code, out, err = run("verify", *frames, *limits)
        self.assertEqual((code, err), (1, ""), out)
        self.assertRegex(out, r"sharp\[0\] +1 m to 2 m +at most 2 px +1\.\d+ px \(1\.\d+ to 1\.\d+\) +1\.5 m +\d{4} +holds\n")
        self.assertRegex(out, r"wall +2 m to infinity +at least 3 px +[45].* 3 m +\d{4} +holds\n")
        self.assertRegex(out, r"nothing +10 m to 20 m +at most 1 px +nothing +- +0 +cannot tell\n")
        self.assertTrue(out.endswith("the frames cannot tell whether the picture keeps its limits\n"), out)
        found = self.answer("verify", *frames, *limits, status=1)
        self.assertEqual([(limit["name"], limit["kind"], limit["nearM"], limit["farM"], limit["limitPx"]) for limit in found["limits"]],
                         [("sharp[0]", "sharp", 1, 2, 2), ("nothing", "sharp", 10, 20, 1), ("wall", "blurred", 2, None, 3)])
        self.assertIsNone(found["limits"][1]["worst"])
        self.assertEqual(found["limits"][2]["worst"], found["slices"][1])
        for limit, last in (("1m..2m:2px", "the picture keeps its limits\n"), ("2m..4m:2px", "the picture does not keep its limits\n")):
            code, out, _ = run("verify", *frames, "--sharp", limit)
            self.assertEqual((code, out[-len(last):]), (0 if "2m:" in limit else 1, last))
        # Nothing is asked: what was measured, and no verdict.
        code, out, _ = run("verify", *frames, "--units", "mm")
        self.assertEqual(code, 0)
        self.assertRegex(out, r"1500 mm +1\.\d+ px .*\n3000 mm +[45]\.?\d* px")
        self.assertIsNone(self.answer("verify", *frames)["holds"])

    def test_the_chart_has_what_was_measured_planned_and_asked(self):
        draw = random.Random(4)
        texture = Texture(draw)
        frames = [self.write("p.png", png(texture.seen(draw, 0.0, 5.0))), "--depth-map", self.depth_map(), "--reference-opening", "0"]
        for name in ("a", "b"):
            frames += ["--reference", self.write(f"{name}.png", png(texture.seen(draw, 0.0, 0.0)))]
        code, planned, _ = run("blur", "--focal-length", "50mm", "--f-number", "2", "--focus", "1.5m", "--at", "1m..4m", "--at", "inf",
                               "--pixel", "60um", "--json")
        self.assertEqual(code, 0)
        predicted = self.write("planned.json", planned.encode())
        chart = os.path.join(self.folder, "chart.svg")
        found = self.answer("verify", *frames, "--sharp", "1m..2m:2px", "--blurred", "2m..inf:3px", "--plot", chart, "--predicted", predicted)
        self.assertTrue(found["slices"][0]["atMost"])
        with open(chart, encoding="utf-8") as file:
            text = file.read()
        for word in ("planned, and measured", "planned (thin lens)", ">measured<", "measured: at most", "at most 2 px", "at least 3 px"):
            self.assertIn(word, text)
        for wrong, says in ((b"{", "not JSON"), (b"{}", "not a list of points"), (b'[{"distanceM": 1}]', "without its distance"),
                            (b'[{"distanceM": "1", "blurPx": 2}]', "without its distance"), (b"[[1, 2]]", "without its distance")):
            self.refused(65, says, "verify", *frames, "--plot", chart, "--predicted", self.write("wrong.json", wrong))
        self.refused(66, "No such file", "verify", *frames, "--plot", chart, "--predicted", chart + "x")
        self.refused(64, "--predicted requires --plot", "verify", *frames, "--predicted", predicted)
        self.refused(64, "has to end in .svg or .png", "verify", *frames, "--plot", "chart.pdf")


class WrongInputs(Pictures):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        rows, small = [[500 + x * y % 97 for x in range(64)] for y in range(48)], [[500] * 64] * 47
        cls.files = {}
        for name, data in (("p", png(rows, f_number=2.0)), ("a", png(rows, f_number=16.0)), ("b", png(rows, f_number=16.1)),
                           ("other", png(rows, f_number=11.0)), ("wide", png(rows, f_number=2.0)), ("bare", png(rows)),
                           ("lens", png(rows, f_number=16.0, lens="else")),
                           ("small", png(small, f_number=16.0)), ("short", png(small, f_number=2.0)),
                           ("colour", png([[sample % 256 for sample in row] * 3 for row in rows], 8, 16.0, channels=3)),
                           ("depth", png([[1000] * 64] * 48)), ("depth8", png([[100] * 64] * 48, 8)), ("unknown", png([[0] * 64] * 48)),
                           ("beyond", png([[65535] * 64] * 48)), ("deep", png([[1000] * 32 + [60000] * 32] * 48)),
                           ("depth-small", png([[1000] * 64] * 47)), ("text", b"this is no picture"), ("cut", png(rows, f_number=2.0)[:300])):
            cls.files[name] = os.path.join(cls.folder, name + ".png")
            with open(cls.files[name], "wb") as file:
                file.write(data)
        cls.files["missing"] = os.path.join(cls.folder, "missing.png")

    def words(self, picture="p", references=("a", "b"), depth="depth", more=()):
        words = [self.files[picture], "--depth-map", self.files[depth]]
        for name in references:
            words += ["--reference", self.files[name]]
        return ["verify", *words, *more]

    def test_files_that_do_not_fit(self):
        alike = (65, "a.png was taken at f/16 and")
        for status, says, words in (
                (66, "missing.png: No such file", {"picture": "missing"}), (66, "missing.png: No such file", {"references": ("a", "missing")}),
                (66, "missing.png: No such file", {"depth": "missing"}), (65, "text.png: not a PNG", {"picture": "text"}),
                (65, "text.png: not a PNG", {"references": ("text", "b")}), (65, "text.png: not a PNG", {"depth": "text"}),
                (65, "cut.png", {"picture": "cut"}),
                (65, "small.png has 64x47 px, the picture", {"references": ("a", "small")}),
                (65, "a.png has 64x48 px, the picture", {"picture": "short", "references": ("a", "b")}),
                (65, "depth-small.png: the depth map has 64x47 px", {"depth": "depth-small"}),
                (65, "must be a grey PNG of 16 bits in millimetres, this one has 8 bits", {"depth": "depth8"}),
                (65, "this one has 8 bits in colour", {"depth": "colour"}),
                (65, "unknown.png: no pixel of the depth map has a known depth", {"depth": "unknown"}),
                (65, "beyond.png: no pixel of the depth map has a known depth", {"depth": "beyond"}),
                (65, "p.png was taken by the lens cam and", {"references": ("a", "lens")}),
                (65, "bare.png does not say its f-number", {"picture": "bare"}), (65, "give --reference-opening", {"references": ("a", "bare")}),
                (*alike, {"references": ("a", "other")}), (*alike, {"references": ("a", "b", "other")}),
                (65, "references need a smaller aperture than the picture", {"picture": "wide", "references": ("p", "wide")}),
                (65, "references need a smaller aperture than the picture", {"picture": "other", "references": ("p", "wide")})):
            with self.subTest(words=words):
                self.refused(status, says, *self.words(**words))

    def test_options_that_make_no_sense(self):
        for says, more in (("a picture is judged between two depths", ["--sharp", "plane(1,0,0):2px"]),
                           ("a picture is judged between two depths", ["--blurred", "@1:2px"]),
                           ("both ends are one depth", ["--sharp", "2m"]), ("both ends are one depth", ["--sharp", "inf..inf:2px"]),
                           ("a bare number; give its unit", ["--sharp", "1..2:1px"]), ("a bare number; give its unit", ["--sharp", "1m..2m:1"]),
                           ("a side is for --blurred only", ["--sharp", "1m..2m:1px:behind"]),
                           ("needs the size of a pixel: add --pixel", ["--blurred", "1m..2m:5um"]),
                           ("two limits are called 'it'", ["--sharp", "it=1m..2m", "--blurred", "it=3m..4m"]),
                           ("--pixel '-1um'", ["--pixel=-1um"]), ("a bare number; give its unit", ["--slice", "0.1"]),
                           ("must be greater than zero", ["--slice", "0m"]), ("blur is looked for up to 1px to 40px", ["--largest", "41px"]),
                           ("blur is looked for up to 1px to 40px", ["--largest", "0.5px"]), ("a bare number", ["--largest", "9"]),
                           ("give a larger --largest, up to 40px", ["--blurred", "1m..2m:9px", "--largest", "8px"]),
                           ("cannot be judged", ["--blurred", "1m..2m:41px"]),
                           ("is from 0 (a pinhole) to 0.99", ["--reference-opening", "1"]), ("is from 0", ["--reference-opening=-0.1"]),
                           ("leave --from out", ["--from", "sensor"]), ("--plot-theme requires --plot", ["--plot-theme", "dark"])):
            with self.subTest(more=more):
                self.refused(64, says, *self.words(more=more))
        self.refused(64, "--reference is needed twice or more", *self.words(references=("a",)))
        self.refused(64, "is given twice", *self.words(references=("a", "a")))
        self.refused(64, "--slice '1mm': the depths from", *self.words(depth="deep", more=["--slice", "1mm"]))
        self.refused(64, "--depth-map is required", "verify", self.files["p"], "--reference", self.files["a"])

    def test_a_frame_without_texture_tells_nothing(self):
        flat = self.write("flat.png", png([[500] * 64] * 48, f_number=2.0))
        for name in ("c", "d"):
            self.files[name] = self.write(name + ".png", png([[500] * 64] * 48, f_number=16.0))
        self.files["flat"] = flat
        found = self.answer(*self.words("flat", ("c", "d"), more=["--sharp", "0.5m..2m:2px"]), status=1)
        self.assertEqual(found["limits"][0]["answer"], "cannot tell")

    def test_brightness_that_is_cut_off_is_said(self):
        rows = [[min(65535, 64000 + 50 * (x * y % 97)) for x in range(64)] for y in range(48)]
        self.files["bright"] = self.write("bright.png", png(rows, f_number=2.0))
        _, _, err = run(*self.words("bright"))
        self.assertRegex(err, r"^\d+ % of the pixels of .*bright.png are at full scale")


SCENE = f"""version = 1
[camera]
width = 224
height = 160
pixel_um = 3.45
bits = 16
full_well_e = 1000000
read_noise_e = 10.0
exposure_ms = 7
frame_rate_hz = 60
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.0]
steps = 4096
speed_steps_per_s = 80000
acceleration_steps_per_s2 = 2000000
settle_ms = 5
iris_steps = 400
initial_f_number = 2.8
[[surface]]
kind = "wall"
distance_m = 1.2
texture = "{HERE}/../../scenes/textures/brick.png"
texture_px_per_image_px = 1.0
"""


class OfASimulatedCamera(DaemonTest):
    """The files say themselves how the lens stood."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lensd-verify-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        with open(os.path.join(cls.folder, "scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        with open(os.path.join(cls.folder, "depth.png"), "wb") as file:
            file.write(png([[1200] * 224] * 160))
        cls.config = f'version = 1\n[[lens]]\nname = "cam"\ndriver = "sim"\nscene = "{cls.folder}/scene.toml"\n'
        super().setUpClass()

    def lensctl(self, *words, status=0):
        done = self.daemon.lensctl(*words, cwd=self.folder)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout

    def test_its_blur_is_that_of_the_lens_equation(self):
        draw = random.Random(27)
        for _ in range(10 if CASES == 100 else 2):
            f_number = draw.choice([2.8, 4.0, 5.6])
            self.lensctl("focus", f"ext:{0.5319 + draw.choice([-1, 1]) * draw.uniform(0.01, 0.025) * f_number / 2:.5f}mm")
            self.lensctl("aperture", "16")
            self.lensctl("snapshot", "-o", "a.png")
            self.lensctl("snapshot", "-o", "b.png")
            self.lensctl("aperture", f"{f_number}")
            self.lensctl("snapshot", "-o", "picture.png")
            stands = json.loads(self.lensctl("status", "cam", "--json"))
            extension_mm, f_number = stands["extensionMm"], stands["fNumber"]
            blur = 25.0 / f_number * abs((25.0 + extension_mm) * (1 / 25.0 - 1 / 1200.0) - 1) / 3.45e-3
            frames = ("verify", "picture.png", "--reference", "a.png", "--reference", "b.png", "--depth-map", "depth.png")
            found = json.loads(self.lensctl(*frames, "--sharp", f"wall=1m..1.5m:{1.15 * blur:.4f}px", "--json"))
            self.assertEqual([limit["answer"] for limit in found["limits"]], ["holds"])
            self.assertAlmostEqual(found["slices"][0]["diameterPx"], blur, delta=0.05 + 0.02 * blur)
            self.assertIn("does not keep its limits", self.lensctl(*frames, "--sharp", f"1m..1.5m:{0.85 * blur:.4f}px", status=1))

    def test_a_reference_in_another_focus_is_said(self):
        for name, aperture, extension in (("a", "16", "0.5mm"), ("b", "16", "0.5mm"), ("picture", "2.8", "0.52mm")):
            self.lensctl("focus", "ext:" + extension)
            self.lensctl("aperture", aperture)
            self.lensctl("snapshot", "-o", name + ".png")
        done = self.daemon.lensctl("verify", "picture.png", "--reference", "a.png", "--reference", "b.png", "--depth-map", "depth.png",
                                   cwd=self.folder)
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stderr, r"^picture.png and a.png were taken in different focus \(extension 0.5[12]\d* mm and 0.(49|50)\d* mm\)")


if __name__ == "__main__":
    unittest.main()
