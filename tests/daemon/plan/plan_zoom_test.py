"""A plan's choice of the focal length, and a lens centre that moves as the lens zooms: judged by trying every place of the
zoom, and by thin-lens arithmetic alone."""
import json
import math
import os
import random
import select
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, PATIENCE, DaemonTest, Daemon  # noqa: E402

BRICK = os.path.join(os.path.dirname(os.path.dirname(HERE)), "scenes", "textures", "brick.png")
PLACES = 1000  # of a simulated zoom, beside its first
EVERY = 10 if PATIENCE > 4 else 1  # sanitizers try every tenth of them
RANDOM = random.Random(20)


def scene_text(lens, distance_m=0.9):
    keys = {"f_number": [1.4, 16.0], "steps": 301, "iris_steps": 1001, "speed_steps_per_s": 1e6,
            "acceleration_steps_per_s2": 1e9, "settle_ms": 1, **lens}
    return ("version = 1\n[camera]\nwidth = 320\nheight = 320\n[lens]\n"
            + "".join(f"{key} = {value}\n" for key, value in keys.items())
            + f'[[surface]]\nkind = "wall"\ndistance_m = {distance_m}\ntexture = "{BRICK}"\n'
            "[truth]\nregion = [0.3, 0.3, 0.4, 0.4]\n")


def calibration_text(ratio):
    """Breathing to `ratio` at 2 mm; otherwise the nominal figures."""
    return f"""version = 1
serial = ""
made = "by hand"
[[focus]]
approach = "near"
error_um = 0.0
points = [{{ steps = 0, extension_mm = 0.0 }}, {{ steps = 300, extension_mm = 2.0 }}]
[breathing]
points = [{{ extension_mm = 0.0, ratio = 1.0 }}, {{ extension_mm = 2.0, ratio = {ratio} }}]
"""


def limit(kind, near, far, um, side=None):
    ends = {"oneEnd": {"distanceM": near}, "otherEnd": {"distanceM": far}}
    return {"kind": kind, "limitUm": um, "depths": [ends], **({"side": side} if side else {})}


class ZoomTest(DaemonTest):
    scene = {"focal_length_mm": [20.0, 40.0], "extension_mm": [0.0, 2.0]}
    calibration = None
    lens = ""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-zoom-")
        place = os.path.join(cls.folder.name, "scene.toml")
        with open(place, "w", encoding="utf-8") as file:
            file.write(scene_text(cls.scene))
        config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{place}"\n{cls.lens}'
        if cls.calibration:
            file_of = os.path.join(cls.folder.name, "a.toml")
            with open(file_of, "w", encoding="utf-8") as file:
                file.write(cls.calibration)
            config += (f'[lens.optics]\nfocal_length_mm = [20.0, 40.0]\nf_number = [1.4, 16.0]\n'
                       f'extension_mm = [0.0, 2.0]\ncalibration = "{file_of}"\n')
        cls.daemon = Daemon(config=config)

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def plan(self, client, request, **more):
        reply = client.call(LENS + "Plan", {"lens": "a", "request": request, **more})
        self.assertNotIn("error", reply, reply)
        return reply["parameters"]

    def status(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]

    def lensctl(self, *arguments):
        done = self.daemon.lensctl(*arguments, "--json")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        return json.loads(done.stdout)


