"""The EXIF and XMP of saved pictures, by a reader of its own and by exiv2 where there is one, against what lensd and the bench say."""
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from xml.etree import ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bench import SIM  # noqa: E402
from harness import LENS, DaemonTest  # noqa: E402
from viewer import FileClient, snapshot  # noqa: E402

OWN = "{urn:io.lensd.Lens:1.0/}"


def png_parts(data):
    """EXIF and XMP of a PNG whose every checksum is right, and the data of the picture."""
    at, exif, xmp, picture = 8, None, None, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(kind + body), kind
        if kind == b"eXIf":
            exif = body
        if kind == b"iTXt" and body.startswith(b"XML:com.adobe.xmp\0\0\0\0\0"):
            xmp = body[22:]
        if kind == b"IDAT":
            assert exif and xmp, "they come before the picture"
            picture += body
        at += 12 + length
    return exif, xmp, picture


def without_notes(data):
    at, kept = 8, data[:8]
    while at < len(data):
        end = at + 12 + struct.unpack(">I", data[at:at + 4])[0]
        if data[at + 4:at + 8] not in (b"eXIf", b"iTXt"):
            kept += data[at:end]
        at = end
    return kept


def jpeg_parts(data):
    at, exif, xmp = 2, None, None
    while data[at + 1] != 0xDA:
        assert data[at] == 0xFF
        length = struct.unpack(">H", data[at + 2:at + 4])[0]
        body = data[at + 4:at + 2 + length]
        if data[at + 1] == 0xE1 and body.startswith(b"Exif\0\0"):
            exif = body[6:]
        if data[at + 1] == 0xE1 and body.startswith(b"http://ns.adobe.com/xap/1.0/\0"):
            xmp = body[29:]
        at += 2 + length
    return exif, xmp, data[at:]


def fields(tiff):
    """The fields of a TIFF's first directory and of the EXIF directory it points to, by tag."""
    order = {b"II": "<", b"MM": ">"}[tiff[:2]]
    magic, at = struct.unpack(order + "HI", tiff[2:8])
    assert magic == 42
    found, waiting = {}, [at]
    while waiting:
        at = waiting.pop()
        count = struct.unpack(order + "H", tiff[at:at + 2])[0]
        tags = []
        for i in range(count):
            tag, kind, number = struct.unpack(order + "HHI", tiff[at + 2 + 12 * i:at + 10 + 12 * i])
            size = number * {2: 1, 4: 4, 5: 8, 7: 1}[kind]
            place = at + 10 + 12 * i
            if size > 4:
                place = struct.unpack(order + "I", tiff[place:place + 4])[0]
                assert place % 2 == 0
            raw = tiff[place:place + size]
            assert len(raw) == size
            found[tag] = struct.unpack(order + "II", raw) if kind == 5 else raw
            tags.append(tag)
            if tag == 0x8769:
                waiting.append(struct.unpack(order + "I", raw)[0])
        assert tags == sorted(tags)
        assert struct.unpack(order + "I", tiff[at + 2 + 12 * count:at + 6 + 12 * count])[0] == 0
    return found


def own_words(xmp):
    packet = xmp.decode().split("?>", 1)[1].rsplit("<?xpacket", 1)[0]
    described = ElementTree.fromstring(packet).find(".//{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description")
    return {name[len(OWN):]: value for name, value in described.attrib.items() if name.startswith(OWN)}


