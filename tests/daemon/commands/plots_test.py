"""--plot of the commands that need a lens: autofocus, calibrate, backlash, stack and plan."""
import os
import sys
import tempfile
import unittest
import xml.etree.ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import Daemon, DaemonTest, HERE  # noqa: E402

SVG = "{http://www.w3.org/2000/svg}"
CURVE = ["--point", "0=inf", "--point", "1000=ext:0.4mm", "--point", "2500=ext:1.01mm", "--point", "4000=ext:1.6mm", "--error", "9um"]


class Plots(DaemonTest):
    lenses = ("a",)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def draw(self, *arguments, name="e.svg", status=(0,), option="--plot"):
        path = os.path.join(self.folder, name)
        done = self.daemon.lensctl(*arguments, option, path)
        self.assertIn(done.returncode, status, done.stderr)
        with open(path, "rb") as file:
            data = file.read()
        os.remove(path)
        return data

    def texts(self, *arguments, option="--plot"):
        svg = self.draw(*arguments, option=option)
        return [text.text for text in xml.etree.ElementTree.fromstring(svg).iter(SVG + "text")]

    def test_a_calibration_is_drawn_when_made_and_when_shown(self):
        for arguments in ([*CURVE], ["--show"]):
            texts = self.texts("calibrate", "a", *arguments)
            for text in ("a: what its focus positions mean (calibrated)", "extension within 9 um", "native focus position",
                         "sensor distance beyond the focal length [mm]"):
                self.assertIn(text, texts)
        self.assertEqual(self.daemon.lensctl("calibrate", "a", "--remove").returncode, 0)
        nothing = self.daemon.lensctl("calibrate", "a", "--show", "--plot", os.path.join(self.folder, "e.svg"))
        self.assertEqual(nothing.returncode, 1)
        self.assertIn("no measured curve", nothing.stderr)
        self.assertEqual(os.listdir(self.folder), [])

    def test_backlash_is_drawn(self):
        texts = self.texts("backlash", "a", "--steps", "12")
        for text in ("a: a reversal of focus loses 12 native units", "as stated, not measured", "outward", "back"):
            self.assertIn(text, texts)

    def test_autofocus_is_drawn_as_png_too(self):
        # A search that a busy machine keeps from its answer is drawn as well.
        searched = self.draw("autofocus", "a", "--range", "@1100..@1600", "--deadline", "8s", name="e.png", status=(0, 1))
        self.assertTrue(searched.startswith(b"\x89PNG"))

    def test_plan_and_stack_name_the_lens(self):
        self.assertIn("a: settings that meet every limit", self.texts("plan", "a", "--sharp", "1m:30um"))
        rays = self.texts("plan", "a", "--sharp", "1m:30um", option="--rays")
        self.assertIn("a: the way of the light at the plan", rays)
        self.assertIn("sharp[0] at 1 m", rays)
        limits = ["--sharp", "0.8m..3m:10um"]
        self.assertTrue(any(text.startswith("a: sharp from shot to shot of a stack of ")
                            for text in self.texts("plan", "a", "--stack", *limits)))
        self.assertTrue(any(text.startswith("a: sharp from shot to shot of a stack of ")
                            for text in self.texts("stack", "a", *limits, "-o", os.path.join(self.folder, "shots"))))

    def test_principal_planes_that_are_apart_are_drawn(self):
        scene = os.path.join(HERE, "small.toml")
        daemon = Daemon(config=f"""version = 1
[[lens]]
name = "a"
driver = "sim"
scene = "{scene}"
[lens.optics]
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
principal_gap_mm = 3.5
""")
        self.addCleanup(daemon.kill)
        path = os.path.join(self.folder, "e.svg")
        done = daemon.lensctl("plan", "a", "--sharp", "1m:30um", "--rays", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(path, encoding="utf-8") as file:
            texts = [text.text for text in xml.etree.ElementTree.fromstring(file.read()).iter(SVG + "text")]
        self.assertIn("H", texts)
        self.assertIn("H′", texts)
        self.assertTrue(any(text.endswith("H to H′ 3.5 mm") for text in texts), texts)
        self.assertNotIn("H", self.texts("plan", "a", "--sharp", "1m:30um", option="--rays"))


if __name__ == "__main__":
    unittest.main()
