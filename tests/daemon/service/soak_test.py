"""Hours in which much goes on and much goes wrong: 200 calls a second, 20 monitors and faults all the time. Nothing is lost
and nothing grows: every call is answered, memory, descriptors and threads are as many at the end as at the beginning, and
stops are carried out at once. And 40 minutes of everyday's calls, after ten of which memory is flat."""
import json
import os
import random
import selectors
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, PATIENCE, Client, Daemon  # noqa: E402

SECONDS = {"fast": 5, "ci": 25, "long": 3600}[os.environ.get("LENSD_TEST_LEVEL", "ci")]
EVERYDAY_SECONDS = {"fast": 2, "ci": 5, "long": 2400}[os.environ.get("LENSD_TEST_LEVEL", "ci")]
WARM_UP, LOOKS, LENSES = 5, 60, "abcd"
SIMULATOR = "io.lensd.Simulator."
FAULTS = ({"kind": "stall", "axis": "focus"}, {"kind": "drop-reply"}, {"kind": "late-reply"}, {"kind": "stale-readback", "axis": "focus"},
          {"kind": "jump", "axis": "focus", "steps": 50}, {"kind": "disconnect"}, {"kind": "lose-frames"}, {"kind": "freeze-frames"})
PLAN = {"limits": [{"name": "n", "kind": "sharp", "limitUm": 50.0, "depths": [{"oneEnd": {"distanceM": 1.1}, "otherEnd": {"distanceM": 1.3}}]}]}


class Caller(Client):
    """A connection that has one call at a time under way and waits for nothing."""

    def __init__(self, path):
        super().__init__(path, 60 * PATIENCE)
        self.busy, self.since = False, 0

    def begin(self, method, parameters, interface=LENS, **flags):
        self.busy, self.since = True, time.monotonic()
        self.send(interface + method, parameters, **flags)

    def come(self):
        """What has come; True: the answer is whole."""
        data = self.socket.recv(65536)
        assert data, "lensd closed a connection"
        self.buffer += data
        while b"\0" in self.buffer:
            message, self.buffer = self.buffer.split(b"\0", 1)
            self.busy = bool(self.judged(json.loads(message)).get("continues"))
        return not self.busy


class Monitor(Client):
    def __init__(self, path):
        super().__init__(path, 60 * PATIENCE)
        self.events = 0
        self.send(LENS + "Monitor", {}, more=True)

    def come(self):
        data = self.socket.recv(1 << 20)
        assert data, "lensd closed a monitor"
        self.events += data.count(b"\0")
        assert b'"error":"io.' not in data, data


def any_call(chance):
    lens = chance.choice(LENSES)
    return chance.choice((
        ("Status", {"lens": lens}), ("Status", {}), ("List", {}), ("Metrics", {}), ("GetCalibration", {"lens": lens}),
        ("Move", {"lens": lens, "axis": "focus", "target": {"position": chance.randrange(4000)}}),
        ("Move", {"lens": lens, "axis": "iris", "target": {"position": chance.randrange(100)}}),
        ("Home", {"lens": lens}), ("Stop", {"lens": lens}), ("PresetSave", {"lens": lens, "label": chance.choice("xyz")}),
        ("PresetList", {"lens": lens}), ("Autofocus", {"lens": lens}), ("Snapshot", {"lens": lens}), ("ResetFaults", {"lens": lens}),
        ("Plan", {"lens": lens, "request": PLAN})))


def everyday_call(chance):
    """Method, parameters and flags; no method: the client closes its connection and opens another."""
    lens = chance.choice(LENSES)
    label = chance.choice("xyz")
    focus, iris = ({"lens": lens, "axis": axis, "target": {"position": chance.randrange(places)}} for axis, places in (("focus", 4000), ("iris", 100)))
    return chance.choices((
        ("Status", {"lens": lens}, {}), ("Status", {}, {}), ("Move", focus, {}), ("Move", iris, {}), ("Stop", {"lens": lens}, {}),
        ("PresetSave", {"lens": lens, "label": label}, {}), ("PresetList", {"lens": lens}, {}), ("PresetRecall", {"lens": lens, "label": label}, {}),
        ("Autofocus", {"lens": lens}, {}), ("Snapshot", {"lens": lens}, {"more": True}), ("Plan", {"lens": lens, "request": PLAN}, {}),
        (None, {}, {})), weights=(4, 2, 2, 1, 4, 1, 1, 1, 1, 2, 2, 1))[0]


