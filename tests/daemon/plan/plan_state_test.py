"""Plans are for the lens as it stands: its zoom, its breathing, its backlash, judged by thin-lens arithmetic alone."""
import json
import math
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, DaemonTest, Daemon  # noqa: E402


def blur_um(status, vergence_d):
    """A thin lens of the Status given: s = A Z_s (U_s - U). The opening is the focal length at extension 0 over N."""
    f, e = status["focalLengthMm"] * 1e-3, status["extensionMm"] * 1e-3
    focal_length_0 = status.get("focalLength0Mm", status["focalLengthMm"]) * 1e-3
    return abs(focal_length_0 / status["fNumber"] * (f + e) * (e / (f * (f + e)) - vergence_d)) * 1e6


class PlanState(DaemonTest):
    """One daemon a class over a scene of its own."""
    scene = {}
    lens = ""
    calibration = None

    @classmethod
    def setUpClass(cls):
        with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as file:
            text = file.read().replace("speed_steps_per_s = 1000", "speed_steps_per_s = 100000")
        head, lens = text.split("[lens]", 1)
        lens, tail = lens.split("[[surface]]", 1)
        lines = [line for line in lens.strip().splitlines() if line.split(" =")[0] not in cls.scene]
        lines += [f"{key} = {value}" for key, value in cls.scene.items()]
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-plan-")
        cls.files = [os.path.join(cls.folder.name, name) for name in ("scene.toml", "calibration.toml")]
        with open(cls.files[0], "w", encoding="utf-8") as file:
            file.write(head + "[lens]\n" + "\n".join(lines) + "\n[[surface]]" + tail)
        optics = ""
        if cls.calibration:
            with open(cls.files[1], "w", encoding="utf-8") as file:
                file.write(cls.calibration)
            f, n, e = (cls.scene[k] for k in ("focal_length_mm", "f_number", "extension_mm"))
            optics = (f'[lens.optics]\nfocal_length_mm = {f}\nf_number = {n}\nextension_mm = {e}\n'
                      f'calibration = "{cls.files[1]}"\n')
        cls.daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{cls.files[0]}"\n'
                                   + optics + cls.lens)

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def run_lensctl(self, *arguments):
        done = self.daemon.lensctl(*arguments, "--json")
        return done.returncode, json.loads(done.stdout or "null"), done.stderr

    def status(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]

    def same_as_status(self, plan):
        now = self.status()
        for key in ("focalLengthMm", "extensionMm", "fNumber"):
            self.assertAlmostEqual(plan[key], now[key], delta=1e-9 * abs(now[key]), msg=key)


class OnAZoom(PlanState):
    scene = {"focal_length_mm": [20.0, 40.0], "f_number": [1.4, 16.0], "extension_mm": [0.0, 2.0], "steps": 4001}

    def setUp(self):
        code, _, errors = self.run_lensctl("zoom", "a", "40mm")
        self.assertEqual(code, 0, errors)

    def test_a_plan_is_for_the_focal_length_the_zoom_stands_at(self):
        code, plan, errors = self.run_lensctl("plan", "a", "--sharp", "0.9m..1.1m:60um", "--apply")
        self.assertIn(code, (0, 1), errors)
        self.assertEqual(code, 0)
        now = self.status()
        self.assertAlmostEqual(now["focalLengthMm"], 40.0)
        worst = max(blur_um(now, 1 / 0.9), blur_um(now, 1 / 1.1))
        self.assertLessEqual(worst, 60.0)
        self.assertGreaterEqual(plan["reached"]["limits"][0]["worstUm"], worst)
        self.same_as_status(plan)
        self.same_as_status(plan["reached"])

    def test_what_no_setting_can_do_here_is_not_called_feasible(self):
        # At 40 mm and f/16 the two ends are 1.6 mm * Z_s * 0.1 D apart: 14 um and more of blur, whatever the focus.
        code, plan, _ = self.run_lensctl("plan", "a", "--sharp", "0.9m..1.1m:8um", "--apply")
        self.assertEqual(code, 1)
        self.assertFalse(plan["feasible"])

    def test_a_stack_is_for_the_focal_length_the_zoom_stands_at(self):
        with self.daemon.client() as client:
            plan = client.call(LENS + "Plan", {"request": {"stack": True, "limits": [
                {"kind": "sharp", "limitUm": 30, "depths": [
                    {"oneEnd": {"distanceM": 0.9}, "otherEnd": {"distanceM": 1.6}}]}]}})["parameters"]["plan"]
        self.assertTrue(plan["feasible"])
        self.assertEqual(plan["shots"][0]["focalLengthMm"], 40.0)
        for depth in [0.9 + 0.001 * i for i in range(701)]:
            best = min(blur_um(shot, 1 / depth) for shot in plan["shots"])
            self.assertLessEqual(best, 30.0, depth)


