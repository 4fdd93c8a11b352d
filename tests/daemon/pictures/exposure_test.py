"""Exposure time and gain: what the camera is set to, what that does to its pictures, and who may set it."""
import json
import os
import statistics
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, DaemonTest  # noqa: E402
from viewer import FileClient, next_picture, scene_daemon, snapshot, view, words  # noqa: E402

SCENE = """version = 1
[camera]
width = 96
height = 64
bits = 12
full_well_e = 10000
exposure_ms = 4
frame_rate_hz = 100
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 4001
speed_steps_per_s = 1000
[[surface]]
kind = "wall"
distance_m = 1.2
constant = 0.2
"""


class OneCamera(DaemonTest):
    scene = SCENE

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-exposure-")
        cls.daemon = scene_daemon(cls.folder.name, cls.scene)

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def setUp(self):
        with self.daemon.client() as client:
            client.call(LENS + "SetExposure", {"exposureMs": 4.0, "gain": 0.0})

    def set(self, **parameters):
        with self.daemon.client() as client:
            return client.call(LENS + "SetExposure", parameters)


class Blinded(OneCamera):
    scene = SCENE.replace("speed_steps_per_s = 1000", "speed_steps_per_s = 10000")

    def test_autofocus_with_a_blinded_camera_says_that_it_is_too_bright(self):
        self.set(exposureMs=9.0, gain=24.0)
        with self.daemon.client() as client:
            for method in (None, "auto", "sweep"):
                result = client.call(LENS + "Autofocus", {"region": {"x": 0, "y": 0, "w": 1, "h": 1},
                                                          **({"method": method} if method else {})})
                self.assertEqual(result["parameters"]["autofocus"]["cause"], "tooBright", (method, result))


