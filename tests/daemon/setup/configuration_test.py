"""Starting and refusing to start: configurations, sockets, exit statuses."""
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, Client  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")
GOOD = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{SCENE}"\n'


class Configuration(unittest.TestCase):

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.file = os.path.join(self.folder.name, "lensd.toml")

    def lensd(self, *arguments):
        return subprocess.run([os.path.join(BIN, "lensd"), *arguments], capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)

    def check(self, text, name=None):
        path = name or self.file
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return self.lensd("--config", self.file, "--check-config")

    def test_a_drop_in_allows_the_configured_drivers_devices_alone(self):
        """It takes the place of the unit's own list: nothing is in it that no configured driver opens."""
        usb, camera = '[[lens]]\nname = "u"\ndriver = "lensconnect"\nserial = "X"\n', '[lens.camera]\ndriver = "uvc"\nserial = "Y"\n'
        for text, classes in (("version = 1\n", []), (GOOD, []), (GOOD + usb, ["char-hidraw"]),
                              (GOOD + usb + camera, ["char-hidraw", "char-usb_device"])):
            with self.subTest(classes=classes):
                with open(self.file, "w", encoding="utf-8") as file:
                    file.write(text)
                printed = self.lensd("--config", self.file, "--print-unit-drop-in")
                self.assertEqual(printed.returncode, 0, printed.stderr)
                comment, section, reset, *lines = printed.stdout.splitlines()
                self.assertTrue(comment.startswith("#") and self.file in comment, comment)
                self.assertEqual((section, reset), ("[Service]", "DeviceAllow="))
                self.assertEqual(lines, [f"DeviceAllow={name} rw" for name in classes])
                with open(os.path.join(HERE, "..", "..", "systemd", "lensd.service.in"), encoding="utf-8") as unit:
                    self.assertLessEqual(set(lines), set(unit.read().splitlines()))
        self.assertEqual(self.lensd("--config", self.file + ".no", "--print-unit-drop-in").returncode, 78)

    def test_good_ones(self):
        for text in ("version = 1\n", GOOD, GOOD + 'start = "home"\ndistance_from = "sensor"\n[lens.focus]\n'
                     'approach = "far"\nsettle_ms = 8\nlimits = [10, 3000]\n[lens.optics]\nfocal_length_mm = 25\n'
                     'f_number = [1.4, 16]\nextension_mm = [0.0, 1.6]\nprincipal_gap_mm = 2\n'):
            with self.subTest(text=text):
                done = self.check(text)
                self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_a_simulated_lens_needs_no_data_sheet_beside_its_calibration(self):
        only = '[lens.optics]\ncalibration = "later.toml"\nprincipal_gap_mm = 2\n'
        self.assertEqual(self.check(GOOD + only).returncode, 0)
        daemon = Daemon(config=GOOD + only)
        try:
            with daemon.client() as client:
                optics = client.call(LENS + "List")["parameters"]["lenses"][0]["optics"]
            self.assertEqual((optics["focalLengthMm"], optics["fNumberMin"], optics["extensionMaxMm"]), (25, 1.4, 1.6))
            self.assertTrue(optics["calibrationFile"].endswith("/later.toml"))
        finally:
            self.assertEqual(daemon.stop(), 0)
        # All of it or none, and no other driver knows it.
        half = self.check(GOOD + only + "f_number = [1.4, 16]\n")
        self.assertEqual(half.returncode, 78)
        self.assertIn("focal_length_mm", half.stderr)
        real = self.check('version = 1\n[[lens]]\nname = "a"\ndriver = "lensconnect"\nserial = "x"\n' + only)
        self.assertEqual(real.returncode, 78)
        self.assertIn("focal_length_mm", real.stderr)

    def test_every_lens_with_a_mistake_is_told(self):
        done = self.check(GOOD + "bogus = 1\n" + GOOD.split("\n", 1)[1].replace('"a"', '"b"') +
                          GOOD.split("\n", 1)[1].replace('"a"', '"c"').replace("small", "no-such"))
        self.assertEqual(done.returncode, 78, done.stderr)
        self.assertRegex(done.stderr, r"lensd\.toml:6: .*bogus(.|\n)*no-such")

    def test_bad_ones_name_the_place_and_the_reason(self):
        for text, line, words in (
                ("", None, "version"), ("version = 2\n", 1, "version 1"), ("version = \n", 1, ""),
                ("version = 1\nbogus = 1\n", 2, "bogus"),
                (GOOD + "bogus = 1\n", 6, "bogus"),
                (GOOD.replace('"a"', '"A"'), 3, "name"), (GOOD.replace('"a"', '"focus"'), 3, "axis"),
                (GOOD.replace('"a"', '"inf"'), 3, "quantity"), (GOOD.replace('"sim"', '"warp"'), 4, "sim"),
                (GOOD + 'start = "soon"\n', 6, "keep"),
                (GOOD + 'bus = "x"\n', 6, "bus"), ('version = 1\n[[bus]]\nname = "x"\n', 2, "bus"),
                (GOOD + "[lens.optics]\nfocal_length_mm = 25\nf_number = [1, 2]\nextension_mm = [0, 1]\n"
                 'calibration = 3\n', 10, "calibration"),
                (GOOD + "[lens.focus]\nlimit = [1, 2]\n", 7, "limit"),
                (GOOD + '[lens.camera]\ndriver = "warp"\n', 7, "warp"),
                (GOOD + f'[lens.camera]\ndriver = "sim"\nscene = "{SCENE}"\n', 6, "camera"),
                (GOOD + GOOD.split("\n", 1)[1], 6, '"a"'), (GOOD.replace("small", "no-such"), None, "no-such")):
            with self.subTest(text=text):
                done = self.check(text)
                self.assertEqual(done.returncode, 78, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(f"lensd.toml:{line}:" if line else "lensd.toml", done.stderr)
                self.assertIn(words, done.stderr)

    def test_drop_ins_add_lenses_and_paths_are_relative_to_their_file(self):
        self.check(GOOD)
        os.symlink(SCENE, os.path.join(self.folder.name, "scene.toml"))
        extra = os.path.join(self.file + ".d", "20-more.toml")
        done = self.check(GOOD.replace('"a"', '"more"').replace(SCENE, "../scene.toml"), extra)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        done = self.check(GOOD, extra)
        self.assertEqual(done.returncode, 78)
        self.assertIn("20-more.toml:2", done.stderr)

    def test_command_line(self):
        self.assertEqual(self.lensd("--version").returncode, 0)
        self.assertEqual(self.lensd("--bogus").returncode, 64)
        missing = self.lensd("--config", "/no/such/file")
        self.assertEqual(missing.returncode, 78)
        self.assertIn("/no/such/file", missing.stderr)

    def test_no_lens_is_a_valid_state(self):
        daemon = Daemon(config="version = 1\n")
        self.addCleanup(daemon.stop)
        with daemon.client() as client:
            self.assertEqual(client.call(LENS + "List")["parameters"]["lenses"], [])
            self.assertEqual(client.call(LENS + "Move", {"axis": "focus", "target": {"position": 1}})["error"],
                             LENS + "LensNotFound")
        for arguments, status in ((["list"], 0), (["status"], 0), (["focus", "1m"], 68)):
            self.assertEqual(daemon.lensctl(*arguments).returncode, status)

    def test_a_lens_that_never_answers_is_served_and_said_not_to_be_homed(self):
        scene = os.path.join(self.folder.name, "broken.toml")
        with open(SCENE, encoding="utf-8") as whole, open(scene, "w", encoding="utf-8") as broken:
            broken.write(whole.read() + '[[fault]]\nat_ms = 0\nkind = "disconnect"\n')
        for start, expected in (("home", True), ("keep", False)):
            daemon = Daemon(config=GOOD.replace(SCENE, scene) + f'start = "{start}"\n')
            try:
                deadline = time.monotonic() + 10 * PATIENCE
                while "not homed" not in daemon.log() and expected and time.monotonic() < deadline:
                    time.sleep(0.02)
                self.assertEqual("not homed" in daemon.log(), expected, daemon.log())
                with daemon.client() as client:
                    lens = client.call(LENS + "List")["parameters"]["lenses"][0]
                    self.assertEqual([(a["minimum"], a["maximum"]) for a in lens["axes"]], [(0, 4000), (0, 99)])
                    self.assertIsNotNone(client.call(LENS + "Status")["parameters"]["lenses"][0]["error"])
                    plan = client.call(LENS + "Plan", {"request": {"limits": []}})
                    self.assertTrue(plan["parameters"]["plan"]["feasible"])
                    move = client.call(LENS + "Move", {"axis": "focus", "target": {"position": 5}})
                    self.assertEqual(move["error"], LENS + "Disconnected")
            finally:
                self.assertEqual(daemon.stop(), 0)

    def test_on_demand_the_first_move_searches_the_reference(self):
        daemon = Daemon(config=GOOD + 'start = "on-demand"\n')

        def homed():
            axes = json.loads(daemon.lensctl("status", "--json").stdout)["axes"]
            return next(axis["homed"] for axis in axes if axis["axis"] == "focus")

        try:
            self.assertFalse(homed())
            moved = json.loads(daemon.lensctl("focus", "@300", "--json").stdout)
            self.assertTrue(moved["reached"], moved)
            self.assertTrue(homed())
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_one_lens_needs_no_name_and_others_do(self):
        one = Daemon(("solo",))
        self.addCleanup(one.stop)
        self.assertEqual(one.lensctl("focus", "@100").returncode, 0)
        self.assertEqual(one.lensctl("focus", "solo", "+5").returncode, 0)
        self.assertEqual(one.lensctl("focus", "-5").returncode, 0)
        self.assertIn('"position":100', one.lensctl("--json", "status").stdout)
        wrong = one.lensctl("focus", "other", "@100")
        self.assertEqual((wrong.returncode, wrong.stdout), (68, ""))
        self.assertEqual(wrong.stderr.count("\n"), 1)
        self.assertIn("solo", wrong.stderr)

    def test_the_socket_of_another_daemon_is_left_alone_and_a_dead_one_replaced(self):
        first = Daemon(())
        second = self.lensd("--socket", first.socket)
        self.assertEqual(second.returncode, 69, second.stderr)
        self.assertIn(first.socket, second.stderr)
        with first.client() as client:
            self.assertIn("parameters", client.call(LENS + "List"))
        first.process.send_signal(signal.SIGKILL)
        first.process.wait()
        self.assertTrue(os.path.exists(first.socket))
        first.process = subprocess.Popen([os.path.join(BIN, "lensd"), "--socket", first.socket], stderr=first.errors)
        first.wait_until_ready()
        path = first.socket
        self.assertEqual(first.stop(), 0)
        self.assertFalse(os.path.exists(path))

    def test_a_socket_made_anew_outlives_the_daemon_before(self):
        first = Daemon()
        os.unlink(first.socket)
        with socket.socket(socket.AF_UNIX) as newer:
            newer.bind(first.socket)
            newer.listen()
            first.process.send_signal(signal.SIGTERM)
            self.assertEqual(first.process.wait(timeout=30 * PATIENCE), 0)
            with socket.socket(socket.AF_UNIX) as client:
                client.connect(first.socket)
        first.stop()

    def test_other_files_are_not_replaced(self):
        with open(self.file, "w", encoding="utf-8"):
            pass
        done = self.lensd("--socket", self.file)
        self.assertEqual(done.returncode, 74, done.stderr)
        self.assertTrue(os.path.isfile(self.file))

    def test_a_socket_that_is_not_there(self):
        done = subprocess.run([os.path.join(BIN, "lensctl"), "--socket", "/no/such/socket", "list"],
                              capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (69, ""))
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertIn("/no/such/socket", done.stderr)

    def test_socket_activation_and_readiness(self):
        path = os.path.join(self.folder.name, "s")
        listening = socket.socket(socket.AF_UNIX)
        listening.bind(path)
        listening.listen()
        notify_path = os.path.join(self.folder.name, "notify")
        notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        notify.bind(notify_path)
        notify.settimeout(20 * PATIENCE)
        client = Client(path)
        client.send("org.varlink.service.GetInfo")  # before anybody serves

        code = ("import os,sys; fd=int(sys.argv[1]); os.dup2(fd,3); os.environ['LISTEN_PID']=str(os.getpid());"
                "os.execv(sys.argv[2],sys.argv[2:])")
        process = subprocess.Popen(
            ["python3", "-c", code, str(listening.fileno()), os.path.join(BIN, "lensd")],
            pass_fds=[listening.fileno()], stderr=subprocess.DEVNULL,
            env={**os.environ, "LISTEN_FDS": "1", "NOTIFY_SOCKET": notify_path})
        try:
            self.assertIn("READY=1", notify.recv(1000).decode())
            self.assertEqual(client.receive()["parameters"]["product"], "lensd")
        finally:
            process.terminate()
            self.assertEqual(process.wait(timeout=30 * PATIENCE), 0)
        self.assertIn("STOPPING=1", notify.recv(1000).decode())
        self.assertTrue(os.path.exists(path))  # systemd's, not ours to remove
        for each in (client.socket, listening, notify):
            each.close()


if __name__ == "__main__":
    unittest.main()
