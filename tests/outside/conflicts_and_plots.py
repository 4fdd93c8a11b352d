#!/usr/bin/python3
"""Infeasible plans: each name of a conflict is needed, relax is the smallest factor, the chart shades nothing and draws the relaxed plan."""
import os, sys
import xml.etree.ElementTree
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("infeasible plans")
NUMBER = int(os.environ.get("OUTSIDE_CASES", "60"))
Log = lambda a, b: math.exp(random.uniform(math.log(a), math.log(b)))
folder = tempfile.mkdtemp(prefix="outside-plots-")
G = lambda x: "%.5g" % x


def Args(p, drop=None, scale=1.0, plot=None):
    args = ["plan", "--focal-length", G(p["f"]) + "mm"]
    args += ["--f-number", "0.001..100000" if drop == "fNumber" else p["n"]]
    args += ["--extension", "0mm..%gmm" % (1e6 * p["f"]) if drop == "extension" else p["e"]]
    if p["focus"] and drop != "focus":
        args += ["--focus", p["focus"]]
    for name, kind, where, limit, side in p["limits"]:
        if name != drop:
            value = repr(limit * scale if kind == "sharp" else limit / scale)
            args += ["--" + kind, "%s=%s:%sum%s" % (name, where, value, side)]
    if p["wave"]:
        args += ["--wavelength", "%dnm" % p["wave"]]
    return args + (["--plot", plot] if plot else [])


infeasible = tries = 0
while infeasible < NUMBER and tries < NUMBER * 6:
    tries += 1
    f = Log(5, 200)
    n0 = Log(1, 6)
    e1 = f / random.uniform(4, 60)
    u = random.uniform(0.05, 0.9) * e1 / (f * (f + e1)) * 1000
    p = dict(f=f, n="%s..%s" % (G(n0), G(n0 * Log(1.5, 12))), e="0mm..%smm" % G(e1), limits=[], wave=random.choice([0, 0, 0, 550]),
             focus=random.choice(["", "", "", G(u) + "D"]))
    width = Log(0.002, 0.05) * n0 * 1000 / f ** 2   # dioptres of one limit
    for i in range(random.randint(1, 2)):
        v = sorted(max(0, u + width * random.uniform(-3, 3)) for _ in range(2))
        p["limits"].append(("s%d" % i, "sharp", "%sD..%sD" % (G(v[1]), G(v[0])), float(G(1000 * width * f ** 2 / 1000 / n0 * Log(0.2, 1.5))), ""))
    for i in range(random.randint(0, 2)):
        v = max(0, u + width * random.uniform(-8, 8))
        p["limits"].append(("b%d" % i, "blurred", G(v) + "D", float(G(1000 * width * f ** 2 / 1000 / n0 * Log(0.5, 6))), random.choice(["", ":behind", ":front"])))
    picture = os.path.join(folder, "p.svg")
    code, plan = Json(bins, *Args(p, plot=picture))
    text = "lensctl " + " ".join(Args(p)) + " --json -> %d %s" % (code, json.dumps(plan)[:260])
    if not report.check("answers", code in (0, 1), text):
        continue
    svg = open(picture).read() if os.path.exists(picture) else ""
    try:
        xml.etree.ElementTree.fromstring(svg)
        fine = True
    except xml.etree.ElementTree.ParseError:
        fine = False
    report.check("the chart is XML", fine, text)
    if os.path.exists(picture):
        os.remove(picture)
    if plan["feasible"]:
        report.check("the chart of a plan does not say that there is none", "no setting" not in svg.lower(), text)
        continue
    infeasible += 1
    report.check("exit status 1", code == 1, text)
    report.check("the chart says that there is none", "no setting meets every limit" in svg.lower(), text)
    report.check("the chart draws the relaxed plan where there is one", ("relaxed" in svg) == (plan["relax"] is not None), text)
    report.check("a conflict has a name or more", bool(plan["conflict"]), text)
    rest = dict(p, limits=[l for l in p["limits"] if l[0] in plan["conflict"]], focus=p["focus"] if "focus" in plan["conflict"] else "")
    keep = {"fNumber": "fNumber" in plan["conflict"], "extension": "extension" in plan["conflict"]}
    if not keep["fNumber"]:
        rest["n"] = "0.001..100000"
    if not keep["extension"]:
        rest["e"] = "0mm..%gmm" % (1e6 * f)
    _, again = Json(bins, *Args(rest))
    report.check("the names of the conflict alone are infeasible", again.get("feasible") is False, text + "\n      " + " ".join(Args(rest)))
    for name in plan["conflict"]:
        _, again = Json(bins, *Args(rest, drop=name))
        if rest["limits"] == [l for l in rest["limits"] if l[0] == name]:
            continue   # nothing left to ask about
        report.check("without one of them the rest is feasible", again.get("feasible") is True, text + "\n      without %s: lensctl %s -> %s" % (name, " ".join(Args(rest, drop=name)), json.dumps(again)[:200]))
    if plan["relax"] is not None:
        r = plan["relax"]
        report.check("relax is at least 1", r >= 1, text)
        _, more = Json(bins, *Args(p, scale=r * (1 + 1e-6)))
        _, less = Json(bins, *Args(p, scale=1 + (r - 1) * (1 - 1e-4)))
        report.check("limits relaxed by relax are feasible", more.get("feasible") is True, text + " at %r: %s" % (r, json.dumps(more)[:200]))
        report.check("relaxed by less they are not", less.get("feasible") is False or r < 1 + 1e-9, text)
    else:
        _, more = Json(bins, *Args(p, scale=1e4))
        report.check("no factor helps where relax is null", more.get("feasible") is False, text)
shutil.rmtree(folder, ignore_errors=True)
sys.exit(report.end())
