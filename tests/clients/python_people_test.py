"""What people do with a lens in Python: save and show pictures, presets, undo, exposure, calibration and stacks, each by the
blocking library and by the one for asyncio. What they say is judged by raw calls, by lensctl, and by a PNG reader of the tests."""
import array
import asyncio
import contextlib
import errno
import importlib.util
import json
import os
import random
import re
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

from situations import BIN, LENS, PACKAGE, PATIENCE, ROOT, Daemon

sys.path.insert(0, PACKAGE)
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon", "pictures"))
import lensd  # noqa: E402
from lensd.types import FrameInfo, PictureInfo  # noqa: E402
from snapshot_test import read_png  # noqa: E402
from viewer import COLOUR_SCENE, scene_daemon  # noqa: E402

LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"


def picture_of(samples, width, height, channels, bits, encoding="raw", gamma=1.0):
    """As it comes from lensd; `samples` in rows."""
    info = PictureInfo(encoding=encoding, left_px=0, top_px=0, width_px=width, height_px=height, channels=channels, bits=bits, gamma=gamma)
    frame = FrameInfo(width_px=width, height_px=height, bits=bits, gamma=gamma, sequence=1, exposure_ms=1.0, moving=False, axes=[])
    data = struct.pack(f"<{len(samples)}H", *samples) if bits > 8 else bytes(samples)
    return lensd.Picture(frame, info, 0, memoryview(data))


