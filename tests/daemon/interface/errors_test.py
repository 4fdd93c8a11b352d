"""What errors tell programs: every field by the interface file, limits in the unit of what was asked, and of Busy who does
what and since when."""
import base64
import os
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, Daemon, DaemonTest  # noqa: E402
from interface_test import Definition  # noqa: E402


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
        with self.daemon.client() as client:
            return self.refused(client.call(LENS + method, parameters, **flags), name)

    def assert_tells(self, told, **expected):
        self.assertEqual({key: told.get(key) for key in expected}, expected, told)


WHOLE = {"x": 0, "y": 0, "w": 1, "h": 1}


class Facts(ErrorTest):
    lenses = ("a", "b", "slow")
    quick = ("a", "b")

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
                ("MeasureBacklash", {"lens": "a", "size": -1}, {"parameter": "size", "minimum": 0, "unit": "steps"}),
                ("MeasureBacklash", {"lens": "a", "region": {"x": 0.9, "y": 0, "w": 0.5, "h": 1}}, {"parameter": "region"}),
                ("AutofocusBegin", {"lens": "a", "regions": [WHOLE, {"x": 0, "y": 0, "w": 2, "h": 1}]},
                 {"parameter": "regions[1]"}),
                ("Autofocus", {"lens": "a", "regions": [WHOLE, {"x": 0, "y": 0, "w": 0.01, "h": 1}]},
                 {"parameter": "regions[1]"}),
                ("Autofocus", {"lens": "a", "regions": [{"x": 0, "y": 0, "w": 0.01, "h": 1}]}, {"parameter": "regions[0]"}),
                ("Autofocus", {"lens": "a", "region": {"x": 0, "y": 0, "w": 0.01, "h": 1}}, {"parameter": "region"}),

                ("PresetSave", {"lens": "a", "label": "a/b"}, {"parameter": "label"}),
                ("Calibrate", {"lens": "a", "points": [{"position": 1, "vergenceD": 1}]}, {"parameter": "points"}),
                ("Calibrate", {"lens": "a", "points": [{"position": 1, "vergenceD": 1},
                                                       {"position": 2, "vergenceD": 1, "distanceM": 1}]},
                 {"parameter": "points[1]"}),
                ("Calibrate", {"lens": "a", "points": [{"position": 1, "vergenceD": 1}, {"position": 2}]},
                 {"parameter": "points[1]"}),
                ("AutofocusEnd", {"session": 77}, {"parameter": "session"}),
                ("AutofocusBegin", {"lens": "a", "deadlineMs": 0}, {"parameter": "deadlineMs", "unit": "ms"}),
                ("Plan", {"lens": "a", "request": {"limits": [
                    {"kind": "sharp", "limitUm": -1, "depths": [{"oneEnd": {}, "otherEnd": {}}]}]}},
                 {"parameter": "request.limits[0].depths[0].oneEnd"})):
            with self.subTest(method=method, parameters=parameters):
                self.assert_tells(self.call(method, parameters, "InvalidRequest"), **expected)

    def test_pictures_that_cannot_be_name_the_parameter(self):
        for method, parameters, expected in (
                ("View", {"maxRateHz": 0}, {"parameter": "maxRateHz", "minimum": 0.001, "maximum": 10000, "unit": "Hz"}),
                ("View", {"region": {"x": 0, "y": 0, "w": 0, "h": 1}}, {"parameter": "region"}),
                ("Snapshot", {"region": {"x": 0.5, "y": 0, "w": 0.6, "h": 1}}, {"parameter": "region"}),
                ("Snapshot", {"scaleTo": {"widthPx": 0, "heightPx": 1}},
                 {"parameter": "scaleTo.widthPx", "minimum": 1, "unit": "px"}),
                ("Snapshot", {"scaleTo": {"widthPx": 1, "heightPx": -1}},
                 {"parameter": "scaleTo.heightPx", "minimum": 1, "unit": "px"})):
            with self.subTest(method=method, parameters=parameters):
                self.assert_tells(self.call(method, {"lens": "a", **parameters}, "InvalidRequest", more=True), **expected)

    def test_a_distance_of_a_calibration_that_cannot_be_is_named_by_its_point(self):
        points = [{"position": 300, "distanceM": 1}, {"position": 100, "distanceM": -5}]
        self.assert_tells(self.call("Calibrate", {"lens": "a", "points": points}, "OutOfRange"),
                          parameter="points[1].distanceM")

    def test_an_end_of_a_range_is_named_as_it_was_asked(self):
        self.assert_tells(self.call("Autofocus", {"lens": "a", "range": {"from": {"distanceM": 0.01}, "to": {"vergenceD": 1}}},
                                    "OutOfRange"), parameter="range.from.distanceM", unit="m")
        self.assert_tells(self.call("AutofocusBegin", {"lens": "a", "range": {"from": {"position": 1}, "to": {"vergenceD": 99}}},
                                    "OutOfRange"), parameter="range.to.vergenceD", unit="D")

    def test_a_frame_exposed_too_early_or_too_small_is_told_in_its_own_parameters(self):
        with self.daemon.client() as client:
            begun = client.call(LENS + "AutofocusBegin", {"lens": "b", "method": "sweep", "region": {**WHOLE, "w": 0.5}})
            session, since = begun["parameters"]["session"], begun["parameters"]["next"]["settledAtNs"]
            frame = {"session": session, "format": "mono8", "exposureEndNs": time.monotonic_ns(),
                     "exposureStartNs": since - 1000000}
            for side, expected in ((1, {"parameter": None}),
                                   (64, {"parameter": "exposureStartNs", "minimum": since, "maximum": None, "unit": "ns"})):
                pixels = base64.b64encode(bytes(side * side)).decode()
                told = self.refused(client.call(LENS + "AutofocusFrame", {**frame, "widthPx": side, "heightPx": side,
                                                                          "data": pixels}), "InvalidRequest")
                self.assert_tells(told, lens="b", **expected)
            client.call(LENS + "AutofocusEnd", {"session": session})

    def test_an_end_that_is_refused_is_not_told(self):
        with self.daemon.client() as client:
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
        self.assert_tells(self.call("Stop", {"lens": "x" * 63 + "é" * 100000}, "LensNotFound"), lens="x" * 63)
        self.assert_tells(self.call("PresetRecall", {"lens": "a", "label": "x"}, "PresetNotFound"), lens="a", label="x")
        self.assert_tells(self.call("Move", {"lens": "a", "axis": "filter", "target": {"position": 1}}, "Unsupported"),
                          lens="a", axis="filter")

    def test_a_calibration_that_says_something_wrong_is_bad_data(self):
        self.assertIn("calibration:1", self.call("Calibrate", {"lens": "a", "toml": "version = ["}, "BadData")["message"])

    def test_a_stop_of_all_names_the_lens_that_did_not_answer(self):
        def inject(kind):
            with self.daemon.client() as client:
                fault = {"lens": "b", "kind": kind}
                self.assertEqual(client.call("io.lensd.Simulator.Inject", fault), {"parameters": {}})
        inject("disconnect")
        try:
            self.assert_tells(self.call("Stop", {}, "Disconnected"), lens="b")
        finally:
            inject("reconnect")
        with self.daemon.client() as client:
            self.wait_for(lambda: client.call(LENS + "Status", {"lens": "b"})["parameters"]["lenses"][0]["connection"]
                          == "connected")
            self.assertNotIn("error", client.call(LENS + "Home", {"lens": "b"}))

    def test_a_stop_and_a_newer_command_tell_of_which_lens(self):
        with self.daemon.client() as first:
            for then, name in ((("Stop", {"lens": "slow"}), "Cancelled"),
                               (("Move", {"lens": "slow", "axis": "focus", "target": {"relative": 1}}), "Superseded")):
                first.send(LENS + "Move", {"lens": "slow", "axis": "focus", "target": {"position": 3900}})
                self.wait_for(lambda: self.position("slow")["moving"])
                with self.daemon.client() as other:
                    other.call(LENS + then[0], then[1])
                self.assert_tells(self.refused(first.receive(), name), lens="slow", axis="focus")


