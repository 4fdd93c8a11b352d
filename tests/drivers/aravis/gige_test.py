"""The daemon over GigE Vision: frames from the network, focus and iris through the camera's registers. Simulated
devices, loopback."""
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "daemon"))
from harness import BIN, PATIENCE, Daemon, driver_processes  # noqa: E402
from own_network import Turn  # noqa: E402

QUICK = os.path.join(HERE, "quick.toml")
OPTICS = """
[lens.optics]
focal_length_mm = 25
f_number = [1.4, 16]
extension_mm = [0.0, 1.6]
"""
# The wall stands at 1.2 m; half a depth of field at f/2 is 2 px N/(f Zs) = 0.022 D.
WALL_D, HALF_DOF_D = 1 / 1.2, 0.022
turn = Turn()


def setUpModule():
    turn.take()


def tearDownModule():
    turn.give()


class Camera:
    """sim-gige-camera on loopback."""

    def __init__(self, *arguments, scene=QUICK):
        self.process = subprocess.Popen(
            [os.path.join(BIN, "sim-gige-camera"), "--scene", scene, "--serial", "TEST1", *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        if line != "ready\n":
            raise AssertionError("the simulated camera did not start: " + line)

    def place_focus(self, steps):
        self.process.stdin.write(f"focus {steps}\n")
        self.process.stdin.flush()

    def stop(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(timeout=30 * PATIENCE)
        self.process.stdin.close()
        self.process.stdout.close()


def lens(extra=""):
    return ('version = 1\n[[lens]]\nname = "gige"\ndriver = "aravis"\nserial = "TEST1"\npacket_size = 8192\n'
            'io_timeout_ms = 3000\n' + extra + OPTICS)


class GigeTest(unittest.TestCase):
    LISTED = (True, True, "gige")  # a lens, a camera, and who uses it

    def start(self, *arguments, config=None, scene=QUICK):
        camera = Camera(*arguments, scene=scene)
        self.cameras = [camera]
        self.addCleanup(lambda: [c.stop() for c in self.cameras])
        self.daemon = Daemon(config=config or lens())
        self.addCleanup(self.daemon.stop)
        return camera

    def ask(self, *arguments):
        done = self.daemon.lensctl("--json", *arguments)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr + self.daemon.log())
        return json.loads(done.stdout)

    def focus_on_the_wall(self):
        self.ask("focus", "@3500")
        self.ask("aperture", "2")
        answer = self.ask("autofocus")
        self.assertTrue(answer["focused"], answer)
        self.assertAlmostEqual(answer["vergenceD"], WALL_D, delta=HALF_DOF_D)
        return answer

    def test_autofocus_closes_the_loop(self):
        self.start()
        self.focus_on_the_wall()

    def test_autofocus_with_positions_that_echo_and_lag(self):
        """Every search was refused: the motor had been moved by another program."""
        if type(self) is not GigeTest:
            self.skipTest("once is enough")
        self.start("--echo", "6", "--stale", "8", "--busy-late", "4")
        self.focus_on_the_wall()

    def test_a_plan_is_applied(self):
        self.start()
        answer = self.ask("plan", "--sharp", "wall=1.1m..1.3m:8um", "--apply")
        self.assertTrue(answer["feasible"], answer)
        self.assertTrue(answer["reached"]["feasible"], answer)
        self.assertEqual({move["axis"] for move in answer["applied"]}, {"focus", "iris"})
        for move in answer["applied"]:
            self.assertTrue(move["reached"], move)

    def test_with_lost_packets_and_no_resends(self):
        self.start("--lose", "0.01", config=lens("resend = false\n"))
        self.focus_on_the_wall()
        answer = self.ask("plan", "--sharp", "wall=1.1m..1.3m:8um", "--apply")
        self.assertTrue(answer["reached"]["feasible"], answer)

    def test_a_camera_that_goes_away_and_comes_back(self):
        camera = self.start()
        picture = os.path.join(self.daemon.folder.name, "a.png")
        self.ask("snapshot", "-o", picture)
        camera.stop(signal.SIGKILL)
        self.cameras.clear()
        deadline = time.monotonic() + 30 * PATIENCE
        while self.ask("status")["connected"]:
            self.assertLess(time.monotonic(), deadline, "the loss was never noticed")
            time.sleep(0.1)
        failed = self.daemon.lensctl("snapshot", "-o", picture)
        self.assertEqual(failed.returncode, 69, failed.stderr)
        self.cameras.append(Camera())
        back = time.monotonic()
        while self.daemon.lensctl("snapshot", "-o", picture).returncode != 0:
            self.assertLess(time.monotonic(), back + 10, "no frame within 10 s of its return")
            time.sleep(0.1)
        print(f"a frame {time.monotonic() - back:.1f} s after the camera's return", file=sys.stderr)
        self.assertIsNone(self.daemon.process.poll(), "the daemon was not restarted")
        self.focus_on_the_wall()

    def test_a_driver_in_a_process_of_its_own_and_its_end(self):
        self.start(config=lens('process = "own"\n'))
        self.focus_on_the_wall()
        host, = driver_processes(self.daemon)
        os.kill(host, signal.SIGKILL)
        picture = os.path.join(self.daemon.folder.name, "a.png")
        deadline = time.monotonic() + 30 * PATIENCE
        while host in driver_processes(self.daemon) or self.daemon.lensctl("snapshot", "-o", picture).returncode != 0:
            self.assertLess(time.monotonic(), deadline, "it never came back: " + self.daemon.log())
            time.sleep(0.1)
        self.assertIn("the driver ended: signal 9 in ", self.daemon.log())
        self.focus_on_the_wall()

    def test_it_is_listed(self):
        self.start()
        listed = self.daemon.lensctl("devices")
        self.assertEqual(listed.returncode, 0, listed.stderr)
        self.assertIn('serial = "TEST1"', listed.stdout)
        device, = self.ask("devices")
        self.assertEqual((device["lens"], device["camera"], device["usedBy"]), (True, True, "gige"))
        self.assertTrue(self.ask("focus", "@2000")["reached"])  # to look was not to take it away

    def test_devices_beside_a_connected_camera_take_a_second(self):
        """A search takes a second. It opened a connected camera a second time, which took five more: none obeys two."""
        self.start()
        deadline = time.monotonic() + 30 * PATIENCE
        while not self.ask("status")["connected"]:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.05)
        seconds = []
        for _ in range(3):
            began = time.monotonic()
            device, = (one for one in self.ask("devices") if one["driver"] == "aravis")
            seconds.append(time.monotonic() - began)
            self.assertEqual((device["lens"], device["camera"], device["usedBy"]), self.LISTED)
        print(f"devices beside a connected camera: {min(seconds):.2f} s", file=sys.stderr)
        self.assertLess(min(seconds), 3.0)

    def without_daemon(self, *arguments):
        return subprocess.run([os.path.join(BIN, "lensctl"), "--socket", "/nowhere", "devices", *arguments],
                              capture_output=True, text=True, timeout=120, check=False)

    def test_without_a_daemon_its_lens_is_found_and_configured(self):
        self.cameras = [Camera()]
        self.addCleanup(lambda: [c.stop() for c in self.cameras])
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "new.toml")
            found = self.without_daemon("--json", "--write-config", file)
            self.assertEqual(found.returncode, 0, found.stderr)
            device, = json.loads(found.stdout)
            self.assertEqual((device["lens"], device["camera"], device["usedBy"]), (True, True, None))
            again = self.without_daemon("--write-config", file)
            self.assertEqual((again.returncode, again.stdout), (73, ""))
            with open(file, encoding="utf-8") as text:
                self.daemon = Daemon(config=text.read())
        self.addCleanup(self.daemon.stop)
        self.assertTrue(self.ask("focus", "@3500")["reached"])

    def test_a_camera_without_a_lens_is_offered_as_a_camera(self):
        self.cameras = [Camera("--names", "none")]
        self.addCleanup(lambda: [c.stop() for c in self.cameras])
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "new.toml")
            device, = json.loads(self.without_daemon("--json", "--write-config", file).stdout)
            self.assertEqual((device["lens"], device["camera"]), (False, True))
            self.assertTrue(device["config"].startswith("[lens.camera]"), device)
            with open(file, encoding="utf-8") as text:
                self.assertIn("\n# [lens.camera]\n", text.read())


