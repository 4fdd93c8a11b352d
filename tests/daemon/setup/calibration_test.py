"""Calibration, backlash, presets, zoom and exposure through lensctl: what is said, kept, refused and found again."""
import json
import os
import random
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, Daemon  # noqa: E402

SCENE = """version = 1
[camera]
width = 96
height = 96
pixel_um = 3.45
exposure_ms = 2
frame_rate_hz = 200
[lens]
focal_length_mm = {focal}
f_number = [1.4, 16.0]
extension_mm = [0.0, 3.0]
steps = 4001
speed_steps_per_s = 40000
backlash_steps = 120
[[surface]]
kind = "wall"
distance_m = {distance}
texture = "{root}/scenes/textures/brick.png"
[truth]
region = [0.1, 0.1, 0.8, 0.8]
"""
ROOT = os.path.dirname(os.path.dirname(HERE))


class CalibrationTest(unittest.TestCase):
    """A daemon with a state folder that outlives it; the nominal optics are wrong on purpose."""
    focal = "[25.0, 40.0]"
    extension_max = "2.6"

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-calibration-")
        self.state = os.path.join(self.folder.name, "state")
        os.environ["STATE_DIRECTORY"] = self.state
        with open(os.path.join(self.folder.name, "scene.toml"), "w", encoding="utf-8") as file:
            file.write(SCENE.format(focal=self.focal, distance=1.2, root=ROOT))
        self.daemon = None
        self.start()

    def tearDown(self):
        self.daemon.stop()
        del os.environ["STATE_DIRECTORY"]
        self.folder.cleanup()

    def config(self, more=""):
        focal = self.focal
        return (f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{self.folder.name}/scene.toml"\n'
                f'[lens.optics]\nfocal_length_mm = {focal}\nf_number = [1.4, 16]\nextension_mm = [0.2, {self.extension_max}]\n{more}')

    def start(self, more=""):
        if self.daemon:
            self.assertEqual(self.daemon.stop(), 0)
        self.daemon = Daemon(config=self.config(more))

    def ask(self, *arguments, status=0, **options):
        done = self.daemon.lensctl(*arguments, "--json", **options)
        self.assertEqual(done.returncode, status, done.stderr + done.stdout)
        return json.loads(done.stdout) if done.stdout else done.stderr

    def true_steps(self, metres, focal=25.0):
        extension = focal ** 2 / (metres * 1e3 - focal)
        return extension / 3.0 * 4000

    def test_points_by_hand_make_a_calibration_that_is_kept(self):
        self.assertEqual(self.ask("status")["grade"], "uncalibrated")
        points = [f"{self.true_steps(d):.2f}={d}m" for d in (0.3, 0.4, 0.6, 1.0, 3.0)] + ["0=inf"]
        info = self.ask("calibrate", *(word for point in points for word in ("--point", point)))
        self.assertEqual(info["grade"], "calibrated")
        self.assertLess(info["errorUm"], 5.0)
        self.assertEqual(info["file"], os.path.join(self.state, "a.calibration.toml"))
        for _ in range(2):
            move = self.ask("focus", "0.8m")
            self.assertAlmostEqual(move["position"], self.true_steps(0.8), delta=4)
            self.assertGreater(move["extensionBoundUm"], info["errorUm"])
            self.assertGreater(move["vergenceBoundD"], 0)
            status = self.ask("status")
            self.assertEqual(status["grade"], "calibrated")
            self.assertGreater(status["calibrationErrorUm"], 0)
            listed = self.ask("list")[0]["optics"]
            self.assertEqual(listed["grade"], "calibrated")
            self.assertAlmostEqual(listed["extensionMaxMm"], 3.0, delta=0.01)
            self.assertGreater(listed["sensorToleranceUm"], info["errorUm"])
            self.start()  # again after a restart
        shown = self.daemon.lensctl("calibrate", "--show")
        self.assertIn("[[focus]]", shown.stdout)
        self.assertIn("calibrated", self.daemon.lensctl("status").stdout)
        self.assertEqual(self.ask("calibrate", "--remove")["grade"], "uncalibrated")
        self.assertFalse(os.path.exists(info["file"]))

    def test_what_a_removal_takes_and_leaves_is_listed(self):
        curve, backlash = "the curve of focus through 5 points", "the backlash of focus (12 steps)"
        for parts in ((), (curve,), (backlash,), (curve, backlash)):
            for takes_all in (False, True):
                with self.subTest(parts=parts, takes_all=takes_all):
                    self.ask("calibrate", "--remove", "--all")
                    if backlash in parts:
                        self.ask("backlash", "focus", "--steps", "12")
                    if curve in parts:
                        self.ask("calibrate", *(word for n in range(5) for word in ("--point", f"{n * 900}=ext:{n * 0.6}mm")))
                    words = self.daemon.lensctl("calibrate", "--remove", *(["--all"] * takes_all))
                    self.assertEqual(words.returncode, 0, words.stderr)
                    for part in parts:
                        goes = takes_all or part == curve
                        self.assertIn(part, words.stdout.partition("removed: ")[2].partition("; still there: ")[0 if goes else 2])
                    shown = self.daemon.lensctl("calibrate", "--show").stdout
                    self.assertNotIn("[[focus]]", shown)
                    self.assertEqual("backlash" in shown, backlash in parts and not takes_all)
                    told = self.ask("calibrate", "--remove")
                    self.assertEqual((told["removed"], told["kept"]),
                                     ([], [backlash] if backlash in parts and not takes_all else []))

    def test_a_point_beyond_the_axis_is_refused(self):
        draw = random.Random(41)
        for _ in range(10):
            wrong = draw.choice([-1, 1]) * draw.randint(1, 10**draw.randint(1, 6))
            wrong = wrong if wrong < 0 else 4000 + wrong
            done = self.daemon.lensctl("calibrate", "--point", "0=inf", "--point", f"{wrong}=0.3m", "--error", "5um", "--json")
            self.assertEqual(done.returncode, 6, done.stderr)
            self.assertIn("but focus reaches 0 to 4000 steps", done.stderr)
            told = json.loads(done.stdout)
            self.assertEqual((told["axis"], told["parameter"], told["minimum"], told["maximum"]), ("focus", "points[1].position", 0, 4000))
        self.assertEqual(self.ask("status")["grade"], "uncalibrated")

    def test_a_limit_is_told_from_a_wish_beyond_it(self):
        draw = random.Random(12)
        for _ in range(5):
            # A round wish, and an end of the range that four digits round onto it, more than half a step away.
            wish = draw.randint(220, 260) / 100
            self.extension_max = f"{wish - draw.uniform(0.0004, 0.00049):.6f}"
            self.start()
            done = self.daemon.lensctl("focus", f"ext:{wish}mm", "--json")
            self.assertEqual(done.returncode, 6, done.stderr)
            wished, _, reach = done.stderr.strip().removeprefix("lensctl: ").partition(" of extension is outside what focus may reach: ")
            self.assertEqual(wished, f"{wish:g} mm")
            end, _, difference = reach.partition(" to ")[2].partition(", and the wish lies ")
            self.assertNotEqual((wished, difference), (end, ""), done.stderr)
            self.assertEqual(json.loads(done.stdout)["message"] + "\n", done.stderr.removeprefix("lensctl: "))

    def test_without_a_state_folder_presets_say_so(self):
        self.assertNotIn("note", self.ask("preset", "save", "one"))
        self.assertEqual(self.daemon.lensctl("preset", "list").stderr, "")
        del os.environ["STATE_DIRECTORY"]
        try:
            self.start()
        finally:
            os.environ["STATE_DIRECTORY"] = self.state
        self.assertIn("lost when lensd ends", self.ask("preset", "save", "one")["note"])
        self.assertIn("lensd --state DIR", self.daemon.lensctl("preset", "save", "two").stdout)
        listed = self.daemon.lensctl("preset", "list")
        self.assertIn("lost when lensd ends", listed.stderr)
        self.assertEqual(listed.stdout.count("\n"), 2)

    def test_two_stops_and_a_data_sheet_are_approximate(self):
        refused = self.daemon.lensctl("calibrate", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet")
        self.assertEqual(refused.returncode, 64)
        self.assertIn("four depths", refused.stderr)
        info = self.ask("calibrate", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet", "--error", "20um")
        self.assertEqual((info["grade"], info["errorUm"]), ("approximate", 20.0))
        self.assertAlmostEqual(self.ask("focus", "1m")["position"], self.true_steps(1.0), delta=1)

    def test_a_plan_counts_the_error(self):
        wide = ("plan", "a", "--sharp", "0.9m..1.1m:20um")
        before = self.ask(*wide)
        self.ask("calibrate", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet", "--error", "8um")
        after = self.ask(*wide)
        self.assertTrue(before["feasible"] and after["feasible"])
        self.assertGreater(after["fNumber"], before["fNumber"])
        # 8 um beside the sensor are 8 um/N of blur.
        self.ask("calibrate", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet", "--error", "900um")
        self.assertFalse(self.ask(*wide, status=1)["feasible"])

    def test_out_of_order_points_and_bad_files_change_nothing(self):
        refused = self.daemon.lensctl("calibrate", "--point", "0=inf", "--point", "900=1m", "--point", "500=0.5m",
                                      "--error", "5um")
        self.assertEqual(refused.returncode, 64)
        self.assertIn("out of order", refused.stderr)
        path = os.path.join(self.folder.name, "bad.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write('version = 1\nserial = ""\ncolour = "red"\n')
        refused = self.daemon.lensctl("calibrate", "--from-file", path)
        self.assertEqual(refused.returncode, 65)
        self.assertIn(':3: unknown key "colour"', refused.stderr)
        self.assertEqual(self.ask("calibrate", "--show")["grade"], "uncalibrated")

    def test_a_file_the_configuration_names(self):
        path = os.path.join(self.folder.name, "a.toml")
        self.start('calibration = "' + path + '"\n')
        self.ask("calibrate", "--point", "0=inf", "--point", "4000=ext:3mm", "--error", "2um")
        self.assertTrue(os.path.exists(path))
        self.start('calibration = "' + path + '"\n')
        self.assertEqual(self.ask("status")["grade"], "calibrated")
        with open(path, "a", encoding="utf-8") as file:
            file.write("\n[oops]\n")
        self.daemon.stop()
        self.daemon = Daemon(config=self.config('calibration = "' + path + '"\n'))
        with self.daemon.client() as client:  # that lens alone is at fault, and says why
            lens = client.call(LENS + "Status")["parameters"]["lenses"][0]
        self.assertEqual((lens["connection"], lens["grade"]), ("connected", "uncalibrated"))
        self.assertIn('unknown key "oops"', lens["warnings"][0])
        with open(path, encoding="utf-8") as damaged, open(path + ".damaged", encoding="utf-8") as copy:
            self.assertEqual(copy.read(), damaged.read())
        self.daemon.stop()
        self.daemon = Daemon(config=self.config())

    def test_guided(self):
        # Every target of this bench is its one wall: so its only honest guided calibration is refused.
        done = self.daemon.lensctl("calibrate", "--at", "1.2m", "--repeat", "2", input="\n")
        self.assertEqual(done.returncode, 64, done.stderr)
        self.assertIn("two depths", done.stderr)
        self.assertIn("press Enter", done.stderr)
        done = self.daemon.lensctl("calibrate", "--at", "1.2m", "--at", "2m", "--repeat", "1", input="\n")
        self.assertEqual(done.returncode, 66, done.stderr)

    def test_backlash(self):
        measured = self.ask("backlash")
        self.assertTrue(measured["measured"], measured)
        self.assertAlmostEqual(measured["size"], 120, delta=2)
        self.assertLess(measured["sizeHigh"] - measured["sizeLow"], 6)
        said = self.ask("backlash", "a", "focus", "--steps", "77")
        self.assertEqual((said["size"], said["measured"]), (77, False))
        for size, status in (("400", 0), ("401", 6), ("1e9", 6)):  # of 4001 steps
            done = self.daemon.lensctl("--json", "backlash", "a", "focus", "--steps", size)
            self.assertEqual(done.returncode, status, done.stdout)
        told = json.loads(done.stdout)
        self.assertEqual((told["parameter"], told["minimum"], told["maximum"], told["unit"]), ("size", 0, 400, "steps"), told)
        self.ask("backlash", "a", "focus", "--steps", "77")
        self.start()
        self.assertIn("[backlash.focus]", self.daemon.lensctl("calibrate", "--show").stdout)
        self.assertEqual(self.daemon.lensctl("backlash", "a", "iris").returncode, 8)

    def test_presets(self):
        self.ask("zoom", "30mm", "--free")
        self.ask("focus", "1m")
        self.ask("aperture", "4")
        saved = self.ask("preset", "save", "door")
        self.assertAlmostEqual(saved["focalLengthMm"], 30, delta=0.02)
        self.assertAlmostEqual(saved["focalPlaneM"], 1.0, delta=0.003)
        self.ask("preset", "save", "a", "another")
        self.start()
        self.assertEqual([preset["label"] for preset in self.ask("preset", "list")], ["another", "door"])
        recall = self.ask("preset", "recall", "door")
        self.assertTrue(recall["reached"])
        self.assertEqual([move["axis"] for move in recall["moves"]], ["zoom", "iris", "focus"])
        self.assertAlmostEqual(recall["moves"][2]["vergenceD"], 1.0, delta=recall["vergenceBoundD"])
        csv = self.daemon.lensctl("preset", "list", "--csv").stdout.splitlines()
        self.assertEqual(len(csv), 3)
        self.assertTrue(csv[0].startswith("label,saved,focusPosition"))
        self.assertEqual({line.count(",") for line in csv}, {13})
        self.ask("preset", "remove", "door")
        gone = self.daemon.lensctl("preset", "recall", "door")
        self.assertEqual(gone.returncode, 68)
        self.assertIn("there is another", gone.stderr)
        self.assertEqual(self.daemon.lensctl("preset", "save", "a", "no,commas").returncode, 64)

    def test_zoom_keeps_the_plane_and_aperture_the_brightness(self):
        self.ask("focus", "1.5m")
        zoomed = self.ask("zoom", "35mm")
        self.assertAlmostEqual(zoomed["focalLengthMm"], 35, delta=0.02)
        self.assertGreater(zoomed["trackingBoundUm"], 0)
        self.assertAlmostEqual(self.ask("status")["focalPlaneM"], 1.5, delta=0.01)
        text = self.daemon.lensctl("zoom", "35mm").stdout
        self.assertIn(" mm within ", text)
        self.assertNotRegex(text, r"within [0-9.e-]+ steps")  # one bound, in the unit of what it bounds
        far = self.daemon.lensctl("zoom", "90mm")
        self.assertEqual(far.returncode, 6)
        before = self.ask("aperture", "4")
        bright = self.ask("aperture", "5.6", "--keep-brightness")
        self.assertAlmostEqual(bright["exposureMs"], 2 * (bright["fNumber"] / before["fNumber"]) ** 2, delta=0.01)
        self.assertAlmostEqual(bright["brightnessRatio"], 1.0, delta=1e-6)
        limited = self.ask("aperture", "16", "--keep-brightness")
        self.assertLess(limited["brightnessRatio"], 0.5)
        self.assertIn("darker", limited["reason"])
        self.assertEqual(limited["cause"], "exposure")
        self.assertEqual(self.daemon.lensctl("filter", "2").returncode, 8)


if __name__ == "__main__":
    unittest.main()