class ExposureTest(OneCamera):
    def light(self):
        """Mean and variance of a new picture, in electrons at no gain, and its exposure."""
        with FileClient(self.daemon.socket) as client:
            about, data = snapshot(client, encoding="raw")
        electrons = [s * 10000 / 4095 for s in words(data)]
        return statistics.fmean(electrons), statistics.pvariance(electrons), about["frame"]["exposureMs"]

    def test_tells_what_is_set_and_what_can_be(self):
        with self.daemon.client() as client:
            now = client.call(LENS + "GetExposure")["parameters"]["exposure"]
        self.assertEqual(now, {"lens": "a", "exposureMs": 4.0, "canSetExposure": True, "exposureMinMs": 0.001,
                               "exposureMaxMs": 1e5, "exposureStepMs": None, "gain": 0.0, "canSetGain": True, "gainMin": 0.0, "gainMax": 24.0,
                               "gainStep": None, "gainUnit": "dB"})

    def test_light_and_its_noise_follow_the_exposure_and_gain_lifts_both(self):
        mean, variance, exposure = self.light()
        self.assertEqual(exposure, 4.0)
        # Photon noise: the variance is the mean, beside a twelfth of a step of 2.4 electrons.
        self.assertAlmostEqual(variance / mean, 1.0, delta=0.1)
        self.assertEqual(self.set(exposureMs=8.0)["parameters"]["exposure"]["exposureMs"], 8.0)
        twice, variance, exposure = self.light()
        self.assertEqual(exposure, 8.0)
        self.assertAlmostEqual(twice / mean, 2.0, delta=0.01)
        self.assertAlmostEqual(variance / twice, 1.0, delta=0.1)
        now = self.set(exposureMs=4.0, gain=6.0206)["parameters"]["exposure"]
        self.assertEqual((now["exposureMs"], now["gain"]), (4.0, 6.0206))
        lifted, variance, _ = self.light()
        self.assertAlmostEqual(lifted / mean, 2.0, delta=0.01)
        self.assertAlmostEqual(variance / lifted, 2.0, delta=0.2)

    def test_a_view_goes_on_with_the_new_exposure(self):
        with FileClient(self.daemon.socket) as client:
            view(client, encoding="raw", fd=True)
            self.assertEqual(next_picture(client)[0]["frame"]["exposureMs"], 4.0)
            self.set(exposureMs=2.0)
            for _ in range(30):
                exposure = next_picture(client)[0]["frame"]["exposureMs"]
                if exposure == 2.0:
                    return
        self.fail("no frame of the new exposure came")

    def test_what_the_camera_does_not_take_is_refused_and_changes_nothing(self):
        for parameters, error in (({"exposureMs": 1e6}, "OutOfRange"), ({"exposureMs": 0}, "OutOfRange"),
                                  ({"gain": 25.0}, "OutOfRange"), ({"gain": -1.0}, "OutOfRange"),
                                  ({}, "InvalidRequest")):
            self.assertEqual(self.set(**parameters)["error"], LENS + error, parameters)
        taken = ("exposureMs", 0.001, 1e5, "ms")
        for parameters, facts in (*(({"exposureMs": ms}, taken) for ms in (1e6, 0, -3, 1e-9, 1e300)),
                                  # Both or neither.
                                  ({"exposureMs": 7.0, "gain": 25.0}, ("gain", 0.0, 24.0, "dB"))):
            told = self.set(**parameters)["parameters"]
            self.assertEqual(tuple(told[key] for key in ("parameter", "minimum", "maximum", "unit")), facts, told)
        with self.daemon.client() as client:
            now = client.call(LENS + "GetExposure")["parameters"]["exposure"]
        self.assertEqual((now["exposureMs"], now["gain"]), (4.0, 0.0))

    def test_a_lease_keeps_others_from_it(self):
        with self.daemon.client() as holder:
            key = holder.call(LENS + "TakeLease", {})["parameters"]["lease"]
            self.assertEqual(self.set(exposureMs=5.0)["error"], LENS + "Leased")
            self.assertEqual(self.set(exposureMs=5.0, lease=key)["parameters"]["exposure"]["exposureMs"], 5.0)

    def test_while_autofocus_compares_pictures_it_is_busy(self):
        with self.daemon.client() as focuser:
            focuser.send(LENS + "Autofocus", {"method": "sweep"})
            self.wait_for(lambda: self.activity() == "autofocus", 20)
            answer = self.set(exposureMs=5.0)
            with self.daemon.client() as client:
                client.call(LENS + "Stop")
            focuser.receive()
        self.assertEqual(answer["error"], LENS + "Busy", answer)
        self.assertIn("autofocus", answer["parameters"]["message"])
        self.assertIn("parameters", self.set(exposureMs=5.0))

    def activity(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status")["parameters"]["lenses"][0]["activity"]

    def test_lensctl_sets_and_tells(self):
        done = self.daemon.lensctl("--json", "exposure", "a", "6ms", "--gain", "3")
        self.assertEqual(done.returncode, 0, done.stderr)
        now = json.loads(done.stdout)
        self.assertEqual((now["exposureMs"], now["gain"]), (6.0, 3.0))
        for words_given in ((), ("a",)):
            told = self.daemon.lensctl("exposure", *words_given)
            self.assertIn("6 ms (0.001 to 100000)", told.stdout)
            self.assertIn("gain 3 dB (0 to 24)", told.stdout)
        self.assertEqual(json.loads(self.daemon.lensctl("--json", "exposure", "2ms").stdout)["exposureMs"], 2.0)
        for gain in ("6 dB", "6dB", "6 db", "6"):  # as it prints it, too
            now = json.loads(self.daemon.lensctl("--json", "exposure", "a", "--gain", gain).stdout)
            self.assertEqual(now["gain"], 6.0, gain)
        for words_given, status in ((("5",), 64), (("a", "--gain", "6 px"), 64), (("a", "--gain", "dB"), 64), (("200s",), 6), (("nose", "2ms"), 68), (("a", "--gain", "99"), 6)):
            self.assertEqual(self.daemon.lensctl("exposure", *words_given).returncode, status, words_given)


if __name__ == "__main__":
    unittest.main()
