"""What the outside checks share: a Varlink client, daemons started by a check, thin-lens formulas of their own, PNG.

Written from the documents alone; shares no code with lensd. Standard library only.
"""
import base64, json, math, os, random, shutil, signal, socket, struct, subprocess, sys, tempfile, time, zlib
from fractions import Fraction


class VarlinkError(Exception):
    def __init__(self, reply):
        super().__init__(json.dumps(reply))
        self.name = reply.get("error", "").rsplit(".", 1)[-1]
        self.parameters = reply.get("parameters") or {}


class Client:
    def __init__(self, path, timeout=60.0):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(timeout)
        self.socket.connect(path)
        self.rest = b""

    def close(self):
        self.socket.close()

    def send(self, method, more=False, **parameters):
        if "." not in method:
            method = "io.lensd.Lens." + method
        message = {"method": method, "parameters": parameters}
        if more:
            message["more"] = True
        self.socket.sendall(json.dumps(message).encode() + b"\0")

    def receive(self):
        while b"\0" not in self.rest:
            piece = self.socket.recv(1 << 20)
            if not piece:
                raise EOFError("connection closed")
            self.rest += piece
        message, self.rest = self.rest.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, **parameters):
        self.send(method, **parameters)
        reply = self.receive()
        if "error" in reply:
            raise VarlinkError(reply)
        return reply.get("parameters") or {}

    def stream(self, method, **parameters):
        self.send(method, more=True, **parameters)
        while True:
            reply = self.receive()
            if "error" in reply:
                raise VarlinkError(reply)
            yield reply.get("parameters") or {}
            if not reply.get("continues"):
                return

    def snapshot(self, lens):
        data, frame = b"", None
        for piece in self.stream("Snapshot", lens=lens):
            frame = piece.get("frame", frame)
            data += base64.b64decode(piece["data"])
        return frame, ReadPng(data)


