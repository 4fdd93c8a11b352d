"""What autofocus teaches lensd of a lens' blur: learned on one region and used on others, after a restart and where the told
f-number is mended; what it does not hold for; another lens; shown, forgotten, kept."""
import json
import os
import statistics
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from autofocus_test import used_frames  # noqa: E402
from harness import BIN, HERE, LENS, Daemon, DaemonTest  # noqa: E402

SIMULATOR = "io.lensd.Simulator."
TEXTURES = os.path.join(HERE, "..", "..", "scenes", "textures")
SCENE = f"""version = 1
[camera]
width = 256
height = 192
exposure_ms = 2
frame_rate_hz = 200
[lens]
f_number = [%g, %g]
extension_mm = [0.0, 1.2]
speed_steps_per_s = 60000
initial_f_number = %g
[[surface]]
kind = "wall"
distance_m = 1.2
texture = "{TEXTURES}/brick.png"
[truth]
region = [0.1, 0.1, 0.8, 0.8]
"""
TOLD = "[lens.optics]\nfocal_length_mm = 25\nf_number = [%g, %g]\nextension_mm = [0, 1.2]\nuse_learned_slope = true\n"
# Where a wall at 1.2 m is in focus, by the thin lens of 25 mm.
EXTENSION_MM = 1e3 / (1 / 0.025 - 1 / 1.2) - 25
WIDEST = 2.8
PIXEL_UM = 3.45
LEFT, RIGHT = {"x": 0.05, "y": 0.1, "w": 0.4, "h": 0.8}, {"x": 0.55, "y": 0.1, "w": 0.4, "h": 0.8}
STARTS = (400, 900, 1300, 2100, 2600, 3300)


