"""Inside the virtual machine, with udev: two cameras alike to the serial number are told apart by where they are plugged in
(`id_path`), through libusb (driver uvc) and through the kernel's uvcvideo (driver v4l2), and a lens by place is whatever is
plugged in there. Order and state are asserted, never time.

usage: id_path_test.py SOURCE_FOLDER BIN_FOLDER SIM_UVC"""
import json
import os
import subprocess
import sys
import time
import tomllib
import unittest

ROOT, BIN, SIM = sys.argv[1:4]
del sys.argv[1:]
os.environ["LENSD_BIN"] = BIN
os.environ.setdefault("LENSD_TEST_PATIENCE", "10")
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon"))
from harness import PATIENCE, Daemon  # noqa: E402

SCENE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "wall.toml")
# The kernel's driver answers readings from its cache: it needs to be told how long a move takes.
MORE = {"uvc": "feedback = \"counts\"\ntimeout_ms = 5000\nuse = \"lens\"\n",
        "v4l2": "focus_speed = 1500\nfocus_settle_ms = 300\nparts = \"lens\"\n"}


def eventually(what, look):
    deadline = time.monotonic() + 6 * PATIENCE
    while time.monotonic() < deadline:
        found = look()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError("never: " + what)


def text(path):
    if not os.path.exists(path):
        return ""
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


class Twin:
    """One of two cameras with the same serial number. vhci gives it the first free port."""

    def __init__(self):
        self.process = subprocess.Popen([SIM, SCENE, "--serial", "TWIN"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        text=True, bufsize=1)
        assert self.process.stdout.readline() == "plugged in\n"

    def say(self, line):
        self.process.stdin.write(line + "\n")

    def focus(self):
        self.say("where")
        return round(float(self.process.stdout.readline().split()[1]))

    def end(self):
        self.process.stdin.close()
        self.process.wait(timeout=6 * PATIENCE)
        self.process.stdout.close()


def places(driver):
    """udev's ID_PATH of each twin: of the device itself, or of the node its pictures come from."""
    subprocess.run(["udevadm", "settle", "--timeout=60"], check=True)
    if driver == "v4l2":
        folder, mine = "/sys/class/video4linux", lambda path: text(path + "/index") == "0\n"
    else:
        folder, mine = "/sys/bus/usb/devices", lambda path: text(path + "/serial") == "TWIN\n"
    found = []
    for name in os.listdir(folder) if os.path.isdir(folder) else []:
        if mine(os.path.join(folder, name)):
            told = subprocess.run(["udevadm", "info", "--query=property", "--path=" + os.path.join(folder, name)],
                                  capture_output=True, text=True, check=False).stdout
            found += [line[len("ID_PATH="):] for line in told.splitlines() if line.startswith("ID_PATH=")]
    return sorted(found)


class Twins(unittest.TestCase):
    def setUp(self):
        self.twins = []

    def tearDown(self):
        for twin in self.twins:
            twin.end()

    def plug(self, driver, count):
        while len(self.twins) < count:
            self.twins.append(Twin())
            eventually(f"udev has seen {len(self.twins)}", lambda: len(places(driver)) == len(self.twins))

    def by_place(self, driver):
        self.plug(driver, 2)
        left, right = places(driver)
        lenses = "".join(f'[[lens]]\nname = "{name}"\ndriver = "{driver}"\nid_path = "{place}"\n{MORE[driver]}'
                         for name, place in (("left", left), ("right", right)))
        daemon = Daemon(config="version = 1\n" + lenses)

        def move(lens, target):
            done = daemon.lensctl("focus", lens, f"@{target}", "--json")
            self.assertEqual(done.returncode, 0, done.stderr + daemon.log())
            self.assertTrue(json.loads(done.stdout)["reached"])

        def positions():
            return [twin.focus() for twin in self.twins]

        def both_are_there():
            lenses = json.loads(daemon.lensctl("status", "--json").stdout)
            return [lens["connection"] for lens in lenses] == ["connected"] * 2

        try:
            # The kernel may have reset a port while it looked at the twins: then the first try to open finds nothing.
            eventually("both lenses are there", both_are_there)
            move("left", 300)
            self.assertEqual(positions()[0], 300)
            self.assertNotEqual(positions()[1], 300)
            move("right", 700)
            self.assertEqual(positions(), [300, 700])
            listed = json.loads(daemon.lensctl("devices", "--json").stdout)
            mine = [device for device in listed if device["driver"] == driver]
            # Whose is which cannot be told by serial number, so it is not told.
            self.assertEqual([(device["serial"], device["usedBy"]) for device in mine], [("TWIN", None)] * 2)
            told = sorted(tomllib.loads(device["config"])["lens"][0]["id_path"] for device in mine)
            self.assertEqual(told, [left, right])
            # Both go, and the second comes alone: it takes the first place, so it is the left one now.
            for twin in self.twins:
                twin.say("unplug")
            eventually("both are gone", lambda: not places(driver))
            self.twins[1].say("plug")
            eventually("it is at the first place", lambda: places(driver) == [left])
            if driver == "uvc":  # an axis that only counts has come back elsewhere: somebody has to say where it stands
                eventually("and found there", lambda: daemon.lensctl("here", "left", f"@{self.twins[1].focus()}").returncode == 0)
            eventually("and it moves there", lambda: daemon.lensctl("focus", "left", "@500").returncode == 0)
            self.assertEqual(self.twins[1].focus(), 500)
            self.assertEqual(self.twins[0].focus(), 300)
            away = daemon.lensctl("focus", "right", "@100")
            self.assertEqual(away.returncode, 69, away.stderr)
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_through_libusb(self):
        self.by_place("uvc")

    def test_through_the_kernels_driver(self):
        self.by_place("v4l2")

    def test_the_serial_number_alone_is_refused(self):
        self.plug("uvc", 2)
        done = subprocess.run([os.path.join(BIN, "lens-run"), "uvc", "serial=TWIN", "move", "focus", "10"],
                              capture_output=True, text=True, check=False, timeout=6 * PATIENCE)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("2 devices fit (id_path ", done.stderr)
        self.assertIn("say which USB camera with serial or id_path", done.stderr)


if __name__ == "__main__":
    unittest.main()
