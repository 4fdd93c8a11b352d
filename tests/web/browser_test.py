"""The page in Chromium, on the simulator: every control is used, and looked at in two widths and both colours; pictures are
counted; tokens let people in."""
import json
import os
import shutil
import subprocess
import sys
import unittest

from web_harness import HERE, MOVE_TOKEN, PATIENCE, VIEW_TOKEN, WebTest, temporary_folder, token_file
from speed_test import JUDGED, replay

ROOT = os.path.join(HERE, "..", "..")
# Where script/bootstrap puts it.
MODULES = os.path.join(ROOT, "build", "browser", "node_modules")


class BrowserTest(WebTest):
    def browse(self, what, *arguments):
        folder = os.path.join(os.environ.get("LENSD_BUILD", os.path.join(ROOT, "build")), "page")
        os.makedirs(folder, exist_ok=True)
        done = subprocess.run(["node", os.path.join(HERE, "browser.cjs"), what, f"http://127.0.0.1:{self.web.port}/", folder, *arguments],
                              env={**os.environ, "NODE_PATH": MODULES}, capture_output=True, text=True, timeout=100 * PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)


class PageTest(BrowserTest):
    config = (f'version = 1\n[[lens]]\nname = "bike"\ndriver = "sim"\nscene = "{os.path.join(ROOT, "scenes", "motorcycle.toml")}"\n')

    def test_every_control(self):
        measured = self.browse("controls")
        print(measured)
        self.assertGreater(measured["rateAtRest"], 1)
        self.assertGreater(measured["rateInAutofocus"], 0)


class RateTest:
    """Different pictures a second on the screen."""
    width, height, rate, least = 0, 0, 0, 0

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.config = replay(cls.folder.name, cls.width, cls.height, cls.rate)
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_pictures_a_second(self):
        measured = self.browse("rate")
        print(f"{self.width}x{self.height}: {measured}")
        for kind in ("rateAtRest", "rateInMotion"):
            self.assertGreaterEqual(measured[kind], self.least if JUDGED else 1)


class SmallRateTest(RateTest, BrowserTest):
    width, height, rate, least = 640, 480, 60, 30


class LargeRateTest(RateTest, BrowserTest):
    width, height, rate, least = 1920, 1080, 30, 25


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


class DiskTest(BrowserTest):
    """A point of light at 3 m before darkness."""

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        scene = os.path.join(cls.folder.name, "light.toml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(LIGHT)
        cls.config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_blur_is_drawn_to_scale(self):
        print(self.browse("disks"))


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


if __name__ == "__main__":
    if not shutil.which("chromium") or not shutil.which("node") or not os.path.isdir(os.path.join(MODULES, "puppeteer-core")):
        print("skipped: chromium, node or puppeteer-core is not installed; script/bootstrap test installs them")
        sys.exit(77)
    unittest.main()
