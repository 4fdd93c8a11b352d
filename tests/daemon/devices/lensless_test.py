#!/usr/bin/env python3
"""A simulated camera without a lens (pinhole, bare aperture): its sensor moves, but nothing says it is focused, plans for
it or reports f-numbers."""
import json
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import Daemon  # noqa: E402

SCENE = """version = 1
[camera]
width = 160
height = 120
[lens]
model = "%s"
focal_length_mm = 25.0
f_number = [60.0, 500.0]
extension_mm = [0.0, 25.0]
steps = 4096
initial_f_number = 250.0
[[surface]]
kind = "wall"
distance_m = 1.0
sinusoid_px = [8.0, 0.0]
"""


class Lensless(unittest.TestCase):
    def start(self, model):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        scene = os.path.join(folder.name, "scene.toml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(SCENE % model)
        daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n')
        self.addCleanup(daemon.stop)
        return daemon

    def test_nothing_is_focused_or_planned(self):
        for model in ("pinhole", "aperture"):
            daemon = self.start(model)
            moved = daemon.lensctl("focus", "a", "@2000", "--json")
            self.assertEqual(moved.returncode, 0, moved.stderr)
            self.assertIsNone(json.loads(moved.stdout)["vergenceD"])
            self.assertNotIn("focused", daemon.lensctl("focus", "a", "@2100").stdout)
            status = daemon.lensctl("status", "a")
            self.assertNotIn("focused", status.stdout)
            self.assertNotIn("f/", status.stdout)
            for wish in (["focus", "a", "1m"], ["plan", "a", "--sharp", "1m:20um"], ["plan", "a", "--focus", "1m"],
                         ["aperture", "a", "100"], ["calibrate", "a", "--point", "0=inf", "--point", "4000=1m"]):
                refused = daemon.lensctl(*wish, "--json")
                self.assertEqual((refused.returncode, json.loads(refused.stdout)["error"]), (8, "unsupported"),
                                 (model, wish, refused.stderr))
            ran = daemon.lensctl("autofocus", "a", "--json")
            if ran.returncode == 1:
                self.assertFalse(json.loads(ran.stdout)["focused"], ran.stdout)
            else:
                self.assertEqual(ran.returncode, 8, (ran.stdout, ran.stderr))


if __name__ == "__main__":
    unittest.main()
