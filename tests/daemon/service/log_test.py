"""What fails is logged once, with the lens and the axis; what works is not logged at all."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, DaemonTest  # noqa: E402

SIMULATOR = "io.lensd.Simulator."


class Log(DaemonTest):
    lenses = ("a",)
    quick = True

    def lines(self, *words):
        return [line for line in self.daemon.log().splitlines() if all(word in line for word in words)]

    def move(self, native):
        with self.daemon.client() as client:
            reply = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": native}})
        return reply["parameters"]["move"]

    def inject(self, **fault):
        with self.daemon.client() as client:
            self.assertEqual(client.call(SIMULATOR + "Inject", {"lens": "a", **fault}), {"parameters": {}})

    def test_a_move_that_fails_is_one_line(self):
        self.assertTrue(self.move(500)["reached"])
        self.assertEqual(self.lines("did not get"), [])
        for times in (1, 2):
            self.inject(kind="stall")
            missed = self.move(3000)
            self.assertFalse(missed["reached"])
            self.wait_for(lambda: self.lines("did not get"))
            self.inject(kind="stall", forMs=1)
            self.wait_for(lambda: self.move(500)["reached"])
            self.daemon.wait_log("a: focus did not get to its target", f"({missed['cause']})", missed["reason"], times=times)

    def test_an_autofocus_that_is_refused_is_one_line(self):
        with self.daemon.client() as client:
            self.inject(kind="freeze-frames", forMs=60000)
            refused = client.call(LENS + "Autofocus", {"lens": "a", "deadlineMs": 5000})
            self.inject(kind="freeze-frames", forMs=1)
        if "error" in refused:
            self.skipTest("the camera was dead, and that is an error: " + refused["error"])
        self.assertFalse(refused["parameters"]["autofocus"]["focused"])
        self.wait_for(lambda: len(self.lines("a: autofocus was refused")) == 1)


if __name__ == "__main__":
    unittest.main()
