#!/usr/bin/python3
"""A free focal length is as good as the best of plans at every place of the zoom in turn (within 0.1 %)."""
import os, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("free focal length")
NUMBER = int(os.environ.get("OUTSIDE_CASES", "8"))
Log = lambda a, b: math.exp(random.uniform(math.log(a), math.log(b)))
lenses = []
for i in range(NUMBER):
    f0 = round(Log(5, 60), 2)
    f1 = round(f0 * random.uniform(1.5, 3), 2)
    n0 = round(Log(1, 4), 2)
    lenses.append(dict(name="z%d" % i, f0=f0, f1=f1, n0=n0, n1=round(n0 * Log(5, 12), 1), e1=round(f1 * random.uniform(0.03, 0.15), 3),
                       steps=int(Log(200, 8000)), isteps=int(Log(50, 1500)), pixel=round(Log(2, 8), 2)))
files = {l["name"] + ".toml": """version=1
[camera]
width=64
height=64
pixel_um=%(pixel)r
[lens]
focal_length_mm=[%(f0)r,%(f1)r]
f_number=[%(n0)r,%(n1)r]
extension_mm=[0.0,%(e1)r]
steps=%(steps)d
iris_steps=%(isteps)d
initial_f_number=%(n0)r
[[surface]]
kind="wall"
distance_m=1.0
sinusoid_px=[8.0,0.0]
""" % l for l in lenses}
files["lensd.toml"] = "version=1\n" + "".join('[[lens]]\nname="%s"\ndriver="sim"\nscene="%s.toml"\n' % (l["name"], l["name"]) for l in lenses)
with Daemon(bins, files) as daemon:
    daemon.wait_connected()
    client = daemon.client()
    for l in lenses:
        zoom = random.uniform(l["f0"], l["f1"])
        e = l["e1"] * random.uniform(0.1, 0.9)
        n = l["n0"] * Log(1, 3)
        u = e / (zoom * (zoom + e))
        a = zoom / n
        blur = l["pixel"] * Log(0.7, 6) / 1000
        width = blur / (a * (zoom + e))
        near, far = u + width * random.uniform(0.2, 1), max(0.0, u - width * random.uniform(0.2, 1))
        limits = [dict(kind="sharp", limitUm=blur * 1000, depths=[{"oneEnd": {"vergenceD": near * 1000}, "otherEnd": {"vergenceD": far * 1000}}])]
        if random.random() < 0.7:
            other = l["pixel"] * Log(2, 20) / 1000
            behind = random.random() < 0.5
            v = u - other / (a * (zoom + e)) if behind else u + other / (a * (zoom + e))
            if 0 <= v < 0.6 / l["f1"]:
                limits.append(dict(kind="blurred", limitUm=other * 950, depths=[{"oneEnd": {"vergenceD": v * 1000}, "otherEnd": {"vergenceD": v * 1000}}], side="behind" if behind else "front"))
        request = dict(limits=limits, objective=random.choice(["light", "light", "sharp"]))
        begin = time.monotonic()
        free = client.call("Plan", lens=l["name"], request=dict(request, focalLengthMinMm=l["f0"], focalLengthMaxMm=l["f1"]))["plan"]
        took = time.monotonic() - begin
        axis = [x for x in [k for k in client.call("List")["lenses"] if k["name"] == l["name"]][0]["axes"] if x["axis"] == "zoom"][0]
        places = int(round((axis["maximum"] - axis["minimum"]) / axis["resolution"]))
        step = max(1, places // 1000)
        what = "fNumber" if request["objective"] == "light" else "worstRatio"
        best = None
        for i in range(0, places + 1, step):
            z = axis["minimum"] + axis["resolution"] * i
            plan = client.call("Plan", lens=l["name"], request=dict(request, focalLengthMm=min(z, axis["maximum"])))["plan"]
            if plan["feasible"] and (best is None or plan[what] < best[what]):
                best = plan
        text = "%s %s: free %s at %s mm (%.0f ms), the best of %d places %s at %s mm\n      %s\n      request %s" % (
            request["objective"], l["name"], free.get(what), free.get("focalLengthMm"), 1000 * took, places // step + 1, best and best[what], best and best["focalLengthMm"],
            json.dumps(l), json.dumps(dict(request, focalLengthMinMm=l["f0"], focalLengthMaxMm=l["f1"])))
        if free["feasible"]:
            report.check("within 0.1 % of the best", best is None or free[what] <= best[what] * 1.001, text)
        else:
            report.check("refused only where no place does", best is None, text)
sys.exit(report.end())
