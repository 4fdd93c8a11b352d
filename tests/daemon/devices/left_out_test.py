"""One bad part costs that part: lensd on a played V4L2 node whose controls, or whose pictures, are of no use. What is left out
is said by list, status, doctor, --check-config and the log; what the configuration names is an error of the lens."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, Daemon, played_node  # noqa: E402

TABLES = os.path.join(HERE, "..", "drivers", "one-bad-part")
FOCUS = "009a090a 1 0 250 5 0 0 0\n"
ZOOM_REVERSED = "009a090d 1 500 100 1 100 100 0\n"


class Played(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-played-")
        cls.library = played_node(cls.folder.name)
        cls.node = os.path.join(cls.folder.name, "video0")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def environment(self, table, pictures="320 240 GREY 30"):
        path = os.path.join(self.folder.name, "table.ctl")
        with open(path, "w", encoding="utf-8") as file:
            file.write(table)
        with open(self.node, "w", encoding="utf-8"):
            pass
        return {"FAKE_NODE": self.node, "FAKE_CTL": path, "FAKE_FMT": pictures}

    def config(self, more="", parts="both"):
        return (f'version = 1\n[[lens]]\nname = "cam"\ndriver = "v4l2"\ndevice = "{self.node}"\nparts = "{parts}"\n{more}')

    def play(self, table, pictures="320 240 GREY 30", more="", parts="both"):
        daemon = Daemon(config=self.config(more, parts), preload=self.library, environment=self.environment(table, pictures))
        self.addCleanup(lambda: self.assertEqual(daemon.stop(), 0))
        return daemon

    def status(self, daemon):
        with daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "cam"})["parameters"]["lenses"][0]

    def info(self, daemon):
        with daemon.client() as client:
            return client.call(LENS + "List")["parameters"]["lenses"][0]


class LeftOutTest(Played):
    def focus_works_without(self, part, daemon):
        moved = daemon.lensctl("focus", "@100", "--json")
        self.assertEqual(moved.returncode, 0, moved.stdout + moved.stderr + daemon.log())
        self.assertTrue(json.loads(moved.stdout)["reached"])
        left_out = self.status(daemon)["leftOut"]
        self.assertEqual([one["part"] for one in left_out], [part] if part else [])
        self.assertEqual(self.info(daemon)["leftOut"], left_out)
        for command in ("list", "status"):
            text = daemon.lensctl(command)
            said = json.loads(daemon.lensctl(command, "--json").stdout)
            self.assertEqual((said if command == "status" else said[0])["leftOut"], left_out)
            for one in left_out:
                self.assertIn(f"without {part}: {one['reason']}", text.stdout)
        if part:
            daemon.wait_log(part, "left out")

    def test_tables(self):
        """Each table of the folder: focus works, and what does not is named."""
        cost = {"autofocus-cannot-be-set": "", "exposure-reversed": "exposure", "gain-reversed": "gain",
                "zoom-65535-as-minus-1": "zoom", "zoom-reversed": "zoom", "zoom-unreadable": "zoom"}
        tables = sorted(name[:-4] for name in os.listdir(TABLES) if name.endswith(".ctl"))
        self.assertEqual(tables, sorted(cost))
        for name in tables:
            with self.subTest(name), open(os.path.join(TABLES, name + ".ctl"), encoding="utf-8") as table:
                daemon = self.play(table.read())
                self.focus_works_without(cost[name], daemon)
                if not cost[name]:
                    self.assertIn("autofocus", self.status(daemon)["warnings"][0])
                self.doCleanups()

    def test_pictures(self):
        for code in ("H264", "BGR3", "NV16"):
            with self.subTest(code):
                daemon = self.play(FOCUS, pictures=f"320 240 {code} 30")
                self.focus_works_without("camera", daemon)
                self.assertIsNone(self.info(daemon)["camera"])
                self.doCleanups()

    def test_with_the_pictures_go_exposure_and_gain(self):
        """Those that the device has: nobody can set them any more."""
        light = {"exposure": "009a0902 1 3 2047 1 250 250 0\n", "gain": "00980913 1 0 100 1 10 10 0\n"}
        for parts in ([], ["exposure"], ["gain"], ["exposure", "gain"]):
            with self.subTest(parts):
                table = FOCUS + "".join(light[part] for part in parts)
                daemon = self.play(table, pictures="320 240 H264 30")
                left_out = self.status(daemon)["leftOut"]
                self.assertEqual([one["part"] for one in left_out], ["camera", *parts])
                for one in left_out[1:]:
                    self.assertEqual(one["reason"], "it describes the pictures, which are left out")
                    self.assertIn(f"without {one['part']}: {one['reason']}", daemon.lensctl("status").stdout)
                self.assertEqual(self.info(daemon)["leftOut"], left_out)
                self.assertEqual(daemon.lensctl("focus", "@100").returncode, 0)
                self.doCleanups()

    def test_a_lens_of_which_only_the_camera_works(self):
        daemon = self.play(FOCUS.replace("0 250", "250 0"))
        status, info = self.status(daemon), self.info(daemon)
        self.assertEqual((status["connection"], status["axes"], info["axes"]), ("connected", [], []))
        self.assertEqual(status["leftOut"][0]["part"], "focus")
        self.assertEqual(info["camera"]["widthPx"], 320)
        shown = daemon.lensctl("snapshot", "-o", os.path.join(self.folder.name, "picture.png"))
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertEqual(daemon.lensctl("focus", "@100").returncode, 8)  # unsupported

    def test_reload_looks_again(self):
        """What failed may work by now; what is no use by what the device says of itself is not worth a disturbance."""
        def zoom(daemon):
            return [axis["axis"] for axis in self.info(daemon)["axes"]]

        for broken, regains in (("009a090d 1 100 400 1 100 100 0 geterr 32\n", True), (ZOOM_REVERSED, False)):
            daemon = self.play(FOCUS + broken)
            self.assertEqual(zoom(daemon), ["focus"])
            with open(os.path.join(self.folder.name, "table.ctl"), "w", encoding="utf-8") as table:
                table.write(FOCUS + "009a090d 1 100 400 1 100 100 0\n")
            reloaded = json.loads(daemon.lensctl("reload", "--json").stdout)
            self.assertEqual(reloaded["reopened" if regains else "unchanged"], ["cam"])
            self.assertEqual(daemon.lensctl("focus", "@50").returncode, 0)
            self.assertEqual(zoom(daemon), ["focus", "zoom"] if regains else ["focus"])
            self.assertEqual(len(self.status(daemon)["leftOut"]), 0 if regains else 1)
            self.doCleanups()

    def test_doctor(self):
        daemon = self.play(FOCUS + ZOOM_REVERSED)
        said = "zoom is left out: " + self.status(daemon)["leftOut"][0]["reason"]
        self.assertIn(said, daemon.lensctl("doctor").stdout)
        findings = json.loads(daemon.lensctl("doctor", "--json").stdout)
        self.assertIn(("lens cam", "warning", said), [(one["check"], one["status"], one["message"]) for one in findings])

    def test_nothing_left(self):
        daemon = self.play(FOCUS.replace("0 250", "250 0") + ZOOM_REVERSED, pictures="320 240 H264 30")
        status = self.status(daemon)
        self.assertFalse(status["connected"])
        for said in ("focus (", "zoom (", "camera (", "from 500 to 100"):
            self.assertIn(said, status["error"])

    def test_what_the_configuration_names_is_an_error_with_its_line(self):
        for more, line in (("[lens.zoom]\ntolerance = 2\n", 7), ("[lens.zoom]\nlimits = [100, 200]\n", 7),
                           ("zoom_scale = 2.0\n", 7), ("[lens.focus]\ntolerance = 9\n[lens.zoom]\npark = 100\n", 9)):
            with self.subTest(more):
                daemon = self.play(FOCUS + ZOOM_REVERSED, more=more)
                status = self.status(daemon)
                self.assertFalse(status["connected"])
                self.assertIn(f"lensd.toml:{line}: ", status["error"])
                self.assertIn("zoom", status["error"])
                self.assertIn("from 500 to 100", status["error"])
                self.assertEqual(daemon.lensctl("focus", "@100").returncode, 69)
                self.doCleanups()
        with self.subTest("pictures of a size"):
            daemon = self.play(FOCUS, pictures="320 240 H264 30", more="width = 320\nheight = 240\n")
            self.assertIn("picture format", self.status(daemon)["error"])

    def test_an_axis_that_the_lens_does_not_have_is_an_error_with_its_line(self):
        for axis, key in (("zoom", "limits = [1, 9]"), ("iris", "tolerance = 2"), ("filter", "settle_ms = 5")):
            with self.subTest(axis):
                status = self.status(self.play(FOCUS, more=f"[lens.{axis}]\n{key}\n"))
                self.assertFalse(status["connected"])
                self.assertIn("lensd.toml:7: ", status["error"])
                self.assertIn(f"this lens has no {axis}", status["error"])
                self.doCleanups()

    def test_check_config_says_it_and_is_content(self):
        path = os.path.join(self.folder.name, "lensd.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.config())
        checked = subprocess.run([os.path.join(BIN, "lensd"), "--check-config", "--config", path], capture_output=True,
                                 text=True, check=False, timeout=60,
                                 env={**os.environ, **self.environment(FOCUS + ZOOM_REVERSED), "LD_PRELOAD": self.library})
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertIn("zoom is left out: ", checked.stderr)
        self.assertIn("from 500 to 100", checked.stderr)


if __name__ == "__main__":
    unittest.main()
