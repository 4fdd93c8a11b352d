"""What went well and what went wrong is counted: moves, searches for focus, frames, answers that did not come."""
import json
import os
import random
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, PATIENCE, Daemon  # noqa: E402

FAULTS = """
[[fault]]
at_ms = 2500
kind = "drop-reply"
for_ms = 200
[[fault]]
at_ms = 4000
kind = "lose-frames"
for_ms = 1500
"""


class Metrics(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        faulty = os.path.join(self.folder.name, "faulty.toml")
        with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as small, open(faulty, "w", encoding="utf-8") as out:
            out.write(small.read() + FAULTS)
        self.began = time.monotonic()
        self.daemon = Daemon(config="version = 1\n" + "".join(
            f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{scene}"\n'
            for name, scene in (("good", os.path.join(HERE, "small.toml")), ("bad", faulty))))
        self.addCleanup(self.daemon.stop)

    def metrics(self, client):
        return {one["lens"]: one for one in client.call(LENS + "Metrics")["parameters"]["lenses"]}

    def wait_until_moving(self, client):
        deadline = time.monotonic() + 20 * PATIENCE
        while client.call(LENS + "Status", {"lens": "good"})["parameters"]["lenses"][0]["activity"] != "moving":
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.005)

    def test_each_is_counted_once_and_of_its_own_lens(self):
        draw = random.Random(5)
        nothing = {"framesLost": 0, "framesLate": 0, "packetsLost": 0, "packetsResent": 0, "busErrors": 0,
                   "temperaturesLeftOut": 0, "framesDamaged": 0}
        with self.daemon.client() as client:
            first = self.metrics(client)["good"]
            for histogram in (first.pop("waitMs"), first.pop("settleMs")):
                self.assertEqual((histogram["count"], histogram["sumMs"]), (0, 0))
                self.assertEqual(histogram["counts"], [0] * (len(histogram["upToMs"]) + 1))
            self.assertEqual(first, {"lens": "good", "moves": 0, "movesReached": 0, "movesVerified": 0, "movesMissed": 0,
                                     "autofocuses": 0, "autofocusesFocused": 0, "frames": 0, "framesFlawed": 0, "refused": 0,
                                     "openings": 1, "failures": 0, "commandsWaiting": 0, "counters": nothing})
            reached = verified = 0
            for _ in range(12):
                target = draw.randrange(0, 300)
                move = client.call(LENS + "Move", {"lens": "good", "axis": "focus", "target": {"position": target}})
                reached += move["parameters"]["move"]["reached"]
                verified += move["parameters"]["move"]["verified"]
            superseded = {"lens": "good", "axis": "focus", "target": {"position": 4000}}
            with self.daemon.client() as other:
                other.send(LENS + "Move", superseded)
                self.wait_until_moving(client)  # of two connections either may be read first
                self.assertEqual(client.call(LENS + "Stop", {"lens": "good"}), {"parameters": {}})
                self.assertEqual(other.receive()["error"], LENS + "Cancelled")
            near = {"from": {"position": 1100}, "to": {"position": 1500}}  # its motors are slow
            focus = client.call(LENS + "Autofocus", {"lens": "good", "range": near})["parameters"]["autofocus"]
            good = self.metrics(client)["good"]
            self.assertEqual((good["moves"], good["movesReached"], good["movesVerified"]), (12, reached, verified))
            self.assertEqual(good["settleMs"]["count"], 12)
            self.assertEqual(good["refused"], 1)  # the move that was stopped
            self.assertEqual((good["autofocuses"], good["autofocusesFocused"]), (1, int(focus["focused"])))
            self.assertGreaterEqual(good["frames"], focus["frames"])
            self.assertEqual(good["counters"], nothing)
            self.assertEqual(self.metrics(client)["bad"]["moves"], 0)

    def test_histograms_say_how_long_moves_took_and_commands_waited(self):
        def place(bounds, ms):
            return next((i for i, bound in enumerate(bounds) if ms <= bound), len(bounds))
        with self.daemon.client() as client:
            took = []
            for target in (10, 700, 720, 0, 1500):
                move = client.call(LENS + "Move", {"lens": "good", "axis": "focus", "target": {"position": target}})
                took.append(move["parameters"]["move"]["elapsedMs"])
            good = self.metrics(client)["good"]
            expected = [0] * (len(good["settleMs"]["upToMs"]) + 1)
            for ms in took:
                expected[place(good["settleMs"]["upToMs"], ms)] += 1
            self.assertEqual(good["settleMs"]["counts"], expected)
            self.assertAlmostEqual(good["settleMs"]["sumMs"], sum(took), delta=0.1)
            self.assertEqual(good["waitMs"]["count"], 5)
            self.assertEqual(sum(good["waitMs"]["counts"]), 5)
            self.assertLess(good["waitMs"]["sumMs"], sum(took))

    def test_refusals_misses_and_openings_are_counted(self):
        with self.daemon.client() as client:
            for target in (1e9, -5.0):
                client.call(LENS + "Move", {"lens": "good", "axis": "focus", "target": {"position": target}})
            self.assertEqual(self.metrics(client)["good"]["refused"], 2)
            self.assertEqual(self.metrics(client)["bad"]["refused"], 0)
            client.call("io.lensd.Simulator.Inject", {"lens": "good", "kind": "missed-steps", "factor": 0.5})
            moved = client.call(LENS + "Move", {"lens": "good", "axis": "focus", "target": {"position": 900}})["parameters"]["move"]
            good = self.metrics(client)["good"]
            self.assertEqual((good["movesMissed"], good["movesReached"]), (int(moved["missed"]), int(moved["reached"])))
            self.assertEqual((good["openings"], good["failures"]), (1, 0))
            daemon = client.call(LENS + "Metrics")["parameters"]["daemon"]
            self.assertLess(daemon["sinceNs"], time.monotonic_ns())
            self.assertEqual([daemon[key] for key in ("failuresTold", "failuresNotTold", "failuresDropped")], [0, 0, 0])

    def test_answers_and_frames_that_do_not_come_are_counted_and_told(self):
        with self.daemon.client() as client:
            while time.monotonic() < self.began + 5:  # over both faults
                client.call(LENS + "Autofocus", {"lens": "bad", "method": "sweep"})
            bad = self.metrics(client)["bad"]
            self.assertGreater(bad["counters"]["busErrors"], 0)
            self.assertGreater(bad["counters"]["framesLost"], 0)
            status = client.call(LENS + "Status", {"lens": "bad"})["parameters"]["lenses"][0]
            self.assertEqual(status["counters"], bad["counters"])
            self.assertEqual(self.metrics(client)["good"]["counters"]["busErrors"], 0)
        told = self.daemon.lensctl("metrics", "bad")
        self.assertEqual(told.returncode, 0, told.stderr)
        self.assertIn(f"{bad['counters']['framesLost']} lost", told.stdout)
        self.assertEqual(json.loads(self.daemon.lensctl("metrics", "bad", "--json").stdout)["lens"], "bad")
        self.assertEqual(self.daemon.lensctl("metrics", "nobody").returncode, 68)


if __name__ == "__main__":
    unittest.main()