def ReadPng(data):
    """(width, height, bits, channels, rows of samples)"""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, idat, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            idat += body
        at += 12 + size
    width, height, bits, colour = head[:4]
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    pixel = channels * bits // 8
    stride = width * pixel
    raw, rows, before = zlib.decompress(idat), [], bytearray(stride)
    at = 0
    for _ in range(height):
        kind, line = raw[at], bytearray(raw[at + 1:at + 1 + stride])
        at += 1 + stride
        if kind == 1:
            for i in range(pixel, stride):
                line[i] = (line[i] + line[i - pixel]) & 255
        elif kind == 2:
            for i in range(stride):
                line[i] = (line[i] + before[i]) & 255
        elif kind == 3:
            for i in range(stride):
                left = line[i - pixel] if i >= pixel else 0
                line[i] = (line[i] + (left + before[i]) // 2) & 255
        elif kind == 4:
            for i in range(stride):
                a = line[i - pixel] if i >= pixel else 0
                b = before[i]
                c = before[i - pixel] if i >= pixel else 0
                p = a + b - c
                pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
                line[i] = (line[i] + (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255
        before = line
        rows.append(list(struct.unpack(">%dH" % (width * channels), line)) if bits == 16 else list(line))
    return width, height, bits, channels, rows


class Daemon:
    """lensd with a configuration and files of its own in a folder that goes away with it."""

    def __init__(self, bins, files, config="lensd.toml", keep=None, wait=True, args=()):
        self.bins = bins
        self.folder = keep or tempfile.mkdtemp(prefix="outside-")
        os.makedirs(self.folder, exist_ok=True)
        for name, text in files.items():
            path = os.path.join(self.folder, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb" if isinstance(text, bytes) else "w") as file:
                file.write(text)
        self.keep = keep
        self.path = os.path.join(tempfile.mkdtemp(prefix="outside-s-"), "s")
        self.log = open(os.path.join(self.folder, "lensd.log"), "wb")
        self.started = time.monotonic()
        self.process = subprocess.Popen([os.path.join(bins, "lensd"), "--config", os.path.join(self.folder, config),
                                         "--socket", self.path, *args], stdout=self.log, stderr=self.log)
        if wait:
            self.wait()

    def wait(self, seconds=20):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                client = Client(self.path)
                client.call("org.varlink.service.GetInfo")
                client.close()
                return time.monotonic() - self.started
            except (FileNotFoundError, ConnectionRefusedError):
                if self.process.poll() is not None:
                    raise RuntimeError("lensd ended with %d: %s" % (self.process.returncode, self.text()))
                time.sleep(0.005)
        raise RuntimeError("lensd does not answer")

    def wait_connected(self, seconds=20):
        end = time.monotonic() + seconds
        client = Client(self.path)
        while time.monotonic() < end:
            lenses = client.call("Status")["lenses"]
            if all(lens["connected"] for lens in lenses):
                client.close()
                return lenses
            time.sleep(0.02)
        raise RuntimeError("not connected: %s" % json.dumps(lenses))

    def text(self):
        self.log.flush()
        with open(self.log.name, "rb") as file:
            return file.read().decode(errors="replace")

    def client(self, timeout=60.0):
        return Client(self.path, timeout)

    def lensctl(self, *args, timeout=60):
        return Lensctl(self.bins, *args, socket_path=self.path, timeout=timeout)

    def stop(self):
        """SIGTERM; seconds until it ended, None if it had to be killed."""
        begin = time.monotonic()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(10)
            took = time.monotonic() - begin
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            took = None
        self.log.close()
        return took

    def clean(self):
        if not self.keep:
            shutil.rmtree(self.folder, ignore_errors=True)
        shutil.rmtree(os.path.dirname(self.path), ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self.clean()


def Lensctl(bins, *args, socket_path=None, timeout=60):
    env = dict(os.environ)
    env.pop("LENSD_SOCKET", None)
    if socket_path:
        env["LENSD_SOCKET"] = socket_path
    done = subprocess.run([os.path.join(bins, "lensctl"), *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env,
                          timeout=timeout, stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")


def Json(bins, *args, **more):
    """(exit status, value of the one line on stdout or None)"""
    code, out, err = Lensctl(bins, *args, "--json", **more)
    lines = out.strip().splitlines()
    if len(lines) != 1:
        return code, {"broken": True, "lines": len(lines), "out": out[:300], "err": err[:300]}
    return code, json.loads(lines[0])


# ---------------------------------------------------------------- optics, lengths in millimetres, vergence in 1/mm

def SignedBlur(f, a, z, u):
    """Of a point at vergence u (1/mm): positive behind the focal plane. From similar triangles: the cone from an opening
    a converges at distance 1/(1/f - u)."""
    return a * (z * (1.0 / f - u) - 1.0)


def J1(x):
    if abs(x) < 12:
        term, total, k = x / 2, x / 2, 1
        while abs(term) > 1e-18 * max(1e-300, abs(total)) or k < abs(x):
            term *= -(x * x / 4) / (k * (k + 1))
            total += term
            k += 1
            if k > 200:
                break
        return total
    n = 2000
    return sum(math.cos(t - x * math.sin(t)) for t in (math.pi * (i + 0.5) / n for i in range(n))) / n


def Kept(blur, period):
    """Contrast of a grating that a uniform disk keeps."""
    x = math.pi * abs(blur) / period
    return 1.0 if x < 1e-9 else 2 * J1(x) / x


class Report:
    def __init__(self, name):
        self.name, self.drawn, self.wrong = name, {}, {}

    def check(self, kind, ok, text=""):
        self.drawn[kind] = self.drawn.get(kind, 0) + 1
        if not ok:
            self.wrong.setdefault(kind, []).append(text)
        return ok

    def end(self, most=6):
        for kind, number in self.drawn.items():
            wrong = self.wrong.get(kind, [])
            print("%-60s drawn %5d  wrong %d" % (self.name + ": " + kind, number, len(wrong)))
            for text in wrong[:most]:
                print("    " + text)
        sys.stdout.flush()
        return 1 if self.wrong else 0


def Bins(argv):
    if len(argv) < 2 or not os.path.exists(os.path.join(argv[1], "lensd")):
        sys.exit("usage: %s FOLDER-OF-BINARIES [SEED]" % argv[0])
    seed = int(argv[2]) if len(argv) > 2 else 1
    random.seed(seed)
    return os.path.abspath(argv[1])
