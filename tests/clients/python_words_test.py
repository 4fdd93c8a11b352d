"""What people type: drawn texts are given to lensctl and to the Python library, and both ask lensd for the same, or refuse with
the same advice. A socket between them and a lensd keeps what each of them asks for."""
import asyncio
import json
import math
import os
import random
import socket
import subprocess
import sys
import threading
import unittest

from situations import BIN, LENS, PACKAGE, PATIENCE, Daemon

sys.path.insert(0, PACKAGE)
import lensd  # noqa: E402

COUNT = 4000 if os.environ.get("LENSD_TEST_LEVEL") == "long" else 60  # of texts for each call
KEPT = {LENS + name for name in ("Move", "Plan", "SetExposure")}


class Between(threading.Thread):
    """Passes calls on to a lensd and its answers back, but for those of KEPT: it keeps and refuses them."""

    def __init__(self, folder, beyond):
        super().__init__(daemon=True)
        self.path, self.beyond, self.kept = os.path.join(folder, "between"), beyond, []
        self.listening = socket.socket(socket.AF_UNIX)
        self.listening.bind(self.path)
        self.listening.listen()

    def run(self):
        while True:
            try:
                client, _ = self.listening.accept()
            except OSError:
                return
            threading.Thread(target=self.serve, args=(client,), daemon=True).start()

    def serve(self, client):
        data = b""
        with client, self.beyond() as lens_daemon:
            while part := client.recv(65536):
                *calls, data = (data + part).split(b"\0")
                for call in calls:
                    asked = json.loads(call)
                    if asked["method"] in KEPT:
                        self.kept.append(asked["parameters"])
                        answer = {"error": LENS + "Internal", "parameters": {"message": "kept"}}
                    else:
                        answer = lens_daemon.call(asked["method"], asked.get("parameters"))
                    client.sendall(json.dumps(answer).encode() + b"\0")


def like(first, second):
    """Equal, numbers to within a rounding."""
    if isinstance(first, float) and isinstance(second, float):
        return math.isclose(first, second, rel_tol=1e-14, abs_tol=1e-300)
    if isinstance(first, dict) and isinstance(second, dict):
        return first.keys() == second.keys() and all(like(first[key], second[key]) for key in first)
    if isinstance(first, list) and isinstance(second, list):
        return len(first) == len(second) and all(map(like, first, second))
    return first == second


def only_what_was_typed(asked):
    """Without what lensctl asks for besides: the lens, that focus follows a zoom, and which end of a range is nearer."""
    if "request" in asked:
        limit, = asked["request"]["limits"]
        ends = [{key: float(value) for key, value in end.items()} for end in (limit["depths"][0]["oneEnd"], limit["depths"][0]["otherEnd"])]
        limits = {key: float(limit[key]) for key in ("limitUm", "limitPx") if limit.get(key) is not None}
        return {**limits, "kind": limit["kind"], "depths": sorted(ends, key=lambda end: sorted(end.items()))}
    kept = {key: value for key, value in asked.items() if key not in ("lens", "keepFocus", "lease")}
    return {key: {name: float(number) for name, number in value.items()} if isinstance(value, dict) else value for key, value in kept.items()}