class Saved(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lensd-saved-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def written(self, picture, name="a.png"):
        path = os.path.join(self.folder, name)
        picture.save(path)
        with open(path, "rb") as file:
            return file.read()

    def test_a_png_has_every_sample(self):
        """10 and 12 bits come back from the 16 of the file without a loss."""
        drawn = random.Random(11)
        for _ in range(400 if LONG else 40):
            bits, channels = drawn.choice([8, 8, 9, 10, 12, 14, 16]), drawn.choice([1, 3])
            width, height = drawn.randint(1, 40), drawn.randint(1, 20)
            largest = (1 << bits) - 1
            samples = [drawn.choice([0, largest, drawn.randint(0, largest)]) for _ in range(width * height * channels)]
            encoding = drawn.choice(["raw", "rgb8" if channels == 3 else "gray8"]) if bits == 8 else "raw"
            with self.subTest(bits=bits, channels=channels, width=width, height=height, encoding=encoding):
                picture = picture_of(samples, width, height, channels, bits, encoding)
                file = self.written(picture, drawn.choice(["a.png", "B.PNG"]))
                deep = 8 if bits == 8 else 16
                *about, stored = read_png(file)
                self.assertEqual(about, [width, height, channels, deep])
                self.assertEqual([round(sample * largest / ((1 << deep) - 1)) for sample in stored], samples)
                self.assertLessEqual(max(abs(sample / ((1 << deep) - 1) - was / largest) for sample, was in zip(stored, samples)), 0.5 / 65535)
                self.assertEqual(picture._repr_png_(), file)
                self.assertIsNone(picture._repr_jpeg_())
        self.assertEqual([name for name in os.listdir(self.folder) if name.endswith(".tmp")], [])

    def test_its_chunks_are_whole_and_it_says_its_gamma(self):
        file = self.written(picture_of([1, 2, 3], 3, 1, 1, 12, gamma=2.2))
        at, kinds = 8, []
        while at < len(file):
            length, kind = struct.unpack(">I4s", file[at:at + 8])
            data = file[at + 8:at + 8 + length]
            self.assertEqual(struct.unpack(">I", file[at + 8 + length:at + 12 + length])[0], zlib.crc32(kind + data))
            if kind == b"gAMA":
                self.assertEqual(struct.unpack(">I", data)[0], 45455)
            kinds.append(kind)
            at += 12 + length
        self.assertEqual((at, kinds), (len(file), [b"IHDR", b"gAMA", b"IDAT", b"IEND"]))

    def test_what_cannot_be_saved_says_what_to_do(self):
        grey = picture_of([1, 2], 2, 1, 1, 8)
        file = picture_of([1, 2], 2, 1, 1, 8, encoding="jpeg")
        for picture, name, words in ((grey, "a.gif", "saved as .png"), (grey, "a", "saved as .png"), (grey, "a.jpg", "encoding='jpeg'"),
                                     (file, "a.png", "save it as .jpg")):
            with self.assertRaisesRegex(ValueError, words):
                picture.save(os.path.join(self.folder, name))
        self.assertEqual(os.listdir(self.folder), [])
        self.assertEqual(self.written(file, "a.jpeg"), b"\1\2")
        self.assertEqual((file._repr_png_(), file._repr_jpeg_()), (None, b"\1\2"))
        with self.assertRaises(OSError) as caught:
            grey.save(os.path.join(self.folder, "nowhere", "a.png"))
        self.assertEqual((caught.exception.errno, caught.exception.filename), (errno.ENOENT, os.path.join(self.folder, "nowhere", "a.png")))
        with self.assertRaises(OSError):
            grey.save("/dev/full/a.png")

    @unittest.skipUnless(importlib.util.find_spec("numpy"), "numpy is not installed")
    def test_numpy_sees_the_samples(self):
        import numpy  # pylint: disable=import-outside-toplevel
        drawn = random.Random(12)
        for _ in range(30):
            bits, channels, width, height = drawn.choice([8, 12, 16]), drawn.choice([1, 3]), drawn.randint(1, 9), drawn.randint(1, 9)
            samples = [drawn.randrange(1 << bits) for _ in range(width * height * channels)]
            picture = picture_of(samples, width, height, channels, bits)
            seen = numpy.asarray(picture)
            self.assertEqual(seen.dtype, numpy.uint16 if bits > 8 else numpy.uint8)
            self.assertEqual(seen.shape, (height, width, 3) if channels == 3 else (height, width))
            self.assertEqual(seen.flatten().tolist(), samples)
            self.assertEqual(seen.__array_interface__["data"][0], numpy.frombuffer(picture.data, numpy.uint8).__array_interface__["data"][0])
            self.assertEqual(numpy.asarray(picture, dtype=float).sum(), sum(samples))
            copied = numpy.array(picture)
            copied[0] = 0  # its own memory, which may be written
            self.assertEqual(numpy.asarray(picture).flatten().tolist(), samples)
            picture.close()
            self.assertEqual(seen.flatten().tolist(), samples)  # the array holds the memory
        with self.assertRaisesRegex(ValueError, "ask for raw"):
            numpy.asarray(picture_of([1], 1, 1, 1, 8, encoding="png"))

    @unittest.skipIf(importlib.util.find_spec("numpy") or not os.path.exists("/usr/bin/python3"), "this Python has numpy, or there is no other")
    def test_numpy_of_the_systems_python(self):
        done = subprocess.run(["/usr/bin/python3", os.path.abspath(__file__), "Saved.test_numpy_sees_the_samples"], capture_output=True,
                              text=True, check=False, timeout=60 * PATIENCE)
        self.assertEqual(done.returncode, 0, done.stderr)
        if "skipped" in done.stderr:
            self.skipTest("no Python here has numpy")

    def test_without_numpy_all_else_works(self):
        program = ("import sys; sys.modules['numpy'] = None\nimport lensd\nfrom lensd.types import FrameInfo, PictureInfo\n"
                   "info = PictureInfo(encoding='raw', left_px=0, top_px=0, width_px=2, height_px=1, channels=1, bits=8, gamma=1.0)\n"
                   "picture = lensd.Picture(None, info, 0, memoryview(b'ab'))\npicture.save(sys.argv[1])\n"
                   "print(picture.samples.tolist(), len(picture._repr_png_()) > 50)\n")
        done = subprocess.run([sys.executable, "-W", "error", "-c", program, os.path.join(self.folder, "a.png")], capture_output=True,
                              text=True, check=False, timeout=60, env={**os.environ, "PYTHONPATH": PACKAGE})
        self.assertEqual((done.stdout, done.stderr), ("[[97, 98]] True\n", ""))


class Waiting:
    """The blocking library behind the face of the other, so that one test asks both."""

    def __init__(self, one):
        self.one = one

    def __getattr__(self, name):
        found = getattr(self.one, name)
        if name == "presets":
            return Waiting(found)

        async def call(*words, **named):
            return found(*words, **named)
        return call


def of_both(test):
    """The test by each library, with a lens of it as an argument."""
    def run(self):
        async def awaited():
            async with lensd.aio.Lens(self.daemon.socket, self.lens) as lens:
                await test(self, lens)

        async def blocking():
            with lensd.Lens(self.daemon.socket, self.lens) as lens:
                await test(self, Waiting(lens))
        for library in (blocking, awaited):
            with self.subTest(library=library.__name__):
                asyncio.run(library())
    return run


class Camera(unittest.TestCase):
    """A colour camera of 12 bits, before a scene that stands still."""
    lens = "a"

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-people-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.daemon = scene_daemon(cls.folder.name, COLOUR_SCENE.replace("speed_steps_per_s = 4000", "speed_steps_per_s = 40000"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    def lensctl(self, *words):
        done = self.daemon.lensctl(*words)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout

    def raw(self, method, **parameters):
        with self.daemon.client() as client:
            return client.call(LENS + method, {"lens": self.lens, **parameters})["parameters"]

    @of_both
    async def test_a_snapshot_is_saved_as_lensctl_saves_it(self, lens):
        path, other = os.path.join(self.folder.name, "a.png"), os.path.join(self.folder.name, "b.png")
        picture = await lens.snapshot()
        self.assertEqual((picture.info.encoding, picture.info.bits, picture.info.channels), ("raw", 12, 3))
        picture.save(path)
        self.lensctl("snapshot", "a", "-o", other)
        with open(path, "rb") as mine, open(other, "rb") as theirs:
            self.assertEqual(read_png(mine.read()), read_png(theirs.read()))
        (await lens.snapshot(encoding="png")).save(path)
        with open(path, "rb") as mine, open(other, "rb") as theirs:
            self.assertEqual(read_png(mine.read()), read_png(theirs.read()))
        for encoding, channels in (("gray8", 1), ("rgb8", 3)):
            picture = await lens.snapshot(encoding=encoding)
            picture.save(path)
            with open(path, "rb") as file:
                self.assertEqual(read_png(file.read()), (64, 48, channels, 8, list(picture.data)))
        picture = await lens.snapshot(encoding="jpeg")
        self.assertEqual(picture._repr_jpeg_()[:2], b"\xff\xd8")

    @of_both
    async def test_exposure(self, lens):
        drawn = random.Random(13)
        for _ in range(10):
            wanted_us = drawn.randint(500, 4000)
            set_by = drawn.choice([{"duration": f"{wanted_us}us"}, {"exposure_ms": wanted_us / 1000}])
            told = await lens.exposure(**set_by)
            now = self.raw("GetExposure")["exposure"]
            self.assertAlmostEqual(told.exposure_ms, wanted_us / 1000)
            self.assertEqual((await lens.exposure()).exposure_ms, now["exposureMs"])
            self.assertEqual(told.exposure_ms, now["exposureMs"])
        with self.assertRaises(lensd.OutOfRange):
            await lens.exposure("9e8s")
        await lens.exposure("1ms")

    @of_both
    async def test_a_stack_is_what_lensctl_takes_and_the_lens_goes_back(self, lens):
        drawn = random.Random(14)
        for _ in range(10 if LONG else 1):
            near = drawn.uniform(0.8, 1.0)
            where, limit = f"{near:.2f}m..{near + 0.6:.2f}m", f"{drawn.randint(2, 4)}um"
            await lens.aperture(position=drawn.randint(5, 40))
            await lens.focus(position=drawn.randint(500, 7000))
            before = {axis["axis"]: axis["position"] for axis in self.raw("Status")["lenses"][0]["axes"]}
            stack = await lens.stack([lensd.sharp(where, limit)])
            after = {axis["axis"]: axis["position"] for axis in self.raw("Status")["lenses"][0]["axes"]}
            self.assertEqual((stack.returned, after), (True, before))
            shots = os.path.join(self.folder.name, "shots")
            told = json.loads(self.lensctl("stack", "a", "--sharp", f"{where}:{limit}", "-o", shots, "--json"))
            self.assertGreater(len(stack.pictures), 1)
            self.assertEqual(len(stack.pictures), len(told["shots"]))
            for picture, shot, theirs in zip(stack.pictures, stack.plan.shots, told["shots"]):
                self.assertAlmostEqual(shot.focus_position, theirs["focusPosition"], delta=2)  # the state of the lens has a part in it
                stood = {axis.axis: axis for axis in picture.frame.axes}["focus"]
                self.assertLessEqual(abs(stood.position - shot.focus_position), stood.position_bound)
                self.assertEqual((picture.frame.moving, picture.info.encoding, picture.info.bits), (False, "raw", 12))

    @of_both
    async def test_a_stack_that_keeps_the_brightness_gives_the_exposure_back(self, lens):
        await lens.exposure("1ms")
        await lens.aperture(1.4)
        stack = await lens.stack([lensd.sharp("0.9m..1.5m", "8um")], keep_brightness=True)
        self.assertGreater(len(stack.pictures), 0)
        for picture in stack.pictures:  # longer, as far as the frame time goes, which at 200 Hz is 5 ms
            self.assertGreater(picture.frame.exposure_ms, 2)
        self.assertEqual((stack.returned, self.raw("GetExposure")["exposure"]["exposureMs"]), (True, 1))

    @of_both
    async def test_a_stack_that_cannot_be_takes_nothing(self, lens):
        before = self.raw("Status")["lenses"][0]["axes"]
        stack = await lens.stack([lensd.sharp("0.1m..0.2m", "5um")])
        self.assertEqual((stack.plan.feasible, stack.pictures, stack.back), (False, [], []))
        with self.assertRaisesRegex(ValueError, "move the zoom first"):
            await lens.stack(lensd.PlanRequest(limits=[lensd.sharp("1m", "5um")], focal_length_mm=25.0))
        self.assertEqual(self.raw("Status")["lenses"][0]["axes"][0]["position"], before[0]["position"])


class States(unittest.TestCase):
    """Presets, undo and calibration, by the lens with fast motors."""
    lens = "b"

    @classmethod
    def setUpClass(cls):
        cls.state = tempfile.TemporaryDirectory(prefix="lensd-people-")
        cls.addClassCleanup(cls.state.cleanup)
        cls.daemon = Daemon(("a", "b"), quick=True, arguments=("--state", cls.state.name))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    raw, lensctl = Camera.raw, Camera.lensctl

    def places(self):
        return {axis["axis"]: axis["position"] for axis in self.raw("Status")["lenses"][0]["axes"]}

    @of_both
    async def test_presets(self, lens):
        drawn, saved = random.Random(15), {}
        for _ in range(100 if LONG else 10):
            await lens.focus(position=drawn.randint(0, 4000))
            label = drawn.choice(["wall", "window", "bench 2", "d"])
            what = drawn.choice(["save", "recall", "remove"])
            if what == "save":
                reply = await lens.presets.save(label)
                self.assertEqual((reply.preset.label, reply.note), (label, None))
                saved[label] = self.places()
            elif label not in saved:
                with self.assertRaises(lensd.PresetNotFound):
                    await getattr(lens.presets, what)(label)
            elif what == "recall":
                recall = await lens.presets.recall(label)
                self.assertTrue(recall.reached)
                self.assertAlmostEqual(self.places()["focus"], saved[label]["focus"], delta=1)
            else:
                await lens.presets.remove(label)
                del saved[label]
            self.assertEqual([preset.label for preset in await lens.presets.list()], sorted(saved))
            self.assertEqual([preset["label"] for preset in self.raw("PresetList")["presets"]], sorted(saved))
        for label in saved:
            await lens.presets.remove(label)

    @of_both
    async def test_undo(self, lens):
        drawn = random.Random(16)
        for _ in range(20 if LONG else 2):
            await lens.focus(position=drawn.randint(0, 1500))
            first = self.places()["focus"]
            await lens.focus(position=drawn.randint(2000, 4000))
            second = self.places()["focus"]
            for expected in (first, second):
                self.assertTrue((await lens.undo()).undone)
                self.assertAlmostEqual(self.places()["focus"], expected, delta=1)

    @of_both
    async def test_calibrate(self, lens):
        drawn = random.Random(17)
        for _ in range(3):
            steps = sorted(drawn.sample(range(0, 4000, 100), 3))
            points = dict(zip(steps, ("inf", f"{drawn.uniform(2, 3):.2f} m", drawn.choice(["0.8m", "1.1 D", "ext:0.8mm", "33in"]))))
            self.lensctl("calibrate", "a", *(f"--point={at}={where}" for at, where in points.items()), "--error", "20um", "--json")
            reply = await lens.calibrate(points, error_um=20, made="by hand")
            self.assertEqual(reply.calibration.grade, "calibrated")
            mine, theirs = self.raw("GetCalibration")["calibration"], self.raw("GetCalibration", lens="a")["calibration"]
            self.assertEqual(*(re.sub(r"^made = .*$", "", each["toml"], flags=re.M) for each in (mine, theirs)))
            by_points = [lensd.CalibrationPoint(position=float(at), vergence_d=0.0 if i == 0 else None, distance_m=i and 3.0 / i or None)
                         for i, at in enumerate(steps)]
            await lens.calibrate(by_points, error_um=20)
            self.assertNotEqual(self.raw("GetCalibration")["calibration"]["toml"], mine["toml"])
            await lens.calibrate(toml=mine["toml"])
            self.assertEqual(self.raw("GetCalibration")["calibration"]["toml"], mine["toml"])
            self.raw("MeasureBacklash", axis="focus", size=3.0)
            reply = await lens.calibrate(remove=True)
            self.assertEqual((reply.calibration.grade, len(reply.removed), len(reply.kept)), ("uncalibrated", 1, 1))
            reply = await lens.calibrate(remove=True, keep_measured=False)
            self.assertEqual((len(reply.removed), reply.kept or []), (1, []))
        for wrong in ({}, {"toml": "", "remove": True}):
            with self.assertRaisesRegex(TypeError, "takes one of"):
                await lens.calibrate(**wrong)
        with self.assertRaisesRegex(ValueError, "write 2.3m"):
            await lens.calibrate({812: "2,3m"})


class Missing(unittest.TestCase):
    """A motor that loses steps does not reach the place of a shot."""
    lens = "a"

    def test_a_stack_ends_where_an_axis_misses(self):
        folder = tempfile.TemporaryDirectory(prefix="lensd-missing-")
        self.addCleanup(folder.cleanup)
        daemon = scene_daemon(folder.name, COLOUR_SCENE)
        try:
            with daemon.client() as client:
                client.call("io.lensd.Simulator.Inject", {"lens": "a", "axis": "focus", "kind": "stall"})
            with lensd.Lens(daemon.socket, "a") as lens, self.assertRaises(lensd.NotReached) as caught:
                lens.stack([lensd.sharp("0.9m..1.5m", "10um")])
            self.assertEqual((caught.exception.axis, caught.exception.exit_status, caught.exception.move.reached), ("focus", 69, False))
        finally:
            with contextlib.suppress(AssertionError):
                daemon.stop()


if __name__ == "__main__":
    assert array.array("H").itemsize == 2 and os.path.exists(BIN)
    unittest.main()
