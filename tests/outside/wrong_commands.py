#!/usr/bin/python3
"""Wrong command lines, drawn at random: one clear message, the documented exit status, JSON to match; never a crash or silence."""
import os, re, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("wrong commands")
NUMBER = int(os.environ.get("OUTSIDE_CASES", "200"))
CODES = {2: "stopped", 3: "superseded", 4: "busy", 5: "timeout", 6: "out-of-range", 7: "not-homed", 8: "unsupported", 9: "leased",
         64: "usage", 65: "bad-data", 66: "no-input", 68: "not-found", 69: "unavailable", 70: "internal", 73: "cannot-write",
         74: "io", 76: "protocol", 77: "not-permitted", 78: "configuration", 130: "interrupted"}
pick = random.choice
number = lambda: "%.3g" % (10 ** random.uniform(-2, 3))


def BadQuantity(kind):
    """Text that is no quantity of this kind."""
    wrong = {"length": ["", "50", "mm", "50 m m", "5kg", "2D", "-50mm", "0mm", "nan", "infmm", "1e400mm", "50mmm", "0x10mm", "5,0mm", "50mm..60mm..70mm", "½mm"],
             "distance": ["", "2", "m", "2mm2", "x", "-1m", "2um5", "nanm", "1..2m", "--", "2m3", "٣m", "5ft-3in", "3s"],
             "blur": ["", "30", "um", "-3um", "0um", "2m/s", "px", "1D", "nan", "20um..30um"],
             "fnumber": ["", "f", "f/", "0", "-2", "f/-2", "2.8mm", "nan", "inf", "2.8.8", "F/x", "1e999"]}
    return pick(wrong[kind])


def Good(kind):
    return {"length": "%smm" % pick(["25", "50", "85"]), "distance": pick(["2m", "0.5D", "inf", "5ft7in"]), "blur": pick(["30um", "8um"]),
            "fnumber": pick(["2.8", "f/4", "F8"])}[kind]


def Spoilt(command, fields, extra=()):
    """A command with one field spoilt."""
    keys = list(fields)
    spoilt = pick(keys)
    args = [command]
    for key in keys:
        args.append(key + "=" + (BadQuantity(fields[key]) if key == spoilt else Good(fields[key])))
    return args + list(extra)


def Missing(command, fields, may_be=()):
    left_out = pick([key for key in fields if key not in may_be])
    return [command] + [key + "=" + Good(kind) for key, kind in fields.items() if key != left_out]


