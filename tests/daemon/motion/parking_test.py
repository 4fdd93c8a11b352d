"""The end of lensd: axes that have a place to park go there, once, within their time, and only where that is safe."""
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon  # noqa: E402

SMALL = os.path.join(HERE, "small.toml")


class ParkingTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-park-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")

    def scene(self, name, **replaced):
        path = os.path.join(self.folder.name, name)
        with open(SMALL, encoding="utf-8") as small, open(path, "w", encoding="utf-8") as scene:
            text = small.read()
            for key, value in replaced.items():
                text = "\n".join(f"{key} = {value}" if line.startswith(key) else line for line in text.splitlines())
            scene.write(text + "\n")
        return path

    def lens(self, name, scene=SMALL, start="keep", focus="park = 100\n"):
        return f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{scene}"\nstart = "{start}"\n[lens.focus]\n{focus}'

    def start(self, *lenses):
        self.config = "version = 1\n" + "".join(lenses)
        daemon = Daemon(config=self.config, arguments=("--state", self.state))
        self.addCleanup(self.finish, daemon)
        return daemon

    @staticmethod
    def finish(daemon):
        if daemon.process.poll() is None:
            daemon.stop()
        elif not daemon.errors.closed:
            daemon.errors.close()
            daemon.folder.cleanup()

    def end(self, daemon):
        """Waits for its end, and gives the log and how long that took."""
        began = time.monotonic()
        self.assertEqual(daemon.process.wait(timeout=60 * PATIENCE), 0, daemon.log())
        return daemon.log(), time.monotonic() - began

    def remembered(self, lens):
        with open(os.path.join(self.state, f"{lens}.position.json"), encoding="utf-8") as file:
            return json.load(file)["axes"]

    def move(self, client, lens, to):
        return client.call(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": to}})

    def moving(self, daemon, lens, target):
        deadline = time.monotonic() + 20 * PATIENCE
        while True:
            with daemon.client() as client:
                status = client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]
            focus = next(axis for axis in status["axes"] if axis["axis"] == "focus")
            if focus["moving"] and focus["target"] == target:
                return focus
            self.assertLess(time.monotonic(), deadline, status)
            time.sleep(0.01)

    def test_term_parks_what_is_to_park_and_nothing_else(self):
        daemon = self.start(self.lens("a"), self.lens("b", focus=""), self.lens("c", focus="park = 250\n[lens.iris]\npark = 3\n"))
        with daemon.client() as client:
            for lens in "abc":
                self.assertTrue(self.move(client, lens, 800)["parameters"]["move"]["reached"])
        daemon.process.send_signal(signal.SIGTERM)
        log, _ = self.end(daemon)
        self.assertNotIn("parked", log)
        self.assertEqual([self.remembered(lens)["focus"]["position"] for lens in "abc"], [100, 800, 250])
        self.assertEqual([self.remembered(lens)["focus"]["inMotion"] for lens in "abc"], [False] * 3)
        self.assertEqual(self.remembered("c")["iris"]["position"], 3)

    def test_callers_are_answered_before_and_nobody_moves_it_meanwhile(self):
        daemon = self.start(self.lens("a", focus="park = 3900\n"))
        with daemon.client() as client, daemon.client() as other:
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
            self.moving(daemon, "a", 4000)
            daemon.process.send_signal(signal.SIGTERM)
            self.assertEqual(client.receive()["error"], LENS + "Cancelled")
            self.moving(daemon, "a", 3900)
            self.assertEqual(self.move(other, "a", 5)["error"], LENS + "Cancelled")
            self.end(daemon)
        self.assertEqual(self.remembered("a")["focus"]["position"], 3900)

    def test_anyone_may_stop_what_parks(self):
        daemon = self.start(self.lens("a", focus="park = 4000\n"))
        with daemon.client() as client:
            daemon.process.send_signal(signal.SIGTERM)
            self.moving(daemon, "a", 4000)
            self.assertEqual(client.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
        log, _ = self.end(daemon)
        self.assertIn("focus is not parked: stopped", log)
        self.assertLess(self.remembered("a")["focus"]["position"], 4000)

    def test_a_second_term_gives_it_up(self):
        daemon = self.start(self.lens("a", scene=self.scene("slow.toml", speed_steps_per_s=50), focus="park = 4000\n"))
        daemon.process.send_signal(signal.SIGTERM)
        self.moving(daemon, "a", 4000)
        daemon.process.send_signal(signal.SIGTERM)
        log, took = self.end(daemon)
        self.assertIn("focus is not parked", log)
        self.assertLess(took, 5 * PATIENCE)
        self.assertLess(self.remembered("a")["focus"]["position"], 1000)

    def test_it_takes_no_longer_than_it_may(self):
        daemon = self.start(self.lens("a", scene=self.scene("slow.toml", speed_steps_per_s=50), focus="park = 4000\n"))
        daemon.process.send_signal(signal.SIGTERM)
        log, took = self.end(daemon)
        self.assertIn("not parked within 10 s", log)
        self.assertGreater(took, 9)
        self.assertLess(took, 10 + 3 * PATIENCE)

    def test_what_does_not_know_where_it_stands_complains_or_was_stopped_for_good_stays(self):
        stuck = self.scene("stuck.toml")
        with open(stuck, "a", encoding="utf-8") as file:
            file.write('[[fault]]\nat_ms = 0\nkind = "disconnect"\n')
        daemon = self.start(self.lens("a", start="on-demand"), self.lens("b"), self.lens("c", scene=stuck),
                            self.lens("d", focus="park = 1e9\n"))
        with daemon.client() as client:
            client.call(LENS + "Stop", {"lens": "b", "latch": True})
        daemon.process.send_signal(signal.SIGTERM)
        log, took = self.end(daemon)
        for lens, why in (("a", "not homed"), ("b", "stopped for good"), ("c", "does not answer"), ("d", "1000000000 steps")):
            self.assertTrue(any(f"{lens}: focus is not parked: " in line and why in line for line in log.splitlines()),
                            (lens, why, log))
        self.assertLess(took, 5 * PATIENCE)

    def test_a_kill_parks_nothing_and_neither_does_what_systemd_runs_after_it(self):
        daemon = self.start(self.lens("a"))
        with daemon.client() as client:
            self.assertTrue(self.move(client, "a", 700)["parameters"]["move"]["reached"])
        daemon.process.kill()
        daemon.process.wait(timeout=30 * PATIENCE)
        before = self.remembered("a")
        stopped = subprocess.run([os.path.join(BIN, "lensd"), "--stop-motors", "--config", daemon.config], check=False,
                                 capture_output=True, text=True, env={**os.environ, "SERVICE_RESULT": "signal"})
        self.assertEqual(stopped.returncode, 0, stopped.stderr)
        self.assertNotIn("park", stopped.stderr)
        self.assertEqual(self.remembered("a"), before)
        self.assertEqual(before["focus"]["position"], 700)

    def test_a_place_outside_its_limits_is_refused_when_it_is_read(self):
        config = os.path.join(self.folder.name, "wrong.toml")
        with open(config, "w", encoding="utf-8") as file:
            file.write("version = 1\n" + self.lens("a", focus="limits = [200, 300]\npark = 100\n"))
        checked = subprocess.run([os.path.join(BIN, "lensd"), "--check-config", "--config", config], check=False,
                                 capture_output=True, text=True)
        self.assertEqual(checked.returncode, 78)
        self.assertRegex(checked.stderr, r"wrong\.toml:\d+: .*park")


if __name__ == "__main__":
    unittest.main()
