"""A lens whose axis counts its steps and has no reference, through losses of power and ends of lensd: nothing is reached that is
elsewhere, `here` says where it stands, and that lasts."""
import glob
import json
import os
import random
import signal
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from counting_drive import PROFILE, CountingDrive  # noqa: E402
from harness import LENS, PATIENCE, Daemon  # noqa: E402

OUTAGES = {"fast": 3, "ci": 4, "long": 200}[os.environ.get("LENSD_TEST_LEVEL", "ci")]
ENDS = {"fast": 2, "ci": 4, "long": 200}[os.environ.get("LENSD_TEST_LEVEL", "ci")]
CONFIG = """version = 1
[[bus]]
name = "b"
driver = "modbus"
host = "127.0.0.1:{port}"
response_timeout_ms = 300
[[lens]]
name = "cam"
driver = "modbus"
bus = "b"
[lens.drives.focus]
unit = 1
profile = "drive.toml"
range = [0, 30000]
[lens.focus]
direction = "near-positive"
backlash = 0
{restore}
[lens.optics]
focal_length_mm = 25.0
f_number = [2.0, 2.0]
extension_mm = [0.0, 1.6]
"""


class DriveCase(unittest.TestCase):
    profile = PROFILE

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-counted-")
        self.addCleanup(self.folder.cleanup)
        self.drive = CountingDrive(shaft=20000)
        self.addCleanup(self.drive.close)
        self.drive.get_power(20000)
        self.daemon = None
        self.addCleanup(lambda: self.daemon and self.daemon.kill())

    def start(self, restore=""):
        profile = os.path.join(self.folder.name, "drive.toml")
        with open(profile, "w", encoding="utf-8") as file:
            file.write(self.profile)
        config = CONFIG.format(port=self.drive.port, restore=restore and f'restore = "{restore}"')
        self.daemon = Daemon(config=config.replace("drive.toml", profile),
                             arguments=("--state", os.path.join(self.folder.name, "state")))
        self.wait_for_answers(True)

    def kill(self):
        self.daemon.kill()
        self.daemon = None

    def status(self):
        with self.daemon.client() as client:
            lens = client.call(LENS + "Status", {"lens": "cam"})["parameters"]["lenses"][0]
        return lens, lens["axes"][0] if lens["axes"] else None

    def wait_for_answers(self, connected):
        with self.daemon.client() as client:
            client.send(LENS + "Status", {"lens": "cam"}, more=True)
            while client.receive()["parameters"]["lenses"][0]["connected"] != connected:
                pass

    def lose_power(self, count=0):
        self.drive.lose_power()
        self.wait_for_answers(False)
        self.drive.get_power(count)
        self.wait_for_answers(True)

    def lensctl(self, *arguments, status=0):
        done = self.daemon.lensctl(*arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def reaches(self, position):
        move = json.loads(self.lensctl("focus", f"@{position}", "--json"))
        self.assertTrue(move["reached"], move)
        self.assertEqual((move["position"], self.drive.shaft()), (position, position))

    def is_unknown(self):
        lens, focus = self.status()
        self.assertEqual((focus["homed"], focus["positionUnknown"], lens["vergenceD"], lens["extensionMm"]),
                         (False, True, None, None))

    def wait_until_moving(self):
        with self.daemon.client() as client:
            client.send(LENS + "Status", {"lens": "cam"}, more=True)
            while not client.receive()["parameters"]["lenses"][0]["axes"][0]["moving"]:
                pass


class CountedTest(DriveCase):
    def test_a_first_start_is_believed_and_told_so(self):
        self.start()
        self.assertIn("not referenced", self.lensctl("list"))
        focus = self.status()[1]
        self.assertTrue(focus["homed"])
        self.assertIsNone(focus.get("positionUnknown"))
        self.reaches(21800)

    def test_a_lost_place_is_unknown_until_somebody_says_it(self):
        self.start()
        self.reaches(21800)
        self.lensctl("preset", "save", "there")
        self.lose_power()
        self.is_unknown()
        self.daemon.wait_log("where focus stands is not known", "lensctl here focus @N")
        self.assertIn("position unknown", self.lensctl("status"))
        for refused in (("focus", "1m"), ("focus", "1D"), ("focus", "ext:0.5mm"), ("preset", "save", "here"),
                        ("preset", "recall", "there"), ("plan", "--sharp", "1m..1.05m:60um", "--apply")):
            with self.subTest(refused=refused):
                self.assertIn("lensctl here focus @N", self.lensctl(*refused, status=7))
                self.assertEqual(self.drive.shaft(), 21800)
        by = json.loads(self.lensctl("focus", "+100", "--json"))
        self.assertEqual((by["reached"], by["cause"], by["verified"], by.get("vergenceD")), (True, "positionUnknown", False, None))
        self.assertEqual(self.drive.shaft(), 21900)
        to = json.loads(self.lensctl("focus", "@500", "--json", status=1))
        self.assertEqual((to["reached"], to["cause"]), (False, "positionUnknown"))
        self.assertEqual(self.drive.shaft(), 22300)
        self.kill()  # it stays unknown, where it is told the same as before
        self.start()
        self.is_unknown()
        self.assertIn("stands at 22300", self.lensctl("here", "@22300"))
        self.assertEqual(self.drive.shaft(), 22300)
        self.assertNotIn("not referenced", self.lensctl("list"))
        focus = self.status()[1]
        self.assertEqual((focus["position"], focus["homed"], focus.get("positionUnknown")), (22300, True, None))
        for place in (100, 15000):  # below where it began to count, too
            self.reaches(place)
        self.lensctl("preset", "recall", "there")
        self.assertEqual(self.drive.shaft(), 21800)
        self.kill()
        self.start()
        self.reaches(7000)

    def test_restore_says_where_it_rested(self):
        for restore in ("near-zero", "conditional", "always")[:None if OUTAGES > 4 else 1]:
            self.start(restore)
            place = self.drive.shaft() - 1000
            self.lensctl("here", f"@{place + 1000}")
            self.reaches(place)
            self.lose_power()
            self.assertEqual(self.status()[1]["position"], place)
            self.reaches(place + 500)
            self.kill()
            self.drive.lose_power()
            self.drive.get_power(0)
            self.start(restore)
            self.assertEqual(self.status()[1]["position"], place + 500)
            self.lose_power(1234)
            self.is_unknown()
            self.kill()

    def test_outages_at_random(self):
        chance = random.Random(11)
        known = 0
        self.start()
        for number in range(OUTAGES):
            with self.subTest(number=number):
                self.lensctl("here", "cam", "focus", f"@{self.drive.shaft()}")
                place = chance.randrange(0, 30000)
                in_mid_move = number % 4 > 1
                if in_mid_move:
                    with self.daemon.client() as client:
                        away = 29999 if self.drive.shaft() < 15000 else 0
                        client.send(LENS + "Move", {"axis": "focus", "target": {"position": away}}, oneway=True)
                        self.wait_until_moving()
                else:
                    self.reaches(place)
                killed = chance.random() < 0.4
                kept = number % 2 == 0
                if killed:
                    self.kill()
                self.drive.lose_power()
                here = self.drive.shaft()
                count = here - round(self.drive.zero) if kept else chance.choice([0, chance.randrange(0, 30000)])
                if killed:
                    self.drive.get_power(count)
                    self.start()
                else:
                    self.wait_for_answers(False)
                    self.drive.get_power(count)
                    self.wait_for_answers(True)
                focus = self.status()[1]
                if kept and not in_mid_move:
                    self.assertTrue(focus["homed"])
                if focus["homed"]:
                    known += 1
                    self.reaches(chance.randrange(0, 30000))
                else:
                    self.is_unknown()
        print(f"{OUTAGES} outages, the place known after {known}")

    def test_an_end_just_after_a_command_keeps_the_place(self):
        """SIGTERM at any instant of a move: the motor stands when lensd has ended, and the next start knows where."""
        chance = random.Random(12)
        for number in range(ENDS):
            self.start()
            with self.daemon.client() as client:
                client.send(LENS + "Move", {"lens": "cam", "axis": "focus", "target": {"position": chance.choice([20000 + 37 * number, 3000])}})
                time.sleep(chance.choice([0.0, 0.05, 0.3]) * chance.random())
                silent = chance.choice([0.0, 0.2, 0.6]) * chance.random()
                self.drive.hold_answers(silent)
                self.daemon.process.send_signal(signal.SIGTERM)
                self.assertEqual(self.daemon.process.wait(timeout=60), 0)
            self.assertNotIn("tries no more", self.daemon.log())
            place = self.drive.shaft()
            time.sleep(0.05)
            self.assertEqual(self.drive.shaft(), place, "the motor stands")
            self.kill()
            self.drive.hold_answers(0.0)
            self.start()
            self.assertEqual(self.status()[1]["position"], place)
            self.kill()

    def test_who_may_say_it_and_what(self):
        self.start()
        for words in (["here"], ["here", "1200"], ["here", "+5"], ["here", "cam", "focsu", "@5"], ["here", "@"],
                      ["here", "cam", "focus", "@1", "@2"]):
            self.lensctl(*words, status=64)
        self.lensctl("here", "@30001", status=6)
        self.lensctl("here", "zoom", "@5", status=8)
        self.lensctl("here", "other", "@5", status=68)
        with self.daemon.client() as holder:
            holder.call(LENS + "TakeLease", {"lens": "cam"})
            self.lensctl("here", "@5", status=9)
            self.assertEqual(holder.call(LENS + "SetPosition", {"axis": "focus", "position": 20000}), {"parameters": {}})
        with self.daemon.client() as mover:
            mover.send(LENS + "Move", {"axis": "focus", "target": {"position": 1000}})
            self.wait_until_moving()
            self.lensctl("here", "@5", status=4)
            self.assertTrue(mover.receive()["parameters"]["move"]["reached"])
        self.assertEqual(self.drive.shaft(), 1000)


class MeasuredTest(DriveCase):
    """An encoder, and no reference: whatever happened, where it stands is measured, and nobody could say it better."""
    profile = PROFILE.replace('type = "s32"\n[[move]]', 'type = "s32"\nfeedback = "encoder"\n[[move]]')

    def test_a_kill_in_mid_move_leaves_nothing_unknown(self):
        chance = random.Random(20261128)
        for number in range(OUTAGES):
            restore = chance.choice(("", "never", "near-zero", "conditional", "always"))
            with self.subTest(number=number, restore=restore):
                self.start(restore)
                away = 29999 if self.drive.shaft() < 15000 else 0
                with self.daemon.client() as client:
                    client.send(LENS + "Move", {"axis": "focus", "target": {"position": away}}, oneway=True)
                    self.wait_until_moving()
                self.kill()
                if chance.random() < 0.3:
                    path, = glob.glob(os.path.join(self.folder.name, "state", "*.position.json"))
                    with open(path, "a", encoding="utf-8") as file:
                        file.write("damaged")
                self.start(restore)
                deadline = time.monotonic() + 30 * PATIENCE
                while (focus := self.status()[1])["moving"] or focus["position"] != self.drive.shaft():
                    self.assertLess(time.monotonic(), deadline, focus)
                self.assertEqual((focus["homed"], focus.get("positionUnknown"), focus["position"]), (True, None, self.drive.shaft()))
                place = chance.randrange(0, 30000)
                move = json.loads(self.lensctl("focus", f"@{place}", "--json"))
                self.assertEqual((move["reached"], move["verified"], move["reason"], self.drive.shaft()), (True, True, None, place))
                self.kill()


class HomingLens(unittest.TestCase):
    def test_what_can_be_homed_is_homed(self):
        daemon = Daemon(lenses=("a",))
        try:
            done = daemon.lensctl("here", "@5")
            self.assertEqual(done.returncode, 8, done.stderr)
            self.assertIn("lensctl home", done.stderr)
            self.assertNotIn("not referenced", daemon.lensctl("list").stdout)
        finally:
            daemon.kill()


if __name__ == "__main__":
    unittest.main()
