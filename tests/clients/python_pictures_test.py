"""The Python library's pictures: they lie in lensd's own memory, and nothing is left behind; autofocus with frames of one's own."""
import array
import asyncio
import ctypes
import importlib.util
import os
import sys
import tempfile
import time
import unittest

from situations import PACKAGE, PATIENCE, ROOT, SCENE, Daemon

sys.path.insert(0, PACKAGE)
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon"))
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon", "pictures"))
import lensd  # noqa: E402
import view_test  # noqa: E402
from viewer import COLOUR_SCENE, scene_daemon  # noqa: E402


class PyBuffer(ctypes.Structure):
    """Where a buffer lies, by Python's own account."""
    _fields_ = [("buf", ctypes.c_void_p), ("obj", ctypes.py_object), ("len", ctypes.c_ssize_t), ("itemsize", ctypes.c_ssize_t),
                ("readonly", ctypes.c_int), ("ndim", ctypes.c_int), ("format", ctypes.c_char_p), ("shape", ctypes.c_void_p),
                ("strides", ctypes.c_void_p), ("suboffsets", ctypes.c_void_p), ("internal", ctypes.c_void_p)]


def address_of(data):
    buffer = PyBuffer()
    ctypes.pythonapi.PyObject_GetBuffer(ctypes.py_object(data), ctypes.byref(buffer), 0)
    address = buffer.buf
    ctypes.pythonapi.PyBuffer_Release(ctypes.byref(buffer))
    return address


def memfd_mappings():
    """Start, end and permissions of every mapped memfd of this process."""
    with open("/proc/self/maps", encoding="utf-8") as maps:
        lines = [line.split() for line in maps if "/memfd:" in line]
    return [(*(int(end, 16) for end in line[0].split("-")), line[1]) for line in lines]


