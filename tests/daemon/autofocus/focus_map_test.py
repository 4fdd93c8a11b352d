"""focus-map: through lensctl and over the socket, on lenses whose tilt the scene file says."""
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402

TEXTURE = os.path.realpath(os.path.join(HERE, "..", "..", "scenes", "textures", "gravel.png"))
CAMERA = """version = 1
[camera]
width = 240
height = 180
pixel_um = 5.0
full_well_e = 10000
read_noise_e = 3
exposure_ms = 2
frame_rate_hz = 100
[lens]
focal_length_mm = 25
f_number = [2, 16]
initial_f_number = 2
extension_mm = [0.3, 0.9]
steps = 2048
speed_steps_per_s = %d
acceleration_steps_per_s2 = 400000
settle_ms = 2
"""
WALL = f"""[[surface]]
kind = "wall"
distance_m = 1.0
texture = "{TEXTURE}"
"""
BLANK = """[[surface]]
kind = "wall"
distance_m = 0.9
constant = 0.5
"""
# At the frame's edges a lens of 25 mm needs 25^2 U/(1000 - 25 U) mm of extension, U being 1.02 and 0.98 D, and 0.988 and 1.012 D.
TURNED = f"""[[surface]]
kind = "plane"
vergence_d = [1.0, 0.02, -0.012]
texture = "{TEXTURE}"
"""
ACROSS_UM, DOWN_UM = ((625e3 * low / (1000 - 25 * low) - 625e3 * high / (1000 - 25 * high)) for low, high in ((1.02, 0.98), (0.988, 1.012)))
SCENES = {
    "tilted": CAMERA % 40000 + TURNED,
    "patchy": CAMERA % 40000 + WALL + BLANK + "region = [0.14, 0.18, 0.32, 0.39]\n",
    "blank": CAMERA % 40000 + BLANK,
    "slow": CAMERA % 400 + WALL,
}


