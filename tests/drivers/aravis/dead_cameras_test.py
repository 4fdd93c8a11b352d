"""GigE cameras that are not there, not the ones meant, or gone, and what their neighbours notice of it: nothing.
Simulated cameras, loopback."""
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "daemon"))
from harness import BIN, LENS, PATIENCE, Client, Daemon  # noqa: E402
from own_network import Turn  # noqa: E402

QUICK = os.path.join(HERE, "quick.toml")
CONTROL_PORT = 3956
turn = Turn()


def setUpModule():
    turn.take()


def tearDownModule():
    turn.give()


class EagerDaemon(Daemon):
    """Does not wait until the lenses are open."""

    def wait_until_ready(self):
        pass


class Camera:
    """sim-gige-camera on loopback."""

    def __init__(self, serial, *arguments, scene=QUICK):
        self.process = subprocess.Popen(
            [os.path.join(BIN, "sim-gige-camera"), "--scene", scene, "--serial", serial, *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        if line != "ready\n":
            raise AssertionError("the simulated camera did not start: " + line)

    def kill(self):
        self.process.kill()
        self.process.wait(timeout=30 * PATIENCE)
        self.process.stdin.close()
        self.process.stdout.close()


def lens(name, where):
    return f'[[lens]]\nname = "{name}"\ndriver = "aravis"\n{where}\n'


class CamerasTest(unittest.TestCase):
    def camera(self, serial, *arguments, scene=QUICK):
        camera = Camera(serial, *arguments, scene=scene)
        self.addCleanup(lambda: camera.process.poll() is None and camera.kill())
        return camera

    def serve(self, config):
        daemon = EagerDaemon(config="version = 1\n" + config)
        self.addCleanup(daemon.stop)
        deadline = time.monotonic() + 20 * PATIENCE
        while True:
            try:
                self.client = Client(daemon.socket)
                break
            except OSError:
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.01)
        self.addCleanup(self.client.socket.close)

    def status(self):
        return {lens["name"]: lens for lens in self.client.call(LENS + "Status")["parameters"]["lenses"]}

    def wait_for(self, name, condition, seconds=20):
        """Seconds until it holds."""
        began = time.monotonic()
        while not condition(self.status()[name]):
            self.assertLess(time.monotonic() - began, seconds * PATIENCE, self.status()[name])
            time.sleep(0.01)
        return time.monotonic() - began


class DeadNeighbours(CamerasTest):
    def bind(self, address):
        bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bound.bind((address, CONTROL_PORT))
        self.addCleanup(bound.close)
        return bound

    def answer_with_garbage(self, bound):
        try:
            while True:
                _, asker = bound.recvfrom(1000)
                bound.sendto(os.urandom(64), asker)
        except OSError:
            pass

    def test_they_hold_nobody_up_and_each_has_its_own_reason(self):
        silent = [f"127.0.0.{number}" for number in range(31, 37)]
        for address in silent:
            self.bind(address)
        threading.Thread(target=self.answer_with_garbage, args=(self.bind("127.0.0.37"),), daemon=True).start()
        dead = {f"silent{number}": (f'address = "{address}"', f"nothing answers at {address}")
                for number, address in enumerate(silent)}
        dead |= {"stranger": ('address = "127.0.0.37"', "is no GigE Vision camera"),
                 "refuses": ('address = "127.0.0.38"', "is there and refuses"),
                 "name": ('address = "no-such-host.invalid"', 'there is no host "no-such-host.invalid"'),
                 "serial": ('serial = "NOSUCH"', 'there is no camera with serial "NOSUCH"'),
                 "serial2": ('serial = "NEITHER"', 'there is no camera with serial "NEITHER"'),
                 "id": ('id = "Nobody-None-1"', 'there is no camera with id "Nobody-None-1"')}
        self.camera("LIVE")
        self.serve("".join(lens(name, where) for name, (where, _) in dead.items()) +
                   lens("live", 'address = "127.0.0.1"'))
        took = self.wait_for("live", lambda live: live["connected"])
        print(f"{len(dead)} dead cameras: the live one is connected after {took:.2f} s", file=sys.stderr)
        self.assertLess(took, 0.7 + 0.3 * PATIENCE)
        began = time.monotonic()
        seen = set()
        while any(lens["connection"] != "absent" for name, lens in self.status().items() if name in dead):
            seen |= {lens["connection"] for lens in self.status().values()}
            self.assertLess(time.monotonic() - began, 20 * PATIENCE, self.status())
            time.sleep(0.02)
        self.assertLessEqual(seen, {"connected", "connecting", "absent"})
        for name, (_, reason) in dead.items():
            self.assertIn(reason, self.status()[name]["error"])


class AnotherCamera(CamerasTest):
    def test_another_one_or_one_without_its_lens_is_a_wrong_device(self):
        camera = self.camera("ONE")
        self.serve(lens("gige", 'address = "127.0.0.1"'))
        self.wait_for("gige", lambda gige: gige["connected"])
        for serial, arguments, reason in (("TWO", (), "with serial number TWO instead of"),
                                          ("ONE", ("--names", "none"), "it has no lens any more")):
            camera.kill()
            self.wait_for("gige", lambda gige: gige["connection"] == "absent")
            camera = self.camera(serial, *arguments)
            self.wait_for("gige", lambda gige: gige["connection"] == "wrongDevice")
            self.assertIn(reason, self.status()["gige"]["error"])
            refused = self.client.call(LENS + "Move", {"lens": "gige", "axis": "focus", "target": {"position": 1}})
            self.assertEqual(refused["error"], LENS + "Disconnected")
        camera.kill()
        self.camera("ONE")
        self.wait_for("gige", lambda gige: gige["connected"])
        self.assertEqual(self.status()["gige"]["connection"], "connected")

    def test_one_without_a_lens_is_a_wrong_device_from_the_start(self):
        self.camera("ONE", "--names", "none")
        self.serve(lens("gige", 'address = "127.0.0.1"'))
        self.wait_for("gige", lambda gige: gige["connection"] == "wrongDevice")
        self.assertIn("this device has no lens", self.status()["gige"]["error"])


class Vanished(CamerasTest):
    """What was known a moment ago is not claimed for long."""

    def vanish(self, how):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        slow = os.path.join(folder.name, "slow.toml")
        with open(slow, "w", encoding="utf-8") as file:
            file.write("version = 1\n[camera]\nwidth = 32\nheight = 24\n[lens]\nsteps = 4001\nspeed_steps_per_s = 500\n"
                       '[[surface]]\nkind = "wall"\ndistance_m = 1.2\nconstant = 0.5\n')
        camera = self.camera("ONE", scene=slow)
        self.serve(lens("gige", 'address = "127.0.0.1"'))
        self.wait_for("gige", lambda gige: gige["connected"])
        with Client(self.client.socket.getpeername()) as mover:
            mover.send(LENS + "Move", {"lens": "gige", "axis": "focus", "target": {"position": 0}})
            self.wait_for("gige", lambda gige: gige["axes"][0]["moving"])
            camera.process.send_signal(how)
            took = self.wait_for("gige", lambda gige: not gige["connected"])
            self.assertEqual(mover.receive()["error"], LENS + "Disconnected")
        focus = self.status()["gige"]["axes"][0]
        self.assertEqual((focus["moving"], focus["homed"], focus["lastKnown"]), (False, False, True))
        print(f"vanished by {how.name}: noticed after {took:.2f} s", file=sys.stderr)
        return took

    def test_of_a_camera_that_refuses(self):
        self.assertLess(self.vanish(signal.SIGKILL), 0.3 + 0.5 * PATIENCE)

    def test_of_a_camera_that_is_silent(self):
        self.assertLess(self.vanish(signal.SIGSTOP), 1 + 0.5 * PATIENCE)


if __name__ == "__main__":
    unittest.main(verbosity=2)
