"""Near is near, over the network: whichever end of its travel a camera's focus counts from, and whoever says so, focus goes to
the distance that was asked for or the request is refused. Where it really is the simulated camera says, counted from the far
end; what that means is worked out here."""
import itertools
import json
import os
import random
import tempfile
import unittest

from gige_test import OPTICS, Camera, setUpModule, tearDownModule  # noqa: F401
from harness import LENS, Daemon

LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"
FOCAL_LENGTH, TRAVEL, STEPS = 0.025, 1.6e-3, 4000
BY_NAME = {"near": "near-negative", "far": "near-positive"}


def vergence_at(steps_from_far):
    extension = TRAVEL * steps_from_far / STEPS
    return extension / (FOCAL_LENGTH * (FOCAL_LENGTH + extension))


def calibration_of(zero):
    """Of the camera whose focus counts from this end."""
    text = 'version = 1\nserial = "TEST1"\n[[focus]]\napproach = "near"\nerror_um = 1\npoints = [\n'
    for count in range(0, STEPS + 1, 200):
        vergence = vergence_at(STEPS - count if zero == "near" else count)
        text += f"  {{ steps = {count}, vergence_d = {vergence!r} }},\n"
    return text + "]\n"


class DirectionTest(unittest.TestCase):
    def start(self, names, zero, key=None, calibrated=False, state=None):
        self.camera = Camera("--names", names, "--focus-zero", zero)
        self.addCleanup(self.camera.stop)
        self.state = state
        self.open(key, calibration_of(zero) if calibrated else None)

    def open(self, key=None, calibration=None):
        optics = OPTICS
        if calibration:
            file = tempfile.NamedTemporaryFile("w", suffix=".toml", delete=False)
            self.addCleanup(os.unlink, file.name)
            with file:
                file.write(calibration)
            optics += f'calibration = "{file.name}"\n'
        text = ('version = 1\n[[lens]]\nname = "gige"\ndriver = "aravis"\nserial = "TEST1"\npacket_size = 8192\n'
                'io_timeout_ms = 3000\n' + optics + "[lens.focus]\nbacklash = 0\n" + (f'direction = "{key}"\n' if key else ""))
        self.daemon = Daemon(config=text, arguments=("--state", self.state) if self.state else ())
        self.addCleanup(lambda daemon=self.daemon: daemon.process.poll() is None and daemon.stop())

    def truth(self):
        self.camera.process.stdin.write("truth\n")
        self.camera.process.stdin.flush()
        return vergence_at(float(self.camera.process.stdout.readline().split()[1]))

    def ask(self, *arguments):
        done = self.daemon.lensctl("--json", *arguments)
        return done.returncode, json.loads(done.stdout)

    def axis(self):
        return self.ask("list")[1][0]["axes"][0]

    def went_the_true_way(self, wanted):
        status, moved = self.ask("focus", f"{1 / wanted:.6f}m")
        if status != 0:
            return self.refused(status, moved)
        self.assertTrue(moved["reached"], moved)
        self.assertAlmostEqual(self.truth(), wanted, delta=0.003)
        before = self.truth()
        self.assertEqual(self.ask("focus", "near:100")[0], 0)
        self.assertGreater(self.truth(), before + 0.01)
        status, plan = self.ask("plan", "--sharp", "1.4m..1.6m:8um", "--apply")
        self.assertEqual(status, 0, plan)
        self.assertTrue(plan["feasible"], plan)
        self.assertAlmostEqual(self.truth(), plan["focalPlaneD"], delta=0.005)
        return True

    def refused(self, status, said):
        self.assertEqual((status, said["error"]), (8, "unsupported"))
        self.assertIn("`direction`", said["message"])
        self.assertIn("lensctl setup", said["message"])
        before = self.truth()
        for asked in (("focus", "near:100"), ("focus", "ext:0.8mm"), ("focus", "hyperfocal"),
                      ("plan", "--sharp", "1.4m..1.6m:8um", "--apply")):
            status, said = self.ask(*asked)
            self.assertEqual(status, 8, said)
            self.assertIn("`direction`", said["message"])
        self.assertEqual(self.truth(), before)
        status, plan = self.ask("plan", "gige", "--sharp", "1.4m..1.6m:8um")
        self.assertTrue(plan["feasible"], "what a lens could do needs no direction")
        self.assertEqual(self.ask("focus", "@1000")[0], 0)
        return False

    def judge(self, names, zero, key, calibrated):
        """True: it went the true way; False: it was refused; None: it goes by a person's word."""
        truly, other = BY_NAME[zero], BY_NAME["near" if zero == "far" else "far"]
        self.start(names, zero, {"absent": None, "right": truly, "wrong": other}[key], calibrated)
        if key == "wrong" and calibrated:
            self.assertIn("the calibration of focus must focus", self.ask("status")[1]["error"])
            return False
        if key == "wrong":
            self.assertEqual(self.axis()["directionFrom"], "configured")
            return None
        went = self.went_the_true_way(random.Random(names + zero + key).uniform(0.3, 2.0))
        said = {"nearNegative": "near-negative", "nearPositive": "near-positive", None: None}[self.axis()["direction"]]
        self.assertEqual(said, truly if key == "right" or calibrated or names == "sfnc" else None)
        return went

    def test_the_lens_goes_the_true_way_or_nowhere(self):
        kinds = list(itertools.product(("sfnc", "imaging-source"), ("near", "far"), ("absent", "right", "wrong"), (False, True)))
        # A camera that counts against its standard, and nobody who says so, is a camera that nobody can know of.
        kinds.remove(("sfnc", "far", "absent", False))
        chosen = kinds if LONG else random.Random(20261127).sample(kinds, 6)
        went = {True: 0, False: 0, None: 0}
        for names, zero, key, calibrated in chosen:
            with self.subTest(names=names, zero=zero, key=key, calibrated=calibrated):
                try:
                    went[self.judge(names, zero, key, calibrated)] += 1
                finally:
                    self.doCleanups()
        print(f"{len(chosen)} cameras: the true way {went[True]}, refused {went[False]}, by a person's word {went[None]}")

    def test_what_was_seen_is_remembered(self):
        with tempfile.TemporaryDirectory() as state:
            self.start("imaging-source", "near", state=state)
            self.assertEqual(self.axis()["direction"], None)
            self.assertIn("(direction unknown)", self.daemon.lensctl("list").stdout)
            with self.daemon.client() as client:
                self.assertIn("direction", client.call(LENS + "List")["parameters"]["features"])
                self.assertEqual(client.call(LENS + "KeepDirection", {"direction": "nearNegative"})["parameters"], {})
            for _ in range(2):
                axis = self.axis()
                self.assertEqual((axis["direction"], axis["directionFrom"]), ("nearNegative", "seen"))
                self.assertIn("(near-negative, seen by setup)", self.daemon.lensctl("list").stdout)
                self.assertTrue(self.went_the_true_way(0.8))
                self.daemon.stop()
                self.open()
            self.daemon.stop()
            self.open(key="near-positive")  # the key wins, and what contradicts it is told
            self.assertEqual(self.axis()["directionFrom"], "configured")
            told = self.daemon.lensctl("status").stdout
            self.assertIn("near-negative by what setup saw: lensd goes by `direction` of [lens.focus]", told)
            with self.daemon.client() as client:
                client.call(LENS + "KeepDirection", {})
            self.assertNotIn("what setup saw", self.daemon.lensctl("status").stdout)

    def test_what_was_seen_beats_the_standard_that_a_camera_counts_against(self):
        with tempfile.TemporaryDirectory() as state:
            self.start("sfnc", "far", state=state)
            self.assertEqual(self.axis()["directionFrom"], "driver")
            with self.daemon.client() as client:
                client.call(LENS + "KeepDirection", {"direction": "nearPositive"})
            for _ in range(2):
                self.assertIn("(near-positive, seen by setup)", self.daemon.lensctl("list").stdout)
                self.assertIn("near-positive by what setup saw, and near-negative by the GenICam standard (SFNC): lensd goes by "
                              "what setup saw", self.daemon.lensctl("status").stdout)
                self.assertTrue(self.went_the_true_way(0.8))
                self.daemon.stop()
                self.open()

    def test_list_says_who_says_so(self):
        self.start("sfnc", "near")
        self.assertIn("(near-negative, by the GenICam standard (SFNC))", self.daemon.lensctl("list").stdout)
        self.daemon.stop()
        self.open(key="near-positive")
        self.assertIn("(near-positive, configured)", self.daemon.lensctl("list").stdout)

    @unittest.skipUnless(LONG, "setup takes a minute")
    def test_setup_finds_it(self):
        for names, zero in (("imaging-source", "near"), ("imaging-source", "far"), ("sfnc", "far")):
            with self.subTest(names=names, zero=zero), tempfile.TemporaryDirectory() as state:
                self.start(names, zero, state=state)
                self.daemon.lensctl("aperture", "2")
                self.daemon.lensctl("focus", "@2000")
                said = self.daemon.lensctl("--json", "setup", "--at", "1.2m")
                found = json.loads(said.stdout)
                self.assertEqual((found["direction"], found["seenDirection"]),
                                 ("found" if names != "sfnc" else "reversed", BY_NAME[zero]), said.stderr)
                self.assertTrue(self.went_the_true_way(0.9))
                self.doCleanups()


if __name__ == "__main__":
    unittest.main(verbosity=2)
