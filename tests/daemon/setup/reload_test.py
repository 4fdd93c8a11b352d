"""The configuration read again: by HUP, by lensctl, with mistakes in it, and while things go on."""
import base64
import contextlib
import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")


class ReloadTest(DaemonTest):
    def setUp(self):
        self.start()

    def start(self, quick=("a", "b")):
        self.daemon = Daemon(("a", "b"), quick=quick)
        self.scene = os.path.join(self.daemon.folder.name, "quick.toml") if quick else SCENE

    def tearDown(self):
        self.assertEqual(self.daemon.stop(), 0)

    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def lens(self, name, more=""):
        return f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{self.scene}"\n{more}'

    def write(self, *lenses):
        with open(self.daemon.config, "w", encoding="utf-8") as file:
            file.write("version = 1\n" + "".join(lenses))

    def reload(self):
        done = self.daemon.lensctl("reload", "--json")
        return done.returncode, json.loads(done.stdout)

    def lenses(self):
        with self.daemon.client() as client:
            return {each["name"]: each for each in client.call(LENS + "Status")["parameters"]["lenses"]}

    def wait_connected(self, *names):
        deadline = time.monotonic() + 10 * PATIENCE
        while time.monotonic() < deadline:
            lenses = self.lenses()
            if sorted(lenses) == sorted(names) and all(each["connection"] == "connected" for each in lenses.values()):
                return lenses
            time.sleep(0.02)
        self.fail(f"not connected: {self.lenses()}")

    def test_lenses_come_go_change_and_stay(self):
        with self.daemon.client() as client:
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 1234}})
        self.write(self.lens("a"), self.lens("b", "[lens.focus]\nlimits = [100, 3000]\n"), self.lens("c"))
        self.assertEqual(self.reload(), (0, {"added": ["c"], "removed": [], "reopened": ["b"], "unchanged": ["a"]}))
        lenses = self.wait_connected("a", "b", "c")
        focus = next(axis for axis in lenses["a"]["axes"] if axis["axis"] == "focus")
        self.assertEqual(focus["position"], 1234)
        self.assertEqual(self.daemon.lensctl("focus", "b", "@3001").returncode, 6)
        self.write(self.lens("c"))
        self.assertEqual(self.reload(), (0, {"added": [], "removed": ["a", "b"], "reopened": [], "unchanged": ["c"]}))
        self.assertEqual(list(self.lenses()), ["c"])
        done = self.daemon.lensctl("focus", "a", "@5", "--json")
        self.assertEqual(done.returncode, 68, done.stdout)
        self.assertEqual(self.daemon.lensctl("focus", "@500").returncode, 0)

    def test_a_mistake_leaves_all_as_it_is_and_names_its_place(self):
        self.write(self.lens("a"), self.lens("b", "[lens.focus]\nlimit = [1, 2]\n"), self.lens("c"))
        status, reply = self.reload()
        self.assertEqual((status, reply["error"]), (78, "configuration"))
        self.assertRegex(reply["message"], r"lensd\.toml:\d+: .*limit")
        os.unlink(self.daemon.config)
        self.assertEqual(self.reload()[0], 78)
        self.assertEqual(sorted(self.lenses()), ["a", "b"])
        self.assertEqual(self.daemon.lensctl("focus", "b", "@500").returncode, 0)

    def test_hup_does_the_same_and_says_so_in_the_log(self):
        self.write(self.lens("b"), self.lens("d"))
        self.daemon.process.send_signal(signal.SIGHUP)
        self.wait_connected("b", "d")
        self.daemon.wait_log("added d; removed a; unchanged b")

    def test_what_goes_on_ends_with_its_lens_and_not_with_the_others(self):
        self.assertEqual(self.daemon.stop(), 0)
        self.start(quick=())  # a move that is under way
        with self.daemon.client() as mover, self.daemon.client() as other, self.daemon.client() as watcher:
            watcher.send(LENS + "Monitor", {"lens": "a"}, more=True)
            watcher.receive()
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
            other.send(LENS + "Move", {"lens": "b", "axis": "focus", "target": {"position": 4000}})
            self.write(self.lens("b"))
            self.assertEqual(self.reload()[0], 0)
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
            self.assertTrue(other.receive()["parameters"]["move"]["reached"])
            last = watcher.receive()
            while last.get("continues"):
                last = watcher.receive()
            self.assertEqual(last["error"], LENS + "LensNotFound")

    def test_a_lens_that_is_opened_anew_keeps_its_lease(self):
        with self.daemon.client() as owner, self.daemon.client() as other, self.daemon.client() as passing:
            timed = owner.call(LENS + "TakeLease", {"lens": "a", "forMs": 600e3})["parameters"]["lease"]
            passing.call(LENS + "TakeLease", {"lens": "b"})
            before = {name: lens["lease"] for name, lens in self.lenses().items()}
            self.write(self.lens("a", "[lens.focus]\nlimits = [100, 3000]\n"), self.lens("b", "[lens.focus]\nlimits = [100, 3000]\n"))
            self.assertEqual(self.reload()[1]["reopened"], ["a", "b"])
            self.wait_for(lambda: all(each["connected"] for each in self.lenses().values()))
            self.assertEqual({name: lens["lease"] for name, lens in self.lenses().items()}, before)
            move = {"axis": "focus", "target": {"position": 200}}
            for name in ("a", "b"):
                self.assertEqual(other.call(LENS + "Move", {"lens": name, **move})["error"], LENS + "Leased")
            for client, key in ((owner, {}), (other, {"lease": timed})):
                self.assertTrue(client.call(LENS + "Move", {"lens": "a", **move, **key})["parameters"]["move"]["reached"])
            self.assertTrue(passing.call(LENS + "Move", {"lens": "b", **move})["parameters"]["move"]["reached"])
            passing.socket.close()  # what was taken without a time ends with its connection, as ever
            self.wait_for(lambda: self.lenses()["b"]["lease"] is None)
            self.assertEqual(self.lenses()["a"]["lease"], before["a"])

    def test_a_watched_lens_is_watched_on_when_it_is_reopened(self):
        with self.daemon.client() as watcher:
            watcher.send(LENS + "Status", {"lens": "a"}, more=True)
            watcher.receive()
            self.write(self.lens("a", "[lens.focus]\nlimits = [100, 3000]\n"), self.lens("b"))
            self.assertEqual(self.reload()[1]["reopened"], ["a"])
            self.wait_connected("a", "b")
            self.assertEqual(self.daemon.lensctl("focus", "a", "@2000").returncode, 0)
            position = None
            while position != 2000:  # what came between may have been left out for something newer
                axes = watcher.receive()["parameters"]["lenses"][0]["axes"]
                position = next((axis["position"] for axis in axes if axis["axis"] == "focus"), None)

    def test_a_changed_file_that_the_configuration_names_is_noticed(self):
        folder = os.path.dirname(self.daemon.config)
        scene, picture = os.path.join(folder, "own.toml"), os.path.join(folder, "page.png")
        with open(SCENE, encoding="utf-8") as small:
            text = small.read()
        png = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg==")
        with open(picture, "wb") as file:
            file.write(png)
        with open(scene, "w", encoding="utf-8") as file:
            file.write(text.replace("sinusoid_px = [8.0, 0.0]", 'texture = "page.png"'))
        self.write(f'[[lens]]\nname = "a"\ndriver = "sim"\nscene = "own.toml"\n', self.lens("b"))
        self.assertEqual(self.reload()[1]["reopened"], ["a"])
        self.wait_connected("a", "b")
        self.assertEqual(self.reload()[1], {"added": [], "removed": [], "reopened": [], "unchanged": ["a", "b"]})
        for path in (scene, picture):
            with open(path, "rb") as file:
                whole = file.read()
            os.unlink(path)
            with open(path, "wb") as file:
                file.write(whole)
            os.utime(path, ns=(1, 1))
            reloaded = self.reload()[1]
            self.assertEqual((reloaded["reopened"], reloaded["unchanged"]), (["a"], ["b"]), path)
            self.wait_for(lambda named=f"files that changed: {path}": named in self.daemon.log())
            self.wait_connected("a", "b")

    def test_many_changes_in_a_row_lose_nothing(self):
        for i in range(40):
            self.write(self.lens("a", f"[lens.focus]\nlimits = [0, {3000 + i}]\n"), *([self.lens("b")] if i % 2 else []))
            self.assertEqual(self.reload()[0], 0)
        self.wait_connected("a", "b")
        self.assertEqual(self.daemon.lensctl("focus", "a", "@2000").returncode, 0)


