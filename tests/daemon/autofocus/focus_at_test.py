"""FocusAt through the daemon: a stage moves a wall nearer and farther, autofocus results become a surface, and the simulator
says where focus truly is."""
import json
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, Daemon, DaemonTest  # noqa: E402

SIMULATOR = "io.lensd.Simulator."
TEXTURES = os.path.join(HERE, "..", "..", "scenes", "textures")
SCENE = """version = 1
[camera]
width = 192
height = 192
exposure_ms = 8
frame_rate_hz = 60
[lens]
f_number = [2.8, 16.0]
extension_mm = [0.0, 1.2]
speed_steps_per_s = 20000
initial_f_number = 2.8
temperature_c = {temperature}
drift_um_per_c = 4.0
[[surface]]
kind = "wall"
distance_m = {distance}
texture = "{textures}/brick.png"
[truth]
region = [0.1, 0.1, 0.8, 0.8]
"""
FOCAL_LENGTH_M = 0.025


def depth(x, y):
    """Where the stage puts the wall, in dioptres: tilted along both axes."""
    return 0.8 + 0.02 * x - 0.01 * y


def words(x, y):
    return f"x={x}mm", f"y={y}mm"


class OverAStage(DaemonTest):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.scenes = 0
        self.state = os.path.join(self.folder.name, "state")
        self.config = os.path.join(self.folder.name, "lensd.toml")
        os.mkdir(self.state)
        self.stage(0, 0)
        self.start()

    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def start(self):
        with open(self.config, encoding="utf-8") as file:
            self.daemon = Daemon(config=file.read(), arguments=("--state", self.state))
        self.addCleanup(self.daemon.stop)

    def stage(self, x, y, temperature=20, extra=""):
        """Writes the configuration of a lens before which the stage stands there."""
        self.scenes += 1
        scene = os.path.join(self.folder.name, f"scene{self.scenes}.toml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(SCENE.format(distance=1 / depth(x, y), temperature=temperature, textures=TEXTURES))
        with open(self.config, "w", encoding="utf-8") as file:
            file.write(f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n{extra}')

    def restart(self, *where, **how):
        """Another scene needs another lensd; what was learned is on disk."""
        self.daemon.stop()
        self.stage(*where, **how)
        self.start()

    def run_json(self, *arguments, status=0):
        ended = self.daemon.lensctl("--json", *arguments)
        self.assertEqual(ended.returncode, status, (ended.stdout, ended.stderr))
        return json.loads(ended.stdout or ended.stderr)

    def sample(self, x, y):
        self.restart(x, y)
        self.assertTrue(self.run_json("autofocus", "a")["focused"])
        return self.run_json("focus-at", "add", "a", *words(x, y))

    def off_steps(self, x, y):
        """How far focus stands from where the wall is in focus, by the thin lens and 4000 steps to 1.2 mm."""
        with self.daemon.client() as client:
            extension = client.call(SIMULATOR + "Truth", {})["parameters"]["extensionMm"]
        power = 1 / FOCAL_LENGTH_M - depth(x, y)
        return (extension - 1e3 * (1 / power - FOCAL_LENGTH_M)) * self.steps_per_mm

    def learn(self):
        for x, y in ((0, 0), (20, 0), (0, 20), (20, 20), (10, 10)):
            surface = self.sample(x, y)
        return surface

    def test_a_surface_is_learned_used_and_kept(self):
        surface = self.learn()
        self.assertTrue(surface["fitted"], surface)
        self.steps_per_mm = self.steps()
        # A fresh autofocus made each of them, and none makes two.
        refused = self.run_json("focus-at", "add", "a", "x=3mm", "y=4mm", status=64)
        self.assertIn("no autofocus", str(refused))
        sigmas = []
        for x, y in ((5, 5), (15, 5), (4, 17), (20, 12)):
            self.restart(x, y)
            went = self.run_json("focus-at", "go", "a", *words(x, y))
            self.assertTrue(went["move"]["reached"], went)
            sigma = went["place"]["sigma"]
            off = self.off_steps(x, y)
            sigmas.append(off / sigma)
            self.assertLess(abs(off), 3 * sigma + 1, (x, y, off, sigma))
            self.assertLess(sigma, 60)
        print("of", len(sigmas), "places, off by", " ".join(f"{one:.2f}" for one in sigmas), "sigma")
        self.outlier_is_named()
        self.beyond_is_refused()
        self.forgotten()

    def steps(self):
        with self.daemon.client() as client:
            before = client.call(SIMULATOR + "Truth", {})["parameters"]["extensionMm"]
            here = self.position()["position"]
            self.assertEqual(self.daemon.lensctl("focus", "a", "@+200").returncode, 0)
            after = client.call(SIMULATOR + "Truth", {})["parameters"]["extensionMm"]
        return (self.position()["position"] - here) / (after - before)

    def outlier_is_named(self):
        before = self.run_json("focus-at", "show", "a", "x=10mm", "y=5mm")
        wrong = before["place"]["position"] + 400
        # Off the diagonals, which do not tell a saddle: the wrong one is not to be the only one that tells it.
        for x, y in ((15, 15), (10, 20)):
            surface = self.sample(x, y)
        self.run_json("focus-at", "add", "a", "x=10mm", "y=5mm", "--position", str(wrong), status=64)
        surface = self.run_json("focus-at", "add", "a", "x=10mm", "y=5mm", "--position", str(wrong), "--sigma", "2")
        self.assertEqual([sample["outlier"] for sample in surface["samples"]], [False] * 7 + [True], surface)
        self.assertEqual([value["value"] for value in surface["next"]], [10, 5])
        self.assertIn("OUTLIER", self.daemon.lensctl("focus-at", "show", "a").stdout)
        after = self.run_json("focus-at", "show", "a", "x=10mm", "y=5mm")["place"]["position"]
        self.assertLess(abs(after - before["place"]["position"]), 40)
        self.run_json("focus-at", "forget", "a", "--sample", "8")

    def beyond_is_refused(self):
        before = self.position()["position"]
        for words_beyond, status, says in (
                (("x=25mm", "y=5mm"), 6, "x = 25 mm is 5 mm outside the samples (0 to 20 mm)"),
                (("x=25um", "y=5mm"), 64, "other coordinates or units"), (("x=5mm",), 64, "other coordinates or units"),
                (("x=5mm", "x=6mm"), 64, "twice"), (("x=a",), 64, "NAME=VALUE")):
            ended = self.daemon.lensctl("focus-at", "go", "a", *words_beyond)
            self.assertEqual((ended.returncode, says in ended.stderr), (status, True), ended.stderr)
        self.assertEqual(self.position()["position"], before)
        with self.daemon.client() as client, self.daemon.client() as other:
            place = [{"name": name, "value": 5.0, "unit": "mm"} for name in "xy"]
            lease = client.call(LENS + "TakeLease", {})["parameters"]["lease"]
            for method, more in (("FocusAt", {"at": place}), ("FocusAtAdd", {"at": place}), ("FocusAtForget", {})):
                self.assertEqual(other.call(LENS + method, more)["error"], LENS + "Leased")
            self.assertIn("place", other.call(LENS + "FocusAtGet", {"at": place})["parameters"])
            self.assertTrue(client.call(LENS + "FocusAt", {"at": place, "lease": lease})["parameters"]["move"]["reached"])
            self.assertIn("focusAt", client.call(LENS + "List")["parameters"]["features"])

    def forgotten(self):
        self.assertIn("[[focus_at.sample]]", self.daemon.lensctl("calibrate", "a", "--show").stdout)
        self.assertEqual(len(self.run_json("focus-at", "show", "a")["surface"]["samples"]), 7)
        self.run_json("focus-at", "forget", "a")
        self.assertEqual(self.run_json("focus-at", "show", "a")["surface"]["samples"], [])
        self.run_json("focus-at", "forget", "a", "--sample", "1", status=64)

    def test_samples_that_make_no_sense_are_refused_and_their_number_ends(self):
        def place(**values):
            return [{"name": name, "value": value} for name, value in values.items()]

        with self.daemon.client() as client:
            add = LENS + "FocusAtAdd"
            empty = client.call(LENS + "FocusAt", {"at": place(x=1)})
            self.assertEqual(empty["error"], LENS + "OutOfRange")
            for at in ([], place(x=1e10), [{"name": "", "value": 1}], [{"name": "a b", "value": 1}], place(a=1, b=1, c=1, d=1)):
                self.assertEqual(client.call(add, {"at": at, "position": 900, "sigma": 1})["error"], LENS + "InvalidRequest")
            for sigma in (0, -1, 1e-300, 1e300):
                self.assertEqual(client.call(add, {"at": place(x=1), "position": 900, "sigma": sigma})["parameters"]["parameter"], "sigma")
            self.assertEqual(client.call(add, {"at": place(x=1), "position": 1e9, "sigma": 1})["error"], LENS + "OutOfRange")
            for number in range(30):
                added = client.call(add, {"at": place(x=number), "position": 900 + 3 * number, "sigma": 1})
                self.assertEqual(len(added["parameters"]["surface"]["samples"]), number + 1)
            self.assertEqual(client.call(add, {"at": place(x=1), "position": 900, "sigma": 1})["error"], LENS + "OutOfRange")
            # The last bit of a sum is no place beyond.
            client.call(LENS + "FocusAtForget", {})
            for value in (0, 0.1, 0.2, 0.3):
                client.call(add, {"at": place(x=value), "position": 900, "sigma": 1})
            self.assertIn("place", client.call(LENS + "FocusAtGet", {"at": place(x=0.1 + 0.2)})["parameters"])
            client.call(LENS + "FocusAtForget", {})
            for number in range(30):
                client.call(add, {"at": place(x=number), "position": 900 + 3 * number, "sigma": 1})
            # A line is found again.
            there = client.call(LENS + "FocusAtGet", {"at": place(x=12.5)})["parameters"]["place"]
            self.assertAlmostEqual(there["position"], 937.5, delta=1e-6)

    def tell(self, *samples):
        for at, position in samples:
            told = self.run_json("focus-at", "add", "a", *at.split(), "--position", str(position), "--sigma", "1")
        return told

    def test_what_samples_cannot_tell_is_said(self):
        four = self.tell(*((f"x={x}mm y={y}mm", 1100 + 10 * x) for x in (-1, 1) for y in (-1, 1)))
        self.assertIn("too few places to show curvature", four["note"])
        self.assertEqual([value["value"] for value in four["next"]], [0, 0])
        shown = self.daemon.lensctl("focus-at", "show", "a", "x=0mm", "y=0mm")
        self.assertIn("note: too few places", shown.stdout)
        nine = self.tell(*((f"x={x}mm y={y}mm", 1100 + 10 * x) for x, y in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0))))
        self.assertIsNone(nine["note"])

    def test_beyond_the_cloud_is_refused(self):
        self.tell(*((f"x={x}mm y={y}mm", 900) for x, y in ((0, 0), (2, 0), (4, 0), (0, 2), (0, 4))))
        refused = self.daemon.lensctl("focus-at", "go", "a", "x=3mm", "y=3mm")
        self.assertEqual(refused.returncode, 6)
        self.assertIn("x=3mm y=3mm does not lie between the samples, of whose bounds the nearest place is x=2mm y=2mm", refused.stderr)
        self.run_json("focus-at", "show", "a", "x=2mm", "y=2mm")

    def test_an_outlier_is_next_once(self):
        wrong = self.tell(*((f"x={x}mm", 900 + 500 * (x == 1)) for x in (-3, -2, -1, 0, 1, 2, 3)))
        self.assertEqual([value["value"] for value in wrong["next"] or []], [1], wrong)
        again = self.tell(("x=1mm", 900))
        self.assertNotEqual([value["value"] for value in again["next"] or []], [1])
        self.assertIn("sample 5 was measured again: forget it", again["note"])

    def test_coordinates_are_read_strictly(self):
        for word in ("x=1.2.3mm", "x=0x10mm", "x=1e", "x=1_000mm", "x=nan", "x=inf", "x=", "x=--5mm", "x=+-5mm", "x=mm"):
            ended = self.daemon.lensctl("focus-at", "add", "a", word, "--position", "900", "--sigma", "1")
            self.assertEqual((ended.returncode, "a number and then its unit" in ended.stderr), (64, True), (word, ended.stderr))
        for word in ("x=+5mm", "x=-5mm", "x=1e1mm", "x=.5mm"):
            self.tell((word, 900))
        ended = self.daemon.lensctl("focus-at", "go", "a", "x=3cm")
        self.assertIn("it has x in mm, and x in cm was asked", ended.stderr)
        self.assertTrue(self.run_json("focus-at", "forget", "a")["removed"])
        self.assertFalse(self.run_json("focus-at", "forget", "a")["removed"])
        self.assertIn("no focus surface to forget", self.daemon.lensctl("focus-at", "forget", "a").stdout)

    def test_a_damaged_calibration_is_named(self):
        self.tell(("x=0mm", 900), ("x=1mm", 900))
        self.daemon.stop()
        kept = os.path.join(self.state, next(name for name in os.listdir(self.state) if name.endswith("calibration.toml")))
        with open(kept, "w", encoding="utf-8") as file:
            file.write("[[focus_at.sample\n")
        self.start()
        self.assertIn(kept, self.daemon.lensctl("focus-at", "show", "a").stdout)

    def test_a_tracking_answer_is_a_sample(self):
        with self.daemon.client() as client:
            client.send(LENS + "Autofocus", {"track": True}, more=True)
            reply = client.receive()
            while "autofocus" not in reply["parameters"]:
                reply = client.receive()
            self.assertTrue(reply["parameters"]["autofocus"]["focused"])
            self.assertEqual(self.daemon.lensctl("stop", "a").returncode, 0)
            self.assertEqual(len(self.run_json("focus-at", "add", "a", "x=1mm", "--sigma", "2")["samples"]), 1)

    def test_another_temperature_is_corrected_or_refused(self):
        self.learn()
        self.steps_per_mm = self.steps()
        self.restart(5, 5, temperature=26)
        refused = self.daemon.lensctl("focus-at", "go", "a", *words(5, 5))
        self.assertEqual(refused.returncode, 8)
        self.assertIn("at 20 C, it is 26 C now", refused.stderr)
        shown = self.run_json("focus-at", "show", "a")["surface"]
        self.assertEqual((len(shown["samples"]), shown["fitted"]), (5, False))
        self.assertIn("26 C", shown["reason"])
        # With the coefficient, which is the simulator's own.
        self.restart(5, 5, temperature=26, extra="[lens.temperature]\ncompensate = true\num_per_c = 4.0\n")
        went = self.run_json("focus-at", "go", "a", *words(5, 5))
        corrected = self.run_json("focus-at", "show", "a")["surface"]["correction"]
        self.assertAlmostEqual(abs(corrected), 6 * 4e-3 * self.steps_per_mm, delta=0.5)
        self.assertLess(abs(self.off_steps(5, 5)), 3 * went["place"]["sigma"] + 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
