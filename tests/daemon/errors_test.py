"""What errors tell programs: every field by the interface file, limits in the unit of what was asked, and of Busy who does
what and since when."""
import os
import tempfile
import unittest
import unittest.mock

from harness import HERE, LENS, Daemon, DaemonTest
from interface_test import Definition


class ErrorTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.daemon.client() as client:
            reply = client.call("org.varlink.service.GetInterfaceDescription", {"interface": "io.lensd.Lens"})
        cls.definition = Definition(reply["parameters"]["description"])

    def refused(self, reply, name):
        """The parameters of an error that keeps to the interface."""
        self.assertEqual(reply.get("error"), LENS + name, reply)
        told = reply["parameters"]
        self.assertEqual(self.definition.wrong(self.definition.errors[name], told, name), [])
        return told

    def call(self, method, parameters, name, **flags):
        with self.daemon.client(60) as client:
            return self.refused(client.call(LENS + method, parameters, **flags), name)

    def assert_tells(self, told, **expected):
        self.assertEqual({key: told.get(key) for key in expected}, expected, told)


class Facts(ErrorTest):
    def move(self, axis, name, **target):
        return self.call("Move", {"lens": "a", "axis": axis, "target": target}, name)

    def test_out_of_range_tells_the_range_as_it_was_asked(self):
        who = {"lens": "a", "axis": "focus"}
        self.assert_tells(self.move("focus", "OutOfRange", position=99999), **who, parameter="target.position",
                          minimum=0, maximum=4000, unit="steps")
        self.assert_tells(self.move("focus", "OutOfRange", extensionMm=9), **who, parameter="target.extensionMm", unit="mm")
        told = self.move("focus", "OutOfRange", distanceM=0.03)
        # Focal length and longest extension of the scene say the closest focus; infinity has no end.
        self.assertAlmostEqual(told["minimum"], 0.025 + 0.025 ** 2 / 0.0016, delta=1e-3)
        self.assert_tells(told, **who, parameter="target.distanceM", maximum=None, unit="m")
        told = self.move("focus", "OutOfRange", vergenceD=30)
        self.assertAlmostEqual(told["maximum"], 1 / (0.025 + 0.025 ** 2 / 0.0016), delta=1e-3)
        self.assertAlmostEqual(told["minimum"], 0, delta=1e-9)
        told = self.move("iris", "OutOfRange", fNumber=99)
        self.assertAlmostEqual(told["minimum"], 1.4, delta=0.01)
        self.assertAlmostEqual(told["maximum"], 16, delta=0.1)
        self.assert_tells(told, axis="iris", parameter="target.fNumber", unit="fNumber")

    def test_relative_targets_count_from_where_the_axis_stands(self):
        with self.daemon.client() as client:
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 100}})
        self.assert_tells(self.move("focus", "OutOfRange", relative=-200), minimum=-100, maximum=3900, unit="steps")

    def test_a_distance_from_the_sensor_is_told_from_the_sensor(self):
        told = self.call("Move", {"lens": "a", "axis": "focus", "target": {"distanceM": 0.1}, "distanceFrom": "sensor"},
                         "OutOfRange")
        f, e = 0.025, 0.0016
        self.assertAlmostEqual(told["minimum"], f + f * f / e + f + e, delta=1e-3)

    def test_wrong_requests_name_the_parameter(self):
        for method, parameters, expected in (
                ("Move", {"lens": "a", "axis": "focus", "target": {}}, {"parameter": "target", "axis": "focus"}),
                ("Move", {"lens": "a", "axis": "focus", "target": {"position": 1}, "keepFocus": True},
                 {"parameter": "keepFocus"}),
                ("Move", {"axis": "focus", "target": {"position": 1}}, {"parameter": "lens"}),
                ("Move", {"lens": "a", "axis": "iris", "target": {"distanceM": 1}}, {"parameter": "target.distanceM"}),
                ("TakeLease", {"lens": "a", "forMs": 1e12},
                 {"parameter": "forMs", "maximum": 86400000, "unit": "ms"}),
                ("Autofocus", {"lens": "a", "method": "magic"}, {"parameter": "method"}),
                ("Autofocus", {"lens": "a", "region": {"x": 0.9, "y": 0, "w": 0.5, "h": 1}}, {"parameter": "region"}),
                ("MeasureBacklash", {"lens": "a", "pairs": 1}, {"parameter": "pairs", "minimum": 3, "maximum": 100}),
                ("MeasureBacklash", {"lens": "a", "size": -1}, {"parameter": "size", "minimum": 0}),
                ("PresetSave", {"lens": "a", "label": "a/b"}, {"parameter": "label"}),
                ("Calibrate", {"lens": "a", "points": [{"position": 1, "vergenceD": 1}]}, {"parameter": "points"}),
                ("AutofocusEnd", {"session": 77}, {"parameter": "session"}),
                ("AutofocusBegin", {"lens": "a", "deadlineMs": 0}, {"parameter": "deadlineMs", "unit": "ms"}),
                ("Plan", {"lens": "a", "request": {"limits": [
                    {"kind": "sharp", "limitUm": -1, "depths": [{"oneEnd": {}, "otherEnd": {}}]}]}},
                 {"parameter": "request.limits[0].depths[0].oneEnd"})):
            with self.subTest(method=method, parameters=parameters):
                self.assert_tells(self.call(method, parameters, "InvalidRequest"), **expected)

    def test_an_end_that_is_refused_is_not_told(self):
        with self.daemon.client(60) as client:
            session = client.call(LENS + "AutofocusBegin", {"lens": "b", "scores": True, "method": "hill-climb"})["parameters"]
            times = {"session": session["session"], "exposureStartNs": 1, "exposureEndNs": 2}
            for method, parameters, expected in (
                    ("TakeLease", {"lens": "a", "forMs": 0}, {"parameter": "forMs", "maximum": 86400000, "unit": "ms"}),
                    ("Autofocus", {"lens": "a", "deadlineMs": 0}, {"parameter": "deadlineMs", "maximum": 3600e3, "unit": "ms"}),
                    ("Autofocus", {"lens": "a", "step": {"relative": 0}}, {"parameter": "step.relative"}),
                    ("Autofocus", {"lens": "a", "step": {"blurPx": -1}}, {"parameter": "step.blurPx"}),
                    ("AutofocusScore", {**times, "sharpness": 0}, {"parameter": "sharpness"}),
                    ("AutofocusScore", {**times, "sharpness": 1, "sigma": 0}, {"parameter": "sigma"})):
                with self.subTest(method=method, parameters=parameters):
                    told = self.refused(client.call(LENS + method, parameters), "InvalidRequest")
                    self.assert_tells(told, minimum=None, **{"maximum": None, "unit": None, **expected})
            client.call(LENS + "AutofocusEnd", {"session": session["session"]})

    def test_what_is_not_found_is_named(self):
        self.assert_tells(self.call("Stop", {"lens": "nobody"}, "LensNotFound"), lens="nobody")
        self.assert_tells(self.call("PresetRecall", {"lens": "a", "label": "x"}, "PresetNotFound"), lens="a", label="x")
        self.assert_tells(self.call("Move", {"lens": "a", "axis": "filter", "target": {"position": 1}}, "Unsupported"),
                          lens="a", axis="filter")

    def test_a_calibration_that_says_something_wrong_is_bad_data(self):
        self.assertIn("calibration:1", self.call("Calibrate", {"lens": "a", "toml": "version = ["}, "BadData")["message"])

    def test_a_stop_and_a_newer_command_tell_of_which_lens(self):
        with self.daemon.client() as first:
            for then, name in ((("Stop", {"lens": "a"}), "Cancelled"),
                               (("Move", {"lens": "a", "axis": "focus", "target": {"relative": 1}}), "Superseded")):
                first.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3900}})
                self.wait_for(lambda: self.position()["moving"])
                with self.daemon.client() as other:
                    other.call(LENS + then[0], then[1])
                self.assert_tells(self.refused(first.receive(), name), lens="a", axis="focus")


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
        with self.daemon.client(60) as client:
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


