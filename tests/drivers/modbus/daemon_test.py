"""A lens of three drives on one bus through lensd and lensctl: home, move, alarms, a pulled cable."""
import json
import os
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "daemon"))
from harness import BIN, LENS, PATIENCE, Daemon  # noqa: E402


class Simulator:
    """sim-modbus-drive with its command line."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([os.path.join(BIN, "sim-modbus-drive"), *arguments], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        self.greeting = self.process.stdout.readline().strip()

    def tell(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def close(self):
        self.process.stdin.write("quit\n")
        self.process.stdin.close()
        self.process.wait(timeout=30)
        self.process.stdout.close()


CONFIG = """version = 1
[[bus]]
name = "rs485"
driver = "modbus"
{wire}
response_timeout_ms = 300
[[lens]]
name = "ring"
driver = "modbus"
bus = "rs485"
[lens.drives.focus]
unit = 1
profile = "{focus}"
range = [0, 20000]
{parameters}
[lens.drives.iris]
unit = 2
profile = "{focus}"
range = [0, 4000]
{parameters}
[lens.drives.zoom]
unit = 3
profile = "{focus}"
range = [-500, 5000]
{parameters}
"""
FAST_AZ = "parameters = { speed = 10000, start_rate = 500000, stop_rate = 500000 }"


class AnyWire:
    """Over one wire or the other."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.simulator, wire = self.start()
        self.addCleanup(self.simulator.close)
        self.daemon = Daemon(config=CONFIG.format(wire=wire, focus="oriental-az", parameters=FAST_AZ))
        self.addCleanup(self.daemon.stop)

    def lensctl(self, *arguments, status=0):
        done = self.daemon.lensctl(*arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def axis(self, name="focus"):
        with self.daemon.client() as client:
            lens = client.call(LENS + "Status", {"lens": "ring"})["parameters"]["lenses"][0]
        return next((axis for axis in lens["axes"] if axis["axis"] == name), None), lens

    def wait_for(self, condition, seconds=10):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened: " + self.daemon.log())
            time.sleep(0.02)

    def test_moves_want_a_reference_and_then_go_where_they_are_told(self):
        self.assertIn("home", self.lensctl("focus", "@100", status=7))
        self.lensctl("home")
        moved = json.loads(self.lensctl("focus", "@5000", "--json"))
        self.assertTrue(moved["reached"] and moved["verified"])
        self.assertEqual(moved["position"], 5000)
        self.assertEqual(self.simulator.tell("position 1"), "5000")
        with self.daemon.client() as client:
            iris = client.call(LENS + "Move", {"axis": "iris", "target": {"position": 1234}})["parameters"]["move"]
        self.assertTrue(iris["reached"])
        self.assertEqual(self.simulator.tell("position 2"), "1234")
        self.assertEqual(self.simulator.tell("position 1"), "5000")

    def test_without_optics_every_axis_goes_by_its_steps(self):
        self.lensctl("home")
        for command, axis, unit in (("focus", "focus", 1), ("aperture", "iris", 2), ("zoom", "zoom", 3)):
            for words, there in (("@1200", 1200), ("+34", 1234), ("-200.0", 1034), ("@0", 0)):
                moved = json.loads(self.lensctl(command, "ring", words, "--json"))
                self.assertEqual((moved["axis"], moved["reached"], moved["position"]), (axis, True, there))
                self.assertEqual(self.simulator.tell(f"position {unit}"), str(there))
            self.assertIn("steps", self.lensctl(command, "@6000000", status=6))
            self.lensctl(command, "@", status=64)
            self.lensctl(command, "+5x", status=64)
        self.lensctl("zoom", "@-500")
        self.assertEqual(self.simulator.tell("position 3"), "-500")
        self.assertIn("f-numbers", self.lensctl("aperture", "2.8", status=8))

    def test_stop_ends_a_move(self):
        self.lensctl("home")
        with self.daemon.client() as mover:
            mover.send(LENS + "Move", {"axis": "focus", "target": {"position": 20000}})
            self.wait_for(lambda: self.axis()[0]["position"] > 100)
            self.lensctl("stop")
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
        self.wait_for(lambda: not self.axis()[0]["moving"])
        self.assertLess(int(self.simulator.tell("position 1")), 20000)

    def test_after_a_kill_in_mid_move_the_motors_are_stopped(self):
        self.lensctl("home")
        with self.daemon.client() as mover:
            mover.send(LENS + "Move", {"axis": "focus", "target": {"position": 20000}})
            self.wait_for(lambda: int(self.simulator.tell("position 1")) > 100)
            self.daemon.process.kill()
            self.daemon.process.wait(timeout=30)
        self.assertLess(int(self.simulator.tell("position 1")), 20000)
        command = [os.path.join(BIN, "lensd"), "--config", self.daemon.config, "--stop-motors"]
        ended_well = subprocess.run(command, env={**os.environ, "SERVICE_RESULT": "success"}, check=False, timeout=30)
        self.assertEqual(ended_well.returncode, 0)
        before = int(self.simulator.tell("position 1"))
        self.wait_for(lambda: int(self.simulator.tell("position 1")) > before)  # nothing has stopped it yet
        began = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(time.monotonic() - began, 0.5 * PATIENCE)
        places = [-1]

        def rests():
            places.append(int(self.simulator.tell("position 1")))
            time.sleep(0.1)
            return places[-1] == places[-2]

        self.wait_for(rests)
        self.assertLess(places[-1], 20000)
        self.assertGreater(places[-1], 0)

    def test_an_alarm_has_a_name_and_goes_on_request(self):
        self.lensctl("home")
        self.simulator.tell("alarm 1 0x30")
        self.wait_for(lambda: self.axis()[0]["fault"] == "alarm 0x30: overload")
        self.assertIn("overload", self.lensctl("focus", "@200", status=8))
        self.assertEqual(self.axis("iris")[0]["fault"], None)
        self.lensctl("call", LENS + "ResetFaults", '{"axis": "focus"}')
        self.wait_for(lambda: self.axis()[0]["fault"] is None)
        self.lensctl("focus", "@200")

    def test_a_drive_that_ignores_its_commands_is_not_said_to_have_obeyed(self):
        self.lensctl("home")
        self.simulator.tell("ignore 1 1000")
        self.assertIn("does not move", self.lensctl("focus", "@300", status=1))
        self.simulator.tell("ignore 1 0")
        self.lensctl("focus", "@300")

    def test_a_pulled_cable_and_its_return(self):
        self.lensctl("home")
        self.simulator.tell("unplug")
        self.wait_for(lambda: not self.axis()[1]["connected"])
        self.lensctl("focus", "@100", status=69)
        self.simulator.tell("plug")
        began = time.monotonic()
        self.wait_for(lambda: self.axis()[1]["connected"])
        print(f"answers again {time.monotonic() - began:.2f} s after its return")
        self.lensctl("focus", "@100")


class Tcp(AnyWire, unittest.TestCase):
    def start(self):
        simulator = Simulator("--tcp", "0", "--unit", "1", "--unit", "2", "--unit", "3")
        return simulator, f'host = "{simulator.greeting.removeprefix("listening on ")}"'


class Rtu(AnyWire, unittest.TestCase):
    def start(self):
        port = os.path.join(self.folder.name, "port")
        simulator = Simulator("--rtu", port, "--unit", "1", "--unit", "2", "--unit", "3")
        return simulator, f'device = "{port}"'


class Configurations(unittest.TestCase):

    def check(self, text):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "lensd.toml")
            with open(os.path.join(folder, "mine.toml"), "w", encoding="utf-8") as profile:
                profile.write('version = 1\nname = "mine"\nbogus = 1\n[status]\naddress = 1\nmoving = 0\n[position]\naddress = 2\n'
                              '[[move]]\naddress = 4\nvalues = ["s32 target"]\n')
            with open(os.path.join(folder, "narrow.toml"), "w", encoding="utf-8") as profile:
                profile.write('version = 1\nname = "narrow"\nhoming = "not-needed"\n[status]\naddress = 1\nmoving = 0\n[position]\naddress = 2\n'
                              'type = "u16"\n[[move]]\naddress = 4\nvalues = ["s32 target"]\n[[stop]]\naddress = 7\nvalues = [1]\n')
            with open(file, "w", encoding="utf-8") as out:
                out.write(text)
            return subprocess.run([os.path.join(BIN, "lensd"), "--config", file, "--check-config"], capture_output=True,
                                  text=True, timeout=60 * PATIENCE, check=False)

    def test_what_is_wrong_is_told_with_its_place(self):
        good = CONFIG.format(wire='host = "127.0.0.1:1"', focus="moons", parameters="")
        for before, after, place, words in (
                ('"rs485"\n[lens.drives.focus]', '"other"\n[lens.drives.focus]', "lensd.toml:10", "no [[bus]] named"),
                ('profile = "moons"', 'profile = "moon"', "lensd.toml:13", "oriental-az"),
                ('profile = "moons"', 'profile = "none.toml"', "lensd.toml:13", "none.toml"),
                ('profile = "moons"', 'profile = "mine.toml"', "mine.toml:3", "bogus"),
                ("unit = 2", "unit = 1", "lensd.toml:", "already"),
                ("unit = 2", "unit = 300", "lensd.toml:", "247"),
                ("range = [0, 4000]", "", "lensd.toml:", "range"),
                ("range = [0, 4000]", "range = [0, 3000000000]", "lensd.toml:", "s32 by its profile"),
                ('profile = "moons"\nrange = [0, 20000]', 'profile = "narrow.toml"\nrange = [0, 65536]', "lensd.toml:14",
                 "u16 by its profile"),
                ('profile = "moons"\nrange = [0, 20000]', 'profile = "narrow.toml"\nrange = [-1, 100]', "lensd.toml:14",
                 "u16 by its profile"),
                ('profile = "moons"\nrange = [0, 20000]', 'profile = "narrow.toml"\nscale = 0.5\nrange = [0, 40000]', "lensd.toml:15",
                 "u16 by its profile"),
                ("range = [0, 4000]", "range = [0, 4000]\nbogus = 1", "lensd.toml:", "bogus"),
                ("range = [0, 4000]", "range = [0, 4000]\nparameters = { sped = 1 }", "lensd.toml:", "speed"),
                ('driver = "modbus"\nhost', 'driver = "sim"\nhost', "lensd.toml:4", "no buses"),
                ('host = "127.0.0.1:1"', 'host = "127.0.0.1:1"\nbaud = 9600', "lensd.toml:6", "baud"),
                ('host = "127.0.0.1:1"', "", "lensd.toml:2", "device")):
            with self.subTest(after=after):
                self.assertIn(before, good)
                done = self.check(good.replace(before, after, 1))
                self.assertEqual((done.returncode, done.stderr.count("\n")), (78, 1), done.stderr)
                self.assertIn(place, done.stderr)
                self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
