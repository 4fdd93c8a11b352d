"""The bench by socket: what is true of a simulated lens, faults on demand and pictures without noise, judged by formulas
that share nothing with the simulator."""
import base64
import math
import os
import re
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest
from interface_test import Definition

SIM = "io.lensd.Simulator."
KINDS = ("stall", "jump", "disconnect", "reconnect", "drop-reply", "late-reply", "stale-readback", "freeze-frames",
         "lose-frames", "wrong-exposure", "missed-steps")


def rows_of(png):
    """Grey samples of a PNG whose rows are not filtered in a way this reader does not know."""
    width, height, bits, colour = struct.unpack(">IIBB", png[16:26])
    assert colour == 0 and png[:8] == b"\x89PNG\r\n\x1a\n"
    data, at = b"", 8
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        data += png[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += size + 12
    data, pixel = zlib.decompress(data), bits // 8
    rows, before, length = [], bytearray(width * pixel), width * pixel
    for y in range(height):
        how, line = data[y * (length + 1)], bytearray(data[y * (length + 1) + 1:(y + 1) * (length + 1)])
        for i in range(length):
            left, up = line[i - pixel] if i >= pixel else 0, before[i]
            corner = before[i - pixel] if i >= pixel else 0
            near = min((abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, near[2])[how]) & 255
        rows.append(list(line))
        before = line
    return rows


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
                    ("axis", "org.varlink.service.InvalidParameter", {"kind": "stall", "axis": "nose"}),
                    ("kind", "org.varlink.service.InvalidParameter", {}),
                    ("forMs", "org.varlink.service.InvalidParameter", {"kind": "stall", "forMs": "long"})):
                facts = self.refused(client, "Inject", error, **given)
                self.assertEqual(facts.get("parameter"), parameter, (given, facts))
            self.refused(client, "Truth", "io.lensd.Lens.LensNotFound", lens="c")

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


def bessel_j1(x):
    """By its power series; good below 10."""
    total, term = 0.0, x / 2
    for k in range(1, 40):
        total += term
        term *= -(x / 2) ** 2 / (k * (k + 1))
    return total


