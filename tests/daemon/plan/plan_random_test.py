"""Random lenses far from the ordinary, planned for and moved by lensctl, and judged by thin-lens arithmetic from what the
scene says: from 4 to 400 mm, f/1 to f/64, infinity to life size, zooming, breathing, warm, with backlash, a pupil factor,
counted diffraction, distances from the lens or the sensor."""
import json
import math
import os
import random
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, Daemon  # noqa: E402

LENSES = int(os.environ.get("LENSD_LENSES", "6"))
PLANS = 8
FALSE, POSSIBLE = 1.02, 1.2


class RandomLens:
    """A scene and a configuration that tells of everything in it."""

    def __init__(self, draw):
        self.draw = draw
        log = lambda low, high: math.exp(draw.uniform(math.log(low), math.log(high)))
        self.f_mm = [log(4, 400)] * 2
        if draw.random() < 0.4:
            self.f_mm = [self.f_mm[0], self.f_mm[0] * draw.uniform(1.2, 4)]
        self.n = [draw.choice([1.0, draw.uniform(1.0, 4.0)]), draw.choice([16.0, 22.0, 64.0])]
        macro = draw.random() < 0.3
        self.e_mm = [0.0, self.f_mm[0] * (draw.uniform(0.5, 1.05) if macro else log(0.004, 0.1))]
        self.steps = int(log(300, 3000))
        self.iris_steps = int(log(30, 300))
        self.breathing = draw.choice([0.0, draw.uniform(-0.06, 0.1)])
        self.temperature, self.drift = draw.choice([(20.0, 0.0), (draw.uniform(-10, 45), draw.uniform(-4, 4))])
        self.backlash = draw.choice([0, draw.randint(3, 25)])
        self.iris_backlash = draw.choice([0, draw.randint(1, 4)])
        self.shift_mm = draw.uniform(-0.3, 0.3) * self.f_mm[1] if self.zooms() and draw.random() < 0.5 else 0.0
        self.pupil = draw.choice([1.0, 0.4, 2.5, draw.uniform(0.4, 2.5)])
        self.wavelength = draw.choice([None, draw.uniform(400e-9, 700e-9)])
        self.origin = draw.choice(["lens", "sensor"])
        self.gap_mm = draw.choice([0.0, draw.uniform(0, 0.5) * self.f_mm[0]])
        self.far = draw.random() < 0.4  # focus is approached moving toward far: the mechanism lags behind its counts
        self.curve = draw.random() < 0.5  # focus is told by a calibration, else by the data sheet

    def zooms(self):
        return self.f_mm[1] > self.f_mm[0]

    def write(self, folder):
        f, zoomed = (self.f_mm, True) if self.zooms() else (self.f_mm[0], False)
        shift = f"centre_shift_mm = {self.shift_mm}\n" if zoomed else ""
        with open(os.path.join(folder, "scene.toml"), "w", encoding="utf-8") as file:
            file.write(f"""version = 1
[camera]
width = 16
height = 16
[lens]
focal_length_mm = {f}
{shift}f_number = {self.n}
extension_mm = {self.e_mm}
steps = {self.steps}
iris_steps = {self.iris_steps}
breathing = {self.breathing}
temperature_c = {self.temperature}
drift_um_per_c = {self.drift}
backlash_steps = {self.backlash}
iris_backlash_steps = {self.iris_backlash}
speed_steps_per_s = 100000.0
acceleration_steps_per_s2 = 1e9
settle_ms = 1
[[surface]]
kind = "wall"
distance_m = 1000.0
constant = 0.5
""")
        breathing = f"""[breathing]
points = [{{ extension_mm = 0.0, ratio = 1.0 }}, {{ extension_mm = {self.e_mm[1]}, ratio = {1 + self.breathing} }}]
""" if self.breathing else ""
        curve = f"""[[focus]]
approach = "near"
error_um = 0.0
points = [{{ steps = 0, extension_mm = 0.0 }}, {{ steps = {self.steps - 1}, extension_mm = {self.e_mm[1]} }}]
""" if self.curve else ""
        with open(os.path.join(folder, "told.toml"), "w", encoding="utf-8") as file:
            file.write(f'version = 1\nserial = ""\nmade = "by hand"\n{breathing}{curve}')
        wavelength = f"wavelength_nm = {self.wavelength * 1e9}\n" if self.wavelength else ""
        return f"""version = 1
[[lens]]
name = "a"
driver = "sim"
scene = "{folder}/scene.toml"
distance_from = "{self.origin}"
[lens.optics]
focal_length_mm = {f}
{shift}f_number = {self.n}
extension_mm = {self.e_mm}
principal_gap_mm = {self.gap_mm}
pupil_factor = {self.pupil}
{wavelength}calibration = "{folder}/told.toml"
[lens.temperature]
compensate = true
um_per_c = {self.drift}
[lens.focus]
approach = "{'far' if self.far else 'near'}"
backlash = {self.backlash}
[lens.iris]
backlash = {self.iris_backlash}
"""

    # ---- what is true, in metres ---------------------------------------------------------------------------------------

    def state(self, focus, iris, zoom_mm):
        """With the mechanism where the positions say."""
        zoom = zoom_mm * 1e-3
        along = (focus + (self.backlash if self.far else 0)) / (self.steps - 1)
        f = zoom * (1 + self.breathing * along)
        e = along * self.e_mm[1] * 1e-3 + self.drift * 1e-6 * (self.temperature - 20)
        n = self.n[0] * (self.n[1] / self.n[0]) ** (iris / (self.iris_steps - 1))
        ahead = 0.0
        if self.zooms():
            ahead = self.shift_mm * 1e-3 * (zoom_mm - self.f_mm[0]) / (self.f_mm[1] - self.f_mm[0])
        return {"f": f, "z": f + e, "a": zoom / n, "ahead": ahead, "n": n}

    def vergence(self, depth, state):
        kind, value = depth
        if kind == "D":
            return value
        centre = value - state["ahead"]
        if self.origin == "sensor":
            centre -= state["z"] + self.gap_mm * 1e-3
        return 1 / max(centre, 1e-9)

    def blur(self, u, state):
        """Geometric: by half-triangles, with the opening's angle widened by the pupil factor."""
        f, z, a = state["f"], state["z"], state["a"]
        return abs(a * (z * (1 / f - u) - 1)) / (1 + f * u * (1 / self.pupil - 1))

    def counts(self, limit, state):
        """The blur that decides: the greatest of a sharp limit, the least of a blurred one."""
        ends = [self.vergence(depth, state) for depth in limit["depths"]]
        plane = 1 / state["f"] - 1 / state["z"]
        if limit["kind"] == "sharp":
            worst = max(self.blur(u, state) for u in ends)
            if self.wavelength:
                m = state["z"] / state["f"] - 1
                airy = 2.44 * self.wavelength * state["f"] / state["a"] * (1 + m / self.pupil)
                worst = math.hypot(worst, airy)
            return worst
        if limit["side"] == "behind":
            return self.blur(max(ends), state) if plane > max(ends) else 0.0
        return self.blur(min(ends), state) if plane < min(ends) else 0.0

    def ratio(self, limit, state):
        blur = self.counts(limit, state)
        return blur / limit["um"] * 1e6 if limit["kind"] == "sharp" else limit["um"] * 1e-6 / max(blur, 1e-15)

    # ---- questions -----------------------------------------------------------------------------------------------------

    def limits(self, zoom_mm):
        draw = self.draw
        there = self.state(draw.uniform(0, self.steps - 1), draw.uniform(0, self.iris_steps - 1), zoom_mm)
        closest = 0.8 / there["f"]
        typical = math.exp(draw.uniform(math.log(3e-6), math.log(2e-4))) / (there["a"] * there["z"])
        limits = []
        for index in range(draw.randint(1, 4)):
            kind = "sharp" if index == 0 or draw.random() < 0.4 else "blurred"
            side = draw.choice(["behind", "front"])
            away = typical * (draw.uniform(-0.6, 0.6) if kind == "sharp" else draw.uniform(1, 6))
            u = (1 / there["f"] - 1 / there["z"]) + (-away if side == "behind" else away)
            ends = sorted(min(max(v, 1e-4), closest) for v in (u, u + draw.uniform(-0.5, 0.5) * typical))
            limit = {"kind": kind, "side": side, "depths": [("D", v) for v in ends]}
            if draw.random() < 0.5:
                start = there["ahead"] + (there["z"] + self.gap_mm * 1e-3 if self.origin == "sensor" else 0)
                limit["depths"] = [("m", 1 / v + start) for v in ends]
            blur = max(self.counts(limit, there), 1e-6)
            factor = math.exp(draw.uniform(math.log(0.4), math.log(3 if kind == "sharp" else 2)))
            limit["um"] = blur * factor * 1e6
            limits.append(limit)
        return sorted(limits, key=lambda limit: limit["kind"], reverse=True)  # as lensctl names and numbers them

    def possible(self, limits, zoom_mm):
        """Some pair of positions leaves a fifth of every limit with each axis a step away."""
        grid = 1e-6 * 1e3 * (self.f_mm[1] - self.f_mm[0])
        zooms = {zoom_mm - grid, zoom_mm + grid} if self.zooms() else {zoom_mm}
        places = range(2, self.steps - self.backlash - 2) if self.far else range(self.backlash + 2, self.steps - 1)
        for focus in places[::max(1, self.steps // 400)]:
            states = [(z, f) for z in zooms for f in (focus - 1, focus + 1)]
            for iris in range(self.iris_backlash + 1, self.iris_steps - 1, max(1, self.iris_steps // 40)):
                if all(self.ratio(limit, self.state(f, i, z)) * POSSIBLE <= 1 for limit in limits
                       for z, f in states for i in (iris - 1, iris + 1)):
                    return True
        return False


def option(limit):
    unit = {"D": "D", "m": "m"}
    ends = "..".join(f"{value!r}{unit[kind]}" for kind, value in limit["depths"])
    side = ":" + limit["side"] if limit["kind"] == "blurred" else ""
    return [f"--{limit['kind']}", f"{ends}:{limit['um']!r}um{side}"]


class RandomLenses(unittest.TestCase):
    def judge(self, lens, daemon, tally):
        def ask(*arguments):
            done = daemon.lensctl(*arguments, "--json")
            self.assertIn(done.returncode, (0, 1), done.stderr)
            return json.loads(done.stdout)

        def status():
            with daemon.client() as client:
                return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]

        draw = lens.draw
        ask("focus", "a", f"@{draw.randint(0, lens.steps - 1)}")
        ask("aperture", "a", f"{draw.uniform(*lens.n):.4f}")
        zoom_mm = lens.f_mm[0]
        if lens.zooms():
            ask("zoom", "a", f"{draw.uniform(*lens.f_mm):.6f}mm", "--free")
            zoom_mm = next(a["position"] for a in status()["axes"] if a["axis"] == "zoom")
        limits = lens.limits(zoom_mm)
        plan = ask("plan", "a", *[word for limit in limits for word in option(limit)], "--apply")
        tally["plans"] += 1
        possible = lens.possible(limits, zoom_mm)
        tally["possible"] += possible
        context = json.dumps({"limits": limits, "lens": {k: v for k, v in vars(lens).items() if k != "draw"},
                              "plan": plan})
        if not plan["feasible"]:
            tally["missed"] += possible
            if possible:
                print("missed", context)
            return
        reached = plan["reached"]
        now = status()
        at = {a["axis"]: a for a in now["axes"]}
        tally["reached"] += reached["feasible"]
        tally["missed"] += possible and not reached["feasible"]
        for key in ("focalLengthMm", "extensionMm", "fNumber"):
            self.assertAlmostEqual(plan[key], now[key], delta=1e-9 * abs(now[key]) + 1e-12, msg=context)
        if not (at["focus"]["positionBound"] < lens.backlash + 0.6 and at["iris"]["positionBound"] < lens.iris_backlash + 0.6):
            return  # its backlash is not taken up: where the mechanism stands cannot be seen from here
        truth = lens.state(at["focus"]["position"], at["iris"]["position"], zoom_mm)
        for limit, said in zip(limits, reached["limits"]):
            blur_um = lens.counts(limit, truth) * 1e6
            if limit["kind"] == "sharp":
                self.assertLessEqual(blur_um, said["worstUm"] * (1 + 1e-9) + 1e-6, context)
            else:
                self.assertGreaterEqual(blur_um, said["worstUm"] * (1 - 1e-9) - 1e-6, context)
            if reached["feasible"]:
                self.assertLessEqual(lens.ratio(limit, truth), FALSE, context)

    def test_reached_is_true_and_what_is_possible_is_found(self):
        tally = {"plans": 0, "reached": 0, "possible": 0, "missed": 0}
        for seed in range(LENSES):
            lens = RandomLens(random.Random(1000 + seed))
            with tempfile.TemporaryDirectory(prefix="lensd-random-") as folder:
                daemon = Daemon(config=lens.write(folder))
                try:
                    for _ in range(PLANS):
                        self.judge(lens, daemon, tally)
                finally:
                    log = daemon.log()
                    self.assertEqual(daemon.stop(), 0, log)
        print(tally)
        self.assertGreater(tally["possible"], tally["plans"] / 5)
        self.assertLessEqual(tally["missed"], 0.05 * tally["possible"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
