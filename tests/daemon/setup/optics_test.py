"""[lens.optics] as data sheets have it: closest distances by an independent rule, models, and what is refused without."""
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import unittest
from fractions import Fraction

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, quick_scene  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")
LENSES = os.path.join(HERE, "..", "..", "lenses")
COUNT = 300 if os.environ.get("LENSD_TEST_LEVEL") == "long" else 12


def lens(name, more, optics):
    return f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{SCENE}"\n{more}[lens.optics]\n{optics}'


def image_distance(f, z):
    """1/f = 1/z + 1/image, exactly."""
    return 1 / (1 / f - 1 / z)


def extension_of(f, closest, origin, gap):
    """In exact numbers; from the sensor by trying distances, since object, gap and image together make the distance."""
    f, closest, gap = Fraction(f), Fraction(closest), Fraction(gap)
    if origin != "sensor":
        return float(image_distance(f, closest) - f)
    near, far = 2 * f, closest  # with the object beyond two focal lengths the sum grows with its distance
    for _ in range(60):
        middle = Fraction(float((near + far) / 2))
        if middle + gap + image_distance(f, middle) < closest:
            near = middle
        else:
            far = middle
    return float(image_distance(f, far) - f)


def listed(text):
    """LensInfo of each lens of this configuration."""
    daemon = Daemon(config=text)
    try:
        with daemon.client() as client:
            return client.call(LENS + "List")["parameters"]["lenses"]
    finally:
        assert daemon.stop() == 0


