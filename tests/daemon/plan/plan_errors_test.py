"""What the errors of Plan tell: the field at fault as it was written, and what it may be."""
import os
import sys
import tempfile
import unittest
import unittest.mock

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "interface"))
from errors_test import ErrorTest  # noqa: E402
from harness import HERE, LENS  # noqa: E402


def sharp(near=1.0, far=1.2, **fields):
    ends = {"oneEnd": {"distanceM": near}, "otherEnd": {"distanceM": far}}
    return {"kind": "sharp", "limitPx": 1, "depths": [ends], **fields}


class PlanTest(ErrorTest):
    def plan(self, request, name, parameter, **expected):
        with self.subTest(request=request):
            told = self.call("Plan", {"lens": "a", "request": request}, name)
            facts = {"minimum": None, "maximum": None, "unit": None, **expected}
            self.assert_tells(told, lens="a", parameter=parameter, **facts)
            return told

    def feasible(self, request):
        with self.daemon.client() as client:
            return client.call(LENS + "Plan", {"lens": "a", "request": request})["parameters"]["plan"]["feasible"]


class Plans(PlanTest):
    """f = 25 mm with up to 1.6 mm of extension, f/1.4 to f/16, and a camera of 3.45 um."""

    def test_an_empty_range_tells_its_end_and_what_would_do(self):
        self.plan({"apertureMin": 8, "apertureMax": 4}, "InvalidRequest", "request.apertureMin", maximum=4, unit="fNumber")
        self.plan({"extensionMinMm": 1, "extensionMaxMm": 0.5}, "InvalidRequest", "request.extensionMinMm", maximum=0.5,
                  unit="mm")
        own = {"minimum": 1.4, "maximum": 16, "unit": "fNumber"}
        self.plan({"apertureMin": 20}, "OutOfRange", "request.apertureMin", **own)
        self.plan({"apertureMax": 1}, "OutOfRange", "request.apertureMax", **own)
        own = {"minimum": 0, "maximum": 1.6, "unit": "mm"}
        self.plan({"extensionMinMm": 5}, "OutOfRange", "request.extensionMinMm", **own)
        self.plan({"extensionMaxMm": -0.1}, "OutOfRange", "request.extensionMaxMm", **own)
        for end in ({"apertureMin": 16}, {"apertureMax": 1.4}, {"extensionMinMm": 1.6}, {"extensionMaxMm": 0}):
            self.assertTrue(self.feasible(end), end)

    def test_a_number_that_makes_no_sense_is_named(self):
        for field, value in (("apertureMin", 0), ("extensionMinMm", -30), ("pixelUm", -1), ("wavelengthNm", -1),
                             ("pupilFactor", 0), ("modelTolerancePx", -1), ("modelToleranceUm", -1)):
            self.plan({field: value}, "InvalidRequest", f"request.{field}")
        self.plan({"stops": [4, -2]}, "InvalidRequest", "request.stops[1]")
        for field in ("blurLimitPx", "blurLimitUm"):
            self.plan({"objective": "depth", "focus": {"distanceM": 1}, field: -1}, "InvalidRequest", f"request.{field}")
        self.plan({"objective": "depth"}, "InvalidRequest", "request.objective")

    def test_of_limits_the_field_of_the_one_at_fault_is_named(self):
        in_um = {"kind": "sharp", "limitUm": 0, "depths": sharp()["depths"]}
        self.plan({"limits": [sharp(), in_um]}, "InvalidRequest", "request.limits[1].limitUm")
        self.plan({"limits": [sharp(limitPx=-1)]}, "InvalidRequest", "request.limits[0].limitPx")
        self.plan({"limits": [sharp(), sharp(depths=[])]}, "InvalidRequest", "request.limits[1].depths")
        self.plan({"limits": [sharp(name="x"), sharp(name="x")]}, "InvalidRequest", "request.limits[1].name")
        past = {"oneEnd": {"distanceM": 1}, "otherEnd": {"vergenceD": -1}}
        self.plan({"limits": [sharp(depths=sharp()["depths"] + [past])]}, "InvalidRequest",
                  "request.limits[0].depths[1].otherEnd.vergenceD", minimum=0, unit="D")
        self.plan({"limits": [sharp(-1)]}, "InvalidRequest", "request.limits[0].depths[0].oneEnd.distanceM")
        self.plan({"limits": [sharp(0.01)]}, "OutOfRange", "request.limits[0].depths[0].oneEnd.distanceM")
        self.plan({"stack": True}, "InvalidRequest", "request.limits")
        self.plan({"stack": True, "limits": [sharp(), sharp(kind="blurred")]}, "InvalidRequest", "request.limits[1].kind")
        self.plan({"stack": True, "limits": [sharp()], "focus": {"vergenceD": 1}}, "InvalidRequest",
                  "request.focus.vergenceD")

    def test_a_value_of_the_wrong_kind_is_named_with_its_place_in_the_list(self):
        wrong = {"depths": [{"oneEnd": {"distanceM": 1}, "otherEnd": {"nope": 1}}]}
        for limit, path in ((sharp(kind="nope"), "kind"), (sharp(**wrong), "depths[0].otherEnd.nope")):
            with self.daemon.client() as client:
                reply = client.call(LENS + "Plan", {"lens": "a", "request": {"limits": [sharp(), limit]}})
            self.assertEqual(reply, {"error": "org.varlink.service.InvalidParameter",
                                     "parameters": {"parameter": "request.limits[1]." + path}})

    def test_a_focus_out_of_reach_tells_the_reach(self):
        closest = 0.025 + 0.025 ** 2 / 0.0016
        for request, added in (({}, 0), ({"distanceFrom": "sensor"}, 0.0266)):
            told = self.plan({"focus": {"distanceM": 0.01}, **request}, "OutOfRange", "request.focus.distanceM",
                             minimum=unittest.mock.ANY, unit="m")
            self.assertAlmostEqual(told["minimum"], closest + added, delta=1e-6)
            self.assertTrue(self.feasible({"focus": {"distanceM": told["minimum"]}, **request}))
        told = self.plan({"focus": {"vergenceD": 1000}}, "OutOfRange", "request.focus.vergenceD", minimum=0,
                         maximum=unittest.mock.ANY, unit="D")
        self.assertAlmostEqual(told["maximum"], 1 / closest, delta=1e-6)
        self.assertTrue(self.feasible({"focus": {"vergenceD": told["maximum"]}}))
        self.plan({"focus": {"distanceM": -1}}, "InvalidRequest", "request.focus.distanceM")

    def test_what_takes_a_zoom_is_named_as_it_was_asked(self):
        for field, request in (("field", {"field": {"widthM": 0.1, "distanceM": 1.2}}), ("focalLengthMm", {"focalLengthMm": 30}),
                               ("focalLengthMinMm", {"focalLengthMinMm": 20, "focalLengthMaxMm": 30})):
            self.plan(request, "OutOfRange", f"request.{field}", axis="zoom")