class Late:
    """A TCP port in front of another one, which answers nothing until a second after the first connection to it."""

    def __init__(self, port):
        self.port_behind, self.open, self.begun = port, threading.Event(), False
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.port = self.listening.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.listening.accept()
                if not self.begun:
                    threading.Timer(1, self.open.set).start()
                self.begun = True
                threading.Thread(target=self.serve, args=(client,), daemon=True).start()

    def serve(self, client):
        self.open.wait()
        with contextlib.suppress(OSError), client, socket.create_connection(("127.0.0.1", self.port_behind)) as behind:
            while True:
                for ready in select.select([client, behind], [], [])[0]:
                    data = ready.recv(4096)
                    if not data:
                        return
                    (behind if ready is client else client).sendall(data)


NEED_OPTICS = (("plan", "ring", "--sharp", "0.8m..1.6m:60um"), ("plan", "ring", "--stack", "--sharp", "1m..1.2m:60um"),
               ("stack", "ring", "--sharp", "1m..1.2m:60um", "-o", "/dev/null/s"), ("focus", "ring", "hyperfocal", "--blur-limit", "60um"))


class SlowAndAway(unittest.TestCase):
    """What needs the optics of a lens says the truth while its device is not open: they are configured."""

    def start(self, port=None):
        self.daemon = Daemon(config="version = 1\n" + (ring(port) if port else ""))
        self.addCleanup(self.daemon.stop)
        return self.daemon

    def said(self, *words):
        done = self.daemon.lensctl(*words, "--json")
        return done.returncode, json.loads(done.stdout or "{}").get("message"), done.stderr

    def test_away_they_say_what_focus_says(self):
        self.start(port=1)
        status, why, _ = self.said("focus", "ring", "1m")
        self.assertEqual(status, 69)
        for words in NEED_OPTICS:
            with self.subTest(words=words):
                self.assertEqual(self.said(*words)[:2], (69, why))

    def test_reload_waits_until_a_slow_device_is_open(self):
        with subprocess.Popen([os.path.join(BIN, "sim-modbus-drive"), "--tcp", "0", "--unit", "1", "--unit", "2"],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as drives:
            try:
                port = int(re.search(r"(\d+)\s*$", drives.stdout.readline()).group(1))
                daemon = self.start()
                for words in NEED_OPTICS[:3]:
                    late = Late(port)
                    with open(daemon.config, "w", encoding="utf-8") as file:
                        file.write("version = 1\n" + ring(late.port))
                    if words is NEED_OPTICS[0]:
                        reloaded = daemon.lensctl("reload")
                        self.assertEqual(reloaded.returncode, 0, reloaded.stderr)
                        with daemon.client() as client:
                            state = client.call(LENS + "Status")["parameters"]["lenses"][0]
                        self.assertEqual((state["connection"], reloaded.stderr), ("connected", ""))
                        self.assertEqual(self.said(*words)[0], 0)
                    else:
                        with daemon.client() as client:
                            client.call(LENS + "Reload")
                        with self.subTest(words=words):
                            self.assertNotIn("not known", self.said(*words)[2])
                    late.listening.close()
            finally:
                drives.stdin.write("quit\n")
                drives.stdin.close()
                drives.wait(timeout=30 * PATIENCE)

    def test_reload_names_a_lens_that_is_not_there(self):
        daemon = self.start()
        with open(daemon.config, "a", encoding="utf-8") as file:
            file.write(ring(1))
        done = daemon.lensctl("reload")
        self.assertEqual(done.returncode, 0)
        self.assertIn("added: ring", done.stdout)
        self.assertIn("ring is not open: ", done.stderr)


def ring(port):
    return (f'[[bus]]\nname = "b"\ndriver = "modbus"\nhost = "127.0.0.1:{port}"\nresponse_timeout_ms = 10000\n'
            '[[lens]]\nname = "ring"\ndriver = "modbus"\nbus = "b"\n'
            '[lens.optics]\nfocal_length_mm = 25\nf_number = [1.4, 16]\nclosest_m = 0.42\n[lens.focus]\ndirection = "near-positive"\n'
            + "".join(f'[lens.drives.{axis}]\nunit = {unit}\nprofile = "oriental-az"\nrange = [0, 4000]\nhoming = "not-needed"\n'
                      for unit, axis in enumerate(("focus", "iris"), 1)))


if __name__ == "__main__":
    unittest.main(verbosity=2)
