"""[lens.refocus] through the daemon: the lens gets warm, and the simulator says how far focus is from the subject; who keeps
lensd from correcting it, what is told of it, and what is kept."""
import json
import os
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402

SIMULATOR = "io.lensd.Simulator."
TEXTURES = os.path.join(HERE, "..", "..", "scenes", "textures")
DRIFT_UM = 3.0
SCENE = f"""version = 1
[camera]
width = 192
height = 192
exposure_ms = 2
frame_rate_hz = 200
[lens]
f_number = [2.8, 16.0]
extension_mm = [0.0, 1.2]
speed_steps_per_s = 60000
initial_f_number = 2.8
drift_um_per_c = {DRIFT_UM}
%s[[surface]]
kind = "wall"
distance_m = 1.2
texture = "{TEXTURES}/brick.png"
[truth]
region = [0.1, 0.1, 0.8, 0.8]
"""
# The simulator's lens gets warm at once.
BY_TEMPERATURE = ("[lens.refocus]\ntemperature_c = 1\nmove_within_um = 3\nminimum_interval_s = 1\n"
                  "[lens.temperature]\nmax_c_per_min = 100000\n")
# Where a wall at 1.2 m is in focus, by the thin lens of 25 mm.
EXTENSION_MM = 1e3 / (1 / 0.025 - 1 / 1.2) - 25