class Closest(unittest.TestCase):
    def test_the_near_end_of_focus_follows_from_the_closest_distance(self):
        draw = random.Random(20261128)
        for begin in range(0, COUNT, 12):
            text, expected = "version = 1\n", {}
            for index in range(begin, begin + 12):
                f_mm = round(draw.uniform(2, 300), 3)
                origin = draw.choice(["lens", "sensor", "front"])
                gap_mm = draw.choice([0, round(draw.uniform(0, 20), 2)])
                least = 4.05 * f_mm + gap_mm if origin == "sensor" else 1.05 * f_mm
                closest = round(least * draw.uniform(1, 30), 2) / 1000
                where = f'closest_from = "{origin}"\n'
                own, inside = draw.choice([("", where), (f'distance_from = "{origin}"\n', "")])
                text += lens(f"l{index}", own, f"focal_length_mm = {f_mm}\nf_number = [2, 16]\nclosest_m = {closest}\n"
                             f"principal_gap_mm = {gap_mm}\n{inside}")
                expected[f"l{index}"] = 1e3 * extension_of(f_mm / 1e3, closest, origin, gap_mm / 1e3)
            lenses = listed(text)
            self.assertEqual(len(lenses), 12)
            for one in lenses:
                with self.subTest(lens=one["name"], text=text):
                    optics = one["optics"]
                    self.assertEqual(optics["extensionMinMm"], 0)
                    want = expected[one["name"]]
                    self.assertAlmostEqual(optics["extensionMaxMm"], want, delta=1e-8 * want)

    def test_one_to_one_from_the_sensor_is_taken_however_it_is_rounded(self):
        """Four focal lengths and the gap, which no binary number need be exactly."""
        draw = random.Random(3368)
        for begin in range(0, COUNT, 12):
            text, lengths = "version = 1\n", {}
            for index in range(begin, begin + 12):
                f_mm = Fraction(3368, 10) if index == 0 else Fraction(draw.randrange(20, 60000), 100)
                gap_mm = draw.choice([Fraction(0), Fraction(draw.randrange(2000), 100)])
                text += lens(f"l{index}", "", f"focal_length_mm = {float(f_mm)}\nf_number = [2, 16]\n"
                             f"closest_m = {float((4 * f_mm + gap_mm) / 1000)}\nclosest_from = \"sensor\"\nprincipal_gap_mm = {float(gap_mm)}\n")
                lengths[f"l{index}"] = float(f_mm)
            lenses = listed(text)
            self.assertEqual(len(lenses), 12)
            for one in lenses:
                with self.subTest(lens=one["name"], text=text):  # near 1:1 the extension goes with the root of the distance
                    self.assertAlmostEqual(one["optics"]["extensionMaxMm"] / lengths[one["name"]], 1, delta=1e-4)

    def test_no_lens_is_taken_to_focus_within_its_focal_length(self):
        """By rounding neither: the picture would be millions of times its object."""
        draw = random.Random(142)
        for index in range(COUNT):
            f_mm = 14.2 if index == 0 else round(draw.uniform(1, 300), 2)
            closest = float(Fraction(str(f_mm)) / 1000) * (1 if index == 0 else draw.choice([1, 1 + 1e-15, 1 + 1e-12, 1 + 1e-4, 1.005]))
            done = check(lens("a", "", f"focal_length_mm = {f_mm}\nf_number = [2, 16]\nclosest_m = {closest!r}\n"
                              f'closest_from = "{draw.choice(["lens", "front"])}"\n'))
            with self.subTest(f_mm=f_mm, closest=closest):
                self.assertEqual(done.returncode, 78, done.stderr)
                self.assertIn("within the focal length", done.stderr)

    def test_the_near_end_that_is_printed_can_be_reached(self):
        """In each unit: what a refusal calls the nearest distance is not refused, and is within a thousandth of the nearest."""
        draw = random.Random(231)
        metres = {"m": 1, "mm": 1e-3, "ft": 0.3048, "in": 0.0254}
        closest = {f"l{index}": round(draw.uniform(0.15, 40), draw.choice([2, 5])) for index in range(4 if COUNT == 12 else 48)}
        with tempfile.TemporaryDirectory() as folder:
            text = "".join(lens(name, "", f"focal_length_mm = 25\nf_number = [2.8, 2.8]\nclosest_m = {near}\n")
                           for name, near in closest.items()).replace(SCENE, quick_scene(folder))
            daemon = Daemon(config="version = 1\n" + text)
            try:
                listed_text = daemon.lensctl("list").stdout
                self.assertIn(" f/2.8,", listed_text)
                self.assertNotIn("..2.8", listed_text)
                for name, near in closest.items():
                    for unit, size in metres.items():
                        refused = daemon.lensctl("focus", name, f"{0.9 * near / size:.6f}{unit}")
                        self.assertEqual(refused.returncode, 6, refused.stderr)
                        printed = re.search(r"may reach: ([0-9.]+) (\w+) to infinity", refused.stderr)
                        with self.subTest(near=near, said=refused.stderr):
                            self.assertNotEqual(daemon.lensctl("focus", name, printed.group(1) + printed.group(2)).returncode, 6)
                            self.assertAlmostEqual(float(printed.group(1)) * metres[printed.group(2)] / near, 1, delta=2e-3)
                # A distance as it is printed, with where it starts.
                for words, origin in (("the lens centre", "lens"), ("the sensor", "sensor")):
                    place = [json.loads(daemon.lensctl("focus", "l0", *how, "--json").stdout)["vergenceD"]
                             for how in ((f"60 m (0.0167 D) from {words}",), ("60m", "--from", origin))]
                    self.assertEqual(place[0], place[1])
            finally:
                self.assertEqual(daemon.stop(), 0)

    def test_what_cannot_be_is_refused_with_the_key(self):
        for optics, words in (("closest_m = 0.02\n", "within the focal length"),
                              ('extension_mm = [0, 1]\nclosest_from = "sensor"\n', "leave closest_from out"),
                              ('liquid = true\npower_d = [38, 48]\nclosest_from = "lens"\n', "leave closest_from out"),
                              ('closest_m = 0.099\nclosest_from = "sensor"\n', "100 mm"),
                              ("closest_m = 0.3\nextension_mm = [0, 1]\n", "one of the two"),
                              ("closest_m = 0.3\nliquid = true\npower_d = [38, 48]\n", "one of the two"),
                              ('closest_m = 0.3\nclosest_from = "tripod"\n', "closest_from"),
                              ("", "docs/lenses.md")):
            with self.subTest(optics=optics):
                done = check(lens("a", "", "focal_length_mm = 25\nf_number = [1.4, 16]\n" + optics))
                self.assertEqual(done.returncode, 78, done.stderr)
                self.assertIn("[lens.optics]", done.stderr)
                self.assertIn("closest_", done.stderr)
                self.assertIn(words, done.stderr)


