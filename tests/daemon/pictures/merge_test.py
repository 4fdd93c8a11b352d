"""lensctl stack --merge and lensctl merge: depth against the scene's own formula, pictures that grow as the lens moves, and what
cannot be merged. Reads PNG files by a reader of its own."""
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bench import rows_of  # noqa: E402
from harness import BIN, HERE, PATIENCE, DaemonTest  # noqa: E402

U0, UX = 1.9, 0.5  # vergence of the tilted plane across the frame
WIDTH, HEIGHT, PIXEL_M, F, N = 320, 240, 3.45e-6, 0.025, 8.0
SCENE = f"""version = 1
[camera]
width = {WIDTH}
height = {HEIGHT}
pixel_um = {PIXEL_M * 1e6}
bits = 10
colour = COLOUR
full_well_e = 10000
read_noise_e = 3
exposure_ms = 2
frame_rate_hz = 100
[lens]
model = "thin"
focal_length_mm = {F * 1e3}
f_number = [2.0, 16.0]
extension_mm = [0.0, 2.0]
steps = 4001
speed_steps_per_s = 20000
acceleration_steps_per_s2 = 1000000
settle_ms = 5
iris_steps = 100
initial_f_number = {N}
telecentric = TELECENTRIC
[[surface]]
kind = "plane"
vergence_d = [{U0}, {UX}, 0.0]
texture = "{HERE}/../../scenes/score/ground.png"
texture_px_per_image_px = 1.0
"""
STACK = ("--sharp", f"{U0 - UX:.2f}D..{U0 + UX:.2f}D:2px", "--f-number", str(N), "--json")


def samples_of(path):
    """Rows of 16-bit grey samples."""
    with open(path, "rb") as file:
        return [[row[2 * i] << 8 | row[2 * i + 1] for i in range(WIDTH)] for row in rows_of(file.read())]


