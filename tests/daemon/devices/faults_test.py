"""Every kind of fault of a simulated lens on demand, seen from outside and judged by what is true of the mechanism; and
what a lens tells when it has gone or was never there."""
import base64
import math
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bench import KINDS, SIM, rows_of  # noqa: E402
from event_stream import Stream  # noqa: E402
from harness import HERE, LENS, Daemon, DaemonTest  # noqa: E402

CREEP = 0.1  # steps: a mechanism comes to rest exponentially, a settled move is within this


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
        self.call("Move", lens="a", axis="iris", target={"position": 20})  # f/2.3: white is well below full scale

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
        self.assertAlmostEqual(end["focusPosition"], 3000, delta=CREEP)
        # In full flight it makes a step a millisecond; it started after `begun`, and took 3.01 s.
        early, late = (self.truth(atNs=begun + int(2e9) + d) for d in (0, 10 ** 9 // 2))
        self.assertAlmostEqual(late["focusPosition"] - early["focusPosition"], 500, 6)
        self.assertGreater(end["atNs"] - begun, 3.0e9)

    def test_stall(self):
        self.inject("stall", axis="focus")
        move = self.move(500)["parameters"]["move"]
        self.assertFalse(move["reached"])
        self.assertAlmostEqual(self.truth()["focusPosition"], 0, delta=CREEP)

    def test_jump(self):
        self.inject("jump", axis="focus", steps=250)
        self.wait_for(lambda: abs(self.truth()["focusPosition"] - 250) < CREEP)
        self.assertEqual(self.status()["axes"][0]["position"], 0)

    def test_missed_steps(self):
        self.inject("missed-steps", axis="focus", factor=0.25)
        self.moved(1000)
        self.assertAlmostEqual(self.truth()["focusPosition"], 750, delta=CREEP)
        self.assertAlmostEqual(self.truth()["extensionMm"], 1.6 * 750 / 4000, delta=1.6 * CREEP / 4000)

    def test_stale_readback(self):
        self.inject("stale-readback", axis="focus")
        move = self.move(800)["parameters"]["move"]
        self.assertFalse(move["reached"], move)
        told = self.status()["axes"][0]["position"]
        self.assertLess(told, 1)
        self.assertGreater(self.truth()["focusPosition"], 100)
        for said in (move, self.status()["axes"][0]):
            self.assertLessEqual(abs(self.truth()["focusPosition"] - said["position"]), said["positionBound"])
        saved = self.client.call(LENS + "PresetSave", {"label": "stuck"})["parameters"]["preset"]
        there = self.truth()["focalPlaneD"]
        self.assertLessEqual(abs(there - saved["vergenceD"]), saved["vergenceBoundD"], "a preset knows no more than the axis")
        self.inject("stale-readback", axis="focus", forMs=0.001)
        self.wait_for(lambda: abs(self.status()["axes"][0]["position"] - self.truth()["focusPosition"]) < 1)
        self.assertLess(self.status()["axes"][0]["positionBound"], 1)

    def test_drop_reply(self):
        self.moved(400)
        self.inject("drop-reply")
        self.wait_for(lambda: not self.status()["connected"])
        self.assertAlmostEqual(self.truth()["focusPosition"], 400, delta=CREEP)
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
        self.assertAlmostEqual(self.truth()["focusPosition"], 300, delta=CREEP)

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

    def test_a_thermometer_that_reports_what_cannot_be_is_not_believed(self):
        self.wait_for(lambda: self.status()["temperatureC"] == 20)
        with Stream(self.daemon, lens="a") as stream:
            for gone, says in ((-127, "range_c"), (0, "0 C"), (60, "max_c_per_min")):
                before = self.status()["counters"]["temperaturesLeftOut"]
                self.inject("wrong-temperature", byC=gone - 20)
                told = stream.until(lambda kind, value, _: kind == "thermometer" and value["fault"] is not None)
                self.assertIn(says, told["thermometer"]["fault"])
                self.wait_for(lambda: self.status()["counters"]["temperaturesLeftOut"] > before)
                now = self.status()
                self.assertEqual((now["temperatureC"], now["temperatureFault"]), (20, told["thermometer"]["fault"]))
                self.daemon.wait_log("a: its thermometer is not believed", says, f"{gone} C")
                self.assertIn(now["temperatureFault"], self.daemon.lensctl("status", "a").stdout)
                self.assertIn(now["temperatureFault"], self.daemon.lensctl("doctor").stdout)
                metrics = self.call("Metrics", lens="a")["lenses"][0]
                self.assertGreater(metrics["counters"]["temperaturesLeftOut"], before)
                self.inject("wrong-temperature", forMs=0.001)
                stream.of("thermometer", fault=None)
        self.daemon.wait_log("a: its thermometer is believed again", times=3)

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
                self.assertEqual((axis["homed"], axis["lastKnown"], axis["positionBound"]), (False, False, None), axis)
        # It was without power, so it counts from zero; what it looks through has not moved.
        self.assertEqual(back["axes"][0]["position"], 0)
        self.assertAlmostEqual(self.truth()["focusPosition"], 1000, delta=CREEP)
        refused = self.move(500)
        self.assertEqual((refused["error"], refused["parameters"]["axis"]), (LENS + "NotHomed", "focus"))
        self.call("Home", lens="a", axis="focus")
        self.assertTrue(self.status()["axes"][0]["homed"])
        self.assertAlmostEqual(self.truth()["focusPosition"], 0, delta=CREEP)
        self.moved(500)
        self.assertAlmostEqual(self.truth()["focusPosition"], 500, delta=CREEP)

    def test_without_its_reference_nothing_is_said_of_the_picture(self):
        """So short an interruption that lensd may not have seen it: the lens alone says that it has no reference."""
        self.moved(2178)
        self.inject("disconnect", forMs=20)
        self.wait_for(lambda: (now := self.status())["connected"] and not now["axes"][0]["homed"])
        now = self.status()
        self.assertEqual((now["vergenceD"], now["extensionMm"], now["focalPlaneM"], now["axes"][0]["positionBound"]),
                         (None, None, None, None))
        saved = self.client.call(LENS + "PresetSave", {"lens": "a", "label": "nowhere"})
        self.assertEqual((saved["error"], saved["parameters"]["axis"]), (LENS + "NotHomed", "focus"))
        _, about = self.picture()
        self.assertEqual((about["extensionMm"], about["extensionBoundUm"]), (None, None))
        self.call("Home", lens="a", axis="focus")
        self.assertIsNotNone(self.status()["vergenceD"])

    def test_disconnect_in_mid_move_stops_it_dead(self):
        with self.daemon.client() as mover:
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3000}})
            self.wait_for(lambda: self.truth()["focusPosition"] > 200)
            self.inject("disconnect", forMs=300)
            self.assertEqual(mover.receive()["error"], LENS + "Disconnected")
            stood = self.truth()["focusPosition"]
            self.assertTrue(200 < stood < 3000, stood)
        self.wait_for(lambda: self.status()["connected"])
        # All that is left is what the mechanism lags behind its motor: 1000 steps a second, 5 ms.
        self.assertAlmostEqual(self.truth()["focusPosition"], stood, delta=5)
        self.assertFalse(self.status()["axes"][0]["homed"])

    def test_blur_lowers_contrast_as_a_disk_does(self):
        """A sinusoid of 8 px behind a disk of d px keeps 2 J1(x) / x of its contrast, x = pi d / 8."""
        for position in (1150, 1230, 1430, 1530, 1700):  # about 1330, where the wall is sharp
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
                    for name in lenses:
                        one = told[name]
                        self.assertEqual((one["connection"], one["connected"], one["activity"], one["axes"], one["latched"]),
                                         ("absent", False, "idle", [], False), one)
                        for unknown in ("vergenceD", "focalPlaneM", "extensionMm", "fNumber", "temperatureC"):
                            self.assertIsNone(one[unknown], (name, unknown))
                        self.assertTrue(one["error"], name)  # why, in the driver's own words
                        move = client.call(LENS + "Move", {"lens": name, "axis": "focus", "target": {"position": 1}})
                        self.assertEqual(move["error"], LENS + "Disconnected", (name, move))
                        self.assertEqual(move["parameters"]["lens"], name)
            finally:
                self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main()
