"""Cameras whose GenICam file refers to itself: each is refused with the nodes of the circle, and lensd serves everything
else. Aravis' simulated camera with files of ours, loopback."""
import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "daemon"))
from harness import BIN, LENS, PATIENCE, Daemon  # noqa: E402
from own_network import Turn  # noqa: E402

QUICK = os.path.join(HERE, "quick.toml")
SMALL = os.path.join(HERE, "..", "..", "daemon", "small.toml")
turn = Turn()

TWO = ('<IntSwissKnife Name="CycM"><pVariable Name="A">CycN</pVariable><Formula>A</Formula></IntSwissKnife>'
       '<IntSwissKnife Name="CycN"><pVariable Name="A">CycM</pVariable><Formula>A</Formula></IntSwissKnife>')
ONE = '<IntSwissKnife Name="CycM"><pVariable Name="A">CycM</pVariable><Formula>A</Formula></IntSwissKnife>'
VALUES = '<Integer Name="FocusOther"><pValue>FocusStepper</pValue></Integer>'
CIRCLE = "CycM -> CycN -> CycM"
# The smallest number divided by -1, and its remainder: on x86-64 the processor raises an exception for both.
OVERFLOW = ('<IntSwissKnife Name="CycM"><Formula>(1 &lt;&lt; 63) / (0 - 1)</Formula></IntSwissKnife>',
            '<IntSwissKnife Name="CycM"><Formula>(1 &lt;&lt; 63) % (0 - 1)</Formula></IntSwissKnife>')
# Where the circle hangs: the feature, what is written into it, the circle, and how it is told.
PLACES = {
    "maximum": ("FocusStepper", "<pMax>CycM</pMax>", TWO, CIRCLE),
    "minimum": ("FocusStepper", "<pMin>CycM</pMin>", TWO, CIRCLE),
    "increment": ("FocusStepper", "<pInc>CycM</pInc>", TWO, CIRCLE),
    "focus available": ("FocusStepper", "<pIsAvailable>CycM</pIsAvailable>", TWO, CIRCLE),
    "itself": ("FocusStepper", "<pMax>CycM</pMax>", ONE, "CycM -> CycM"),
    "gain available": ("GainRaw", "<pIsAvailable>CycM</pIsAvailable>", TWO, CIRCLE),
    "width": ("Width", "<pMax>CycM</pMax>", TWO, CIRCLE),
    "value": ("FocusStepper", "<pValue>FocusOther</pValue>", VALUES, "FocusStepper -> FocusOther -> FocusStepper"),
}
LENSES = (f'[[lens]]\nname = "good"\ndriver = "sim"\nscene = "{SMALL}"\n'
          '[[lens]]\nname = "bad"\ndriver = "aravis"\naddress = "127.0.0.1"\n')


def setUpModule():
    turn.take()


def tearDownModule():
    turn.give()


def description():
    return subprocess.run([os.path.join(BIN, "sim-gige-camera"), "--scene", QUICK, "--print-description"],
                          capture_output=True, text=True, timeout=60 * PATIENCE, check=True).stdout


def circular(text, place):
    """A camera's file with a circle in it, and what the refusal says of that."""
    feature, reference, nodes, chain = PLACES[place]
    begin = text.index(">", text.index(f'Name="{feature}"')) + 1
    end = text.index("\n", begin)  # a node a line
    element = re.match("<p?(\\w+)>", reference)[1]
    # Of two that state the same, Aravis would take the last.
    inside = re.sub(f"<p?{element}>[^<]*</p?{element}>", "", text[begin:end])
    rest = text[end:].replace("</RegisterDescription>", nodes + "</RegisterDescription>")
    return text[:begin] + reference + inside + rest, chain


