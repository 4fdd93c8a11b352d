#!/usr/bin/python3
"""Scores autofocus of a lensd by pictures from pupils (pictures.py), sent through AutofocusBegin and AutofocusFrame.

  LENSD_BIN=build/release/bin bench/pupils/score.py --seed 1 --runs 50 [--class plain --class moderate ...]

Every run has another texture, lens, noise, place of the subject and start; all follow from the seed and the run's number.
  plain      rays of an ideal lens, perhaps with blades or an obstruction and a little spherical aberration
  moderate   spherical aberration, coma, astigmatism, colour, obstruction, blades, cat's eye, dirt, hot pixels, lights that
             clip, breathing; the f-number told is 0.7 to 1.5 times the true one
  beyond     as plain, focus 6 to 40 px of blur beyond an end of the travel
  blank      nothing but noise
The travel is 120 px of blur. within: at most 2 px from where the texture is sharpest; false: focused, and more than 4 px off
(in `beyond` and `blank`: focused at all, unless it stands at the end with focus less than 2 px beyond it); off: between.
`in 95 %`: of the answers, those no more than 1.96 sigmaD from the truth, `beyond 3`: more than 3, of the place where the lens
stands; `subject`: as `in 95 %`, of `subject`. The simulated lens of lensd only moves; no picture of its own is used.
"""
import argparse
import base64
import json
import os
import random as seeds
import socket
import subprocess
import sys
import tempfile
import time

import numpy as np
from pictures import FRAME, Optics, Scene

FOCAL_M, PIXEL_UM, TRUE_N, TRAVEL_PX, STEPS = 0.05, 3.45, 2.8, 120.0, 4000
TOLD = (0.7, 0.85, 1.0, 1.2, 1.5)                 # of the true f-number
PX_M = TRUE_N * PIXEL_UM * 1e-6                   # extension that a px of blur takes
SCENE = """version = 1
[camera]
width = 64
height = 48
pixel_um = {pixel}
frame_rate_hz = 500
exposure_ms = 1
[lens]
focal_length_mm = {focal}
f_number = {n}
extension_mm = [0.0, {reach:.9f}]
steps = {steps}
speed_steps_per_s = 200000
acceleration_steps_per_s2 = 200000000
settle_ms = 0
[[surface]]
kind = "wall"
distance_m = 1.0
constant = 0.5
"""


class Lensd:
    """One lens for each f-number that is told."""

    def __init__(self, binary):
        self.folder = tempfile.TemporaryDirectory(prefix="pupils-")
        path = self.folder.name
        config = "version = 1\n"
        for i, factor in enumerate(TOLD):
            with open(f"{path}/{i}.toml", "w", encoding="utf-8") as file:
                file.write(SCENE.format(pixel=PIXEL_UM, focal=FOCAL_M * 1e3, n=TRUE_N * factor, steps=STEPS,
                                        reach=TRAVEL_PX * PX_M * 1e3))
            config += f'[[lens]]\nname = "n{i}"\ndriver = "sim"\nscene = "{i}.toml"\n'
        with open(f"{path}/lensd.toml", "w", encoding="utf-8") as file:
            file.write(config)
        self.process = subprocess.Popen([binary, "--config", f"{path}/lensd.toml", "--socket", f"{path}/s"],
                                        stderr=subprocess.DEVNULL)
        self.rest, until = b"", time.monotonic() + 60
        while True:
            try:
                self.socket = socket.socket(socket.AF_UNIX)
                self.socket.settimeout(300)
                self.socket.connect(f"{path}/s")
                if all(one["connection"] != "connecting" for one in self.call("Status")["lenses"]):
                    return
            except OSError:
                pass
            self.socket.close()
            if time.monotonic() > until or self.process.poll() is not None:
                sys.exit("lensd does not come up")
            time.sleep(0.05)

    def call(self, method, /, **parameters):
        self.socket.sendall(json.dumps({"method": "io.lensd.Lens." + method, "parameters": parameters}).encode() + b"\0")
        while b"\0" not in self.rest:
            piece = self.socket.recv(1 << 20)
            if not piece:
                sys.exit("lensd closed the connection")
            self.rest += piece
        message, self.rest = self.rest.split(b"\0", 1)
        reply = json.loads(message)
        if "error" in reply:
            sys.exit(f"{method}: {reply}")
        return reply["parameters"]

    def focus(self, lens, start, method, take):
        """`take(position)` gives an 8-bit picture; the AutofocusResult."""
        self.call("Move", lens=lens, axis="focus", target={"position": start})
        answer = self.call("AutofocusBegin", lens=lens, pixelUm=PIXEL_UM, method=method, deadlineMs=600000)
        session = answer["session"]
        while answer.get("next"):
            grey = take(answer["next"]["position"])
            now = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
            answer = self.call("AutofocusFrame", session=session, widthPx=grey.shape[1], heightPx=grey.shape[0],
                               format="mono8", exposureStartNs=now, exposureEndNs=now,
                               data=base64.b64encode(grey.tobytes()).decode())
        return answer["autofocus"]

    def close(self):
        self.socket.close()
        self.process.terminate()
        self.process.wait(30)
        self.folder.cleanup()


