"""A configured lens that is not plugged in: it is served as disconnected, and the others do not notice."""
import json
import os
import subprocess
import tempfile
import unittest

from harness import BIN, HERE, LENS, Daemon

CONFIG = f"""version = 1
[[lens]]
name = "gone"
driver = "lensconnect"
serial = "no such serial"
[[lens]]
name = "here"
driver = "sim"
scene = "{os.path.join(HERE, "small.toml")}"
"""


class AbsentLens(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(config=CONFIG)

    @classmethod
    def tearDownClass(cls):
        log = cls.daemon.log()
        status = cls.daemon.stop()
        if status != 0:
            raise AssertionError(f"lensd ended with {status}: {log}")

    def test_status_says_what_is_missing(self):
        with self.daemon.client() as client:
            gone, here = client.call(LENS + "Status")["parameters"]["lenses"]
        self.assertEqual((gone["name"], gone["connected"], gone["axes"]), ("gone", False, []))
        self.assertIn('no LensConnect lens with serial "no such serial" is plugged in', gone["error"])
        self.assertTrue(here["connected"])

    def test_it_is_listed(self):
        with self.daemon.client() as client:
            gone = client.call(LENS + "List")["parameters"]["lenses"][0]
        self.assertEqual((gone["driver"], gone["axes"], gone["camera"]), ("lensconnect", [], None))

    def test_every_command_answers_disconnected(self):
        calls = [("Move", {"axis": "focus", "target": {"native": 5}}), ("Home", {}), ("Stop", {}), ("Autofocus", {}),
                 ("Plan", {"request": {}})]
        with self.daemon.client() as client:
            for method, parameters in calls:
                reply = client.call(LENS + method, {"lens": "gone", **parameters})
                self.assertEqual(reply.get("error"), LENS + "Disconnected", (method, reply))
            reply = client.call(LENS + "Snapshot", {"lens": "gone"}, more=True)
            self.assertEqual(reply.get("error"), LENS + "Disconnected")

    def test_the_other_lens_moves(self):
        with self.daemon.client() as client:
            move = client.call(LENS + "Move", {"lens": "here", "axis": "focus", "target": {"native": 40}})
        self.assertTrue(move["parameters"]["move"]["reached"], move)

    def test_lensctl_exits_unavailable(self):
        done = self.daemon.lensctl("focus", "gone", "@10")
        self.assertEqual((done.returncode, done.stdout), (69, ""))
        self.assertIn("is plugged in", done.stderr)

    def test_watching_and_monitoring_it_works(self):
        with self.daemon.client() as client:
            client.send(LENS + "Monitor", {"lens": "gone"}, more=True)
            self.assertFalse(client.receive()["parameters"]["event"]["status"]["connected"])

    def test_check_config_says_so_and_passes(self):
        done = subprocess.run([os.path.join(BIN, "lensd"), "--config", self.daemon.config, "--check-config"],
                              capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("lensd would wait for it", done.stderr)


class WrongKeys(unittest.TestCase):
    def test_a_wrong_key_is_an_error_even_when_the_lens_is_not_there(self):
        for wrong in ('speed = 3', 'stop_value = -1', 'iris_pps = 0', 'concurrent_axes = 1', 'serial = 5'):
            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "lensd.toml")
                with open(path, "w", encoding="utf-8") as file:
                    file.write(f'version = 1\n[[lens]]\nname = "a"\ndriver = "lensconnect"\n{wrong}\n')
                done = subprocess.run([os.path.join(BIN, "lensd"), "--config", path, "--check-config"],
                                      capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 78, (wrong, done.stderr))
            self.assertIn("lensd.toml:5", done.stderr, wrong)


if __name__ == "__main__":
    unittest.main()