@contextlib.contextmanager
def camera(text):
    """Aravis' simulated camera, with that file."""
    with tempfile.NamedTemporaryFile("w", suffix=".xml", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        process = subprocess.Popen(["arv-fake-gv-camera-0.8", "-i", "127.0.0.1", "-s", "BAD1", "-g", file.name],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            yield
        finally:
            process.kill()
            process.wait(timeout=30 * PATIENCE)


@contextlib.contextmanager
def daemon_of(lenses):
    """lensd, which must go in peace."""
    daemon = Daemon(config="version = 1\n" + lenses)
    try:
        yield daemon
    finally:
        status = daemon.stop()
        if status != 0:
            raise AssertionError(f"lensd ended with {status}")


class CircularDescriptions(unittest.TestCase):
    def refused(self, daemon, chain):
        """The lens of that camera is refused with the reason, the other one is served."""
        deadline = time.monotonic() + 20 * PATIENCE
        with daemon.client() as client:
            while True:
                lenses = {lens["name"]: lens for lens in client.call(LENS + "Status")["parameters"]["lenses"]}
                if "GenICam" in (lenses["bad"]["error"] or ""):
                    break
                self.assertLess(time.monotonic(), deadline, lenses)
                time.sleep(0.02)
        self.assertIn("the camera with address 127.0.0.1 is not used: its GenICam file (Local:arv-fake-camera.xml",
                      lenses["bad"]["error"])
        self.assertIn(": " + chain, lenses["bad"]["error"])
        self.assertEqual(lenses["bad"]["connection"], "wrongDevice")
        self.assertEqual(lenses["good"]["connection"], "connected")

    def refused_in_searches(self, daemon, chain):
        self.found(json.loads(daemon.lensctl("--json", "devices").stdout), chain)
        done = subprocess.run([os.path.join(BIN, "lensd"), "--devices"], capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.found(json.loads(done.stdout)["devices"], chain)
        self.assertIn(chain, daemon.lensctl("doctor").stdout)
        moved = daemon.lensctl("focus", "good", "@100")
        self.assertEqual(moved.returncode, 0, moved.stdout + moved.stderr)

    def found(self, devices, chain):
        """The camera is there, and why it is not used."""
        problems = [device["problem"] for device in devices if device["serial"] == "BAD1"]
        self.assertEqual(len(problems), 1, devices)
        self.assertIn(chain, problems[0])

    def test_a_division_that_overflows_ends_nothing(self):
        """Formulas of whole numbers; lensd was ended by SIGFPE."""
        good = description()
        for place, nodes in zip(("maximum", "gain available"), OVERFLOW):
            with self.subTest(place):
                text = circular(good, place)[0].replace(TWO, nodes)
                with camera(text), daemon_of(LENSES) as daemon:
                    deadline = time.monotonic() + 20 * PATIENCE
                    with daemon.client() as client:
                        while client.call(LENS + "Status", {"lens": "bad"})["parameters"]["lenses"][0]["connection"] == "connecting":
                            self.assertLess(time.monotonic(), deadline)
                            time.sleep(0.02)
                    devices = json.loads(daemon.lensctl("--json", "devices").stdout)
                    self.assertEqual([device["problem"] for device in devices if device["serial"] == "BAD1"], [None])
                    moved = daemon.lensctl("focus", "good", "@100")
                    self.assertEqual(moved.returncode, 0, moved.stdout + moved.stderr)
                    print(place, daemon.lensctl("status", "bad").stdout, file=sys.stderr)

    def test_the_process_that_tries_a_usb_camera_says_nothing_and_ends(self):
        """What goes wrong in order, as with a camera that is not there, is found by the process that waits for it."""
        done = subprocess.run([os.path.join(BIN, "lensd"), "--try-usb-camera", "Nobody-Camera-1"], capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_every_place_is_refused_and_the_other_lens_is_served(self):
        good = description()
        for place in PLACES:
            with self.subTest(place):
                began = time.monotonic()
                text, chain = circular(good, place)
                with camera(text), daemon_of(LENSES) as daemon:
                    self.refused(daemon, chain)
                    if place in ("maximum", "value"):
                        self.refused_in_searches(daemon, chain)
                print(f"{place}: refused in {time.monotonic() - began:.1f} s", file=sys.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
