"""Clients that do their worst: no call ends the daemon or a lens, and what enters is checked."""
import contextlib
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from harness import LENS, PATIENCE, Daemon, DaemonTest


INVALID_PARAMETER = "org.varlink.service.InvalidParameter"
INVALID_REQUEST = LENS + "InvalidRequest"
BAD_DATA = LENS + "BadData"
EPSILON = 4.9e-324


class NoCallKillsTheDaemon(DaemonTest):

    def tearDown(self):
        self.assertIsNone(self.daemon.process.poll(), "the daemon is dead")
        with self.daemon.client() as client:
            self.assertEqual(client.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
            self.assertTrue(client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["connected"])

    def call(self, method, parameters):
        with self.daemon.client(timeout=10 * PATIENCE) as client:
            return client.call(LENS + method, parameters)

    def test_names_and_values_nested_to_any_depth(self):
        for depth in (17, 1000, 10327, 60000, 500000):
            for text in ("a." * depth + "a = 1", "[" + "a." * depth + "a]\nb = 1", "a = " + "[" * depth + "]" * depth,
                         "a = " + "{a=" * depth + "1" + "}" * depth, "[" * depth, "a = [\n" * depth,
                         '"a".' * depth + "a = 1", "a = {" + "a." * depth + "a = 1}", ("a = " + "{a.b.c.d=") * depth):
                if len(text) > 1000000:
                    continue
                with self.subTest(depth=depth, text=text[:20]):
                    reply = self.call("Calibrate", {"lens": "a", "toml": text})
                    self.assertEqual(reply["error"], BAD_DATA)

    def test_exposures_at_the_ends_of_their_numbers(self):
        ends = (-2 ** 63, -2 ** 63 + 1, -1, 0, 2 ** 62, 2 ** 63 - 1)
        for method, rest in (("AutofocusScore", {"sharpness": 1.0}),
                             ("AutofocusFrame", {"widthPx": 1, "heightPx": 1, "format": "mono8", "data": "AA=="})):
            for start in ends:
                for end in ends:
                    with self.subTest(method=method, start=start, end=end), self.daemon.client() as client:
                        begun = client.call(LENS + "AutofocusBegin", {"lens": "a", "scores": method.endswith("Score")})
                        parameters = {"session": begun["parameters"]["session"], "exposureStartNs": start,
                                      "exposureEndNs": end, **rest}
                        self.assertEqual(client.call(LENS + method, parameters)["error"], INVALID_REQUEST)

    def test_integers_beyond_64_bits_are_refused_not_wrapped(self):
        with self.daemon.client() as client:
            begun = client.call(LENS + "AutofocusBegin", {"lens": "a", "scores": True})["parameters"]
            for wrong in (2 ** 63, 2 ** 64 - 1, 2 ** 64, 2 ** 64 + begun["session"], 1e300, 1.5):
                with self.subTest(wrong=wrong):
                    reply = client.call(LENS + "AutofocusEnd", {"session": wrong})
                    self.assertEqual(reply, {"error": INVALID_PARAMETER, "parameters": {"parameter": "session"}})
            self.assertEqual(client.call(LENS + "AutofocusEnd", {"session": begun["session"]}), {"parameters": {}})

    def test_counts_are_refused_not_cut_to_32_bits(self):
        for pairs in (2 ** 32 + 3, 2 ** 31, -2 ** 63, 2 ** 63 - 1, 101, 2, 0, -1):
            with self.subTest(pairs=pairs):
                self.assertEqual(self.call("MeasureBacklash", {"lens": "a", "pairs": pairs})["error"], INVALID_REQUEST)

    def test_numbers_at_the_ends_of_double(self):
        """Whatever a curve is made of: it is refused, or the lens moves by it or says why not."""
        extremes = (EPSILON, -EPSILON, 2.3e-308, 1e-300, 1e300, 1.7e308, -1.7e308, 0.0)
        targets = [{"extensionMm": 0.8}, {"vergenceD": 1.0}, {"distanceM": 1.0}, {"extensionMm": EPSILON},
                   {"vergenceD": EPSILON}, {"vergenceD": 1.7e308}, {"extensionMm": -1.7e308}, {"distanceM": EPSILON}]
        for steps in extremes:
            for mm in extremes:
                points = [{"position": 0, "extensionMm": 0.0}, {"position": steps, "extensionMm": mm},
                          {"position": 2000, "extensionMm": 0.8}, {"position": 4000, "extensionMm": 1.6}]
                with self.subTest(steps=steps, mm=mm), self.daemon.client(timeout=30 * PATIENCE) as client:
                    client.call(LENS + "Calibrate", {"lens": "a", "points": points, "errorUm": 1.0})
                    for target in targets:
                        client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": target}, oneway=True)
                    self.assertIn("parameters", client.call(LENS + "Stop", {"lens": "a"}))
                    client.call(LENS + "Calibrate", {"lens": "a", "remove": True})

    def test_curves_from_files_at_the_ends_of_double(self):
        for knot in ("[4.9e-324, 0.1]", "[0, 4.9e-324]", "[0.0, 0.0], [4.9e-324, 1e308]", "[0, -1.7e308], [1, 1.7e308]",
                     "[0, inf]", "[nan, 1]", "[-1.7e308, 0], [1.7e308, 1]"):
            text = ("version = 1\nserial = \"\"\n[[focus]]\npoints = [" + knot + ", [2000, 0.8], [4000, 1.6]]\n")
            with self.subTest(knot=knot):
                self.call("Calibrate", {"lens": "a", "toml": text})
                self.call("Move", {"lens": "a", "axis": "focus", "target": {"extensionMm": 0.5}})
                self.call("Calibrate", {"lens": "a", "remove": True})

    def test_a_client_that_resets_in_the_middle_of_everything(self):
        for piece in (b"", b"{", b'{"method":"' + LENS.encode() + b'Status"}\0', b'{"method":"x"'):
            client = self.daemon.client()
            client.send_bytes(piece)
            client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.socket.close()


FSYNC_SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <unistd.h>
int fsync(int fd) {
  usleep(100000);
  return ((int (*)(int))dlsym(RTLD_NEXT, "fsync"))(fd);
}
"""


def slow_disk(folder):
    """A library that makes every fsync take 100 ms."""
    source, library = os.path.join(folder, "slow.c"), os.path.join(folder, "slow.so")
    with open(source, "w", encoding="utf-8") as file:
        file.write(FSYNC_SHIM)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    return library


def memory_of(process):
    with open(f"/proc/{process.pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class StopIsNeverLate(DaemonTest):
    """Every way in which a stop once was late or refused."""
    lenses = ("a", "b", "c")

    def setUp(self):
        with self.daemon.client() as client:
            client.call(LENS + "ResetFaults", {"lens": "a"})
            client.call(LENS + "Stop", {})
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 0}})

    def go_far(self, client, lens="a", **flags):
        client.send(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": 4000}}, **flags)
        self.wait_for(lambda: self.position(lens)["moving"])

    def timed_stop(self, client, parameters=None):
        began = time.monotonic()
        self.assertEqual(client.call(LENS + "Stop", {} if parameters is None else parameters), {"parameters": {}})
        return time.monotonic() - began

    def test_without_a_name_every_lens_stops(self):
        with self.daemon.client() as stopper:
            movers = [self.daemon.client() for _ in self.lenses]
            for mover, lens in zip(movers, self.lenses):
                self.go_far(mover, lens)
            self.timed_stop(stopper)
            for mover in movers:
                self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
                mover.socket.close()

    def test_a_user_who_holds_every_connection_may_still_stop(self):
        with self.daemon.client() as mover:
            self.go_far(mover)
            held = [self.daemon.client() for _ in range(150)]
            for client in held[:63]:
                self.assertIn("parameters", client.call("org.varlink.service.GetInfo"))
            with self.daemon.client() as late:
                self.timed_stop(late)
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
            for client in held:
                client.socket.close()
        self.wait_for(self.is_served)

    def is_served(self):
        with self.daemon.client() as client:
            return "error" not in client.call("org.varlink.service.GetInfo")

    def test_a_stop_overtakes_the_move_of_its_own_connection_and_the_replies_keep_their_order(self):
        with self.daemon.client() as client:
            self.go_far(client)
            client.send(LENS + "Status", {"lens": "a"})
            began = time.monotonic()
            client.send(LENS + "Stop", {"lens": "a"})
            self.assertEqual(client.receive()["error"], LENS + "Cancelled")
            self.assertLess(time.monotonic() - began, 0.5 * PATIENCE)
            self.assertIn("lenses", client.receive()["parameters"])
            self.assertEqual(client.receive(), {"parameters": {}})

    def test_calls_read_before_a_stop_never_move_anything(self):
        with self.daemon.client() as client:
            move = {"method": LENS + "Move",
                    "parameters": {"lens": "a", "axis": "focus", "target": {"position": 4000}}}
            stop = {"method": LENS + "Stop", "parameters": {"lens": "a"}}
            client.send_bytes(b"".join(json.dumps(call).encode() + b"\0" for call in [move] * 5 + [stop]))
            for _ in range(5):
                self.assertEqual(client.receive()["error"], LENS + "Cancelled")
            self.assertEqual(client.receive(), {"parameters": {}})
        time.sleep(0.2)
        self.assertLess(self.position()["position"], 200)

    def test_a_latch_holds_until_it_is_reset(self):
        with self.daemon.client() as client:
            client.call(LENS + "Stop", {"lens": "a", "latch": True})
            for method, parameters in (("Move", {"axis": "focus", "target": {"position": 10}}), ("Home", {}),
                                       ("Autofocus", {}), ("PresetRecall", {"label": "x"})):
                self.assertEqual(client.call(LENS + method, {"lens": "a", **parameters})["error"], LENS + "Cancelled")
            self.assertIn("move", client.call(LENS + "Move", {"lens": "b", "axis": "focus",
                                                              "target": {"position": 10}})["parameters"])
            client.call(LENS + "ResetFaults", {"lens": "a"})
            moved = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 10}})
            self.assertTrue(moved["parameters"]["move"]["reached"])

    def test_refused_moves_leave_nothing_behind(self):
        before = memory_of(self.daemon.process)
        refused = {"lens": "a", "axis": "focus", "target": {"position": 1e9}}
        with self.daemon.client() as client, self.daemon.client() as stopper:
            for _ in range(4000):
                reply = client.call(LENS + "Move", {**refused, "keepBrightness": True}, more=True)
                self.assertEqual(reply["error"], INVALID_REQUEST)
            self.go_far(client)
            self.assertLess(self.timed_stop(stopper), 0.1 * PATIENCE)
        self.assertLess(memory_of(self.daemon.process) - before, 16 << 20)

    def test_oneway_calls_are_counted(self):
        before = memory_of(self.daemon.process)
        call = json.dumps({"method": LENS + "Devices", "oneway": True}).encode() + b"\0"
        with self.daemon.client() as flood, self.daemon.client() as stopper:
            for _ in range(200):
                flood.send_bytes(call * 500)
            self.assertLess(self.timed_stop(stopper), 0.5 * PATIENCE)
        self.assertLess(memory_of(self.daemon.process) - before, 32 << 20)

    def test_a_monitor_that_does_not_read_sees_the_newest_state_when_it_does(self):
        with self.daemon.client() as monitor, self.daemon.client() as mover:
            monitor.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            monitor.send(LENS + "Monitor", {"lens": "a"}, more=True)
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3000}})
            time.sleep(2.0)
            with self.daemon.client() as reader:
                now = reader.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["readAtNs"]
            waiting = 0
            while monitor.receive()["parameters"]["event"].get("status", {"readAtNs": 0})["readAtNs"] < now:
                waiting += 1
            self.assertLess(waiting, 60)  # 25 a second would be no backlog, every reading would be 1,000
            with self.daemon.client() as stopper:
                self.timed_stop(stopper, {"lens": "a"})
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")


class SlowDisk(unittest.TestCase):

    def test_stops_do_not_wait_for_the_disk(self):
        with tempfile.TemporaryDirectory() as folder:
            daemon = Daemon(arguments=("--state", os.path.join(folder, "state")), preload=slow_disk(folder))
            try:
                savers = [daemon.client() for _ in range(8)]
                took = []
                with daemon.client() as mover, daemon.client() as stopper:
                    for number in range(40):
                        for client in savers:
                            client.send(LENS + "PresetSave", {"lens": "a", "label": f"p{number % 5}"}, oneway=True)
                        mover.send(LENS + "Move", {"lens": "a", "axis": "focus",
                                                   "target": {"position": 100 + number * 50}}, oneway=True)
                        time.sleep(0.01 * (number % 5))
                        began = time.monotonic()
                        assert stopper.call(LENS + "Stop") == {"parameters": {}}
                        took.append(time.monotonic() - began)
                took.sort()
                print(f"slow disk: {len(took)} stops, p50 {took[20] * 1e3:.1f} ms, worst {took[-1] * 1e3:.1f} ms")
                self.assertLess(took[-1], 0.09 * max(1, PATIENCE / 3))  # one fsync takes 100 ms
            finally:
                self.assertEqual(daemon.stop(), 0)


def hostile_clients(path, number, seconds):
    """A process of its own: `number` clients, each doing its worst in its own way."""
    import selectors
    import random
    os.sched_setaffinity(0, {sorted(os.sched_getaffinity(0))[0]})
    chance = random.Random(5)
    selector = selectors.DefaultSelector()
    move = lambda: {"lens": chance.choice("abcdefghijklmnop"), "axis": "focus", "target": {"position": chance.randrange(4000)}}
    kinds = [lambda: ("Move", move(), {"oneway": True}), lambda: ("Devices", {}, {"oneway": True}),
             lambda: ("Status", {}, {}), lambda: ("List", {}, {}),
             lambda: ("Move", {**move(), "keepBrightness": True}, {"oneway": True}),
             lambda: ("PresetSave", {"lens": chance.choice("abcd"), "label": chance.choice("xyz")}, {"oneway": True}),
             lambda: ("Nothing", {}, {"oneway": True}), lambda: ("Autofocus", {"lens": "a"}, {"oneway": True})]
    clients = []
    for index in range(number):
        client = socket.socket(socket.AF_UNIX)
        client.connect(path)
        client.setblocking(False)
        if index % 8 == 7:
            client.send(json.dumps({"method": LENS + "Monitor", "more": True}).encode() + b"\0")
            clients.append((client, None))
        else:
            clients.append((client, kinds[index % len(kinds)]))
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for client, kind in clients:
            try:
                if kind:
                    method, parameters, flags = kind()
                    call = json.dumps({"method": LENS + method, "parameters": parameters, **flags}).encode() + b"\0"
                    client.send(call * 20)
                if chance.random() < 0.3:
                    client.recv(65536)
            except OSError:
                pass


class AllAtOnce(unittest.TestCase):

    def test_stops_among_64_hostile_clients(self):
        lenses = "abcdefghijklmnop"
        stops = int(os.environ.get("LENSD_TEST_STOPS", "300"))
        with tempfile.TemporaryDirectory() as folder:
            daemon = Daemon(lenses=lenses, arguments=("--state", os.path.join(folder, "state")),
                            preload=slow_disk(folder))
            hostile = None
            try:
                cores = sorted(os.sched_getaffinity(0))
                os.sched_setaffinity(daemon.process.pid, {cores[-1]})
                hostile = subprocess.Popen([sys.executable, __file__, "--hostile", daemon.socket, "63", "120"])
                time.sleep(2)
                before = memory_of(daemon.process)
                took = []
                with daemon.client() as stopper:
                    for number in range(stops):
                        began = time.monotonic()
                        reply = stopper.call(LENS + "Stop", {"lens": lenses[number % 16]} if number % 2 else {})
                        took.append(time.monotonic() - began)
                        assert reply == {"parameters": {}}, reply
                        time.sleep(0.005)
                took.sort()
                grown = memory_of(daemon.process) - before
                print(f"{stops} stops among 64 hostile clients, 16 lenses, 100 ms an fsync: "
                      f"p50 {took[stops // 2] * 1e3:.1f} ms, p99 {took[stops * 99 // 100] * 1e3:.1f} ms, "
                      f"worst {took[-1] * 1e3:.1f} ms; memory grew by {grown >> 20} MiB")
                self.assertLess(took[stops // 2], 0.1 * PATIENCE)
                self.assertLess(grown, 64 << 20)
            finally:
                if hostile:
                    hostile.kill()
                    hostile.wait()
                self.assertEqual(daemon.stop(), 0)


class StderrNobodyReads(unittest.TestCase):

    def test_a_full_pipe_hangs_nobody(self):
        reading, writing = os.pipe()
        daemon = Daemon(stderr=writing)
        try:
            held = [daemon.client() for _ in range(60)]
            for _ in range(2000):  # each is a line in the log
                with contextlib.suppress(OSError), daemon.client() as client:
                    client.send_bytes(b"no message\0")
            for client in held:
                client.socket.close()
            with daemon.client(timeout=5 * PATIENCE) as client:
                self.assertIn("parameters", client.call(LENS + "Status"))
            self.assertEqual(daemon.stop(), 0)
        finally:
            os.close(writing)
            os.close(reading)


class Signals(unittest.TestCase):

    def test_pipe_and_usr_kill_nobody_and_term_answers_who_waits(self):
        daemon = Daemon()
        for harmless in (signal.SIGPIPE, signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP):
            daemon.process.send_signal(harmless)
        with daemon.client() as mover, daemon.client() as other:
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
            time.sleep(0.3)
            self.assertIn("parameters", other.call(LENS + "Status"))
            began = time.monotonic()
            daemon.process.send_signal(signal.SIGTERM)
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
            self.assertEqual(daemon.stop(), 0)
            self.assertLess(time.monotonic() - began, 2 * PATIENCE)


if __name__ == "__main__":
    if "--hostile" in sys.argv:
        hostile_clients(sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
    else:
        unittest.main()
