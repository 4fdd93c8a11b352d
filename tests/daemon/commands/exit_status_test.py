"""Every exit status of the contract's table by a real situation: without --json one line for people on stderr, with it one
line for programs on stdout that has the code's name and what is known."""
import contextlib
import json
import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon  # noqa: E402

CODES = {2: "stopped", 3: "superseded", 4: "busy", 5: "timeout", 6: "out-of-range", 7: "not-homed", 8: "unsupported", 9: "leased",
         64: "usage", 65: "bad-data", 66: "no-input", 68: "not-found", 69: "unavailable", 70: "internal", 73: "cannot-write",
         74: "io", 76: "protocol", 77: "not-permitted", 78: "configuration", 130: "interrupted"}
LENSCTL = os.path.join(BIN, "lensctl")
PLAN = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..3mm"]


def grey_png(side):
    """A grey picture of 16 bits whose file is small and whose pixels are many."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    packer, rows = zlib.compressobj(1), b""
    row = b"\0" + b"\x04\x00" * side
    for _ in range(side):
        rows += packer.compress(row)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 16, 0, 0, 0, 0))
            + chunk(b"IDAT", rows + packer.flush()) + chunk(b"IEND", b""))


class Drive(threading.Thread):
    """A Modbus drive on TCP that holds what is written, until it refuses everything."""

    def __init__(self):
        super().__init__(daemon=True)
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.listening.getsockname()[1]}"
        self.refuses = False
        self.registers = {}

    def run(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.listening.accept()
                threading.Thread(target=self.serve, args=(client,), daemon=True).start()

    def serve(self, client):
        with contextlib.suppress(OSError, struct.error), client:
            while True:
                number, protocol, length, unit = struct.unpack(">HHHB", client.recv(7, socket.MSG_WAITALL))
                answer = self.answer(client.recv(length - 1, socket.MSG_WAITALL))
                client.sendall(struct.pack(">HHHB", number, protocol, len(answer) + 1, unit) + answer)

    def answer(self, asked):
        function, address, value = struct.unpack(">BHH", asked[:5])
        if self.refuses:
            return struct.pack(">BB", function | 0x80, 4)
        if function in (3, 4):
            return struct.pack(">BB", function, 2 * value) + b"".join(
                struct.pack(">H", self.registers.get(address + i, 0)) for i in range(value))
        if function == 16:
            for i in range(value):
                self.registers[address + i] = struct.unpack(">H", asked[6 + 2 * i:8 + 2 * i])[0]
        else:
            self.registers[address] = value
        return asked[:5]


class FalseDaemon:
    """Takes one connection after another, and does one thing with each."""

    def __init__(self, folder, act, reads=65536):
        self.path = os.path.join(folder, "false")
        self.listening = socket.socket(socket.AF_UNIX)
        self.listening.bind(self.path)
        self.listening.listen()
        self.act, self.reads = act, reads
        threading.Thread(target=self.run, daemon=True).start()

    def __enter__(self):
        return self.path

    def __exit__(self, *unused):
        self.listening.close()
        os.remove(self.path)

    def run(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.listening.accept()
                client.recv(self.reads)
                with contextlib.suppress(OSError):
                    self.act(client)
                client.close()


def refuse_with(name):
    return lambda client: client.sendall(json.dumps({"error": LENS + name, "parameters": {"message": name}}).encode() + b"\0")


class ExitStatus(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-exit-")
        cls.state = os.path.join(cls.folder.name, "state")
        os.mkdir(cls.state)
        with open(os.path.join(cls.state, "lost.position.json"), "w", encoding="utf-8") as file:
            file.write('{"version": 1, "ax')  # damaged: that lens does not know where it stands
        scene = os.path.join(HERE, "small.toml")
        with open(scene, encoding="utf-8") as file:
            deaf = file.read() + '[[fault]]\nat_ms = 2000\nkind = "drop-reply"\nfor_ms = 86400000\n'
        with open(os.path.join(cls.folder.name, "deaf.toml"), "w", encoding="utf-8") as file:
            file.write(deaf)
        cls.drive = Drive()
        cls.drive.start()
        text = "version = 1\n" + "".join(
            f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{place}"\n'
            for name, place in (("a", scene), ("lost", scene), ("deaf", os.path.join(cls.folder.name, "deaf.toml"))))
        for name, host in (("drive", cls.drive.address), ("gone", "127.0.0.1:9")):
            text += (f'[[bus]]\nname = "{name}"\ndriver = "modbus"\nhost = "{host}"\n[[lens]]\nname = "{name}"\n'
                     f'driver = "modbus"\nbus = "{name}"\n[lens.drives.focus]\nunit = 1\nprofile = "generic"\n'
                     'range = [-1000, 1000]\n')
        cls.daemon = Daemon(config=text, arguments=("--state", cls.state))

    @classmethod
    def tearDownClass(cls):
        cls.drive.listening.close()
        status = cls.daemon.stop()
        cls.folder.cleanup()
        assert status == 0, status

    def run_lensctl(self, *arguments, options=None, meanwhile=None):
        process = subprocess.Popen([LENSCTL, *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True, **(options or {}))
        if meanwhile:
            meanwhile(process)
        out, err = process.communicate(timeout=60 * PATIENCE)
        return process.returncode, out, err

    def ends(self, status, *arguments, path=None, says="", lines=1, options=None, meanwhile=None, **facts):
        """The same twice, with and without --json."""
        words = ["--socket", path or self.daemon.socket, *arguments]
        code, out, err = self.run_lensctl(*words, options=options, meanwhile=meanwhile)
        self.assertEqual((code, out), (status, ""), (words, err))
        self.assertEqual(err.count("\n"), lines, err)
        self.assertTrue(err.splitlines()[-1].startswith("lensctl: "), err)
        self.assertIn(says, err)
        if meanwhile:
            self.calm()
        code, out, err = self.run_lensctl(*words, "--json", options=options, meanwhile=meanwhile)
        self.assertEqual((code, out.count("\n")), (status, 1), (words, out, err))
        self.assertEqual(err.count("\n"), lines, err)
        told = json.loads(out)
        self.assertEqual(told["error"], CODES[status])
        self.assertEqual(err.splitlines()[-1], "lensctl: " + told["message"])
        self.assertEqual({name: told.get(name) for name in facts}, facts, told)
        return told

    def status(self, lens):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]

    def wait_for(self, condition, seconds=10):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened")
            time.sleep(0.005)

    def far(self):
        """A target that takes some seconds to reach."""
        return "@3900" if self.status("a")["axes"][0]["position"] < 2000 else "@100"

    def calls(self, method, **parameters):
        """Once the lens moves somebody else calls this."""
        def act(_):
            self.wait_for(lambda: self.status("a")["axes"][0]["moving"])
            with self.daemon.client() as client:
                self.assertNotIn("error", client.call(LENS + method, {"lens": "a", **parameters}))
        return act

    def test_0_done_and_1_the_answer_is_no(self):
        for words, status in ((["list"], 0), (["focus", "a", "@50"], 0),
                              ([*PLAN, "--sharp", "1m..inf:1um"], 1), (["plan", "a", "--sharp", "0.6m..inf:1um"], 1)):
            code, out, err = self.run_lensctl("--socket", self.daemon.socket, *words, "--json")
            self.assertEqual((code, err, out.count("\n")), (status, "", 1), words)
            answer = json.loads(out)
            self.assertFalse(isinstance(answer, dict) and "error" in answer, answer)

    def test_2_stopped(self):
        self.ends(2, "focus", "a", "@3900", meanwhile=self.calls("Stop"), lens="a", axis="focus")

    def test_3_superseded(self):
        self.ends(3, "focus", "a", "@3900", lens="a", axis="focus",
                  meanwhile=self.calls("Move", axis="focus", target={"position": 10}))

    def test_4_busy(self):
        with self.daemon.client() as client:
            client.call(LENS + "AutofocusBegin", {"lens": "a"})
            told = self.ends(4, "autofocus", "a", lens="a", activity="autofocus")
            self.assertIn(f"[{os.getpid()}]", told["holder"])
            self.assertGreater(told["sinceMs"], 0)
            for words in (["preset", "save", "a", "x"], ["backlash", "a"], ["backlash", "a", "focus", "--steps", "3"],
                          ["calibrate", "a", "--remove"]):
                self.ends(4, *words, lens="a")
        self.wait_for(lambda: self.status("a")["activity"] == "idle")
        with self.daemon.client() as client:
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": int(self.far()[1:])}})
            self.wait_for(lambda: self.status("a")["activity"] == "moving")
            self.ends(4, "preset", "save", "a", "x", lens="a", axis="focus", activity="moving")

    def test_5_timeout(self):
        self.ends(5, "--timeout", "1s", "focus", "a", self.far(), lines=2)  # and that it was stopped
        self.wait_for(lambda: not self.status("deaf")["connected"], seconds=20)
        self.ends(5, "focus", "deaf", "@100", lens="deaf")  # the device itself does not answer

    def test_6_out_of_range(self):
        self.ends(6, "focus", "a", "@99999", lens="a", axis="focus", parameter="target.position", minimum=0, maximum=4000,
                  unit="steps")
        told = self.ends(6, "focus", "a", "10mm", lens="a", axis="focus", parameter="target.distanceM", unit="m")
        self.assertAlmostEqual(told["minimum"], 0.025 + 0.025 ** 2 / 0.0016, delta=1e-3)
        self.assertNotIn("maximum", told)
        self.ends(6, "aperture", "a", "f/99", axis="iris", unit="fNumber")

    def test_7_not_homed(self):
        self.ends(7, "focus", "lost", "@100", lens="lost", axis="focus")

    def test_8_unsupported(self):
        self.ends(8, "filter", "a", "1", lens="a", axis="filter")
        self.ends(8, "call", "Nope", says="no method 'Nope'", method="Nope")
        self.ends(8, "call", "a.b.C", says="no interface 'a.b'", interface="a.b")
        self.ends(8, "introspect", "x", says="no interface 'x'", interface="x")

    def test_9_leased(self):
        with self.daemon.client() as client:
            client.call(LENS + "TakeLease", {"lens": "a", "forMs": 600000})
            told = self.ends(9, "focus", "a", "@100", lens="a")
            self.assertIn(f"[{os.getpid()}]", told["holder"])
            self.assertTrue(0 < told["remainingMs"] <= 600000)
            client.call(LENS + "DropLease", {"lens": "a"})

    def test_64_usage(self):
        axes = "there is no axis 'nose': the axes are focus, iris, zoom and filter"
        self.ends(64, "backlash", "a", "nose", says=axes)
        self.ends(64, "home", "a", "nose", says=axes)
        self.ends(64, "focus", "a", "5")
        self.ends(64, "focus", "@5", says="say which lens", parameter="lens")
        self.ends(64, "autofocus", "a", "--method", "magic", lens="a", parameter="method")
        self.ends(64, "call", "Status", '{"lenz": "a"}', says="'lenz'", parameter="lenz")
        self.ends(64, "call", "Monitor", "{}", says="--more")
        self.ends(64, "call", "--more", "List", says="leave out --more")
        self.ends(64, "dof", "--focal-length", "50mm", "--f-number", "2", "--focus", "10mm", "--blur-limit", "30um",
                  says="closest focus")

    def file(self, name, content):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(content)
        return path

    def test_65_bad_data(self):
        wrong = self.file("wrong.toml", b"version = [")
        self.ends(65, "calibrate", "a", "--from-file", wrong, says="wrong.toml", lens="a")
        self.ends(65, *PLAN, "--depth-map", self.file("wrong.png", b"no picture"), "--sharp", "@1:20um")

    def test_66_no_input(self):
        self.ends(66, "calibrate", "a", "--from-file", "/nonexistent/file")
        self.ends(66, *PLAN, "--depth-map", "/nonexistent/file.png", "--sharp", "@1:20um")

    def test_68_not_found(self):
        self.ends(68, "focus", "nobody", "@5", says="there is a, lost", lens="nobody")
        self.ends(68, "preset", "recall", "a", "nothing", lens="a", label="nothing")

    def test_69_unavailable(self):
        self.ends(69, "list", path="/nonexistent/socket")
        self.ends(69, "focus", "gone", "@5", lens="gone", axis="focus")
        with FalseDaemon(self.folder.name, lambda client: None) as path:  # goes in the middle of a call
            self.ends(69, "list", path=path)

    @unittest.skipIf(PATIENCE > 4, "a sanitizer's allocator ends the program where memory ends")
    def test_70_internal(self):
        big = self.file("big.png", grey_png(12000))
        limit = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_AS, (256 << 20, 256 << 20))}
        self.ends(70, *PLAN, "--depth-map", big, "--sharp", "@1:20um", says="not enough memory", options=limit)

    def test_73_cannot_write(self):
        self.ends(73, "snapshot", "a", "-o", "/nonexistent/picture.png")
        self.ends(73, *PLAN, "--sharp", "2m:20um", "--plot", "/nonexistent/plan.svg")
        os.mkdir(os.path.join(self.state, "a.presets.toml"))  # where the daemon keeps them
        self.ends(73, "preset", "save", "a", "x", lens="a")
        os.rmdir(os.path.join(self.state, "a.presets.toml"))

    def test_74_io(self):
        with FalseDaemon(self.folder.name, lambda client: None, reads=1) as path:  # leaves the rest unread: a reset
            self.ends(74, "list", path=path, says="cannot be read from")
        with FalseDaemon(self.folder.name, refuse_with("DeviceError")) as path:
            self.ends(74, "list", path=path)

    def test_every_error_has_its_status(self):
        """Those of the interface file, of Varlink itself, and one that nobody knows."""
        statuses = {2: "Cancelled", 3: "Superseded", 4: "Busy Overrun", 5: "Timeout", 6: "OutOfRange", 7: "NotHomed", 8: "Unsupported",
                    9: "Leased", 64: "InvalidRequest", 65: "BadData", 68: "LensNotFound PresetNotFound", 69: "Disconnected",
                    70: "Internal", 73: "NotKept", 74: "DeviceError", 76: "ProtocolError OfANewerLensd", 77: "NotPermitted",
                    78: "BadConfiguration"}
        right = {LENS + name: status for status, names in statuses.items() for name in names.split()}
        right.update({"org.varlink.service." + name: status for name, status in (
            ("InterfaceNotFound", 8), ("MethodNotFound", 8), ("MethodNotImplemented", 8), ("InvalidParameter", 64),
            ("ExpectedMore", 64), ("PermissionDenied", 77))})
        with open(os.path.join(HERE, "..", "..", "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
            defined = [LENS + line.split()[1] for line in file if line.startswith("error ")]
        self.assertEqual([name for name in defined if name not in right], [])
        for name, status in right.items():
            answer = json.dumps({"error": name, "parameters": {"message": "no"}}).encode() + b"\0"
            with FalseDaemon(self.folder.name, lambda client, answer=answer: client.sendall(answer)) as path:
                self.ends(status, "list", path=path, says="no")

    def test_75_timeout_of_a_question_among_others(self):
        def answers(client):
            """Every question but that for the devices at once, that one late."""
            for name, after, told in (("GetInfo", 0, {"version": "?"}), ("Status", 0, {"lenses": []}),
                                      ("Devices", 1.5, {"devices": [], "failed": []}), ("List", 0, {"lenses": []})):
                time.sleep(after)
                client.sendall(json.dumps({"parameters": told}).encode() + b"\0")
                client.recv(65536)
        with FalseDaemon(self.folder.name, answers) as path:
            code, out, err = self.run_lensctl("--socket", path, "doctor", "--timeout", "1s")
        self.assertEqual((code, err), (1, ""), out)
        self.assertIn("did not answer in time", out)
        self.assertIn("clock: ", out)

    def test_76_protocol(self):
        with FalseDaemon(self.folder.name, lambda client: client.sendall(b"what?\0")) as path:
            self.ends(76, "list", path=path)
        self.wait_for(lambda: self.status("drive")["connected"])
        self.drive.refuses = True
        try:
            self.ends(76, "home", "drive", lens="drive")
        finally:
            self.drive.refuses = False

    def test_77_not_permitted(self):
        folder = os.path.join(self.folder.name, "shut")
        os.mkdir(folder, 0o700)
        os.chmod(self.folder.name, 0o755)
        with FalseDaemon(folder, lambda client: None) as path:
            os.chmod(path, 0)
            os.chmod(folder, 0o755)
            other = {"user": 65534} if os.getuid() == 0 else {}
            self.ends(77, "list", path=path, says="may not use the socket", options=other)

    def test_78_configuration(self):
        wrong = self.file("lensd.toml", b"version = 1\nnose = 3\n")
        done = subprocess.run([os.path.join(BIN, "lensd"), "--config", wrong, "--check-config"], capture_output=True,
                              text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 78, done.stderr)
        self.assertIn("lensd.toml:2", done.stderr)

    def test_130_interrupted(self):
        def interrupt(process):
            self.wait_for(lambda: self.status("a")["axes"][0]["moving"])
            process.send_signal(signal.SIGINT)
        self.ends(130, "focus", "a", "@3900", lines=2, meanwhile=interrupt)

    def setUp(self):
        self.calm()

    def calm(self):
        with self.daemon.client() as client:
            client.call(LENS + "Stop", {"lens": "a"})
            self.wait_for(lambda: self.status("a")["activity"] == "idle" and not self.status("a")["axes"][0]["moving"])
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 50}})


if __name__ == "__main__":
    unittest.main()