class Refocus(DaemonTest):
    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        os.mkdir(self.state)

    def path(self, name, text):
        path = os.path.join(self.folder.name, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def start(self, refocus=BY_TEMPERATURE, lens=""):
        scene = self.path("scene.toml", SCENE % lens)
        self.text = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n{refocus}'
        self.daemon = Daemon(config=self.text, arguments=("--state", self.state))
        self.addCleanup(self.daemon.stop)

    def ask(self, method, **parameters):
        with self.daemon.client() as client:
            reply = client.call(method if "." in method else LENS + method, {"lens": "a", **parameters})
        self.assertNotIn("error", reply, reply)
        return reply["parameters"]

    def warm(self, by_c):
        self.ask(SIMULATOR + "Inject", kind="warmth", byC=by_c)

    def state_of(self):
        return self.ask("GetRefocus")["refocus"]

    def off_um(self):
        return 1e3 * (self.ask(SIMULATOR + "Truth")["extensionMm"] - EXTENSION_MM)

    def focus(self):
        found = self.ask("Autofocus")["autofocus"]
        self.assertTrue(found["focused"], found)
        self.assertTrue(self.state_of()["active"])

    def corrected(self, by_c):
        """The newest correction, after the temperature has changed."""
        before = (self.state_of()["last"] or {}).get("atNs", 0)
        self.warm(by_c)
        self.wait_for(lambda: (self.state_of()["last"] or {"atNs": 0})["atNs"] > before, 30)
        return self.state_of()["last"]

    def kept(self):
        """How many results are on disk."""
        with open(os.path.join(self.state, "a.refocus.toml"), encoding="utf-8") as file:
            return file.read().count("[[result]]")

    def waits(self, says):
        self.wait_for(lambda: says in (self.state_of()["reason"] or ""))

    def test_it_learns_moves_and_knows_it_after_a_restart(self):
        self.start()
        with self.daemon.client() as client:
            self.assertIn("refocus", client.call(LENS + "List")["parameters"]["features"])
        self.assertEqual(self.state_of()["active"], False)
        self.assertIn("no autofocus", self.state_of()["reason"])
        self.focus()
        offs = []
        for by_c in (1.5, 3.0, 4.5, 6.0, 4.0, 2.0, 0.5, 2.5, 5.0):
            last = self.corrected(by_c)
            self.assertEqual((last["cause"], last["lens"]), ("temperature", "a"))
            self.assertIn(last["end"], ("moved", "searched"), last)
            offs.append(abs(self.off_um()))
        drift = self.state_of()["drift"]
        self.assertEqual(last["end"], "moved", last)
        self.assertIn("um a degree", last["reason"])
        print(f"of {len(offs)} corrections after changes of 1.5 to 2.5 C the worst left {max(offs):.2f} um; learned "
              f"{drift['umPerC']:.3f} um/C, {drift['lowUmPerC']:.3f} to {drift['highUmPerC']:.3f}, true {DRIFT_UM}")
        self.assertLess(max(offs), 4)
        self.assertLess(drift["lowUmPerC"], DRIFT_UM)
        self.assertGreater(drift["highUmPerC"], DRIFT_UM)
        shown = self.daemon.lensctl("refocus", "show").stdout
        for words in ("a: lensd keeps the focus", "refocus by temperature, moved by", "um a degree (", "subject "):
            self.assertIn(words, shown)
        self.daemon.wait_log("a: refocus by temperature, moved")
        self.daemon.wait_log("a: refocus by temperature, searched")
        known = self.state_of()["results"]
        config = self.daemon.config
        backup = self.daemon.lensctl("--json", "backup", "--config", config, "--state", self.state, os.path.join(self.folder.name, "b"))
        self.assertIn("a.refocus.toml", json.loads(backup.stdout)["files"], backup.stderr)
        self.wait_for(lambda: self.kept() == len(known))  # at its end lensd drops what still waits to be written
        self.daemon.stop()
        self.start()
        again = self.state_of()
        self.assertEqual([result["made"] for result in again["results"]], [result["made"] for result in known])
        self.assertAlmostEqual(again["drift"]["umPerC"], drift["umPerC"])
        self.assertEqual((again["active"], again["last"]), (False, None))
        self.forgotten(len(known))

    def forgotten(self, count):
        for number in ("0", "201"):
            self.assertEqual(self.daemon.lensctl("refocus", "forget", "--result", number).returncode, 64)
        with self.daemon.client() as client:
            self.assertEqual(client.call(LENS + "ForgetDrift", {"lens": "a", "result": count + 1})["error"], LENS + "InvalidRequest")
        self.assertEqual(self.daemon.lensctl("refocus", "forget", "a", "--result", "1").returncode, 0)
        self.assertEqual(len(self.state_of()["results"]), count - 1)
        self.assertEqual(self.daemon.lensctl("refocus", "forget").returncode, 0)
        self.assertEqual((self.state_of()["results"], self.state_of()["drift"]), ([], None))
        self.assertIn("not learned yet", self.daemon.lensctl("refocus", "show").stdout)
        self.assertFalse(os.path.exists(os.path.join(self.state, "a.refocus.toml")))

    def test_it_waits_for_holds_leases_and_latches(self):
        self.start()
        self.focus()
        with self.daemon.client() as client:
            until = time.monotonic_ns() + 60 * 10**9
            client.call(LENS + "Hold", {"lens": "a", "untilNs": until})
            self.warm(4)
            self.waits("held")
        self.wait_for(lambda: self.state_of()["last"], 30)
        self.assertLess(abs(self.off_um()), 2)
        with self.daemon.client() as client:
            key = client.call(LENS + "TakeLease", {"lens": "a"})["parameters"]["lease"]
            at = self.state_of()["last"]["atNs"]
            self.warm(8)
            self.waits("leased to")
            self.assertEqual(client.call(LENS + "ForgetDrift", {"lens": "a", "result": 1, "lease": key}), {"parameters": {}})
            with self.daemon.client() as other:
                self.assertEqual(other.call(LENS + "ForgetDrift", {"lens": "a"})["error"], LENS + "Leased")
        self.wait_for(lambda: self.state_of()["last"]["atNs"] > at, 30)
        self.ask("Stop", latch=True)
        self.waits("stopped")
        self.assertFalse(self.state_of()["active"])

    def test_a_stop_ends_it_and_it_stays_so(self):
        self.start(lens="settle_ms = 300\n")  # slow, so that the stop comes before the search has ended
        self.focus()
        with self.daemon.client() as client:
            client.send(LENS + "Monitor", {"lens": "a"}, more=True)
            self.warm(4)
            while (event := client.receive()["parameters"]["event"]).get("status", {}).get("activity") != "autofocus":
                pass
            self.ask("Stop")
            while "refocus" not in (event := client.receive()["parameters"]["event"]):
                pass
        self.assertEqual((event["refocus"]["end"], event["refocus"]["cause"]), ("failed", "temperature"))
        self.assertIn("stopped", event["refocus"]["reason"])
        # It has to brake first.
        self.wait_for(lambda: self.ask("Status")["lenses"][0]["activity"] == "idle" and not self.position()["moving"])
        stands = self.position()["position"]
        state = self.state_of()
        self.assertEqual(state["active"], False)
        self.warm(9)
        self.wait_for(lambda: self.ask("Status")["lenses"][0]["temperatureC"] == 29)
        self.assertEqual(self.state_of()["last"]["atNs"], state["last"]["atNs"])
        self.assertEqual(self.position()["position"], stands)

    def test_what_a_person_focuses_is_left_alone(self):
        self.start()
        self.focus()
        self.assertEqual(self.daemon.lensctl("focus", "a", "1m").returncode, 0)
        self.waits("moved by a command")
        stands = self.position()["position"]
        self.warm(5)
        self.wait_for(lambda: self.ask("Status")["lenses"][0]["temperatureC"] == 25)
        self.assertEqual((self.state_of()["last"], self.position()["position"]), (None, stands))
        self.focus()
        self.assertIn(self.corrected(9)["end"], ("searched", "moved"))

    def test_a_knock_is_seen(self):
        self.start("[lens.refocus]\nsharpness_loss = 0.3\nlook_every_s = 0.2\nminimum_interval_s = 1\n")
        self.focus()
        knocks = []

        def seen():
            """A knock before the first looks is no loss: what they see is what counts."""
            state = self.state_of()
            due = not knocks or time.monotonic() > knocks[-1] + 2
            if due and not state["last"] and state["reason"] != "one is under way":
                self.ask(SIMULATOR + "Inject", kind="jump", steps=200)
                knocks.append(time.monotonic())
            return state["last"]

        self.wait_for(seen, 60)
        self.assertEqual((self.state_of()["last"]["cause"], self.state_of()["last"]["end"]), ("sharpness", "searched"))
        self.assertLess(abs(self.off_um()), 3)

    def test_a_file_that_cannot_be_read_is_kept(self):
        path = os.path.join(self.state, "a.refocus.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write("version = 1\n[[result]]\ntemperature_c = warm\n")
        self.start()
        self.assertIn("a.refocus.toml", str(self.ask("Status")["lenses"][0]["warnings"]))
        self.focus()
        self.assertIn("a.refocus.toml", self.state_of()["driftReason"])
        with open(path, encoding="utf-8") as file:
            self.assertIn("warm", file.read())
        self.assertEqual(self.daemon.lensctl("refocus", "forget").returncode, 0)
        self.assertTrue(os.path.exists(path + ".damaged"))
        self.assertFalse(os.path.exists(path))

    def test_a_lens_without_a_thermometer_says_so(self):
        self.start(lens="thermometer = false\n")
        checked = subprocess.run([os.path.join(BIN, "lensd"), "--config", self.path("c.toml", self.text), "--check-config"],
                                 capture_output=True, text=True, timeout=20 * PATIENCE, check=False)
        self.assertEqual(checked.returncode, 78, checked.stderr)
        self.assertRegex(checked.stderr, r'c.toml:6: lens "a": \[lens.refocus\] temperature_c never starts anything')
        self.assertIn("does not report its temperature", str(self.ask("Status")["lenses"][0]["warnings"]))
        self.focus()
        self.assertEqual(self.state_of()["results"], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
