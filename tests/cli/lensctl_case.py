"""What the tests of lensctl share: how it is run, and exact units."""
import json
import subprocess
import sys
import unittest
from fractions import Fraction as Q

LENSCTL = sys.argv.pop(1)

UNITS = {"nm": Q(1, 10**9), "um": Q(1, 10**6), "mm": Q(1, 1000), "cm": Q(1, 100), "m": Q(1), "km": Q(1000),
         "in": Q(254, 10000), "ft": Q(3048, 10000)}


DOF = ["--focal-length", "50mm", "--f-number", "2.8", "--focus", "2m", "--blur-limit", "8um"]
CODES = {64: "usage", 65: "bad-data", 66: "no-input", 69: "unavailable", 73: "cannot-write"}


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
        """stderr is one line for people; stdout stays empty, or holds one line for programs with --json."""
        for extra in ((), ("--json",)):
            code, out, err = run(*arguments, *extra)
            self.assertEqual(code, status, (arguments, err))
            self.assertTrue(err.startswith("lensctl: ") and err.endswith("\n") and err.count("\n") == 1, err)
            self.assertIn(says, err)
            if extra:
                self.check_error(status, out, err)
            else:
                self.assertEqual(out, "", arguments)

    def check_error(self, status, out, err):
        self.assertTrue(out.endswith("\n") and out.count("\n") == 1, out)
        told = json.loads(out, parse_constant=no_constant)
        self.assertEqual((told["error"], "lensctl: " + told["message"] + "\n"), (CODES[status], err))

    def near(self, value, exact, relative=1e-12, absolute=0.0):
        error = abs(Q(value) - exact)
        self.assertLessEqual(error, max(abs(exact) * Q(relative), Q(absolute)), (value, float(exact)))