class FreeFocalLength(ZoomTest):
    """Every place of the zoom, fixed one after the other, is the reference for leaving the choice to the daemon."""
    questions = [
        {"limits": [limit("sharp", 0.8, 1.1, 30.0)]},
        {"limits": [limit("sharp", 0.8, 1.1, 30.0), limit("blurred", 2.5, 9.0, 70.0, "behind")]},
        {"limits": [limit("sharp", 0.8, 0.95, 30.0), limit("blurred", 2.5, 9.0, 110.0, "behind")],
         "objective": "sharp"},
        {"limits": [limit("sharp", 0.5, 0.6, 30.0), limit("blurred", 0.2, 0.3, 100.0, "front")],
         "wavelengthNm": 550.0, "pupilFactor": 0.6},
        {"limits": [limit("sharp", 0.7, 2.5, 14.0)], "stack": True, "apertureMax": 5.6},
    ]

    def worth(self, answer, question):
        """Smaller is better; what cannot be comes last."""
        if question.get("stack"):
            return (len(answer["shots"]), answer["shots"][0]["fNumber"]) if answer["feasible"] else (math.inf, math.inf)
        if not answer["feasible"]:
            return (math.inf, math.inf)
        return (1, answer["worstRatio"] if question.get("objective") == "sharp" else answer["fNumber"])

    def test_the_choice_is_within_a_thousandth_of_the_best_of_all_focal_lengths(self):
        low, high = self.scene["focal_length_mm"]
        for question in self.questions:
            with self.daemon.client() as client:
                chosen = self.plan(client, {**question, "focalLengthMinMm": low, "focalLengthMaxMm": high})["plan"]
                best = min(self.worth(self.plan(client, {**question, "focalLengthMm":
                                                         low + (high - low) * i / PLACES})["plan"], question)
                           for i in range(0, PLACES + 1, EVERY))
            print(self.id().split(".")[-2], question, "chosen", self.worth(chosen, question), "best", best)
            self.assertLess(best[0], math.inf, question)
            self.assertEqual(self.worth(chosen, question)[0], best[0], question)
            self.assertLessEqual(self.worth(chosen, question)[1], best[1] * 1.001, question)

    def test_no_choice_where_no_focal_length_will_do(self):
        with self.daemon.client() as client:
            answer = self.plan(client, {"limits": [limit("sharp", 0.8, 1.1, 20.0),
                                                   limit("blurred", 1.2, 9.0, 500.0, "behind")],
                                        "focalLengthMinMm": 20, "focalLengthMaxMm": 40})["plan"]
        self.assertFalse(answer["feasible"])
        self.assertTrue(answer["conflict"])

    def test_a_range_beyond_the_zoom_is_out_of_range(self):
        done = self.daemon.lensctl("plan", "a", "--focal-length", "10mm..15mm", "--sharp", "1m:20um", "--json")
        self.assertEqual(done.returncode, 6)
        self.assertIn("20 mm to 40 mm", json.loads(done.stdout)["message"])


class FreeOnABreathingLens(FreeFocalLength):
    scene = {**ZoomTest.scene, "breathing": 0.09}
    calibration = calibration_text(1.09)
    questions = FreeFocalLength.questions[1:4:2]


class WhileChoosing(ZoomTest):
    """A search of seconds keeps nobody waiting, the end of lensd neither."""

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_others_are_answered_and_the_end_of_lensd_breaks_it_off(self):
        question = {**FreeFocalLength.questions[3], "focalLengthMinMm": 20, "focalLengthMaxMm": 40}
        with self.daemon.client() as planner, self.daemon.client() as other:
            planner.send(LENS + "Plan", {"lens": "a", "request": question})
            time.sleep(0.05)
            for method, parameters in (("Stop", {}), ("Plan", {"lens": "a", "request": FreeFocalLength.questions[0]}),
                                       ("Status", {})):
                asked = time.monotonic()
                self.assertNotIn("error", other.call(LENS + method, parameters))
                self.assertLess(time.monotonic() - asked, 0.1 * PATIENCE, method)
            self.assertFalse(select.select([planner.socket], [], [], 0)[0], "it took no time: this tests nothing")
            told = time.monotonic()
            self.assertEqual(self.daemon.stop(), 0)
            self.assertLess(time.monotonic() - told, 1.0 * PATIENCE)
            reply = planner.receive()
        self.assertTrue(reply is None or reply["error"].endswith("Cancelled"), reply)


class FreeFromTheSensorWithAMovingCentre(FreeFocalLength):
    scene = {**ZoomTest.scene, "centre_shift_mm": 60.0}
    lens = 'distance_from = "sensor"\n'
    questions = FreeFocalLength.questions[1:3]


class Framing(ZoomTest):
    scene = {**ZoomTest.scene, "centre_shift_mm": 25.0, "breathing": 0.06}
    calibration = calibration_text(1.06).replace("[[focus]]", """[zoom]
points = [{ steps = 20.0, focal_length_mm = 20.0, centre_shift_mm = 0.0 },
  { steps = 40.0, focal_length_mm = 40.0, centre_shift_mm = 25.0 }]
[[focus]]""")

    def test_the_field_asked_for_fills_the_sensor(self):
        for _ in range(20):
            sensor_mm, distance = RANDOM.uniform(3, 12), RANDOM.uniform(0.9, 2.0)
            f_about = RANDOM.uniform(24, 36) * 1e-3
            width = sensor_mm * 1e-3 * (distance / f_about - 1)
            with self.daemon.client() as client:
                plan = self.plan(client, {"field": {"widthM": width, "distanceM": distance},
                                          "sensorWidthMm": sensor_mm, "focus": {"distanceM": distance},
                                          "limits": []}, apply=True)["plan"]
            self.assertTrue(plan["feasible"])
            now = self.status()
            # The sensor's edges as seen through the centre of the lens, which stands nearer by the shift.
            shift = 25.0 * (now["axes"][-1]["position"] - 20.0) / 20.0 * 1e-3
            z_s = (now["focalLengthMm"] + now["extensionMm"]) * 1e-3
            seen = sensor_mm * 1e-3 * (distance - shift) / z_s
            self.assertAlmostEqual(seen / width, 1.0, delta=0.001)
            self.assertAlmostEqual(plan["fieldWidthM"], seen, delta=1e-6 * seen)

    def test_the_shots_of_a_stack_tell_the_field_they_frame(self):
        with self.daemon.client() as client:
            plan = self.plan(client, {"field": {"widthM": 0.2, "distanceM": 1.2}, "sensorWidthMm": 6, "stack": True,
                                      "limits": [{"kind": "sharp", "limitUm": 20, "depths": [
                                          {"oneEnd": {"distanceM": 1.1}, "otherEnd": {"distanceM": 1.3}}]}]})["plan"]
        self.assertTrue(plan["feasible"], plan)
        for shot in plan["shots"]:
            # The sensor's edges as seen through the centre of the lens, which stands nearer by the shift.
            shift = 25.0 * (plan["focalLengthMm"] - 20.0) / 20.0 * 1e-3
            seen = 6e-3 * (1.2 - shift) / (1e-3 * (shot["focalLengthMm"] + shot["extensionMm"]))
            self.assertAlmostEqual(shot["fieldWidthM"], seen, delta=0.002 * seen)
        self.assertEqual((plan["fieldWidthM"], plan["focalLengthMm"]),
                         (plan["shots"][0]["fieldWidthM"], plan["shots"][0]["focalLengthMm"]))


