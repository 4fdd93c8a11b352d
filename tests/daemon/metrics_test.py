"""What went well and what went wrong is counted: moves, searches for focus, frames, answers that did not come."""
import json
import os
import random
import tempfile
import time
import unittest

from harness import HERE, LENS, Daemon

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

    def test_each_is_counted_once_and_of_its_own_lens(self):
        draw = random.Random(5)
        nothing = {"framesLost": 0, "framesLate": 0, "packetsLost": 0, "packetsResent": 0, "busErrors": 0}
        with self.daemon.client() as client:
            self.assertEqual(self.metrics(client)["good"],
                             {"lens": "good", "moves": 0, "movesReached": 0, "movesVerified": 0, "autofocuses": 0,
                              "autofocusesFocused": 0, "frames": 0, "counters": nothing})
            reached = verified = 0
            for _ in range(12):
                target = draw.randrange(0, 300)
                move = client.call(LENS + "Move", {"lens": "good", "axis": "focus", "target": {"position": target}})
                reached += move["parameters"]["move"]["reached"]
                verified += move["parameters"]["move"]["verified"]
            superseded = {"lens": "good", "axis": "focus", "target": {"position": 4000}}
            with self.daemon.client() as other:
                other.send(LENS + "Move", superseded)
                self.assertEqual(client.call(LENS + "Stop", {"lens": "good"}), {"parameters": {}})
                self.assertEqual(other.receive()["error"], LENS + "Cancelled")
            focus = client.call(LENS + "Autofocus", {"lens": "good"})["parameters"]["autofocus"]
            good = self.metrics(client)["good"]
            self.assertEqual((good["moves"], good["movesReached"], good["movesVerified"]), (12, reached, verified))
            self.assertEqual((good["autofocuses"], good["autofocusesFocused"]), (1, int(focus["focused"])))
            self.assertGreaterEqual(good["frames"], focus["frames"])
            self.assertEqual(good["counters"], nothing)
            self.assertEqual(self.metrics(client)["bad"]["moves"], 0)

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