class FocusMap(DaemonTest):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        config = "version = 1\n"
        for name, text in SCENES.items():
            path = os.path.join(cls.folder.name, name + ".toml")
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            config += f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{path}"\n'
        cls.daemon = Daemon(config=config)

    def lensctl(self, *arguments, status=0):
        done = self.daemon.lensctl("focus-map", *arguments)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def test_the_tilt_is_that_of_the_scene(self):
        done = self.lensctl("tilted", "--json")
        self.assertEqual(done.stdout.count("\n"), 1)
        found = json.loads(done.stdout)
        self.assertTrue(found["mapped"])
        self.assertEqual((found["cause"], found["columns"], found["rows"], len(found["cells"])), ("found", 5, 4, 20))
        surface = found["surface"]
        for tilt, rise, side_um in ((surface["across"], ACROSS_UM, 1200), (surface["down"], DOWN_UM, 900)):
            self.assertLess(abs(tilt["riseUm"] - rise), 4 * tilt["sigmaUm"])
            self.assertLess(tilt["sigmaUm"], 2.5)
            self.assertAlmostEqual(tilt["sensorDeg"], math.degrees(math.atan(tilt["riseUm"] / side_um)), places=3)
            # The target's distance is 1 m, the sensor's 1/39 m.
            self.assertAlmostEqual(tilt["targetDeg"], math.degrees(math.atan(39 * tilt["riseUm"] / side_um)), delta=1)
        self.assertLess(abs(surface["curvatureUm"]), 4 * surface["curvatureSigmaUm"])
        self.assertEqual(self.position("tilted")["position"], found["position"])
        middle = [cell["extensionUm"] for cell in found["cells"]]
        # Least out of focus as a whole: as far off on either side.
        self.assertAlmostEqual(max(middle), -min(middle), delta=6)
        self.assertAlmostEqual(found["cells"][0]["x"], 0.1)
        self.assertAlmostEqual(found["cells"][19]["y"], 0.875)

    def test_people_are_told_what_to_move(self):
        text = self.lensctl("tilted", "--grid", "3x3", "--mount", "40mm").stdout
        for words in ("9 of 9 regions", "best focus at the right edge", "best focus at the upper edge", "of the sensor about its vertical axis",
                      "sensor: move its left edge, seen from behind the camera", "or mount: a shim of", "or target: turn it by",
                      "its right edge away from the camera", "turn the target by half a turn", "curvature: none beyond its error"):
            self.assertIn(words, text)
        text = self.lensctl("patchy").stdout
        for words in ("19 of 20 regions", "left out: column 2, row 2: nothing in the region changes with focus", "none beyond its error"):
            self.assertIn(words, text)
        self.assertNotIn("shim", text)

    def test_an_earlier_map_tells_what_a_change_did(self):
        before = os.path.join(self.folder.name, "before.json")
        map_before = json.loads(self.lensctl("tilted", "--json").stdout)
        # As if the target had hung the other way round, and the field had been flatter.
        for side in ("across", "down"):
            map_before["surface"][side]["riseUm"] *= -1
        map_before["surface"]["curvatureUm"] = -400
        with open(before, "w", encoding="utf-8") as file:
            json.dump(map_before, file)
        turned = json.loads(self.lensctl("tilted", "--json", "--before", before, "--turned").stdout)["turned"]
        self.assertLess(abs(turned["across"]["cameraUm"]), 4 * turned["across"]["sigmaUm"])
        self.assertLess(abs(turned["across"]["targetUm"] - ACROSS_UM), 4 * turned["across"]["sigmaUm"])
        probe = json.loads(self.lensctl("tilted", "--json", "--before", before, "--moved", "2mm").stdout)["probe"]
        self.assertAlmostEqual(probe["gain"], 0.2, delta=4 * probe["gainSigma"])
        text = self.lensctl("tilted", "--before", before, "--moved", "2mm").stdout
        self.assertIn("of the move", text)
        map_before["surface"]["curvatureUm"] = 0
        with open(before, "w", encoding="utf-8") as file:
            json.dump(map_before, file)
        self.assertIn("no advice", self.lensctl("tilted", "--before", before, "--moved", "2mm").stdout)
        for arguments, status, words in ((("--before", before), 64, "--turned"), (("--turned",), 64, "--before FILE"),
                                         (("--before", before, "--moved", "0mm"), 64, "not 0"),
                                         (("--before", "/no/file", "--turned"), 66, "cannot be read"),
                                         (("--before", TEXTURE, "--turned"), 65, "is no focus map")):
            self.assertIn(words, self.lensctl("tilted", *arguments, status=status).stderr)

    def test_it_is_drawn(self):
        path = os.path.join(self.folder.name, "map.svg")
        self.lensctl("patchy", "--plot", path)
        texts = [text.text for text in xml.etree.ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")]
        for text in ("patchy: best focus over the frame", "noTexture", "column, as in the picture"):
            self.assertIn(text, texts)

    def test_a_refusal_says_why_and_puts_the_lens_back(self):
        self.daemon.lensctl("focus", "blank", "@777")
        done = self.lensctl("blank", status=1)
        self.assertIn("refused, and the lens is back where it was", done.stdout)
        self.assertIn("0 of 20 regions", done.stdout)
        found = json.loads(self.lensctl("blank", "--json", status=1).stdout)
        self.assertEqual((found["mapped"], found["cause"], found["surface"], found["position"]), (False, "noTexture", None, 777))
        self.assertEqual({cell["cause"] for cell in found["cells"]}, {"noTexture"})

    def test_what_makes_no_sense_is_refused_before_anything_moves(self):
        for arguments, status, words in ((("--grid", "5"), 64, "columns and rows"), (("--grid", "1x4"), 64, "from 2 to 12"),
                                         (("--grid", "5x99999999999"), 64, "columns and rows"), (("--mount", "3"), 64, "--mount"),
                                         (("--range", "0.1m..1m"), 6, "0.1 m"), (("--deadline", "1ms"), 6, "too short"),
                                         (("--plot", "a.gif"), 64, ".svg or .png")):
            done = self.lensctl("slow", *arguments, status=status)
            self.assertIn(words, done.stderr)

    def test_progress_and_watchers(self):
        with self.daemon.client(60 * PATIENCE) as watcher, self.daemon.client(60 * PATIENCE) as client:
            self.assertIn("focusMap", client.call(LENS + "List")["parameters"]["features"])
            watcher.send(LENS + "Monitor", {"lens": "patchy"}, more=True)
            client.send(LENS + "FocusMap", {"lens": "patchy", "columns": 2, "rows": 2}, more=True)
            steps = []
            while True:
                reply = client.receive()
                if not reply.get("continues"):
                    break
                steps.append(reply["parameters"]["progress"])
            found = reply["parameters"]["map"]
            numbers = [step["frames"] for step in steps]
            self.assertEqual(numbers, sorted(set(numbers)))
            self.assertLessEqual(numbers[-1], found["frames"])  # a frame that is taken again has no step of its own
            self.assertTrue(all(step["samples"] == [] for step in steps))
            self.assertGreaterEqual(steps[-1]["framesExpected"], found["frames"])
            self.assertIsNone(found["surface"]["curvatureUm"])  # four regions
            while True:
                event = watcher.receive()["parameters"].get("event", {}).get("autofocus")
                if event:
                    break
            self.assertEqual((event["method"], event["focused"]), ("map", True))

    def test_control_c_stops_the_lens(self):
        before = self.position("slow")["position"]
        process = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "focus-map", "slow"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_for(lambda: self.position("slow")["position"] != before)
        with self.daemon.client() as client:
            self.assertEqual(client.call(LENS + "FocusMap", {"lens": "slow"})["error"], LENS + "Busy")
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30 * PATIENCE)
        self.assertEqual(process.returncode, 130, said)
        self.assertIn("slow: ", said)
        with self.daemon.client() as client:
            lens = client.call(LENS + "Status", {"lens": "slow"})["parameters"]["lenses"][0]
            self.assertEqual(lens["activity"], "idle")


if __name__ == "__main__":
    unittest.main()
