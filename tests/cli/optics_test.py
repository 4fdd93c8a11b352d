#!/usr/bin/env python3
"""The lecture's optics as lensctl tells it, against exact fractions. The truths are computed from definitions that are
not the product's formulas: blur and light by the rays through the edges of the opening, conjugates by the lens equation,
depth of field by where the blur meets its limit. Conditions are drawn at random over the whole range, with fixed seeds;
figures with two roots of the lens equation between (diffraction, angles) are compared as floats."""
import json
import math
import os
import random
import subprocess
import sys
import unittest
from fractions import Fraction as Q

LENSCTL = sys.argv.pop(1)
LONG = os.environ.get("LENSD_TEST_LEVEL", "") == "long"
ROUNDS = 400 if LONG else 60

UNITS = {"um": Q(1, 10**6), "mm": Q(1, 1000), "cm": Q(1, 100), "m": Q(1), "km": Q(1000), "in": Q(254, 10000),
         "ft": Q(3048, 10000)}


def ask(*arguments):
    done = subprocess.run([LENSCTL, *arguments, "--json"], capture_output=True, text=True, timeout=60, check=False)
    if done.returncode != 0 or done.stderr:
        raise AssertionError((arguments, done.returncode, done.stdout, done.stderr))
    return json.loads(done.stdout)


class Draw(random.Random):
    """Texts as people type them, with their exact values in metres or dioptres."""

    def digits(self, low, high):
        return f"{10 ** self.uniform(math.log10(low), math.log10(high)):.{self.randint(1, 12)}g}"

    def length(self, low, high):
        """Between `low` and `high` metres, in any unit."""
        unit = self.choice([u for u in UNITS if low >= UNITS[u] / 100 or u in ("mm", "m")])
        number = self.digits(low / float(UNITS[unit]), high / float(UNITS[unit]))
        return number + unit, Q(number) * UNITS[unit]

    def depth(self, beyond, closest=Q(0)):
        """A depth farther than `closest`, most of them near it or far away: text, exact vergence."""
        kind = self.random()
        if kind < 0.1:
            return "inf", Q(0)
        if kind < 0.3:
            number = self.digits(1e-9, float(1 / (closest or beyond)) * 0.999)
            value = Q(number)
            return (number + "D", value) if value * (closest or beyond) < 1 else ("inf", Q(0))
        for _ in range(50):
            number = repr(float(beyond) * (1 + 10 ** self.uniform(-9, 9)))
            if Q(number) > closest:
                return number + "m", 1 / Q(number)
        return "1km", Q(1, 1000)

    def f_number(self):
        number = self.digits(0.5, 90)
        return self.choice(["", "f/", "f", "F", "F/"]) + number, Q(number)


class Lens:
    """A thin lens with its sensor, in the letters of the lecture."""

    def __init__(self, draw):
        text, self.f = draw.length(1e-3, 1.0)
        self.arguments = ["--focal-length", text]
        if draw.random() < 0.7:
            text, n = draw.f_number()
            self.arguments += ["--f-number", text]
            self.a = self.f / n
        else:
            text, self.a = draw.length(1e-4, 0.5)
            self.arguments += ["--aperture-diameter", text]
        kind = draw.random()
        if kind < 0.6:
            text, u = draw.depth(self.f, self.f)
            self.arguments += ["--focus", text]
            self.z_s = 1 / (1 / self.f - u)
        elif kind < 0.8:
            number = draw.digits(1e-9, 2.0)
            factor = draw.choice([1, 1, -Q(49, 100)])
            e = Q(number) * factor * self.f
            number = f"{float(e):.15e}"
            self.arguments += ["--extension", number + "m"]
            self.z_s = self.f + Q(number)
        else:
            text, self.z_s = draw.length(float(self.f) * 0.2, float(self.f) * 3)
            self.arguments += ["--sensor-distance", text]
        self.power = 1 / self.f

    def lands(self, a, x, u):
        """Where the ray from (x/u, 1/u), or from direction x, through the opening at `a` meets the sensor, on the image
        side's axes: the lens bends it by a/f."""
        slope = a * u - x             # leaves the scene point, meets the opening at a
        slope -= a * self.power
        return -(a + slope * self.z_s)


class Hole(Lens):
    def __init__(self, draw, model):  # pylint: disable=super-init-not-called
        text, self.z_s = draw.length(1e-3, 1.0)
        self.arguments = ["--model", model, "--sensor-distance", text]
        text, self.a = draw.length(1e-6, 0.1)
        self.arguments += ["--aperture-diameter", text]
        if model == "pinhole":
            self.a = Q(0)
        self.power = Q(0)


