"""`start` and `keep`: a lens stands where it is to stand after a restart, a replug, and other programs; and nothing of this moves a
lens that a client moves, stops or leases, or that does not know where it stands."""
import os
import random
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bench import SIM  # noqa: E402
from counting_drive import PROFILE, CountingDrive  # noqa: E402
from harness import BIN, HERE, LENS, PATIENCE, Daemon, played_node, quick_scene  # noqa: E402

LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"
RESTARTS = 100 if LONG else 3
REOPENED = 5000 if LONG else 100
SAID = 100 if LONG else 3
KILLS = 200 if LONG else 6
UNDONE = 60 if LONG else 3
CREEP = 0.1  # steps: a mechanism comes to rest exponentially, a settled move is within this
FOCUS, AUTOFOCUS = 0x9A090A, 0x9A090C
# Focus of 0 to 250 which the device's own autofocus takes away while it is on, as the kernel has it.
TABLE = "009a090a 1 0 250 1 0 {focus} 0 inactive 10094860\n009a090c 2 0 1 1 0 {automatic} 0\n"

# Another program on the node: it opens it anew for each line "FOCUS AUTOMATIC" (a number, or - where it leaves that alone).
OTHER = """import ctypes, fcntl, os, struct, sys
def control(node, number, value):
    one = ctypes.create_string_buffer(struct.pack("=IIIq", number, 0, 0, value))
    fcntl.ioctl(node, 0xC0205648, struct.pack("=IIIiIxxxxQ", 0, 1, 0, 0, 0, ctypes.addressof(one)))
for line in sys.stdin:
    focus, automatic = line.split()
    node = os.open(os.environ["FAKE_NODE"], os.O_RDWR)
    fcntl.ioctl(node, 0xC0145608, struct.pack("=IIIIB3x", 2, 1, 1, 0, 0))
    fcntl.ioctl(node, 0x40045612, struct.pack("=i", 1))
    if automatic != "-":
        control(node, 0x9A090C, int(automatic))
    if focus != "-":
        control(node, 0x9A090A, int(focus))
    fcntl.ioctl(node, 0x40045613, struct.pack("=i", 1))
    os.close(node)
    print("closed", flush=True)
"""


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-stay-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        self.daemon = None
        self.addCleanup(self.end)
        self.draw = random.Random(20261128)

    def start(self, lens, state=True, head="", **played):
        self.daemon = Daemon(config="version = 1\n" + head + '[[lens]]\nname = "cam"\n' + lens,
                             arguments=("--state", self.state) if state else (), **played)

    def end(self):
        if self.daemon is not None:
            daemon, self.daemon = self.daemon, None
            self.assertEqual(daemon.stop(), 0)

    def status(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "cam"})["parameters"]["lenses"][0]

    def focus(self):
        return next(axis for axis in self.status()["axes"] if axis["axis"] == "focus")

    def move(self, position, axis="focus"):
        with self.daemon.client() as client:
            reply = client.call(LENS + "Move", {"lens": "cam", "axis": axis, "target": {"position": position}})
        self.assertTrue(reply["parameters"]["move"]["reached"], reply)

    def wait_for(self, condition, seconds=30):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened:\n" + self.daemon.log())
            time.sleep(0.005)

    def stands_at(self, position):
        self.wait_for(lambda: (now := self.focus())["position"] == position and not now["moving"])

    def looked_at(self):
        """lensd has had time to do what it must not: it has read the lens several times since."""
        for _ in range(5):
            seen = self.status()["readAtNs"]
            self.wait_for(lambda: self.status()["readAtNs"] > seen)

    def lines(self, *words):
        return [line for line in self.daemon.log().splitlines() if all(word in line for word in words)]


