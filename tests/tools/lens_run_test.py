#!/usr/bin/env python3
"""lens-run as a person runs it, on the simulated driver: what it prints and how it ends."""
import os
import subprocess
import sys
import tempfile
import unittest

LENS_RUN, SOURCE = sys.argv.pop(), sys.argv.pop()
SCENE = "scene=" + os.path.join(SOURCE, "scenes", "brick.toml")


class LensRun(unittest.TestCase):
    def run_it(self, *arguments):
        ended = subprocess.run([LENS_RUN, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               timeout=60, check=False)
        return ended.returncode, ended.stdout, ended.stderr

    def refuses(self, status, part, *arguments):
        code, out, err = self.run_it(*arguments)
        self.assertEqual((code, out), (status, ""), err)
        self.assertIn(part, err)
        self.assertEqual(err.count("\n"), 1, err)

    def test_lists_drivers(self):
        code, out, _ = self.run_it()
        self.assertEqual(code, 0)
        self.assertIn("sim", out.splitlines())

    def test_lists_moves_reads_and_grabs(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, "picture.png")
            code, out, err = self.run_it("sim", SCENE, "list", "move", "focus", "400", "read", "grab", picture)
            self.assertEqual((code, err), (0, ""))
            self.assertIn("focus  0..4095 steps", out)
            self.assertEqual(out.count("focus 400 "), 2, out)
            with open(picture, "rb") as file:
                self.assertEqual(file.read(4), b"\x89PNG")

    def test_refuses(self):
        self.refuses(64, "it has sim", "nix")
        self.refuses(64, "no command", "sim", SCENE, "jump")
        self.refuses(64, "move AXIS TARGET", "sim", SCENE, "move", "focus")
        self.refuses(64, "outside 0..4095", "sim", SCENE, "move", "focus", "-3")
        self.refuses(64, "no axis", "sim", SCENE, "home", "tripod")
        self.refuses(78, 'unknown key "colour"', "sim", SCENE, "colour=red")
        self.refuses(75, "--timeout", "--timeout=0.02", "sim", SCENE, "move", "focus", "4000")
        self.refuses(74, "nowhere.toml", "sim", "scene=/nowhere.toml")


if __name__ == "__main__":
    unittest.main()
