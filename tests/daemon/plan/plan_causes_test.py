"""A refused plan names what alone prevents it, in text and JSON, with a lens and without one. The truth: whoever lifts exactly that gets a plan, and
whoever lifts something else does not."""
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from counting_drive import PROFILE, CountingDrive  # noqa: E402
from harness import BIN, Daemon, played_node  # noqa: E402

LEVEL = os.environ.get("LENSD_TEST_LEVEL", "ci")
F_NUMBER, EXTENSION = 1.8, 0.286


class OfALens(unittest.TestCase):
    """A played V4L2 node: 1024 steps of focus, a fixed aperture, backlash not known."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-causes-")
        library = played_node(cls.folder.name)
        node, table = (os.path.join(cls.folder.name, name) for name in ("video0", "table.ctl"))
        for path, text in ((node, ""), (table, "009a090a 1 0 1023 1 0 0 0\n")):
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        os.environ.update({"FAKE_NODE": node, "FAKE_CTL": table, "FAKE_FMT": "320 240 GREY 30"})
        cls.daemon = Daemon(preload=library, config=(
            f'version = 1\n[[lens]]\nname = "cam"\ndriver = "v4l2"\ndevice = "{node}"\nparts = "lens"\n[lens.optics]\n'
            f"focal_length_mm = 4.74\nf_number = [{F_NUMBER}, {F_NUMBER}]\nextension_mm = [0, {EXTENSION}]\n[lens.focus]\ndirection = \"near-positive\"\n"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0
        cls.folder.cleanup()

    def plan(self, *words):
        done = self.daemon.lensctl("plan", "cam", *words, "--json")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        return json.loads(done.stdout)

    def test_backlash_that_is_not_known_and_the_fixed_aperture_are_named(self):
        draw, seen = random.Random(102), {}
        for _ in range(24):
            near = draw.uniform(0.2, 1.0)
            words = ("--sharp", f"{near:.3f}m..{near * draw.uniform(1.0, 1.5):.3f}m:{10**draw.uniform(-1.5, 1.5):.3g}um")
            told = self.plan(*words)
            if told["feasible"]:
                self.assertNotIn("causes", told)
                continue
            causes = {cause["cause"]: cause["reason"] for cause in told["causes"]}
            text = self.daemon.lensctl("plan", "cam", *words).stdout
            for cause, reason in causes.items():
                seen[cause] = seen.get(cause, 0) + 1
                self.assertIn(reason, text)
            self.assertEqual("Possible but for" in text, bool(causes), text)
            with self.subTest(words=words, causes=causes):
                self.assertEqual(self.daemon.lensctl("backlash", "cam", "--steps", "0").returncode, 0)
                self.assertEqual(self.plan(*words)["feasible"], "focusUncertainty" in causes)
                self.assertEqual(self.daemon.lensctl("calibrate", "cam", "--remove", "--all").returncode, 0)
                self.assertRegex(causes.get("focusUncertainty", "the uncertainty of focus (1 um: backlash not known): lensctl backlash cam"),
                                 r"^the uncertainty of focus \([\d.]+ [a-z]+: backlash not known\): lensctl backlash cam$")
                self.assertRegex(causes.get("aperture", "the fixed aperture f/1.8: f/2 would do"), r"^the fixed aperture f/1\.8: f/[\d.]+ would do$")
        self.assertGreaterEqual(min(seen.get(cause, 0) for cause in ("focusUncertainty", "aperture")), 2, seen)

    def test_limits_that_contradict_each_other_have_no_cause_in_the_lens(self):
        words = ("--sharp", "0.5m:5um", "--blurred", "0.5m:50um")
        told = self.plan(*words)
        self.assertEqual((told["feasible"], told["causes"]), (False, []))
        self.assertIn("No setting meets all of this. In conflict: ", self.daemon.lensctl("plan", "cam", *words).stdout)

    def test_a_move_says_that_the_mechanism_may_be_behind_the_motor(self):
        self.daemon.lensctl("focus", "cam", "@900")
        behind = "the mechanism may be up to 103 steps behind the motor, whose backlash is not known: lensctl backlash cam"
        self.assertIn(behind, self.daemon.lensctl("focus", "cam", "@300").stdout)
        self.assertIn(behind, json.loads(self.daemon.lensctl("focus", "cam", "@200", "--json").stdout)["reason"])


class OfADrive(unittest.TestCase):
    """A drive that counts its steps, and whose backlash is not known."""

    def test_a_move_speaks_of_the_motor_and_of_what_may_be_behind_it(self):
        with tempfile.TemporaryDirectory(prefix="lensd-causes-") as folder:
            drive = CountingDrive(shaft=20000)
            self.addCleanup(drive.close)
            drive.get_power(20000)
            profile = os.path.join(folder, "drive.toml")
            with open(profile, "w", encoding="utf-8") as file:
                file.write(PROFILE)
            daemon = Daemon(config=f'version = 1\n[[bus]]\nname = "b"\ndriver = "modbus"\nhost = "127.0.0.1:{drive.port}"\n'
                            f'[[lens]]\nname = "ring"\ndriver = "modbus"\nbus = "b"\n[lens.drives.focus]\nunit = 1\n'
                            f'profile = "{profile}"\nrange = [0, 30000]\n')
            self.addCleanup(daemon.kill)
            daemon.lensctl("here", "ring", "focus", "@20000")
            text = daemon.lensctl("focus", "ring", "@9000").stdout
            self.assertRegex(text, r"^ring: focus motor at 9000 \(not verified\)")
            self.assertIn("the mechanism may be up to 3000 steps behind the motor, whose backlash is not known: lensctl backlash ring", text)


class OfARequest(unittest.TestCase):
    """Without a lens everything that limits a plan is written in the request."""

    @staticmethod
    def plan(asked):
        words = [word for option, value in asked.items() for word in (f"--{option}", value)]
        done = subprocess.run([os.path.join(BIN, "lensctl"), "plan", *words, "--json"], capture_output=True, text=True, check=False)
        assert done.returncode in (0, 1), (words, done.stderr)
        return json.loads(done.stdout)

    def test_what_is_lifted_alone_is_named(self):
        draw, seen, refused = random.Random(41), {}, 0
        while refused < (400 if LEVEL == "long" else 25):
            n, least, near = draw.uniform(1.4, 8), draw.uniform(0, 2), draw.uniform(0.5, 4)
            asked = {"focal-length": "50mm", "f-number": f"{n:.2f}..{n * draw.uniform(1.0, 3):.2f}", "extension": f"{least:.2f}mm..{least + draw.uniform(0, 4):.2f}mm",
                     "sharp": f"{near:.2f}m..{near * draw.uniform(1.0, 1.3):.2f}m:{draw.uniform(5, 60):.0f}um",
                     "blurred": f"{near * draw.uniform(1.5, 4):.2f}m:{draw.uniform(5, 300):.0f}um:behind",
                     "sensor-tolerance": f"{draw.uniform(1, 60):.0f}um", "f-number-tolerance": f"{draw.uniform(0, 40):.1f}%"}
            if draw.random() < 0.3:
                asked["focus"] = f"{near * draw.uniform(0.9, 1.4):.2f}m"
            told = self.plan(asked)
            if told["feasible"]:
                continue
            refused += 1
            named = {cause["cause"] for cause in told["causes"]}
            lifts = {"sensorTolerance": ("sensor-tolerance", "0um"), "fNumberTolerance": ("f-number-tolerance", "0%"),
                     "fNumber": ("f-number", "0.5..128"), "extension": ("extension", "0mm..50mm"), "focus": ("focus", None)}
            for cause, (option, value) in lifts.items():
                lifted = {**asked, option: value}
                possible = self.plan({key: said for key, said in lifted.items() if said is not None})["feasible"]
                seen[cause] = seen.get(cause, 0) + (cause in named)
                self.assertEqual(cause in named, possible, (cause, asked, told["causes"]))
        self.assertGreaterEqual(sum(times > 0 for times in seen.values()), 3, seen)

    def test_what_would_do_does(self):
        told = self.plan({"focal-length": "50mm", "f-number": "2..2.8", "extension": "0mm..3mm", "sharp": "2m..3m:20um"})
        (reason,) = [cause["reason"] for cause in told["causes"] if cause["cause"] == "fNumber"]
        n = float(re.fullmatch(r"the apertures that it may have \(f/2 to f/2\.8\): f/([\d.]+) would do", reason)[1])
        self.assertTrue(self.plan({"focal-length": "50mm", "f-number": f"{n * 1.01:.3f}", "extension": "0mm..3mm", "sharp": "2m..3m:20um"})["feasible"])


if __name__ == "__main__":
    unittest.main()
