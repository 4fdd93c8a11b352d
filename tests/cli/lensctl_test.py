#!/usr/bin/env python3
"""Runs lensctl as people and scripts do: exit status, what goes to stdout and stderr, the fields of the JSON, and the
figures against exact rational arithmetic on the decimals written on the command line."""
import json
import math
import random
import re
import unittest
from fractions import Fraction as Q

from lensctl_case import DOF, Case, metres, run, vergence


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

    def test_a_rig_is_a_daemon_by_its_name(self):
        self.refused(64, "both say which daemon", "--rig", "left", "--socket", "/tmp/s", "list")
        for name in ("a/b", "..", "left.toml"):
            self.refused(64, "a name has letters, digits, - and _", "--rig", name, "list")
        self.refused(69, "/run/lensd/no-such-rig/io.lensd.Lens", "--rig", "no-such-rig", "list")

    def test_errors_before_a_command_is_known_are_json_too(self):
        self.refused(64, "say m, mm, ft, in or D", "--units", "yd", "dof", *DOF)
        self.refused(64, "--model is empty", "blur", "--model", "", "--focal-length", "50mm", "--f-number", "2", "--focus", "1m", "--at", "2m")
        self.refused(64, "--pixel describes the pictures of --frames-from", "autofocus", "a", "--pixel", "3um")
        for signed in ("+2m", "+100mm"):
            self.refused(64, "a distance has no sign", "focus", "a", signed)
        self.refused(64, "a focal length has no sign", "zoom", "a", "+100mm")
        for command in ("focus", "aperture", "zoom"):
            self.refused(64, "the position is missing, as in @1200", command, "a", "@")
        code, out, err = run("--json", "bogus")
        self.assertEqual(code, 64)
        self.check_error(64, out, err)

    def test_global_options_before_and_after(self):
        before = run("--json", "--from", "sensor", "dof", *DOF)
        after = run("dof", *DOF, "--json", "--from", "sensor")
        self.assertEqual(before, after)
        self.assertEqual(before[0], 0)
        self.assertNotEqual(json.loads(before[1]), self.answer("dof", *DOF))


class Text(Case):
    """What people read: the unit they typed, at most six digits, no exponents, no noise."""
    LENS = ["--focal-length", "50mm", "--f-number", "2.8"]

    def text(self, *arguments):
        code, out, err = run(*arguments)
        self.assertEqual((code, err), (0, ""), arguments)
        return out

    def test_distances_come_back_in_the_unit_of_the_first_one_typed(self):
        ask = ["blur", *self.LENS, "--focus"]
        self.assertIn("10 ft (0.32", self.text(*ask, "5ft7in", "--at", "3.048m"))
        self.assertIn("120 in (0.32", self.text(*ask, "33in", "--at", "3.048m"))
        self.assertIn("3048 mm (0.32", self.text(*ask, "900mm", "--at", "3.048m"))
        self.assertIn("3.048 m (0.32", self.text(*ask, "inf", "--at", "3.048m"))
        self.assertIn("0.3281 D (3.048 m)", self.text(*ask, "0.5D", "--at", "3.048m"))
        self.assertIn("10 ft (0.32", self.text("--units", "ft", *ask, "2m", "--at", "3.048m"))
        self.assertIn("6.562 ft", self.text("plan", *self.LENS, "--extension", "0mm..8mm", "--sharp",
                                            "wall=inf..6.5617ft:500um", "--units=ft"))
        self.assertIn(" in (", self.text("dof", *self.LENS, "--focus", "33in", "--blur-limit", "8um"))

    def test_f_numbers_as_people_write_them(self):
        texts = {self.text("dof", "--focal-length", "50mm", "--f-number", n, "--focus", "2m", "--blur-limit", "8um")
                 for n in ("2.8", "f/2.8", "f2.8", "F2.8", "F/2.8", "2.80")}
        self.assertEqual(len(texts), 1)

    def test_digits_over_every_size(self):
        rng = random.Random(7)
        number = lambda low, high: f"{10 ** rng.uniform(low, high):.{rng.randint(1, 12)}g}"
        told = 0
        for _ in range(120):
            lens = ["--focal-length", number(0, 3) + "mm", "--f-number", number(-0.3, 2)]
            depth = lambda: rng.choice(["inf", number(-2, 9) + "m", number(-9, 1) + "D", number(0, 6) + "ft"])
            command = rng.choice([
                ["blur", *lens, "--focus", depth(), "--at", depth(), "--at", depth()],
                ["dof", *lens, "--focus", depth(), "--blur-limit", number(-1, 3) + "um"],
                ["light", *lens, "--focus", depth()],
                ["project", *lens, "--focus", depth(), "--point", f"{number(-3, 2)}m,{number(-3, 2)}m,{number(-2, 9)}m"],
                ["plan", *lens, "--extension", "0mm..80mm", "--sharp", f"{depth()}:{number(-1, 3)}um"]])
            code, out, err = run(*command, "--units", rng.choice(["m", "mm", "ft", "in", "D"]))
            if code not in (0, 1):
                self.assertEqual(code, 64, (command, err))
                out = err
            told += code == 0
            self.assertNotRegex(out, r"\d[eE][+-]?\d", command)
            for written in re.findall(r"\d+\.\d+", out if code in (0, 1) else ""):
                self.assertLessEqual(len(written.lstrip("0.").replace(".", "")), 6, (command, out))
        self.assertGreater(told, 40)


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

    def test_at_the_hyperfocal_distance(self):
        # Half of it to infinity, by any lens: the truth of the textbook, which computes no depth of field.
        draw = random.Random(9)
        for _ in range(20):
            f, n, c = f"{draw.randint(4, 400)}mm", f"{draw.randint(10, 320) / 10}", f"{draw.randint(1, 60)}um"
            lens = ("dof", "--focal-length", f, "--f-number", n, "--blur-limit", c)
            answer = self.answer(*lens, "--focus", "hyperfocal")
            hyperfocal = metres(f) + metres(f)**2 / (Q(n) * metres(c))
            self.near(answer["hyperfocalM"], hyperfocal)
            self.near(answer["nearM"], hyperfocal / 2)
            self.assertEqual((answer["farD"], answer["farM"]), (0, None), lens)
        code, out, err = run(*lens, "--focus", "hyperfocal", "--wavelength", "550nm")
        self.assertIn(code, (0, 1), err)

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


if __name__ == "__main__":
    unittest.main()
