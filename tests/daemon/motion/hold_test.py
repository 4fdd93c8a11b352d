"""Hold and Release through the daemon: who ends a hold, who is told, and what goes on all the same."""
import json
import os
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, LENS, PATIENCE, DaemonTest  # noqa: E402


class Hold(DaemonTest):
    lenses = ("a",)

    def setUp(self):
        # lensd may still be about to notice that the last test's connections are closed
        self.wait_for(lambda: self.held() is None)

    def held(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["holdUntilNs"]

    def until(self, seconds):
        return time.clock_gettime_ns(time.CLOCK_MONOTONIC) + int(1e9 * seconds)

    def hold(self, client, seconds):
        until = self.until(seconds)
        reply = client.call(LENS + "Hold", {"lens": "a", "untilNs": until})
        self.assertEqual(reply["parameters"].get("untilNs"), until, reply)
        return until

    def test_it_ends_with_its_connection(self):
        with self.daemon.client() as client:
            until = self.hold(client, 60)
            self.wait_for(lambda: self.held() == until)
        self.wait_for(lambda: self.held() is None)

    def test_it_ends_by_release_and_by_its_time(self):
        with self.daemon.client() as client:
            self.hold(client, 60)
            self.assertEqual(client.call(LENS + "Release", {"lens": "a"})["parameters"], {})
            self.wait_for(lambda: self.held() is None)
            until = self.hold(client, 0.5)
            self.wait_for(lambda: self.held() is None)
            self.assertGreaterEqual(self.until(0), until)
            client.call(LENS + "Release", {"lens": "a"})  # harmless

    def test_the_longest_counts_and_each_ends_its_own(self):
        with self.daemon.client() as one, self.daemon.client() as other:
            longer = self.hold(one, 60)
            shorter = self.hold(other, 30)
            self.wait_for(lambda: self.held() == longer)
            one.call(LENS + "Release", {"lens": "a"})
            self.wait_for(lambda: self.held() == shorter)
            moved = self.hold(other, 20)  # a new call moves its end, forth and back
            self.wait_for(lambda: self.held() == moved)

    def test_commands_and_stops_go_on(self):
        with self.daemon.client() as client, self.daemon.client() as another:
            self.hold(client, 60)
            move = {"lens": "a", "axis": "focus", "target": {"position": 20}}
            self.assertTrue(another.call(LENS + "Move", move)["parameters"]["move"]["reached"])
            self.assertEqual(another.call(LENS + "Stop", {"lens": "a"})["parameters"], {})

    def test_what_makes_no_sense_is_refused(self):
        with self.daemon.client() as client:
            for seconds in (-1, 3700):
                reply = client.call(LENS + "Hold", {"lens": "a", "untilNs": self.until(seconds)})
                self.assertEqual((reply["error"], reply["parameters"]["parameter"]), (LENS + "InvalidRequest", "untilNs"))
            self.assertIsNone(self.held())
            self.assertIn("hold", client.call(LENS + "List")["parameters"]["features"])

    def test_with_more_it_answers_at_its_end(self):
        with self.daemon.client() as client:
            until = self.until(0.4)
            client.send(LENS + "Hold", {"lens": "a", "untilNs": until}, more=True)
            first = client.receive()
            self.assertTrue(first["continues"])
            self.assertTrue(first["parameters"]["atRest"])
            self.assertLess(self.until(0), until)
            self.assertFalse(client.receive().get("continues", False))
            self.assertGreaterEqual(self.until(0), until)

    def test_lensctl_holds_until_control_c(self):
        process = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "--json", "hold", "a", "--for", "60s"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_for(lambda: self.held() is not None)
        self.assertIn("corrections wait for another", self.daemon.lensctl("status", "a").stdout)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=20 * PATIENCE)
        self.assertEqual(process.returncode, 130)
        self.assertTrue(json.loads(out.splitlines()[0])["atRest"])
        self.wait_for(lambda: self.held() is None)
        self.assertEqual(self.daemon.lensctl("hold", "a", "--for", "300ms").returncode, 0)
        self.assertEqual(self.daemon.lensctl("hold", "a", "--for", "2h").returncode, 64)


if __name__ == "__main__":
    unittest.main()
