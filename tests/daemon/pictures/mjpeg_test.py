"""A webcam whose pictures are not as they should be, on a played V4L2 node: what every viewer shows is shown and counted, what
has lost a part is dropped and counted, and whoever waits for a frame is told at once why none can be used."""
import json
import os
import random
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, driver_processes, played_node  # noqa: E402

JPEGS = os.path.join(HERE, "..", "drivers", "pixels", "jpegs")
CONTROLS = "009a090a 1 0 250 5 0 0 0\n"
PICTURES = "64 48 MJPG 30"
CUT = "none could be decoded: damaged: Premature end of JPEG file"


def pixels(path):
    """What a PNG shows, packed, without when it was taken."""
    with open(path, "rb") as file:
        png = file.read()
    at, shown = 8, b""
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        if kind == b"IDAT":
            shown += png[at + 8:at + 8 + size]
        at += size + 12
    return zlib.decompress(shown)


class MjpegTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-mjpeg-")
        cls.library = played_node(cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    def show(self, data):
        """From the next frame on."""
        with open(self.path("new.jpg"), "wb") as file:
            file.write(data)
        os.replace(self.path("new.jpg"), self.path("shown.jpg"))

    def jpeg(self, name):
        with open(os.path.join(JPEGS, name + ".jpg"), "rb") as file:
            return file.read()

    def play(self, pictures=PICTURES, jpeg=True, process="inside"):
        for name, text in (("video0", ""), ("table.ctl", CONTROLS)):
            with open(self.path(name), "w", encoding="utf-8") as file:
                file.write(text)
        environment = {"FAKE_NODE": self.path("video0"), "FAKE_CTL": self.path("table.ctl"), "FAKE_FMT": pictures}
        if jpeg:
            environment["FAKE_JPEG"] = self.path("shown.jpg")
        daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "cam"\ndriver = "v4l2"\ndevice = "{self.path("video0")}"\n'
                               f'parts = "both"\nprocess = "{process}"\n', preload=self.library, environment=environment)
        self.addCleanup(daemon.stop)
        return daemon

    def metrics(self, daemon):
        with daemon.client() as client:
            return client.call(LENS + "Metrics")["parameters"]["lenses"][0]

    def snapshot(self, daemon):
        done = daemon.lensctl("snapshot", "-o", self.path("x.png"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr + daemon.log())
        return pixels(self.path("x.png"))

    def test_what_shows_is_shown_and_what_is_lost_is_told_at_once(self):
        self.show(self.jpeg("good"))
        daemon = self.play()
        good = self.snapshot(daemon)
        self.assertEqual(self.metrics(daemon)["framesFlawed"], 0)
        for name in ("one-extra", "extra-before-restarts", "extra-before-end", "no-end"):
            before = self.metrics(daemon)
            self.show(self.jpeg(name))
            self.assertEqual(self.snapshot(daemon), good, name)
            self.assertGreater(self.metrics(daemon)["framesFlawed"], before["framesFlawed"], name)
        self.assertEqual(self.metrics(daemon)["counters"]["framesDamaged"], 0)
        self.show(self.jpeg("cut"))
        for command in (("snapshot", "-o", self.path("y.png")), ("autofocus",)):
            began = time.monotonic()
            done = daemon.lensctl(*command)
            self.assertNotEqual(done.returncode, 0, command)
            self.assertIn(CUT, done.stdout + done.stderr, command)
            self.assertRegex(done.stdout + done.stderr, r"[1-9][0-9] frames came, ")
            self.assertLess(time.monotonic() - began, 4 * PATIENCE, command)
        with daemon.client() as client:
            began = time.monotonic()
            seen = client.call(LENS + "View", {"lens": "cam"}, more=True)
            self.assertIn(CUT, json.dumps(seen))
            self.assertLess(time.monotonic() - began, 4 * PATIENCE)
        counters = self.metrics(daemon)["counters"]
        self.assertGreaterEqual(counters["framesDamaged"], 30)
        self.assertGreaterEqual(counters["framesLost"], counters["framesDamaged"])
        self.assertEqual(counters["busErrors"], 0)
        self.show(self.jpeg("good"))
        self.assertEqual(self.snapshot(daemon), good)

    def test_through_a_process_of_its_own_it_goes_as_inside(self):
        self.show(self.jpeg("good"))
        inside = self.play()
        good = self.snapshot(inside)
        inside.stop()
        self.assertEqual(driver_processes(inside), [])
        daemon = self.play(process="own")
        self.assertEqual(len(driver_processes(daemon)), 1)
        self.assertEqual(self.snapshot(daemon), good)
        before = self.metrics(daemon)["framesFlawed"]
        self.show(self.jpeg("one-extra"))
        self.assertEqual(self.snapshot(daemon), good)
        self.assertGreater(self.metrics(daemon)["framesFlawed"], before)
        self.show(self.jpeg("cut"))
        done = daemon.lensctl("snapshot", "-o", self.path("y.png"))
        self.assertNotEqual(done.returncode, 0)
        self.assertIn(CUT, done.stdout + done.stderr)
        self.assertGreater(self.metrics(daemon)["counters"]["framesDamaged"], 0)

    def test_a_bad_one_now_and_then_is_waited_out(self):
        draw = random.Random(8)
        good = self.jpeg("good")
        self.show(good)
        daemon = self.play()
        expected = self.snapshot(daemon)
        for _ in range(12):
            self.show(good[:draw.randrange(0, len(good) - 3)])
            snapshot = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", daemon.socket,
                                         "snapshot", "-o", self.path("z.png")], stdout=subprocess.DEVNULL)
            time.sleep(draw.uniform(0.05, 0.3))
            self.show(good)
            self.assertEqual(snapshot.wait(20 * PATIENCE), 0)
            self.assertEqual(pixels(self.path("z.png")), expected)

    def test_bytes_that_are_not_the_rows_are_named(self):
        for bytes_more, words in ((3 * 64 * 48, "three bytes a pixel: this looks like RGB"), (64 * 48 + 1, "1 too many")):
            with self.subTest(words):
                daemon = self.play(f"64 48 GREY 30 64 {bytes_more}", jpeg=False)
                done = daemon.lensctl("snapshot", "-o", self.path("x.png"))
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(f"none could be used: {bytes_more} bytes came", done.stdout + done.stderr)
                self.assertIn(words, done.stdout + done.stderr)
        # What a kernel's driver pads is no fault of the picture.
        daemon = self.play("64 48 GREY 30 64 4096", jpeg=False)
        self.snapshot(daemon)


if __name__ == "__main__":
    unittest.main()
