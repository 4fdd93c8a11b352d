"""Plans on the positions of a lens: what only its steps rule out, and what they cost."""
import json
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, DaemonTest, Daemon  # noqa: E402

STEP_MM = 0.2
F_MM = 25.0


class CoarseSteps(DaemonTest):
    """A lens of nine focus positions: 0, 0.2, ... 1.6 mm."""

    @classmethod
    def setUpClass(cls):
        with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as file:
            scene = file.read().replace("steps = 4001", "steps = 9", 1)
        cls.scene = os.path.join(HERE, f"coarse-{os.getpid()}.toml")
        with open(cls.scene, "w", encoding="utf-8") as file:
            file.write(scene)
        try:
            cls.daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{cls.scene}"\n')
        finally:
            os.unlink(cls.scene)

    def subject(self, extension_mm, limit_um):
        distance_mm = F_MM + F_MM**2 / extension_mm
        depth = {"distanceM": distance_mm / 1000}
        return {"stops": [2.0], "limits": [
            {"name": "it", "kind": "sharp", "limitUm": limit_um, "depths": [{"oneEnd": depth, "otherEnd": depth}]}]}

    def plan(self, request):
        with self.daemon.client() as client:
            return client.call(LENS + "Plan", {"request": request})["parameters"]

    def test_what_only_the_steps_rule_out_names_the_nearest(self):
        # Halfway between two positions. The limit leaves 0.12 mm on either side at f/2 and the motor half a step of
        # doubt, so 0.3 mm would do and neither 0.2 nor 0.4 mm does.
        reply = self.plan(self.subject(0.3, 60))
        self.assertFalse(reply["plan"]["feasible"])
        self.assertEqual(reply["plan"]["conflict"], ["positions"])
        nearest = reply["nearest"]
        self.assertFalse(nearest["feasible"])
        self.assertIn(round(nearest["extensionMm"], 9), (0.2, 0.4))
        # By hand: at W = 1 - f U the blur half a step beyond is W (0.1 + 0.1 mm)/N over the limit.
        w = F_MM / (F_MM + 0.3)
        self.assertAlmostEqual(nearest["worstRatio"], w * STEP_MM / nearest["fNumber"] / 0.060, delta=0.03)
        self.assertEqual(reply["plan"]["relax"], nearest["worstRatio"])
        self.assertEqual(reply["plan"]["relaxed"], {key: nearest[key] for key in ("fNumber", "extensionMm", "focalPlaneD")})
        done = self.daemon.lensctl("plan", "a", "--f-number", "2", "--sharp", "it=2.108333m:60um", "--json")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(json.loads(done.stdout)["conflict"], ["positions"])

    def test_what_the_lens_has_not_is_refused_with_what_it_has(self):
        with self.daemon.client() as client:
            own = client.call(LENS + "Plan", {"request": {}, "showRequest": True})["parameters"]["request"]
            low, high, end = own["apertureMin"], own["apertureMax"], own["extensionMaxMm"]
            f_mm = own["focalLengthMm"]
            for wish, parameter, least, most in (
                    ({"apertureMin": 1.5 * high, "apertureMax": 2 * high}, "apertureMin", low, high),
                    ({"apertureMin": low / 9, "apertureMax": low / 2}, "apertureMax", low, high),
                    ({"stops": [2.0, low / 2]}, "stops[1]", low, high),
                    ({"stops": [2 * high]}, "stops[0]", low, high),
                    ({"aperturesAreDiameters": True, "stops": [2 * f_mm]}, "stops[0]", f_mm / high, f_mm / low),
                    ({"aperturesAreDiameters": True, "apertureMin": 2 * f_mm, "apertureMax": 3 * f_mm}, "apertureMin",
                     f_mm / high, f_mm / low),
                    ({"extensionMinMm": 3 * end, "extensionMaxMm": 4 * end}, "extensionMinMm", 0, end),
                    ({"extensionMinMm": -3, "extensionMaxMm": -2}, "extensionMaxMm", 0, end)):
                told = client.call(LENS + "Plan", {"request": wish})
                self.assertEqual(told.get("error"), LENS + "OutOfRange", (wish, told))
                told = told["parameters"]
                self.assertEqual(told["parameter"], "request." + parameter, told)
                self.assertAlmostEqual(told["minimum"], least, delta=0.01 * most, msg=told)
                self.assertAlmostEqual(told["maximum"], most, delta=0.01 * most, msg=told)
            # Marked stops are rounded, and ends may lie beyond the lens' own.
            for wish in ({"stops": [low * 1.01]}, {"apertureMin": low / 3}, {"extensionMaxMm": 3 * end},
                         {"apertureMin": low, "apertureMax": 3 * high}):
                self.assertTrue(client.call(LENS + "Plan", {"request": wish})["parameters"]["plan"]["feasible"], wish)

    def test_diameters_left_out_are_those_of_the_lens(self):
        with self.daemon.client() as client:
            def request(wish):
                reply = client.call(LENS + "Plan", {"request": wish, "showRequest": True})
                self.assertNotIn("error", reply)
                return reply["parameters"]["request"]
            own, told = request({}), request({"aperturesAreDiameters": True})
            self.assertAlmostEqual(told["apertureMin"], own["focalLengthMm"] / own["apertureMax"], 9)
            self.assertAlmostEqual(told["apertureMax"], own["focalLengthMm"] / own["apertureMin"], 9)
            self.assertAlmostEqual(request({"aperturesAreDiameters": True, "apertureMax": 6})["apertureMax"], 6, 9)

    def test_a_subject_on_a_position_is_met_there(self):
        plan = self.plan(self.subject(0.4, 60))["plan"]
        self.assertTrue(plan["feasible"])
        self.assertAlmostEqual(plan["extensionMm"], 0.4, places=9)
        self.assertLessEqual(plan["worstRatio"], 1)

    def test_a_vergence_stays_beside_a_distance_from_the_sensor(self):
        # At 0.4 mm, away from the middle of the range, the plane in focus is at 0.63 D, and what is 1.6 m from the sensor
        # at 0.635 D.
        for ends in ("1.6m..0.6D", "0.6D..1.6m"):
            with self.subTest(ends=ends):
                def ask(*limit):
                    done = self.daemon.lensctl("plan", "a", "--from", "sensor", "--f-number", "2", "--extension", "0.35mm..0.45mm",
                                               *limit, "--json")
                    return json.loads(done.stdout)
                plan = ask("--sharp", f"it={ends}:200um")
                self.assertAlmostEqual(plan["extensionMm"], 0.4, places=9)
                told = plan["limits"][0]
                self.assertAlmostEqual(told["farD"], 0.6, places=12)
                self.assertAlmostEqual(told["nearD"], 1 / (1.6 - plan["sensorDistanceMm"] / 1000), places=12)
                self.assertFalse(ask("--blurred", f"it={ends}:0.001um")["feasible"])  # the plane in focus is among them

    def test_a_limit_finer_than_the_motor_keeps_is_the_limits_own_conflict(self):
        reply = self.plan(self.subject(0.4, 40))  # 0.08 mm at f/2, less than half a step
        self.assertFalse(reply["plan"]["feasible"])
        self.assertIn("it", reply["plan"]["conflict"])
        self.assertNotIn("nearest", reply)


if __name__ == "__main__":
    unittest.main(verbosity=2)
