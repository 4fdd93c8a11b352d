"""The bench by socket: what is true of a simulated lens, faults on demand and pictures without noise, judged by formulas
that share nothing with the simulator."""
import base64
import math
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "interface"))
from bench import KINDS, SIM, rows_of  # noqa: E402
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402
from interface_test import Definition  # noqa: E402


class SimulatorTest(DaemonTest):
    def simulator(self, client, method, **parameters):
        reply = client.call(SIM + method, {"lens": "a", **parameters})
        self.assertNotIn("error", reply)
        return reply["parameters"]

    def refused(self, client, method, error, **parameters):
        reply = client.call(SIM + method, {"lens": "a", **parameters})
        self.assertEqual(reply.get("error"), error, reply)
        return reply["parameters"]

    def test_it_is_introspected_as_the_first(self):
        with self.daemon.client() as client:
            self.assertIn("io.lensd.Simulator", client.call("org.varlink.service.GetInfo")["parameters"]["interfaces"])
            text = client.call("org.varlink.service.GetInterfaceDescription", {"interface": "io.lensd.Simulator"})
            definition = Definition(text["parameters"]["description"])
            self.assertEqual(set(definition.methods), {"Truth", "Inject", "Render"})
            told = self.simulator(client, "Truth", vergenceD=1.0)
            self.assertEqual(definition.wrong(definition.methods["Truth"][1], told, "Truth"), [])
            for kind in KINDS:
                if kind not in ("disconnect", "drop-reply", "late-reply"):
                    self.simulator(client, "Inject", kind=kind, forMs=0.001)

    def test_the_truth_is_that_of_the_mechanism(self):
        with self.daemon.client() as client:
            client.call(LENS + "Home", {"lens": "a"})
            client.call(LENS + "Move", {"lens": "a", "axis": "iris", "target": {"position": 14}})
            before = self.simulator(client, "Truth")
            move = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 2000}})
            self.assertTrue(move["parameters"]["move"]["reached"])
            self.simulator(client, "Inject", kind="jump", axis="focus", steps=300)
            self.wait_for(lambda: abs(self.simulator(client, "Truth")["focusPosition"] - 2300) < 0.5)
            # The lens does not know of the knock, and says so of none.
            self.assertEqual(self.position("a")["position"], 2000)
            true = self.simulator(client, "Truth", vergenceD=1 / 1.2)
            self.assertAlmostEqual(true["extensionMm"], 1.6 * true["focusPosition"] / 4000, 9)
            f, number, z = 25.0, true["fNumber"], 25.0 + true["extensionMm"]
            self.assertAlmostEqual(true["signedBlurUm"], 1e3 * f / number * (z * (1 / f - 1 / 1200) - 1), 6)
            self.assertAlmostEqual(true["blurUm"], abs(true["signedBlurUm"]), 12)
            self.assertAlmostEqual(true["focalPlaneD"], 1e3 * (1 / f - 1 / z), 9)
            # 99 steps from f/1.4 to f/16, even in log.
            self.assertAlmostEqual(true["irisPosition"], 14, 6)
            self.assertAlmostEqual(number, 1.4 * (16 / 1.4) ** (14 / 99), 9)
            self.assertIsNone(true["zoomPosition"])
            # The past is as it was.
            self.assertEqual(self.simulator(client, "Truth", atNs=before["atNs"])["focusPosition"],
                             before["focusPosition"])
            self.refused(client, "Truth", "io.lensd.Lens.OutOfRange", atNs=true["atNs"] + 10 ** 12)
            self.refused(client, "Truth", "io.lensd.Lens.OutOfRange", atNs=-2 ** 63)
            self.assertTrue(client.call(LENS + "Home", {"lens": "a", "axis": "focus"})["parameters"]["moves"][0]["reached"])

    def test_a_fault_on_demand_does_what_a_scene_says(self):
        with self.daemon.client() as client, self.daemon.client() as mover:
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 1500}})
            self.wait_for(lambda: self.simulator(client, "Truth")["focusPosition"] > 100)
            self.simulator(client, "Inject", kind="stall", axis="focus")
            self.assertFalse(mover.receive()["parameters"]["move"]["reached"])
            stuck = self.simulator(client, "Truth")["focusPosition"]
            self.assertLess(stuck, 1400)
            self.simulator(client, "Inject", kind="stall", forMs=1)
            time.sleep(0.01)
            move = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 600}})["parameters"]
            self.assertTrue(move["move"]["reached"], move)
            self.assertAlmostEqual(self.simulator(client, "Truth")["focusPosition"], 600, 0)

    def test_a_link_that_breaks_still_tells_the_truth(self):
        with self.daemon.client() as client:
            self.simulator(client, "Inject", kind="disconnect")
            self.wait_for(lambda: client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 9}})
                          .get("error") == LENS + "Disconnected")
            self.simulator(client, "Truth")
            self.simulator(client, "Inject", kind="reconnect")
            self.wait_for(lambda: client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["connected"])
            client.call(LENS + "Home", {"lens": "a"})

    def test_wrong_calls_are_told_why(self):
        with self.daemon.client() as client:
            kinds = self.refused(client, "Inject", "io.lensd.Lens.InvalidRequest", kind="sulk")["message"]
            for kind in KINDS:
                self.assertIn(kind, kinds)
            wrong = "io.lensd.Lens.InvalidRequest"
            for parameter, error, given in (
                    ("kind", wrong, {"kind": ""}), ("kind", wrong, {"kind": "Stall"}),
                    ("axis", "io.lensd.Lens.Unsupported", {"kind": "stall", "axis": "zoom"}),
                    ("forMs", wrong, {"kind": "stall", "forMs": -1}), ("forMs", wrong, {"kind": "stall", "forMs": 1e13}),
                    ("factor", wrong, {"kind": "missed-steps", "factor": 2}),
                    ("factor", wrong, {"kind": "wrong-exposure", "factor": -0.5}),
                    ("factor", wrong, {"kind": "stall", "factor": 0.5}),
                    ("steps", wrong, {"kind": "jump", "steps": 1e9}), ("steps", wrong, {"kind": "stall", "steps": 3}),
                    ("byC", wrong, {"kind": "warmth", "byC": 1e4}), ("byC", wrong, {"kind": "stall", "byC": 3}),
                    ("axis", "org.varlink.service.InvalidParameter", {"kind": "stall", "axis": "nose"}),
                    ("kind", "org.varlink.service.InvalidParameter", {}),
                    ("forMs", "org.varlink.service.InvalidParameter", {"kind": "stall", "forMs": "long"})):
                facts = self.refused(client, "Inject", error, **given)
                self.assertEqual(facts.get("parameter"), parameter, (given, facts))
            self.refused(client, "Truth", "io.lensd.Lens.LensNotFound", lens="c")
            now = time.monotonic_ns()
            for asked in (now + 10**12, 1):
                facts = self.refused(client, "Truth", "io.lensd.Lens.OutOfRange", atNs=asked)
                self.assertEqual((facts["parameter"], facts["unit"]), ("atNs", "ns"))
                self.assertLess(facts["minimum"], now)
                self.assertAlmostEqual(facts["maximum"], time.monotonic_ns(), delta=1e9 * PATIENCE)
                for instant in ("minimum", "maximum"):
                    self.assertEqual(self.simulator(client, "Truth", atNs=int(facts[instant]))["atNs"], int(facts[instant]))

    def test_a_lease_does_not_cover_it(self):
        with self.daemon.client() as holder, self.daemon.client() as client:
            holder.call(LENS + "TakeLease", {"lens": "a"})
            self.simulator(client, "Inject", kind="lose-frames", forMs=1)
            self.simulator(client, "Truth")

    def test_a_picture_is_that_of_the_wall(self):
        """A sinusoid of 8 px, in focus."""
        with self.daemon.client() as client:
            for axis, target in (("focus", {"distanceM": 1.2}), ("iris", {"fNumber": 2.0})):
                move = client.call(LENS + "Move", {"lens": "a", "axis": axis, "target": target})["parameters"]["move"]
                self.assertTrue(move["reached"], move)
            told = self.simulator(client, "Render")
            png = base64.b64decode(told["png"])
            self.assertEqual((told["offset"], told["size"]), (0, len(png)))
            sharp = rows_of(png)
            self.assertEqual((len(sharp), len(sharp[0])), (48, 64))
            # No noise: rows of a pattern that does not change downward are alike, and white is 0.9 of full scale at f/2.
            self.assertTrue(all(row == sharp[0] for row in sharp))
            true = self.simulator(client, "Truth")
            white = 0.9 * 255 * (2.0 / true["fNumber"] / (1 + true["extensionMm"] / 25)) ** 2
            for i, sample in enumerate(sharp[0]):
                self.assertAlmostEqual(sample, white * (0.5 + 0.5 * math.cos(math.pi * (i + 0.5) / 4)), delta=2.5)
            client.send(SIM + "Render", {"lens": "a"}, more=True)
            pieces, reply = b"", {"continues": True}
            while reply.get("continues"):
                reply = client.receive()
                pieces += base64.b64decode(reply["parameters"]["png"])
            self.assertEqual(rows_of(pieces), sharp)


