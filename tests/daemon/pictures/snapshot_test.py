"""Pictures of one frame in every encoding, by Snapshot, View and `lensctl snapshot`."""
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, LENS, DaemonTest  # noqa: E402
from viewer import COLOUR_SCENE, FileClient, next_picture, scene_daemon, snapshot, view, words  # noqa: E402


def read_png(data):
    """Width, height, channels, bits and samples of a PNG without interlace."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + length]
        at += 12 + length
    channels = {0: 1, 2: 3}[colour]
    step = channels * bits // 8
    raw, row, samples = zlib.decompress(packed), width * step, []
    before = bytes(row)
    for y in range(height):
        start = y * (row + 1)
        method, line = raw[start], bytearray(raw[start + 1:start + 1 + row])
        for i in range(row):
            left = line[i - step] if i >= step else 0
            corner = before[i - step] if i >= step else 0
            paeth = min((abs(before[i] - corner), 0, left), (abs(left - corner), 1, before[i]),
                        (abs(left + before[i] - 2 * corner), 2, corner))[2]
            line[i] = (line[i] + (0, left, before[i], (left + before[i]) // 2, paeth)[method]) & 255
        before = bytes(line)
        samples += line if bits == 8 else struct.unpack(f">{row // 2}H", line)
    return width, height, channels, bits, samples


class ColourTest(DaemonTest):
    """A colour camera of 12 bits without noise, before a scene that stands still: all pictures of it are alike."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-view-")
        cls.daemon = scene_daemon(cls.folder.name, COLOUR_SCENE)

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_every_encoding_shows_the_same_picture(self):
        with FileClient(self.daemon.socket) as client:
            camera = client.call(LENS + "List")["parameters"]["lenses"][0]["camera"]
            self.assertTrue(camera["colour"])
            about, raw = snapshot(client, encoding="raw")
            self.assertEqual((about["picture"]["channels"], about["picture"]["bits"]), (3, 12))
            samples = words(raw)
            self.assertEqual(len(samples), 64 * 48 * 3)
            self.assertLessEqual(max(samples), 4095)
            self.assertGreater(max(samples) - min(samples), 500)
            _, png = snapshot(client, encoding="png")
            self.assertEqual(read_png(png), (64, 48, 3, 16, [(s * 65535 + 2047) // 4095 for s in samples]))
            about, rgb = snapshot(client, encoding="rgb8")
            self.assertEqual((about["picture"]["channels"], about["picture"]["bits"]), (3, 8))
            self.assertLessEqual(max(abs(b - s * 255 / 4095) for b, s in zip(rgb, samples)), 0.51)
            about, gray = snapshot(client, encoding="gray8")
            self.assertEqual((about["picture"]["channels"], len(gray)), (1, 64 * 48))
            # The scene is grey, so its luminance is each of its colours, but for what their roundings leave.
            self.assertLessEqual(max(abs(g - s * 255 / 4095) for g, s in zip(gray, samples[1::3])), 0.6)
            about, jpeg = snapshot(client, encoding="jpeg")
            self.assertEqual((jpeg[:2], jpeg[-2:]), (b"\xff\xd8", b"\xff\xd9"))
            self.assertEqual((about["picture"]["gamma"], about["frame"]["gamma"]), (2.2, 1.0))

    def test_a_view_is_bit_for_bit_the_snapshot(self):
        with FileClient(self.daemon.socket) as client, FileClient(self.daemon.socket) as other:
            for encoding in ("raw", "png", "rgb8", "gray8", "jpeg"):
                _, wanted = snapshot(client, encoding=encoding)
                for fd in (False, True):
                    with FileClient(self.daemon.socket) as viewer:
                        view(viewer, encoding=encoding, fd=fd)
                        for _ in range(3):
                            self.assertEqual(next_picture(viewer)[1], wanted, (encoding, fd))
            view(other, encoding="raw", fd=True)
            next_picture(other)


class LensctlTest(DaemonTest):
    """`lensctl snapshot` as people use it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lensd-view-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def snapshot(self, name, *options):
        path = os.path.join(self.folder, name)
        done = self.daemon.lensctl("--json", "snapshot", "a", "-o", path, *options)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(path, "rb") as file:
            return json.loads(done.stdout), file.read()

    def test_the_encoding_follows_the_file_or_the_option(self):
        self.assertEqual(self.snapshot("x.png")[1][:4], b"\x89PNG")
        self.assertEqual(self.snapshot("x.jpg")[1][:2], b"\xff\xd8")
        self.assertEqual(self.snapshot("X.JPG")[1][:2], b"\xff\xd8")
        self.assertEqual(self.snapshot("x")[1][:4], b"\x89PNG")
        about, data = self.snapshot("x.png", "--encoding", "gray8")
        self.assertEqual(len(data), about["widthPx"] * about["heightPx"])

    def test_stdout_takes_the_picture_and_nothing_else(self):
        lensctl = [os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket]
        done = subprocess.run([*lensctl, "snapshot", "a", "-o", "-"], capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((done.stdout[:4], done.stdout[-8:-4]), (b"\x89PNG", b"IEND"))
        self.assertIn(b"f/", done.stderr)
        done = subprocess.run([*lensctl, "--json", "snapshot", "a", "-o", "-"], capture_output=True, timeout=60)
        self.assertEqual((done.returncode, b"name a file" in done.stderr), (64, True), done)

    def test_a_part_made_smaller(self):
        about, data = self.snapshot("x", "--encoding", "raw", "--region", "0.5,0,0.5,1", "--scale-to", "16x16", "--in-motion")
        picture = about["picture"]
        self.assertEqual((picture["leftPx"], picture["topPx"]), (32, 0))
        self.assertEqual((picture["widthPx"], picture["heightPx"]), (11, 16))
        self.assertEqual(len(data), 11 * 16)

    def test_wrong_options_say_what_is_right(self):
        path = os.path.join(self.folder, "x")
        done = self.daemon.lensctl("snapshot", "a", "-o", path + ".dat")
        self.assertEqual((done.returncode, ".png" in done.stderr), (64, True), done.stderr)
        for options, word in ((("--encoding", "gif"), "jpeg"), (("--region", "1,2"), "X,Y,W,H"),
                              (("--scale-to", "16"), "WIDTHxHEIGHT"), (("--scale-to", "0x5"), "WIDTHxHEIGHT"),
                              (("--region", "0.5,0.5,0.6,0.6"), "at most 1")):
            done = self.daemon.lensctl("snapshot", "a", "-o", path, *options)
            self.assertEqual(done.returncode, 64, done.stderr)
            self.assertIn(word, done.stderr)
        done = self.daemon.lensctl("snapshot", "a", "-o", path, "--encoding", "rgb8")
        self.assertEqual((done.returncode, "gray8" in done.stderr), (8, True), done.stderr)


if __name__ == "__main__":
    unittest.main()