DOF = {"--focal-length": "length", "--f-number": "fnumber", "--focus": "distance", "--blur-limit": "blur"}
PLAN = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..3mm"]
U = {64}
DRAWN = [
    (U, lambda: Spoilt("dof", DOF)), (U, lambda: Spoilt("dof", DOF)), (U, lambda: Missing("dof", DOF, ["--focus"])),
    (U, lambda: Spoilt("blur", {"--focal-length": "length", "--f-number": "fnumber", "--focus": "distance", "--at": "distance"})),
    (U, lambda: ["blur", "--model", pick(["fish", "", "Thin", "thick"]), "--focal-length", "50mm", "--f-number", "2", "--focus", "2m", "--at", "1m"]),
    (U, lambda: ["blur", "--model", pick(["pinhole", "aperture"]), "--at", "1m"]),
    (U, lambda: ["blur", "--focal-length", "50mm", "--f-number", "2", "--focus", "2m", "--extension", "1mm", "--at", "1m"]),
    (U, lambda: ["blur", "--focal-length", "50mm", "--focus", "2m", "--at", "1m"]),
    (U, lambda: ["dof", "--focal-length", "50mm", "--f-number", "2", "--focus", pick(["50mm", "10mm", "25D", "0.049m"]), "--blur-limit", "30um"]),
    (U, lambda: ["conjugate", "--focal-length", "50mm", "--point=" + pick(["", "1m", "1m,2m", "1,2,3", "1m,2m,3", "a,b,c", "1m,2m,3m,4m", "0,0,0,0", "1m;2m;3m", "inf,0m,1m", "1m,2m,-3D"])]),
    (U, lambda: ["project", "--model", "pinhole", "--sensor-distance", "25mm"] + pick([[], ["--point", "1m,2m"], ["--sensor-point", "1mm,1mm"], ["--point", "0m,0m,1m", "--sensor-point", "1mm,1mm", "--at", "1m"], ["--at", "1m"], ["--sensor-point", "1mm", "--at", "1m"], ["--sensor-point", "1mm,1mm", "--at", "inf"]])),
    (U, lambda: ["light"] + pick([[], ["--focal-length", "50mm"], ["--f-number", "2"], ["--model", "aperture", "--aperture-diameter", "1mm"]])),
    (U, lambda: PLAN + ["--sharp", pick(["", "2m:", ":20um", "2m..:20um", "2m..3m..4m:20um", "2m:20", "2m:20um:behind", "a=:20um", "2m:-3um", "2m:0um", "x=y=2m:20um", "plane(1,2):20um", "plane(1,2,x):20um", "@1:20um", "@x:20um", "2m:1px"])]),
    (U, lambda: PLAN + ["--sharp", "2m:20um", "--blurred", pick(["5m", "5m:60um:left", "5m:60um:front:behind", "5m:60um:", "5m..:60um"])]),
    (U, lambda: ["plan", "--focal-length", "50mm", "--sharp", "2m:20um", "--f-number", pick(["", "a..b", "0..4", "4..", "1.4,,2", "-1..2", "2mm", "f/"]), "--extension", "0mm..3mm"]),
    (U, lambda: ["plan", "--focal-length", "50mm", "--sharp", "2m:20um", "--f-number", "2..8", "--extension", pick(["", "3", "a..b", "0mm..", "0mm..3mm..4mm", "0D..1D"])]),
    (U, lambda: PLAN + ["--objective", pick(["depth", "best", "", "Light"]), "--sharp", "2m:20um"]),
    (U, lambda: PLAN + ["--sharp", "2m:20um"] + pick([["--wavelength", "0nm"], ["--wavelength", "550"], ["--diffraction", "airey"], ["--pupil-factor", "0"], ["--pupil-factor", "-1"], ["--sensor-tolerance", "-2um"], ["--f-number-tolerance", "150%"], ["--f-number-tolerance", "-2%"], ["--model-tolerance", "x"], ["--from", "moon"], ["--units", "yd"], ["--aperture-diameter", "3mm..20mm"], ["--field", "1m"], ["--field", "1m@2m"], ["--sensor-distance", "50mm..52mm"]])),
    ({65, 66, 64}, lambda: PLAN + ["--sharp", "@1:20um", "--depth-map", pick(["/nonexistent.png", "/etc/passwd", "/", "/dev/null", ""])]),
    ({73}, lambda: PLAN + ["--sharp", "2m:20um", "--plot", pick(["/nonexistent/a.svg", "/proc/a.svg"])]),
    (U, lambda: PLAN + ["--sharp", "2m:20um", "--plot", pick(["/", "a.pdf", "a"])]),
    (U, lambda: [pick(["focuss", "Plan", "", "help me", "--jsn", "-x", "plan.", "dofs", "zoomm"])]),
    (U, lambda: pick([["dof", "--json=maybe"], ["--timeout", "5", "list"], ["--timeout", "-1s", "list"], ["--timeout", "x", "list"], ["--units", "m"]])),
    # with the daemon
    (U | {68}, lambda: ["focus"] + pick([["cam"], ["cam", "5"], ["cam", "+100mm"], ["cam", "x"], ["cam", "@"], ["cam", "@x"], ["cam", "+"], ["cam", "near:"], ["cam", "near:x"], ["cam", "ext:"], ["cam", "ext:3"], ["cam", "2m", "3m"], ["cam", "-5m"], ["cam", "f/2"], ["cam", "@1e999"], ["cam", "@nan"], []])),
    ({6}, lambda: ["focus", "cam", pick(["1mm", "24mm", "@99999", "@-5", "+99999", "-99999", "ext:99mm", "near:99999", "0.01m", "999D", "@1e12"])]),
    (U, lambda: ["aperture", "cam", pick(["x", "", "2.8mm", "f/", "@", "+", "@x", "0", "-2.5x", "2.8..4", "nan"])]),
    ({6}, lambda: ["aperture", "cam", pick(["0.5", "f/99", "@999", "+999", "-999", "@-1"])]),
    (U, lambda: ["zoom", "cam", pick(["x", "35", "", "35um2", "@", "35mm..40mm", "2D", "+mm", "nanmm"])]),
    ({6}, lambda: ["zoom", "cam", pick(["5mm", "500mm", "@999", "+999", "-999"])]),
    ({8}, lambda: ["filter", "cam", pick(["1", "2"])]), ({8, 64}, lambda: ["zoom", "two", pick(["35mm", "@3"])]),
    ({68}, lambda: [pick(["focus", "zoom", "aperture"]), pick(["nobody", "cam2", "camm"]), pick(["@5", "+3"])]),
    ({68}, lambda: [pick(["status", "stop", "home", "autofocus", "monitor", "metrics"]), pick(["nobody", "cam2"])]),
    (U, lambda: [pick(["focus", "zoom", "aperture"]), "@5"]), (U, lambda: pick([["snapshot", "-o", "/tmp/x.png"], ["home"], ["autofocus"], ["plan", "--sharp", "2m:20um"], ["calibrate", "--show"], ["preset", "list"]])),
    (U, lambda: ["home", "cam", pick(["nose", "Focus", "focus iris"])]), ({8, 64}, lambda: ["home", "cam", "filter"]),
    (U, lambda: ["autofocus", "cam"] + pick([["--roi", "1,2,3"], ["--roi", "0,0,2,2"], ["--roi", "a,b,c,d"], ["--roi", "0.5,0.5,0,0.1"], ["--roi", "-0.1,0,0.5,0.5"], ["--policy", "best"], ["--method", "magic"], ["--pixel", "3"], ["--track", "--frames-from", "true"], ["--roi", "0.9,0.9,0.2,0.2"]])),
    ({73}, lambda: ["snapshot", "cam", "-o", pick(["/nonexistent/x.png", "/proc/x.png"])]), (U, lambda: ["snapshot", "cam"]),
    (U | {66}, lambda: ["calibrate", "cam"] + pick([[], ["--point", "5"], ["--point", "x=1m"], ["--point", "0=inf", "--data-sheet"], ["--at", "x"], ["--point", "0="], ["--error", "5"], ["--repeat", "0", "--at", "1m"], ["--from-file", "/nonexistent"], ["--show", "--remove"]])),
    (U, lambda: ["backlash", "cam"] + pick([["--steps", "-5"], ["--steps", "x"], ["--pairs", "1"]])),
    ({68}, lambda: ["preset", pick(["recall", "remove"]), "cam", "nothing"]), (U, lambda: ["preset"] + pick([[], ["save"], ["save", "cam"], ["load", "cam", "a"]])),
    ({64, 8, 68}, lambda: ["call"] + pick([["Nope"], ["io.lensd.Lens.Nope"], ["a.b.C"], ["Status", "{"], ["Status", "[]"], ["Status", '{"lens": 5}'], ["Status", '{"lenz": "cam"}'], ["Move", "{}"], ["Move", '{"lens":"cam","axis":"nose","target":{"position":1}}'], ["Move", '{"lens":"cam","axis":"focus","target":{}}'], ["Move", '{"lens":"cam","axis":"focus","target":{"position":1,"relative":2}}']])),
    ({64, 8, 68}, lambda: ["introspect", pick(["a.b.c", "io.lensd.Nope", "x"])]), ({69, 64, 9}, lambda: ["lease", "drop", "cam"] if False else ["--socket", "/nonexistent/s", pick(["list", "status", "stop"])]),
    ({6}, lambda: ["plan", "cam", "--focal-length", pick(["5mm", "500mm"]), "--sharp", "2m:20um"]), (U, lambda: ["plan", "cam", "--focal-length", "x", "--sharp", "2m:20um"]),
    (U, lambda: ["stack", "cam", "--sharp", "1m..2m:20um"]), ({73}, lambda: ["stack", "cam", "--sharp", "1m..2m:200um", "-o", "/proc/nothing"]),
]
ANYWAY = os.environ.get("OUTSIDE_VERBOSE")
scene = """version=1
[camera]
width=64
height=64
[lens]
focal_length_mm=%s
speed_steps_per_s=100000.0
acceleration_steps_per_s2=1e8
[[surface]]
kind="wall"
distance_m=1.0
sinusoid_px=[8.0,0.0]
"""
files = {"cam.toml": scene % "[20.0,40.0]", "two.toml": scene % "25.0",
         "lensd.toml": 'version=1\n[[lens]]\nname="cam"\ndriver="sim"\nscene="cam.toml"\n[[lens]]\nname="two"\ndriver="sim"\nscene="two.toml"\n'}