class PictureNotes(DaemonTest):
    lenses = ("a",)
    quick = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.work = tempfile.TemporaryDirectory(prefix="lensd-notes-")

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.work.cleanup()

    def move(self, axis, **target):
        with self.daemon.client(60) as client:
            move = client.call(LENS + "Move", {"lens": "a", "axis": axis, "target": target})["parameters"]["move"]
        self.assertTrue(move["reached"])
        return move

    def taken(self, name, *options):
        """A picture's file, and what --json says of it."""
        path = os.path.join(self.work.name, name)
        told = self.daemon.lensctl("--json", "snapshot", "a", "-o", path, *options)
        self.assertEqual(told.returncode, 0, told.stderr)
        with open(path, "rb") as file:
            return path, file.read(), json.loads(told.stdout)

    def judged(self, exif, xmp, frame, move):
        """Holds both against the frame, and against the vergence that the thin lens has there."""
        found, own = fields(exif), own_words(xmp)
        ratio = {tag: pair[0] / pair[1] for tag, pair in found.items() if isinstance(pair, tuple)}
        self.assertAlmostEqual(ratio[0x829A], frame["exposureMs"] / 1e3, 6)
        self.assertAlmostEqual(ratio[0x829D], frame["fNumber"], 5)
        self.assertAlmostEqual(ratio[0x920A], 25.0, 6)
        self.assertEqual((found[0x9000], found[0xA434]), (b"0232", b"a\0"))
        self.assertRegex(found[0x0131], rb"^lensctl [\d.]+\0$")
        self.assertRegex(found[0x9003], rb"^20\d\d:\d\d:\d\d \d\d:\d\d:\d\d\0$")
        z = 25.0 + frame["extensionMm"]
        vergence = 1e3 * (1 / 25.0 - 1 / z)
        self.assertAlmostEqual(float(own["VergenceD"]), vergence, 9)
        self.assertAlmostEqual(float(own["VergenceD"]), move["vergenceD"], 9)
        for name, key in (("ExtensionMm", "extensionMm"), ("ExtensionBoundUm", "extensionBoundUm"), ("FNumber", "fNumber"),
                          ("FNumberBound", "fNumberBound")):
            self.assertEqual(float(own[name]), frame[key])
        self.assertEqual((own["Lens"], own["Moving"], own["FocusPosition"]), ("a", "false", str(move["position"])))
        return ratio, vergence

    def test_png_and_jpeg_say_how_the_lens_stood(self):
        move = self.move("focus", position=1777)
        self.move("iris", position=30)
        for name, parts in (("one.png", png_parts), ("one.jpg", jpeg_parts)):
            with self.subTest(name=name):
                path, data, frame = self.taken(name)
                exif, xmp, _ = parts(data)
                ratio, vergence = self.judged(exif, xmp, frame, move)
                self.assertAlmostEqual(ratio[0x9206], 1 / vergence, 5)
                with self.daemon.client() as client:
                    true = client.call(SIM + "Truth", {"lens": "a"})["parameters"]
                self.assertAlmostEqual(ratio[0x829D], true["fNumber"], delta=frame["fNumberBound"] + 1e-5)
                self.read_by_exiv2(path, frame, vergence)

    def read_by_exiv2(self, path, frame, vergence):
        if shutil.which("exiv2") is None:
            return
        told = subprocess.run(["exiv2", "-PEXkt", path], capture_output=True, text=True, check=False)
        self.assertEqual((told.returncode, told.stderr), (0, ""))
        own = {name.split(".")[-1]: value.strip() for name, value in re.findall(r"^(\S+)\s+(.*)$", told.stdout, re.M)}
        self.assertAlmostEqual(float(own["FNumber"].lstrip("F")), frame["fNumber"], delta=0.06)
        self.assertEqual(own["FocalLength"], "25.0 mm")
        self.assertAlmostEqual(float(own["SubjectDistance"].split()[0]), 1 / vergence, delta=0.006)
        self.assertAlmostEqual(float(own["VergenceD"]), vergence, 9)

    def test_infinity_is_written_as_exif_has_it(self):
        move = self.move("focus", position=0)
        _, data, frame = self.taken("far.png")
        exif, xmp, _ = png_parts(data)
        self.judged(exif, xmp, frame, move)
        self.assertEqual(fields(exif)[0x9206], (0xFFFFFFFF, 1))

    def test_the_picture_itself_is_left_alone_and_other_encodings_have_no_place_for_it(self):
        self.move("focus", position=600)
        _, data, _ = self.taken("with.png")
        with FileClient(self.daemon.socket) as client:  # the scene stands still and has no noise
            _, sent = snapshot(client, encoding="png")
        self.assertEqual(without_notes(data), sent)
        self.assertNotEqual(data, sent)
        _, raw, frame = self.taken("frame.raw", "--encoding", "gray8")
        self.assertEqual(len(raw), frame["picture"]["widthPx"] * frame["picture"]["heightPx"])


if __name__ == "__main__":
    unittest.main()
