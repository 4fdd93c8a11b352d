#!/usr/bin/env python3
"""The main job, end to end, with no hardware: plan, apply, prove it with a picture, defocus, focus again, and ask for the
impossible. Everything goes through lensctl; the proof uses frames alone. Run it by script/demo."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from png_crop import save_crop

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
BIN = os.environ.get("LENSD_BIN", os.path.join(ROOT, "build", "release", "bin"))
OUT = os.path.join(ROOT, "out", "demo")
PIXEL_UM = 50.25
NEAR = (2.1, 2.5)       # metres: sharp to 1 px
FAR_FROM = 4.3          # metres: everything beyond blurred by 4 px or more
REGION = "0.34,0.42,0.16,0.20"  # the engine, as fractions of the frame
ENGINE_M = 2.39         # its distance in the measured depth map
SMALL_APERTURE = 16.0
CROPS = {"near": (345, 180, 150, 112), "far": (20, 0, 150, 112)}  # x, y, width, height: engine and tank; back wall
DEPTH_MAP = os.path.join(ROOT, "scenes", "motorcycle", "depth_mm.png")


class Failed(Exception):
    """Something did not go as promised; the message says what."""


def say(text=""):
    print(text, flush=True)


def step(number, title):
    say(f"\n{number}. {title}")


class Bench:
    """lensd on a private socket, and lensctl talking to it."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="lensd-demo-")
        self.socket = os.path.join(self.folder, "io.lensd.Lens")
        self.log = open(os.path.join(OUT, "lensd.log"), "w", encoding="utf-8")
        self.daemon = subprocess.Popen(
            [os.path.join(BIN, "lensd"), "--config", os.path.join(HERE, "lensd.toml"), "--socket", self.socket],
            stdout=self.log, stderr=self.log)
        deadline = time.monotonic() + 20
        while not os.path.exists(self.socket):
            if self.daemon.poll() is not None or time.monotonic() > deadline:
                raise Failed("lensd did not start; see out/demo/lensd.log")
            time.sleep(0.02)
        while self.lensctl("status", "bike", quiet=True)["connection"] == "connecting":
            if time.monotonic() > deadline:
                raise Failed("the lens is not opened; see out/demo/lensd.log")
            time.sleep(0.02)

    def close(self):
        self.daemon.send_signal(signal.SIGTERM)
        try:
            status = self.daemon.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.daemon.kill()
            raise Failed("lensd did not stop within 10 s of SIGTERM") from None
        finally:
            self.log.close()
            shutil.rmtree(self.folder, ignore_errors=True)
        if status != 0:
            raise Failed(f"lensd ended with status {status}; see out/demo/lensd.log")

    def lensctl(self, *arguments, expect=(0,), quiet=False):
        """Runs lensctl, shows the command, and returns its JSON answer. `expect`: the statuses that are as they should be."""
        if not quiet:
            say("   $ lensctl " + " ".join(os.path.relpath(a, ROOT) if a.startswith("/") else a for a in arguments))
        done = subprocess.run([os.path.join(BIN, "lensctl"), "--json", "--socket", self.socket, *arguments],
                              capture_output=True, text=True, timeout=600, check=False)
        if done.returncode not in expect:
            raise Failed(f"lensctl {' '.join(arguments)}: status {done.returncode} instead of {' or '.join(map(str, expect))}: "
                         f"{done.stderr.strip() or done.stdout.strip()}")
        lines = [line for line in done.stdout.splitlines() if line.strip()]
        return json.loads(lines[-1]) if lines else None


def snapshot(bench, name):
    path = os.path.join(OUT, name)
    bench.lensctl("snapshot", "bike", "-o", path)
    return path


