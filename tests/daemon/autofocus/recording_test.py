"""Autofocus that leaves a picture of its search behind, or its frames: `--plot`, `--record`, and what a replay makes of them."""
import base64
import json
import os
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import autofocus_test  # noqa: E402
from harness import BIN, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402


def detail(pixels, width):
    """Mean square of what neighbours in a row differ by."""
    steps = [(a - b) ** 2 for i, (a, b) in enumerate(zip(pixels, pixels[1:])) if (i + 1) % width]
    return sum(steps) / len(steps)


def picture(folder, frame):
    """Width and grey bytes of a recorded frame."""
    with open(os.path.join(folder, frame["file"]), "rb") as file:
        width, _, pixels = autofocus_test.grey_of_png(file.read())
    return width, pixels


class Recording(DaemonTest):

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(config=autofocus_test.CONFIG)

    def setUp(self):
        self.move(500)

    def move(self, position):
        with self.daemon.client() as client:
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": position}})

    def recorded(self, *arguments):
        """A run that is recorded into a folder that is there until the test ends: its result, run.json and the folder."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        record = os.path.join(folder.name, "run")
        self.move(500)
        ran = self.daemon.lensctl("--json", "autofocus", "a", "--record", record, *arguments)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""), ran)
        with open(os.path.join(record, "run.json"), encoding="utf-8") as file:
            return json.loads(ran.stdout), json.load(file), record

    def test_a_search_is_drawn_frame_by_frame_with_its_answer(self):
        with tempfile.TemporaryDirectory() as folder:
            chart = os.path.join(folder, "run.svg")
            ran = self.daemon.lensctl("--json", "autofocus", "a", "--plot", chart)
            self.assertEqual(ran.returncode, 0, ran)
            result = json.loads(ran.stdout)
            drawn = xml.etree.ElementTree.parse(chart).getroot()
        texts = ["".join(text.itertext()) for text in drawn.iter("{http://www.w3.org/2000/svg}text")]
        for number in autofocus_test.used_frames(result):
            self.assertIn(str(number), texts)
        self.assertTrue(any(text.startswith("focus: 1.1") and "sigma" in text for text in texts), texts)
        self.assertTrue(any(f"in {result['frames']} frames" in text for text in texts), texts)

    def test_the_folder_holds_the_frames_of_the_run_and_nothing_else(self):
        result, run, folder = self.recorded()
        self.assertEqual(run["result"], result)
        self.assertEqual([frame["frame"] for frame in run["frames"]], autofocus_test.used_frames(result))
        self.assertEqual([frame["position"] for frame in run["frames"]], [each["position"] for each in result["samples"]])
        self.assertEqual(set(os.listdir(folder)), {"run.json"} | {frame["file"] for frame in run["frames"]})
        width, first = picture(folder, run["frames"][0])
        last = picture(folder, run["frames"][-1])[1]
        self.assertGreater(detail(last, width), 1.5 * detail(first, width))  # blurred, and in focus
        ran = self.daemon.lensctl("autofocus", "a", "--record", folder)
        self.assertEqual(ran.returncode, 73, ran)
        self.assertIn("not empty", ran.stderr)

    @unittest.skipUnless(os.path.exists(os.path.join(BIN, "lens-bench")), "no lens-bench in this build")
    def test_a_replay_of_the_frames_is_the_run_again(self):
        result, run, folder = self.recorded()
        ran = subprocess.run([os.path.join(BIN, "lens-bench"), "autofocus", "--replay", folder, "--method", "auto", "--json"],
                             capture_output=True, text=True, timeout=120 * PATIENCE, check=False)
        self.assertEqual(ran.returncode, 0, ran)
        replayed = json.loads(ran.stdout)[0]
        self.assertTrue(replayed["focused"], replayed)
        self.assertEqual((replayed["frames"], replayed["elsewhere"]), (len(autofocus_test.used_frames(result)), 0), replayed)
        self.assertAlmostEqual(replayed["at"], run["frames"][-1]["extensionMm"], places=9)

    def test_frames_of_a_command_are_recorded_with_their_gamma(self):
        take = f"{os.path.join(BIN, 'lensctl')} --socket {self.daemon.socket} snapshot a -o $LENSD_FRAME >/dev/null"
        result, run, _ = self.recorded("--frames-from", take, "--pixel", "3.45um", "--gamma", "2.2", "--range", "@2500..@3500")
        self.assertEqual([frame["frame"] for frame in run["frames"]], autofocus_test.used_frames(result))
        self.assertEqual({frame["gamma"] for frame in run["frames"]}, {2.2})
        self.assertEqual(run["regions"], [{"x": 0.4, "y": 0.4, "w": 0.2, "h": 0.2}])

    def test_frames_that_are_left_out_keep_their_numbers(self):
        with tempfile.TemporaryDirectory() as folder:
            count, last, chart = (os.path.join(folder, name) for name in ("count", "last.png", "run.svg"))
            # Each third picture is the one before once more.
            take = (f"n=$(($(cat {count} 2>/dev/null) + 1)); echo $n >{count}; if [ $((n % 3)) = 0 ]; then cp {last} $LENSD_FRAME; "
                    f"else {os.path.join(BIN, 'lensctl')} --socket {self.daemon.socket} snapshot a -o $LENSD_FRAME >/dev/null && "
                    f"cp $LENSD_FRAME {last}; fi")
            record = os.path.join(folder, "run")
            ran = self.daemon.lensctl("--json", "autofocus", "a", "--record", record, "--plot", chart, "--frames-from", take,
                                      "--pixel", "3.45um", "--gamma", "2.2", "--range", "@2500..@3500")
            self.assertIn(ran.returncode, (0, 1), ran)
            result = json.loads(ran.stdout)
            used = autofocus_test.used_frames(result)
            self.assertIn(3, [frame["frame"] for frame in result["framesLeftOut"]])
            with open(os.path.join(record, "run.json"), encoding="utf-8") as file:
                run = json.load(file)
            self.assertEqual([frame["frame"] for frame in run["frames"]], used)
            self.assertEqual(set(os.listdir(record)), {"run.json"} | {f"{number:04d}.png" for number in used})
            drawn = xml.etree.ElementTree.parse(chart).getroot()
        texts = ["".join(text.itertext()) for text in drawn.iter("{http://www.w3.org/2000/svg}text")]
        sharpest = max(result["samples"], key=lambda sample: sample["score"])
        self.assertIn(str(sharpest["frame"]), texts)

    def test_what_cannot_be_drawn_or_recorded_is_refused_before_anything_moves(self):
        for arguments, says in ((("--plot", "run.jpg"), "end in .svg or .png"), (("--plot", "run"), "end in .svg or .png"),
                                (("--track", "--plot", "run.svg"), "--track"), (("--track", "--record", "run"), "--track"),
                                (("--gamma", "2.2"), "--gamma describes the pictures of --frames-from")):
            ran = self.daemon.lensctl("autofocus", "a", *arguments)
            self.assertEqual(ran.returncode, 64, ran)
            self.assertIn(says, ran.stderr)
        self.assertEqual(self.position()["position"], 500)

    def test_the_same_frame_again_is_named_as_that(self):
        with self.daemon.client(60 * PATIENCE) as client:
            client.send(LENS + "Snapshot", {"lens": "a"}, more=True)
            png, reply = b"", {"continues": True}
            while reply.get("continues"):
                reply = client.receive()
                png += base64.b64decode(reply["parameters"]["data"])
            width, height, pixels = autofocus_test.grey_of_png(png)
            answer = client.call(LENS + "AutofocusBegin", {"lens": "a", "pixelUm": 3.45})["parameters"]
            session = answer["session"]
            while "next" in answer:
                now = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
                reply = client.call(LENS + "AutofocusFrame", {
                    "session": session, "widthPx": width, "heightPx": height // 4, "format": "mono8", "exposureStartNs": now,
                    "exposureEndNs": now, "data": base64.b64encode(pixels[:width * (height // 4)]).decode()})
                self.assertNotIn("error", reply)
                answer = reply["parameters"]
        self.assertEqual((answer["autofocus"]["focused"], answer["autofocus"]["cause"]), (False, "sameFrame"))
        self.assertIn("the same frame was sent twice", answer["autofocus"]["reason"])


if __name__ == "__main__":
    unittest.main()
