"""Autofocus under conditions of its own through the daemon: lensctl, clients that go away, shifts that are kept."""
import json
import os
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402

SIMULATOR = "io.lensd.Simulator."
TEXTURES = os.path.join(HERE, "..", "..", "scenes", "textures")
SCENE = f"""version = 1
[camera]
width = 192
height = 192
exposure_ms = 8
frame_rate_hz = 60
[lens]
f_number = [2.8, 16.0]
extension_mm = [0.0, 1.2]
speed_steps_per_s = 20000
initial_f_number = 8.0
focus_shift_um = 60
filter_focus_um = [0, 45]
[[surface]]
kind = "wall"
distance_m = 1.2
texture = "{TEXTURES}/brick.png"
[truth]
region = [0.1, 0.1, 0.8, 0.8]
"""


class Conditions(DaemonTest):

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        scene = os.path.join(self.folder.name, "scene.toml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(SCENE)
        self.config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'
        self.state = os.path.join(self.folder.name, "state")
        os.mkdir(self.state)
        self.daemon = Daemon(config=self.config, arguments=("--state", self.state))
        self.addCleanup(lambda: self.daemon.stop())
        self.assertEqual(self.lensctl("aperture", "a", "@50")[0], 0)
        self.assertEqual(self.lensctl("aperture", "a", "@60")[0], 0)

    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def lensctl(self, *arguments):
        ended = self.daemon.lensctl(*arguments)
        return ended.returncode, ended.stdout, ended.stderr

    def json(self, *arguments, status=0):
        code, out, error = self.lensctl("--json", *arguments)
        self.assertEqual(code, status, (out, error))
        return json.loads(out)

    def stands(self):
        places = [self.position(axis=axis)["position"] for axis in ("iris", "filter")]
        return (*places, self.json("exposure", "a")["exposureMs"])

    def truth(self):
        with self.daemon.client() as client:
            return client.call(SIMULATOR + "Truth", {})["parameters"]

    def off_um(self):
        """How far the sensor is from where the subject is in focus."""
        truth = self.truth()
        to_sensor = 1e-3 * (truth["focalLengthMm"] + truth["extensionMm"])
        return 1e6 * (truth["focalPlaneD"] - 1 / 1.2) * to_sensor ** 2

    def test_a_shift_is_measured_used_kept_listed_and_removed(self):
        before = self.stands()
        missing = self.json("autofocus", "a", "--f-number", "2.8", "--exposure", "1ms")
        self.assertTrue(missing["focused"], missing)
        self.assertIsNone(missing["conditions"]["shift"])
        self.assertIn("is not measured", missing["conditions"]["shiftReason"])
        self.assertIn("is not measured", missing["reason"])
        self.assertEqual(self.stands(), before)
        self.assertGreater(abs(self.off_um()), 40)
        # 60 um at f/2.8, (2.8/8.1)² of that where the iris stands.
        needed = 60 * (2.8 / self.truth()["fNumber"]) ** 2
        measured = self.json("focus-shift", "measure", "a", "--f-number", "2.8", "--exposure", "1ms", "--pairs", "3")
        shift = measured["shift"]["shift"]
        self.assertAlmostEqual(shift["extensionUm"], needed - 60, delta=2)
        self.assertGreater(shift["sigmaUm"], 0)
        self.assertEqual(self.stands(), before)
        self.daemon.stop()
        self.daemon = Daemon(config=self.config, arguments=("--state", self.state))
        self.assertEqual(self.lensctl("aperture", "a", "@50")[0], 0)
        self.assertEqual(self.lensctl("aperture", "a", "@60")[0], 0)
        (kept,) = self.json("focus-shift", "list", "a")
        self.assertEqual(kept["shift"], shift)
        self.assertIn("[[focus_shift]]", self.lensctl("calibrate", "a", "--show")[1])
        used = self.json("autofocus", "a", "--f-number", "2.8", "--exposure", "1ms")
        self.assertTrue(used["focused"], used)
        self.assertEqual(used["conditions"]["shift"], shift)
        self.assertTrue(used["conditions"]["restored"])
        self.assertAlmostEqual(used["conditions"]["fNumber"], 2.8, delta=0.05)
        self.assertLess(abs(self.off_um()), 10)
        self.assertEqual(self.stands(), before)
        code, out, _ = self.lensctl("focus-shift", "list", "a")
        self.assertIn("f/2.8 to f/8", out)
        code, out, _ = self.lensctl("focus-shift", "remove", "a", "--from", "f/8.08", "--to", "f/2.8")
        self.assertEqual(code, 0, out)
        self.assertEqual(self.json("focus-shift", "list", "a"), [])
        self.json("focus-shift", "remove", "a", "--from", "f/8", "--to", "f/2.8", status=64)

    def begin(self):
        """A search under way, the iris open; its process."""
        process = subprocess.Popen(
            [os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "--json", "autofocus", "a", "--f-number", "2.8",
             "--exposure", "1ms", "--method", "exhaustive"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_for(lambda: self.position(axis="iris")["position"] == 0 and self.json("status", "a")["activity"] == "autofocus")
        return process

    def test_control_c_brings_all_back(self):
        before = self.stands()
        process = self.begin()
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=20 * PATIENCE)
        self.assertEqual(process.returncode, 130, error)
        self.wait_for(lambda: self.stands() == before)

    def test_a_client_that_is_gone_leaves_nothing_behind(self):
        before = self.stands()
        process = self.begin()
        process.kill()
        process.communicate()
        self.wait_for(lambda: self.stands() == before)

    def test_a_stop_moves_nothing_and_the_answer_says_what_stays(self):
        before = self.stands()
        process = self.begin()
        self.assertEqual(self.lensctl("stop", "a")[0], 0)
        out, error = process.communicate(timeout=20 * PATIENCE)
        self.assertEqual(process.returncode, 2, error)
        self.assertIn("the iris is left where it is", json.loads(out)["message"])
        self.assertEqual(self.stands(), (0, before[1], before[2]))

    def test_a_refusal_before_anything_moves(self):
        before = self.stands()
        told = self.json("filter", "a", "1.5", status=6)
        self.assertEqual((told["minimum"], told["maximum"], told["axis"]), (1, 2, "filter"))
        self.assertIn("filter stands in whole places, 1 to 2: there is none at 1.5", told["message"])
        for arguments, code in ((("--f-number", "1"), "out-of-range"), (("--filter", "7"), "out-of-range"),
                                (("--filter", "1.5"), "out-of-range"),
                                (("--exposure", "1ms", "--track"), "usage"),
                                (("--f-number", "0"), "usage")):
            self.assertEqual(self.json("autofocus", "a", *arguments, status={"out-of-range": 6, "usage": 64}[code])["error"], code)
        with self.daemon.client() as client:
            for conditions in ({}, {"fNumber": -1}):
                reply = client.call(LENS + "Autofocus", {"lens": "a", "conditions": conditions})
                self.assertEqual(reply["error"], LENS + "InvalidRequest", reply)
            reply = client.call(LENS + "MeasureFocusShift", {"lens": "a", "conditions": {"exposureMs": 1}})
            self.assertEqual(reply["error"], LENS + "InvalidRequest", reply)
            reply = client.call(LENS + "RemoveFocusShift", {"lens": "a", "fromFNumber": 2.8})
            self.assertEqual(reply["error"], LENS + "InvalidRequest", reply)
            self.assertIn("searchConditions", client.call(LENS + "List")["parameters"]["features"])
        self.json("focus-shift", "measure", "a", "--filter", "1", status=64)  # it is in place
        self.assertEqual(self.stands(), before)


if __name__ == "__main__":
    unittest.main()
