"""A driver that throws, wherever it may: that lens alone fails, says why, and is opened again; the others live."""
import os
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from event_stream import Stream  # noqa: E402
from faulty_daemon import FaultyDaemon  # noqa: E402
from harness import LENS, DaemonTest  # noqa: E402


class Thrown(DaemonTest):
    @classmethod
    def setUpClass(cls):
        cls.daemon = FaultyDaemon(("a", "b"))

    def setUp(self):
        self.daemon.fault("a")
        with self.daemon.client() as client:
            self.wait_for(lambda: self.daemon.status(client, "a")["connected"], 20)

    def assert_fails_alone(self, place, provoke, what_next):
        """`place` throws: `a` says so in its state, an event and the log, while `b` moves; then it is there again."""
        with self.daemon.client() as client, Stream(self.daemon, lens="a") as events:
            self.assertEqual(events.next()["status"]["connection"], "connected")
            said = f"the {place} of the test threw"
            before = len(self.daemon.lines(" a: ", said))
            self.daemon.fault("a", f"{place} throw", *what_next)
            provoke(client)
            gone = events.of("list", change="gone")
            self.assertEqual(gone["connection"], "absent")
            self.assertIn(said, gone["reason"])
            self.assertTrue(self.daemon.move(client, "b", 300)["parameters"]["move"]["reached"])
            self.assertTrue(self.daemon.move(client, "b", 100)["parameters"]["move"]["reached"])
            self.assertEqual(len(self.daemon.lines(" a: ", said)), before + 1, self.daemon.log())
            # It is tried again and again, and opened once that works.
            self.daemon.fault("a")
            events.of("list", change="opened")
            self.assertTrue(self.daemon.move(client, "a", 200)["parameters"]["move"]["reached"])

    def test_on_a_command(self):
        def move(client):
            self.assertEqual(self.daemon.move(client, "a", 700)["error"], LENS + "Cancelled")
        # It is not opened again before the event has been seen.
        self.assert_fails_alone("move", move, ("open throw",))

    def test_while_it_is_read(self):
        self.assert_fails_alone("read", lambda client: None, ("open throw",))

    def test_on_a_thread_of_its_own(self):
        self.assert_fails_alone("background", lambda client: None, ("open throw",))

    def test_when_it_is_opened(self):
        with self.daemon.client() as client:
            said = "the open of the test threw"
            before = len(self.daemon.lines(" a: ", said))
            self.daemon.fault("a", "read throw", "open throw")
            self.wait_for(lambda: said in (self.daemon.status(client, "a")["error"] or ""))
            self.assertEqual(self.daemon.status(client, "a")["connection"], "absent")
            refused = self.daemon.move(client, "a", 200)
            self.assertEqual(refused["error"], LENS + "Disconnected")
            self.assertIn(said, refused["parameters"]["message"])
            self.assertTrue(self.daemon.move(client, "b", 400)["parameters"]["move"]["reached"])
            time.sleep(1)  # it is tried again meanwhile, and said once
            self.assertEqual(len(self.daemon.lines(" a: ", said)), before + 1, self.daemon.log())
            self.daemon.fault("a")
            self.wait_for(lambda: self.daemon.status(client, "a")["connected"], 20)
            self.assertTrue(self.daemon.move(client, "a", 300)["parameters"]["move"]["reached"])

    def test_when_it_is_closed(self):
        with self.daemon.client() as client:
            self.daemon.fault("a", "close throw")
            with open(self.daemon.config, encoding="utf-8") as file:
                before = file.read()
            with open(self.daemon.config, "w", encoding="utf-8") as file:
                file.write(before.replace('name = "a"\n', 'name = "a"\ndistance_from = "sensor"\n'))
            reloaded = client.call(LENS + "Reload")
            self.assertEqual(reloaded["parameters"]["reopened"], ["a"])
            self.wait_for(lambda: self.daemon.lines(" a: ", "the close of the test threw"))
            self.wait_for(lambda: self.daemon.status(client, "a")["connected"])
            self.daemon.fault("a")
            self.assertTrue(self.daemon.move(client, "a", 300)["parameters"]["move"]["reached"])
            self.assertTrue(self.daemon.move(client, "b", 300)["parameters"]["move"]["reached"])


if __name__ == "__main__":
    unittest.main()