class LiquidLensTest(GigeTest):
    """FocalPower instead of FocusStepper."""

    def start(self, *arguments, **unused):
        config = lens().replace("extension_mm = [0.0, 1.6]", "liquid = true\npower_d = [40, 46]")
        config = config.replace("f_number = [1.4, 16]", "f_number = [2, 8]")
        return super().start(*arguments, config=config, scene=os.path.join(HERE, "liquid.toml"))

    def focus_on_the_wall(self):
        self.ask("focus", "@45.5")
        self.ask("aperture", "2")
        answer = self.ask("autofocus")
        self.assertTrue(answer["focused"], answer)
        self.assertAlmostEqual(answer["vergenceD"], WALL_D, delta=HALF_DOF_D)

    def test_a_plan_is_applied(self):
        self.start()
        answer = self.ask("plan", "--sharp", "wall=1.1m..1.3m:8um", "--apply")
        self.assertTrue(answer["reached"]["feasible"], answer)
        self.assertAlmostEqual(answer["sensorDistanceMm"], 25, places=9)
        power_d = next(move["position"] for move in answer["applied"] if move["axis"] == "focus")
        # The plane in focus is that of the power above 1/Zs, and both ends of the wall are as blurred as A allows.
        self.assertAlmostEqual(power_d - 40, answer["focalPlaneD"], places=6)
        aperture_m = answer["apertureDiameterMm"] * 1e-3
        for distance_m in (1.1, 1.3):
            blur_um = abs(aperture_m * (0.025 * (power_d - 1 / distance_m) - 1)) * 1e6
            self.assertLessEqual(blur_um, 8)
            self.assertGreater(blur_um, 7)

    def test_focus_says_where(self):
        self.start()
        answer = self.ask("focus", "20cm")
        self.assertTrue(answer["reached"], answer)
        self.assertAlmostEqual(answer["vergenceD"], 5, delta=0.002)
        refused = self.daemon.lensctl("focus", "10cm")
        self.assertNotEqual(refused.returncode, 0)

    test_with_lost_packets_and_no_resends = None
    test_a_driver_in_a_process_of_its_own_and_its_end = None
    test_a_camera_that_goes_away_and_comes_back = None
    test_it_is_listed = None
    test_without_a_daemon_its_lens_is_found_and_configured = None
    test_a_camera_without_a_lens_is_offered_as_a_camera = None