class Merge(DaemonTest):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory(prefix="lensd-merge-")
        cls.config = "version = 1\n"
        for lens, telecentric, colour in (("grows", "false", "false"), ("keeps", "true", "true")):
            with open(cls.path(lens + ".toml"), "w", encoding="utf-8") as file:
                file.write(SCENE.replace("TELECENTRIC", telecentric).replace("COLOUR", colour))
            cls.config += f'[[lens]]\nname = "{lens}"\ndriver = "sim"\nscene = "{cls.path(lens)}.toml"\n'
        super().setUpClass()
        cls.answers = {}
        for lens in ("grows", "keeps"):
            done = cls.daemon.lensctl("stack", lens, *STACK, "-o", cls.path(lens), "--merge", cls.path(lens + "-sharp.png"),
                                      "--depth", cls.path(lens + "-depth.png"))
            assert done.returncode == 0, done.stderr
            cls.answers[lens] = json.loads(done.stdout)

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.work.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.work.name, name)

    def merge(self, status, *words):
        done = self.daemon.lensctl("merge", *words, cwd=self.work.name)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def refused(self, status, says, *words):
        self.assertIn(says, self.merge(status, *words).stderr)

    def copy(self, name):
        shutil.rmtree(self.path(name), ignore_errors=True)
        return shutil.copytree(self.path("grows"), self.path(name))

    def change(self, folder, old, new):
        """In every frame's notes, without changing their length."""
        for name in os.listdir(folder):
            with open(os.path.join(folder, name), "r+b") as file:
                data = file.read()
                self.assertIn(old, data)
                file.seek(0)
                file.write(data.replace(old, new))

    def test_depth_is_that_of_the_scene(self):
        for lens, answer in self.answers.items():
            frames = [shot["frame"] for shot in answer["shots"]]
            self.assertGreater(len(frames), 6)
            largest = max(1 + frame["extensionMm"] / (F * 1e3) for frame in frames) if lens == "grows" else 1.0
            known = within = 0
            for row in samples_of(self.path(lens + "-depth.png"))[8:-8]:
                for x in range(8, WIDTH - 8):
                    if row[x] == 0:
                        continue
                    across = ((x + 0.5) / WIDTH - 0.5) / largest
                    off = abs(1000 / row[x] - (U0 + UX * 2 * across))
                    half_depth = 2 * PIXEL_M * N / (F * F * (1 + max(f["extensionMm"] for f in frames) / (F * 1e3)))
                    known += 1
                    within += off <= half_depth
            print(f"{lens}: {len(frames)} frames, {known / WIDTH / HEIGHT:.3f} known, {within / known:.4f} of it within half a depth")
            self.assertGreater(known, 0.7 * WIDTH * HEIGHT)
            self.assertGreater(within, 0.98 * known)

    def test_the_lens_says_how_its_pictures_grow(self):
        for lens, law in (("grows", "lens"), ("keeps", "lens-telecentric")):
            merged = self.answers[lens]["merged"]
            self.assertEqual((merged["alignedBy"], merged["order"]), (law, "vergence"), merged)
            self.assertLess(merged["misfitPx"], 1.5)
            self.assertEqual(len(merged["frames"]), len(self.answers[lens]["shots"]))
        growth = self.answers["grows"]["merged"]["frames"][-1]["magnification"]
        self.assertAlmostEqual(growth, 1.028, delta=0.01)

    def test_colour_is_kept(self):
        for lens, kind in (("grows", 0), ("keeps", 2)):
            with open(self.path(lens + "-sharp.png"), "rb") as file:
                self.assertEqual((file.read(26)[24:26]), bytes((16, kind)))

    def test_a_plan_is_made_from_the_depth_that_was_measured(self):
        done = self.daemon.lensctl("plan", "--focal-length", "25mm", "--f-number", "2..16", "--extension", "0mm..2mm", "--pixel", "3.45um",
                                   "--depth-map", self.path("grows-depth.png"), "--sharp", "@1:12px", "--json")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        limit = json.loads(done.stdout)["limits"][0]
        self.assertAlmostEqual(limit["nearD"], U0 + UX, delta=0.15)
        self.assertAlmostEqual(limit["farD"], U0 - UX, delta=0.15)

    def test_frames_that_were_taken_before_give_the_same_again(self):
        told = self.merge(0, "grows", "-o", "again.png", "--depth", "again-depth.png").stdout
        self.assertIn(f"{len(self.answers['grows']['shots'])} frames from ", told)
        for again, first in (("again.png", "grows-sharp.png"), ("again-depth.png", "grows-depth.png")):
            with open(self.path(again), "rb") as a, open(self.path(first), "rb") as b:
                data = a.read()
                self.assertEqual(data, b.read())
                self.assertIn(b'lensd:MergedFrames="', data)

    def test_merged_pictures_in_the_folder_are_no_frames(self):
        folder = self.copy("mixed")
        shutil.copy(self.path("grows-sharp.png"), folder)
        merged = json.loads(self.merge(0, "mixed", "-o", "m.png", "--json").stdout)
        self.assertEqual(len(merged["frames"]), len(self.answers["grows"]["shots"]))

    def test_near_is_preferred_on_request(self):
        self.merge(0, "grows", "-o", "near.png", "--prefer", "near")
        self.refused(64, "--prefer", "grows", "-o", "near.png", "--prefer", "far")

    def test_without_calibration_there_is_a_picture_and_no_depth(self):
        folder = self.copy("native")
        self.change(folder, b" lensd:VergenceD=", b" lensd:XergenceD=")
        merged = json.loads(self.merge(0, "native", "-o", "n.png", "--json").stdout)
        self.assertEqual((merged["order"], merged["frames"][0]["vergenceD"]), ("position", None))
        self.refused(65, "lensctl calibrate", "native", "-o", "n.png", "--depth", "d.png")
        self.refused(65, "--prefer near", "native", "-o", "n.png", "--prefer", "near")
        self.assertFalse(os.path.exists(self.path("d.png")))

    def test_pictures_of_others_are_merged_by_name_and_laid_over_each_other_as_they_grow(self):
        folder = self.copy("foreign")
        self.change(folder, b"urn:io.lensd.Lens:1.0/", b"urn:io.other.Lens:1.0/")
        merged = json.loads(self.merge(0, "foreign", "-o", "f.png", "--json").stdout)
        self.assertEqual((merged["order"], merged["alignedBy"]), ("name", "pictures"))
        names = [int(re.findall(r"\d+", os.path.basename(frame["file"]))[0]) for frame in merged["frames"]]
        self.assertEqual(names, list(range(1, len(names) + 1)))
        self.assertAlmostEqual(merged["frames"][-1]["magnification"],
                               self.answers["grows"]["merged"]["frames"][-1]["magnification"], delta=0.003)

    def test_what_is_no_stack_is_refused(self):
        folder = self.copy("gap")
        os.remove(os.path.join(folder, "shot-3.png"))
        self.refused(66, "shot-3.png is missing", "gap", "-o", "x.png")
        left = [os.path.join("gap", f"shot-{i}.png") for i in (1, 2, 4, 5)]
        self.merge(0, *left, "-o", "x.png")
        self.refused(66, "nothing.png", "grows/shot-1.png", "nothing.png", "-o", "x.png")
        self.refused(66, "nowhere", "nowhere", "-o", "x.png")
        self.refused(65, "at least two", "grows/shot-1.png", "-o", "x.png")
        self.refused(65, "same focus", "grows/shot-1.png", "grows/shot-1.png", "-o", "x.png")
        self.refused(65, "not a PNG", "grows/shot-1.png", "grows.toml", "-o", "x.png")
        self.refused(65, "different lenses", "grows/shot-1.png", "keeps/shot-2.png", "-o", "x.png")
        self.refused(64, "let its name end in .png", "grows", "-o", "x.jpg")
        self.refused(64, "say what to make", "grows")
        for wrong in (("--merge", "x.jpg"), ("--prefer", "near")):  # before anything moves
            done = self.daemon.lensctl("stack", "grows", *STACK[:-1], "-o", self.path("never"), *wrong)
            self.assertEqual((done.returncode, os.path.exists(self.path("never"))), (64, False), done.stderr)
        self.refused(73, "/proc/nothing", "grows", "-o", "/proc/nothing/x.png")
        for words in (("focus", "grows", "5m"), ("snapshot", "grows", "--scale-to", "160x120", "-o", os.path.join(folder, "shot-3.png"))):
            done = self.daemon.lensctl(*words)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.refused(65, "160x120", "gap", "-o", "x.png")

    def test_control_c_leaves_what_was_taken(self):
        folder = self.path("stopped")
        stack = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "stack", "grows", *STACK[:-1], "-o", folder,
                                  "--merge", self.path("stopped.png")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 30 * PATIENCE
        while not os.path.exists(os.path.join(folder, "shot-2.png")):
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.002)
        stack.send_signal(signal.SIGINT)
        _, errors = stack.communicate(timeout=30 * PATIENCE)
        self.assertIn(stack.returncode, (130, -signal.SIGINT), errors)
        self.assertFalse(os.path.exists(self.path("stopped.png")))
        self.merge(0, "stopped", "-o", "stopped.png")


if __name__ == "__main__":
    unittest.main()
