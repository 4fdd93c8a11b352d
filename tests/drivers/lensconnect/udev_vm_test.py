#!/usr/bin/env python3
"""In the virtual machine with udev: the installed rules give a lens' node to the group video, and lensd
finds it when udev tells of it."""
import grp
import json
import os
import shutil
import stat
import subprocess
import sys
import time
import unittest

ROOT, BIN = sys.argv[1:3]
del sys.argv[1:]
os.environ["LENSD_BIN"] = BIN
os.environ.setdefault("LENSD_TEST_PATIENCE", "10")
sys.path.insert(0, os.path.join(ROOT, "tests", "daemon"))
from harness import LENS, PATIENCE, Daemon  # noqa: E402

RULES = "/etc/udev/rules.d/60-lensd.rules"


def node_of(lens):
    """The hidraw node of the simulated lens, once udev has dealt with it."""
    deadline = time.monotonic() + 20 * PATIENCE
    while time.monotonic() < deadline:
        for name in sorted(os.listdir("/sys/class/hidraw")):
            with open(f"/sys/class/hidraw/{name}/device/uevent", encoding="ascii") as uevent:
                if f"HID_UNIQ={lens}\n" in uevent.read() and os.path.exists("/dev/" + name):
                    subprocess.run(["udevadm", "settle", "--timeout=60"], check=True)
                    return "/dev/" + name
        time.sleep(0.05)
    raise AssertionError("no hidraw node came")


class Rules(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.copy(os.path.join(ROOT, "systemd", "udev", "60-lensd.rules"), RULES)
        subprocess.run(["udevadm", "control", "--reload"], check=True)
        cls.lens = subprocess.Popen([os.path.join(BIN, "uhid_lens"), "UDEV1"], stdin=subprocess.PIPE,
                                    stdout=subprocess.PIPE, text=True)

    @classmethod
    def tearDownClass(cls):
        cls.lens.stdin.close()
        cls.lens.wait(timeout=30)
        cls.lens.stdout.close()

    def tell(self, command):
        self.lens.stdin.write(command + "\n")
        self.lens.stdin.flush()
        self.assertEqual(self.lens.stdout.readline().strip(), "ok")

    def test_the_node_belongs_to_video_and_the_daemon_hears_of_it(self):
        daemon = Daemon(config='version = 1\n[[lens]]\nname = "usb"\ndriver = "lensconnect"\nserial = "UDEV1"\n')
        try:
            self.tell("plug")
            node = node_of("UDEV1")
            about = os.stat(node)
            self.assertEqual(grp.getgrgid(about.st_gid).gr_name, "video")
            self.assertEqual(stat.S_IMODE(about.st_mode), 0o660)
            deadline = time.monotonic() + 20 * PATIENCE
            connected = False
            while not connected and time.monotonic() < deadline:
                with daemon.client() as client:
                    connected = client.call(LENS + "Status")["parameters"]["lenses"][0]["connected"]
                time.sleep(0.02)
            self.assertTrue(connected, daemon.log())
            findings = json.loads(daemon.lensctl("doctor", "--json").stdout)
            udev = next(finding for finding in findings if finding["check"] == "udev")
            self.assertEqual(udev["status"], "ok", udev)
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_somebody_outside_the_group_is_told_what_to_do(self):
        self.tell("plug") if not self.plugged() else None
        node = node_of("UDEV1")
        listed = subprocess.run([os.path.join(BIN, "lens-run"), "lensconnect"], capture_output=True, text=True, user=65534,
                                group=65534, extra_groups=[], timeout=60 * PATIENCE, check=False)
        self.assertIn(f"no permission to read and write {node}; join its group video", listed.stdout + listed.stderr)

    def plugged(self):
        def uevent(name):
            with open(f"/sys/class/hidraw/{name}/device/uevent", encoding="ascii") as file:
                return file.read()

        return any("UDEV1" in uevent(name) for name in os.listdir("/sys/class/hidraw"))


if __name__ == "__main__":
    unittest.main()