def held(process):
    """Descriptors, threads and KiB of memory of a process."""
    folder = f"/proc/{process.pid}"
    with open(folder + "/status", encoding="ascii") as file:
        kib = next(int(line.split()[1]) for line in file if line.startswith("VmRSS"))
    return len(os.listdir(folder + "/fd")), len(os.listdir(folder + "/task")), kib


def pictures(daemon):
    """KiB of pictures that the simulator remembers: as many as it may, and no more, however long it runs."""
    with daemon.client() as client:
        kib = [client.call(SIMULATOR + "Truth", {"lens": lens})["parameters"]["picturesKib"] for lens in LENSES]
    assert max(kib) <= 32 << 10, kib
    return sum(kib)


def stops(path, seconds):
    """A process of its own, so that nothing but lensd makes it wait: how long each stop took, in ms."""
    took, end = [], time.monotonic() + seconds
    with Client(path, 60 * PATIENCE) as client:
        while time.monotonic() < end:
            began = time.monotonic()
            reply = client.call(LENS + "Stop", {"lens": LENSES[len(took) % len(LENSES)]})
            took.append(1e3 * (time.monotonic() - began))
            # A lens whose power is off cannot be stopped, and says so.
            assert reply == {"parameters": {}} or reply["error"].split(".")[-1] in ("Disconnected", "Timeout", "DeviceError"), reply
            time.sleep(0.1)
    print(json.dumps(took))


class Load(unittest.TestCase):
    """Calls at a rate to one daemon; a connection has one under way at a time."""
    rate, callers_open, monitors_open, fault_every = 200, 16, 20, 0.5

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-soak-")
        self.addCleanup(self.folder.cleanup)
        self.daemon = Daemon(LENSES, arguments=("--state", os.path.join(self.folder.name, "state")))
        self.addCleanup(lambda: self.assertEqual(self.daemon.stop(), 0))
        self.chance = random.Random(17)
        self.selector = selectors.DefaultSelector()
        self.callers, self.monitors = [], []
        for _ in range(self.callers_open):
            self.open(Caller, self.callers)
        for _ in range(self.monitors_open):
            self.open(Monitor, self.monitors)
        self.faults = self.open(Caller, [])
        self.answered = self.left_out = 0
        self.memory = []  # KiB without pictures, by time

    def open(self, kind, among):
        client = kind(self.daemon.socket)
        among.append(client)
        self.selector.register(client.socket, selectors.EVENT_READ, client)
        self.addCleanup(client.socket.close)
        return client

    def call(self, caller):
        caller.begin(*any_call(self.chance))

    def listen(self, seconds):
        for key, _ in self.selector.select(max(seconds, 0)):
            self.answered += bool(key.data.come())

    def run_for(self, seconds, looks=LOOKS):
        """Calls at the rate, whatever becomes of those before; where all connections wait for answers, one is left out."""
        began = time.monotonic()
        next_call = next_fault = next_look = began
        while (now := time.monotonic()) < began + seconds:
            if now >= next_call:
                next_call += 1 / self.rate
                free = [caller for caller in self.callers if not caller.busy]
                if free:
                    self.call(self.chance.choice(free))
                else:
                    self.left_out += 1
            if self.fault_every and now >= next_fault and not self.faults.busy:
                next_fault = now + self.fault_every
                fault = {**self.chance.choice(FAULTS), "lens": self.chance.choice(LENSES)}
                if fault["kind"] != "jump":
                    fault["forMs"] = self.chance.choice((20, 100, 300))
                self.faults.begin("Inject", fault, SIMULATOR)
            if now >= next_look:
                next_look = now + seconds / looks
                self.memory.append(held(self.daemon.process)[2] - pictures(self.daemon))
            self.listen(min(next_call, next_fault if self.fault_every and not self.faults.busy else next_call) - time.monotonic())
            slow = [caller for caller in self.callers if caller.busy and now - caller.since > 60 * PATIENCE]
            self.assertFalse(slow, [caller.calls for caller in slow])

    def rest(self):
        """No call is under way, no fault in force, and every lens is there."""
        deadline = time.monotonic() + 60 * PATIENCE
        with self.daemon.client() as client:
            while any(caller.busy for caller in (*self.callers, self.faults)):
                self.assertLess(time.monotonic(), deadline, [caller.calls for caller in self.callers if caller.busy])
                client.call(LENS + "Stop", {})
                self.listen(0.02)
            while True:
                lenses = client.call(LENS + "Status")["parameters"]["lenses"]
                if all(lens["connected"] and lens["activity"] == "idle" for lens in lenses):
                    break
                self.assertLess(time.monotonic(), deadline, lenses)
                self.listen(0.05)
        for _ in range(20):
            self.listen(0.01)
        return held(self.daemon.process)


