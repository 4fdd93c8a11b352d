"""ASCOM Alpaca counts in the steps of a device, whatever its unit: lensd on played V4L2 nodes."""
import os
import random
import subprocess
import tempfile
import time
import unittest

from alpaca_test import Asks
from web_harness import HERE, PATIENCE, Daemon, Web


class StepsTest(Asks, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lens-web-steps-")
        cls.library = os.path.join(cls.folder.name, "v4l2_node.so")
        source = os.path.join(HERE, "..", "daemon", "v4l2_node.c")
        subprocess.run(["cc", "-O1", "-w", "-shared", "-fPIC", "-o", cls.library, source, "-ldl", "-lpthread"], check=True)
        cls.draw = random.Random(7)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def play(self, low, high, step, stands, more):
        node, table = os.path.join(self.folder.name, "video0"), os.path.join(self.folder.name, "table.ctl")
        for path, text in ((node, ""), (table, f"009a090a 1 {low} {high} {step} {low} {stands} 0\n")):
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        os.environ.update({"FAKE_NODE": node, "FAKE_CTL": table, "FAKE_FMT": "320 240 GREY 30"})
        daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "cam"\ndriver = "v4l2"\ndevice = "{node}"\nparts = "lens"\n{more}',
                        preload=self.library)
        self.addCleanup(lambda: self.assertEqual(daemon.stop(), 0))
        web = Web(daemon.socket, "--alpaca", "127.0.0.1:0")
        self.addCleanup(web.stop)
        self.alpaca = web.alpaca
        self.assertEqual(self.put("connected", Connected="True"), 0)

    def check(self, low, high, step, stands, more=""):
        self.play(low, high, step, stands, more)
        count = (high - low) // step
        self.assertEqual((self.get("maxstep"), self.get("maxincrement")), (count, count))
        first = self.get("position")
        self.assertTrue(0 <= first <= count)
        self.assertLessEqual(abs(first * step - (min(max(stands, low), high) - low)), step / 2)
        inside = [self.draw.randint(0, count) for _ in range(6)]
        for wish in [0, 1, count, *inside, count + self.draw.randint(1, 10**6), -self.draw.randint(1, 10**6)]:
            self.assertEqual(self.put("move", Position=wish), 0)
            deadline = time.monotonic() + 20 * PATIENCE
            while self.get("ismoving"):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.005)
            self.assertEqual(self.get("position"), min(max(wish, 0), count), (low, high, step, more))

    def test_dioptres(self):
        self.check(0, 4095, 1, 0, 'focus_unit = "dioptres"\nfocus_scale = 0.00293\n')

    def test_a_step_of_five(self):
        self.check(0, 250, 5, 27)

    def test_a_scale(self):
        self.check(0, 4095, 1, 0, "focus_scale = 7\n")

    def test_an_axis_that_stands_below_its_range(self):
        self.check(-3473, 1526, 1, -5454)

    def test_drawn_grids(self):
        for _ in range(3):
            low, step = self.draw.randint(-10**4, 10**4), self.draw.randint(1, 50)
            high = low + step * self.draw.randint(20, 2000)
            self.check(low, high, step, self.draw.randint(low, high), f"focus_scale = {10**self.draw.uniform(-4, 2):.4g}\n")
            self.doCleanups()


if __name__ == "__main__":
    unittest.main()