with Daemon(bins, files) as daemon:
    daemon.wait_connected()
    for case in range(NUMBER):
        allowed, make = DRAWN[case % len(DRAWN)] if case < 2 * len(DRAWN) else pick(DRAWN)
        args = make()
        text = "lensctl " + " ".join("'%s'" % a if not a or re.search(r"[^\w./:=+@,-]", a) else a for a in args)
        try:
            code, out, err = daemon.lensctl(*args, timeout=30)
            code2, out2, err2 = daemon.lensctl(*args, "--json", timeout=30)
        except subprocess.TimeoutExpired:
            report.check("ends", False, text)
            continue
        said = "%s -> %d, %s" % (text, code, (err or out).strip()[:240])
        report.check("no crash", 0 <= code < 128, said)
        report.check("not a silent success", code != 0, said)
        report.check("status as documented (%s)" % "/".join(map(str, sorted(allowed))) if ANYWAY else "status as documented", code in allowed,
                     "wanted %s: %s" % (sorted(allowed), said))
        lines = [l for l in err.strip().splitlines() if l]
        report.check("one line, beginning with the program's name", len(lines) == 1 and lines[0].startswith("lensctl: ") and len(lines[0]) > 20, "%d lines: %s" % (len(lines), said))
        report.check("nothing on stdout", out.strip() == "", "%s stdout %s" % (text, out[:100]))
        json_lines = out2.strip().splitlines()
        ok = code2 == code and len(json_lines) == 1
        if ok:
            try:
                value = json.loads(json_lines[0])
                ok = isinstance(value, dict) and value.get("error") == CODES.get(code) and bool(value.get("message"))
            except ValueError:
                ok = False
        report.check("--json says the same", ok, "%s --json -> %d %s" % (text, code2, out2.strip()[:200]))
    report.check("the daemon lives", daemon.process.poll() is None and daemon.lensctl("list")[0] == 0, daemon.text()[-300:])
sys.exit(report.end(int(os.environ.get("OUTSIDE_SHOW", "8"))))
