#!/usr/bin/python3
"""Sixteen lenses of which eight are dead in different ways: first answer, status, live moves, stop and SIGTERM in time."""
import os, sys, threading
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("dead devices")
SLACK = float(os.environ.get("OUTSIDE_SLACK", "3"))    # a busy machine; 1 judges the figures of the issue


def Listen(garbage):
    server = socket.socket()
    server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    server.bind(("127.0.0.1", 0))
    server.listen(50)
    kept = []

    def Serve():
        while True:
            peer, _ = server.accept()
            kept.append(peer)
            if garbage:
                def Talk(peer=peer):
                    try:
                        while peer.recv(4096):
                            peer.sendall(os.urandom(random.randint(1, 300)))
                    except OSError:
                        pass
                threading.Thread(target=Talk, daemon=True).start()
    threading.Thread(target=Serve, daemon=True).start()
    return server.getsockname()[1]


closed = socket.socket()
closed.bind(("127.0.0.1", 0))
ports = dict(hang=Listen(False), garbage=Listen(True), refused=closed.getsockname()[1])
scene = """version=1
[camera]
width=64
height=64
[lens]
focal_length_mm=25.0
speed_steps_per_s=2000.0
[[surface]]
kind="wall"
distance_m=1.0
sinusoid_px=[8.0,0.0]
"""
text = "version=1\n"
for bus in ports:
    text += '[[bus]]\nname="%s"\ndriver="modbus"\nhost="127.0.0.1:%d"\n' % (bus, ports[bus])
live = ["live%d" % i for i in range(8)]
dead = {}


def Add(name, body):
    global text
    text += '[[lens]]\nname="%s"\n%s\n' % (name, body)


drive = 'driver="modbus"\nbus="%s"\n[lens.drives.focus]\nunit=1\nprofile="oriental-az"\nrange=[0,20000]'
for i, (name, body) in enumerate([
        ("noroute", 'driver="aravis"\naddress="192.0.2.17"'),
        ("noroute2", 'driver="aravis"\naddress="10.255.255.1"'),
        ("noserial", 'driver="aravis"\nserial="NOSUCH1"'),
        ("nousb", 'driver="lensconnect"\nserial="NOSUCH2"'),
        ("nouvc", 'driver="uvc"\nserial="NOSUCH3"'),
        ("nonode", 'driver="v4l2"\ndevice="/dev/v4l-subdev99"'),
        ("hangs", drive % "hang"),
        ("garbage", drive % "garbage")]):
    Add(name, body)
    dead[name] = body
    Add(live[i], 'driver="sim"\nscene="s.toml"')
Add("refused", drive % "refused")
dead["refused"] = ""


def Times(name, seconds, limit, text=""):
    report.check("%s within %g ms" % (name, limit * 1000), seconds is not None and seconds <= limit * SLACK, "%s: %s ms %s" % (name, seconds and round(seconds * 1000, 1), text))
    if os.environ.get("OUTSIDE_VERBOSE"):
        print("   %-30s %s ms %s" % (name, seconds and round(seconds * 1000, 1), text[:100]))


for turn in range(int(os.environ.get("OUTSIDE_TURNS", "2"))):
    with Daemon(bins, {"s.toml": scene, "lensd.toml": text}, wait=False) as daemon:
        while not os.path.exists(daemon.path) and daemon.process.poll() is None:
            time.sleep(0.001)
        Times("socket after start", time.monotonic() - daemon.started, 0.1)
        client = None
        while client is None and daemon.process.poll() is None:
            try:
                client = daemon.client(15)
            except OSError:
                time.sleep(0.001)
        if client is None:
            report.check("lensd starts", False, daemon.text())
            break
        first = client.call("Status")["lenses"]
        Times("first answer after start", time.monotonic() - daemon.started, 0.1)
        report.check("all lenses listed at once", len(first) == 17, "%d" % len(first))
        slowest, seen = 0.0, {}
        end = time.monotonic() + (3 if turn else 18)
        moved = {}
        while time.monotonic() < end:
            begin = time.monotonic()
            for lens in client.call("Status")["lenses"]:
                seen.setdefault(lens["name"], [])
                state = (lens.get("connection"), lens.get("error"))
                if state not in seen[lens["name"]]:
                    seen[lens["name"]].append(state)
                if lens["name"] in dead:
                    report.check("dead: neither connected, moving nor homed", not lens["connected"] and not any(
                        a["moving"] or a["homed"] for a in lens["axes"]) and lens.get("connection") in ("connecting", "absent", "wrong-device"),
                        json.dumps(lens))
            slowest = max(slowest, time.monotonic() - begin)
            time.sleep(0.02)
        Times("slowest Status of 17", slowest, 0.1)
        for name in live:
            report.check("live lens connects", seen[name][-1] == ("connected", None), "%s %s" % (name, seen[name]))
            try:
                result = client.call("Move", lens=name, axis="focus", target={"position": 200.0})
                report.check("live lens moves", result["move"]["reached"], json.dumps(result))
            except VarlinkError as error:
                report.check("live lens moves", False, str(error))
        for name in dead:
            report.check("dead: has a reason in words", turn == 1 or any(error for _, error in seen[name]), "%s %s" % (name, seen[name]))
            begin = time.monotonic()
            try:
                client.call("Move", lens=name, axis="focus", target={"position": 1.0})
                report.check("dead: a move is refused", False, name)
            except VarlinkError as error:
                report.check("dead: a move is refused", error.name == "Disconnected", str(error))
            Times("dead: refusal", time.monotonic() - begin, 0.1, name)
        if turn == 0:
            for name in dead:
                print("   %-9s %s" % (name, seen[name]))
        # a stop in mid-move of every live lens, while the dead are being tried
        others = [daemon.client() for _ in live]
        for other, name in zip(others, live):
            other.send("Move", lens=name, axis="focus", target={"position": 8000.0})
        time.sleep(0.3)
        begin = time.monotonic()
        client.call("Stop")
        Times("stop of all", time.monotonic() - begin, 0.01)
        for other in others:
            reply = other.receive()
            report.check("moves end as Cancelled", reply.get("error", "").endswith("Cancelled"), json.dumps(reply))
        moving = [a for lens in client.call("Status")["lenses"] for a in lens["axes"] if a["axis"] == "focus" and a["position"] > 7000]
        report.check("stopped short", not moving, json.dumps(moving))
        client.close()
        took = daemon.stop()
        Times("SIGTERM", took, 2.0)
        report.check("ends with 0", daemon.process.returncode == 0, str(daemon.process.returncode))
# SIGTERM right after the start, while everything is being opened
for wait in (0.0, 0.05, 0.3, 1.0):
    with Daemon(bins, {"s.toml": scene, "lensd.toml": text}, wait=False) as daemon:
        while not os.path.exists(daemon.path) and daemon.process.poll() is None:
            time.sleep(0.001)
        time.sleep(wait)
        Times("SIGTERM while opening", daemon.stop(), 2.0, "after %g s" % wait)
        report.check("SIGTERM while opening ends with 0", daemon.process.returncode == 0, "%s after %g s" % (daemon.process.returncode, wait))
sys.exit(report.end())