class Learned(DaemonTest):
    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        os.mkdir(self.state)
        self.file = os.path.join(self.state, "a.slope.toml")

    def start(self, told=1.0, true=1.0):
        """A lens whose f-numbers are `true` times those of the scene, told `told` times those."""
        scene = os.path.join(self.folder.name, "scene.toml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(SCENE % (true * WIDEST, true * 16, true * WIDEST))
        config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n' + TOLD % (told * WIDEST, told * 16)
        self.widest = true * WIDEST
        self.daemon = Daemon(config=config, arguments=("--state", self.state))
        self.addCleanup(self.daemon.stop)

    def ask(self, call, **parameters):
        with self.daemon.client() as client:
            reply = client.call(call if "." in call else LENS + call, {"lens": "a", **parameters})
        self.assertNotIn("error", reply, reply)
        return reply["parameters"]

    def learned(self):
        return self.ask("GetLearned")["learned"]

    def wait_kept(self, runs):
        """Until so many are on disk."""
        def kept():
            if not os.path.exists(self.file):
                return 0
            with open(self.file, encoding="utf-8") as file:
                return file.read().count("[[run]]")
        self.wait_for(lambda: kept() == runs)

    def off_px(self):
        return abs(self.ask(SIMULATOR + "Truth")["extensionMm"] - EXTENSION_MM) * 1e3 / (self.widest * PIXEL_UM)

    def focus(self, start, region=LEFT, **parameters):
        """An autofocus from there; every answer is held against the truth."""
        self.ask("Move", axis="focus", target={"position": start})
        found = self.ask("Autofocus", region=region, **parameters)["autofocus"]
        self.assertTrue(found["focused"], found)
        self.assertLess(self.off_px(), 4, found)
        return found

    def teach(self, starts=STARTS):
        return [self.focus(start) for start in starts]

    def test_learned_on_one_region_used_on_others_and_after_a_restart(self):
        for told in (0.5, 2.0):
            with self.subTest(told=told):
                self.start(told=told)
                before = self.teach()
                self.assertEqual([run["slope"]["known"] for run in before[:3]], [None] * 3)
                known = self.learned()["known"]
                self.assertAlmostEqual(known["factor"], told, delta=0.1 * told)
                self.assertEqual((known["runs"], self.learned()["reason"]), (len(STARTS), None))
                fresh = [len(used_frames(run)) for run in before[:3]]
                after = [self.focus(start, RIGHT) for start in STARTS]
                for run in after:
                    self.assertFalse(run["slope"]["anotherLens"], run)
                    self.assertAlmostEqual(run["slope"]["known"]["factor"], told, delta=0.1 * told)
                    self.assertAlmostEqual(run["slope"]["shown"], told, delta=0.2 * told)
                frames = [len(used_frames(run)) for run in after]
                print(f"told {told}: {fresh} frames before, {frames} after")
                self.assertLessEqual(statistics.median(frames), statistics.median(fresh))
                self.wait_kept(2 * len(STARTS))
                self.daemon.stop()
                self.start(told=told)
                self.assertEqual(len(self.learned()["runs"]), 2 * len(STARTS))
                again = self.focus(STARTS[0])
                self.assertAlmostEqual(again["slope"]["known"]["factor"], told, delta=0.1 * told)
                # The f-number is mended: what was seen of the lens still holds, and there is nothing to correct.
                self.daemon.stop()
                self.start()
                mended = self.focus(STARTS[1])
                self.assertAlmostEqual(mended["slope"]["known"]["factor"], 1, delta=0.1)
                self.assertFalse(mended["slope"]["anotherLens"])
                self.ask("ForgetLearned")
                self.daemon.stop()

    def test_it_holds_for_one_opening(self):
        self.start(told=0.7)
        self.teach(STARTS[:4])
        self.assertIsNotNone(self.learned()["known"])
        self.assertEqual(self.daemon.lensctl("aperture", "a", "f/4").returncode, 0)
        state = self.learned()
        self.assertIsNone(state["known"])
        self.assertIn("there are 0", state["reason"])
        self.assertEqual({run["holds"] for run in state["runs"]}, {False})
        self.assertIsNone(self.focus(900)["slope"]["known"])
        self.assertEqual(self.daemon.lensctl("aperture", "a", f"f/{0.7 * WIDEST}").returncode, 0)
        self.assertEqual(self.learned()["known"]["runs"], 4)
        self.assertEqual(len(self.learned()["runs"]), 5)

    def test_frames_from_outside_teach_for_themselves(self):
        self.start(told=0.7)
        take = f"{os.path.join(BIN, 'lensctl')} --socket {self.daemon.socket} snapshot a -o $LENSD_FRAME >/dev/null"
        for start in STARTS[:3]:
            self.ask("Move", axis="focus", target={"position": start})
            run = self.daemon.lensctl("autofocus", "a", "--roi", "0.05,0.1,0.4,0.8", "--frames-from", take, "--pixel", f"{PIXEL_UM}um", "--gamma", "2.2")
            self.assertEqual(run.returncode, 0, run)
        state = self.learned()
        self.assertEqual(([run["framesFromOutside"] for run in state["runs"]], [run["holds"] for run in state["runs"]]),
                         ([True] * 3, [True] * 3))
        self.assertEqual(state["known"]["runs"], 3)
        # The lens' own camera has taught nothing yet.
        self.assertIsNone(self.focus(STARTS[3])["slope"]["known"])
        self.assertIsNone(self.learned()["known"])

    def test_another_lens_is_noticed(self):
        self.start()
        self.teach(STARTS[:5])
        self.wait_kept(5)
        self.daemon.stop()
        self.start(true=2.0)
        self.assertEqual(self.learned()["known"]["runs"], 5)
        swapped = self.focus(STARTS[2])
        self.assertTrue(swapped["slope"]["anotherLens"], swapped)
        self.assertAlmostEqual(swapped["slope"]["shown"], 0.5, delta=0.15)
        self.daemon.wait_log("as with another lens")
        state = self.learned()
        self.assertEqual((state["known"], len(state["runs"])), (None, 1))
        for start in STARTS[:3]:
            self.assertFalse(self.focus(start)["slope"]["anotherLens"])
        self.assertAlmostEqual(self.learned()["known"]["factor"], 0.5, delta=0.1)
        self.assertEqual(self.daemon.log().count("as with another lens"), 1)

    def test_it_is_shown_and_forgotten(self):
        self.start()
        with self.daemon.client() as client:
            self.assertIn("learned", client.call(LENS + "List")["parameters"]["features"])
        self.assertEqual(self.learned(), {"lens": "a", "known": None, "runs": [], "lags": [],
                                          "reason": "it takes 3 runs in the present state of the lens, and there are 0"})
        self.teach(STARTS[:3])
        self.wait_for(lambda: os.path.exists(self.file))
        shown = self.daemon.lensctl("learned", "show", "a").stdout
        for words in ("a: a step of focus makes", "times the configured blur", "from 3 runs", "  3  ", "iris at 0"):
            self.assertIn(words, shown)
        found = self.daemon.lensctl("autofocus", "a").stdout
        self.assertIn("times the configured one, as 3 runs have shown", found)
        backup = self.daemon.lensctl("--json", "backup", "--config", self.daemon.config, "--state", self.state,
                                     os.path.join(self.folder.name, "b"))
        self.assertIn("a.slope.toml", json.loads(backup.stdout)["files"], backup.stderr)
        with self.daemon.client() as client:
            client.call(LENS + "TakeLease", {"lens": "a"})
            with self.daemon.client() as other:
                self.assertEqual(other.call(LENS + "ForgetLearned", {"lens": "a"})["error"], LENS + "Leased")
        forgotten = self.daemon.lensctl("learned", "forget", "a")
        self.assertEqual((forgotten.returncode, forgotten.stdout), (0, "forgot its learned blur\n"))
        self.assertEqual((self.learned()["runs"], os.path.exists(self.file)), ([], False))
        self.assertIn("the configured blur is used; it takes 3 runs", self.daemon.lensctl("learned", "show").stdout)
        self.assertIsNone(self.focus(900)["slope"]["known"])

    def test_a_file_that_cannot_be_read_is_kept(self):
        with open(self.file, "w", encoding="utf-8") as file:
            file.write("version = 1\n[[run]]\nlog_factor = sharp\n")
        self.start()
        self.assertIn("a.slope.toml", str(self.ask("Status")["lenses"][0]["warnings"]))
        self.assertTrue(os.path.exists(self.file + ".damaged"))
        self.teach(STARTS[:3])
        state = self.learned()
        self.assertEqual(state["known"]["runs"], 3)  # it learns all the same
        self.assertIn("a.slope.toml", state["reason"])
        with open(self.file, encoding="utf-8") as file:
            self.assertIn("sharp", file.read())
        self.assertEqual(self.daemon.lensctl("learned", "forget").returncode, 0)
        self.assertTrue(os.path.exists(self.file + ".damaged"))
        self.assertFalse(os.path.exists(self.file))
        self.focus(900)
        self.wait_for(lambda: os.path.exists(self.file))

    def test_searches_that_show_no_blur_teach_nothing(self):
        self.start()
        self.focus(900, method="sweep")
        self.assertEqual(self.learned()["runs"], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
