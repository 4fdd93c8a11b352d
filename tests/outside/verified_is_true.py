#!/usr/bin/python3
"""Moves with faults on every kind of feedback: what is called verified is where the picture says the lens is."""
import os, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("verified")
LENSES = int(os.environ.get("OUTSIDE_LENSES", "20"))
FEEDBACK = ["none", "echo", "counts", "encoder"]
FAULTS = ["", "jump", "missed-steps", "stale-readback", "stall"]
F, N, PIXEL, STEPS, SPAN, Z = 50.0, 2.0, 0.01, 4001, 2.0, 1.6   # mm; 0.5 um a step; in focus at 1613 mm... in the middle
FOCUS = F * F / (Z * 1000 - F)


def Scene(lens):
    text = """version=1
[camera]
width=48
height=128
pixel_um=10.0
bits=16
exposure_ms=1
frame_rate_hz=500
[lens]
focal_length_mm=%r
f_number=%r
extension_mm=[%r,%r]
steps=%d
speed_steps_per_s=20000.0
acceleration_steps_per_s2=1e7
settle_ms=3
feedback="%s"
initial_f_number=%r
[[surface]]
kind="wall"
distance_m=%r
sinusoid_px=[0.0,8.0]
""" % (F, N, FOCUS - SPAN / 2, FOCUS + SPAN / 2, STEPS, lens["feedback"], N, Z)
    if lens["fault"]:
        text += '[[fault]]\nat_ms=%d\nkind="%s"\n' % (lens["at"], lens["fault"])
        if lens["fault"] == "jump":
            text += "steps=%d\n" % lens["steps"]
        if lens["fault"] == "missed-steps":
            text += "factor=%r\n" % lens["factor"]
        if lens["for"]:
            text += "for_ms=%d\n" % lens["for"]
    return text


def Measured(rows):
    """Blur in px from the contrast of the grating, below the first zero."""
    c = s = m = 0.0
    for y in range(16, 112):
        v = sum(rows[y]) / len(rows[y])
        m += v / 96
        c += v * math.cos(2 * math.pi * y / 8) / 48
        s += v * math.sin(2 * math.pi * y / 8) / 48
    kept = math.hypot(c, s) / m
    low, high = 0.0, 9.7
    for _ in range(40):
        middle = (low + high) / 2
        if Kept(middle, 8) > kept:
            low = middle
        else:
            high = middle
    return low, kept


lenses = []
for i in range(LENSES):
    lenses.append({"name": "v%d" % i, "feedback": FEEDBACK[i % 4], "fault": FAULTS[(i // 4) % 5], "at": random.randint(300, 2500),
                   "steps": random.choice([-1, 1]) * random.randint(20, 150), "factor": round(random.uniform(0.02, 0.5), 3),
                   "for": random.choice([0, 0, 500, 1500])})
files = {l["name"] + ".toml": Scene(l) for l in lenses}
files["lensd.toml"] = "version=1\n" + "".join('[[lens]]\nname="%s"\ndriver="sim"\nscene="%s.toml"\n' % (l["name"], l["name"]) for l in lenses)
counted = {}
with Daemon(bins, files) as daemon:
    daemon.wait_connected()
    client = daemon.client()
    for lens in client.call("List")["lenses"]:
        told = [l for l in lenses if l["name"] == lens["name"]][0]["feedback"]
        focus = [a for a in lens["axes"] if a["axis"] == "focus"][0]
        report.check("List tells the feedback", focus["feedback"] == told, "%s %s" % (told, focus))
    begun = time.monotonic()
    turn = 0
    while turn < 5 or time.monotonic() - begun < 3.5:
        turn += 1
        for lens in lenses:
            key = (lens["feedback"], lens["fault"] or "no fault")
            home = random.random() < 0.08
            try:
                if home:
                    move = [m for m in client.call("Home", lens=lens["name"])["moves"] if m["axis"] == "focus"][0]
                else:
                    target = STEPS // 2 + random.choice([-1, 1]) * random.randint(40, 280)
                    if random.random() < 0.5:
                        client.call("Move", lens=lens["name"], axis="focus", target={"position": float(random.randint(0, STEPS - 1))})
                    move = client.call("Move", lens=lens["name"], axis="focus", target={"position": float(target)})["move"]
            except VarlinkError as error:
                counted.setdefault(key, {}).setdefault("error " + error.name, []).append(str(error)[:160])
                report.check("an error only with a fault", lens["fault"] != "", "%s %s" % (key, error))
                continue
            state = "home " if home else ""
            state += "verified" if move["verified"] else "reached" if move["reached"] else "missed" if move.get("missed") else "other"
            counted.setdefault(key, {}).setdefault(state, []).append(move["reason"])
            report.check("verified only when reached", move["reached"] or not move["verified"], json.dumps(move))
            if not home:
                report.check("verified only with an encoder", not move["verified"] or lens["feedback"] == "encoder", "%s %s" % (key, json.dumps(move)))
                if move["reached"]:
                    report.check("reached: within a step of the target by the reading", abs(move["position"] - target) <= 1, "%s target %d %s" % (key, target, json.dumps(move)))
            if not lens["fault"] and not home:
                report.check("without a fault it arrives", move["reached"], "%s %s" % (key, json.dumps(move)))
                if lens["feedback"] == "encoder":
                    report.check("an encoder without a fault verifies", move["verified"], json.dumps(move))
            if home or not move["reached"] or (lens["fault"] and not move["verified"]):
                continue
            try:
                frame, picture = client.snapshot(lens["name"])
            except VarlinkError as error:
                counted.setdefault(key, {}).setdefault("no frame", []).append(str(error)[:160])
                continue
            blur, kept = Measured(picture[4])
            a, u = F / N, 1 / (Z * 1000)
            at = move["extensionMm"]
            bound = move["extensionBoundUm"] / 1000
            ends = [abs(SignedBlur(F, a, F + at + d, u)) / PIXEL for d in (-bound, 0, bound)]
            ok = min(ends) - 0.12 <= blur <= max(ends) + 0.12 or (blur < 0.5 and min(ends) < 0.6)
            if lens["fault"] != "stall":
                true = client.call("io.lensd.Simulator.Truth", lens=lens["name"])["focusPosition"]
                report.check(("verified" if move["verified"] else "reached without a fault") + " is true of the mechanism",
                             abs(true - move["position"]) <= move["positionBound"],
                             "%s truly at %.4f; %s %s" % (key, true, json.dumps(move), lens))
                report.check(("verified" if move["verified"] else "reached without a fault") + " is true by picture", ok,
                             "%s blur %.3f px, want %.3f..%.3f; %s %s" % (key, blur, min(ends), max(ends), json.dumps(move), lens))
            elif not ok:
                counted.setdefault(key, {}).setdefault("off by picture", []).append(move["reason"])
                report.check("verified is true by picture", not move["verified"], "%s %s" % (key, json.dumps(move)))
for key in sorted(counted):
    print("   ", key, {state: len(v) for state, v in counted[key].items()}, sorted({r for v in counted[key].values() for r in v if r})[:4])
sys.exit(report.end())
