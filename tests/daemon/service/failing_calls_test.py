"""Every failure point: fifty commands again and again, each time with another system call of lensd failing. Each answer is
right or an honest error, none is missing, lensd lives, and what it remembers is true or said to be unknown."""
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, PATIENCE, Daemon  # noqa: E402

LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"
SECONDS = int(os.environ.get("LENSD_TEST_SECONDS", "25"))  # of random ones, and each kind once
SEED = int(os.environ.get("LENSD_TEST_SEED", "1"))
KINDS = ("open", "read", "write", "fsync", "rename", "accept", "send", "mmap")
HONEST = {"stopped", "superseded", "busy", "timeout", "out-of-range", "not-homed", "unsupported", "cannot-write", "io",
          "protocol", "unavailable", "not-found", "configuration"}
PLACES = (60, 100, 50, 110, 80, 64, 10, 82)


class Run:
    """One run of the commands, with the `at`-th call of a kind failing; 0: none."""

    def __init__(self, folder, library, kind, at):
        self.state = tempfile.mkdtemp(dir=folder)
        self.report = os.path.join(folder, "report")
        self.environment = {"FAIL_KIND": kind, "FAIL_AT": str(at), "FAIL_REPORT": self.report}
        self.library = library
        self.wrong = []
        self.presets = {}  # by label, whether it must be there; None: nobody knows
        self.honest = 0

    def start(self, **options):
        return Daemon(("a",), arguments=("--state", self.state), quick=True, **options)

    def all(self):
        os.environ.update(self.environment)
        try:
            self.daemon = self.start(preload=self.library)
        except AssertionError as failed:  # it did not begin to serve
            return self.wrong.append(f"no start: {failed}") if "error" not in str(failed) else None
        finally:
            for name in self.environment:
                del os.environ[name]
        self.commands()
        self.end()
        return None

    def lensctl(self, *arguments):
        """Exit status and answer; what is no honest end is noted."""
        try:
            done = self.daemon.lensctl(*arguments, "--json", "--timeout", "10s")
        except subprocess.TimeoutExpired:
            self.wrong.append(f"{arguments}: hangs")
            return None, {}
        line = done.stdout.strip().splitlines()[-1] if done.stdout.strip() else "{}"
        answer = json.loads(line)
        if done.returncode not in (0, 1):
            self.honest += 1
            if answer.get("error") not in HONEST:
                self.wrong.append(f"{arguments}: {done.returncode} {done.stdout}{done.stderr}")
        if self.daemon.process.poll() is not None:
            self.wrong.append(f"{arguments}: lensd has ended with {self.daemon.process.returncode}: {self.daemon.log()}")
        return done.returncode, answer

    def truth(self):
        """Where the motor is; through a connection of its own, which may be the one that fails."""
        for _ in range(3):
            try:
                with self.daemon.client() as client:
                    reply = client.call("io.lensd.Simulator.Truth", {"lens": "a"})
                    if "error" in reply:  # it is not open: nothing is said of its place either
                        return None, None
                    status = client.call(LENS + "Status", {"lens": "a"})
                    return reply["parameters"]["focusPosition"], status["parameters"]["lenses"][0]["axes"][0]
            except (OSError, TypeError):  # no connection, or it was closed without an answer
                time.sleep(0.01)
        self.wrong.append("neither Truth nor Status is answered any more")
        return None, None

    def check_place(self, what):
        place, axis = self.truth()
        if axis is not None and axis["homed"] and not axis["moving"] and abs(axis["position"] - place) > 1 + axis["positionBound"]:
            self.wrong.append(f"{what}: it stands at {place} and is said to be at {axis}")
        return place

    def focus(self, target):
        status, move = self.lensctl("focus", "a", f"@{target}")
        place = self.check_place(f"focus {target}")
        if status == 0 and place is not None and abs(place - target) > 1 + move["positionBound"]:
            self.wrong.append(f"focus {target}: reached, it says, and stands at {place}")
        if status == 7:
            self.lensctl("home", "a", "focus")

    def save(self, label):
        status, _ = self.lensctl("preset", "save", "a", label)
        self.presets[label] = True if status == 0 else None

    def remove(self, label):
        status, _ = self.lensctl("preset", "remove", "a", label)
        self.presets[label] = False if status == 0 else None

    def list(self):
        status, listed = self.lensctl("preset", "list", "a")
        if status == 0:
            self.check_presets({preset["label"] for preset in listed})

    def check_presets(self, labels):
        for label, there in self.presets.items():
            if there is not None and (label in labels) != there:
                self.wrong.append(f"preset {label}: {there}, and listed are {labels}")

    def commands(self):
        picture = os.path.join(self.state, "picture.png")
        for number, target in enumerate(PLACES):
            self.focus(target)
            self.save(f"p{number}")
            self.lensctl("status", "a")
            if number % 2:
                self.list()
                self.remove(f"p{number - 1}")
            else:
                self.lensctl("stop", "a")
        status, _ = self.lensctl("snapshot", "a", "-o", picture)
        if status == 0 and open(picture, "rb").read(8) != b"\x89PNG\r\n\x1a\n":
            self.wrong.append("snapshot: done, it says, and there is no picture")
        self.lensctl("metrics", "a")
        self.lensctl("list")
        self.lensctl("devices")
        self.lensctl("exposure", "a")
        self.lensctl("home", "a", "focus")
        self.lensctl("reload")
        self.focus(42)

    def end(self):
        """Killed, and begun again without faults: what it remembers is so, or it says that it does not know."""
        place, _ = self.truth()
        os.kill(self.daemon.process.pid, signal.SIGTERM if LONG else signal.SIGKILL)
        self.daemon.process.wait(timeout=30 * PATIENCE)
        kept = os.path.join(self.state, "a.position.json")
        if os.path.exists(kept) and place is not None:
            with open(kept, encoding="utf-8") as file:
                focus = json.load(file)["axes"]["focus"]
            if focus["known"] and not focus["inMotion"] and abs(focus["position"] - place) > 1 + focus["doubt"]:
                self.wrong.append(f"remembered is {focus}, and it stood at {place}")
        self.daemon.errors.close()
        self.daemon.folder.cleanup()
        self.daemon = self.start()
        try:
            with self.daemon.client() as client:
                presets = client.call(LENS + "PresetList", {"lens": "a"})
            self.check_presets({preset["label"] for preset in presets["parameters"]["presets"]})
        finally:
            if self.daemon.stop() != 0:
                self.wrong.append("it does not end well after a restart")