class ZoomPlans(PlanTest):
    """20 to 40 mm before a sensor 6.4 mm wide."""

    @classmethod
    def setUpClass(cls):
        cls.scenes = tempfile.TemporaryDirectory(prefix="lensd-errors-")
        with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as file:
            scene = file.read().replace("focal_length_mm = 25.0", "focal_length_mm = [20.0, 40.0]")
        place = os.path.join(cls.scenes.name, "zoom.toml")
        with open(place, "w", encoding="utf-8") as file:
            file.write(scene.replace("pixel_um = 3.45", "pixel_um = 100"))
        cls.config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{place}"\n'
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.scenes.cleanup()

    def test_a_field_that_cannot_be_framed_tells_the_widths_that_can(self):
        framed = {}
        for width in (0.1, 1):
            told = self.plan({"field": {"widthM": width, "distanceM": 2}}, "OutOfRange", "request.field.widthM",
                             minimum=unittest.mock.ANY, maximum=unittest.mock.ANY, unit="m")
            framed = {"minimum": told["minimum"], "maximum": told["maximum"]}
            # Field over sensor is distance over sensor distance: at the longest and the shortest focal length.
            self.assertAlmostEqual(told["minimum"], 6.4e-3 * (2 - 0.04) / 0.04, delta=1e-9)
            self.assertAlmostEqual(told["maximum"], 6.4e-3 * (2 - 0.02) / 0.02, delta=1e-9)
        for width in framed.values():
            self.assertTrue(self.feasible({"field": {"widthM": width, "distanceM": 2}}))
        self.plan({"field": {"widthM": 0, "distanceM": 2}}, "InvalidRequest", "request.field.widthM")
        self.plan({"field": {"widthM": 1, "distanceM": -2}}, "InvalidRequest", "request.field.distanceM")
        self.plan({"field": {"widthM": 1, "distanceM": 2}, "sensorWidthMm": 0}, "InvalidRequest", "request.sensorWidthMm")

    def test_focal_lengths_out_of_reach_tell_those_in_reach(self):
        reach = {"minimum": 20, "maximum": 40, "unit": "mm", "axis": "zoom"}
        self.plan({"focalLengthMm": 50}, "OutOfRange", "request.focalLengthMm", **reach)
        self.plan({"focalLengthMinMm": 50, "focalLengthMaxMm": 60}, "OutOfRange", "request.focalLengthMinMm", **reach)
        self.plan({"focalLengthMm": 30, "extensionMinMm": 5}, "OutOfRange", "request.extensionMinMm", minimum=0, maximum=1.6,
                  unit="mm")


del ErrorTest, PlanTest  # of the loader


if __name__ == "__main__":
    unittest.main()
