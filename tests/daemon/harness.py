"""Starts lensd on a private socket and talks to it in raw bytes: this client shares no code with the server."""
import contextlib
import glob
import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import time
import unittest

BIN = os.environ["LENSD_BIN"]
HERE = os.path.dirname(os.path.abspath(__file__))
LENS = "io.lensd.Lens."
# Sanitizers and busy machines make everything slower; limits on time below are multiplied by this.
PATIENCE = float(os.environ.get("LENSD_TEST_PATIENCE", "1"))


def errors_of_page():
    """By method, what docs/interface.md says that its calls may end with."""
    with open(os.path.join(HERE, "..", "..", "docs", "interface.md"), encoding="utf-8") as file:
        methods = re.findall(r"^### (\w+)\n(?:(?!^###).*\n)*?Errors: (.*)\.$", file.read(), re.MULTILINE)
    return {name: set(re.findall(r"`(\w+)`", errors)) for name, errors in methods}


class Client:
    """One connection. Messages are decoded, errors are returned as they are; one that the page of the interface does not
    list for its method fails the test that meets it."""
    page = errors_of_page()

    def __init__(self, path, timeout=30 * PATIENCE):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(timeout)
        try:
            self.socket.connect(path)
        except OSError:
            self.socket.close()
            raise
        self.buffer = b""
        self.calls = []  # without an answer yet; None: nobody knows, since a test wrote bytes of its own

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        """Waits until the daemon has seen the end too: what hangs on a connection, such as a lease, is over then for whoever comes
        next. Not where it still owes answers, nor for ever."""
        if self.calls == []:
            with contextlib.suppress(OSError):
                self.socket.settimeout(2)
                self.socket.shutdown(socket.SHUT_WR)
                while self.socket.recv(65536):
                    pass
        self.socket.close()

    def send_bytes(self, data):
        self.calls = None
        self.socket.sendall(data)

    def send(self, method, parameters=None, **flags):
        message = {"method": method, **flags}
        if parameters is not None:
            message["parameters"] = parameters
        if self.calls is not None and not flags.get("oneway"):
            self.calls.append(method)
        self.socket.sendall(json.dumps(message).encode() + b"\0")

    def receive(self):
        """The next message, or None when the server has closed."""
        while b"\0" not in self.buffer:
            try:
                data = self.socket.recv(65536)
            except ConnectionResetError:
                return None
            if not data:
                return None
            self.buffer += data
        message, self.buffer = self.buffer.split(b"\0", 1)
        return self.judged(json.loads(message.decode()))

    def judged(self, reply):
        """The same, after a look at the page."""
        if not self.calls:
            return reply
        method = self.calls[0]
        if not reply.get("continues"):
            self.calls.pop(0)
        error = reply.get("error", "")
        refused = "connections are open" in reply.get("parameters", {}).get("message", "")  # whatever the call was
        if method.startswith(LENS) and error.startswith(LENS) and not refused:
            listed = self.page.get(method[len(LENS):], set())
            assert error[len(LENS):] in listed, f"docs/interface.md does not list {error} for {method}: {reply}"
        return reply

    def call(self, method, parameters=None, **flags):
        self.send(method, parameters, **flags)
        return self.receive()


