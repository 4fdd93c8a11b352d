"""Situations in which lensd refuses, each with the error and the exit status that the contract gives it. Both client libraries
are led through all of them; what they say of the error is what a test of theirs compares."""
import json
import os
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(HERE, "..", "daemon"))
sys.path.insert(0, os.path.join(HERE, "..", "daemon", "commands"))
from exit_status_test import Drive, FalseDaemon  # noqa: E402
from harness import BIN  # noqa: E402
from harness import HERE as DAEMON_TESTS  # noqa: E402
from harness import LENS, PATIENCE, Daemon  # noqa: E402

PACKAGE = os.path.join(os.path.dirname(BIN), "python")  # as the build wrote it
SCENE = os.path.join(DAEMON_TESTS, "small.toml")
# The contract's exit statuses, and what each error of the interface is there.
CODES = {2: "stopped", 3: "superseded", 4: "busy", 5: "timeout", 6: "out-of-range", 7: "not-homed", 8: "unsupported", 9: "leased",
         64: "usage", 65: "bad-data", 68: "not-found", 69: "unavailable", 70: "internal", 73: "cannot-write", 74: "io",
         76: "protocol", 77: "not-permitted", 78: "configuration"}
STATUS = {"Cancelled": 2, "Superseded": 3, "Busy": 4, "Overrun": 4, "Timeout": 5, "OutOfRange": 6, "NotHomed": 7, "Unsupported": 8,
          "Leased": 9, "InvalidRequest": 64, "BadData": 65, "LensNotFound": 68, "PresetNotFound": 68, "Disconnected": 69,
          "Internal": 70, "NotKept": 73, "DeviceError": 74, "ProtocolError": 76, "NotPermitted": 77, "BadConfiguration": 78}
VARLINK = {"InvalidParameter": 64, "ExpectedMore": 64, "MethodNotFound": 8, "MethodNotImplemented": 8, "InterfaceNotFound": 8,
           "PermissionDenied": 77}


def answering(*messages):
    """Answers one call with these, then closes."""
    return lambda client: client.sendall(b"".join(json.dumps(each).encode() + b"\0" for each in messages))