class Played(Case):
    """A webcam of the kernel: lensd drives its focus, and other programs take pictures from it."""

    @classmethod
    def setUpClass(cls):
        cls.built = tempfile.TemporaryDirectory(prefix="lensd-played-")
        cls.library = played_node(cls.built.name)

    @classmethod
    def tearDownClass(cls):
        cls.built.cleanup()

    def setUp(self):
        super().setUp()
        self.node = os.path.join(self.folder.name, "video0")
        self.table = os.path.join(self.folder.name, "table.ctl")
        self.played = {"FAKE_NODE": self.node, "FAKE_CTL": self.table, "FAKE_FMT": "320 240 GREY 30", "FAKE_SHARED": "1"}
        self.plug(0)

    def plug(self, focus, automatic=0):
        """The camera has got power: nothing of what was set before is left."""
        with open(self.node, "w", encoding="utf-8"), open(self.table, "w", encoding="utf-8") as table:
            table.write(TABLE.format(focus=focus, automatic=automatic))

    def device(self):
        """Its controls, as the file of the played node has them."""
        with open(self.table, encoding="utf-8") as table:
            return {int(words[0], 16): int(words[6]) for words in (line.split() for line in table)}

    def begin(self, start="", keep=False, state=True, limits=""):
        self.start(f'driver = "v4l2"\ndevice = "{self.node}"\nparts = "lens"\n{start}' + ("[lens.focus]\nkeep = true\n" + limits if keep else ""),
                   state, preload=self.library, environment=self.played)

    def other_program(self):
        process = subprocess.Popen([sys.executable, "-c", OTHER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                   env={**os.environ, **self.played, "LD_PRELOAD": self.library})

        def over():
            process.stdin.close()
            process.stdout.close()
            process.wait(timeout=30 * PATIENCE)
        self.addCleanup(over)

        def opens(focus="-", automatic="-"):
            process.stdin.write(f"{focus} {automatic}\n")
            process.stdin.flush()
            self.assertEqual(process.stdout.readline(), "closed\n")
        return opens

    def test_after_a_restart_it_stands_where_it_was_left_or_at_its_preset(self):
        for _ in range(RESTARTS):
            preset = self.draw.random() < 0.5
            start = 'start = "preset:desk"\n' if preset else 'start = "last"\n'
            wanted, elsewhere, reset = self.draw.sample(range(251), 3)
            with self.subTest(start=start, wanted=wanted, elsewhere=elsewhere, reset=reset):
                self.begin(start)
                self.move(wanted)
                if preset:
                    self.assertEqual(self.daemon.lensctl("preset", "save", "cam", "desk").returncode, 0)
                    self.move(elsewhere)
                self.end()
                self.plug(reset, automatic=self.draw.randint(0, 1))
                self.begin(start)
                self.stands_at(wanted)
                self.assertEqual(self.device()[FOCUS], wanted)
                self.assertEqual(self.status()["warnings"], [])
                self.end()

    def test_what_was_answered_is_not_undone_by_a_kill(self):
        """However soon after the answer it comes, and whatever the power does then."""
        self.begin('start = "last"\n')
        left = None
        for number in range(KILLS):
            wanted, reset = self.draw.sample([place for place in range(251) if place != left], 2)
            alive = 0.2 * self.draw.random() * (number % 2)  # at once, every other time
            with self.subTest(wanted=wanted, reset=reset, alive=alive):
                self.move(wanted)
                time.sleep(alive)
                daemon, self.daemon = self.daemon, None
                daemon.kill()
                if self.draw.random() < 0.7:
                    self.plug(reset, automatic=self.draw.randint(0, 1))
                self.begin('start = "last"\n')
                self.daemon.wait_log("start: the lens is where it was left")
                self.assertEqual((self.device()[FOCUS], self.focus()["position"]), (wanted, wanted))
                self.assertEqual([name for name in os.listdir(self.state) if name.startswith(".")], [])
                left = wanted

    def test_what_another_program_did_is_not_where_it_was_left(self):
        """Also where lensd is killed then."""
        self.begin('start = "last"\n')
        opens = self.other_program()
        for _ in range(RESTARTS):
            wanted, elsewhere = self.draw.sample(range(0, 251, 10), 2)
            self.move(wanted)
            opens(elsewhere)
            self.wait_for(lambda: self.focus()["position"] == elsewhere)
            if follow := self.draw.random() < 0.5:  # a client wants it where the other program has put it
                self.move(elsewhere)
            self.wait_for(lambda: self.kept_last() == (elsewhere if follow else wanted))
            daemon, self.daemon = self.daemon, None
            daemon.kill()
            self.begin('start = "last"\n')
            self.daemon.wait_log("start: the lens is where it was left")
            self.assertEqual(self.device()[FOCUS], elsewhere if follow else wanted)

    def test_keep_follows_a_client_to_where_another_program_has_put_it(self):
        self.begin(keep=True)
        self.move(200)
        opens = self.other_program()
        opens(50)
        self.wait_for(lambda: self.device()[FOCUS] == 200)
        opens(90)  # less than 2 s later it is not brought back yet
        self.wait_for(lambda: self.focus()["position"] == 90)
        self.move(90)
        self.looked_at()
        opens(30)
        self.wait_for(lambda: self.device()[FOCUS] == 90)

    def test_undo_knows_nothing_of_what_keep_did(self):
        """Places where clients have left focus, in any order with those of another program."""
        self.begin(keep=True)
        opens = self.other_program()
        places = list(range(0, 251, 10))
        self.move(before := self.draw.choice(places[2:]))
        self.move(now := self.draw.choice([place for place in places if place != before]))
        for _ in range(UNDONE):
            back = now
            opens(elsewhere := self.draw.choice([place for place in places if place not in (before, now)]))
            # A call that moves nothing, before it is brought back or after.
            calls = self.draw.choices(("", "preset save", "move"), k=2)
            if calls[0]:  # refused while it moves
                self.wait_for(lambda: self.daemon.lensctl("preset", "save", "cam", "any").returncode == 0)
            self.wait_for(lambda: self.device()[FOCUS] == back)
            self.stands_at(back)
            if "preset" in calls[1]:
                self.assertEqual(self.daemon.lensctl("preset", "save", "cam", "any").returncode, 0)
            if calls[1] == "move":
                before, now = now, self.draw.choice([place for place in places if place not in (before, now)])
                self.move(now)
            with self.subTest(before=before, now=now, elsewhere=elsewhere, calls=calls):
                with self.daemon.client() as client:
                    self.assertTrue(client.call(LENS + "Undo", {"lens": "cam"})["parameters"]["undo"]["undone"])
                self.assertEqual(self.device()[FOCUS], before)
                before, now = now, before

    def kept_last(self):
        try:
            with open(os.path.join(self.state, "cam.last.toml"), encoding="utf-8") as file:
                return next(float(line.split("=")[1]) for line in file if line.startswith("focus_steps"))
        except (OSError, StopIteration):
            return None

    def test_a_missing_preset_moves_nothing_and_is_said(self):
        for state in (True, False):
            self.plug(self.draw.randint(1, 250))
            before = self.device()[FOCUS]
            self.begin('start = "preset:desk"\n', state=state)
            self.wait_for(lambda: any("there is no such preset" in one for one in self.status()["warnings"]))
            self.daemon.wait_log('start = "preset:desk"', "nothing was moved", times=1)
            self.assertEqual(self.device()[FOCUS], before)
            self.assertEqual(self.daemon.lensctl("preset", "save", "cam", "desk").returncode, 0)
            self.wait_for(lambda: not self.status()["warnings"])
            self.end()

    def test_keep_brings_focus_back_from_a_program_that_reopens_the_stream(self):
        """Again and again, with its own focus, with the camera's autofocus, or with both."""
        self.begin(keep=True)
        began = time.monotonic()
        self.move(wanted := self.draw.randint(20, 200))
        opens = self.other_program()
        for _ in range(REOPENED):
            opens(*self.draw.choice([("-", "-"), (self.draw.randint(0, 250), 0), ("-", 1)]))
        self.wait_for(lambda: self.device() == {FOCUS: wanted, AUTOFOCUS: 0})
        self.stands_at(wanted)
        self.wait_for(lambda: self.focus()["fault"] is None)
        reports = len(self.lines("external"))
        self.assertLessEqual(reports, 1 + (time.monotonic() - began) / 2)
        self.assertGreater(reports, 0)
        # Once more, each kind alone: nothing was worn out.
        for focus, automatic in ((wanted + 20, "-"), ("-", 1)):  # a step or two may be the scatter of its readings
            opens(focus, automatic)
            self.wait_for(lambda: self.device() == {FOCUS: wanted, AUTOFOCUS: 0})
        self.wait_for(lambda: not self.status()["warnings"])

    def test_without_keep_another_program_has_its_way(self):
        self.begin()
        self.move(100)
        opens = self.other_program()
        opens(30)
        self.wait_for(lambda: self.focus()["position"] == 30)
        self.assertEqual(self.focus()["movedBy"], "external")
        opens("-", 1)
        self.wait_for(lambda: "autofocus" in (self.focus()["fault"] or ""))
        # A client's own move is the newest command: it takes focus from the device again.
        self.move(60)
        self.assertEqual(self.device(), {FOCUS: 60, AUTOFOCUS: 0})

    def test_nothing_moves_under_a_lease(self):
        self.begin(keep=True)
        self.move(100)
        opens = self.other_program()
        with self.daemon.client() as owner:
            self.assertNotIn("error", owner.call(LENS + "TakeLease", {"lens": "cam"}))
            opens(30)
            self.wait_for(lambda: self.focus()["position"] == 30)
            self.looked_at()
            self.assertEqual((self.device()[FOCUS], self.lines("external")), (30, []))
        self.wait_for(lambda: self.device()[FOCUS] == 100)

    def test_nothing_moves_under_a_hold(self):
        self.begin(keep=True)
        self.move(100)
        opens = self.other_program()
        with self.daemon.client() as holder:
            held = holder.call(LENS + "Hold", {"lens": "cam", "untilNs": time.monotonic_ns() + 3000 * 10**9})
            self.assertNotIn("error", held)
            opens(30)
            self.wait_for(lambda: self.focus()["position"] == 30)
            self.looked_at()
            self.assertEqual((self.device()[FOCUS], self.lines("external")), (30, []))
        self.wait_for(lambda: self.device()[FOCUS] == 100)

    def test_what_is_not_brought_back_is_not_said_to_be(self):
        """The place lies outside of what focus may reach by now."""
        self.begin('start = "last"\n', keep=True)
        self.move(self.draw.randint(150, 250))
        self.end()
        self.plug(30)
        self.begin('start = "last"\n', keep=True, limits="limits = [0, 100]\n")
        self.wait_for(lambda: any("keep: the lens is not where it is kept" in one for one in self.status()["warnings"]))
        self.assertEqual((self.device()[FOCUS], self.lines("external")), (30, []))
        self.move(60)
        self.wait_for(lambda: not self.status()["warnings"])

    def test_without_a_state_folder_the_log_says_what_is_forgotten(self):
        self.begin('start = "last"\n', state=False)
        self.daemon.wait_log("without a state folder", times=1)

    def test_what_makes_no_sense_is_refused(self):
        with open(os.path.join(self.folder.name, "c.toml"), "w", encoding="utf-8") as file:
            file.write(f'version = 1\n[[lens]]\nname = "cam"\ndriver = "v4l2"\ndevice = "{self.node}"\nparts = "lens"\n')
        for start, keep, flags, state, status, words in (
                ('"last"', False, 0, True, 0, ""), ('"preset:a b"', True, 0, True, 0, ""), ('"preset:"', False, 0, True, 78, "must name a preset"),
                ('"preset:/x"', False, 0, True, 78, "must name a preset"), ('"lsat"', False, 0, True, 78, "last"),
                ('"last"', False, 0, False, 78, "without a state folder"), ('"preset:desk"', False, 0, False, 78, "without a state folder"),
                ('"keep"', True, 0, False, 0, ""), ('"keep"', True, 0x40, True, 78, "cannot be read back")):
            if not state and os.path.exists("/var/lib/lensd"):
                continue  # this machine has the folder of the service
            with self.subTest(start=start, keep=keep, flags=flags, state=state):
                with open(self.table, "w", encoding="utf-8") as table:
                    table.write(f"009a090a 1 0 250 1 0 0 {flags:x}\n")
                path = os.path.join(self.folder.name, "d.toml")
                with open(os.path.join(self.folder.name, "c.toml"), encoding="utf-8") as file, open(path, "w", encoding="utf-8") as checked:
                    checked.write(file.read() + f"start = {start}\n" + ("[lens.focus]\nkeep = true\n" if keep else ""))
                done = subprocess.run([os.path.join(BIN, "lensd"), "--config", path, "--check-config", *(["--state", self.state] if state else [])],
                                      env={**os.environ, **self.played, "LD_PRELOAD": self.library}, capture_output=True, text=True,
                                      timeout=60 * PATIENCE, check=False)
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertIn(words, done.stderr)


class Simulated(Case):
    """A lens that has to be homed after each loss of power."""

    def begin(self, start, slow=False):
        scene = quick_scene(self.folder.name)
        if slow:  # 40 s from end to end
            with open(scene, encoding="utf-8") as quick, open(os.path.join(self.folder.name, "slow.toml"), "w", encoding="utf-8") as file:
                file.write(quick.read().replace("speed_steps_per_s = 10000", "speed_steps_per_s = 100"))
            scene = file.name
        self.start(f'driver = "sim"\nscene = "{scene}"\n{start}')

    def inject(self, kind, **how):
        with self.daemon.client() as client:
            self.assertEqual(client.call(SIM + "Inject", {"lens": "cam", "kind": kind, **how}), {"parameters": {}})

    def truth(self):
        with self.daemon.client() as client:
            return client.call(SIM + "Truth", {"lens": "cam"})["parameters"]["focusPosition"]

    def saved(self, at):
        """Its preset "desk" is at focus `at`, and lensd has ended."""
        self.begin("")
        self.assertEqual(self.daemon.lensctl("home", "cam").returncode, 0)
        self.move(at)
        self.assertEqual(self.daemon.lensctl("preset", "save", "cam", "desk").returncode, 0)
        self.end()

    def test_it_is_homed_first_whenever_it_comes_back(self):
        self.saved(at=1700)
        for start in ('start = "preset:desk"\n', 'start = "last"\n'):
            self.begin(start)
            if "last" in start:
                self.assertEqual(self.daemon.lensctl("home", "cam").returncode, 0)
                self.move(1700)
            self.stands_at(1700)
            for outage in ({}, {"forMs": 20}):
                with self.subTest(start=start, outage=outage):
                    told = len(self.lines("start: the lens is"))
                    self.inject("disconnect", **outage)
                    if not outage:
                        self.wait_for(lambda: self.status()["connection"] == "absent")
                        self.inject("jump", axis="focus", steps=-self.draw.randint(100, 900))
                        self.inject("reconnect")
                    self.wait_for(lambda: len(self.lines("start: the lens is")) > told)
                    self.stands_at(1700)
                    self.assertAlmostEqual(self.truth(), 1700, delta=CREEP)
            self.end()

    def test_a_client_that_moves_stops_or_leases_it_wins(self):
        self.saved(at=4000)
        for what in ("Move", "Stop", "Stop for good"):
            with self.subTest(what=what):
                self.begin('start = "preset:desk"\n', slow=True)
                with self.daemon.client() as client:
                    self.wait_for(lambda: self.status()["activity"] != "idle" or self.lines("start:"))
                    self.assertEqual(self.lines("start: the lens is"), [])
                    if what == "Move":
                        target = {"position": self.draw.randint(5, 60)}
                        reply = client.call(LENS + "Move", {"lens": "cam", "axis": "focus", "target": target})
                        # A client may come before the lens has its reference: then it hears so, and the search has been ended.
                        self.assertTrue(reply.get("error") == LENS + "NotHomed" or reply["parameters"]["move"]["reached"], reply)
                    else:
                        self.assertNotIn("error", client.call(LENS + "Stop", {"lens": "cam", "latch": "good" in what}))
                    self.wait_for(lambda: self.status()["activity"] == "idle")
                    stood = self.focus()["position"]
                    self.daemon.wait_log("start: given up", times=1)
                    self.looked_at()
                    self.assertEqual((self.focus()["position"], self.status()["activity"]), (stood, "idle"))
                    self.assertEqual(self.status()["warnings"], [])
                self.end()


    def test_under_a_lease_it_waits(self):
        self.saved(at=1700)
        self.begin('start = "preset:desk"\n')
        self.stands_at(1700)
        with self.daemon.client() as owner:
            self.inject("disconnect")
            self.wait_for(lambda: self.status()["connection"] == "absent")
            self.assertNotIn("error", owner.call(LENS + "TakeLease", {"lens": "cam"}))
            self.inject("reconnect")
            self.wait_for(lambda: self.status()["connected"])
            self.inject("jump", axis="focus", steps=-500)
            self.looked_at()
            self.assertAlmostEqual(self.truth(), 1200, delta=CREEP)
            self.assertFalse(self.focus()["homed"])
        self.stands_at(1700)
        self.assertAlmostEqual(self.truth(), 1700, delta=CREEP)


class Counting(Case):
    """A motor that counts its steps and has no reference."""

    def setUp(self):
        super().setUp()
        self.drive = CountingDrive(shaft=20000)
        self.addCleanup(self.drive.close)
        self.drive.get_power(20000)

    def begin(self, keys="", keep=False, backlash=0):
        profile = os.path.join(self.folder.name, "drive.toml")
        with open(profile, "w", encoding="utf-8") as file:
            file.write(PROFILE)
        self.start(f'driver = "modbus"\nbus = "b"\n{keys}[lens.drives.focus]\nunit = 1\nprofile = "{profile}"\nrange = [0, 30000]\n'
                   f'[lens.focus]\nkeep = {str(keep).lower()}\nbacklash = {backlash}\n',
                   head=f'[[bus]]\nname = "b"\ndriver = "modbus"\nhost = "127.0.0.1:{self.drive.port}"\nresponse_timeout_ms = 300\n')
        self.wait_for(lambda: self.status()["connected"])

    def kill(self):
        daemon, self.daemon = self.daemon, None
        daemon.kill()

    def loses_power(self):
        self.drive.lose_power()
        self.wait_for(lambda: not self.status()["connected"])
        self.drive.get_power(0)
        self.wait_for(lambda: self.status()["connected"])

    def other_program_moves(self, shaft):
        with self.drive.lock:
            self.drive.way = (self.drive.place(), float(shaft), time.monotonic())

    def test_one_whose_place_is_not_known_does_not_move(self):
        self.begin('start = "last"\n', keep=True)
        self.move(21000)
        self.loses_power()
        self.wait_for(lambda: any("start" in one for one in self.status()["warnings"]))
        self.assertTrue(self.focus()["positionUnknown"])
        self.assertAlmostEqual(self.drive.shaft(), 21000, delta=1)
        self.looked_at()
        self.assertEqual(self.lines("external"), [])  # nobody has moved it

    def test_where_somebody_says_that_it_stands_it_stays(self):
        """Whatever was before: nothing moves, what was complained of is over, and `keep` goes by what was said."""
        for number in range(SAID):
            start = self.draw.choice(("", 'start = "keep"\n', 'start = "last"\n'))
            keep, backlash = self.draw.random() < 0.7, self.draw.choice((0, 0, 60))
            before = self.draw.choice(("nothing", "end", "kill", "power cut", "power cut", "outage"))
            if number == 0:  # whatever is drawn
                start, keep, before = 'start = "last"\n', True, "power cut"
            with self.subTest(number=number, start=start, keep=keep, backlash=backlash, before=before):
                self.says_where_it_stands(start, keep, backlash, before)

    def says_where_it_stands(self, start, keep, backlash, before):
        self.begin(start, keep, backlash)
        self.here(self.draw.randint(9000, 21000))
        self.move(self.focus()["position"] + self.draw.choice((-1, 1)) * self.draw.randint(500, 4000))
        if before in ("end", "kill", "power cut"):
            (self.end if before == "end" else self.kill)()
            if before == "power cut":
                self.drive.lose_power()
                self.drive.get_power(0)
            self.begin(start, keep, backlash)
        elif before == "outage":
            self.loses_power()
        if "cut" in before or "outage" in before:
            self.wait_for(lambda: self.focus()["positionUnknown"])
            if "last" in start:
                self.wait_for(lambda: any("start" in one for one in self.status()["warnings"]))
            if self.draw.random() < 0.5:  # a command of a client ends the complaint too
                self.assertEqual(self.daemon.lensctl("focus", f"{self.draw.choice('+-')}{self.draw.randint(1, 500)}").returncode, 0)
                self.wait_for(lambda: not self.status()["warnings"])
        stood, reports = self.drive.shaft(), len(self.lines("external"))
        self.assertEqual(reports, 0)
        self.here(said := self.draw.randint(0, 30000))
        self.looked_at()
        now = self.focus()
        self.assertEqual((now["position"], now["homed"], self.drive.shaft(), self.status()["warnings"]), (said, True, stood, []))
        self.assertEqual(len(self.lines("external")), reports)
        self.other_program_moves(stood + self.draw.choice((-1, 1)) * self.draw.randint(500, 1000))
        self.wait_for(lambda: self.focus()["movedBy"] == "external" or self.lines("external"))
        if keep:
            self.wait_for(lambda: self.drive.shaft() == stood)
            self.stands_at(said)
            self.wait_for(lambda: self.lines("external"))  # said once it is there
        else:
            self.assertEqual(self.lines("external"), [])
        self.end()

    def here(self, place):
        """Where its count is in doubt, or it has just moved, that is to be said again in a while."""
        self.wait_for(lambda: self.daemon.lensctl("here", "focus", f"@{place}").returncode == 0)


if __name__ == "__main__":
    unittest.main()
