"""Sixteen lenses, of which eight are dead in different ways: nobody waits for those."""
import contextlib
import os
import socket
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, PATIENCE, Client, Daemon  # noqa: E402

# Threads that hang in a device or on a disk are left behind at the end, on purpose.
os.environ["TSAN_OPTIONS"] = os.environ.get("TSAN_OPTIONS", "") + " report_thread_leaks=0"

LIVE = "abcdefgh"
DRIVE = '[lens.drives.focus]\nunit = 1\nprofile = "generic"\nrange = [-1000, 1000]\n'


class EagerDaemon(Daemon):
    """Does not wait until the lenses are open."""

    def wait_until_ready(self):
        pass

    def wait_for_socket(self):
        """Until it listens: the file is there a moment sooner."""
        deadline = time.monotonic() + 20 * PATIENCE
        while time.monotonic() < deadline:
            with contextlib.suppress(OSError), self.client():
                return
            time.sleep(0.01)


def answer_with_garbage(listening):
    def serve(client):
        try:
            while client.recv(100):
                client.sendall(os.urandom(64))
        except OSError:
            pass
    while True:
        try:
            client, _ = listening.accept()
        except OSError:
            return
        threading.Thread(target=serve, args=(client,), daemon=True).start()


class DeadDevices(unittest.TestCase):

    def setUp(self):
        self.hang = socket.create_server(("127.0.0.1", 0))  # takes connections and never answers
        self.garbage = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(self.hang.close)
        self.addCleanup(self.garbage.close)
        threading.Thread(target=answer_with_garbage, args=(self.garbage,), daemon=True).start()

    def config(self):
        scene = os.path.join(HERE, "small.toml")
        text = "version = 1\n"
        hosts = {"hangs": f"127.0.0.1:{self.hang.getsockname()[1]}",
                 "garbage": f"127.0.0.1:{self.garbage.getsockname()[1]}",
                 "refuses": "127.0.0.1:9", "no-route": "10.255.255.1:502"}
        for name, host in hosts.items():
            text += f'[[bus]]\nname = "{name}"\ndriver = "modbus"\nhost = "{host}"\n'
        for name in LIVE:
            text += f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{scene}"\n'
        for name in hosts:
            text += f'[[lens]]\nname = "{name}"\ndriver = "modbus"\nbus = "{name}"\n' + DRIVE
        text += '[[lens]]\nname = "address"\ndriver = "aravis"\naddress = "10.255.255.2"\n'
        text += '[[lens]]\nname = "id"\ndriver = "aravis"\nid = "Nobody-None-1"\n'
        text += '[[lens]]\nname = "hid"\ndriver = "lensconnect"\nserial = "NOPE"\n'
        text += '[[lens]]\nname = "usb"\ndriver = "uvc"\nserial = "NOPE"\n'
        return text

    def status(self, client):
        return {lens["name"]: lens for lens in client.call(LENS + "Status")["parameters"]["lenses"]}

    def test_the_live_ones_are_served_as_if_alone(self):
        began = time.monotonic()
        daemon = EagerDaemon(config=self.config())
        while True:
            try:
                client = Client(daemon.socket)
                break
            except OSError:
                time.sleep(0.002)
        try:
            self.assertEqual(len(self.status(client)), 16)
            first = time.monotonic() - began
            # A call that comes while its lens is being opened waits for that.
            moved = client.call(LENS + "Move", {"lens": "b", "axis": "focus", "target": {"position": 50}})
            self.assertTrue(moved["parameters"]["move"]["reached"])
            took = []
            with daemon.client() as mover:
                for number in range(100):
                    mover.send(LENS + "Move", {"lens": LIVE[number % 8], "axis": "focus", "target": {"position": 4000}},
                               oneway=True)
                    time.sleep(0.01)
                    at = time.monotonic()
                    self.assertEqual(client.call(LENS + "Stop"), {"parameters": {}})
                    took.append(time.monotonic() - at)
            took.sort()
            deadline = time.monotonic() + 10 * PATIENCE
            while any(lens["connection"] == "connecting" for lens in self.status(client).values()):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.05)
            for name, lens in self.status(client).items():
                self.assertEqual(lens["connection"], "connected" if name in LIVE else "absent")
                if name not in LIVE:
                    self.assertIn(f'lens "{name}"', lens["error"])
        finally:
            client.socket.close()
            at = time.monotonic()
            status = daemon.stop()
            ended = time.monotonic() - at
        self.assertEqual(status, 0)
        print(f"8 of 16 dead: first answer {first * 1e3:.0f} ms after the start, stop p50 {took[50] * 1e3:.1f} ms, "
              f"p99 {took[98] * 1e3:.1f} ms, SIGTERM {ended:.2f} s")
        self.assertLess(first, 0.1 * PATIENCE)
        self.assertLess(took[50], 0.01 * PATIENCE)
        self.assertLess(ended, 2.0 * PATIENCE)

    def test_an_opening_that_hangs_is_told_and_holds_nobody_up(self):
        """Something that is never answered, here the calibration file: a pipe that nobody writes to."""
        with tempfile.TemporaryDirectory() as folder:
            os.mkfifo(os.path.join(folder, "pipe.toml"))
            scene = os.path.join(HERE, "small.toml")
            daemon = EagerDaemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'
                                        f'[[lens]]\nname = "stuck"\ndriver = "sim"\nscene = "{scene}"\n'
                                        f'[lens.optics]\nfocal_length_mm = 25\nf_number = [1.4, 16]\nextension_mm = [0.0, 1.6]\ncalibration = "{folder}/pipe.toml"\n')
            try:
                daemon.wait_for_socket()
                with daemon.client() as client:
                    began = time.monotonic()
                    self.assertEqual(self.status(client)["stuck"]["connection"], "connecting")
                    while self.status(client)["stuck"]["connection"] == "connecting":
                        self.assertLess(time.monotonic() - began, 15 + 5 * PATIENCE)
                        time.sleep(0.1)
                    stuck = self.status(client)["stuck"]
                    self.assertEqual((stuck["connection"], stuck["connected"]), ("hung", False))
                    self.assertIn("has not answered for 15 s", stuck["error"])
                    refused = client.call(LENS + "Move", {"lens": "stuck", "axis": "focus", "target": {"position": 1}})
                    self.assertEqual(refused["error"], LENS + "Disconnected")
                    moved = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 50}})
                    self.assertTrue(moved["parameters"]["move"]["reached"])
            finally:
                at = time.monotonic()
                self.assertEqual(daemon.stop(), 0)
                self.assertLess(time.monotonic() - at, 2.0 * PATIENCE)


if __name__ == "__main__":
    unittest.main()
