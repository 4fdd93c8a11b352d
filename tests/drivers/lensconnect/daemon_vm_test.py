#!/usr/bin/env python3
"""In the virtual machine: lensd with a LensConnect lens on uhid that comes, goes in mid-move and comes back, beside a lens
that is always there. Its driver runs in a process of its own."""
import json
import os
import subprocess
import sys
import time
import tomllib
import unittest

ROOT, BIN = sys.argv[1:3]
del sys.argv[1:]
os.environ["LENSD_BIN"] = BIN
os.environ.setdefault("LENSD_TEST_PATIENCE", "10")
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon"))
from harness import LENS, PATIENCE, Daemon  # noqa: E402

CONFIG = f"""version = 1
[[lens]]
name = "usb"
driver = "lensconnect"
process = "own"
serial = "A123"
[[lens]]
name = "here"
driver = "sim"
scene = "{os.path.join(ROOT, "tests", "daemon", "small.toml")}"
"""


class Plugged(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.lens = subprocess.Popen([os.path.join(BIN, "uhid_lens"), "A123"], stdin=subprocess.PIPE,
                                    stdout=subprocess.PIPE, text=True)
        cls.daemon = Daemon(config=CONFIG)

    @classmethod
    def tearDownClass(cls):
        log = cls.daemon.log()
        status = cls.daemon.stop()
        cls.lens.stdin.close()
        cls.lens.wait(timeout=30)
        cls.lens.stdout.close()
        if status != 0:
            raise AssertionError(f"lensd ended with {status}: {log}")

    def tell(self, command):
        self.lens.stdin.write(command + "\n")
        self.lens.stdin.flush()
        answer = self.lens.stdout.readline().strip()
        self.assertFalse(answer.startswith("error"), answer)
        return answer

    def status(self, name="usb"):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": name})["parameters"]["lenses"][0]

    def axis(self, axis):
        return next(a for a in self.status()["axes"] if a["axis"] == axis)

    def wait_for(self, condition, seconds=20):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened: " + json.dumps(self.status()))
            time.sleep(0.02)

    def call(self, method, **parameters):
        with self.daemon.client(timeout=60 * PATIENCE) as client:
            return client.call(LENS + method, {"lens": "usb", **parameters})

    def move(self, axis, native):
        return self.call("Move", axis=axis, target={"position": native})

    def check_the_other_lens(self, native):
        with self.daemon.client(timeout=60 * PATIENCE) as client:
            reply = client.call(LENS + "Move", {"lens": "here", "axis": "focus", "target": {"position": native}})
        self.assertTrue(reply["parameters"]["move"]["reached"], reply)

    def test_a_life(self):
        # Not there yet.
        self.assertFalse(self.status()["connected"])
        self.assertEqual(self.move("focus", 10)["error"], LENS + "Disconnected")
        # It comes: no restart, no event from udev here.
        self.tell("plug")
        self.wait_for(lambda: self.status()["connected"])
        self.assertFalse(self.axis("focus")["homed"])
        self.assertEqual(self.move("focus", 10)["error"], LENS + "NotHomed")
        device, = json.loads(self.daemon.lensctl("devices", "--json").stdout)
        self.assertEqual((device["driver"], device["serial"], device["usedBy"], device["problem"]),
                         ("lensconnect", "A123", "usb", None))
        self.assertEqual(tomllib.loads(device["config"]),
                         {"lens": [{"name": "usb", "driver": "lensconnect", "serial": "A123"}]})
        self.assertIn("used by usb", self.daemon.lensctl("devices").stdout)
        homed = self.call("Home")["parameters"]["moves"]
        self.assertEqual([m["reached"] for m in homed], [True] * 4, homed)
        for number, (axis, target) in enumerate((("zoom", 1500), ("focus", 2500), ("iris", 300), ("filter", 2))):
            moved = self.move(axis, target)["parameters"]["move"]
            self.assertTrue(moved["reached"] and not moved["verified"], moved)
            self.assertEqual(self.tell(f"position {number}"), str(target))
        # It goes in mid-move.
        with self.daemon.client(timeout=60 * PATIENCE) as mover:
            mover.send(LENS + "Move", {"lens": "usb", "axis": "focus", "target": {"position": 0}})
            self.wait_for(lambda: self.axis("focus")["moving"] and self.axis("focus")["position"] < 2450)
            self.tell("unplug")
            self.assertEqual(mover.receive()["error"], LENS + "Disconnected")
        self.wait_for(lambda: not self.status()["connected"])
        self.assertEqual(self.call("Stop")["error"], LENS + "Disconnected")
        self.check_the_other_lens(40)
        # It comes back: found again, and nobody knows where it is.
        self.tell("plug")
        self.wait_for(lambda: self.status()["connected"])
        self.assertFalse(self.axis("focus")["homed"])
        self.assertEqual(self.move("focus", 100)["error"], LENS + "NotHomed")
        self.assertTrue(self.call("Home", axis="focus")["parameters"]["moves"][0]["reached"])
        self.assertTrue(self.move("focus", 100)["parameters"]["move"]["reached"])
        self.assertEqual(self.tell("position 1"), "100")
        self.check_the_other_lens(80)
        # Once more, at rest.
        self.tell("unplug")
        self.wait_for(lambda: not self.status()["connected"])
        self.tell("plug")
        self.wait_for(lambda: self.status()["connected"])


if __name__ == "__main__":
    unittest.main()