class Case(unittest.TestCase):
    def same(self, value, exact, about=None):
        """The double nearest to the exact value, or its neighbour."""
        self.assertLessEqual(abs(Q(value) - exact), abs(exact) * Q(1, 2**52), (value, float(exact), about))

    def close(self, value, expected, about=None):
        self.assertLessEqual(abs(value - expected), 1e-12 * abs(expected), (value, expected, about))

    def systems(self, seed):
        draw = Draw(seed)
        for i in range(ROUNDS):
            yield draw, (Lens(draw) if i % 3 else Hole(draw, draw.choice(["aperture", "pinhole"])))


class Blur(Case):
    def test_the_edge_rays_of_every_system(self):
        for draw, system in self.systems(1):
            places = [draw.depth(Q(1, 10**4)) for _ in range(4)]
            arguments = ["blur", *system.arguments]
            for text, _ in places:
                arguments += ["--at", text]
            for (text, u), row in zip(places, ask(*arguments)):
                about = (arguments, text)
                spread = system.lands(system.a / 2, Q(0), u) - system.lands(-system.a / 2, Q(0), u)
                self.same(row["signedBlurUm"], spread * 10**6, about)
                self.assertEqual(row["blurUm"], abs(row["signedBlurUm"]))
                self.same(row["vergenceD"], u)
                if u == 0:
                    self.assertIsNone(row["distanceM"])
                else:
                    self.same(row["distanceM"], 1 / u)
                if system.power == u or system.power == 0:
                    self.assertIsNone(row["imageDistanceMm"])
                else:
                    self.same(row["imageDistanceMm"], 1000 / (system.power - u), about)

    def test_inside_the_focal_length_and_at_it(self):
        rows = ask("blur", "--focal-length", "50mm", "--f-number", "2", "--focus", "1m", "--at", "50mm", "--at", "20D",
                   "--at", "25mm")
        self.assertEqual([row["imageDistanceMm"] for row in rows], [None, None, -50])
        self.same(rows[2]["signedBlurUm"], Q(25000) * (Q(1, 19) * (20 - 40) - 1))

    def test_diffraction_in_quadrature(self):
        for draw, system in self.systems(2):
            if system.a == 0:
                continue
            text, _ = draw.depth(system.z_s)
            wavelength = draw.randint(380, 1100)
            convention, factor = draw.choice([("airy", 2.44), ("mtf50", 1.75)])
            geometric = ask("blur", *system.arguments, "--at", text)[0]["blurUm"]
            row = ask("blur", *system.arguments, "--wavelength", f"{wavelength}nm", "--diffraction", convention, "--at", text)[0]
            disk = factor * wavelength * 1e-3 * float(system.z_s / system.a)
            self.close(row["blurUm"], math.hypot(geometric, disk), (system.arguments, text))
            self.assertEqual(abs(row["signedBlurUm"]), geometric)


class Dof(Case):
    def test_the_ends_are_where_blur_meets_the_limit(self):
        draw = Draw(3)
        for _ in range(ROUNDS):
            f_text, f = draw.length(1e-3, 1.0)
            n_text, n = draw.f_number()
            focus_text, u = draw.depth(f, f)
            c_text, c = draw.length(1e-6, 1e-3)
            answer = ask("dof", "--focal-length", f_text, "--f-number", n_text, "--focus", focus_text, "--blur-limit",
                         c_text)
            self.assertEqual(set(answer), {"nearM", "farM", "nearD", "farD", "hyperfocalM"})
            about = (f_text, n_text, focus_text, c_text)
            z_s, a = 1 / (1 / f - u), f / n
            # |A (Z_s (P - U) - 1)| = C
            near, far = (1 / f - (1 + side * c / a) / z_s for side in (-1, 1))
            self.same(answer["nearD"], near, about)
            self.same(answer["nearM"], 1 / near, about)
            if far > 0:
                self.same(answer["farD"], far, about)
                self.same(answer["farM"], 1 / far, about)
            else:
                self.assertEqual((answer["farD"], answer["farM"]), (0, None), about)
            self.same(answer["hyperfocalM"], f + f * f / (n * c), about)