class Texts:
    """What somebody might type, mostly quantities and near misses of quantities."""
    numbers = ["2", "2.5", ".5", "2.", "1e3", "-2", "+3", "2,3", "0,75", "0", "-0", "007", "1e400", "1e-400", "1e-320", "5e-324",
               "12345678901234567890", "0.1", "3.3e-2", "1,000", "1.2.3", "\u22122", "9" * 201, "1e1001", "0.8382", "33"]
    lengths = ["nm", "um", "\u00b5m", "\u03bcm", "mm", "cm", "m", "km", "in", "ft", "'", '"', "M", "Mm", "FT", "meter"]
    units = lengths + ["D", "d", "px", "PX", "ns", "us", "ms", "s", "S", "min", "h", "C", "%", "", ""]
    spaces = ["", "", "", " ", "\u00a0", "\u2009", "\t", "  "]
    whole = ["inf", "Inf", "infinity", "INFINITY", "\u221e", "past infinity", "", "@", "@1200", "@ 5", "@-3", "@x", "near:10", "far:3.5",
             "near:x", "ext:2.6mm", "ext:5'7\"", "ext:2", "ext:-1mm", "+50", "-7", "+ 5", "+100mm", "-1m", "-0.1D", "+2D", "bike", "2 m bike",
             "f/2.8", "F4", "f2.8", "1:2.8", "1:f/2.8", "f/", "f/0", "2,8", "1/250s", "1/0s", "2/3s", "1/-3s", "1/250", "1/2ms", "6dB"]

    def __init__(self, seed, likely):
        self.random, self.likely = random.Random(seed), likely  # likely: units that fit the call

    def quantity(self):
        choose = self.random.choice
        kind = self.random.random()
        number = choose(self.numbers) if kind < 0.4 else f"{self.random.uniform(-1, 20):.{self.random.randint(0, 4)}f}"
        if kind > 0.9:
            return number + choose(["ft", "'", " ft "]) + choose(self.spaces) + choose(self.numbers) + choose(["in", '"', " in", "\u2033", "", "cm"])
        return number + choose(self.spaces) + choose(self.units if self.random.random() < 0.5 else self.likely)

    def text(self):
        choose = self.random.choice
        kind = self.random.random()
        if kind < 0.2:
            text = choose(self.whole)
        elif kind < 0.55:
            text = self.quantity()
        elif kind < 0.75:
            text = choose([self.quantity(), choose(self.whole)]) + choose(["..", "...", "-", " to ", "\u2013", "\u2026"]) + choose([self.quantity(), "inf"])
        elif kind < 0.85:
            text = choose([self.quantity(), "past infinity"]) + " (" + choose([self.quantity(), "infinity", "past infinity"]) + ")"
        else:
            text = choose(["@", "+", "-", "near:", "far:", "ext:", "f/", "1:", "1/"]) + self.quantity()
        if self.random.random() < 0.05:
            text += choose([" from the sensor", " from the lens centre", " from the moon"])
        if text and self.random.random() < 0.1:  # a slip of the finger
            at = self.random.randrange(len(text))
            text = text[:at] + choose(["", ",", ".", " ", "m", "e5", "'"]) + text[at + 1:]
        return text


