"""Inside the virtual machine: two cameras of one configuration, each by its serial number, both asleep, are opened at once by each
start of lensd, and the first command to each works. Opening wakes them; of two that are woken at once the kernel loses one. Order
and state are asserted, never time.

usage: two_cameras_test.py SOURCE_FOLDER BIN_FOLDER SIM_UVC DRIVER"""
import glob
import os
import subprocess
import sys
import threading
import time
import unittest

ROOT, BIN, SIM, DRIVER = sys.argv[1:5]
STARTS = 20 if os.environ.get("LENSD_TEST_LEVEL") == "long" else 2
del sys.argv[1:]
os.environ["LENSD_BIN"] = BIN
os.environ.setdefault("LENSD_TEST_PATIENCE", "10")
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon"))
from harness import LENS, PATIENCE, Daemon  # noqa: E402

SCENE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "wall.toml")
NAMES = ("left", "right")


def text(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read().strip()


def asleep():
    """The serial numbers of the cameras that the kernel has suspended, once its driver has bound to them."""
    nodes = glob.glob("/sys/class/video4linux/video*")
    serials = []
    for path in glob.glob("/sys/bus/usb/devices/*/serial"):
        device = os.path.realpath(os.path.dirname(path))
        bound = any(os.path.realpath(node).startswith(device + "/") for node in nodes)
        if text(path) in ("LEFT", "RIGHT") and bound and text(os.path.join(device, "power", "runtime_status")) == "suspended":
            serials.append(text(path))
    return sorted(serials)


def plug(serial):
    camera = subprocess.Popen([SIM, SCENE, "--serial", serial], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                              bufsize=1)
    assert camera.stdout.readline() == "plugged in\n"
    return camera


class TwoCamerasTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cameras = [plug(name.upper()) for name in NAMES]

    @classmethod
    def tearDownClass(cls):
        for camera in cls.cameras:
            camera.stdin.close()
            camera.wait(timeout=6 * PATIENCE)
            camera.stdout.close()

    def wait_until_asleep(self):
        deadline = time.monotonic() + 6 * PATIENCE
        while asleep() != ["LEFT", "RIGHT"]:
            self.assertLess(time.monotonic(), deadline, f"only these went to sleep: {asleep()}")
            time.sleep(0.1)

    def test_the_first_command_of_each_start_works(self):
        more = "timeout_ms = 5000\nuse = \"lens\"\n" if DRIVER == "uvc" else ""
        config = "version = 1\n" + "".join(
            f'[[lens]]\nname = "{name}"\ndriver = "{DRIVER}"\nserial = "{name.upper()}"\n{more}' for name in NAMES)
        for start in range(STARTS):
            self.wait_until_asleep()
            daemon = Daemon(config=config)  # until it has tried to open both
            with daemon.client() as client:
                lenses = client.call(LENS + "Status")["parameters"]["lenses"]
            said = {}

            def first(name):
                said[name] = daemon.lensctl("focus", name, f"@{100 + 50 * (start % 4)}")

            threads = [threading.Thread(target=first, args=(name,)) for name in NAMES]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            log = daemon.log()
            self.assertEqual(daemon.stop(), 0)
            self.assertEqual([lens["connection"] for lens in lenses], ["connected"] * 2, f"start {start}:\n{log}")
            for name in NAMES:
                self.assertEqual(said[name].returncode, 0, f"start {start}: {said[name].stderr}\n{log}")


if __name__ == "__main__":
    unittest.main()
