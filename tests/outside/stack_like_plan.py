#!/usr/bin/python3
"""plan and plan --stack judge f-number tolerance, diffraction and sensor tolerance alike, and as a scan of one's own does."""
import os, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("stack like plan")
NUMBER = int(os.environ.get("OUTSIDE_CASES", "120"))
Log = lambda a, b: math.exp(random.uniform(math.log(a), math.log(b)))
S = lambda x, n=6: float("%.*g" % (n, x))


def Interval(f, n, eps, delta, near, far, c, wave, low, high):
    """Extensions that keep blur within c over [far, near] (1/mm) for f-numbers n(1-eps) .. n(1+eps); None: there are none."""
    for m in (n * (1 - eps), n * (1 + eps)) if not wave else [n * (1 - eps + 2 * eps * i / 8) for i in range(9)]:
        a = f / m
        for u in (near, far):
            # a^2 ((f+e)(1/f-u) - 1)^2 + (2.44 wave (f+e)/a)^2 <= c^2, a quadratic in z = f + e
            w, d = 1 / f - u, 2.44 * wave / a
            p, q, r = (a * w) ** 2 + d * d, -2 * a * a * w, a * a - c * c
            disc = q * q - 4 * p * r
            if disc < 0:
                return None
            root = math.sqrt(disc)
            z0 = 2 * r / (-q + root) if r > 0 and q < 0 else (-q - root) / (2 * p)
            z1 = (-q + root) / (2 * p)
            low, high = max(low, z0 - f + delta) if z0 - f + delta > low else low, min(high, z1 - f - delta)
    return (low, high) if low <= high else None


agree = 0
for case in range(NUMBER):
    f, n0 = S(Log(5, 200), 4), S(Log(1, 4), 3)
    n1 = S(n0 * Log(3, 20), 3)
    zmin = f * random.uniform(4, 60)
    e1 = S(f * f / (zmin - f), 4)
    eps = random.choice([0, S(random.uniform(0.001, 0.1), 3)])
    delta = random.choice([0, S(Log(1e-4, 5e-3), 3)])   # mm
    wave = random.choice([0, 0, random.randint(400, 900)])
    c = S(Log(0.002, 0.06), 4)
    umax = e1 / (f * (f + e1))
    v = sorted(S(random.uniform(0, 1) * umax * 1000, 6) for _ in range(2))
    if random.random() < 0.7:
        v[1] = S(v[0] + random.uniform(0, 1) * 2 * c * Log(1, 20) * n0 / (f * f) * 1000, 7)
    far, near = v[0] / 1000, v[1] / 1000
    if near >= 0.9 / f:
        continue
    args = ["plan", "--focal-length", "%rmm" % f, "--f-number", "%r..%r" % (n0, n1), "--extension", "0mm..%rmm" % e1,
            "--sharp", "%rD..%rD:%rum" % (v[1], v[0], S(c * 1000, 4))]
    c = S(c * 1000, 4) / 1000
    if eps:
        args += ["--f-number-tolerance", "%r%%" % S(eps * 100, 3)]
        eps = S(eps * 100, 3) / 100
    if delta:
        args += ["--sensor-tolerance", "%rum" % S(delta * 1000, 3)]
        delta = S(delta * 1000, 3) / 1000
    if wave:
        args += ["--wavelength", "%dnm" % wave]
    code, plan = Json(bins, *args)
    code2, stack = Json(bins, *args, "--stack")
    text = "lensctl %s --json  -> %d %s; --stack -> %d %s" % (" ".join(args), code, json.dumps({k: plan.get(k) for k in ("feasible", "fNumber", "extensionMm", "error", "message")}), code2, json.dumps(stack)[:300])
    if not report.check("both answer", code in (0, 1) and code2 in (0, 1), text):
        continue
    one = stack["feasible"] and len(stack["shots"]) == 1
    convex = not wave or c * n1 * (1 + eps) / f <= 0.355
    report.check("one shot does exactly where a plan does", plan["feasible"] == one, text)
    if plan["feasible"] and one:
        report.check("at the same f-number", abs(plan["fNumber"] - stack["shots"][0]["fNumber"]) <= 1e-9 * plan["fNumber"], text)
    w = wave * 1e-6
    own = lambda n: Interval(f, n, eps, delta, near, far, c, w, 0.0, e1)
    if plan["feasible"]:
        got = Interval(f, plan["fNumber"], eps, delta * (1 - 1e-9), near, far, c * (1 + 1e-6), w, -1e-12, e1 * (1 + 1e-12))
        report.check("a plan holds by formulas of one's own", got is not None and got[0] - 1e-9 <= plan["extensionMm"] <= got[1] + 1e-9, text + " own %s" % (got,))
        better = own(plan["fNumber"] * (1 - 1e-6)) if plan["fNumber"] * (1 - 1e-6) > n0 else None
        report.check("no smaller f-number would do", better is None, text + " own %s" % (better,))
    else:
        scan = [n0 * (n1 / n0) ** (i / 400) for i in range(401)]
        found = [n for n in scan if Interval(f, n, eps, delta, near, far, c * (1 - 1e-9), w, 0.0, e1)]
        report.check("where there is no plan a scan finds none", not found, text + " own at f/%s" % found[:1])
sys.exit(report.end())
