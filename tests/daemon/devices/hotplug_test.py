"""A configured lens that is not plugged in: it is served as disconnected, and the others do not notice."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, Daemon  # noqa: E402

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
        calls = [("Move", {"axis": "focus", "target": {"position": 5}}), ("Home", {}), ("Stop", {}), ("Autofocus", {}),
                 ("Plan", {"request": {}})]
        with self.daemon.client() as client:
            for method, parameters in calls:
                reply = client.call(LENS + method, {"lens": "gone", **parameters})
                self.assertEqual(reply.get("error"), LENS + "Disconnected", (method, reply))
            reply = client.call(LENS + "Snapshot", {"lens": "gone"}, more=True)
            self.assertEqual(reply.get("error"), LENS + "Disconnected")

    def test_the_other_lens_moves(self):
        with self.daemon.client() as client:
            move = client.call(LENS + "Move", {"lens": "here", "axis": "focus", "target": {"position": 40}})
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


class Advice(unittest.TestCase):
    """lensctl devices and doctor."""

    def doctor(self, *arguments, **options):
        done = subprocess.run([os.path.join(BIN, "lensctl"), "doctor", "--json", *arguments], capture_output=True,
                              text=True, timeout=120, check=False, **options)
        findings = json.loads(done.stdout)
        for finding in findings:
            self.assertEqual(finding["status"] == "ok", finding["remedy"] is None, finding)
        problems = any(finding["status"] == "problem" for finding in findings)
        self.assertEqual(done.returncode, 1 if problems else 0, done.stdout)
        return {finding["check"]: finding for finding in findings}

    def test_a_missing_lens_is_a_problem_and_the_other_is_not(self):
        daemon = Daemon(config=CONFIG)
        try:
            found = self.doctor("--socket", daemon.socket)
            devices = daemon.lensctl("devices", "--json")
        finally:
            daemon.stop()
        self.assertEqual(found["lens gone"]["status"], "problem")
        for check in ("socket", "daemon", "configuration", "lens here"):
            self.assertEqual(found[check]["status"], "ok", found)
        self.assertEqual(devices.returncode, 0, devices.stderr)
        for device in json.loads(devices.stdout):  # whatever this machine has
            self.assertIn(f'driver = "{device["driver"]}"', device["config"])

    def test_devices_are_looked_for_without_a_daemon(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "new.toml")
            done = subprocess.run([os.path.join(BIN, "lensctl"), "--socket", os.path.join(folder, "s"), "devices", "--json",
                                   "--write-config", file], capture_output=True, text=True, timeout=120, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("no daemon", done.stderr)
            self.assertIsInstance(json.loads(done.stdout), list)
            checked = subprocess.run([os.path.join(BIN, "lensd"), "--check-config", "--config", file], capture_output=True,
                                     text=True, timeout=120, check=False)
            self.assertEqual(checked.returncode, 0, checked.stderr)
            for _ in range(5):  # cameras of other tests come and go
                printed = subprocess.run([os.path.join(BIN, "lensctl"), "--socket", os.path.join(folder, "s"), "devices",
                                          "--write-config", "-"], capture_output=True, text=True, timeout=120, check=False, cwd=folder)
                with open(file, encoding="utf-8") as text:
                    kept = text.read()
                if printed.stdout.strip() == kept.strip():
                    break
                os.remove(file)
                subprocess.run([os.path.join(BIN, "lensctl"), "--socket", os.path.join(folder, "s"), "devices", "--write-config", file],
                               capture_output=True, timeout=120, check=True)
            self.assertEqual(printed.stdout.strip(), kept.strip())
            self.assertEqual(os.listdir(folder), ["new.toml"])

    def test_a_healthy_daemon_has_no_problem(self):
        daemon = Daemon(("a",))
        try:
            found = self.doctor("--socket", daemon.socket)
        finally:
            daemon.stop()
        self.assertEqual(found["lens a"]["status"], "ok")

    def test_without_a_daemon_the_file_is_checked(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "lensd.toml")
            for text, status in (("version = 1\n", "ok"), ("version = 1\nlens = 3\n", "problem"), (CONFIG, "warning")):
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                found = self.doctor("--socket", os.path.join(folder, "s"), "--config", path)
                self.assertEqual(found["socket"]["status"], "problem")
                self.assertEqual(found["configuration"]["status"], status, (text, found))

    @unittest.skipUnless(os.geteuid() == 0, "needs root to become somebody else")
    def test_a_forbidden_socket_names_the_group(self):
        daemon = Daemon(("a",))
        try:
            os.chmod(daemon.folder.name, 0o755)
            os.chmod(daemon.socket, 0o660)
            os.chown(daemon.socket, 0, 44)  # video
            found = self.doctor("--socket", daemon.socket, user=65534, group=65534, extra_groups=[])
            self.assertEqual(found["socket"]["status"], "problem")
            self.assertIn("usermod -aG video", found["socket"]["remedy"])
            found = self.doctor("--socket", daemon.socket, user=65534, group=65534, extra_groups=[44])
            self.assertEqual(found["socket"]["status"], "ok")
        finally:
            daemon.stop()


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