def check(text, files=()):
    with tempfile.TemporaryDirectory() as folder:
        for name, content in (("lensd.toml", "version = 1\n" + text), *files):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(content)
        return subprocess.run([os.path.join(BIN, "lensd"), "--config", os.path.join(folder, "lensd.toml"), "--check-config"],
                              capture_output=True, text=True, timeout=60 * PATIENCE, check=False)


def named(model):
    return f'[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{SCENE}"\noptics = "{model}"\n'


class Models(unittest.TestCase):
    def test_every_model_names_its_document_and_is_taken(self):
        files = sorted(os.listdir(LENSES))
        self.assertGreater(len(files), 2)
        text = "version = 1\n"
        for index, file in enumerate(files):
            with open(os.path.join(LENSES, file), encoding="utf-8") as model:
                self.assertRegex(model.read(), r'\ndocument = "[^"]{20,}"\n')
            text += named(file.removesuffix(".toml")).replace('"a"', f'"l{index}"')
        lenses = listed(text)
        for one, file in zip(lenses, files):
            with open(os.path.join(LENSES, file), encoding="utf-8") as model:
                f_mm = float(re.search(r"focal_length_mm = (.*)", model.read()).group(1))
            self.assertEqual(one["optics"]["focalLengthMm"], f_mm)

    def test_a_closest_distance_beside_a_model_starts_where_the_models_does(self):
        """Unless closest_from is beside it too. The focal lengths and origins are drawn; what is expected is reckoned exactly."""
        draw = random.Random(506)
        for begin in range(0, COUNT, 12):
            text, expected = "version = 1\n", {}
            folder = tempfile.TemporaryDirectory()
            self.addCleanup(folder.cleanup)
            for index in range(begin, begin + 12):
                f_mm, gap_mm = draw.uniform(2, 300), draw.choice([0, 7.5])
                origin, other = draw.sample(["lens", "sensor"], 2)
                # Possible from either origin; the model's own closest distance is another one and must not count.
                closest = round((4.05 * f_mm + gap_mm) * draw.uniform(1, 9), 2) / 1000
                path = os.path.join(folder.name, f"l{index}.toml")
                with open(path, "w", encoding="utf-8") as model:
                    reach = draw.choice([f'closest_m = {3 * closest}\nclosest_from = "{origin}"\n'] * 3 + ["extension_mm = [0, 0.5]\n"])
                    model.write(f'version = 1\ndocument = "the data sheet of this test"\nfocal_length_mm = {f_mm}\nf_number = [2, 16]\n'
                                f'principal_gap_mm = {gap_mm}\n{reach}')
                from_model = origin if "closest_from" in reach else "lens"
                beside, origin = draw.choice([("", from_model), (f'closest_from = "{other}"\n', other)])
                text += lens(f"l{index}", "", f'model = "{path}"\nclosest_m = {closest}\n{beside}')
                expected[f"l{index}"] = 1e3 * extension_of(f_mm / 1e3, closest, origin, gap_mm / 1e3)
            for one in listed(text):
                with self.subTest(lens=one["name"], text=text):
                    want = expected.pop(one["name"])
                    self.assertAlmostEqual(one["optics"]["extensionMaxMm"], want, delta=1e-8 * want)
            self.assertEqual(expected, {})
        at_sensor = lens("a", "", 'model = "hasselblad-hcd-50-ii"\nclosest_m = 0.6\n')
        for one in listed("version = 1\n" + at_sensor):
            with open(os.path.join(LENSES, "hasselblad-hcd-50-ii.toml"), encoding="utf-8") as model:
                f = float(re.search(r"focal_length_mm = (.*)", model.read()).group(1)) / 1e3
            want = 1e3 * extension_of(f, 0.6, "sensor", one["optics"]["principalGapMm"] / 1e3)
            self.assertAlmostEqual(one["optics"]["extensionMaxMm"], want, delta=1e-8 * want)

    def test_other_keys_take_precedence_and_mistakes_are_named(self):
        own = 'version = 1\ndocument = "a data sheet"\nfocal_length_mm = 25\nf_number = [1.4, 16]\nclosest_m = 0.3\n'
        beside = lens("a", "", 'model = "mine.toml"\nextension_mm = [0, 1.6]\n')
        self.assertEqual(check(beside, [("mine.toml", own)]).returncode, 0)
        self.assertEqual(check(named("mine.toml"), [("mine.toml", own)]).returncode, 0)
        for text, files, words in ((named("raspberry-pi-camera-modle-3"), [], 'did you mean "raspberry-pi-camera-module-3"'),
                                   (named("nothing-like-it"), [], "docs/lenses.md"), (named("no.toml"), [], "there is no file"),
                                   (named("mine.toml"), [("mine.toml", own.replace("document", "documnt"))], "document"),
                                   (named("mine.toml"), [("mine.toml", own.replace("25", "-25"))], "mine.toml:3"),
                                   (named("../lenses/x"), [], "no lens model")):
            with self.subTest(text=text):
                done = check(text, files)
                self.assertEqual(done.returncode, 78, done.stderr)
                self.assertIn(words, done.stderr)