def drawn(kind, seed, run, lens):
    """Scene, f-number told (its index), blur of the ideal lens at the low end of the travel, start."""
    draw = seeds.Random(f"{kind} {seed} {lens}")
    noise = np.random.default_rng([seed, run, ("plain", "moderate", "beyond", "blank").index(kind)])
    subject = draw.choice(("noise", "leaves", "strokes")) if kind != "blank" else "blank"
    told = TOLD.index(1.0)
    if kind == "moderate":
        some = lambda chance, low, high: draw.choice((-1, 1)) * draw.uniform(low, high) if draw.random() < chance else 0.0
        colour = some(0.5, 0.5, 2.0)
        optics = Optics(spherical=some(0.7, 0.5, 3.0), coma=some(0.5, 0.3, 1.5), astigmatism=some(0.4, 0.3, 1.0),
                        angle=draw.uniform(0, 6.28), colour=(colour, 0.0, -colour),
                        obstruction=draw.choice((0.0, 0.0, 0.3)), blades=draw.choice((0, 5, 6, 7, 9)),
                        catseye=draw.choice((0.0, 0.0, 0.3)))
        scene = Scene(subject, optics, noise, electrons=draw.choice((3000.0, 10000.0)),
                      breathing=draw.uniform(-3e-4, 3e-4), lights=draw.choice((0, 0, 4)), dirt=draw.choice((0, 0, 10, 25)),
                      hot=draw.choice((0, 0, 30)))
        told = draw.randrange(len(TOLD))
    else:
        optics = Optics(spherical=draw.uniform(-0.5, 0.5), blades=draw.choice((0, 0, 6, 8)),
                        obstruction=draw.choice((0.0, 0.0, 0.25)), angle=draw.uniform(0, 6.28))
        scene = Scene(subject, optics, noise)
    draw = seeds.Random(f"{kind} {seed} {run} here") if lens != run else draw
    inside = draw.uniform(15.0, TRAVEL_PX - 15.0)
    if kind == "beyond":
        off = draw.uniform(6.0, 40.0)
        inside = draw.choice((-off, TRAVEL_PX + off))
    return scene, told, inside, draw.randint(0, STEPS)


