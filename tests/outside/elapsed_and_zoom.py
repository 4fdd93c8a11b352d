#!/usr/bin/python3
"""elapsedMs is the time that passed, of plain moves, zooms that keep focus, homing and plans; a zoom keeps the tolerance asked for, or says so."""
import os, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("elapsed")
NUMBER = int(os.environ.get("OUTSIDE_CASES", "24"))
scene = """version=1
[camera]
width=64
height=64
[lens]
focal_length_mm=[20.0,60.0]
extension_mm=[0.0,3.0]
speed_steps_per_s=%r
[[surface]]
kind="wall"
distance_m=1.0
sinusoid_px=[8.0,0.0]
"""
names = ["slow", "quick"]
files = {"slow.toml": scene % 8000.0, "quick.toml": scene % 40000.0,
         "lensd.toml": "version=1\n" + "".join('[[lens]]\nname="%s"\ndriver="sim"\nscene="%s.toml"\n' % (n, n) for n in names)}
with Daemon(bins, files) as daemon:
    daemon.wait_connected()
    client = daemon.client()
    for case in range(NUMBER):
        lens = random.choice(names)
        kind = random.choice(["focus", "tracked zoom", "tracked zoom", "tracked zoom", "free zoom", "iris", "home", "focus by distance"])
        call = {"focus": dict(axis="focus", target={"position": float(random.randint(0, 8191))}),
                "iris": dict(axis="iris", target={"position": float(random.randint(0, 99))}),
                "focus by distance": dict(axis="focus", target={"vergenceD": random.uniform(0, 0.7)}),
                "free zoom": dict(axis="zoom", target={"focalLengthMm": random.uniform(20, 60)}),
                "tracked zoom": dict(axis="zoom", target={"focalLengthMm": random.uniform(20, 60)}, keepFocus=True)}.get(kind)
        tolerance = None
        if kind == "tracked zoom":
            client.call("Move", lens=lens, axis="focus", target={"vergenceD": random.uniform(0, 0.4)})
            if random.random() < 0.6:
                tolerance = call["trackingToleranceUm"] = round(math.exp(random.uniform(math.log(2), math.log(60))), 2)
        begin = time.monotonic()
        try:
            if kind == "home":
                moves = client.call("Home", lens=lens)["moves"]
            else:
                moves = [client.call("Move", lens=lens, **call)["move"]]
        except VarlinkError as error:
            if error.name != "OutOfRange":
                report.check("moves", False, "%s %s %s" % (lens, call, error))
            continue
        wall = 1000 * (time.monotonic() - begin)
        said = max(m["elapsedMs"] for m in moves)
        report.check(kind, said <= wall + 1 and said >= wall - 30 - 0.05 * wall, "%s %s: said %.1f ms, the wall clock %.1f" % (lens, call, said, wall))
        if tolerance:
            move = moves[0]
            report.check("tracking within the tolerance asked for, or a word about it",
                         move["trackingBoundUm"] <= tolerance * 1.001 or "toler" in move["reason"] or "track" in move["reason"],
                         "%s %s: trackingBoundUm %.3f, reason '%s'" % (lens, call, move["trackingBoundUm"], move["reason"]))
sys.exit(report.end())
