"""A person at a terminal sees how far a long command has come, and after Control-C where the lens stands; programs and pipes see
neither."""
import json
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, LENS, DaemonTest  # noqa: E402

LENSCTL = os.path.join(BIN, "lensctl")


class Terminal:
    """lensctl with stderr on a terminal of its own and stdout in a pipe."""

    def __init__(self, daemon, *words):
        master, terminal = pty.openpty()
        self.seen = b""
        self.process = subprocess.Popen([LENSCTL, "--socket", daemon.socket, *words], stdout=subprocess.PIPE, stderr=terminal,
                                        text=True)
        os.close(terminal)
        self.reader = threading.Thread(target=self.read, args=(master,))
        self.reader.start()

    def read(self, master):
        with os.fdopen(master, "rb", buffering=0) as stream:
            try:
                while data := stream.read(4096):
                    self.seen += data
            except OSError:  # the other end has closed
                pass

    def end(self):
        out, _ = self.process.communicate(timeout=120)
        self.reader.join(timeout=60)
        return self.process.returncode, out, self.seen.decode()


class Progress(DaemonTest):
    lenses = ("a", "b", "c", "d")

    def test_a_line_from_the_second_second_on_and_on_a_terminal_alone(self):
        long = Terminal(self.daemon, "focus", "a", "@2600")
        json_too = Terminal(self.daemon, "--json", "focus", "b", "@2600")
        piped = subprocess.Popen([LENSCTL, "--socket", self.daemon.socket, "focus", "c", "@2600"], stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)
        status, out, seen = long.end()
        self.assertEqual(status, 0)
        lines = [line for line in seen.split("\r") if line.strip()]
        self.assertTrue(lines)
        for line in lines:
            self.assertRegex(line, r"^\d+ s, a: (moving, focus at -?[\d.]+ on its way to 2600, focused at .*|idle)")
            self.assertLess(len(line), 80)
        self.assertTrue(any(" on its way to 2600" in line for line in lines))
        self.assertRegex(seen, r"\r +\r$", "the line is gone in the end")
        self.assertRegex(out, r"^a: focus at 2600, ")
        status, out, seen = json_too.end()
        self.assertEqual((status, json.loads(out)["position"], seen), (0, 2600, ""))
        out, err = piped.communicate(timeout=120)
        self.assertEqual((piped.returncode, err), (0, ""))

    def state(self, lens):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]

    def interrupted(self, lens, *words, options=()):
        """What is said of a lens that is stopped by Control-C, and how it then is."""
        run = subprocess.Popen([LENSCTL, "--socket", self.daemon.socket, *options, *words], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
        begun = self.state(lens)["axes"][0]["position"]
        self.wait_for(lambda: abs(self.state(lens)["axes"][0]["position"] - begun) > 50)
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=120)
        self.assertEqual(run.returncode, 130, err)
        now = self.state(lens)
        self.assertFalse(any(axis["moving"] for axis in now["axes"]), "it was told before it was so")
        return out, err, now

    def test_control_c_stops_and_says_where_the_lens_stands(self):
        out, err, now = self.interrupted("d", "focus", "d", "@3900")
        told = re.search(r"^stopped: d: focus at ([\d.]+) within ([\d.]+), iris at [\d.]+ within [\d.]+, focused at .* "
                         r"\(([\d.]+) D\) within ([\d.]+) D, f/2$", err, re.M)
        self.assertTrue(told, err)
        position, bound, vergence, vergence_bound = (float(number) for number in told.groups())
        self.assertAlmostEqual(position, now["axes"][0]["position"], 3)
        self.assertLess(position, 3900)
        self.assertAlmostEqual(bound, now["axes"][0]["positionBound"], delta=0.01 * bound)
        self.assertAlmostEqual(vergence, now["vergenceD"], delta=1e-3 * vergence)
        self.assertAlmostEqual(vergence_bound, now["vergenceBoundD"], delta=0.1 * vergence_bound)
        self.assertLess(bound, 10, "it is where it was read, not somewhere on its way")
        self.assertEqual(out, "")

    def test_control_c_with_json_and_in_an_autofocus(self):
        out, err, _ = self.interrupted("c", "focus", "c", "@3900", options=("--json",))
        self.assertEqual(json.loads(out)["error"], "interrupted")
        self.assertIn("stopped: c: focus at ", err)
        out, err, _ = self.interrupted("b", "autofocus", "b", "--method", "exhaustive")
        self.assertRegex(err, r"stopped: b: focus at [\d.]+ within .*, focused at .* D\) within .* D, f/2")

    def test_control_c_among_frames_of_a_command_tells_what_it_has_come_to(self):
        """The command interrupts lensctl itself while it takes the fourth picture; before, it notes where the lens stood."""
        notes = os.path.join(self.daemon.folder.name, "notes")
        lensctl = f"{LENSCTL} --socket {self.daemon.socket}"
        take = (f"{lensctl} snapshot a -o $LENSD_FRAME >/dev/null && {lensctl} --json status a >> {notes}; "
                f"[ $(wc -l < {notes}) -lt 4 ] || kill -{{}} $PPID; true")
        for name, number in (("INT", 130), ("TERM", 130)):
            with self.subTest(name):
                run = self.daemon.lensctl("autofocus", "a", "--roi", "0.1,0.1,0.8,0.8", "--method", "sweep", "--range", "@1000..@2000",
                                          "--step", "60steps", "--frames-from", take.format(name))
                self.assertEqual((run.returncode, run.stdout), (number, ""), run.stderr)
                with open(notes, encoding="utf-8") as file:
                    stood = [json.loads(line)["axes"][0]["position"] for line in file]
                os.remove(notes)
                now = self.state("a")["axes"][0]
                self.assertFalse(now["moving"])
                told = re.search(r"^stopped: a: focus at ([\d.]+) within .*\nnot focused; sharpest so far at position ([\d.]+) "
                                 r"\(frame (\d) of ([1-3])\)$", run.stderr, re.M)
                self.assertTrue(told, run.stderr)
                self.assertAlmostEqual(float(told[1]), now["position"], places=3)
                # Sharp is the wall at 1.2 m: e = f^2 / (Z - f) of 25 mm, 2500 steps a millimetre.
                sharp = 2500 * 25.0**2 / (1200 - 25)
                self.assertAlmostEqual(float(told[2]), min(stood[:int(told[4])], key=lambda at: abs(at - sharp)), delta=1)
                self.assertAlmostEqual(float(told[2]), stood[int(told[3]) - 1], delta=1)

    def test_a_command_that_fails_tells_it_too(self):
        run = self.daemon.lensctl("autofocus", "a", "--roi", "0.1,0.1,0.8,0.8", "--frames-from", "false")
        self.assertEqual(run.returncode, 74, run.stderr)
        self.assertRegex(run.stderr, r"(?s)stopped: a: focus at .*no frame was judged yet.*so there is no frame: false")


if __name__ == "__main__":
    unittest.main()