class Busy(ErrorTest):
    """A move of `a` across the range takes four seconds."""
    lenses = ("a", "quick")
    quick = ("quick",)
    lens = "a"
    NEAR = {"from": {"position": 1100}, "to": {"position": 1500}}  # a search of a few seconds

    def setUp(self):
        self.me = f"[{os.getpid()}] of user {os.getuid()}"
        self.first = self.daemon.client()
        self.addCleanup(self.first.socket.close)
        self.addCleanup(self.stop)

    def stop(self):
        with self.daemon.client() as client:
            self.assertEqual(client.call(LENS + "Stop", {"lens": self.lens}), {"parameters": {}})
        self.wait_for(lambda: self.activity() == "idle" and not self.position(self.lens)["moving"])

    def activity(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": self.lens})["parameters"]["lenses"][0]["activity"]

    def begin(self, method, activity, **parameters):
        self.first.send(LENS + method, {"lens": self.lens, **parameters})
        self.wait_for(lambda: self.activity() == activity)

    def begin_move(self):
        self.begin("Move", "moving", axis="focus", target={"position": 3990 if self.position(self.lens)["position"] < 2000 else 10})

    def busy(self, method, activity, **parameters):
        told = self.call(method, {"lens": self.lens, **parameters}, "Busy")
        self.assert_tells(told, lens=self.lens, axis="focus", activity=activity)
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
        self.begin("Autofocus", "autofocus", range=self.NEAR)
        self.busy("Autofocus", "autofocus")
        self.busy("AutofocusBegin", "autofocus")
        self.busy("MeasureBacklash", "autofocus")
        self.busy("SetExposure", "autofocus", exposureMs=5)
        self.assertTrue(self.first.receive()["parameters"]["autofocus"]["focused"])

    def test_a_session_is_an_autofocus_until_it_ends(self):
        self.lens = "quick"
        self.first.send(LENS + "AutofocusBegin", {"lens": self.lens})
        session = self.first.receive()["parameters"]["session"]
        self.busy("Autofocus", "autofocus")
        self.busy("AutofocusBegin", "autofocus")
        self.assertEqual(self.first.call(LENS + "AutofocusEnd", {"session": session}), {"parameters": {}})
        with self.daemon.client() as client:
            self.assertNotIn("error", client.call(LENS + "Autofocus", {"lens": self.lens}))

    def test_a_backlash_that_is_measured_is_one_thing_from_its_first_frame_to_its_last(self):
        self.begin("MeasureBacklash", "backlash")
        for method in ("Autofocus", "AutofocusBegin", "MeasureBacklash"):
            self.busy(method, "backlash")
        self.busy("Calibrate", "backlash", remove=True)
        self.busy("PresetSave", "backlash", label="here")
        self.stop()
        self.assertIn(self.first.receive()["error"], (LENS + "Cancelled", LENS + "Superseded"))
        with self.daemon.client() as client:
            self.assertNotIn("error", client.call(LENS + "Autofocus", {"lens": "a", "range": self.NEAR}))

    def test_a_move_displaces_and_a_stop_always_works(self):
        self.begin_move()
        with self.daemon.client() as client:
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
