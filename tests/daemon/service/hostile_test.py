"""Clients that do their worst: no call ends the daemon or a lens, and what enters is checked."""
import contextlib
import json
import os
import select
import signal
import socket
import struct
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, PATIENCE, Daemon, DaemonTest, memory_of  # noqa: E402

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
            for client in held[:63 + 16]:
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

    def test_a_calibration_of_a_megabyte_holds_up_no_stop(self):
        points = ", ".join(f"[{step}, {step * 0.00004:.5f}]" for step in range(40000))
        longest = "version = 1\nserial = \"\"\ngrade = \"calibrated\"\n[[focus]]\napproach = \"near\"\nerror_um = 5\npoints = [" + points + "]\n"
        many = {"lens": "a", "points": [{"position": step, "extensionMm": step * 0.0004} for step in range(4000)], "errorUm": 5.0}
        with self.daemon.client() as caller, self.daemon.client() as stopper:
            self.assertEqual(caller.call(LENS + "Calibrate", many)["error"], INVALID_REQUEST)
            before = []  # stops that were answered while lensd read the calibration
            for _ in range(3):
                caller.send(LENS + "Calibrate", {"lens": "a", "toml": longest})
                before.append(0)
                while not select.select([caller.socket], [], [], 0)[0]:
                    self.timed_stop(stopper, {"lens": "a"})
                    before[-1] += 1
                self.assertEqual(caller.receive()["error"], BAD_DATA)
            # Where reading it held up a stop, that would be one, or the one before it as well.
            self.assertGreater(max(before), 3, before)

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
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
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
    unittest.main()
