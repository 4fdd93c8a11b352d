#!/usr/bin/env python3
"""Runs lensctl as people and scripts do: exit status, what goes to stdout and stderr, the fields of the JSON, and the
figures against exact rational arithmetic on the decimals written on the command line."""
import json
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
import zlib
from fractions import Fraction as Q

LENSCTL = sys.argv.pop(1)

UNITS = {"nm": Q(1, 10**9), "um": Q(1, 10**6), "mm": Q(1, 1000), "cm": Q(1, 100), "m": Q(1), "km": Q(1000),
         "in": Q(254, 10000), "ft": Q(3048, 10000)}


def metres(text):
    for unit in sorted(UNITS, key=len, reverse=True):
        if text.endswith(unit):
            return Q(text[:-len(unit)]) * UNITS[unit]
    raise ValueError(text)


def vergence(text):
    if text == "inf":
        return Q(0)
    return Q(text[:-1]) if text.endswith("D") else 1 / metres(text)


def run(*arguments):
    done = subprocess.run([LENSCTL, *arguments], capture_output=True, text=True, timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


def no_constant(name):
    raise ValueError(f"{name} in JSON")


class Case(unittest.TestCase):
    def answer(self, *arguments, status=0):
        """The one JSON value on the one line of stdout."""
        code, out, err = run(*arguments, "--json")
        self.assertEqual((code, err), (status, ""), (arguments, out, err))
        self.assertTrue(out.endswith("\n") and out.count("\n") == 1, out)
        return json.loads(out, parse_constant=no_constant)

    def refused(self, status, says, *arguments):
        """stdout stays empty, stderr is one line, with and without --json."""
        for extra in ((), ("--json",)):
            code, out, err = run(*arguments, *extra)
            self.assertEqual((code, out), (status, ""), (arguments, err))
            self.assertTrue(err.startswith("lensctl: ") and err.endswith("\n") and err.count("\n") == 1, err)
            self.assertIn(says, err)

    def near(self, value, exact, relative=1e-12, absolute=0.0):
        error = abs(Q(value) - exact)
        self.assertLessEqual(error, max(abs(exact) * Q(relative), Q(absolute)), (value, float(exact)))


class Frame(Case):
    def test_help_and_version(self):
        code, out, err = run("--version")
        self.assertEqual((code, err), (0, ""))
        self.assertRegex(out, r"^lensctl \d+\.\d+\.\d+\n$")
        for arguments in (["--help"], ["plan", "--help"], ["blur", "-h"], ["dof", "--help"], ["conjugate", "--help"]):
            code, out, err = run(*arguments)
            self.assertEqual((code, err), (0, ""))
            self.assertIn("Usage", out)

    def test_usage_errors(self):
        self.refused(64, "say which command")
        self.refused(64, "'bogus'", "bogus")
        self.refused(64, "--bogus", "plan", "--bogus")
        self.refused(64, "--focal-length", "dof")
        self.refused(64, "say lens, sensor or front", "--from", "here", "dof", *DOF)
        self.refused(64, "500ms", "--timeout", "3", "dof", *DOF)

    def test_global_options_before_and_after(self):
        before = run("--json", "--from", "sensor", "dof", *DOF)
        after = run("dof", *DOF, "--json", "--from", "sensor")
        self.assertEqual(before, after)
        self.assertEqual(before[0], 0)
        self.assertNotEqual(json.loads(before[1]), self.answer("dof", *DOF))


DOF = ["--focal-length", "50mm", "--f-number", "2.8", "--focus", "2m", "--blur-limit", "8um"]


class Blur(Case):
    FIELDS = {"distanceM", "vergenceD", "blurUm", "signedBlurUm", "imageDistanceMm"}

    def check(self, f, n, at, focus=None, extension=None):
        plane = ["--focus", focus] if focus else ["--extension", extension]
        arguments = ["blur", "--focal-length", f, "--f-number", n, *plane]
        for place in at:
            arguments += ["--at", place]
        rows = self.answer(*arguments)
        self.assertEqual(len(rows), len(at))
        length = metres(f)
        e = metres(extension) if extension else length**2 * vergence(focus) / (1 - length * vergence(focus))
        for place, row in zip(at, rows):
            self.assertEqual(set(row), self.FIELDS)
            u = vergence(place)
            exact = length / Q(n) * ((length + e) * (1 / length - u) - 1)
            self.near(row["signedBlurUm"], exact * 10**6, absolute=0 if exact else 1e-300)
            self.assertEqual(row["blurUm"], abs(row["signedBlurUm"]))
            self.near(row["vergenceD"], u)
            if u == 0:
                self.assertIsNone(row["distanceM"])
            else:
                self.near(row["distanceM"], 1 / u)
            if length * u == 1:
                self.assertIsNone(row["imageDistanceMm"])
            else:
                self.near(row["imageDistanceMm"], length / (1 - length * u) * 1000)

    def test_exact(self):
        self.check("50mm", "2.8", ["0.8m", "1m", "inf", "2D", "33in", "20mm", "50mm", "1e-3D", "1000km"], focus="0.8m")
        self.check("50mm", "1.4", ["1m", "inf", "0.0501m"], focus="inf")
        self.check("35mm", "4", ["1m", "inf", "5km"], extension="-0.1mm")
        self.check("35mm", "4", ["1m", "inf", "2.5D"], extension="1.25mm")

    def test_near_the_focal_length_and_far_away(self):
        for near in ("50.00000005mm", "50.0000001mm", "50.1mm"):
            self.check("50mm", "2.8", [near, "50.0000002mm", "1m", "inf"], focus=near)
        for far in ("1e9m", "5e10m", "1e-11D"):
            self.check("50mm", "2.8", [far, "1e8m", "inf", "1m"], focus=far)

    def test_sides(self):
        rows = self.answer("blur", "--focal-length", "50mm", "--f-number", "2.8", "--focus", "1m", "--at", "2m", "--at",
                           "1m", "--at", "0.5m")
        self.assertGreater(rows[0]["signedBlurUm"], 0)
        self.assertEqual(rows[1]["signedBlurUm"], 0)
        self.assertLess(rows[2]["signedBlurUm"], 0)

    def test_models(self):
        hole = ["--aperture-diameter", "0.5mm", "--sensor-distance", "80mm"]
        rows = self.answer("blur", "--model", "aperture", *hole, "--at", "2m", "--at", "inf")
        self.near(rows[0]["blurUm"], Q(500) * (1 + Q(80, 2000)))
        self.near(rows[1]["blurUm"], Q(500))
        rows = self.answer("blur", "--model", "pinhole", "--sensor-distance", "80mm", "--at", "2m")
        self.assertEqual(rows[0]["blurUm"], 0)
        thin = ["blur", "--focal-length", "50mm", "--f-number", "8", "--focus", "2m", "--at", "2m", "--at", "3m"]
        plain = self.answer(*thin)
        for convention, factor in (("airy", 2.44), ("mtf50", 1.75)):
            rows = self.answer(*thin, "--model", "diffraction", "--wavelength", "550nm", "--diffraction", convention)
            disk = factor * 0.55 * 8 * (2 / 1.95)
            self.assertAlmostEqual(rows[0]["blurUm"], disk, delta=1e-9)
            self.assertAlmostEqual(rows[1]["blurUm"], math.hypot(plain[1]["blurUm"], disk), delta=1e-9)
        by_hole = self.answer("blur", "--focal-length", "50mm", "--aperture-diameter", "6.25mm", "--sensor-distance",
                              "52mm", "--at", "3m")
        by_number = self.answer("blur", "--focal-length", "50mm", "--f-number", "8", "--extension", "2mm", "--at", "3m")
        self.near(by_hole[0]["blurUm"], Q(by_number[0]["blurUm"]))

    def test_refusals(self):
        lens = ["blur", "--focal-length", "50mm", "--f-number", "2.8"]
        self.refused(64, "closest focus", *lens, "--focus", "50mm", "--at", "1m")
        self.refused(64, "closest focus", *lens, "--focus", "20D", "--at", "1m")
        self.refused(64, "bare number", *lens, "--focus", "0.8", "--at", "1m")
        self.refused(64, "bare number", *lens, "--focus", "1m", "--at", "1")
        self.refused(64, "--focus, --extension or --sensor-distance", *lens, "--at", "1m")
        self.refused(64, "past infinity", *lens, "--focus", "1m", "--at", "-1D")
        self.refused(64, "--sensor-distance", "blur", "--model", "aperture", "--aperture-diameter", "1mm", "--at", "1m")
        self.refused(64, "greater than zero", "blur", "--focal-length", "0mm", "--f-number", "2", "--focus", "1m", "--at", "1m")
        for bad in ("nan", "nanmm", "infmm", "-50mm", "1e400m", ""):
            self.refused(64, "--focal-length", "blur", "--focal-length", bad, "--f-number", "2", "--focus", "1m", "--at", "1m")


class Dof(Case):
    def check(self, f, n, focus, limit):
        answer = self.answer("dof", "--focal-length", f, "--f-number", n, "--focus", focus, "--blur-limit", limit)
        self.assertEqual(set(answer), {"nearM", "farM", "nearD", "farD", "hyperfocalM"})
        length, number, u, c = metres(f), Q(n), vergence(focus), metres(limit)
        reach = c * number * (1 - length * u) / length**2
        self.near(answer["nearD"], u + reach)
        self.near(answer["nearM"], 1 / (u + reach))
        self.near(answer["hyperfocalM"], length + length**2 / (number * c))
        if u > reach:
            self.near(answer["farD"], u - reach)
            self.near(answer["farM"], 1 / (u - reach))
        else:
            self.assertEqual((answer["farD"], answer["farM"]), (0, None))

    def test_exact(self):
        self.check("50mm", "2.8", "2m", "8um")
        self.check("50mm", "16", "0.5D", "30um")
        self.check("24mm", "11", "10m", "30um")
        self.check("50mm", "2.8", "inf", "8um")
        self.check("50mm", "4", "50.0000001mm", "1um")
        # Focused at the hyperfocal distance exactly, the far end is infinity exactly: 0.05 + 0.0025/(2 * 1e-5) m.
        self.check("50mm", "2", "125.05m", "10um")

    def test_from_the_sensor(self):
        answer = self.answer("dof", "--from", "sensor", "--focal-length", "50mm", "--f-number", "2.8", "--focus", "0.8m",
                             "--blur-limit", "8um")
        # D = Z_o + Z_s with 1/Z_o + 1/Z_s = 1/f
        focus = 0.4 * (1 + math.sqrt(1 - 0.2 / 0.8))
        self.assertLess(answer["nearM"], focus)
        self.assertGreater(answer["farM"], focus)
        self.assertAlmostEqual((answer["nearD"] + answer["farD"]) / 2, 1 / focus, places=12)
        self.refused(64, "200 mm", "dof", "--from", "sensor", "--focal-length", "50mm", "--f-number", "2.8", "--focus",
                     "199mm", "--blur-limit", "8um")

    def test_refusals(self):
        rest = ["--f-number", "2.8", "--blur-limit", "8um"]
        self.refused(64, "closest focus", "dof", "--focal-length", "50mm", "--focus", "0.05m", *rest)
        self.refused(64, "--pixel", "dof", *DOF[:-1], "1px")
        self.refused(64, "greater than zero", "dof", *DOF[:-1], "0um")
        self.refused(64, "bare number", "dof", *DOF[:-1], "8")


class Conjugate(Case):
    def ask(self, f, point):
        answer = self.answer("conjugate", "--focal-length", f, "--point", point)
        self.assertEqual(set(answer), {"point", "imageMm"})
        return answer["point"], answer["imageMm"]

    def check(self, f, point, homogeneous):
        """Up to scale, and the image in millimetres."""
        length = metres(f)
        x, y, z, w = homogeneous
        exact = [length * x, length * y, length * z, z - length * w]
        given, image = self.ask(f, point)
        largest = max(range(4), key=lambda i: abs(exact[i]))
        for i in range(4):
            self.near(Q(given[i]) / Q(given[largest]), exact[i] / exact[largest])
        if exact[3] == 0:
            self.assertIsNone(image)
        else:
            for i in range(3):
                self.near(image[i], exact[i] / exact[3] * 1000)

    def test_exact(self):
        self.check("50mm", "0.1m,-20mm,2m", (Q("0.1"), Q("-0.02"), Q(2), Q(1)))
        self.check("50mm", "1mm,2mm,50.00000005mm", (Q("0.001"), Q("0.002"), Q("0.05000000005"), Q(1)))
        self.check("50mm", "-1mm,0mm,30mm", (Q("-0.001"), Q(0), Q("0.03"), Q(1)))
        self.check("50mm", "1,2,1e9,1", (Q(1), Q(2), Q(10**9), Q(1)))
        self.check("50mm", "0.3,0.2,1,0", (Q("0.3"), Q("0.2"), Q(1), Q(0)))
        self.check("50mm", "0.3,0.2,0.05,1", (Q("0.3"), Q("0.2"), Q("0.05"), Q(1)))
        self.check("50mm", "-1m,2m,inf", (Q(0), Q(0), Q(1), Q(0)))
        self.assertEqual(self.ask("50mm", "0m,0m,inf")[1], [0, 0, 50])

    def test_virtual_image_is_negative(self):
        self.assertLess(self.ask("50mm", "0mm,1mm,20mm")[1][2], 0)

    def test_self_inverse(self):
        image, _ = self.ask("50mm", "0.25,0.5,2,1")
        back, _ = self.ask("50mm", ",".join(map(repr, image)))
        for i, value in enumerate((0.25, 0.5, 2, 1)):
            self.assertAlmostEqual(back[i] / back[3], value, places=12)

    def test_refusals(self):
        self.refused(64, "0,0,0,0", "conjugate", "--focal-length", "50mm", "--point", "0,0,0,0")
        self.refused(64, "X,Y,Z", "conjugate", "--focal-length", "50mm", "--point", "1m,2m")
        self.refused(64, "bare number", "conjugate", "--focal-length", "50mm", "--point", "1,2,3")
        self.refused(64, "--point", "conjugate", "--focal-length", "50mm", "--point", "1m,inf,inf")


class Plan(Case):
    FIELDS = {"feasible", "fNumber", "apertureDiameterMm", "workingFNumber", "tStop", "subtendedAngleDeg",
              "magnification", "extensionMm", "sensorDistanceMm", "focalPlaneD", "focalPlaneM", "focusFromSensorM",
              "worstRatio", "model", "modelErrorUm", "limits"}
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..8mm"]

    def plan(self, *arguments, lens=None):
        answer = self.answer(*(lens or self.LENS), *arguments)
        self.assertTrue(answer["feasible"])
        self.assertLessEqual(self.FIELDS, set(answer))
        for limit in answer["limits"]:
            self.assertEqual(set(limit), {"name", "nearD", "farD", "limitUm", "worstUm", "atD", "ratio"})
            self.assertLessEqual(limit["ratio"], 1 + 1e-12)
        return answer

    def test_two_ends_of_one_subject(self):
        # Sharp from 2.1 to 2.5 m: focus at the dioptre midpoint, N such that both ends have blur c:
        # N = f² (U_near - U_far) / (c (W_near + W_far)).
        answer = self.plan("--sharp", "2.1m..2.5m:1px", "--pixel", "50.25um")
        f, c, near, far = Q("0.05"), Q("50.25e-6"), 1 / Q("2.1"), 1 / Q("2.5")
        number = f**2 * (near - far) / (c * (2 - f * near - f * far))
        self.near(answer["fNumber"], number)
        e = (f**2 * far + c * number) / (1 - f * far)
        self.near(answer["extensionMm"], e * 1000)
        self.near(answer["sensorDistanceMm"], (e + f) * 1000)
        self.near(answer["focalPlaneD"], e / (f * (f + e)))
        self.near(answer["focalPlaneM"], f + f**2 / e)
        self.near(answer["focusFromSensorM"], f + f**2 / e + f + e)
        self.near(answer["apertureDiameterMm"], f / number * 1000)
        self.near(answer["magnification"], e / f)
        self.near(answer["workingFNumber"], number * (1 + e / f))
        angle = 2 * math.degrees(math.atan(float(f / number / (2 * (e + f)))))
        self.assertAlmostEqual(answer["subtendedAngleDeg"], angle, places=10)
        self.assertEqual([limit["name"] for limit in answer["limits"]], ["sharp[0]"])
        self.near(answer["limits"][0]["limitUm"], Q("50.25"))

    def test_names_sides_and_default_limit(self):
        answer = self.plan("--pixel", "50.25um", "--sharp", "near=2.5m..2.1m", "--blurred", "far=4.3m..inf:4px:behind")
        self.assertEqual([limit["name"] for limit in answer["limits"]], ["near", "far"])
        self.near(answer["limits"][0]["limitUm"], Q("50.25"))
        self.near(answer["limits"][1]["limitUm"], Q("201"))
        self.assertEqual(answer["limits"][1]["farD"], 0)

    def test_exact_tie_on_decimals(self):
        lens = ["plan", "--focal-length", "50mm", "--f-number", "2.5", "--extension", "0mm..8mm", "--focus", "1.05m"]
        # s = f²/N (Z - D)/(Z (D - f)) with N = 2.5, D = 1.05 m, Z = 2.1 m: 0.0025/2.5 * 1.05/(2.1 * 1) m = 500 um exactly.
        self.answer(*lens, "--sharp", "2.1m:500um")
        self.answer(*lens, "--blurred", "2.1m:500um")
        self.assertFalse(self.answer(*lens, "--sharp", "2.1m:499.9999999999999999um", status=1)["feasible"])
        self.assertFalse(self.answer(*lens, "--blurred", "2.1m:500.0000000000000001um", status=1)["feasible"])

    def test_infeasible_is_an_answer(self):
        answer = self.answer(*self.LENS, "--sharp", "face=1m:10um", "--blurred", "1.01m:200um", status=1)
        self.assertEqual(set(answer), {"feasible", "conflict", "relax"})
        self.assertFalse(answer["feasible"])
        self.assertEqual(set(answer["conflict"]) - {"face", "blurred[0]", "fNumber", "extension"}, set())
        self.assertGreater(answer["relax"], 1)
        code, out, err = run(*self.LENS, "--sharp", "face=1m:10um", "--blurred", "1.01m:200um")
        self.assertEqual((code, err), (1, ""))
        self.assertIn("face", out)
        answer = self.answer(*self.LENS, "--focus", "0.2m", status=1)
        self.assertEqual(set(answer["conflict"]), {"focus", "extension"})
        self.assertIsNone(answer["relax"])

    def test_alternatives_say_the_same(self):
        subject = ["--sharp", "2m..2.2m:20um"]
        by_number = self.plan(*subject)
        by_distance = self.plan(*subject, lens=["plan", "--focal-length", "50mm", "--f-number", "16..1.4",
                                                "--sensor-distance", "58mm..50mm"])
        self.assertEqual(by_number, by_distance)
        by_diameter = self.plan(*subject, lens=["plan", "--focal-length", "50mm", "--aperture-diameter", "2mm..25mm",
                                                "--extension", "0mm..8mm"])
        self.assertAlmostEqual(by_number["fNumber"], by_diameter["fNumber"], places=12)
        stops = self.plan(*subject, lens=["plan", "--focal-length", "50mm", "--f-number", "1.4,2,2.8,4,5.6",
                                          "--extension", "0mm..8mm"])
        self.assertEqual(stops["fNumber"], min(n for n in (1.4, 2, 2.8, 4, 5.6) if n >= by_number["fNumber"]))

    def test_focus(self):
        answer = self.plan("--focus", "0.8m")
        self.near(answer["extensionMm"], Q("2.5") / Q("0.75"))
        self.near(answer["focalPlaneM"], Q("0.8"))
        answer = self.plan("--focus", "inf")
        self.assertEqual((answer["focalPlaneD"], answer["focalPlaneM"], answer["focusFromSensorM"]), (0, None, None))

    def test_from_the_sensor(self):
        answer = self.plan("--from", "sensor", "--focus", "0.8m")
        self.assertAlmostEqual(answer["focusFromSensorM"], 0.8, places=12)
        self.assertAlmostEqual(answer["focalPlaneM"], 0.4 * (1 + math.sqrt(0.75)), places=12)
        answer = self.plan("--from", "sensor", "--sharp", "2.1m..2.5m:20um")
        stands = answer["sensorDistanceMm"] / 1000
        self.assertAlmostEqual(answer["limits"][0]["nearD"], 1 / (2.1 - stands), places=12)
        self.assertAlmostEqual(answer["limits"][0]["farD"], 1 / (2.5 - stands), places=12)
        self.assertAlmostEqual(answer["limits"][0]["worstUm"], 20, places=9)

    def test_planes(self):
        tilted = self.plan("--sharp", "plane(0.5,0.02,-0.01):20um")
        interval = self.plan("--sharp", "0.47D..0.53D:20um")
        self.assertEqual(tilted, interval)

    def test_objectives(self):
        light = self.plan("--sharp", "2m..2.2m:40um")
        sharp = self.plan("--sharp", "2m..2.2m:40um", "--objective", "sharp")
        self.assertLess(sharp["worstRatio"], light["worstRatio"])
        depth = self.plan("--focus", "2m", "--objective", "depth", "--blur-limit", "20um")
        self.assertEqual(depth["fNumber"], 16)
        reach = Q("20e-6") * 16 * (1 - Q("0.05") / 2) / Q("0.05")**2
        self.near(depth["depthOfField"]["nearD"], Q("0.5") + reach)
        self.near(depth["depthOfField"]["farD"], Q("0.5") - reach)

    def smallest(self, near, far, c_near, c_far, slack):
        """N where the upper and the lower bound on e meet: both ends of the subject are just sharp."""
        f = Q("0.05")
        w_near, w_far = 1 - f * near, 1 - f * far
        return (f**2 * (near / w_near - far / w_far) + 2 * slack) / (c_near / w_near + c_far / w_far)

    def test_tolerances_tighten(self):
        answer = self.plan("--sharp", "2.1m..2.5m:50um", "--sensor-tolerance", "5um", "--f-number-tolerance", "2%")
        near, far, c = 1 / Q("2.1"), 1 / Q("2.5"), Q("50e-6") * Q("0.98")
        self.near(answer["fNumber"], self.smallest(near, far, c, c, Q("5e-6")))
        self.near(answer["limits"][0]["ratio"], Q(1))

    def test_pupil_factor(self):
        answer = self.plan("--sharp", "0.5m..0.52m:30um", "--pupil-factor", "0.7")
        near, far, f, p = Q(2), 1 / Q("0.52"), Q("0.05"), Q("0.7")
        c_near, c_far = (Q("30e-6") * (1 + f * u * (1 / p - 1)) for u in (near, far))
        self.near(answer["fNumber"], self.smallest(near, far, c_near, c_far, 0))
        m = Q(answer["magnification"])
        self.near(answer["workingFNumber"], Q(answer["fNumber"]) * (1 + m / p))

    def test_diffraction(self):
        for convention, factor in (("airy", 2.44), ("mtf50", 1.75)):
            answer = self.plan("--sharp", "2m..2.2m:20um", "--wavelength", "550nm", "--diffraction", convention)
            n, stands = answer["fNumber"], answer["sensorDistanceMm"] / 1000
            disk = factor * 550e-9 * stands / (0.05 / n)
            blurs = [math.hypot(0.05 / n * (stands * (20 - u) - 1), disk) for u in (1 / 2, 1 / 2.2)]
            self.assertAlmostEqual(max(blurs) / 20e-6, 1, places=10)
            self.assertEqual(answer["model"], "diffraction")
        answer = self.answer(*self.LENS[:3], "--f-number", "22", *self.LENS[5:], "--sharp", "2m:5um", "--wavelength",
                             "550nm", status=1)
        self.assertEqual(set(answer["conflict"]), {"sharp[0]", "fNumber"})

    def test_the_simplest_model_within_the_tolerance(self):
        ask = ["--sharp", "2m..2.2m:20um", "--wavelength", "550nm", "--model-tolerance"]
        errors = {}
        for tolerance in ("0.1um", "30um", "100mm"):
            answer = self.plan(*ask, tolerance)
            self.assertLessEqual(answer["modelErrorUm"], float(metres(tolerance) * 10**6))
            errors[answer["model"]] = answer["modelErrorUm"]
        self.assertEqual(list(errors), ["diffraction", "thin", "pinhole"])
        self.assertEqual(self.plan("--sharp", "2m..2.2m:20um")["model"], "thin")

    def test_zoom(self):
        zoom = ["plan", "--focal-length", "24mm..70mm", "--f-number", "4", "--extension", "0mm..8mm"]
        answer = self.plan("--field", "2.4m@3m", "--sensor-width", "36mm", "--focus", "3m", lens=zoom)
        m = Q("0.036") / Q("2.4")
        self.near(answer["focalLengthMm"], m * 3 / (1 + m) * 1000)
        self.near(answer["fieldWidthM"], Q("2.4"))
        self.refused(64, "--field", *zoom)
        self.refused(64, "24 to 70 mm", *zoom, "--field", "1mm@3m", "--sensor-width", "36mm")
        self.refused(64, "--focal-length A..B", *self.LENS, "--field", "2.4m@3m", "--sensor-width", "36mm")

    def test_refusals(self):
        lens = self.LENS
        nowhere = ["--socket", "/nonexistent/socket"]
        self.refused(69, "/nonexistent/socket", "plan", "--f-number", "2", "--extension", "0mm..8mm", *nowhere)
        self.refused(69, "/nonexistent/socket", *lens, "station3", *nowhere)
        self.refused(69, "/nonexistent/socket", *lens, "--apply", *nowhere)
        self.refused(64, "--f-number is required", "plan", "--focal-length", "50mm", "--extension", "0mm..8mm")
        self.refused(64, "--extension is required", "plan", "--focal-length", "50mm", "--f-number", "2")
        self.refused(64, "bare number", "plan", "--focal-length", "50", "--f-number", "2", "--extension", "0mm..8mm")
        self.refused(64, "closest focus is 362.5 mm", *lens, "--focus", "50mm")
        self.refused(64, "closest focus", *lens, "--focus", "30D")
        self.refused(64, "focal length", *lens, "--sharp", "50mm..1m:10um")
        self.refused(64, "greater than zero", *lens, "--sharp", "1m:0um")
        self.refused(64, "greater than zero", *lens, "--sharp", "1m:-3um")
        self.refused(64, "--pixel", *lens, "--sharp", "1m:1px")
        self.refused(64, "--pixel", *lens, "--sharp", "1m")
        self.refused(64, "not a quantity", *lens, "--sharp", "nan:1um")
        self.refused(64, "--sharp", *lens, "--sharp", "1m:nanum")
        self.refused(64, "--blurred only", *lens, "--sharp", "1m:1um:behind")
        self.refused(64, "--blur-limit", *lens, "--objective", "depth", "--focus", "1m")
        self.refused(64, "light, sharp or depth", *lens, "--objective", "best")
        self.refused(64, "--wavelength", *lens, "--diffraction", "airy")
        self.refused(64, "once", *lens, "--sensor-distance", "50mm..58mm")
        self.refused(64, "once", *lens, "--aperture-diameter", "50mm")
        self.refused(64, "plane(U0,UX,UY)", *lens, "--sharp", "plane(1,2):1um")
        self.refused(64, "@1 to @255", *lens, "--sharp", "@0:1um")
        self.refused(64, "own", *lens, "--sharp", "a=1m:1um", "--sharp", "a=2m:1um")
        self.refused(64, "taken", *lens, "--sharp", "focus=1m:1um")


class Stacks(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..8mm", "--stack"]

    def check(self, near, far, limit_um, tolerance_um, *extra):
        answer = self.answer(*self.LENS, "--sharp", f"{near}..{far}:{limit_um}um", "--sensor-tolerance",
                             f"{tolerance_um}um", *extra)
        self.assertEqual(set(answer), {"feasible", "shots"})
        f, shots = Q("0.05"), answer["shots"]
        for shot in shots:
            self.assertEqual(set(shot), {"fNumber", "extensionMm", "nearD", "farD", "magnification"})
            n, e = Q(shot["fNumber"]), Q(shot["extensionMm"]) / 1000
            self.near(shot["magnification"], e / f)
            # Both ends of what it claims are sharp wherever the sensor stands within its tolerance.
            for u in (Q(shot["nearD"]), Q(shot["farD"])):
                for error in (-1, 1):
                    stands = e + error * Q(tolerance_um) / 10**6
                    blur = abs(f / n * ((f + stands) * (1 / f - u) - 1)) * 10**6
                    self.assertLessEqual(blur, Q(limit_um) * (1 + Q("1e-9")))
        covered = sorted((Q(shot["farD"]), Q(shot["nearD"])) for shot in shots)
        self.near(covered[0][0], vergence(far), absolute=1e-12)
        self.near(covered[-1][1], vergence(near), absolute=1e-12)
        for (_, end), (start, _) in zip(covered, covered[1:]):
            self.assertLessEqual(start, end + Q("1e-12"))
        return shots

    def test_covers_everything_with_the_fewest(self):
        shots = self.check("0.5m", "2m", 20, 0)
        # With N at most 16 each shot covers at most 2 c N W/f² of vergence: fewer shots cannot reach.
        f, c = Q("0.05"), Q("20e-6")
        reach = 2 * c * 16 * (1 - f / 2) / f**2
        self.assertEqual(len(shots), math.ceil((Q(2) - Q("0.5")) / reach))
        self.assertGreater(len(self.check("0.5m", "2m", 20, 60)), len(shots))
        self.assertEqual(len(self.check("1m", "1.001m", 20, 0)), 1)
        self.check("1m", "inf", 30, 1, "--wavelength", "550nm")

    def test_refusals(self):
        answer = self.answer(*self.LENS, "--sharp", "1m..2m:10um", "--sensor-tolerance", "1mm", status=1)
        self.assertEqual((answer["feasible"], answer["shots"]), (False, []))
        self.assertTrue(answer["reason"])
        self.refused(64, "blurred", *self.LENS, "--sharp", "1m:10um", "--blurred", "2m:10um")
        self.refused(64, "focus", *self.LENS, "--sharp", "1m:10um", "--focus", "1m")


class Plots(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..4", "--extension", "0mm..8mm", "--pixel", "50um"]

    def draw(self, status, *limits):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "plan.svg")
            self.answer(*self.LENS, *limits, "--plot", path, status=status)
            texts = [text.text for text in xml.etree.ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")]
            self.assertEqual(os.listdir(folder), ["plan.svg"])
            return texts

    def test_names_limits_and_axes(self):
        texts = self.draw(0, "--sharp", "near=2.1m..2.5m", "--blurred", "far=4.3m..inf:4px:behind")
        for text in ("f-number", "sensor distance from the lens centre [mm]", "blur diameter [px]", "near ≤ 1 px",
                     "near ≤ 1 px (near end)", "near ≤ 1 px (far end)", "far ≥ 4 px (behind)", "in focus", "infinity"):
            self.assertIn(text, texts)
        texts = self.draw(1, "--sharp", "near=2.1m..2.5m", "--sharp", "wall=5m")
        self.assertIn("No setting meets every limit", texts)
        self.assertTrue(any(text.startswith("in conflict: near, wall") for text in texts), texts)
        self.assertIn("depth of field", self.draw(0, "--focus", "2m", "--objective", "depth", "--blur-limit", "1px"))

    def test_a_file_that_cannot_be_written(self):
        self.refused(74, "/nonexistent/plan.svg", *self.LENS, "--sharp", "2m", "--plot", "/nonexistent/plan.svg")


class Extremes(Case):
    """Whatever the sizes, the answer is JSON without NaN or infinity, or one line that says why not."""

    def number(self, rng):
        return f"{rng.choice(['', '', '', '-'])}{rng.uniform(0.1, 10):.3g}e{rng.choice([-320, -150, -12, -3, 0, 0, 0, 1, 6, 100, 308])}"

    def depth(self, rng):
        return rng.choice(["inf", self.number(rng) + "m", self.number(rng) + "D", f"{rng.uniform(0.01, 9):.3g}m"])

    def test_any_size(self):
        rng = random.Random(20)
        answered = 0
        for _ in range(150):
            f = rng.choice(["50mm", "50mm", self.number(rng) + "m"])
            lens = ["--focal-length", f, "--f-number", rng.choice(["2.8", self.number(rng)])]
            command = rng.choice([
                ["blur", *lens, "--focus", self.depth(rng), "--at", self.depth(rng), "--at", self.depth(rng)],
                ["blur", *lens, "--extension", self.number(rng) + "mm", "--at", self.depth(rng)],
                ["dof", *lens, "--focus", self.depth(rng), "--blur-limit", self.number(rng) + "um"],
                ["conjugate", "--focal-length", f, "--point", ",".join(self.number(rng) for _ in range(4))],
                ["plan", *lens, "--extension", "-1mm.." + self.number(rng) + "mm", "--sharp",
                 f"{self.depth(rng)}..{self.depth(rng)}:{self.number(rng)}um"],
                ["plan", *lens, "--extension", "0mm..8mm", "--focus", self.depth(rng), "--blurred",
                 f"{self.depth(rng)}:{self.number(rng)}um"],
            ])
            code, out, err = run(*command, "--json")
            if code in (0, 1):
                json.loads(out, parse_constant=no_constant)
                self.assertEqual((out.count("\n"), err), (1, ""), command)
                answered += 1
            else:
                self.assertEqual((code, out), (64, ""), (command, err))
                self.assertRegex(err, r"^lensctl: [^\n]+\n$")
        self.assertGreater(answered, 15)

    def test_a_full_disk(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            done = subprocess.run([LENSCTL, "dof", *DOF], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(done.returncode, 74)
        self.assertIn("stdout", done.stderr)

    def test_negative_ends(self):
        answer = self.answer("plan", "--focal-length", "50mm", "--f-number", "2", "--extension", "-0.1mm..0.2mm",
                             "--focus", "-0.02D")
        self.near(answer["focalPlaneD"], Q("-0.02"))
        self.assertLess(answer["extensionMm"], 0)
        self.assertEqual((answer["focalPlaneM"], answer["focusFromSensorM"]), (None, None))


def write_png(path, rows, bits=16, colour=0):
    """A PNG of grey rows (or of RGB ones, their samples in a row)."""
    channels = 3 if colour == 2 else 1
    raw = b"".join(b"\0" + struct.pack(">" + ("H" if bits == 16 else "B") * len(row), *row) for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]) // channels, len(rows), bits, colour, 0, 0, 0)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)) +
                  chunk(b"IEND", b""))


class DepthMaps(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..8mm"]

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def png(self, name, rows, bits=16, colour=0):
        path = os.path.join(self.folder, name)
        write_png(path, rows, bits, colour)
        return path

    def test_classes_are_their_depths(self):
        depths = self.png("depths.png", [[0, 2000, 2100], [2300, 900, 9000], [65535, 0, 2500]])
        mask = self.png("mask.png", [[1, 1, 1], [1, 2, 3], [0, 3, 1]], bits=8)
        maps = ["--depth-map", depths, "--mask", mask]
        by_map = self.answer(*self.LENS, *maps, "--sharp", "@1:40um", "--blurred", "@3:40um:behind")
        by_range = self.answer(*self.LENS, "--sharp", "2000mm..2500mm:40um", "--blurred", "9m:40um:behind")
        self.assertEqual(by_map, by_range)
        without_mask = self.png("one.png", [[2000, 0], [2250, 2500]])
        self.assertEqual(self.answer(*self.LENS, "--depth-map", without_mask, "--sharp", "@1:40um"),
                         self.answer(*self.LENS, "--sharp", "2m..2.5m:40um"))

    def test_a_class_on_both_sides_of_the_subject(self):
        around = [1000 + 7 * i for i in range(60)] + [4000 + 50 * i for i in range(60)]
        depths = self.png("depths.png", [[2000, 2010] + around[:58], around[58:118]])
        mask = self.png("mask.png", [[1, 1] + [2] * 58, [2] * 60], bits=8)
        maps = ["--depth-map", depths, "--mask", mask]
        limits = ["--sharp", "@1:20um", "--blurred", "@2:200um"]
        self.assertEqual(self.answer(*self.LENS, "--sharp", "2m..2.01m:20um", "--blurred", "1m..6.85m:200um", status=1)
                         ["feasible"], False)
        answer = self.answer(*self.LENS, *maps, *limits)
        f, n, e = Q("0.05"), Q(answer["fNumber"]), Q(answer["extensionMm"]) / 1000
        for depth in around[:118]:
            blur = abs(f / n * ((f + e) * (1 / f - Q(1000, depth)) - 1))
            self.assertGreaterEqual(blur, Q("200e-6") * (1 - Q("1e-12")))
        for depth in (2000, 2010):
            blur = abs(f / n * ((f + e) * (1 / f - Q(1000, depth)) - 1))
            self.assertLessEqual(blur, Q("20e-6") * (1 + Q("1e-12")))

    def test_refusals(self):
        depths = self.png("depths.png", [[2000, 2100], [0, 0]])
        mask = self.png("mask.png", [[1, 1], [2, 2]], bits=8)
        sharp = ["--sharp", "@1:40um"]
        self.refused(64, "--depth-map", *self.LENS, *sharp)
        self.refused(64, "--depth-map", *self.LENS, "--mask", mask, "--sharp", "2m:40um")
        self.refused(64, "no limit uses it", *self.LENS, "--depth-map", depths, "--sharp", "2m:40um")
        plan = [*self.LENS, "--depth-map", depths, "--mask", mask]
        self.refused(65, "mask.png: class @3", *plan, "--sharp", "@3:40um")
        self.refused(65, "mask.png: class @2", *plan, "--sharp", "@2:40um")
        wide = self.png("wide.png", [[1, 1, 1], [1, 1, 1]], bits=8)
        self.refused(65, "wide.png: the mask is 3x2 px", *self.LENS, "--depth-map", depths, "--mask", wide, *sharp)
        self.refused(65, "mask.png: a depth map must be a grey PNG of 16 bits", *self.LENS, "--depth-map", mask, *sharp)
        self.refused(65, "depths.png: a mask must be a grey PNG of 8 bits", *self.LENS, "--depth-map", depths,
                     "--mask", depths, *sharp)
        colour = self.png("colour.png", [[1, 2, 3, 4, 5, 6]], colour=2)
        self.refused(65, "colour.png", *self.LENS, "--depth-map", colour, *sharp)
        full = self.png("full.png", [[65535, 2000]])
        self.refused(65, "full.png: class @1 holds 65535 mm", *self.LENS, "--depth-map", full, *sharp)
        text = os.path.join(self.folder, "text.png")
        with open(text, "w", encoding="ascii") as out:
            out.write("not a picture")
        self.refused(65, "text.png: not a PNG", *self.LENS, "--depth-map", text, *sharp)
        self.refused(74, "missing.png", *self.LENS, "--depth-map", os.path.join(self.folder, "missing.png"), *sharp)
        near = self.png("near.png", [[40, 2000]])
        self.refused(64, "focal length", *self.LENS, "--depth-map", near, *sharp)


if __name__ == "__main__":
    unittest.main()