class MovingCentre(ZoomTest):
    """The wall stands at 0.9 m; zoomed to 40 mm the lens centre is 30 mm nearer to it."""
    scene = {**ZoomTest.scene, "steps": 8001, "centre_shift_mm": 30.0}

    def plane_m(self):
        now = self.status()
        f, e = now["focalLengthMm"] * 1e-3, now["extensionMm"] * 1e-3
        return f * (f + e) / e

    def test_distances_stay_those_of_the_subject(self):
        for focal_length, ahead in ((20.0, 0.0), (30.0, 0.015), (40.0, 0.030)):
            self.lensctl("zoom", "a", f"{focal_length}mm", "--free")
            for distance in (0.9, 1.7):
                self.lensctl("focus", "a", f"{distance}m")
                self.assertAlmostEqual(self.plane_m(), distance - ahead, delta=0.002)
                self.assertAlmostEqual(self.status()["centreShiftMm"], ahead * 1e3, places=9)

    def test_the_picture_is_sharp_where_the_subject_is(self):
        for focal_length in (20.0, 40.0):
            self.lensctl("zoom", "a", f"{focal_length}mm", "--free")
            self.lensctl("aperture", "a", "2")
            found = self.lensctl("autofocus", "a")
            self.assertTrue(found["focused"], found)
            # Within half a depth of field: two pixels of blur at f/2. At 40 mm the shift is worth four of them.
            there = 1.0 / (0.9 - 0.030 * (focal_length - 20.0) / 20.0)
            self.assertAlmostEqual(found["vergenceD"], there, delta=2 * 3.45e-6 * 2 / (focal_length * 1e-3) ** 2)

    def test_zooming_keeps_the_subject_in_focus(self):
        self.lensctl("zoom", "a", "20mm", "--free")
        self.lensctl("focus", "a", "0.9m")
        self.lensctl("zoom", "a", "40mm")
        self.assertAlmostEqual(self.plane_m(), 0.87, delta=0.002)

    def test_a_plan_counts_the_shift_and_reached_is_true(self):
        for _ in range(20):
            near = RANDOM.uniform(0.85, 1.6)
            far = near * RANDOM.uniform(1.02, 1.3)
            um = RANDOM.uniform(20, 60)
            f = RANDOM.uniform(20, 40)
            plan = self.lensctl("plan", "a", "--focal-length", f"{f:.3f}mm", "--sharp", f"{near}m..{far}m:{um}um",
                                "--apply")
            if not plan["feasible"]:
                continue
            now = self.status()
            f, e = now["focalLengthMm"] * 1e-3, now["extensionMm"] * 1e-3
            ahead = 0.030 * (now["focalLengthMm"] - 20.0) / 20.0
            blurs = [abs(f / now["fNumber"] * (e / f - (f + e) / (depth - ahead))) * 1e6 for depth in (near, far)]
            self.assertTrue(plan["reached"]["feasible"])
            self.assertLessEqual(max(blurs), um)
            self.assertGreaterEqual(plan["reached"]["limits"][0]["worstUm"], max(blurs) * (1 - 1e-9))
            # Nor is it far from the truth: an unnoticed shift would cost more.
            self.assertLessEqual(plan["reached"]["limits"][0]["worstUm"], max(blurs) + 0.05 * um + 1.0)


del ZoomTest
if __name__ == "__main__":
    unittest.main(verbosity=2)
