"""What viewers cost: 1920x1080 at 8 bits from a replay camera of prepared frames, 30 pictures a second. CI prints, --long judges."""
import contextlib
import os
import struct
import threading
import time
import unittest
import zlib

from web_harness import HERE, Stream, WebTest, temporary_folder

WIDTH, HEIGHT, FRAMES = 1920, 1080, 6
SCENE = """version = 1
[camera]
width = {width}
height = {height}
bits = 8
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
JUDGED = os.environ.get("LENSD_TEST_LEVEL") == "long"


def picture(number, width, height):
    """An 8-bit grey PNG with stripes, blocks and a slope: about as much for JPEG to do as a photograph."""
    tile = bytes((x * 3 + (x // 16 % 2) * 70 + (x * x // 97) % 23 + 20 * number) & 255 for x in range(width + 64))
    rows = b"".join(b"\0" + tile[(y // 8 * 5) % 64:(y // 8 * 5) % 64 + width] for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def replay(folder, width, height, rate):
    """Configuration of a lens whose camera plays prepared frames."""
    scene = os.path.join(folder, "scene.toml")
    with open(scene, "w", encoding="utf-8") as file:
        file.write(SCENE.format(width=width, height=height, rate=rate) +
                   "".join(f'[[frame]]\nfile = "{number}.png"\n' for number in range(FRAMES)))
    for number in range(FRAMES):
        with open(os.path.join(folder, f"{number}.png"), "wb") as file:
            file.write(picture(number, width, height))
    return f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'


def processor_seconds(process):
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class SpeedTest(WebTest):
    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.config = replay(cls.folder.name, WIDTH, HEIGHT, 30)
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def measure(self, viewers, seconds=4):
        """Pictures a second of the slowest viewer, processors of lensd and lens-web, milliseconds of the slowest of five stops."""
        counts, ended = [0] * viewers, threading.Event()

        def look(number, stream):
            with contextlib.suppress(EOFError, OSError, ValueError):
                while not ended.is_set():
                    counts[number] += stream.reader.chunk().count(b"Content-Length:")
        streams = [Stream(self.web, "/live.mjpg?lens=a&rate=30") for _ in range(viewers)]
        threads = [threading.Thread(target=look, args=each) for each in enumerate(streams)]
        for thread in threads:
            thread.start()
        self.wait_for(lambda: min(counts) > 0)
        before, began, first = [processor_seconds(p) for p in (self.daemon.process, self.web.process)], time.monotonic(), list(counts)
        time.sleep(seconds)
        took = time.monotonic() - began
        cores = [(processor_seconds(p) - b) / took for p, b in zip((self.daemon.process, self.web.process), before)]
        rate = min(now - then for now, then in zip(counts, first)) / took
        stops = []
        for _ in range(5):
            asked = time.monotonic()
            self.web.call("Stop", {"lens": "a"})
            stops.append(1000 * (time.monotonic() - asked))
        ended.set()
        for thread in threads:
            thread.join()
        for stream in streams:
            stream.connection.close()
        print(f"{viewers} viewers of {WIDTH}x{HEIGHT}: {rate:.1f} pictures/s each, lensd {cores[0]:.2f} and lens-web {cores[1]:.2f} "
              f"of a core, Stop {max(stops):.1f} ms", flush=True)
        return rate, sum(cores), max(stops)

    def test_viewers_cost(self):
        for viewers, most in ((1, 0.3), (8, 0.5)):
            rate, cores, stop_ms = self.measure(viewers)
            self.assertGreater(rate, 1)
            if JUDGED:
                self.assertGreaterEqual(rate, 25)
                self.assertLessEqual(cores, most)
                self.assertLessEqual(stop_ms, 30)


class AutofocusTest(WebTest):
    """A search takes as long as without anybody who looks on: viewers are shown the frames it takes."""
    config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{os.path.join(HERE, "..", "..", "scenes", "motorcycle.toml")}"\n'

    def search_ms(self):
        """The middle one of three searches from the same place, where it is judged."""
        took = []
        for _ in range(3 if JUDGED else 1):
            self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 0}})
            status, told = self.web.call("Autofocus", {"lens": "a", "method": "sweep"})
            self.assertEqual((status, told["autofocus"]["focused"]), (200, True), told)
            took.append(told["autofocus"]["elapsedMs"])
        return sorted(took)[len(took) // 2]

    def test_viewers_do_not_delay_it(self):
        alone = self.search_ms()
        ended = threading.Event()

        def look(stream):
            with contextlib.suppress(EOFError, OSError, ValueError):
                while not ended.is_set():
                    stream.reader.chunk()
        streams = [Stream(self.web, "/live.mjpg?lens=a&rate=30&width=640") for _ in range(8)]
        threads = [threading.Thread(target=look, args=(stream,)) for stream in streams]
        for thread in threads:
            thread.start()
        watched = self.search_ms()
        ended.set()
        for thread in threads:
            thread.join()
        for stream in streams:
            stream.connection.close()
        print(f"a sweep takes {alone:.0f} ms, with 8 viewers {watched:.0f} ms", flush=True)
        if JUDGED:
            self.assertLess(watched, 1.1 * alone)


class SearchTest(WebTest):
    """What a camera shows whose frames are there anyway goes on in a search, which takes no longer for it: its frames all look
    the same, so that each search is refused, after frames whose number is chance."""

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.config = replay(cls.folder.name, 640, 480, 60)
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def search(self):
        """Seconds of some searches, and milliseconds a frame of theirs."""
        began, frames, spent_ms = time.monotonic(), 0, 0
        for _ in range(5 if JUDGED else 2):
            self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 0}})
            told = self.web.call("Autofocus", {"lens": "a", "method": "sweep"})[1]["autofocus"]
            frames, spent_ms = frames + told["frames"], spent_ms + told["elapsedMs"]
        return time.monotonic() - began, spent_ms / frames

    def test_the_picture_goes_on(self):
        alone_ms, counts, ended = self.search()[1], [0] * 8, threading.Event()

        def look(number, stream):
            with contextlib.suppress(EOFError, OSError, ValueError):
                while not ended.is_set():
                    stream.picture()
                    counts[number] += 1
        streams = [Stream(self.web, "/live.mjpg?lens=a&rate=60") for _ in counts]
        threads = [threading.Thread(target=look, args=each) for each in enumerate(streams)]
        for thread in threads:
            thread.start()
        self.wait_for(lambda: min(counts) > 0)
        first = list(counts)
        took, watched_ms = self.search()
        rate = min(now - then for now, then in zip(counts, first)) / took
        ended.set()
        for thread in threads:
            thread.join()
        for stream in streams:
            stream.connection.close()
        print(f"in a search 8 viewers of 640x480 at 60 Hz get {rate:.1f} pictures/s each; it takes {alone_ms:.0f} ms a frame alone and "
              f"{watched_ms:.0f} ms so", flush=True)
        self.assertGreater(rate, 12, "the search's own frames are 8 a second")
        if JUDGED:
            self.assertGreaterEqual(rate, 30)
            self.assertLess(watched_ms, 1.1 * alone_ms)


if __name__ == "__main__":
    unittest.main()