class Soak(Load):

    def test_nothing_is_lost_and_nothing_grows(self):
        self.run_for(WARM_UP)
        before, remembered = self.rest(), pictures(self.daemon)
        answered, began = self.answered, time.monotonic()
        self.memory.clear()
        stopper = subprocess.Popen([sys.executable, __file__, "--stops", self.daemon.socket, str(SECONDS)], stdout=subprocess.PIPE)
        self.addCleanup(stopper.kill)
        self.run_for(SECONDS)
        rate = (self.answered - answered) / (time.monotonic() - began)
        took = sorted(json.loads(stopper.communicate(timeout=60 * PATIENCE)[0]))
        self.assertEqual(stopper.returncode, 0)
        after, deadline = self.rest(), time.monotonic() + 10 * PATIENCE
        while (after[0] > before[0] or after[1] > before[1]) and time.monotonic() < deadline:  # connections that were just closed
            time.sleep(0.1)
            after = held(self.daemon.process)
        remembered = pictures(self.daemon) - remembered
        events = sum(monitor.events for monitor in self.monitors)
        print(f"{SECONDS} s: {rate:.0f} calls a second answered, {self.left_out} left out, {events} events; {len(took)} stops, p50 "
              f"{took[len(took) // 2]:.1f} ms, p99 {took[len(took) * 99 // 100]:.1f} ms, p99.9 {took[len(took) * 999 // 1000]:.1f} ms; "
              f"descriptors {before[0]} and {after[0]}, threads {before[1]} and {after[1]}, memory {before[2]} and {after[2]} KiB, "
              f"{remembered} of the growth in remembered pictures")
        fifths = [sorted(part)[len(part) // 2] for part in (self.memory[i * LOOKS // 5:(i + 1) * LOOKS // 5] for i in range(5))]
        print("memory without pictures, medians of five parts of the time:", *fifths, "KiB")
        self.assertLessEqual(after[0], before[0])
        self.assertLessEqual(after[1], before[1])
        if PATIENCE < 15:  # sanitizers keep what was freed
            self.assertLess(after[2] - before[2] - remembered, 16 << 10)
        self.assertTrue(all(monitor.events > SECONDS for monitor in self.monitors))
        if SECONDS > 1000:
            self.assertLess(took[len(took) * 999 // 1000], 10)
            self.assertGreater(rate, 0.9 * self.rate)


class Everyday(Load):
    """Six clients that come and go, and two monitors."""
    rate, callers_open, monitors_open, fault_every = 90, 6, 2, 0

    def call(self, caller):
        method, parameters, flags = everyday_call(self.chance)
        if method:
            return caller.begin(method, parameters, **flags)
        self.selector.unregister(caller.socket)
        self.callers.remove(caller)
        caller.socket.close()
        return self.open(Caller, self.callers)

    def test_memory_is_flat_after_ten_minutes(self):
        """The medians of two minutes each from the tenth and up to the fortieth. In less time it is shown that the calls are served;
        tests/sim/memory_test.cpp has what grew."""
        self.run_for(EVERYDAY_SECONDS, looks=EVERYDAY_SECONDS // 2)
        before, after = (sorted(part)[len(part) // 2] for part in (self.memory[len(self.memory) // 4:][:60], self.memory[-60:]))
        every_minute = [sorted(part)[len(part) // 2] for part in (self.memory[at:at + 30] for at in range(0, len(self.memory), 30))]
        print(f"{EVERYDAY_SECONDS} s: {self.answered} calls answered, {self.left_out} left out; memory without pictures grew by {after - before} KiB:",
              *every_minute, "KiB, each the median of a minute")
        self.assertGreater(self.answered, 5 * EVERYDAY_SECONDS / PATIENCE)
        if EVERYDAY_SECONDS > 1000 and PATIENCE < 15:  # sanitizers keep what was freed
            self.assertLess(after - before, 512)


if __name__ == "__main__":
    if "--stops" in sys.argv:
        stops(sys.argv[2], float(sys.argv[3]))
    else:
        unittest.main()
