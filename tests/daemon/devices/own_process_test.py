"""process = "own": what lensd drives through a driver's process goes as it does inside, the end of that process costs its lens
alone, and the end of lensd stops what moves."""
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from event_stream import Stream  # noqa: E402
from harness import BIN, HERE, LENS, PATIENCE, Daemon, driver_processes  # noqa: E402

LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"
DEATHS = 40 if LONG else 2
FAR = 60000  # a minute away: what stands short of it was stopped
LENS_ON_A_BUS = """[[bus]]
name = "bus-{name}"
driver = "modbus"
host = "{host}"
response_timeout_ms = {timeout}
[[lens]]
name = "{name}"
driver = "modbus"
bus = "bus-{name}"
{process}
[lens.drives.focus]
unit = 1
profile = "{profile}"
range = [0, 60000]
parameters = {{ speed = {speed} }}
"""


class Pipe:
    """A program that answers each line with a line; its first line says where it listens."""

    def __init__(self, *command):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.host = self.process.stdout.readline().strip().removeprefix("listening on ")

    def tell(self, words):
        self.process.stdin.write(words + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def close(self):
        self.process.kill()
        self.process.wait(timeout=30)
        self.process.stdin.close()
        self.process.stdout.close()


class Drive(Pipe):
    """One drive of the family Oriental AZ."""
    profile, speed = "oriental-az", 1000

    def __init__(self):
        super().__init__(os.path.join(BIN, "sim-modbus-drive"), "--tcp", "0", "--unit", "1")

    def place(self):
        return int(self.tell("position 1"))


class MuteDrive(Pipe):
    """A drive that may leave questions unanswered, and obeys all the same."""
    profile, speed = "generic", 100

    def __init__(self):
        super().__init__(sys.executable, os.path.join(HERE, "..", "drivers", "modbus", "busy_drive.py"), "0", "6", "0")
        self.host = "127.0.0.1:" + self.host

    def place(self):
        return int(self.tell("where").split()[0])


class OwnProcessTest(unittest.TestCase):
    def start(self, drives, process=()):
        """lensd with a lens a drive; those named in `process` have a process of their own."""
        runtime = tempfile.TemporaryDirectory(prefix="lensd-run-")
        self.addCleanup(runtime.cleanup)
        self.runtime = runtime.name
        text = "version = 1\n"
        for name, drive in drives.items():
            self.addCleanup(drive.close)
            own = 'process = "own"' if name in process else ""
            text += LENS_ON_A_BUS.format(name=name, host=drive.host, process=own, profile=drive.profile, speed=drive.speed,
                                         timeout=500 if drive.profile == "generic" else 300)
        # The first of these that is set is where lensd puts its sockets.
        self.daemon = Daemon(config=text, environment={"RUNTIME_DIRECTORY": self.runtime})
        self.addCleanup(lambda: self.daemon.folder.cleanup())
        self.addCleanup(lambda: self.daemon.process.poll() is None and self.daemon.stop())
        return self.daemon

    def end(self):
        """lensd ends in peace, and leaves no process and no file behind."""
        hosts = driver_processes(self.daemon)
        self.assertEqual(self.daemon.stop(), 0)
        self.assertEqual([number for number in hosts if os.path.exists(f"/proc/{number}/exe")], [])
        self.assertEqual(os.listdir(self.runtime), [])

    def status(self, lens):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]

    def host(self):
        """The one driver process, once there is one."""
        self.wait_for(lambda: len(driver_processes(self.daemon)) == 1)
        return driver_processes(self.daemon)[0]

    def wait_for(self, condition, seconds=20):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened: " + self.daemon.log())
            time.sleep(0.01)

    def wait_until_connected(self, lens):
        self.wait_for(lambda: self.status(lens)["connected"])

    def begin(self, client, lens, target):
        client.send(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": target}})

    def move(self, lens, target):
        with self.daemon.client() as client:
            self.begin(client, lens, target)
            return client.receive()["parameters"]

    def home(self, *lenses):
        with self.daemon.client() as client:
            for lens in lenses:
                homed = client.call(LENS + "Home", {"lens": lens, "axis": "focus"})
                self.assertTrue(homed["parameters"]["moves"][0]["reached"], homed)

    def rests_short_of_the_target(self, drive):
        """The place where its shaft has come to rest."""
        places = [-1]

        def rests():
            places.append(drive.place())
            time.sleep(0.1)
            return places[-1] == places[-2]

        self.wait_for(rests)
        self.assertLess(places[-1], FAR)
        return places[-1]

    def test_a_lens_in_a_process_goes_like_one_inside(self):
        drives = {"one": Drive(), "inner": Drive()}
        daemon = self.start(drives, {"one"})
        self.wait_until_connected("one")
        with daemon.client() as client:
            listed = {lens["name"]: lens for lens in client.call(LENS + "List")["parameters"]["lenses"]}
        self.assertEqual(set(listed), set(drives))
        for what in ("driver", "model", "axes"):
            self.assertEqual(listed["one"][what], listed["inner"][what])
        for lens, process in (("one", self.host()), ("inner", None)):
            for said in (listed[lens], self.status(lens)):
                self.assertEqual((said["process"], said["cameraProcess"]), (process, None))
        lines = daemon.lensctl("list").stdout.splitlines()
        self.assertEqual([f"(driver in process {self.host()})" in line for line in lines],
                         [line.startswith("one:") for line in lines])
        self.home("one", "inner")
        for lens, drive in drives.items():
            moved = self.move(lens, 321)["move"]
            self.assertTrue(moved["reached"] and moved["verified"], moved)
            self.assertEqual(drive.place(), 321)
            with daemon.client() as client, daemon.client() as other:
                self.begin(client, lens, FAR)
                self.wait_for(lambda drive=drive: drive.place() > 400)
                self.assertEqual(other.call(LENS + "Stop", {"lens": lens}), {"parameters": {}})
                self.assertEqual(client.receive()["error"], LENS + "Cancelled")
            self.rests_short_of_the_target(drive)
        self.end()

    def test_a_stop_passes_a_reading_that_hangs(self):
        drive = MuteDrive()
        daemon = self.start({"one": drive}, {"one"})
        self.wait_until_connected("one")
        with daemon.client() as client, daemon.client() as other:
            self.begin(client, "one", FAR)
            self.wait_for(lambda: drive.place() > 100)
            drive.tell("busy 0 -1 reads 1")  # no reading is answered from now on
            before = drive.place()
            self.wait_for(lambda: drive.place() > before)
            other.send(LENS + "Stop", {"lens": "one"})
            self.rests_short_of_the_target(drive)
            drive.tell("busy 0 0 reads 1")
            other.receive()
            client.receive()
        self.wait_until_connected("one")
        self.assertTrue(self.move("one", 50)["move"]["reached"])
        self.end()

    def test_a_process_that_dies_costs_its_lens_alone(self):
        drives = {"one": Drive(), "inner": Drive()}
        daemon = self.start(drives, {"one"})
        self.home("one", "inner")
        with daemon.client() as mover, daemon.client() as other, Stream(daemon, lens="one") as events:
            self.begin(other, "inner", 3000)
            self.begin(mover, "one", FAR)
            self.wait_for(lambda: drives["one"].place() > 50)
            dead = self.host()
            os.kill(dead, signal.SIGKILL)
            answer = mover.receive()
            self.assertEqual(answer["error"], LENS + "Disconnected")
            self.assertIn("the driver ended: signal 9 in ", answer["parameters"]["message"])
            self.assertEqual(events.of("list", change="gone")["connection"], "absent")
            events.of("list", change="opened")
            self.assertEqual(self.status("one")["process"], self.host())
            self.assertNotEqual(self.host(), dead)
            # Its motor ran on, and the next process has stopped it; where it stands the drive knows.
            self.assertGreater(self.rests_short_of_the_target(drives["one"]), 50)
            self.assertTrue(self.move("one", 10)["move"]["reached"])
            deaths = 1 + self.die_again_and_again()
            moved = other.receive()["parameters"]["move"]
            self.assertTrue(moved["reached"], moved)
        self.assertEqual([line for line in daemon.log().splitlines() if "inner" in line and "ended" in line], [])
        daemon.wait_log("warning one: the driver ended: signal 9", times=deaths)
        self.end()

    def die_again_and_again(self):
        """Each time the pause before the next process is longer, unless one has worked for 10 s."""
        expected, pauses = 0, []
        born = None
        for _ in range(DEATHS):
            self.wait_until_connected("one")
            host = self.host()
            if born is not None and time.monotonic() - born > 9:
                break  # on a machine so slow that it may have worked for 10 s
            killed = time.monotonic()
            os.kill(host, signal.SIGKILL)
            self.wait_for(lambda gone=host: [one for one in driver_processes(self.daemon) if one != gone], 40)
            born = time.monotonic()
            pauses.append(born - killed)
            expected = min(2 * expected, 10) or 0.25
            self.assertGreater(pauses[-1], expected, pauses)
        print("pauses before the next process: " + ", ".join(f"{pause:.2f} s" for pause in pauses), file=sys.stderr)
        self.wait_until_connected("one")
        return len(pauses)

    def test_the_end_of_lensd_is_the_end_of_its_motors(self):
        drive = Drive()
        daemon = self.start({"one": drive}, {"one"})
        self.home("one")
        with daemon.client() as mover:
            self.begin(mover, "one", FAR)
            self.wait_for(lambda: drive.place() > 50)
            host = os.pidfd_open(self.host())
            self.addCleanup(os.close, host)
            daemon.process.kill()
            killed = time.monotonic()
            daemon.process.wait(timeout=30)
            self.assertTrue(select.select([host], [], [], 2 * PATIENCE)[0], "the driver's process lives on")
        print(f"a driver's process ended {time.monotonic() - killed:.2f} s after lensd", file=sys.stderr)
        self.rests_short_of_the_target(drive)
        daemon.errors.close()

    def test_motors_that_nobody_stopped_are_stopped_through_a_process(self):
        drive = Drive()
        daemon = self.start({"one": drive}, {"one"})
        self.home("one")
        with daemon.client() as mover:
            self.begin(mover, "one", FAR)
            self.wait_for(lambda: drive.place() > 50)
            host = self.host()
            os.kill(daemon.process.pid, signal.SIGSTOP)  # so that it starts no other
            os.kill(host, signal.SIGKILL)
            daemon.process.kill()
            daemon.process.wait(timeout=30)
        before = drive.place()
        self.wait_for(lambda: drive.place() > before)
        command = [os.path.join(BIN, "lensd"), "--config", daemon.config, "--stop-motors"]
        environment = {**os.environ, "RUNTIME_DIRECTORY": self.runtime}
        # It gives every lens 2 s, which a process under a sanitizer may need to start.
        self.wait_for(lambda: subprocess.run(command, check=False, timeout=60, env=environment).returncode == 0, 30)
        self.rests_short_of_the_target(drive)
        daemon.errors.close()

    @unittest.skipUnless(LONG, "takes 8 s and more")
    def test_a_process_that_is_frozen_is_ended(self):
        drives = {"one": Drive(), "inner": Drive()}
        daemon = self.start(drives, {"one"})
        self.home("one", "inner")
        frozen = self.host()
        os.kill(frozen, signal.SIGSTOP)
        self.wait_for(lambda: not self.status("one")["connected"])
        daemon.wait_log("one", "the driver has not answered for 8 s in ", "and was ended")
        self.wait_until_connected("one")
        self.assertNotEqual(self.host(), frozen)
        self.assertTrue(self.move("one", 100)["move"]["reached"])
        self.end()


class Configurations(unittest.TestCase):
    def check(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "lensd.toml")
            with open(path, "w", encoding="utf-8") as file:
                file.write("version = 1\n" + text)
            done = subprocess.run([os.path.join(BIN, "lensd"), "--check-config", "--config", path], capture_output=True, text=True,
                                  check=False, timeout=60)
        return done.returncode, (done.stdout + done.stderr).replace(folder + "/", "")

    def test_what_process_cannot_be(self):
        scene = os.path.join(HERE, "small.toml")
        for word, why in (("own", "the simulator always runs inside lensd"), ("owm", "must be one of inside, own")):
            status, said = self.check(f'[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\nprocess = "{word}"\n')
            self.assertEqual(status, 78, said)
            self.assertIn("lensd.toml:6:", said)
            self.assertIn(why, said)

    def test_lenses_on_a_bus_have_one_master(self):
        lens = ('[[lens]]\nname = "{0}"\ndriver = "modbus"\nbus = "b"\n{1}\n[lens.drives.focus]\nunit = {2}\nprofile = "generic"\n'
                'range = [0, 100]\n')
        bus = '[[bus]]\nname = "b"\ndriver = "modbus"\nhost = "127.0.0.1:1"\n'
        status, said = self.check(bus + lens.format("x", 'process = "own"', 1) + lens.format("y", "", 2))
        self.assertEqual(status, 78, said)
        self.assertIn('lensd.toml:15: lenses on one bus have the same process: lens "y" has "inside", and lens "x" on this bus has '
                      '"own"\n', said)
        status, said = self.check(bus + lens.format("x", "", 1) + lens.format("y", 'process = "own"', 2))
        self.assertIn("lensd.toml:19: lenses on one bus have", said)


if __name__ == "__main__":
    unittest.main()