class FaultsTest(DaemonTest):
    """Every kind of fault on a lens at rest at position 0 of a homed lens, and what is true meanwhile. The scene: a focus of
    1000 steps a second that gets there within 1/100 s, 4001 counts over 1.6 mm, a striped wall, no noise."""
    lenses = ("a",)

    def setUp(self):
        self.client = self.daemon.client()
        self.addCleanup(self.client.socket.close)
        self.inject("reconnect")
        for kind in KINDS:
            if kind not in ("jump", "disconnect", "reconnect"):
                self.inject(kind, forMs=0.001)  # takes the place of whatever an earlier test has left
        self.wait_for(lambda: self.status()["connected"])
        self.call("Home", lens="a")
        self.assertTrue(all(axis["homed"] for axis in self.status()["axes"]))

    def call(self, method, **parameters):
        reply = self.client.call(LENS + method, parameters)
        self.assertNotIn("error", reply)
        return reply["parameters"]

    def inject(self, kind, **how):
        self.assertEqual(self.client.call(SIM + "Inject", {"lens": "a", "kind": kind, **how}), {"parameters": {}})

    def truth(self, **parameters):
        return self.client.call(SIM + "Truth", {"lens": "a", **parameters})["parameters"]

    def status(self):
        return self.call("Status", lens="a")["lenses"][0]

    def move(self, position):
        return self.client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": position}})

    def moved(self, position):
        move = self.move(position)["parameters"]["move"]
        self.assertTrue(move["reached"], move)
        return move

    def picture(self):
        """A snapshot's samples, and what is said of its frame."""
        self.client.send(LENS + "Snapshot", {"lens": "a", "encoding": "raw"}, more=True)
        data, about, reply = b"", None, {"continues": True}
        while reply.get("continues"):
            reply = self.client.receive()
            self.assertNotIn("error", reply)
            data += base64.b64decode(reply["parameters"]["data"])
            about = about or reply["parameters"]["frame"]
        return data, about

    def test_no_fault_the_way_of_a_move_is_that_of_its_speed(self):
        begun = self.truth()["atNs"]
        self.moved(3000)
        end = self.truth()
        self.assertAlmostEqual(end["focusPosition"], 3000, 6)
        # In full flight it makes a step a millisecond; it started after `begun`, and took 3.01 s.
        early, late = (self.truth(atNs=begun + int(2e9) + d) for d in (0, 10 ** 9 // 2))
        self.assertAlmostEqual(late["focusPosition"] - early["focusPosition"], 500, 6)
        self.assertGreater(end["atNs"] - begun, 3.0e9)

    def test_stall(self):
        self.inject("stall", axis="focus")
        move = self.move(500)["parameters"]["move"]
        self.assertFalse(move["reached"])
        self.assertEqual(self.truth()["focusPosition"], 0)

    def test_jump(self):
        self.inject("jump", axis="focus", steps=250)
        self.wait_for(lambda: self.truth()["focusPosition"] == 250)
        self.assertEqual(self.status()["axes"][0]["position"], 0)

    def test_missed_steps(self):
        self.inject("missed-steps", axis="focus", factor=0.25)
        self.moved(1000)
        self.assertAlmostEqual(self.truth()["focusPosition"], 750, 6)
        self.assertAlmostEqual(self.truth()["extensionMm"], 1.6 * 750 / 4000, 9)

    def test_stale_readback(self):
        self.inject("stale-readback", axis="focus")
        move = self.move(800)["parameters"]["move"]
        self.assertFalse(move["reached"], move)
        told = self.status()["axes"][0]["position"]
        self.assertLess(told, 1)
        self.assertGreater(self.truth()["focusPosition"], 100)
        self.inject("stale-readback", axis="focus", forMs=0.001)
        self.wait_for(lambda: abs(self.status()["axes"][0]["position"] - self.truth()["focusPosition"]) < 1)

    def test_drop_reply(self):
        self.moved(400)
        self.inject("drop-reply")
        self.wait_for(lambda: not self.status()["connected"])
        self.assertEqual(self.truth()["focusPosition"], 400)
        self.inject("drop-reply", forMs=0.001)
        self.wait_for(lambda: self.status()["connected"])
        # The lens had its power all the time.
        self.assertEqual((self.status()["axes"][0]["position"], self.status()["axes"][0]["homed"]), (400, True))

    def test_late_reply(self):
        errors = self.status()["counters"]["busErrors"]
        self.inject("late-reply")
        self.wait_for(lambda: self.status()["counters"]["busErrors"] > errors)
        self.inject("late-reply", forMs=0.001)
        self.wait_for(lambda: self.status()["connected"])
        self.moved(300)
        self.assertAlmostEqual(self.truth()["focusPosition"], 300, 6)

    def test_freeze_frames(self):
        first, about = self.picture()
        self.inject("freeze-frames")
        self.moved(3000)
        frozen, again = self.picture()
        self.assertEqual(frozen, first)
        self.assertGreater(again["exposureStartNs"], about["exposureEndNs"])
        self.inject("freeze-frames", forMs=0.001)
        self.assertNotEqual(self.picture()[0], first)

    def test_lose_frames(self):
        lost = self.status()["counters"]["framesLost"]
        begun = self.truth()["atNs"]
        self.inject("lose-frames", forMs=400)
        _, about = self.picture()
        self.assertGreater(about["exposureStartNs"], begun + int(0.4e9))
        self.wait_for(lambda: self.status()["counters"]["framesLost"] > lost)

    def test_wrong_exposure(self):
        plain, about = self.picture()
        self.inject("wrong-exposure", factor=0.25)
        dark, said = self.picture()
        self.assertEqual(about["exposureMs"], said["exposureMs"])
        self.assertAlmostEqual(sum(dark) / sum(plain), 0.25, delta=0.01)

    def test_disconnect_takes_the_place_from_the_lens_and_not_from_the_truth(self):
        self.moved(1000)
        with self.daemon.client() as watcher:
            watcher.send(LENS + "Status", {"lens": "a"}, more=True)
            told = [watcher.receive()["parameters"]["lenses"][0]]

            def until(connection):
                while told[-1]["connection"] != connection:
                    told.append(watcher.receive()["parameters"]["lenses"][0])
                return told[-1]

            self.inject("disconnect")
            gone = until("absent")
            self.assertEqual((gone["connected"], gone["activity"]), (False, "idle"))
            self.assertIn("disconnected", gone["error"])
            for axis in gone["axes"]:
                self.assertEqual((axis["homed"], axis["moving"], axis["lastKnown"], axis["positionBound"]),
                                 (False, False, True, None), axis)
            self.assertEqual(gone["axes"][0]["position"], 1000)
            self.assertEqual(self.move(9)["error"], LENS + "Disconnected")
            self.inject("reconnect")
            back = until("connected")
            self.assertIsNone(back["error"])
            for axis in back["axes"]:
                self.assertEqual((axis["homed"], axis["lastKnown"]), (False, False), axis)
        # It was without power, so it counts from zero; what it looks through has not moved.
        self.assertEqual((back["axes"][0]["position"], self.truth()["focusPosition"]), (0, 1000))
        refused = self.move(500)
        self.assertEqual((refused["error"], refused["parameters"]["axis"]), (LENS + "NotHomed", "focus"))
        self.call("Home", lens="a", axis="focus")
        self.assertTrue(self.status()["axes"][0]["homed"])
        self.assertAlmostEqual(self.truth()["focusPosition"], 0, 6)
        self.moved(500)
        self.assertAlmostEqual(self.truth()["focusPosition"], 500, 6)

    def test_disconnect_in_mid_move_stops_it_dead(self):
        with self.daemon.client() as mover:
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3000}})
            self.wait_for(lambda: self.truth()["focusPosition"] > 200)
            self.inject("disconnect", forMs=300)
            self.assertEqual(mover.receive()["error"], LENS + "Disconnected")
            stood = self.truth()["focusPosition"]
            self.assertTrue(200 < stood < 3000, stood)
        self.wait_for(lambda: self.status()["connected"])
        self.assertEqual(self.truth()["focusPosition"], stood)
        self.assertFalse(self.status()["axes"][0]["homed"])

    def test_blur_lowers_contrast_as_a_disk_does(self):
        """A sinusoid of 8 px behind a disk of d px keeps 2 J1(x) / x of its contrast, x = pi d / 8."""
        self.call("Move", lens="a", axis="iris", target={"position": 0})
        for position in (0, 300, 900, 1600):
            self.moved(position)
            true = self.truth(vergenceD=1 / 1.2)
            x = math.pi * true["blurUm"] / 3.45 / 8
            told = self.client.call(SIM + "Render", {"lens": "a"})["parameters"]
            row = rows_of(base64.b64decode(told["png"]))[24]
            mean = sum(row) / 64
            wave = sum(sample * math.cos(math.pi * (i + 0.5) / 4) for i, sample in enumerate(row)) / 32
            self.assertAlmostEqual(wave / mean, 2 * bessel_j1(x) / x, delta=0.02, msg=(position, x))


