"""Pictures as they come: View, through the socket and beside it."""
import array
import fcntl
import mmap
import os
import random
import select
import signal
import struct
import sys
import tempfile
import time
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, PATIENCE, DaemonTest  # noqa: E402
from viewer import COLOUR_SCENE, FileClient, next_picture, scene_daemon, snapshot, view, words  # noqa: E402


class ViewTest(DaemonTest):
    """Two plain lenses: 'a' is moved, both are seen."""

    def client(self):
        return FileClient(self.daemon.socket)

    def test_frames_come_in_order_and_tell_the_lens_and_their_light(self):
        with self.client() as client:
            view(client, lens="b", encoding="raw")
            last, started = -1, time.monotonic_ns()
            for _ in range(10):
                reply, data = next_picture(client)
                frame, picture = reply["frame"], reply["picture"]
                self.assertGreater(frame["sequence"], last)
                last = frame["sequence"]
                self.assertEqual([a["axis"] for a in frame["axes"]], ["focus", "iris"])
                self.assertFalse(frame["moving"])
                self.assertEqual(picture["channels"], 1)
                samples = data if picture["bits"] == 8 else words(data)
                self.assertEqual(len(samples), frame["widthPx"] * frame["heightPx"])
                counted = [0] * 64
                for sample in samples:
                    counted[sample * 64 >> frame["bits"]] += 1
                self.assertEqual(picture["histogram"], counted)
                self.assertGreater(picture["sharpness"], 0)
                self.assertGreater(frame["exposureStartNs"], started - 10**9)

    def test_the_rate_is_at_most_what_was_asked_for(self):
        with self.client() as client:
            view(client, lens="b", encoding="jpeg", maxRateHz=8)
            times = [next_picture(client)[0]["frame"]["exposureStartNs"] for _ in range(6)]
        for before, after in zip(times, times[1:]):
            self.assertGreaterEqual(after - before, 0.87e9 / 8)

    def test_pictures_come_while_the_lens_moves_and_the_move_is_not_slower(self):
        def move(client, target):
            started = time.monotonic()
            reply = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": target}})
            self.assertTrue(reply["parameters"]["move"]["reached"], reply)
            return time.monotonic() - started

        with self.daemon.client() as mover, self.client() as client, self.client() as other, self.client() as third:
            alone = min(move(mover, 2000 + 300 * (i % 2)) for i in range(4))
            for one in (client, other, third):
                view(one, lens="a", encoding="jpeg", scaleTo={"widthPx": 32, "heightPx": 32})
                next_picture(one)
            seen = min(move(mover, 2000 + 300 * (i % 2)) for i in range(4))
            self.assertLess(seen, alone * 1.1 + 0.05 * PATIENCE)
            # The lens goes to and fro until five places of it have been seen, however slowly pictures come.
            places, moves = set(), 0
            answered = True
            deadline = time.monotonic() + 20 * PATIENCE
            while len(places) < 5:
                self.assertLess(time.monotonic(), deadline, f"places seen in {moves} moves: {sorted(places)}")
                if answered:
                    mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 2000 + 300 * (moves % 2)}})
                    moves += 1
                frame = next_picture(client)[0]["frame"]
                if frame["moving"]:
                    places.add(frame["axes"][0]["position"])
                answered = bool(select.select([mover.socket], [], [], 0)[0])
                if answered:
                    self.assertTrue(mover.receive()["parameters"]["move"]["reached"])
            if not answered:
                mover.receive()

    def test_without_in_motion_only_pictures_of_a_lens_at_rest_come(self):
        with self.daemon.client() as mover, self.client() as client:
            view(client, lens="a", encoding="raw", inMotion=False)
            next_picture(client)
            for target in (1500, 1800, 1500):
                mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": target}})
                self.assertFalse(next_picture(client)[0]["frame"]["moving"])
                mover.receive()
                self.assertFalse(next_picture(client)[0]["frame"]["moving"])

    def test_a_region_made_smaller(self):
        region = {"x": 0.25, "y": 0.5, "w": 0.5, "h": 0.25}
        with self.client() as client:
            whole, samples = snapshot(client, lens="b", encoding="raw")
            width, height = whole["frame"]["widthPx"], whole["frame"]["heightPx"]
            about, part = snapshot(client, lens="b", encoding="raw", region=region)
            picture = about["picture"]
            self.assertEqual((picture["leftPx"], picture["topPx"]), (width // 4, height // 2))
            self.assertEqual((picture["widthPx"], picture["heightPx"]), (width // 2, height // 4))
            self.assertEqual(len(part), len(samples) // 8)
            about, small = snapshot(client, lens="b", encoding="gray8", region=region,
                                    scaleTo={"widthPx": width // 4, "heightPx": 10**6})
            self.assertEqual((about["picture"]["widthPx"], about["picture"]["heightPx"]), (width // 4, height // 8))
            self.assertEqual(len(small), width // 4 * (height // 8))
            about, _ = snapshot(client, lens="b", encoding="raw", scaleTo={"widthPx": 10**5, "heightPx": 10**5})
            self.assertEqual(about["picture"]["widthPx"], width)

    def test_wrong_wishes_are_refused(self):
        bad = ({"region": {"x": 0.5, "y": 0, "w": 0.6, "h": 1}}, {"region": {"x": 0, "y": 0, "w": 0, "h": 1}},
               {"scaleTo": {"widthPx": 0, "heightPx": 5}})
        of_views = ({"maxRateHz": 0}, {"maxRateHz": -3}, {"fd": True, "keepFrames": True})
        with self.client() as client:
            for method, wishes in (("Snapshot", bad), ("View", (*bad, *of_views))):
                for wish in wishes:
                    client.send(LENS + method, {"lens": "b", **wish}, more=True)
                    self.assertEqual(client.receive()["error"], LENS + "InvalidRequest", wish)
            client.send(LENS + "View", {"lens": "b", "encoding": "gif"}, more=True)
            self.assertEqual(client.receive()["error"], "org.varlink.service.InvalidParameter")
            client.send(LENS + "View", {"lens": "b"})
            self.assertEqual(client.receive()["error"], "org.varlink.service.ExpectedMore")
            for method in ("Snapshot", "View"):
                client.send(LENS + method, {"lens": "b", "encoding": "rgb8"}, more=True)
                self.assertEqual(client.receive()["error"], LENS + "Unsupported")

    def test_three_files_are_out_at_most_and_closing_gives_back(self):
        with self.client() as client:
            view(client, lens="b", encoding="raw", fd=True)
            held = [client.receive() for _ in range(3)]
            self.assertEqual(len(client.files), 3)
            client.socket.settimeout(0.5)
            with self.assertRaises(TimeoutError):
                client.receive()
            client.socket.settimeout(30)
            # Mapped is not given back, though the file is closed.
            mapped = mmap.mmap(client.files[0], 0, prot=mmap.PROT_READ)
            os.close(client.files.pop(0))
            client.socket.settimeout(0.5)
            with self.assertRaises(TimeoutError):
                client.receive()
            client.socket.settimeout(30)
            mapped.close()
            reply = client.receive()["parameters"]
            self.assertGreater(reply["dropped"], held[-1]["parameters"]["dropped"])
            self.assertGreater(reply["frame"]["sequence"], held[-1]["parameters"]["frame"]["sequence"] + 1)

    def test_a_file_cannot_be_written_to(self):
        with self.client() as client:
            view(client, lens="b", encoding="raw", fd=True)
            reply = client.receive()["parameters"]
            file = client.files[0]
            self.assertEqual((reply["fd"], os.fstat(file).st_size), (0, reply["size"]))
            before = os.pread(file, reply["size"], 0)
            seals = fcntl.fcntl(file, fcntl.F_GET_SEALS)
            wanted = fcntl.F_SEAL_WRITE | fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL
            self.assertEqual(seals & wanted, wanted)
            again = os.open(f"/proc/self/fd/{file}", os.O_RDWR)
            try:
                for attempt in (lambda: os.write(file, b"x"), lambda: os.pwrite(again, b"x", 0),
                                lambda: os.ftruncate(again, 0), lambda: os.ftruncate(again, reply["size"] * 2),
                                lambda: mmap.mmap(again, reply["size"])):
                    with self.assertRaises(OSError):
                        attempt()
            finally:
                os.close(again)
            self.assertEqual(os.pread(file, reply["size"] + 1, 0), before)

    def test_a_viewer_that_goes_ends_its_view_and_a_late_one_misses_frames(self):
        for _ in range(40):  # more than are open at a time
            with self.client() as client:
                view(client, lens="b", encoding="jpeg")
                next_picture(client)
        with self.client() as client:
            view(client, lens="b", encoding="raw")
            first, _ = next_picture(client)
            time.sleep(1.5)  # what is made meanwhile fills the socket, then the two places, then is dropped
            dropped = 0
            deadline = time.monotonic() + 30 * PATIENCE
            while dropped == 0 and time.monotonic() < deadline:
                reply, _ = next_picture(client)
                dropped = reply["dropped"]
            self.assertGreater(dropped, first["dropped"])

    def test_frames_that_are_kept_wait_for_a_client_that_does_not_read(self):
        with self.client() as client:
            view(client, lens="b", encoding="raw", keepFrames=True)
            times = [next_picture(client)[0]["frame"]["exposureStartNs"]]
            time.sleep(1.5)  # far more comes than the socket and the two places take
            for _ in range(60):
                reply, _ = next_picture(client)
                self.assertEqual(reply["dropped"], 0)
                times.append(reply["frame"]["exposureStartNs"])
        self.assertEqual(times, sorted(set(times)))

    def test_a_machine_that_has_no_time_for_lensd_ends_no_view(self):
        with self.client() as client:
            view(client, lens="b", encoding="jpeg")
            before = next_picture(client)[0]["frame"]["sequence"]
            os.kill(self.daemon.process.pid, signal.SIGSTOP)
            time.sleep(6)  # longer than a camera has for a frame
            os.kill(self.daemon.process.pid, signal.SIGCONT)
            deadline = time.monotonic() + 20 * PATIENCE
            began = time.monotonic_ns()
            while next_picture(client)[0]["frame"]["exposureStartNs"] < began:
                self.assertLess(time.monotonic(), deadline)
            self.assertGreater(next_picture(client)[0]["frame"]["sequence"], before)

    def test_sixteen_views_and_no_more(self):
        clients = [self.client() for _ in range(17)]
        try:
            for client in clients[:16]:
                view(client, lens="b", encoding="jpeg", maxRateHz=5)
                self.assertGreater(len(next_picture(client)[1]), 0)
            view(clients[16], lens="b")
            self.assertEqual(clients[16].receive()["error"], LENS + "Busy")
        finally:
            for client in clients:
                client.__exit__()


class AutofocusTest(DaemonTest):
    quick = True

    def test_autofocus_with_a_viewer_finds_the_same_and_is_seen(self):
        with self.daemon.client() as focuser, FileClient(self.daemon.socket) as client:
            alone = focuser.call(LENS + "Autofocus", {"lens": "a"})["parameters"]["autofocus"]
            self.assertTrue(alone["focused"], alone)
            view(client, lens="a", encoding="jpeg")
            next_picture(client)
            # A viewer that slowed searches down would slow each of them; a busy machine slows some.
            longest = alone["elapsedMs"] * 1.5 + 200 * PATIENCE
            for _ in range(8):
                seen = focuser.call(LENS + "Autofocus", {"lens": "a"})["parameters"]["autofocus"]
                self.assertTrue(seen["focused"], seen)
                frames, frames_alone = (len({sample["frame"] for sample in run["samples"]}) for run in (seen, alone))
                self.assertLessEqual(frames, frames_alone + 3)
                if seen["elapsedMs"] < longest:
                    break
            self.assertLess(seen["elapsedMs"], longest)


class GoneTest(unittest.TestCase):
    """A lens that goes away, by a fault of its scene."""

    def test_a_lens_that_goes_ends_the_view_with_the_reason(self):
        fault = '[[fault]]\nkind = "disconnect"\nat_ms = 4000\n'
        with tempfile.TemporaryDirectory(prefix="lensd-view-") as folder:
            daemon = scene_daemon(folder, COLOUR_SCENE.replace("colour = true", "colour = false") + fault)
            try:
                with FileClient(daemon.socket) as client:
                    view(client, encoding="raw", fd=True)
                    pictures, message = 0, client.receive()
                    while message is not None and "error" not in message:
                        for file in client.files:
                            os.close(file)
                        client.files.clear()
                        pictures += 1
                        message = client.receive()
                self.assertGreater(pictures, 3)
                self.assertEqual(message["error"], LENS + "Disconnected", message)
                self.assertIn("disconnected", message["parameters"]["message"])
            finally:
                daemon.stop()


class SpeedTest(unittest.TestCase):
    """A replay camera of 1920 x 1080 at 16 bits, played faster than anyone asks for."""
    WIDTH, HEIGHT, RATE_HZ = 1920, 1080, 75
    SCENE = """version = 1
[camera]
width = {width}
height = {height}
bits = 16
frame_rate_hz = {rate}
exposure_ms = 1
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
[[surface]]
kind = "wall"
distance_m = 1.2
constant = 0.5
"""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-view-")
        scene = cls.SCENE.format(width=cls.WIDTH, height=cls.HEIGHT, rate=cls.RATE_HZ)
        cls.pictures = []
        for number in range(3):
            picture = random.Random(number).randbytes(2 * cls.WIDTH * cls.HEIGHT)
            cls.pictures.append(picture)
            scene += f'[[frame]]\nfile = "{number}.png"\n'
            with open(os.path.join(cls.folder.name, f"{number}.png"), "wb") as file:
                file.write(cls.png(picture))
        cls.daemon = scene_daemon(cls.folder.name, scene)

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()
        cls.folder.cleanup()

    @classmethod
    def png(cls, picture):
        """A 16-bit grey PNG of samples with the lower byte first."""
        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

        samples = array.array("H", picture)
        samples.byteswap()
        step = cls.WIDTH
        rows = b"".join(b"\0" + samples[y * step:(y + 1) * step].tobytes() for y in range(cls.HEIGHT))
        header = struct.pack(">IIBBBBB", cls.WIDTH, cls.HEIGHT, 16, 0, 0, 0, 0)
        return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 1)) +
                chunk(b"IEND", b""))

    def processor_seconds(self):
        with open(f"/proc/{self.daemon.process.pid}/stat", encoding="ascii") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def measure(self, seconds, **parameters):
        """Pictures a second that a client sees whole, and the daemon's processors meanwhile."""
        with FileClient(self.daemon.socket) as client:
            view(client, **parameters)
            next_picture(client)
            used, began, count = self.processor_seconds(), time.monotonic(), 0
            while time.monotonic() - began < seconds:
                reply, data = next_picture(client)
                count += 1
                if parameters.get("encoding") == "raw" and count % 16 == 1:
                    self.assertEqual(data, self.pictures[reply["frame"]["sequence"] % 3])
            took = time.monotonic() - began
            rate, cores = count / took, (self.processor_seconds() - used) / took
        print(f"\n{parameters}: {rate:.1f} frames/s, lensd {cores:.2f} of a core", flush=True)
        return rate, cores

    def test_sixty_frames_a_second_on_one_core(self):
        part = 0.3 if os.environ.get("LENSD_TEST_LEVEL") == "fast" else 1  # of the time, where only faults are looked for
        rate, cores = self.measure(5 * part, encoding="raw", fd=True)
        self.measure(3 * part, encoding="jpeg")
        self.measure(3 * part, encoding="raw")
        self.measure(4 * part, encoding="png")
        # The promise is judged where nothing else runs; elsewhere it is printed.
        judged = os.environ.get("LENSD_TEST_LEVEL") == "long" and PATIENCE <= 3
        self.assertGreater(rate, 60 if judged else 60 / (4 * PATIENCE))
        if judged:
            self.assertLess(cores, 1.0)

    def test_stops_do_not_wait_for_viewers(self):
        with FileClient(self.daemon.socket) as one, FileClient(self.daemon.socket) as other, \
                self.daemon.client() as client:
            for viewer in (one, other):
                view(viewer, encoding="png")
                next_picture(viewer)
            took = []
            for _ in range(100):
                began = time.monotonic()
                self.assertEqual(client.call(LENS + "Stop"), {"parameters": {}})
                took.append(time.monotonic() - began)
                time.sleep(0.01)
        took.sort()
        print(f"\nstops beside two viewers of PNG: p50 {took[50] * 1e3:.1f} ms, p99 {took[98] * 1e3:.1f} ms", flush=True)
        self.assertLess(took[50], 0.01 * PATIENCE)


if __name__ == "__main__":
    unittest.main()
