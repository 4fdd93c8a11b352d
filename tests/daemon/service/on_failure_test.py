"""The command that a configuration gives for failures: what it is told, one at a time, ended in time, and never in the way."""
import json
import os
import signal
import stat
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, PATIENCE, Daemon  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")
SIMULATOR = "io.lensd.Simulator."


class OnFailureTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-failure-")
        self.addCleanup(self.folder.cleanup)
        self.told = os.path.join(self.folder.name, "told")

    def script(self, text, name="tell"):
        path = os.path.join(self.folder.name, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\n" + text)
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def config(self, command):
        lens = f'driver = "sim"\nscene = "{SCENE}"\n'
        return f'version = 1\n[[lens]]\nname = "a"\n{lens}on_failure = {command}\n[[lens]]\nname = "b"\n{lens}'

    def start(self, command):
        self.daemon = Daemon(config=self.config(command))
        self.addCleanup(self.finish)
        return self.daemon

    def finish(self):
        if self.daemon.process.poll() is None:
            self.assertEqual(self.daemon.stop(), 0)

    def events(self):
        if not os.path.exists(self.told):
            return []
        with open(self.told, encoding="utf-8") as file:
            return [json.loads(line) for line in file.read().splitlines() if line]

    def wait_for(self, condition, seconds=20):
        deadline = time.monotonic() + seconds * PATIENCE
        while not (got := condition()):
            self.assertLess(time.monotonic(), deadline, self.daemon.log())
            time.sleep(0.01)
        return got

    def fault(self, client, lens="a", **fault):
        self.assertEqual(client.call(SIMULATOR + "Inject", {"lens": lens, **fault}), {"parameters": {}})

    def miss(self, client, lens="a"):
        """A move that stalls."""
        self.fault(client, lens, kind="stall")
        moved = client.call(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": 3000}})
        self.assertFalse(moved["parameters"]["move"]["reached"])
        self.fault(client, lens, kind="stall", forMs=1)
        return moved["parameters"]["move"]

    def losses(self, client, count):
        """The lens is gone and comes back so often."""
        for _ in range(count):
            self.fault(client, kind="disconnect")
            self.wait_for(lambda: not self.status(client)["connected"])
            self.fault(client, kind="reconnect")
            self.wait_for(lambda: self.status(client)["connected"])

    def status(self, client, lens="a"):
        return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]

    def counts(self, client):
        return client.call(LENS + "Metrics")["parameters"]["daemon"]

    def test_it_reads_what_happened_and_only_of_its_lens(self):
        with self.start(f'"{self.script(f"cat >> {self.told}")}"').client() as client:
            began = time.time()
            self.miss(client, "b")
            moved = self.miss(client)
            self.wait_for(lambda: any(each["event"] == "moveFailed" for each in self.events()))
            event = next(each for each in self.events() if each["event"] == "moveFailed")
            self.assertEqual((event["version"], event["lens"], event["axis"], event["event"], event["severity"]),
                             (1, "a", "focus", "moveFailed", "warning"))
            self.assertIn(moved["reason"], event["message"])
            self.assertEqual(event["leftOut"], 0)
            self.assertLess(abs(event["atNs"] - time.monotonic_ns()), 60e9 * PATIENCE)
            self.assertRegex(event["time"], r"^20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            self.assertGreaterEqual(event["time"], time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(began)))
            self.losses(client, 1)
            self.wait_for(lambda: any(each["event"] == "lensLost" for each in self.events()))
            self.assertEqual({each["lens"] for each in self.events()}, {"a"})
            self.wait_for(lambda: self.counts(client)["failuresTold"] == len(self.events()))
            self.assertEqual(self.counts(client)["failuresNotTold"], 0)

    def test_a_list_is_a_program_and_its_arguments_and_no_shell(self):
        script = self.script(f'printf "%s|" "$@" >> {self.told}; echo >> {self.told}')
        with self.start(f"['{script}', 'two words', '$HOME;true', '*']").client() as client:
            self.miss(client)
            self.wait_for(lambda: self.told_text().endswith("\n"))  # printf and echo write one after the other
        with open(self.told, encoding="utf-8") as file:
            self.assertEqual(file.readline(), "two words|$HOME;true|*|\n")

    def test_one_at_a_time_and_the_loop_does_not_wait(self):
        busy = os.path.join(self.folder.name, "busy")
        text = f"mkdir {busy} || echo '\"both at once\"' >> {self.told}\nsleep 1\ncat >> {self.told}\nrmdir {busy}\n"
        with self.start(f'"{self.script(text)}"').client() as client:
            self.losses(client, 3)
            slowest = 0.0
            while len(self.events()) < 3:
                began = time.monotonic()
                self.status(client)
                slowest = max(slowest, time.monotonic() - began)
                time.sleep(0.01)
            self.assertNotIn("both at once", self.events())
            self.assertLess(slowest, 0.8 * max(1, PATIENCE / 3))  # a script takes a second

    def test_what_takes_too_long_is_ended_with_all_that_it_began(self):
        pids = os.path.join(self.folder.name, "pids")
        text = f"sleep 1000 &\necho $! > {pids}.new; echo $$ >> {pids}.new; mv {pids}.new {pids}\nwait\n"
        with self.start(f'"{self.script(text)}"').client() as client:
            self.losses(client, 1)
            self.wait_for(lambda: os.path.exists(pids))
            with open(pids, encoding="ascii") as file:
                numbers = [int(line) for line in file]
            self.assertEqual(os.getpgid(numbers[0]), numbers[1])  # a group of its own
            self.assertNotEqual(os.getpgid(numbers[1]), os.getpgid(self.daemon.process.pid))
            self.wait_for(lambda: "took too long" in self.daemon.log(), 30)
            self.wait_for(lambda: not any(self.runs(number) for number in numbers))
            self.wait_for(lambda: self.counts(client)["failuresNotTold"] == 1)  # counted after the line is logged

    @staticmethod
    def runs(number):
        try:
            with open(f"/proc/{number}/stat", encoding="ascii") as file:
                return file.read().rsplit(")", 1)[1].split()[0] != "Z"
        except (FileNotFoundError, ProcessLookupError):
            return False

    def test_too_many_are_left_out_and_counted(self):
        with self.start(f'"{self.script(f"cat >> {self.told}")}"').client() as client:
            self.losses(client, 14)
            self.wait_for(lambda: self.counts(client)["failuresDropped"] >= 4)
            self.wait_for(lambda: len(self.events()) == 10)
            counts = self.counts(client)
            self.wait_for(lambda: counts["failuresTold"] + counts["failuresDropped"] == self.daemon.log().count("warning a: "))
            self.assertEqual(len(self.events()), 10)

    def test_one_that_fails_or_is_not_there_is_told_in_the_log(self):
        with self.start(f'"{self.script("exit 3")}"').client() as client:
            self.losses(client, 1)
            self.wait_for(lambda: "ended with status 3" in self.daemon.log())
            with open(self.daemon.config, "w", encoding="utf-8") as file:
                file.write(self.config('"missing"'))
            reloaded = json.loads(self.daemon.lensctl("reload", "--json").stdout)
            self.assertEqual(reloaded["unchanged"], ["a", "b"])  # it takes effect without that
            self.losses(client, 1)
            missing = os.path.join(os.path.dirname(self.daemon.config), "missing")
            self.wait_for(lambda: f'on_failure of lens "a": {missing} cannot be run' in self.daemon.log())

    def told_text(self):
        if not os.path.exists(self.told):
            return ""
        with open(self.told, encoding="ascii") as file:
            return file.read()

    def test_it_gets_no_file_and_no_signal_mask_of_lensd(self):
        text = f"ls /proc/self/fd | tr '\\n' ' ' > {self.told}\nexec grep -E 'Sig(Blk|Ign)' /proc/self/status >> {self.told}\n"
        with self.start(f'"{self.script(text)}"').client() as client:
            self.losses(client, 1)
            self.wait_for(lambda: "SigIgn" in self.told_text())
        told = self.told_text()
        self.assertLessEqual(len(told.split("SigBlk")[0].split()), 5, told)  # three, the folder of ls, and what dash has of the script
        blocked = int(told.split("SigBlk:")[1].split()[0], 16)
        ignored = int(told.split("SigIgn:")[1].split()[0], 16)
        for number in (signal.SIGTERM, signal.SIGPIPE, signal.SIGHUP):
            self.assertFalse((blocked | ignored) >> (number - 1) & 1, (number, told))

    def test_the_end_of_lensd_does_not_wait_for_it(self):
        with self.start(f'"{self.script("sleep 1000")}"').client() as client:
            self.losses(client, 2)
            self.wait_for(lambda: self.counts(client)["failuresTold"] == 1)
        began = time.monotonic()
        self.assertEqual(self.daemon.stop(), 0)
        self.assertLess(time.monotonic() - began, 4 * PATIENCE)

    def test_what_is_no_command_is_a_mistake_of_the_configuration(self):
        for wrong in ("3", '""', "[]", '["a", 1]', "true"):
            with self.subTest(wrong=wrong):
                daemon = Daemon(("a", "b"))
                try:
                    with open(daemon.config, "w", encoding="utf-8") as file:
                        file.write(self.config(wrong))
                    done = daemon.lensctl("reload", "--json")
                    self.assertEqual(done.returncode, 78, done.stdout)
                    self.assertIn("on_failure", done.stdout)
                finally:
                    daemon.stop()


if __name__ == "__main__":
    unittest.main()