class EveryFailurePoint(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lensd-failing-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.library = os.path.join(self.folder, "failing.so")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", self.library, os.path.join(HERE, "failing_calls.c"), "-ldl"],
                       check=True)

    def run_with(self, kind, at):
        run = Run(self.folder, self.library, kind, at)
        run.all()
        self.assertEqual(run.wrong, [], f"the {at}-th {kind} failed (seed {SEED})")
        return run

    def counts(self):
        """Calls of each kind in a run without faults."""
        daemon = None
        os.environ["FAIL_REPORT"] = report = os.path.join(self.folder, "report")
        try:
            run = Run(self.folder, self.library, "none", 0)
            run.end = lambda: None
            run.all()
            daemon = run.daemon
            self.assertEqual((run.wrong, run.honest), ([], 0))
        finally:
            self.assertEqual(daemon.stop() if daemon else None, 0)
        with open(report, encoding="utf-8") as file:
            return {kind: int(count) for kind, count in (line.split() for line in file)}

    def test_each(self):
        counts = self.counts()
        self.assertEqual(set(counts), set(KINDS))
        points = [(kind, at) for kind in KINDS for at in range(1, counts[kind] + 1)]
        chance = random.Random(SEED)
        if not LONG:  # each kind as often as any other: what is rare is not less interesting
            points = [chance.choice([point for point in points if point[0] == kind] or points)
                      for _ in range(1000) for kind in KINDS]
        began, done, honest = time.monotonic(), 0, 0
        for kind, at in points:
            if not LONG and done >= len(KINDS) and time.monotonic() - began > SECONDS:
                break
            honest += self.run_with(kind, at).honest
            done += 1
        print(f"{done} runs of {sum(counts.values())} failure points {counts}: {honest} commands ended with an error, "
              f"no wrong answer, no hang, no crash, no lost state")
        self.assertGreaterEqual(done, len(KINDS))


if __name__ == "__main__":
    unittest.main()
