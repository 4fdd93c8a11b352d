#!/usr/bin/env python3
"""Plans as lensctl makes them without a daemon, against exact rational arithmetic."""
import math
import re
import unittest
from fractions import Fraction as Q

from lensctl_case import Case, metres, run


class Plan(Case):
    FIELDS = {"feasible", "fNumber", "apertureDiameterMm", "workingFNumber", "tStop", "subtendedAngleDeg",
              "lightParaxial", "lightExact", "magnification", "extensionMm", "sensorDistanceMm", "focalPlaneD", "focalPlaneM", "focusFromSensorM",
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
        self.assertEqual(set(answer), {"feasible", "conflict", "causes", "relax", "relaxed"})
        self.assertEqual(set(answer["relaxed"]), {"fNumber", "extensionMm", "focalPlaneD"})
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

    def test_a_conflict_from_the_sensor_is_infeasible_by_itself(self):
        # The blurred limit forces another extension, where the sharp one's distances are other depths.
        lens = ["plan", "--focal-length", "157.5687mm", "--f-number", "3.661064..9.794077", "--extension", "-1.479184mm..151.7136mm",
                "--from", "sensor", "--objective", "sharp", "--f-number-tolerance", "2.39239%"]
        sharp = ["--sharp", "a=0.6412662m..2.758601D:9.681198um"]
        blurred = ["--blurred", "b=0.6415358m..25.26408in:8.424322um:front"]
        self.plan(*sharp, lens=lens)
        self.plan(*blurred, lens=lens)
        answer = self.answer(*lens, *sharp, *blurred, status=1)
        self.assertLessEqual({"a", "b"}, set(answer["conflict"]))

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
        answer = self.plan("--sharp", "2m..2.2m:20um")
        self.assertEqual((answer["model"], answer["modelErrorUm"]), ("thin", 0.0))

    def test_diffraction_that_no_limit_counts_is_named(self):
        lens = [*self.LENS[:3], "--f-number", "16", *self.LENS[5:]]
        answer = self.plan("--sharp", "2m:20um", lens=lens)
        self.assertEqual(answer["modelErrorUm"], 0.0)
        self.near(answer["diffractionUm"], Q("2.44") * Q("0.55") * Q(answer["workingFNumber"]))
        self.assertNotIn("diffractionUm", self.plan("--sharp", "2m:30um", "--wavelength", "550nm", lens=lens))

    def test_f_number_tolerance_is_one_promise_for_plan_and_stack(self):
        """Every f-number within the tolerance meets the limit, geometric blur and diffraction together."""
        ask = ["--focal-length", "25mm", "--f-number", "1.4..22", "--extension", "0mm..8mm", "--f-number-tolerance", "5%",
               "--wavelength", "550nm", "--sharp", "1.2517D..1.1153D:11.33um"]
        answer = self.answer("plan", *ask)
        self.assertTrue(answer["feasible"])
        stack = self.answer("plan", *ask, "--stack")
        self.assertEqual(len(stack["shots"]), 1)
        self.assertAlmostEqual(stack["shots"][0]["fNumber"], answer["fNumber"], places=9)
        f, e, worst = 0.025, answer["extensionMm"] / 1000, 0
        for percent in range(-5, 6):
            n = answer["fNumber"] * (1 + percent / 100)
            for u in (1.2517, 1.1153):
                disk = 2.44 * 550e-9 * n * (1 + e / f)
                worst = max(worst, math.hypot((e - f * (f + e) * u) / n, disk) / 11.33e-6)
        self.assertAlmostEqual(worst, answer["worstRatio"], places=8)
        self.assertLessEqual(worst, 1 + 1e-9)

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
        self.refused(69, "/nonexistent/socket", *lens, "--sharp", "1m:8um", "--apply", *nowhere)
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


class Words(Case):
    LENS = ["plan", "--focal-length", "50mm", "--f-number", "1.4..16", "--extension", "0mm..3mm", "--pixel", "5um"]

    def rows(self, *arguments):
        """The table of limits: its heads, and its rows by name."""
        code, out, err = run(*self.LENS, *arguments)
        self.assertEqual((code, err), (0, ""))
        lines = [re.split(r"  +", line.strip()) for line in out.splitlines()]
        begin = next(i for i, line in enumerate(lines) if line[0] == "limit")
        return lines[begin], {line[0]: line for line in lines[begin + 1:] if len(line) == 7}, out

    def test_limits_are_answered_in_the_unit_they_were_asked_in(self):
        heads, rows, _ = self.rows("--sharp", "part=2m..2.2m:1.5px", "--blurred", "wall=4m..inf:3px")
        self.assertEqual(heads[3:5], ["limit [px]", "worst [px]"])
        told = self.answer(*self.LENS, "--sharp", "part=2m..2.2m:1.5px", "--blurred", "wall=4m..inf:3px")["limits"]
        for limit in told:
            self.assertAlmostEqual(float(rows[limit["name"]][3]) * 5, limit["limitUm"], delta=1e-3 * limit["limitUm"])
            self.assertAlmostEqual(float(rows[limit["name"]][4]) * 5, limit["worstUm"], delta=1e-3 * limit["worstUm"])
        heads, rows, _ = self.rows("--sharp", "part=2m..2.2m:7.5um")
        self.assertEqual((heads[3], rows["part"][3]), ("limit [um]", "7.5"))
        heads, rows, _ = self.rows("--sharp", "part=2m..2.2m:7.5um", "--blurred", "wall=4m..inf")
        self.assertEqual((heads[3], rows["part"][3], rows["wall"][3]), ("limit", "7.5 um", "1 px"))

    def test_answers_keep_the_unit_and_say_where_they_start(self):
        _, _, out = self.rows("--sharp", "6ft..7ft:1.5px", "--focus", "6.5ft", "--from", "sensor")
        self.assertNotRegex(out.split("limit")[0].split("focal plane")[1].splitlines()[0], r"\d m\b")
        self.assertIn("6.5 ft from the sensor", out)
        self.assertIn("distances are from the lens centre", out)
        for command in (["dof", "--f-number", "2.8", "--focus", "2m", "--blur-limit", "20um"],
                        ["blur", "--f-number", "2.8", "--focus", "2m", "--at", "3m"]):
            with self.subTest(command=command):
                code, out, _ = run(*command, "--focal-length", "50mm", "--from", "sensor")
                self.assertEqual(code, 0)
                self.assertTrue(out.endswith("distances are from the lens centre\n"), out)
                self.assertNotIn("lens centre", run(*command, "--focal-length", "50mm")[1])
        _, out, _ = run("plan", "--focal-length", "50mm", "--f-number", "8", "--extension", "0mm..3mm", "--pixel", "5um", "--sharp",
                        "1m..8m:2px", "--stack")
        self.assertIn("1 m (1 D)", out)
        self.assertNotIn("1000 mm", out)

if __name__ == "__main__":
    unittest.main()