def open_files():
    return len(os.listdir("/proc/self/fd"))


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(("a", "b"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    def setUp(self):
        self.lens = lensd.Lens(self.daemon.socket, "b")
        self.addCleanup(self.lens.close)

    def test_a_picture_of_a_view_lies_in_lensds_memory(self):
        before = open_files()
        with self.lens.view(encoding="gray8") as view:
            picture = next(view)
        at = address_of(picture.data)
        mapped = [mapping for mapping in memfd_mappings() if mapping[0] <= at and at + len(picture.data) <= mapping[1]]
        self.assertEqual([permissions for _, _, permissions in mapped], ["r--s"], memfd_mappings())
        print(f"picture at {at:#x}, in the mapping {mapped[0][0]:#x}-{mapped[0][1]:#x} of a memfd")
        self.assertTrue(picture.data.readonly)
        samples = picture.samples
        self.assertEqual(address_of(samples), at)
        self.assertEqual(samples.shape, (48, 64))
        del picture
        self.assertEqual(len(memfd_mappings()), 1)  # the samples hold it
        self.assertEqual(len(samples.tobytes()), 48 * 64)
        del samples
        self.assertEqual(memfd_mappings(), [])
        self.lens.close()
        self.assertEqual(open_files(), before)

    def test_pictures_are_those_of_a_snapshot(self):
        with self.lens.view(encoding="raw") as view, next(view) as seen:
            frozen = bytes(seen.data)
        taken = self.lens.snapshot(encoding="raw")
        self.assertEqual((taken.info.width_px, taken.info.height_px, taken.info.bits), (64, 48, 8))
        self.assertEqual(bytes(taken.data), frozen)  # a scene without noise
        with self.lens.view(encoding="raw", files=False) as view:
            inline = next(view)
        self.assertEqual(bytes(inline.data), frozen)
        self.assertEqual(bytes(self.lens.snapshot(encoding="png").data[:4]), b"\x89PNG")
        with self.assertRaises(ValueError):
            _ = self.lens.snapshot(encoding="png").samples

    def test_no_file_is_left_behind(self):
        before = open_files()
        for _ in range(20):
            with self.lens.view(encoding="raw") as view:
                next(view)
        self.assertEqual((memfd_mappings(), open_files()), ([], before))
        with self.lens.view(encoding="raw") as view:
            held = [next(view) for _ in range(3)]
            self.assertEqual(len(memfd_mappings()), 3)
            held.pop(0).close()
            self.assertGreater(next(view).frame.sequence, held[-1].frame.sequence)
        del held
        self.assertEqual(memfd_mappings(), [])

    def test_asyncio_views_without_copies_too(self):
        async def look():
            async with lensd.aio.Lens(self.daemon.socket, "b") as lens, lens.view(encoding="raw") as view:
                seen = []
                async for picture in view:
                    seen.append(any(start <= address_of(picture.data) < end for start, end, _ in memfd_mappings()))
                    if len(seen) == 5:
                        return seen
        self.assertEqual(asyncio.run(look()), [True] * 5)
        self.assertEqual(memfd_mappings(), [])

    @unittest.skipUnless(importlib.util.find_spec("numpy"), "numpy is not installed")
    def test_numpy_takes_it_without_a_copy(self):
        import numpy  # pylint: disable=import-outside-toplevel
        with self.lens.view(encoding="gray8") as view:
            picture = next(view)
        flat, square = numpy.frombuffer(picture.data, numpy.uint8), numpy.asarray(picture.samples)
        self.assertEqual({flat.__array_interface__["data"][0], square.__array_interface__["data"][0]}, {address_of(picture.data)})
        self.assertEqual(square.shape, (48, 64))
        del picture, flat
        self.assertEqual(len(memfd_mappings()), 1)
        self.assertGreater(int(square.sum()), 0)

    def test_live_view_of_large_pictures(self):
        replay = view_test.SpeedTest  # its camera plays prepared pictures of 1920 x 1080 at 16 bits, 75 a second
        replay.setUpClass()
        try:
            with lensd.Lens(replay.daemon.socket) as lens, lens.view(encoding="raw") as view:
                self.assertIn(bytes(next(view).data), replay.pictures)
                begun, seconds, count = time.monotonic(), 2.0, 0
                for picture in view:
                    self.assertEqual(picture.samples.shape, (1080, 1920))
                    count += 1
                    if time.monotonic() - begun > seconds:
                        break
                print(f"live view of 1920 x 1080 at 16 bits: {count / (time.monotonic() - begun):.1f} pictures a second")
                self.assertGreater(count, 1)
        finally:
            replay.tearDownClass()

    def test_colour_and_deep_samples(self):
        with tempfile.TemporaryDirectory() as folder:
            daemon = scene_daemon(folder, COLOUR_SCENE)
            try:
                with lensd.Lens(daemon.socket) as lens, lens.view(encoding="raw") as view:
                    picture = next(view)
                self.assertEqual((picture.info.bits, picture.samples.shape, picture.samples.itemsize), (12, (48, 64, 3), 2))
                words = array.array("H", picture.data.tobytes())
                self.assertEqual(picture.samples.tolist()[7][5], list(words[(7 * 64 + 5) * 3:][:3]))
                self.assertLess(max(words), 4096)
            finally:
                self.assertEqual(daemon.stop(), 0)


class OwnFrames(unittest.TestCase):
    """`autofocus(grab=...)`: a second client's snapshots stand for a camera of one's own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-frames-")
        with open(SCENE, encoding="utf-8") as file:
            cls.daemon = scene_daemon(cls.folder.name, file.read().replace("speed_steps_per_s = 1000", "speed_steps_per_s = 8000"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0
        cls.folder.cleanup()

    def setUp(self):
        self.lens, self.camera = lensd.Lens(self.daemon.socket), lensd.Lens(self.daemon.socket)
        self.addCleanup(self.lens.close)
        self.addCleanup(self.camera.close)

    def frame(self, _step):
        picture = self.camera.snapshot(encoding="gray8")
        return lensd.Frame(bytes(picture.data), width_px=64, height_px=48, gamma=picture.info.gamma)

    def test_frames(self):
        result = self.lens.autofocus(grab=self.frame, pixel_um=3.45, method="sweep")
        self.assertTrue(result.focused, result.reason)
        self.assertAlmostEqual(1 / result.vergence_d, 1.2, delta=0.03)
        self.assertGreater(len(result.samples), 5)

    def test_scores_and_a_coroutine(self):
        async def search():
            async with lensd.aio.Lens(self.daemon.socket) as lens, lensd.aio.Lens(self.daemon.socket) as camera:
                async def grab(_step):
                    begun = time.monotonic_ns()
                    async with camera.view(encoding="gray8") as view:
                        async for picture in view:
                            if picture.frame.exposure_start_ns > begun:
                                return lensd.Score(max(picture.info.sharpness, 1e-12))
                return await lens.autofocus(grab=grab, scores=True)
        result = asyncio.run(search())
        self.assertTrue(result.focused, result.reason)
        self.assertAlmostEqual(1 / result.vergence_d, 1.2, delta=0.03)

    def test_what_grab_raises_ends_the_search(self):
        steps = []

        def grab(step):
            steps.append(step)
            if len(steps) == 3:
                raise KeyError("no film")
            return self.frame(step)
        with self.assertRaisesRegex(KeyError, "no film"):
            self.lens.autofocus(grab=grab, method="sweep", pixel_um=3.45)
        self.assertEqual(self.lens.wait_idle(20 * PATIENCE).activity, "idle")
        self.assertEqual([step.frame for step in steps], [1, 2, 3])

    def test_a_frame_of_no_size_and_one_exposed_too_early(self):
        with self.assertRaisesRegex(ValueError, "two dimensions"):
            self.lens.autofocus(grab=lambda step: lensd.Frame(b"12"))
        with self.assertRaises(lensd.InvalidRequest):
            self.lens.autofocus(grab=lambda step: lensd.Frame(bytes(64 * 48), 64, 48, exposure_start_ns=1, exposure_end_ns=2))
        with self.assertRaisesRegex(ValueError, "give grab"):
            self.lens.autofocus(scores=True)

    def test_the_lens_own_camera_tells_its_progress(self):
        seen = []
        result = self.lens.autofocus(progress=lambda progress: seen.append(progress.frames), method="sweep")
        self.assertTrue(result.focused, result.reason)
        self.assertEqual(seen, sorted(seen))
        self.assertGreater(len(seen), 3)


if __name__ == "__main__":
    assert os.path.exists(SCENE)
    unittest.main()