class Situations:
    """Mixed into a TestCase that says how its library makes a call: `refusal()`."""

    def refusal(self, path, method, parameters, name=None):
        """What a call ends with: {"error": NAME, "code": CODE, "exit_status": N, "message": TEXT, and the error's fields}; None: well."""
        raise NotImplementedError

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-clients-")
        cls.state = os.path.join(cls.folder.name, "state")
        os.mkdir(cls.state)
        with open(os.path.join(cls.state, "lost.position.json"), "w", encoding="utf-8") as file:
            file.write('{"version": 1, "ax')  # damaged: that lens does not know where it stands
        cls.drive = Drive()
        cls.drive.start()
        text = "version = 1\n" + "".join(f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{SCENE}"\n'
                                         for name in ("a", "deaf", "lost"))
        for name, host in (("drive", cls.drive.address), ("gone", "127.0.0.1:9")):
            text += (f'[[bus]]\nname = "{name}"\ndriver = "modbus"\nhost = "{host}"\n[[lens]]\nname = "{name}"\n'
                     f'driver = "modbus"\nbus = "{name}"\n[lens.drives.focus]\nunit = 1\nprofile = "generic"\nrange = [-1000, 1000]\n')
        cls.daemon = Daemon(config=text, arguments=("--state", cls.state))

    @classmethod
    def tearDownClass(cls):
        cls.drive.listening.close()
        status = cls.daemon.stop()
        cls.folder.cleanup()
        assert status == 0, status

    def raw(self, method, **parameters):
        with self.daemon.client() as client:
            return client.call(method if "." in method else LENS + method, parameters)

    def state_of(self, lens):
        return self.raw("Status", lens=lens)["parameters"]["lenses"][0]

    def wait_for(self, condition, seconds=10):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened")
            time.sleep(0.005)

    def ends(self, error, status, method, parameters, *, path=None, meanwhile=None, **facts):
        helper = threading.Thread(target=meanwhile) if meanwhile else None
        if helper:
            helper.start()
        told = self.refusal(path or self.daemon.socket, method, parameters)
        if helper:
            helper.join()
        self.assertIsNotNone(told, f"{method} {parameters} was not refused")
        self.assertEqual((told["error"], told["exit_status"], told["code"]), (error, status, CODES[status]), told)
        self.assertEqual({name: told.get(name) for name in facts}, facts, told)
        self.assertGreater(len(told["message"]), 5)
        return told

    def far(self):
        position = self.state_of("a")["axes"][0]["position"]
        return {"lens": "a", "axis": "focus", "target": {"position": 3900 if position < 2000 else 100}}

    def once_it_moves(self, method, **parameters):
        def act():
            self.wait_for(lambda: self.state_of("a")["axes"][0]["moving"])
            self.raw(method, lens="a", **parameters)
        return act

    def test_stopped_and_superseded(self):
        self.ends("Cancelled", 2, "Move", self.far(), meanwhile=self.once_it_moves("Stop"), lens="a", axis="focus")
        self.setUp()
        self.ends("Superseded", 3, "Move", self.far(), lens="a", axis="focus",
                  meanwhile=self.once_it_moves("Move", axis="focus", target={"position": 2000}))

    def test_busy_and_leased_say_who(self):
        self.wait_for(lambda: self.state_of("a")["activity"] == "idle")
        with self.daemon.client() as client:
            client.call(LENS + "AutofocusBegin", {"lens": "a"})
            told = self.ends("Busy", 4, "PresetSave", {"lens": "a", "label": "x"}, lens="a", activity="autofocus")
            self.assertIn(f"[{os.getpid()}]", told["holder"])
            self.assertGreater(told["sinceMs"], 0)
        self.wait_for(lambda: self.state_of("a")["activity"] == "idle")
        with self.daemon.client() as client:
            client.call(LENS + "TakeLease", {"lens": "a", "forMs": 600000})
            told = self.ends("Leased", 9, "Home", {"lens": "a"}, lens="a")
            self.assertIn(f"[{os.getpid()}]", told["holder"])
            self.assertTrue(0 < told["remainingMs"] <= 600000)
            client.call(LENS + "DropLease", {"lens": "a"})

    def test_out_of_range_says_the_range(self):
        self.ends("OutOfRange", 6, "Move", {"lens": "a", "axis": "focus", "target": {"position": 99999}}, lens="a", axis="focus",
                  parameter="target.position", minimum=0, maximum=4000, unit="steps")

    def test_not_homed_unsupported_and_gone(self):
        self.ends("NotHomed", 7, "Move", {"lens": "lost", "axis": "focus", "target": {"position": 5}}, lens="lost", axis="focus")
        self.ends("Unsupported", 8, "Move", {"lens": "a", "axis": "filter", "target": {"position": 1}}, lens="a", axis="filter")
        self.ends("Disconnected", 69, "Move", {"lens": "gone", "axis": "focus", "target": {"position": 1}}, lens="gone")

    def test_calls_that_make_no_sense(self):
        self.ends("InvalidRequest", 64, "Move", {"lens": "a", "axis": "focus", "target": {}}, parameter="target")
        self.ends("InvalidParameter", 64, "Move", {"lens": "a", "axis": "nose", "target": {}}, parameter="axis")
        self.ends("ExpectedMore", 64, "Monitor", {})
        self.ends("BadData", 65, "Calibrate", {"lens": "a", "toml": "version = ["}, lens="a")

    def test_what_is_not_there(self):
        self.ends("LensNotFound", 68, "Move", {"lens": "nobody", "axis": "focus", "target": {"position": 1}}, lens="nobody")
        self.ends("PresetNotFound", 68, "PresetRecall", {"lens": "a", "label": "none"}, lens="a", label="none")

    def test_a_file_that_cannot_be_written(self):
        place = os.path.join(self.state, "a.presets.toml")
        os.mkdir(place)
        try:
            self.wait_for(lambda: self.state_of("a")["activity"] == "idle")
            self.ends("NotKept", 73, "PresetSave", {"lens": "a", "label": "x"}, lens="a")
        finally:
            os.rmdir(place)

    def test_a_device_that_breaks_its_rules(self):
        self.wait_for(lambda: self.state_of("drive")["connected"])
        self.drive.refuses = True
        try:
            self.ends("ProtocolError", 76, "Home", {"lens": "drive"}, lens="drive")
        finally:
            self.drive.refuses = False

    def test_a_device_that_does_not_answer(self):
        self.raw("io.lensd.Simulator.Inject", lens="deaf", kind="drop-reply")
        self.wait_for(lambda: not self.state_of("deaf")["connected"], seconds=20)
        self.ends("Timeout", 5, "Move", {"lens": "deaf", "axis": "focus", "target": {"position": 100}}, lens="deaf")

    def test_a_configuration_with_a_mistake(self):
        with open(self.daemon.config, "a", encoding="utf-8") as file:
            file.write("nose = 3\n")
        self.ends("BadConfiguration", 78, "Reload", {})

    def test_every_error_as_the_contract_has_it(self):
        for prefix, table in ((LENS, STATUS), ("org.varlink.service.", VARLINK)):
            for name, status in table.items():
                said = {"message": f"said of {name}"} if prefix == LENS else {}
                with FalseDaemon(self.folder.name, answering({"error": prefix + name, "parameters": said})) as path:
                    told = self.ends(name, status, "List", {}, path=path)
                self.assertTrue(prefix != LENS or told["message"] == said["message"])

    def test_what_is_no_lensd(self):
        self.ends("Unavailable", 69, "List", {}, path="/nonexistent/socket")
        with FalseDaemon(self.folder.name, lambda client: None) as path:
            self.ends("Unavailable", 69, "List", {}, path=path)
        with FalseDaemon(self.folder.name, lambda client: None, reads=1) as path:  # leaves the rest unread: a reset
            self.ends("SocketFailed", 74, "List", {}, path=path)
        with FalseDaemon(self.folder.name, lambda client: client.sendall(b"what?\0")) as path:
            self.ends("BrokenReply", 76, "List", {}, path=path)
        with FalseDaemon(self.folder.name, lambda client: client.sendall(b"7\0")) as path:
            self.ends("BrokenReply", 76, "List", {}, path=path)
        newer = {"error": LENS + "Melted", "parameters": {"message": "the lens has melted", "lens": "a"}}
        with FalseDaemon(self.folder.name, answering(newer)) as path:
            told = self.ends("UnknownError", 76, "List", {}, path=path, lens="a")
        self.assertEqual(told["message"], "the lens has melted")

    def test_a_socket_that_this_user_may_not_use(self):
        folder = os.path.join(self.folder.name, "shut")
        os.mkdir(folder, 0o755)
        os.chmod(self.folder.name, 0o755)
        with FalseDaemon(folder, lambda client: None) as path:
            os.chmod(path, 0)
            told = self.as_another_user(lambda: self.refusal(path, "List", {}))
        self.assertEqual((told["error"], told["exit_status"], told["code"]), ("SocketRefused", 77, "not-permitted"), told)
        self.assertIn("you may not use the socket", told["message"])

    @staticmethod
    def as_another_user(act):
        """What `act` gives in a process that is not root's."""
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                if os.getuid() == 0:
                    os.setuid(65534)
                os.write(writing, json.dumps(act()).encode())
            finally:
                os._exit(0)
        os.close(writing)
        with os.fdopen(reading, encoding="utf-8") as pipe:
            told = pipe.read()
        os.waitpid(child, 0)
        return json.loads(told)

    def setUp(self):
        self.raw("Stop", lens="a")
        self.wait_for(lambda: not self.state_of("a")["axes"][0]["moving"])