def plan_and_apply(bench, summary):
    step(1, f"Plan: {NEAR[0]} to {NEAR[1]} m sharp to 1 px, everything beyond {FAR_FROM} m blurred by 4 px or more")
    snapshot(bench, "before.png")
    asked = ["--pixel", f"{PIXEL_UM}um", "--sharp", f"near={NEAR[0]}m..{NEAR[1]}m:1px",
              "--blurred", f"far={FAR_FROM}m..inf:4px:behind"]
    plan = bench.lensctl("plan", "bike", *asked)
    if not plan["feasible"]:
        raise Failed(f"the plan should be feasible: {plan}")
    say(f"   f/{plan['fNumber']:.3f}, sensor {plan['sensorDistanceMm']:.4f} mm behind the lens centre,"
        f" focal plane at {plan['focalPlaneM']:.3f} m; the tightest limit is used to {100 * plan['worstRatio']:.1f} %")
    summary["planned"] = plan

    step(2, "Apply: turn focus and iris there")
    applied = bench.lensctl("plan", "bike", *asked, "--apply")
    summary["applied"] = applied
    for move in applied["applied"]:
        where = f"f/{move['fNumber']:.4g}" if move["axis"] == "iris" else f"{1 / move['vergenceD']:.4g} m"
        say(f"   {move['axis']} at {move['position']:g} steps, {where}: reached {move['reached']}, verified {move['verified']},"
            f" {move['elapsedMs']:.0f} ms")
        if not move["reached"]:
            raise Failed(f"{move['axis']} did not arrive: {move['reason']}")


def predicted_blur(bench, plan, path):
    """The blur that lensctl blur expects at every distance, for the chart."""
    arguments = ["blur", "--focal-length", "50mm", "--f-number", repr(plan["fNumber"]),
                 "--extension", f"{plan['extensionMm']!r}mm", "--pixel", f"{PIXEL_UM}um"]
    for step_of in range(151):
        arguments += ["--at", f"{2.0 + 0.02 * step_of:.2f}m"]
    with open(path, "w", encoding="utf-8") as out:
        json.dump(bench.lensctl(*arguments, quiet=True), out)


def blur_text(measured):
    """A measured blur with its error bar."""
    if measured["highPx"] is None:
        return "not known"
    if measured["atMost"]:
        return f"at most {measured['highPx']:.2f} px"
    return f"{measured['diameterPx']:.2f} px ({measured['lowPx']:.2f} to {measured['highPx']:.2f})"


def compare_with_plan(slices, path):
    """In how many slices the error bar holds what was planned for its mean distance, of how many that were planned."""
    with open(path, encoding="utf-8") as file:
        planned = json.load(file)
    inside = compared = 0
    for measured in slices:
        there = measured["meanM"]
        for one, next_one in zip(planned, planned[1:]):
            if not one["distanceM"] <= there < next_one["distanceM"]:
                continue
            part = (there - one["distanceM"]) / (next_one["distanceM"] - one["distanceM"])
            here = one["blurPx"] + part * (next_one["blurPx"] - one["blurPx"])
            compared += 1
            inside += measured["lowPx"] <= here and (measured["highPx"] is None or here <= measured["highPx"])
    return inside, compared


def measure(bench, summary):
    step(3, f"Prove it from frames alone: the picture against two frames through a small aperture (f/{SMALL_APERTURE:g})")
    picture = snapshot(bench, "after.png")
    bench.lensctl("aperture", "bike", f"{SMALL_APERTURE:g}")
    references = [snapshot(bench, "reference-a.png"), snapshot(bench, "reference-b.png")]
    predicted = os.path.join(OUT, "predicted.json")
    predicted_blur(bench, summary["applied"], predicted)
    measured = bench.lensctl("verify", picture, "--reference", references[0], "--reference", references[1],
                             "--depth-map", DEPTH_MAP, "--sharp", f"near={NEAR[0]}m..{NEAR[1]}m:1px",
                             "--blurred", f"far={FAR_FROM}m..inf:4px", "--slice", "0.05m", "--largest", "8px",
                             "--predicted", predicted, "--plot", os.path.join(OUT, "blur-vs-distance.svg"), expect=(0, 1))
    summary["measured"] = measured
    for limit in measured["limits"]:
        relation = "at most" if limit["kind"] == "sharp" else "at least"
        worst = limit["worst"]
        where = f"{blur_text(worst)} at {worst['meanM']:.2f} m" if worst else "nothing"
        say(f"   {limit['name']:>4}: {relation} {limit['limitPx']:g} px asked; worst measured {where}"
            f" ({limit['pixels']} pixels): {limit['answer']}")
    inside, compared = compare_with_plan(measured["slices"], predicted)
    say(f"   in {inside} of {compared} slices of depth the error bar holds the blur that was planned")
    if not measured["holds"]:
        raise Failed("the picture does not keep its limits, or the frames cannot tell")
    bench.lensctl("aperture", "bike", repr(summary["planned"]["fNumber"]))
    for name, source, gain in (("sharp", references[0], measured["slices"][0]["gain"]), ("before", "before.png", 1.0),
                               ("after", picture, 1.0)):
        for part, where in CROPS.items():
            save_crop(os.path.join(OUT, source), where, gain, os.path.join(OUT, f"{part}-{name}.png"))