class Busy(ErrorTest):
    """A move across the range takes four seconds."""

    def setUp(self):
        self.me = f"[{os.getpid()}] of user {os.getuid()}"
        self.first = self.daemon.client(60)
        self.addCleanup(self.first.socket.close)
        self.addCleanup(self.stop)

    def stop(self):
        with self.daemon.client() as client:
            self.assertEqual(client.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
        self.wait_for(lambda: self.activity() == "idle" and not self.position()["moving"])

    def activity(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["activity"]

    def begin(self, method, activity, **parameters):
        self.first.send(LENS + method, {"lens": "a", **parameters})
        self.wait_for(lambda: self.activity() == activity)

    def begin_move(self):
        self.begin("Move", "moving", axis="focus", target={"position": 3990 if self.position()["position"] < 2000 else 10})

    def busy(self, method, activity, **parameters):
        told = self.call(method, {"lens": "a", **parameters}, "Busy")
        self.assert_tells(told, lens="a", axis="focus", activity=activity)
        self.assertIn(self.me, told["holder"])
        self.assertIn(told["holder"], told["message"])
        self.assertTrue(0 < told["sinceMs"] < 60e3, told)

    POINTS = [{"position": 0, "extensionMm": 0}, {"position": 4000, "extensionMm": 0.8}]

    def test_what_says_where_the_lens_stands_waits_for_an_axis_that_moves(self):
        with self.daemon.client() as client:
            client.call(LENS + "PresetRemove", {"lens": "a", "label": "here"})
        self.begin_move()
        self.busy("Calibrate", "moving", points=self.POINTS, errorUm=5, approximate=True)
        self.busy("Calibrate", "moving", remove=True)
        self.busy("MeasureBacklash", "moving")
        self.busy("MeasureBacklash", "moving", axis="focus", size=3)
        self.busy("PresetSave", "moving", label="here")
        self.assertEqual(self.activity(), "moving")  # none of them has displaced it
        self.stop()
        with self.daemon.client() as client:
            self.assertEqual(client.call(LENS + "PresetList", {"lens": "a"})["parameters"], {"presets": []})
            self.assertNotIn("error", client.call(LENS + "PresetSave", {"lens": "a", "label": "here"}))
            self.assertNotIn("error", client.call(LENS + "Calibrate", {"lens": "a", "remove": True}))

    def test_a_second_autofocus_is_refused_and_the_first_goes_on(self):
        with self.daemon.client() as client:
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 500}})
        self.begin("Autofocus", "autofocus")
        self.busy("Autofocus", "autofocus")
        self.busy("AutofocusBegin", "autofocus")
        self.busy("MeasureBacklash", "autofocus")
        self.busy("SetExposure", "autofocus", exposureMs=5)
        self.assertTrue(self.first.receive()["parameters"]["autofocus"]["focused"])

    def test_a_session_is_an_autofocus_until_it_ends(self):
        self.first.send(LENS + "AutofocusBegin", {"lens": "a"})
        session = self.first.receive()["parameters"]["session"]
        self.busy("Autofocus", "autofocus")
        self.busy("AutofocusBegin", "autofocus")
        self.assertEqual(self.first.call(LENS + "AutofocusEnd", {"session": session}), {"parameters": {}})
        with self.daemon.client(60) as client:
            self.assertNotIn("error", client.call(LENS + "Autofocus", {"lens": "a"}))

    def test_a_backlash_that_is_measured_is_one_thing_from_its_first_frame_to_its_last(self):
        self.begin("MeasureBacklash", "backlash")
        for method in ("Autofocus", "AutofocusBegin", "MeasureBacklash"):
            self.busy(method, "backlash")
        self.busy("Calibrate", "backlash", remove=True)
        self.busy("PresetSave", "backlash", label="here")
        self.stop()
        self.assertIn(self.first.receive()["error"], (LENS + "Cancelled", LENS + "Superseded"))
        with self.daemon.client(60) as client:
            self.assertNotIn("error", client.call(LENS + "Autofocus", {"lens": "a"}))

    def test_a_move_displaces_and_a_stop_always_works(self):
        self.begin_move()
        with self.daemon.client(60) as client:
            moved = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"relative": 5}})
        self.assertNotIn("error", moved)
        self.assert_tells(self.refused(self.first.receive(), "Superseded"), lens="a")


class Compensation(unittest.TestCase):
    def test_a_lens_without_a_coefficient_can_be_given_one(self):
        scene = os.path.join(HERE, "small.toml")
        daemon = Daemon(config=f"""version = 1
[[lens]]
name = "a"
driver = "sim"
scene = "{scene}"
[lens.temperature]
compensate = true
""")
        try:
            with daemon.client() as client:
                status = client.call(LENS + "Status")["parameters"]["lenses"][0]
                self.assertTrue(status["connected"], status)
                self.assertEqual(["um_per_c" in warning for warning in status["warnings"]], [True])
                toml = ('version = 1\nserial = ""\nmade = "by hand"\n[[focus]]\napproach = "near"\nerror_um = 1.0\n'
                        'points = [{ steps = 0, extension_mm = 0.0 }, { steps = 4000, extension_mm = 1.6 }]\n'
                        "[temperature]\nreference_c = 20\num_per_c = 1.5\n")
                self.assertNotIn("error", client.call(LENS + "Calibrate", {"toml": toml}))
                self.assertEqual(client.call(LENS + "Status")["parameters"]["lenses"][0]["warnings"], [])
        finally:
            self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main()