def memory_of(process):
    with open(f"/proc/{process.pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def quick_scene(folder):
    """Writes small.toml with motors ten times as fast, for tests that judge nothing of time, and returns its path."""
    path = os.path.join(folder, "quick.toml")
    with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as small, open(path, "w", encoding="utf-8") as quick:
        quick.write(re.sub(r"^(speed_steps_per_s|acceleration_steps_per_s2) = (\d+)", r"\1 = \g<2>0", small.read(), flags=re.M))
    return path


def played_node(folder):
    """Builds v4l2_node.c there. The path is what to preload, and v4l2_node.c says what environment it takes."""
    library = os.path.join(folder, "v4l2_node.so")
    subprocess.run(["cc", "-O1", "-w", "-shared", "-fPIC", "-o", library, os.path.join(HERE, "v4l2_node.c"), "-ldl", "-lpthread"], check=True)
    return library


class Daemon:
    """lensd with the given lenses over tests/daemon/small.toml. `quick`: those that are over quick_scene(), or True."""
    program = "lensd"

    def __init__(self, lenses=("a", "b"), config=None, arguments=(), preload=None, stderr=None, quick=(), environment=None):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-test-")
        self.socket = os.path.join(self.folder.name, "s")
        self.config = os.path.join(self.folder.name, "lensd.toml")
        small, fast = os.path.join(HERE, "small.toml"), quick_scene(self.folder.name) if quick else ""
        scenes = {name: fast if quick is True or name in quick else small for name in lenses}
        text = "version = 1\n" + "".join(
            f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{scene}"\n' for name, scene in scenes.items())
        with open(self.config, "w", encoding="utf-8") as file:
            file.write(text if config is None else config)
        self.errors = open(os.path.join(self.folder.name, "stderr"), "w+", encoding="utf-8")
        self.process = subprocess.Popen([os.path.join(BIN, self.program), "--config", self.config, "--socket", self.socket,
                                         *arguments], stderr=stderr or self.errors,
                                        env={**os.environ, **(environment or {}), **({"LD_PRELOAD": preload} if preload else {})})
        self.wait_until_ready()

    def wait_until_ready(self):
        """Until it answers, and has tried to open every lens."""
        deadline = time.monotonic() + 20 * PATIENCE
        while time.monotonic() < deadline and self.process.poll() is None:
            # TypeError: it closed the connection without an answer.
            with contextlib.suppress(OSError, TypeError), Client(self.socket) as client:
                lenses = client.call(LENS + "Status")["parameters"]["lenses"]
                if all(lens["connection"] != "connecting" for lens in lenses):
                    return
            time.sleep(0.02)
        raise AssertionError("lensd does not answer: " + self.log())

    def log(self):
        self.errors.flush()
        with open(self.errors.name, encoding="utf-8") as file:
            return file.read()

    def wait_log(self, *words, times=None):
        """Until so many lines of the log (no number: any) have all these words: what is logged may come after the answer."""
        deadline = time.monotonic() + 5 * PATIENCE
        while (found := sum(all(word in line for word in words) for line in self.log().splitlines())) < (times or 1):
            if time.monotonic() > deadline:
                break
            time.sleep(0.01)
        assert found and found == (times or found), f"{found} lines have {words}:\n{self.log()}"

    def client(self, timeout=30 * PATIENCE):
        return Client(self.socket, timeout)

    def lensctl(self, *arguments, **options):
        return subprocess.run([os.path.join(BIN, "lensctl"), "--socket", self.socket, *arguments],
                              capture_output=True, text=True, timeout=120, check=False, **options)

    def kill(self):
        """Ends the daemon at once: nothing of it can tidy up."""
        self.process.kill()
        self.process.wait(timeout=30 * PATIENCE)
        self.errors.close()
        self.folder.cleanup()

    def stop(self):
        """Ends the daemon and returns its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(timeout=30 * PATIENCE)
        if status != 0:
            print(self.log())
        self.errors.close()
        self.folder.cleanup()
        return status


def driver_processes(daemon):
    """The numbers of the processes in which drivers of this lensd run."""
    found = []
    for path in glob.glob("/proc/[0-9]*/stat"):
        with contextlib.suppress(OSError), open(path, encoding="utf-8") as file:  # one may end meanwhile
            number, rest = file.read().split(" (", 1)
            name, rest = rest.rsplit(") ", 1)
            state, parent = rest.split()[:2]
            if name == "lensd-driver" and int(parent) == daemon.process.pid and state != "Z":
                found.append(int(number))
    return found


class DaemonTest(unittest.TestCase):
    """One daemon for all tests of a class; at the end it must go in peace."""
    lenses = ("a", "b")
    config = None
    quick = ()  # lenses with fast motors, see Daemon; what is stopped or looked at in mid-move stays slow

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(cls.lenses, cls.config, quick=cls.quick)

    @classmethod
    def tearDownClass(cls):
        log = cls.daemon.log()
        status = cls.daemon.stop()
        if status != 0:
            raise AssertionError(f"lensd ended with {status}: {log}")

    def position(self, lens="a", axis="focus"):
        with self.daemon.client() as client:
            status = client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]
        return next(a for a in status["axes"] if a["axis"] == axis)

    def wait_for(self, condition, seconds=10):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened")
            time.sleep(0.005)