class ModbusFocusTest(GigeTest):
    """The focus motor is a Modbus drive, the camera a GenICam one without a lens: one rig."""
    LISTED = (False, True, "station")

    def follow(self, drive, camera):
        """The drive turns the ring of the lens before the simulated camera."""
        while not self.ended:
            drive.stdin.write("position 1\n")
            drive.stdin.flush()
            camera.place_focus(drive.stdout.readline().strip())
            time.sleep(0.002)

    def setUp(self):
        self.ended = False

    def make_scene(self):
        with open(QUICK, encoding="utf-8") as file:
            text = file.read()
        textures = os.path.abspath(os.path.join(HERE, "..", "..", "..", "scenes", "textures"))
        text = text.replace("../../../scenes/textures", textures)
        text = text.replace("speed_steps_per_s = 20000", "speed_steps_per_s = 10000000")
        text = text.replace("acceleration_steps_per_s2 = 400000", "acceleration_steps_per_s2 = 10000000000")
        text = text.replace("f_number = [1.4, 16.0]", "f_number = [2.0, 2.0]")
        file = tempfile.NamedTemporaryFile("w", suffix=".toml", delete=False)
        self.addCleanup(os.unlink, file.name)
        with file:
            file.write(text)
        return file.name

    def start(self, *arguments, **unused):
        drive = subprocess.Popen([os.path.join(BIN, "sim-modbus-drive"), "--tcp", "0", "--profile", "moons"],
                                 stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        host = drive.stdout.readline().split()[-1]
        camera = Camera("--names", "none", *arguments, scene=self.make_scene())
        follower = threading.Thread(target=self.follow, args=(drive, camera))
        follower.start()

        def end():
            self.ended = True
            follower.join()
            drive.stdin.close()
            drive.terminate()
            drive.wait(timeout=30 * PATIENCE)
            drive.stdout.close()
            camera.stop()

        self.addCleanup(end)
        config = f"""version = 1
[[bus]]
name = "ring"
driver = "modbus"
host = "{host}"
response_timeout_ms = 500
[[lens]]
name = "station"
driver = "modbus"
bus = "ring"
[lens.drives.focus]
unit = 1
profile = "moons"
range = [0, 4000]
[lens.focus]
direction = "near-positive"
settle_ms = 200
[lens.optics]
focal_length_mm = 25
f_number = [2, 2]
extension_mm = [0.0, 1.6]
[lens.camera]
driver = "aravis"
serial = "TEST1"
packet_size = 8192
io_timeout_ms = 3000
resend = false
"""
        self.daemon = Daemon(config=config)
        self.addCleanup(self.daemon.stop)
        return camera

    def focus_on_the_wall(self):
        if not self.ask("status")["axes"][0]["homed"]:
            self.ask("home", "focus")
        self.ask("focus", "@3500")
        answer = self.ask("autofocus")
        self.assertTrue(answer["focused"], answer)
        self.assertAlmostEqual(answer["vergenceD"], WALL_D, delta=HALF_DOF_D)

    def test_a_plan_is_applied(self):
        self.start()
        if not self.ask("status")["axes"][0]["homed"]:
            self.ask("home", "focus")
        answer = self.ask("plan", "--sharp", "wall=1.15m..1.25m:12um", "--apply")
        self.assertTrue(answer["reached"]["feasible"], answer)
        self.assertEqual([move["axis"] for move in answer["applied"]], ["focus"])

    def test_with_lost_packets_and_no_resends(self):
        self.start("--lose", "0.01")
        self.focus_on_the_wall()

    test_a_driver_in_a_process_of_its_own_and_its_end = None
    test_a_camera_that_goes_away_and_comes_back = None
    test_it_is_listed = None
    test_without_a_daemon_its_lens_is_found_and_configured = None
    test_a_camera_without_a_lens_is_offered_as_a_camera = None


if __name__ == "__main__":
    unittest.main(verbosity=2)