class Words(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(("cam",))
        cls.between = Between(cls.daemon.folder.name, cls.daemon.client)
        cls.between.start()
        cls.lens = lensd.Lens(cls.between.path, "cam")

    @classmethod
    def tearDownClass(cls):
        cls.lens.close()
        cls.between.listening.close()
        assert cls.daemon.stop() == 0

    def asked(self):
        kept, self.between.kept[:] = list(self.between.kept), []
        return [only_what_was_typed(each) for each in kept]

    def by_lensctl(self, *words):
        """What lensd is asked for, or the advice."""
        done = subprocess.run([os.path.join(BIN, "lensctl"), "--socket", self.between.path, *words], capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)
        asked = self.asked()
        if asked:
            return asked
        self.assertEqual(done.returncode, 64, (words, done))
        return done.stderr.rpartition("': ")[2].strip()

    def by_python(self, act):
        try:
            act()
        except ValueError as error:
            self.assertEqual(self.asked(), [])
            return str(error).rpartition("': ")[2].strip()
        except lensd.Internal:
            return self.asked()
        raise AssertionError("it was answered")

    def compare(self, seed, likely, words, act, fits=lambda text: True):
        drawn, texts, read = Texts(seed, likely), [], 0
        while len(texts) < COUNT:
            text = drawn.text()
            if fits(text):
                texts.append(text)
        for text in texts:
            with self.subTest(text=text):
                wanted = self.by_lensctl(*words(text))
                told = self.by_python(lambda: act(self.lens, text))
                self.assertTrue(like(told, wanted), f"Python {told}, lensctl {wanted}")
                read += isinstance(wanted, list)
        print(f"{words('TEXT')[0]}: {len(texts)} texts, {read} of them read")
        self.assertGreater(read, len(texts) // 20)
        self.assertLess(read, len(texts))

    def test_focus(self):
        self.compare(1, ["m", "mm", "D", "ft", "'"], lambda text: ["focus", "--json", "--", "cam", text], lambda lens, text: lens.focus(text),
                     lambda text: text != "bike")

    def test_aperture(self):
        self.compare(2, [""], lambda text: ["aperture", "--json", "--", "cam", text], lambda lens, text: lens.aperture(text))

    def test_zoom(self):
        self.compare(3, ["mm", "cm"], lambda text: ["zoom", "--json", "--", "cam", text], lambda lens, text: lens.zoom(text))

    def test_exposure(self):
        self.compare(4, ["ms", "s", "us"], lambda text: ["exposure", "--json", "cam", text], lambda lens, text: lens.exposure(text),
                     lambda text: text != "" and text[0] != "-")

    def test_where_of_limits(self):
        drawn = random.Random(5)
        sizes = [drawn.choice(["8um", "1.5px", "0.01 mm", "1,5px", "8", "8UM", "0px", "-1um", "2m-3m", "\u221e"]) for _ in range(COUNT)]
        self.compare(6, ["m", "D"], lambda text: ["plan", "cam", "--json", "--sharp=" + text],
                     lambda lens, text: lens.plan([lensd.sharp(*text.split(":"))]),
                     lambda text: text != "" and text[0] != "@" and not set(":=") & set(text))
        for where in ("2m..3m", "4m..inf", "2m-3m", "1.2 m"):
            for size in sizes[:20]:
                with self.subTest(where=where, size=size):
                    wanted = self.by_lensctl("plan", "cam", "--json", f"--blurred={where}:{size}")
                    told = self.by_python(lambda: self.lens.plan([lensd.blurred(where, size)]))
                    self.assertTrue(like(told, wanted), f"Python {told}, lensctl {wanted}")

    def test_asyncio_reads_the_same(self):
        async def ask(text):
            async with lensd.aio.Lens(self.between.path, "cam") as lens:
                await lens.focus(text)
        for text in ("1.2 m from the sensor", "5'7\"", "2,3m", "812"):
            self.assertTrue(like(self.by_python(lambda: asyncio.run(ask(text))), self.by_lensctl("focus", "--json", "--", "cam", text)), text)


class Numbers(unittest.TestCase):
    """A number that does not say what it counts is a TypeError that says what to write, before anything is asked of lensd."""

    def refused(self, act):
        with self.assertRaises(TypeError) as caught:
            act(lensd.Lens("/nonexistent/socket", "cam"))

        async def wait():
            await act(lensd.aio.Lens("/nonexistent/socket", "cam"))
        with self.assertRaises(TypeError) as awaited:
            asyncio.run(wait())
        self.assertEqual(str(caught.exception), str(awaited.exception))
        return str(caught.exception)

    def test_what_it_says_is_what_to_write(self):
        for number in (2.3, 0, 812, -5):
            said = self.refused(lambda lens: lens.focus(number))
            for way in ("distance_m", "vergence_d", "extension_mm", "position", "relative"):
                self.assertIn(f"focus({way}={number})", said)
            self.assertIn("focus('2m')", said)
            self.assertIn(f"zoom(focal_length_mm={number})", self.refused(lambda lens: lens.zoom(number)))
            said = self.refused(lambda lens: lens.exposure(number))
            self.assertIn(f"exposure(exposure_ms={number})", said)
        self.assertIn("no target", self.refused(lambda lens: lens.focus()))
        self.assertIn("two targets", self.refused(lambda lens: lens.focus("2m", position=3)))
        self.assertIn("several targets", self.refused(lambda lens: lens.focus(distance_m=2, position=3)))
        self.assertIn("position is a number", self.refused(lambda lens: lens.focus(position="812")))
        self.assertIn("aperture(True)", self.refused(lambda lens: lens.aperture(True)))

    def test_one_that_says_it_is_sent(self):
        for act in (lambda lens: lens.focus(distance_m=2.3), lambda lens: lens.focus(position=812), lambda lens: lens.aperture(2.8),
                    lambda lens: lens.zoom(focal_length_mm=35), lambda lens: lens.exposure(exposure_ms=8)):
            with self.assertRaises(lensd.Unavailable):
                act(lensd.Lens("/nonexistent/socket", "cam"))


if __name__ == "__main__":
    unittest.main()