def autofocus(bench, summary):
    step(4, "Defocus to 1.0 m, then autofocus back on the engine")
    bench.lensctl("focus", "bike", "1.0m")
    snapshot(bench, "defocused.png")
    result = bench.lensctl("autofocus", "bike", "--roi", REGION)
    snapshot(bench, "refocused.png")
    summary["autofocus"] = result
    if not result["focused"]:
        raise Failed(f"autofocus refused: {result['reason']}")
    distance = 1 / result["vergenceD"]
    say(f"   focused at {distance:.3f} m after {result['frames']} frames and {result['moves']} moves"
        f" in {result['elapsedMs'] / 1000:.1f} s (confidence {result['confidence']:.3f}): {result['reason']}")
    plan = summary["applied"]
    half_depth_of_field = 2 * PIXEL_UM * 1e-6 * plan["fNumber"] / (0.05 * plan["sensorDistanceMm"] * 1e-3)
    error = abs(result["vergenceD"] - 1 / ENGINE_M) / half_depth_of_field
    say(f"   the depth map has the engine at {ENGINE_M} m: {error:.2f} of half a depth of field (2 px of blur) away")
    if error > 1:
        raise Failed("that is not where the engine stands")


def impossible(bench, summary):
    step(5, "Ask for the impossible: bench and bike both sharp to 1 px, with no aperture smaller than f/4")
    answer = bench.lensctl("plan", "bike", "--pixel", f"{PIXEL_UM}um", "--f-number", "1.4..4",
                           "--sharp", f"bike={NEAR[0]}m..{NEAR[1]}m:1px", "--sharp", f"wall={FAR_FROM}m..5m:1px", expect=(1,))
    summary["impossible"] = answer
    if answer["feasible"]:
        raise Failed("that should have been impossible")
    say(f"   impossible: {', '.join(answer['conflict'])} contradict each other;"
        f" with every limit {answer['relax']:.2f} times looser it could be done")


def main():
    shutil.rmtree(OUT, ignore_errors=True)
    os.makedirs(OUT)
    summary = {}
    say("lensd demo: a simulated 50 mm f/1.4 lens looks at a photograph with measured depth.")
    bench = Bench()
    try:
        status = bench.lensctl("status", "bike")
        say(f"   it stands at f/{status['fNumber']:.3g}, focused at "
            + (f"{status['focalPlaneM']:.3g} m" if status["focalPlaneM"] else "infinity"))
        plan_and_apply(bench, summary)
        measure(bench, summary)
        autofocus(bench, summary)
        impossible(bench, summary)
    finally:
        bench.close()
    with open(os.path.join(OUT, "summary.json"), "w", encoding="utf-8") as out:
        json.dump(summary, out, indent=2)
        out.write("\n")
    say("\nIt worked. Pictures, chart and every number are in out/demo/:")
    for name in sorted(os.listdir(OUT)):
        say(f"   out/demo/{name}")


if __name__ == "__main__":
    try:
        main()
    except Failed as failure:
        print(f"script/demo: {failure}", file=sys.stderr)
        sys.exit(1)
