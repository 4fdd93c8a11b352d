"""Starts lens-web beside a lensd and talks HTTP to it in raw bytes."""
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "daemon"))
from harness import BIN, LENS, PATIENCE, Daemon  # noqa: E402,F401

VIEW_TOKEN, MOVE_TOKEN = "v" * 40, "m" * 40


class Web:
    """lens-web on a free port."""

    def __init__(self, socket_path, *arguments):
        self.process = subprocess.Popen([os.path.join(BIN, "lens-web"), "--socket", socket_path, "--listen", "127.0.0.1:0", *arguments],
                                        stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.alpaca = None
        if line.startswith("Alpaca at "):
            self.alpaca, line = int(line.rsplit(":", 1)[1]), self.process.stdout.readline()
        match = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\n", line)
        assert match, f"lens-web says {line!r}"
        self.port = int(match[1])

    def stop(self):
        self.process.terminate()
        status = self.process.wait(timeout=20 * PATIENCE)
        self.process.stdout.close()
        return status

    def connect(self, timeout=20):
        made = socket.create_connection(("127.0.0.1", self.port), timeout * PATIENCE)
        made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return made

    def ask(self, method, path, body=None, headers=None, timeout=20):
        """Status, headers and body of one exchange on a connection of its own."""
        with self.connect(timeout) as connection:
            connection.sendall(request(self.port, method, path, body, headers))
            return Reader(connection).answer()

    def call(self, method, parameters=None, **headers):
        status, _, body = self.ask("POST", f"/call/{method}", json.dumps(parameters or {}),
                                   {"Content-Type": "application/json", **headers})
        return status, json.loads(body)


def request(port, method, path, body=None, headers=None):
    lines = {"Host": f"127.0.0.1:{port}", **(headers or {})}
    data = b"" if body is None else body.encode() if isinstance(body, str) else body
    if body is not None:
        lines["Content-Length"] = str(len(data))
    head = f"{method} {path} HTTP/1.1\r\n" + "".join(f"{name}: {value}\r\n" for name, value in lines.items() if value is not None)
    return head.encode() + b"\r\n" + data


class Reader:
    """Cuts what comes over one connection into answers and chunks."""

    def __init__(self, connection):
        self.connection, self.held = connection, b""

    def more(self):
        data = self.connection.recv(65536)
        if not data:
            raise EOFError(self.held)
        self.held += data

    def until(self, end):
        while end not in self.held:
            self.more()
        part, self.held = self.held.split(end, 1)
        return part

    def take(self, size):
        while len(self.held) < size:
            self.more()
        part, self.held = self.held[:size], self.held[size:]
        return part

    def head(self):
        lines = self.until(b"\r\n\r\n").decode().split("\r\n")
        fields = dict(line.lower().split(": ", 1) if ": " in line else (line, "") for line in lines[1:])
        return int(lines[0].split()[1]), fields

    def chunk(self):
        size = int(self.until(b"\r\n"), 16)
        data = self.take(size)
        self.take(2)
        return data

    def answer(self):
        status, fields = self.head()
        if fields.get("transfer-encoding") == "chunked":
            body = b""
            while data := self.chunk():
                body += data
            return status, fields, body
        return status, fields, self.take(int(fields.get("content-length", 0)))


class Stream:
    """An answer that goes on."""

    def __init__(self, web, path, method="GET", body=None, headers=None):
        self.connection = web.connect()
        self.connection.sendall(request(web.port, method, path, body, headers))
        self.reader, self.body = Reader(self.connection), b""
        self.status, self.fields = self.reader.head()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.connection.close()

    def until(self, end):
        while end not in self.body:
            data = self.reader.chunk()
            if not data:
                raise EOFError(self.body)
            self.body += data
        part, self.body = self.body.split(end, 1)
        return part

    def event(self):
        """The next server-sent event as {field: value}, data decoded; comments are passed over, for a while."""
        deadline = time.monotonic() + 20 * PATIENCE
        while True:
            assert time.monotonic() < deadline, "no event came, pings alone"
            lines = [line for line in self.until(b"\n\n").decode().split("\n") if line and not line.startswith(":")]
            fields = dict(line.split(": ", 1) for line in lines)
            if "data" in fields:
                return {**fields, "data": json.loads(fields["data"])}

    def picture(self):
        """The next part of multipart/x-mixed-replace: its header fields and bytes."""
        head = self.until(b"\r\n\r\n").decode()
        assert head.startswith("--f\r\n"), head
        fields = dict(line.split(": ", 1) for line in head.split("\r\n")[1:])
        size = int(fields["Content-Length"])
        while len(self.body) < size + 2:
            self.body += self.reader.chunk()
        data, self.body = self.body[:size], self.body[size + 2:]
        return fields, data


class WebTest(unittest.TestCase):
    """One lensd and one lens-web for all tests of a class; both must go in peace."""
    lenses = ("a", "b")
    config = None
    arguments = ()

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(cls.lenses, cls.config)
        cls.web = Web(cls.daemon.socket, *cls.arguments)

    @classmethod
    def tearDownClass(cls):
        statuses = cls.web.stop(), cls.daemon.stop()
        assert statuses == (0, 0), statuses

    def wait_for(self, condition, seconds=10):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "it never happened")
            time.sleep(0.01)


def token_file(folder, mode=0o640):
    path = os.path.join(folder, "tokens")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"# who may what\nview {VIEW_TOKEN}\nmove {MOVE_TOKEN}\n")
    os.chmod(path, mode)
    return path


def temporary_folder():
    return tempfile.TemporaryDirectory(prefix="lens-web-test-")
