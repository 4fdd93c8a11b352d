"""Calls of a driver that do not come back: that lens is `hung`, says so, and is opened anew; the others live."""
import os
import socket
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from event_stream import Stream  # noqa: E402
from faulty_daemon import FaultyDaemon  # noqa: E402
from harness import LENS, PATIENCE, DaemonTest  # noqa: E402

CALL = 10  # s: what lensd gives a call of a driver
OPENING = 15  # s: and opening it
LENSES = ("a", "reads", "moves", "opens", "closes", "lost")


class Hung(DaemonTest):
    """All at once, because each takes its time: while the others hang, `a` must not notice."""

    @classmethod
    def setUpClass(cls):
        cls.state = tempfile.TemporaryDirectory(prefix="lensd-hung-")
        # systemd's end of its watchdog
        cls.notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        cls.notify.bind(os.path.join(cls.state.name, "notify"))
        os.environ["NOTIFY_SOCKET"] = os.path.join(cls.state.name, "notify")
        os.environ["WATCHDOG_USEC"] = "2000000"
        cls.pings = []

        def listen():
            while True:
                said = cls.notify.recv(4096)
                if said == b"END":
                    return
                if b"WATCHDOG=1" in said:
                    cls.pings.append(time.monotonic())

        cls.listener = threading.Thread(target=listen)
        cls.listener.start()
        try:
            cls.daemon = FaultyDaemon(LENSES, arguments=("--state", cls.state.name))
        finally:
            del os.environ["NOTIFY_SOCKET"], os.environ["WATCHDOG_USEC"]

    @classmethod
    def tearDownClass(cls):
        try:
            super().tearDownClass()
        finally:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
                end.sendto(b"END", os.path.join(cls.state.name, "notify"))
            cls.listener.join()
        # Never later than systemd would wait, whatever hung.
        gaps = [later - earlier for earlier, later in zip(cls.pings, cls.pings[1:])]
        assert len(gaps) > 10 and max(gaps) < 2 * PATIENCE, gaps
        cls.notify.close()
        cls.state.cleanup()

    def connection(self, client, lens):
        return self.daemon.status(client, lens)["connection"]

    def live(self, client, seconds):
        """`a` moves and is stopped at once for so long."""
        until, worst = time.monotonic() + seconds, 0
        while time.monotonic() < until:
            moved = self.daemon.move(client, "a", 200 if worst else 300)["parameters"]["move"]
            self.assertTrue(moved["reached"], moved)
            began = time.monotonic()
            self.assertEqual(client.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
            worst = max(worst, time.monotonic() - began)
            time.sleep(0.05)
        self.assertLess(worst, 0.1 * PATIENCE)

    def test_all_at_once(self):
        daemon = self.daemon
        with daemon.client() as client, daemon.client(60 * PATIENCE) as mover, daemon.client() as other, \
                Stream(daemon, lens="moves", timeout=60 * PATIENCE) as events:
            self.assertTrue(daemon.move(client, "moves", 500)["parameters"]["move"]["reached"])
            # -- a call hangs in the midst of a move, and one while the lens is read
            daemon.fault("moves", "move hang")
            daemon.fault("reads", "read hang")
            daemon.fault("closes", "read throw", "close hang")
            daemon.fault("opens", "read throw", "open hang")
            daemon.fault("lost", "read hang", "open hang")
            began = time.monotonic()
            mover.send(LENS + "Move", {"lens": "moves", "axis": "focus", "target": {"position": 3000}})
            time.sleep(0.2)
            # A stop does not wait until it is known that the lens hangs.
            stopped = other.call(LENS + "Stop", {"lens": "moves"})
            self.assertLess(time.monotonic() - began, 5 + PATIENCE)
            self.assertEqual(stopped["error"], LENS + "Timeout")
            self.assertIn("may continue", stopped["parameters"]["message"])
            self.live(client, 1)
            # -- it is known
            answer = mover.receive()
            took = time.monotonic() - began
            self.assertGreater(took, CALL - 1)
            self.assertLess(took, CALL + 2 + PATIENCE)
            self.assertEqual(answer["error"], LENS + "Disconnected")
            self.assertIn("has not answered for 10 s", answer["parameters"]["message"])
            gone = events.of("list", change="gone")
            self.assertEqual(gone["connection"], "hung")
            self.wait_for(lambda: len(daemon.lines("moves: its device has not answered")) == 1)
            # -- opened anew beside it: where it stands is not known, since its motor may have run
            events.of("list", change="opened")
            found = daemon.status(client, "moves")
            self.assertFalse(found["axes"][0]["homed"], found)
            self.live(client, 1)
            # -- one whose every call hangs, opening too, stays hung and says so
            self.wait_for(lambda: "3 such calls hang" in (daemon.status(client, "lost")["error"] or ""), 60)
            self.assertEqual(self.connection(client, "lost"), "hung")
            began = time.monotonic()
            stopped = client.call(LENS + "Stop", {"lens": "lost"})
            self.assertEqual(stopped["error"], LENS + "Disconnected")
            self.assertIn("may continue", stopped["parameters"]["message"])
            stopped = client.call(LENS + "Stop")  # of all: the others are, and one that hangs is named
            self.assertEqual(stopped["error"], LENS + "Disconnected")
            self.assertIn(stopped["parameters"]["lens"], LENSES[1:])
            self.assertLess(time.monotonic() - began, 0.2 * PATIENCE)
            self.assertEqual(self.connection(client, "opens"), "hung")
            self.assertIn(self.connection(client, "reads"), ("hung", "connected"))
            # Its close hangs: the device is opened anew all the same.
            self.wait_for(lambda: daemon.lines("closes: its device has not answered for 10 s"))
            self.live(client, 1)
            self.come_back(client, events)

    def come_back(self, client, events):
        """What hung for most of a minute comes back: nothing that it says or does counts."""
        daemon = self.daemon
        daemon.fault("moves", "held")  # calls from now on do not hang, and the one that does goes on hanging
        self.home(client, "moves")
        self.assertTrue(daemon.move(client, "moves", 700)["parameters"]["move"]["reached"])
        before = daemon.status(client, "moves")["axes"]
        seen = len(events.told)
        daemon.fault("moves")
        self.wait_for(lambda: daemon.lines("moves: a call that hung has returned"))
        self.assertEqual(daemon.status(client, "moves")["axes"], before)
        for lens in LENSES[1:]:
            daemon.fault(lens)
        for lens in LENSES:
            self.wait_for(lambda lens=lens: self.connection(client, lens) == "connected", 40)
            self.home(client, lens)
            self.assertTrue(daemon.move(client, lens, 250)["parameters"]["move"]["reached"])
        while events.last["moves"]["lasting"] < 0 or events.told[-1].get("move", {}).get("position") != 250:
            events.next()
        moves = [event["move"] for event in events.told[seen:] if "move" in event]
        self.assertNotIn(3000, [move["target"] if "target" in move else move["position"] for move in moves])
        # Its thread is gone with it: the daemon ends at once.

    def home(self, client, lens):
        if not self.daemon.status(client, lens)["axes"][0]["homed"]:
            homed = client.call(LENS + "Home", {"lens": lens, "axis": "focus"})
            self.assertTrue(homed["parameters"]["moves"][0]["reached"], homed)


if __name__ == "__main__":
    unittest.main()