class Conjugate(Case):
    def test_the_lens_equation_and_back(self):
        draw = Draw(4)
        for _ in range(ROUNDS):
            f_text, f = draw.length(1e-3, 1.0)
            x, y, z = (draw.choice([-1, 1]) * Q(draw.digits(1e-4, 1e4)) for _ in range(3))
            w = draw.choice([Q(1), Q(1), Q(0), Q(draw.digits(1e-6, 10))])
            if draw.random() < 0.1:
                z, w = f, Q(1)
            point = ",".join(f"{float(v)!r}" for v in (x, y, z, w))
            x, y, z, w = (Q(repr(float(v))) for v in (x, y, z, w))
            answer = ask("conjugate", "--focal-length", f_text, f"--point={point}")
            if z == f * w:
                self.assertIsNone(answer["imageMm"])
                self.assertEqual(answer["point"][3], 0)
                continue
            # 1/Z_i = 1/f - 1/Z_o; the ray through the centre goes straight on: X_i/Z_i = X_o/Z_o.
            z_i = f if w == 0 else 1 / (1 / f - w / z)
            for value, exact in zip(answer["imageMm"], (z_i * x / z, z_i * y / z, z_i)):
                self.same(value, exact * 1000, (f_text, point))
            image = [Q(value) for value in answer["point"]]
            for value, exact in zip(image[:3], (z_i * x / z, z_i * y / z, z_i)):
                self.assertLessEqual(abs(value / image[3] - exact), abs(exact) * Q(1, 2**51))


class Project(Case):
    def test_forward_is_what_the_edge_rays_light(self):
        for draw, system in self.systems(5):
            z_text, z = draw.length(1e-2, 1e3)
            (x_text, x), (y_text, y) = draw.length(1e-4, 10), draw.length(1e-4, 10)
            answer = ask("project", *system.arguments, "--point", f"{x_text},-{y_text},{z_text}")
            about = (system.arguments, x_text, y_text, z_text)
            edges = [system.lands(side * system.a / 2, x / z, 1 / z) for side in (-1, 1)]
            self.same(answer["imageMm"][0], sum(edges) / 2 * 1000, about)
            self.same(answer["imageMm"][1], -y / z * system.z_s * 1000, about)
            self.same(answer["diameterUm"], abs(edges[1] - edges[0]) * 10**6, about)

    def test_reverse_sees_exactly_the_points_that_light_it(self):
        for draw, system in self.systems(6):
            z_text, z = draw.length(1e-2, 1e3)
            (x_text, x), (y_text, y) = draw.length(1e-6, 0.1), draw.length(1e-6, 0.1)
            answer = ask("project", *system.arguments, "--sensor-point", f"-{x_text},{y_text}", "--at", z_text)
            about = (system.arguments, x_text, z_text)
            # The scene point X whose ray through the edge at a lands at -x: lands() is linear in X, so two tell it.
            ends = []
            for side in (-1, 1):
                a = side * system.a / 2
                at_0, at_1 = system.lands(a, Q(0), 1 / z), system.lands(a, 1 / z, 1 / z)
                ends.append((-x - at_0) / (at_1 - at_0))
            self.same(answer["sceneM"][0], sum(ends) / 2, about)
            self.same(answer["sceneM"][1], y * z / system.z_s, about)
            self.same(answer["diameterMm"], abs(ends[1] - ends[0]) * 1000, about)

    def test_directions(self):
        answer = ask("project", "--model", "pinhole", "--sensor-distance", "50mm", "--point", "0.1,-0.2,1,0")
        self.assertEqual(answer, {"imageMm": [5, -10], "diameterUm": 0})


class Light(Case):
    def test_the_cone_of_light(self):
        for _, system in self.systems(7):
            if system.a == 0:
                continue
            answer = ask("light", *system.arguments)
            self.same(answer["apertureDiameterMm"], system.a * 1000)
            self.same(answer["sensorDistanceMm"], system.z_s * 1000, system.arguments)
            self.same(answer["workingFNumber"], system.z_s / system.a)
            self.same(answer["tStop"], system.z_s / system.a)
            self.same(answer["lightParaxial"], (system.a / system.z_s) ** 2)
            theta = math.atan(float(system.a / (2 * system.z_s)))
            self.close(answer["lightExact"], 4 * math.sin(theta) ** 2, system.arguments)
            self.close(answer["subtendedAngleDeg"], math.degrees(2 * theta))
            if isinstance(system, Hole):
                self.assertIsNone(answer["fNumber"])
            else:
                self.same(answer["fNumber"], system.f / system.a)

    def test_a_plan_tells_the_same(self):
        plan = ask("plan", "--focal-length", "50mm", "--f-number", "1.4", "--extension", "0mm..8mm", "--focus", "0.8m")
        light = ask("light", "--focal-length", "50mm", "--f-number", "1.4", "--focus", "0.8m")
        for key in ("fNumber", "tStop", "workingFNumber", "lightParaxial", "lightExact", "subtendedAngleDeg"):
            self.close(plan[key], light[key], key)
        self.assertAlmostEqual(math.log2(plan["lightParaxial"] / plan["lightExact"]), 0.15, delta=0.01)


if __name__ == "__main__":
    unittest.main()
