"""status --watch on a terminal: read as a terminal would show it, driven by keys, and given back as it was whatever ends it."""
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, LENS, PATIENCE, DaemonTest  # noqa: E402

LENSCTL = os.path.join(BIN, "lensctl")
OPEN, CLOSE = b"\x1b[?1049h", b"\x1b[?1049l"


class Screen:
    """lensctl on a terminal of its own, and what that shows: enough of ECMA-48 for what lensctl writes."""

    def __init__(self, daemon, *words, colour=True, rows=24, columns=100):
        self.master, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.before = termios.tcgetattr(terminal)
        environment = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
        self.process = subprocess.Popen([LENSCTL, "--socket", daemon.socket, "status", *words, "--watch"], stdin=terminal,
                                        stdout=terminal, stderr=subprocess.PIPE, text=True, start_new_session=True,
                                        env={**environment, **({} if colour else {"NO_COLOR": "1"})})
        self.terminal, self.seen, self.lines = terminal, b"", []

    def read(self, seconds):
        if select.select([self.master], [], [], seconds)[0]:
            self.seen += os.read(self.master, 65536)
            frames = self.seen.split(b"\x1b[H")
            if len(frames) > 2:
                whole = frames[-2 if b"\x1b[J" not in frames[-1] else -1]
                shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", whole.split(b"\x1b[J")[0].decode())
                self.lines = re.split(r"\r*\n", shown)

    def until(self, words, seconds=20):
        """Reads on until a line of the screen matches, which is the answer."""
        deadline = time.monotonic() + seconds * PATIENCE
        while time.monotonic() < deadline:
            for line in self.lines:
                if found := re.search(words, line):
                    return found
            self.read(0.1)
        raise AssertionError(f"{words} was never shown: " + "\n".join(self.lines))

    def type(self, keys):
        os.write(self.master, keys.encode())

    def end(self):
        """Exit status, and whether the terminal is as it was."""
        deadline = time.monotonic() + 20 * PATIENCE
        while self.process.poll() is None and time.monotonic() < deadline:
            self.read(0.05)
        status = self.process.wait(timeout=5)
        while select.select([self.master], [], [], 0)[0]:
            self.seen += os.read(self.master, 65536)
        as_it_was = termios.tcgetattr(self.terminal) == self.before and self.seen.rstrip().endswith(CLOSE)
        self.process.stderr.close()
        os.close(self.terminal)
        os.close(self.master)
        return status, as_it_was


class Watch(DaemonTest):
    lenses = ("a", "b")
    quick = ("b",)

    def call(self, method, **parameters):
        with self.daemon.client(60) as client:
            return client.call(LENS + method, parameters)

    def test_it_shows_what_there_is_and_follows_it(self):
        screen = Screen(self.daemon)
        screen.until(r"^lensd: 2 lenses")
        screen.until(r"^> a +idle .* f/2$")
        screen.until(r"^  b +idle ")
        screen.until(r"^    sharp +\S+ [km]?m .* to .*\(blur up to 2 px\)")
        self.call("Move", lens="a", axis="focus", target={"position": 1330})  # about where the wall is sharp
        screen.until(r"^    focus +1330 +\[-+o-+\] 0\.\.4000$")
        screen.until(r"^    sharpness +\[#+ *\] [\d.]+, best [\d.]+")
        state = self.call("Status", lens="a")["parameters"]["lenses"][0]
        told = screen.until(r"^> a .* ([\d.]+) m \(([\d.]+) D\)")
        self.assertAlmostEqual(float(told[1]), state["focalPlaneM"], delta=1e-3 * state["focalPlaneM"])
        with self.daemon.client() as holder:
            holder.call(LENS + "TakeLease", {"lens": "a", "forMs": 60e3})
            screen.until(r"^    lease +leased by \S+ .* for \d+ s")
            holder.call(LENS + "DropLease", {"lens": "a"})
        screen.type("q")
        self.assertEqual(screen.end(), (0, True))

    def test_keys_step_stop_and_focus(self):
        self.call("Move", lens="b", axis="focus", target={"position": 1000})
        screen = Screen(self.daemon)
        screen.until(r"^> a")
        screen.type("\x1b[B")
        screen.until(r"^> b")
        screen.type("\x1b[D")
        screen.until(r"^b: focus nearer by 10: done")
        self.assertEqual(self.position("b")["position"], 1010)
        screen.type("]")
        screen.until(r"^b: focus farther by 1: done")
        self.assertEqual(self.position("b")["position"], 1009)
        screen.type("f")
        screen.until(r"^b: autofocus: done", 60)
        self.assertNotEqual(self.position("b")["position"], 1009)
        screen.type("\x1b[A")
        screen.until(r"^> a")
        with self.daemon.client(60) as mover:
            far = 3900 if self.position("a")["position"] < 2000 else 0
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": far}})
            screen.until(r"^> a +moving")
            screen.type(" ")
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
        screen.until(r"^a: stop: done")
        screen.type("q")
        self.assertEqual(screen.end(), (0, True))

    def test_at_most_twenty_drawings_a_second_and_no_colour_where_none_is_wanted(self):
        screen = Screen(self.daemon, "a", colour=False)
        screen.until(r"^> a +idle")
        begun, before = time.monotonic(), screen.seen.count(b"\x1b[H")
        with self.daemon.client(60) as mover:
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3900}})
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3000}})
            while time.monotonic() < begun + 1.5:
                screen.read(0.02)
        took = time.monotonic() - begun
        drawn = screen.seen.count(b"\x1b[H") - before
        self.assertLessEqual(drawn, 20 * took + 1)
        self.assertGreater(drawn, 2)
        self.assertNotRegex(screen.seen, rb"\x1b\[\d*m")
        screen.type("q")
        self.assertEqual(screen.end(), (0, True))

    def test_the_terminal_is_given_back_whatever_ends_it(self):
        for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 0), (signal.SIGHUP, 0), (signal.SIGQUIT, 0)):
            with self.subTest(signal=number):
                screen = Screen(self.daemon)
                screen.until(r"^> a")
                screen.process.send_signal(number)
                self.assertEqual(screen.end(), (status, True))
        screen = Screen(self.daemon, "--timeout", "1s")
        self.assertEqual(screen.end(), (0, True))

    def test_a_daemon_that_goes_ends_it_with_its_error(self):
        from harness import Daemon  # one of its own, to be killed
        daemon = Daemon(("a",))
        screen = Screen(daemon)
        screen.until(r"^> a")
        daemon.kill()
        self.assertEqual(screen.end(), (69, True))

    def test_a_lens_that_is_not_there_is_an_error_and_no_screen(self):
        screen = Screen(self.daemon, "nobody")
        status, _ = screen.end()
        self.assertEqual(status, 68)
        self.assertNotIn(OPEN, screen.seen)

    def test_elsewhere_it_is_a_line_at_each_change(self):
        told = self.daemon.lensctl("status", "a", "--watch", "--timeout", "1s")
        self.assertEqual(told.returncode, 0)
        self.assertRegex(told.stdout, r"^a: ")
        self.assertNotIn("\x1b", told.stdout)


if __name__ == "__main__":
    unittest.main()