class IrisBacklash(PlanState):
    scene = {"focal_length_mm": 25.0, "f_number": [1.4, 16.0], "extension_mm": [0.0, 1.6], "steps": 4001,
             "iris_steps": 100, "iris_backlash_steps": 9}

    def test_reached_counts_what_the_iris_may_be_off_by(self):
        code, _, errors = self.run_lensctl("aperture", "a", "8")
        self.assertEqual(code, 0, errors)
        code, plan, _ = self.run_lensctl("plan", "a", "--sharp", "2m:100um", "--blurred", "0.9m:300um:front", "--apply")
        if "reached" not in plan:
            self.assertEqual(code, 1)
            return
        # The iris came from the other side and stands 9 of its steps farther closed than it counts.
        iris = next(a for a in self.status()["axes"] if a["axis"] == "iris")
        smallest = 1.4 * (16 / 1.4) ** ((iris["position"] + iris["positionBound"]) / 99)
        truth = blur_um({**self.status(), "fNumber": smallest}, 1 / 0.9)
        self.assertLessEqual(plan["reached"]["limits"][1]["worstUm"], truth * (1 + 1e-9))
        self.assertEqual(plan["reached"]["feasible"], truth >= 300.0)


class FarApproach(PlanState):
    scene = {"focal_length_mm": 50.0, "f_number": [2.0, 16.0], "extension_mm": [0.0, 3.0], "steps": 3001,
             "backlash_steps": 20}
    lens = '[lens.focus]\napproach = "far"\nbacklash = 20\n'

    def test_positions_whose_backlash_stays_are_planned_with_it(self):
        # 0.88 m focuses at 3.012 mm. From 2980 on nothing is left to turn back on; there the mechanism, which lags 20
        # steps behind the counts after coming down from 3000, stands at 3.000 mm.
        code, plan, errors = self.run_lensctl("plan", "a", "--sharp", "0.88m:6um", "--apply")
        self.assertEqual(code, 0, errors)
        focus = next(a for a in self.status()["axes"] if a["axis"] == "focus")
        self.assertLessEqual(focus["position"], 2980)
        self.assertAlmostEqual(plan["extensionMm"], (focus["position"] + 20) * 1e-3, delta=1e-9)
        self.assertTrue(plan["reached"]["feasible"])


class Breathing(PlanState):
    scene = {"focal_length_mm": 50.0, "f_number": [2.0, 16.0], "extension_mm": [0.0, 4.0], "steps": 4001,
             "breathing": 0.064}
    calibration = """version = 1
serial = ""
made = "by hand"
[[focus]]
approach = "near"
error_um = 0.0
points = [{ steps = 0, extension_mm = 0.0 }, { steps = 4000, extension_mm = 4.0 }]
[breathing]
points = [{ extension_mm = 0.0, ratio = 1.0 }, { extension_mm = 4.0, ratio = 1.064 }]
"""

    def test_a_plans_figures_are_those_of_the_status(self):
        code, plan, errors = self.run_lensctl("plan", "a", "--focus", "0.8m", "--sharp", "0.8m:20um", "--apply")
        self.assertEqual(code, 0, errors)
        self.same_as_status(plan)
        self.assertGreater(plan["focalLengthMm"], 52.0)
        now = self.status()
        # The focal plane within half a step of where it should be, by the thin lens.
        f, e = now["focalLengthMm"] * 1e-3, now["extensionMm"] * 1e-3
        self.assertAlmostEqual(e / (f * (f + e)), 1 / 0.8, delta=0.0005)
        self.assertAlmostEqual(plan["apertureDiameterMm"], 50.0 / now["fNumber"], places=9)
        self.assertTrue(math.isclose(plan["limits"][0]["limitUm"], 20.0))


if __name__ == "__main__":
    unittest.main(verbosity=2)
