#!/usr/bin/python3
"""Scores autofocus on points of light: random scenes of the simulator, one run each, by lens-bench.

  LENSD_BIN=build/release/bin bench/stars/score.py --seed 1 --runs 60 [--class aberrated ...] [--method stars,sweep]

Every run has other stars, another distance (one of three at infinity), sky, sensor and start; all follow from the seed and
the run's number.
  perfect    an ideal lens; 1 to 20 stars of 0.5 to 60 full scales each when sharp, which spread over a pixel at least
  clipped    the same, 100 to 2000 full scales: all of them too bright for the sensor in focus
  aberrated  1 to 5 stars, with spherical aberration, coma, an obstruction of up to 0.45, blades, breathing of up to 5 %, hot
             pixels and pixels of unequal gain; 2 to 300 full scales
  blank      no star: sky and hot pixels
  gradient   no star: a ramp of light
The travel is about 100 px of blur. within: at most 2 px of blur off; false: focused and more than 4 px off (in `blank` and
`gradient`: focused at all); off: between.
"""
import argparse
import collections
import json
import os
import random
import subprocess
import sys
import tempfile

CLASSES = ("perfect", "clipped", "aberrated", "blank", "gradient")
SCENE = """version = 1
[camera]
width = 320
height = 240
pixel_um = 3.45
bits = {bits}
full_well_e = {well}
read_noise_e = {read}
black_level = {black}
exposure_ms = 10
frame_rate_hz = 60
{flaws}
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [-0.15, 0.85]
steps = 4096
speed_steps_per_s = 8000
acceleration_steps_per_s2 = 200000
settle_ms = 8
initial_f_number = 2.8
{lens}
[truth]
region = [0.2, 0.2, 0.6, 0.6]
"""


def between(draw, low, high):
    """Even in the logarithm."""
    return low * (high / low) ** draw.random()


def scene_of(kind, draw):
    focal, far = 0.025, draw.random() < 1 / 3
    extension = draw.uniform(0.02e-3, 0.72e-3)
    distance = "inf" if far else repr(focal + focal * focal / extension)
    flaws, lens = "", ""
    if kind in ("aberrated", "blank"):
        flaws = f"prnu = 0.01\nhot_pixels = {between(draw, 2e-5, 5e-4):.6f}\nflaw_seed = {draw.randrange(1, 10**6)}"
    if kind == "aberrated":
        lens = (f"spherical_um = {draw.uniform(-1.0, 1.0):.3f}\ncoma_um = {draw.uniform(-1.5, 1.5):.3f}\n"
                f"obstruction = {draw.choice([0.0, draw.uniform(0.1, 0.45)]):.3f}\n"
                f"aperture_blades = {draw.choice([0, 0, 6, 8])}\nbreathing = {draw.uniform(0.0, 0.05):.4f}")
    text = SCENE.format(bits=draw.choice([8, 10, 12, 16]), well=round(between(draw, 3000, 30000)),
                        read=round(draw.uniform(2, 10), 1), black=round(draw.uniform(0.01, 0.06), 3), flaws=flaws, lens=lens)
    if kind in ("blank", "gradient"):
        paint = "constant = 0.05" if kind == "blank" else f"gradient = [0.02, {draw.uniform(0.1, 0.9):.2f}]"
        return text + f'[[surface]]\nkind = "wall"\ndistance_m = 2.0\n{paint}\n'
    low, high = {"perfect": (0.5, 60), "clipped": (100, 2000), "aberrated": (2, 300)}[kind]
    for _ in range(draw.randint(1, 5 if kind == "aberrated" else 20)):  # rays of an aberrated lens take their time
        text += (f"[[light]]\nx = {draw.uniform(0.22, 0.78):.5f}\ny = {draw.uniform(0.22, 0.78):.5f}\n"
                 f"distance_m = {distance}\nintensity = {between(draw, low, high):.3f}\n")
    return text


def run(binary, path, methods, seed):
    done = subprocess.run([f"{binary}/lens-bench", "autofocus", "--scene", path, "--method", methods, "--runs", "1", "--seed",
                           str(seed), "--json", "--each"], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{path}: {done.stderr}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=60, help="of each class")
    parser.add_argument("--class", dest="classes", action="append", choices=CLASSES)
    parser.add_argument("--method", default="stars,sweep", help="of lensd, with commas between them")
    parser.add_argument("--keep", help="folder for the scenes that did not end within")
    asked = parser.parse_args()
    binary = os.environ.get("LENSD_BIN", "build/release/bin")
    print("| class | method | runs | within | off | refused | false | frames median / p95 |\n|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="stars-") as folder:
        for kind in asked.classes or CLASSES:
            tally, frames = collections.defaultdict(collections.Counter), collections.defaultdict(list)
            for number in range(asked.runs):
                text = scene_of(kind, random.Random(f"{asked.seed} {kind} {number}"))
                path = f"{folder}/scene.toml"
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                for row in run(binary, path, asked.method, 1000 * asked.seed + number):
                    how = row["each"]["outcome"][0]
                    if kind in ("blank", "gradient") and how != "refused":
                        how = "false"
                    tally[row["method"]][how] += 1
                    frames[row["method"]].append(row["each"]["frames"][0])
                    wanted = "refused" if kind in ("blank", "gradient") else "within"
                    if asked.keep and how != wanted:
                        with open(f"{asked.keep}/{kind}-{number}-{row['method']}-{how}.toml", "w", encoding="utf-8") as file:
                            file.write(f"# seed {1000 * asked.seed + number}, off by {row['each']['errorPx'][0]} px\n{text}")
            for method, ends in tally.items():
                taken = sorted(frames[method])
                print(f"| {kind} | `{method}` | {asked.runs} | {ends['within']} | {ends['off']} | {ends['refused']} | "
                      f"{ends['false']} | {taken[len(taken) // 2]} / {taken[int(0.95 * (len(taken) - 1))]} |", flush=True)


if __name__ == "__main__":
    main()