class Without(unittest.TestCase):
    def test_what_is_refused_for_want_of_optics_says_what_to_configure(self):
        with subprocess.Popen([os.path.join(BIN, "sim-modbus-drive"), "--tcp", "0", "--unit", "1", "--unit", "2", "--unit", "3"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as drives:
            port = re.search(r"(\d+)\s*$", drives.stdout.readline()).group(1)
            text = (f'version = 1\n[[bus]]\nname = "b"\ndriver = "modbus"\nhost = "127.0.0.1:{port}"\nresponse_timeout_ms = 300\n'
                    '[[lens]]\nname = "ring"\ndriver = "modbus"\nbus = "b"\n')
            for unit, axis in enumerate(("focus", "iris", "zoom"), 1):
                text += f'[lens.drives.{axis}]\nunit = {unit}\nprofile = "oriental-az"\nrange = [0, 20000]\nhoming = "not-needed"\n'
            daemon = Daemon(config=text + '[lens.focus]\ndirection = "near-positive"\n')
            try:
                for words in (("focus", "1m"), ("focus", "2D"), ("focus", "hyperfocal"), ("aperture", "2.8"), ("zoom", "35mm"),
                              ("plan", "ring", "--sharp", "1m..2m:8um"), ("calibrate", "ring", "--point", "0=inf", "--point", "9=1m"),
                              ("stack", "ring", "--sharp", "1m..2m:8um", "-o", daemon.folder.name + "/s")):
                    done = daemon.lensctl(*words, "--json")
                    with self.subTest(words=words, said=done.stdout + done.stderr):
                        self.assertEqual(done.returncode, 8)
                        for part in ("[lens.optics]", "focal_length_mm", "f_number", "closest_m", "docs/lenses.md"):
                            self.assertIn(part, json.loads(done.stdout)["message"])
                            self.assertIn(part, done.stderr)
            finally:
                self.assertEqual(daemon.stop(), 0)
                drives.stdin.write("quit\n")
                drives.stdin.close()
                drives.wait(timeout=30)


if __name__ == "__main__":
    unittest.main()