class AbsentTest(unittest.TestCase):
    """What was never there is told in the same words, whichever driver was to find it."""

    def test_a_lens_that_is_not_there_looks_the_same_for_every_driver(self):
        with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as file:
            scene = file.read() + '[[fault]]\nkind = "disconnect"\nat_ms = 0\n'
        with tempfile.TemporaryDirectory(prefix="lensd-absent-") as folder:
            with open(os.path.join(folder, "gone.toml"), "w", encoding="utf-8") as file:
                file.write(scene)
            lenses = {"sim": f'scene = "{folder}/gone.toml"', "lensconnect": 'serial = "nowhere"',
                      "uvc": 'serial = "nowhere"', "v4l2": f'device = "{folder}/video99"'}
            daemon = Daemon(config="version = 1\n" + "".join(
                f'[[lens]]\nname = "{name}"\ndriver = "{name}"\n{how}\n' for name, how in lenses.items()))
            try:
                with daemon.client() as client:
                    told = {one["name"]: one for one in client.call(LENS + "Status")["parameters"]["lenses"]}
                    # Where a driver says why in its own words, there is a why.
                    for name, one in told.items():
                        self.assertTrue(one.pop("error"), name)
                        self.assertEqual((one.pop("name"), one.pop("warnings")), (name, []))
                        one.pop("readAtNs")
                    for name in lenses:
                        self.assertEqual(told[name]["connection"], "absent", name)
                        self.assertEqual(told[name], told["sim"], name)
                        move = client.call(LENS + "Move", {"lens": name, "axis": "focus", "target": {"position": 1}})
                        self.assertEqual(move["error"], LENS + "Disconnected", (name, move))
                        self.assertEqual(move["parameters"]["lens"], name)
            finally:
                self.assertEqual(daemon.stop(), 0)


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