def run_once(lensd, kind, seed, run, options):
    lens = run - run % options.same_lens
    scene, told, ideal, start = drawn(kind, seed, run, lens)
    if options.same_lens > 1 and run == lens:
        lensd.call("ForgetLearned", lens=f"n{told}")
    px = lambda steps: steps * TRAVEL_PX / STEPS
    result = lensd.focus(f"n{told}", start, options.method, lambda steps: scene.picture(px(steps) - ideal))
    best = ideal + scene.best() if kind != "blank" else None
    ended = px(result["position"])
    row = {"class": kind, "run": run, "told": TOLD[told], "focused": result["focused"], "frames": result["frames"],
           "known": (result["slope"] or {}).get("known"), "method": result["method"], "cause": result["cause"], "best": best, "ended": ended, "reason": result["reason"]}
    if not result["focused"]:
        return {**row, "outcome": "refused"}
    if best is None:
        return {**row, "outcome": "false"}
    off = ended - best
    at_end = min(ended, TRAVEL_PX - ended) < 0.5 and abs(off) <= 2.0
    row["outcome"] = "within" if abs(off) <= 2.0 else "false" if abs(off) > 4.0 else "off"
    if kind == "beyond" and not at_end:
        row["outcome"] = "false"
    in_px = lambda sigma_d: sigma_d * (FOCAL_M + ended * PX_M) ** 2 / PX_M
    row["off"], row["sigma"] = off, in_px(result["sigmaD"])
    subject = result["subject"]
    row["subjectOff"], row["subjectSigma"] = px(subject["position"]) - best, in_px(subject["sigmaD"])
    return row


def table(rows):
    print(f"{'class':10}{'runs':>6}{'within':>8}{'off':>6}{'refused':>9}{'false':>7}{'frames':>10}{'in 95 %':>10}{'beyond 3':>10}{'subject':>9}")
    for kind in dict.fromkeys(row["class"] for row in rows):
        mine = [row for row in rows if row["class"] == kind]
        count = lambda outcome: sum(row["outcome"] == outcome for row in mine)
        frames = sorted(row["frames"] for row in mine)
        line = f"{kind:10}{len(mine):6}{count('within'):8}{count('off'):6}{count('refused'):9}{count('false'):7}"
        line += f"{frames[len(frames) // 2]:5} /{frames[int(0.95 * (len(frames) - 1))]:3}"
        told = [row for row in mine if "sigma" in row]
        if told:
            share = lambda off, sigma, times: 100.0 * sum(abs(r[off]) <= times * r[sigma] for r in told) / len(told)
            line += f"{share('off', 'sigma', 1.96):9.1f}%{100 - share('off', 'sigma', 3.0):9.1f}%"
            line += f"{share('subjectOff', 'subjectSigma', 1.96):8.1f}%"
        print(line)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=20, help="of each class")
    parser.add_argument("--class", dest="kinds", action="append", choices=("plain", "moderate", "beyond", "blank"))
    parser.add_argument("--same-lens", type=int, default=1, metavar="RUNS",
                        help="the next lens after so many runs, and what was learned is forgotten then")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--list", metavar="FILE", help="one line of JSON for each run")
    parser.add_argument("--most-false", type=int, help="exit status 1 where more answers are false")
    parser.add_argument("--least-right", type=float, default=0.0,
                        help="exit status 1 where a smaller share of a class is within, or refused where it has to be")
    options = parser.parse_args()
    if options.same_lens < 1:
        parser.error("--same-lens is 1 or more")
    lensd = Lensd(os.path.join(os.environ["LENSD_BIN"], "lensd"))
    rows = []
    try:
        for kind in options.kinds or ("plain", "moderate", "beyond", "blank"):
            rows += [run_once(lensd, kind, options.seed, run, options) for run in range(options.runs)]
    finally:
        lensd.close()
    table(rows)
    if options.list:
        with open(options.list, "w", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in rows)
    wrong = [row for row in rows if row["outcome"] == "false"]
    for row in wrong:
        print("false:", json.dumps(row))
    poor = False
    for kind in {row["class"] for row in rows}:
        right = "within" if kind in ("plain", "moderate") else "refused"
        mine = [row["outcome"] == right for row in rows if row["class"] == kind]
        poor |= sum(mine) < options.least_right * len(mine)
    sys.exit(poor or (options.most_false is not None and len(wrong) > options.most_false))


if __name__ == "__main__":
    main()