class ExampleTest(unittest.TestCase):
    """docs/testing-your-program.md does what it says, as it stands."""

    def test_the_worked_example_runs(self):
        with open(os.path.join(HERE, "../../docs/testing-your-program.md"), encoding="utf-8") as file:
            page = file.read()
        files = dict(re.findall(r"`([\w.]+)`[,:][^`]*```\w+\n(.*?)```", page, re.S))
        self.assertEqual(sorted(files), ["bench.toml", "test_faults.py", "wall.toml"])
        commands = re.search(r"```sh\n(.*?)```", page, re.S).group(1)
        with tempfile.TemporaryDirectory(prefix="lensd-example-") as folder:
            for name, text in files.items():
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            ran = subprocess.run(["bash", "-c", commands], cwd=folder, capture_output=True, text=True, check=False,
                                 timeout=100 * PATIENCE, env={**os.environ, "PATH": BIN + ":" + os.environ["PATH"]})
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("Ran 4 tests", ran.stderr)


class NoSimulatorTest(unittest.TestCase):
    def test_it_is_not_there_without_a_simulated_lens(self):
        daemon = Daemon(config="version = 1\n")
        try:
            with daemon.client() as client:
                info = client.call("org.varlink.service.GetInfo")["parameters"]
                self.assertNotIn("io.lensd.Simulator", info["interfaces"])
                self.assertEqual(client.call(SIM + "Truth")["error"], "org.varlink.service.InterfaceNotFound")
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_it_comes_and_goes_with_the_configuration(self):
        scene = os.path.join(HERE, "small.toml")
        simulated = f'[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'
        daemon = Daemon(config="version = 1\n")
        try:
            with daemon.client() as client:
                for lenses, there in ((simulated, True), ("", False)):
                    with open(daemon.config, "w", encoding="utf-8") as file:
                        file.write("version = 1\n" + lenses)
                    self.assertNotIn("error", client.call(LENS + "Reload"))
                    info = client.call("org.varlink.service.GetInfo")["parameters"]
                    self.assertEqual("io.lensd.Simulator" in info["interfaces"], there)
                    self.assertEqual("error" in client.call(SIM + "Truth"), not there)
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_a_real_lens_is_refused(self):
        scene = os.path.join(HERE, "small.toml")
        daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'
                               '[[lens]]\nname = "real"\ndriver = "lensconnect"\nserial = "nowhere"\n')
        try:
            with daemon.client() as client:
                for method, parameters in (("Truth", {}), ("Inject", {"kind": "stall"}), ("Render", {})):
                    reply = client.call(SIM + method, {"lens": "real", **parameters})
                    self.assertEqual(reply["error"], LENS + "Unsupported")
                    self.assertIn("lensconnect", reply["parameters"]["message"])
                begun = time.monotonic()
                self.assertNotIn("error", client.call(SIM + "Truth", {"lens": "a"}))
                self.assertLess(time.monotonic() - begun, 5)
        finally:
            self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main()
