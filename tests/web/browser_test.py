"""The page in Chromium, on the simulator: every control is used, and looked at in two widths and both colours; tokens let people
in. How many pictures a second it shows is in page_rate_test.py."""
import json
import os
import shutil
import subprocess
import sys
import unittest

from web_harness import HERE, MOVE_TOKEN, PATIENCE, VIEW_TOKEN, WebTest, temporary_folder, token_file

ROOT = os.path.join(HERE, "..", "..")
# Where script/bootstrap puts it.
MODULES = os.path.join(ROOT, "build", "browser", "node_modules")


class BrowserTest(WebTest):
    def page(self, what, *arguments):
        folder = os.path.join(os.environ.get("LENSD_BUILD", os.path.join(ROOT, "build")), "page")
        os.makedirs(folder, exist_ok=True)
        return subprocess.Popen(["node", os.path.join(HERE, "browser.cjs"), what, f"http://127.0.0.1:{self.web.port}/", folder, *arguments],
                                env={**os.environ, "NODE_PATH": MODULES}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def browse(self, what, *arguments):
        page = self.page(what, *arguments)
        told, why = page.communicate(timeout=100 * PATIENCE)
        self.assertEqual(page.returncode, 0, why)
        return json.loads(told)


class PageTest(BrowserTest):
    config = (f'version = 1\n[[lens]]\nname = "bike"\ndriver = "sim"\nscene = "{os.path.join(ROOT, "scenes", "motorcycle.toml")}"\n')

    def test_every_control(self):
        measured = self.browse("controls")
        print(measured)
        self.assertGreater(measured["rateAtRest"], 1)
        self.assertGreater(measured["rateInAutofocus"], 0)


LIGHT = """version = 1
[camera]
width = 320
height = 240
bits = 12
exposure_ms = 1
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 8192
initial_f_number = 2.0
[[surface]]
kind = "wall"
distance_m = 3.0
constant = 0.0
[[light]]
x = 0.5
y = 0.5
distance_m = 3.0
intensity = 400.0
"""


class SceneTest:
    """One lens, before a scene of the test's own."""
    scene = ""

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        path = os.path.join(cls.folder.name, "scene.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(cls.scene)
        cls.config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{path}"\n'
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()


class DiskTest(SceneTest, BrowserTest):
    """A point of light at 3 m before darkness."""

    scene = LIGHT

    def test_blur_is_drawn_to_scale(self):
        print(self.browse("disks"))


WALL = """version = 1
[camera]
width = 480
height = 360
pixel_um = 5.0
bits = 12
full_well_e = 20000
read_noise_e = 3.0
exposure_ms = 2
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 8192
iris_steps = 400
initial_f_number = 2.0
[[surface]]
kind = "wall"
distance_m = 2.0
texture = "{texture}"
"""


class BlurTest(SceneTest, BrowserTest):
    """A wall with a photograph on it."""

    scene = WALL.format(texture=os.path.join(ROOT, "scenes", "motorcycle", "left.png"))

    def test_measured_blur_is_there(self):
        print(self.browse("blur"))


SLANT = """version = 1
[camera]
width = 400
height = 300
pixel_um = 5.5
bits = 8
full_well_e = 3000
read_noise_e = 3.0
exposure_ms = 5
frame_rate_hz = 100
[lens]
focal_length_mm = 35.0
f_number = [4.0, 16.0]
extension_mm = [1.75, 2.84]
steps = 297
speed_steps_per_s = 1200
initial_f_number = 4.0
[[surface]]
kind = "plane"
vergence_d = [1.78, 0.083, -0.087]
texture = "{texture}"
texture_px_per_image_px = 1.0
"""


class MapTest(SceneTest, BrowserTest):
    """A plane that is not square to the axis: its vergence in each part of the picture is in the scene."""

    scene = SLANT.format(texture=os.path.join(ROOT, "scenes", "textures", "gravel.png"))

    def test_a_focus_map_shows_how_the_plane_lies(self):
        told = self.browse("map")
        self.assertEqual(told["parts"], [24, 24], told)
        # The middles of the corners of 6 by 4 parts.
        across, down = 0.083 * 5 / 6, 0.087 * 3 / 4
        for shown, vergence in zip(told["mm"], (1.78 + across + down, 1.78 - across - down)):
            self.assertAlmostEqual(shown, 1000 / vergence, delta=0.01 * 1000 / vergence)


class OddTest(BrowserTest):
    """Lenses that lack something, and hands that press anything: one without optics, one that is away, one that is whole, one
    without a camera."""

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        small = os.path.join(HERE, "..", "daemon", "small.toml")
        with open(small, encoding="utf-8") as file:
            scene = file.read()
        away = os.path.join(cls.folder.name, "away.toml")
        with open(away, "w", encoding="utf-8") as file:
            file.write(scene + '\n[[fault]]\nkind = "disconnect"\nat_ms = 0\n')
        cls.config = "version = 1\n" + "".join(f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{path}"\n'
                                               for name, path in (("whole", small), ("away", away)))
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_nothing_breaks(self):
        for seed in (1, 2):
            print(self.browse("odd", str(seed)))


class NoLensTest(BrowserTest):
    config = "version = 1\n"

    def test_nothing_breaks_where_there_is_nothing(self):
        print(self.browse("odd", "3"))


class RestartTest(BrowserTest):
    lenses = ("a",)

    def test_lensd_goes_and_comes_back(self):
        page = self.page("restart")
        self.assertEqual(page.stderr.readline(), "open\n")
        self.daemon.process.terminate()
        self.assertEqual(self.daemon.process.wait(timeout=20 * PATIENCE), 0)
        self.assertEqual(page.stderr.readline(), "missed\n")
        self.daemon.process = subprocess.Popen(self.daemon.process.args, stderr=subprocess.DEVNULL)
        told, why = page.communicate(timeout=100 * PATIENCE)
        self.assertEqual(page.returncode, 0, why)
        print(told, end="")


class TokenPageTest(BrowserTest):
    lenses = ("a",)

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.arguments = ("--token-file", token_file(cls.folder.name))
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_who_gets_in(self):
        self.browse("tokens", VIEW_TOKEN, MOVE_TOKEN)


def main():
    if not shutil.which("chromium") or not shutil.which("node") or not os.path.isdir(os.path.join(MODULES, "puppeteer-core")):
        print("skipped: chromium, node or puppeteer-core is not installed; script/bootstrap test installs them")
        sys.exit(77)
    unittest.main()


if __name__ == "__main__":
    main()
