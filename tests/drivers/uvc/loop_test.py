"""Inside the virtual machine: lensd on the simulated USB camera, through libusb (driver uvc) or through the kernel's uvcvideo
(driver v4l2), each in a process of its own. Autofocus closes the loop on streamed pictures; the plug is pulled in mid-move. Order and state are asserted,
never time.

usage: loop_test.py BIN_FOLDER SIM_UVC uvc|v4l2"""
import json
import os
import subprocess
import sys
import tempfile
import time

BIN, SIM, DRIVER = sys.argv[1:4]
HERE = os.path.dirname(os.path.abspath(__file__))
SUBJECT_D = 1 / 1.2
# Half a depth of field, a blur of two pixels: 2 px N / (f Z_s).
HALF_DEPTH_D = 2 * 13.8e-6 * 2.8 / (0.025 * 0.0255)

CONFIG = {
    "uvc": 'driver = "uvc"\nprocess = "own"\nserial = "LOOP"\nfeedback = "counts"\ntimeout_ms = 5000\nframe_timeout_ms = 20000\npixel_um = 13.8\n',
    "v4l2": 'driver = "v4l2"\nprocess = "own"\nserial = "LOOP"\npixel_um = 13.8\ngamma = 1.0\nformat = "YUYV"\n'
            'focus_speed = 1500\nfocus_settle_ms = 300\niris_unit = "f-number"\niris_scale = 0.01\n',
}
OPTICS = """[lens.optics]
focal_length_mm = 25
f_number = [1.4, 16]
extension_mm = [0.0, 1.0]
[lens.focus]
direction = "near-positive"
"""


def check(what, so):
    print(("ok: " if so else "NOT SO: ") + what, flush=True)
    if not so:
        raise SystemExit(1)


def eventually(what, look, limit=60):
    end = time.monotonic() + limit
    while time.monotonic() < end:
        found = look()
        if found:
            return found
        time.sleep(0.2)
    check(what, False)


class Sim:
    def __init__(self):
        self.process = subprocess.Popen([SIM, os.path.join(HERE, "wall.toml"), "--serial", "LOOP"], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, bufsize=1)
        check("the simulated camera is plugged in", self.process.stdout.readline() == "plugged in\n")
        self.wait()

    def wait(self):
        """Until the kernel's driver has bound to it."""
        eventually("uvcvideo binds", lambda: any(name.startswith("video") for name in os.listdir("/dev")))

    def say(self, line):
        self.process.stdin.write(line + "\n")

    def where(self):
        self.say("where")
        words = self.process.stdout.readline().split()
        return {"focus": float(words[1]), "vergence": float(words[5])}


class Daemon:
    def __init__(self, folder):
        self.socket = os.path.join(folder, "s")
        config = os.path.join(folder, "lensd.toml")
        scene = os.path.join(HERE, "..", "..", "daemon", "small.toml")
        with open(config, "w", encoding="utf-8") as out:
            out.write(f'version = 1\n[[lens]]\nname = "usb"\n{CONFIG[DRIVER]}{OPTICS}'
                      f'[[lens]]\nname = "other"\ndriver = "sim"\nscene = "{scene}"\n')
        self.process = subprocess.Popen([os.path.join(BIN, "lensd"), "--config", config, "--socket", self.socket])
        eventually("lensd answers", lambda: self.ctl("list").returncode == 0)
        eventually("the camera is open", lambda: self.ctl("wait", "usb", "idle").returncode == 0)

    def start(self, *arguments):
        return subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.socket, "--timeout", "100s", *arguments],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def ctl(self, *arguments):
        process = self.start(*arguments)
        out, err = process.communicate(timeout=120)
        return subprocess.CompletedProcess(arguments, process.returncode, out, err)

    def move(self, *arguments):
        done = self.ctl(*arguments, "--json")
        check(f"{' '.join(arguments)}: {done.stdout.strip() or done.stderr.strip()}", done.returncode == 0)
        return json.loads(done.stdout)

    def status(self):
        return self.ctl("status", "usb", "--json").stdout


def closes_the_loop(sim, daemon):
    moved = daemon.move("focus", "usb", "@100")
    check("the move was reached", moved["reached"])
    check(f"the lens is there: {sim.where()}", abs(sim.where()["focus"] - 100) <= 1)
    found = daemon.move("autofocus", "usb")
    check("autofocus says focused", found["focused"])
    truth = sim.where()
    check(f"and it is: {truth}, subject at {SUBJECT_D:.4f} D, half a depth of field is {HALF_DEPTH_D:.3f} D",
          abs(truth["vergence"] - SUBJECT_D) <= HALF_DEPTH_D)


def survives_the_plug(sim, daemon):
    daemon.move("focus", "usb", "@0")
    moving = daemon.start("focus", "usb", "@1023")
    eventually("the lens sets off", lambda: sim.where()["focus"] > 10)
    sim.say("unplug")
    _, err = moving.communicate(timeout=120)
    check(f"the move ends with an error: {err.strip()}", moving.returncode == 69)
    check("the error says that the camera is gone", "unplugged" in err or "No such device" in err)
    other = daemon.move("focus", "other", "@50")
    check("the other lens still moves", other["reached"])
    check("lensd still runs", daemon.process.poll() is None)
    again = daemon.ctl("focus", "usb", "@100")
    check(f"a lens that is not there takes no orders: {again.stderr.strip()}", again.returncode != 0)
    sim.say("plug")
    eventually("the lens is found again", lambda: daemon.ctl("focus", "usb", "@200").returncode == 0)
    check(f"and moves: {sim.where()}", abs(sim.where()["focus"] - 200) <= 1)


def main():
    with tempfile.TemporaryDirectory() as folder:
        sim = Sim()
        daemon = Daemon(folder)
        closes_the_loop(sim, daemon)
        survives_the_plug(sim, daemon)
        daemon.process.terminate()
        check("lensd ends in peace", daemon.process.wait(timeout=60) == 0)
        sim.say("quit")
        check("the simulated camera too", sim.process.wait(timeout=60) == 0)


main()
