"""Autofocus with frames that the client takes: a session over the socket, fed with pictures that `Snapshot` took."""
import base64
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402

SCENE = os.path.join(HERE, "..", "..", "scenes", "tune", "brick.toml")
CONFIG = f"""version = 1
[[lens]]
name = "a"
driver = "sim"
scene = "{SCENE}"
[[lens]]
name = "b"
driver = "sim"
scene = "{SCENE}"
"""


def grey_of_png(png):
    """Width, height and bytes of an 8-bit grey PNG, by the specification."""
    width, height, bits, colour = struct.unpack(">IIBB", png[16:26])
    assert (bits, colour) == (8, 0)
    packed, at = b"", 8
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        if kind == b"IDAT":
            packed += png[at + 8:at + 8 + length]
        at += 12 + length
    data, rows, before = zlib.decompress(packed), [], bytearray(width)
    for y in range(height):
        kind, row = data[y * (width + 1)], bytearray(data[y * (width + 1) + 1:(y + 1) * (width + 1)])
        for x in range(width):
            left, up, corner = (row[x - 1] if x else 0), before[x], (before[x - 1] if x else 0)
            guess = left + up - corner
            paeth = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
            row[x] = (row[x] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        rows.append(bytes(row))
        before = row
    return width, height, b"".join(rows)


def used_frames(result):
    """Numbers of the frames that the search used. All others are in `framesLeftOut`, each once; samples are the newest 1000."""
    used = sorted({sample["frame"] for sample in result["samples"]})
    left_out = [frame["frame"] for frame in result.get("framesLeftOut", ())]
    assert sorted(used + left_out) == list(range(1, result["frames"] + 1)), result
    return used


class Session(DaemonTest):

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(config=CONFIG)

    def begin(self, client, **parameters):
        reply = client.call(LENS + "AutofocusBegin", {"lens": "a", **parameters})
        self.assertIn("session", reply["parameters"], reply)
        return reply["parameters"]["session"], reply["parameters"]["next"]

    def snapshot(self):
        """Pixels of one frame with its exposure, as a client with a camera of its own would have them."""
        with self.daemon.client(60 * PATIENCE) as client:
            client.send(LENS + "Snapshot", {"lens": "a"}, more=True)
            png, frame, reply = b"", None, {"continues": True}
            while reply.get("continues"):
                reply = client.receive()
                frame = reply["parameters"].get("frame") or frame
                png += base64.b64decode(reply["parameters"]["data"])
        return (*grey_of_png(png), frame)

    def move(self, native):
        with self.daemon.client() as client:
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": native}})

    def activity(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["activity"]

    def frame_call(self, client, session, fraction=(0.4, 0.4, 0.2, 0.2), late=None):
        """Sends the region of a snapshot, its first half in a piece before, with gaps between its rows. `late`: pictures
        that come first, in their order."""
        width, height, pixels, info = self.snapshot()
        if late is not None:
            late.append(pixels)
            pixels = late.pop(0)
        x, y = round(fraction[0] * width), round(fraction[1] * height)
        w, h = round(fraction[2] * width), round(fraction[3] * height)
        data = b"".join(pixels[(y + row) * width + x:(y + row) * width + x + w] + b"gap" for row in range(h))
        half = len(data) // 2
        piece = {"session": session, "offset": 0, "data": base64.b64encode(data[:half]).decode()}
        self.assertEqual(client.call(LENS + "AutofocusPixels", piece), {"parameters": {"received": half}})
        return client.call(LENS + "AutofocusFrame", {
            "session": session, "widthPx": w, "heightPx": h, "strideBytes": w + 3, "format": "mono8",
            "exposureStartNs": info["exposureStartNs"], "exposureEndNs": info["exposureEndNs"],
            "data": base64.b64encode(data[half:]).decode()})

    def test_focuses_with_the_pictures_of_a_client(self):
        self.move(500)
        with self.daemon.client(60 * PATIENCE) as client:
            session, step = self.begin(client, pixelUm=3.45)
            self.assertEqual((step["frame"], step["position"]), (1, 500))
            positions = [500]
            reply = {"next": step}
            while "next" in reply:
                answer = self.frame_call(client, session)
                self.assertNotIn("error", answer)
                reply = answer["parameters"]
                if "next" in reply:
                    self.assertEqual(reply["next"]["frame"], len(positions) + 1)
                    positions.append(reply["next"]["position"])
            result = reply["autofocus"]
            self.assertTrue(result["focused"], result)
            self.assertEqual(result["frames"], len(positions))
            used_frames(result)
            self.assertAlmostEqual(result["vergenceD"], 1 / 0.9, delta=0.04)
            print(f"session: {positions}: {result['reason']}")
            # The end was told: the session is over.
            self.assertEqual(client.call(LENS + "AutofocusEnd", {"session": session})["error"], LENS + "InvalidRequest")

    def test_the_lag_of_late_pictures_is_learned_shown_stated_and_forgotten(self):
        def lags():
            shown = [client.call(LENS + "GetLearned", {"lens": "a"})["parameters"]["learned"]["lags"],
                     client.call(LENS + "List")["parameters"]["lenses"][0]["lags"]]
            self.assertEqual(shown[0], shown[1])
            return [lag for lag in shown[0] if lag["pixelUm"] == 3.5]

        with self.daemon.client(60 * PATIENCE) as client:
            for wrong in (-1, 5):
                reply = client.call(LENS + "AutofocusBegin", {"lens": "a", "lagFrames": wrong})
                self.assertEqual(reply["error"], LENS + "InvalidRequest", reply)
                self.assertEqual(reply["parameters"]["parameter"], "lagFrames", reply)
            self.assertEqual(lags(), [])
            self.move(900)
            late = [self.snapshot()[2]]
            for begin in ({}, {}, {"lagFrames": 1}):
                self.move(500)
                session, _ = self.begin(client, pixelUm=3.5, **begin)
                reply = {"next": None}
                while "next" in reply:
                    answer = self.frame_call(client, session, late=late)
                    self.assertNotIn("error", answer)
                    reply = answer["parameters"]
                result = reply["autofocus"]
                print(f"late: {result['frames']} frames, {result['reason']}")
                self.assertTrue(result["focused"], result)
                self.assertEqual(result["lagFrames"], 1)
                self.assertAlmostEqual(result["vergenceD"], 1 / 0.9, delta=0.04)
                self.assertEqual(lags(), [{"framesFromOutside": True, "pixelUm": 3.5, "frames": 1}])
            for arguments in (("learned", "show", "a"), ("list",)):
                self.assertIn("pictures of a client's camera, 3.5 um a pixel: 1 frame late", self.daemon.lensctl(*arguments).stdout)
            client.call(LENS + "ForgetLearned", {"lens": "a"})
            self.assertEqual(lags(), [])

    def test_a_frame_that_is_doubted_for_nothing_is_listed_too(self):
        self.move(500)
        with self.daemon.client(60 * PATIENCE) as client:
            session, step = self.begin(client, pixelUm=3.45)
            reply = {"next": step}
            while "next" in reply:
                width, height, pixels, info = self.snapshot()
                if reply["next"]["frame"] in (2, 3):  # from here on the scene is black for a while
                    pixels = bytes(len(pixels))
                answer = client.call(LENS + "AutofocusFrame", {
                    "session": session, "widthPx": width, "heightPx": height // 4, "format": "mono8",
                    "exposureStartNs": info["exposureStartNs"], "exposureEndNs": info["exposureEndNs"],
                    "data": base64.b64encode(pixels[:width * (height // 4)]).decode()})
                self.assertNotIn("error", answer)
                reply = answer["parameters"]
        result = reply["autofocus"]
        self.assertNotIn(2, used_frames(result))
        self.assertEqual([frame["reason"] for frame in result["framesLeftOut"] if frame["frame"] == 2],
                         ["it was taken twice, since it was in doubt: both frames look the same"])
        self.assertNotIn("both frames look the same", result["reason"])

    def test_the_example_of_the_manual_works(self):
        with open(os.path.join(HERE, "..", "..", "docs", "interface.md"), encoding="utf-8") as file:
            example = file.read().split("```python\n")[1].split("```")[0]
        names = {}
        exec(example.replace("/run/lensd/io.lensd.Lens", self.daemon.socket)  # pylint: disable=exec-used
             .replace('"AutofocusBegin",', '"AutofocusBegin", lens="a", region=dict(x=0.4, y=0.4, w=0.2, h=0.2),'), names)

        def take_frame():
            width, height, pixels, info = self.snapshot()
            return width, height, pixels, info["exposureStartNs"], info["exposureEndNs"]

        self.move(3500)
        result = names["autofocus"](take_frame)
        self.assertTrue(result["focused"], result)
        self.assertAlmostEqual(result["vergenceD"], 1 / 0.9, delta=0.04)

    def test_tracking_ends_on_control_c_and_the_lens_stays(self):
        self.move(500)
        command = [os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "--json", "autofocus", "a", "--track"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as tracker:
            try:
                first = json.loads(tracker.stdout.readline())
                self.assertTrue(first["focused"], first)
                tracker.send_signal(signal.SIGINT)
                out, err = tracker.communicate(timeout=60 * PATIENCE)
            finally:
                tracker.kill()
        self.assertEqual(tracker.returncode, 130, err)
        self.assertEqual(out, "")  # a still scene has one answer
        self.assertRegex(err, r"^tracking ended \(.*\): focused 1 time, refused 0; the lens stays, last answer at "
                              r"position [0-9.]+\n$")
        self.wait_for(lambda: self.activity() == "idle")
        self.assertEqual(self.position()["position"], first["position"])

    def test_a_lens_is_focused_while_it_moves(self):
        self.move(3500)
        ran = self.daemon.lensctl("--json", "autofocus", "a", "--method", "moving")
        result = json.loads(ran.stdout)
        self.assertEqual((ran.returncode, result["method"]), (0, "moving"), ran)
        self.assertAlmostEqual(result["vergenceD"], 1 / 0.9, delta=0.04)
        self.assertLessEqual(result["moves"], 10)  # on a busy machine a slower pass follows

    def test_the_curve_so_far_comes_with_every_frame(self):
        self.move(500)
        with self.daemon.client(60 * PATIENCE) as client:
            client.send(LENS + "Autofocus", {"lens": "a", "method": "sweep", "step": {"relative": 200}}, more=True)
            curves, reply = [], {"continues": True}
            while reply.get("continues"):
                reply = client.receive()
                if progress := reply["parameters"].get("progress"):
                    curves.append([sample["frame"] for sample in progress["samples"]])
                    self.assertEqual(curves[-1][-1], progress["frames"])
        result = reply["parameters"]["autofocus"]
        self.assertTrue(result["focused"], result)
        # A frame in doubt, as any may be, is taken again: it is not part of the curve. A search that begins anew has a new one.
        self.assertEqual(curves[-1], used_frames(result))
        for before, after in zip(curves, curves[1:]):
            self.assertIn(after[:-1], (before, []))
        top = max(result["samples"], key=lambda sample: sample["score"])
        self.assertAlmostEqual(top["position"], result["position"], delta=60)
        self.assertEqual({sample["state"] for sample in result["samples"]}, {"standing"})
        first_pass = [sample["position"] for sample in result["samples"][1:20]]
        self.assertTrue(all(0 < b - a <= 200 for a, b in zip(first_pass, first_pass[1:])), first_pass)
        subject = result["subject"]
        self.assertEqual((subject["region"], subject["foundBy"]), (0, "sharpness"))
        self.assertAlmostEqual(subject["vergenceD"], 1 / 0.9, delta=0.04)
        self.assertAlmostEqual(subject["focalPlaneM"], 1 / subject["vergenceD"], places=9)
        self.assertGreater(subject["sigmaD"], 0)

    def test_a_search_keeps_to_its_range(self):
        self.move(500)
        with self.daemon.client(60 * PATIENCE) as client:
            reply = client.call(LENS + "Autofocus", {
                "lens": "a", "range": {"from": {"distanceM": 0.8}, "to": {"distanceM": 1.1}}})["parameters"]["autofocus"]
            self.assertTrue(reply["focused"], reply)
            self.assertAlmostEqual(reply["vergenceD"], 1 / 0.9, delta=0.04)
            for sample in reply["samples"]:
                self.assertTrue(1 / 1.1 - 0.01 <= sample["vergenceD"] <= 1 / 0.8 + 0.01, sample)
            # A subject that lies elsewhere is a refusal; the lens is back where it was, outside of the range.
            self.move(500)
            reply = client.call(LENS + "Autofocus", {
                "lens": "a", "range": {"from": {"distanceM": 1.4}, "to": {"vergenceD": 0.3}}})["parameters"]["autofocus"]
            self.assertEqual((reply["focused"], reply["cause"], reply["subject"]), (False, "endOfTravel", None), reply)
            self.assertEqual(self.position()["position"], 500)

    def test_what_a_search_cannot_keep_to_is_refused_by_name(self):
        with self.daemon.client(60 * PATIENCE) as client:
            for method in ("Autofocus", "AutofocusBegin"):
                for wrong, error, parameter in (
                        ({"range": {"from": {"position": 10}, "to": {"position": 99999}}}, "OutOfRange", "range.to.position"),
                        ({"range": {"from": {"distanceM": 0.001}, "to": {"position": 9}}}, "OutOfRange", "range.from.distanceM"),
                        ({"range": {"from": {}, "to": {"position": 9}}}, "InvalidRequest", "range.from"),
                        ({"range": {"from": {"position": 9}, "to": {"position": 9}}}, "InvalidRequest", "range"),
                        ({"step": {"relative": 0.2}}, "OutOfRange", "step.relative"),
                        ({"step": {"relative": -5}}, "InvalidRequest", "step.relative"),
                        ({"step": {"extensionUm": 1e6}}, "OutOfRange", "step.extensionUm"),
                        ({"step": {"relative": 5, "blurPx": 5}}, "InvalidRequest", "step"),
                        ({"step": {"blurPx": 5}, "method": "defocus"}, "InvalidRequest", "step"),
                        ({"deadlineMs": 3600001}, "InvalidRequest", "deadlineMs"),
                        ({"deadlineMs": 0}, "InvalidRequest", "deadlineMs")):
                    answer = client.call(LENS + method, {"lens": "a", **wrong})
                    self.assertEqual((answer.get("error"), answer["parameters"].get("parameter")),
                                     (LENS + error, parameter), (wrong, answer))
            answer = client.call(LENS + "Autofocus", {"lens": "a", "deadlineMs": 20})
            self.assertEqual((answer.get("error"), answer["parameters"]["parameter"]), (LENS + "OutOfRange", "deadlineMs"))
            self.assertGreater(answer["parameters"]["minimum"], 20)
            self.assertIn("whole range", answer["parameters"]["message"])

    def test_lensctl_says_how_long_where_and_how_finely(self):
        self.move(500)
        ran = self.daemon.lensctl("--json", "autofocus", "a", "--range", "@1000..@3000", "--step", "12px", "--deadline", "60s")
        self.assertEqual(ran.returncode, 0, ran)
        result = json.loads(ran.stdout)
        self.assertEqual(result["method"], "sweep")
        for sample in result["samples"]:
            self.assertTrue(999 <= sample["position"] <= 3001, sample)
        for arguments, status, says in (
                (("--range", "0.8m"), 64, "--range '0.8m'"), (("--range", "0.8m..2"), 64, "--range '2'"),
                (("--range", "@1..@99999"), 6, "the range"), (("--step", "20"), 64, "--step '20'"),
                (("--step", "0.1steps"), 6, "a step must be from one position"), (("--deadline", "30"), 64, "--deadline '30'"),
                (("--deadline", "20ms"), 6, "too short")):
            ran = self.daemon.lensctl("autofocus", "a", *arguments)
            self.assertEqual(ran.returncode, status, ran)
            self.assertIn(says, ran.stderr)

    def test_scores_need_no_pictures(self):
        self.move(500)
        with self.daemon.client(60 * PATIENCE) as client:
            session, step = self.begin(client, scores=True)
            reply = {"next": step}
            while "next" in reply:
                sharpness = 7.0 / (1.0 + ((reply["next"]["position"] - 2000) / 60.0) ** 2)
                time.sleep(0.001)
                now = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
                answer = client.call(LENS + "AutofocusScore", {
                    "session": session, "sharpness": sharpness, "exposureStartNs": now - 1000, "exposureEndNs": now})
                self.assertNotIn("error", answer)
                reply = answer["parameters"]
            self.assertTrue(reply["autofocus"]["focused"], reply)
            self.assertAlmostEqual(reply["autofocus"]["position"], 2000, delta=10)

    def test_what_makes_no_sense_is_refused_and_the_frame_stays_wanted(self):
        frame = {"widthPx": 64, "heightPx": 64, "format": "mono8", "data": base64.b64encode(bytes(4096)).decode()}
        with self.daemon.client() as client, self.daemon.client() as other:
            session, step = self.begin(client)
            now = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
            good = {**frame, "session": session, "exposureStartNs": now, "exposureEndNs": now}
            for wrong, says in (
                    ({"exposureStartNs": step["settledAtNs"] - 10 ** 6}, "before the lens stood"),
                    ({"exposureStartNs": now + 1}, "ends before it begins"),
                    ({"exposureEndNs": now + 10 ** 12}, "future"),
                    ({"heightPx": 65}, "65 rows of 64 bytes"),
                    ({"widthPx": 1 << 40}, "1 to 65536"),
                    ({"strideBytes": 63}, "strideBytes"),
                    ({"widthPx": 8, "data": base64.b64encode(bytes(8 * 64)).decode()}, "16 x 16"),
                    ({"data": base64.b64encode(bytes(3 * 4096)).decode()}, "three bytes a pixel: this looks like RGB"),
                    ({"data": base64.b64encode(bytes(4097)).decode()}, "1 too many"),
                    ({"data": base64.b64encode(bytes(4095)).decode()}, "a part of it is missing"),
                    ({"format": "mono10le", "widthPx": 32, "data": base64.b64encode(bytes([255]) * 4096).decode()},
                     "above the full scale"),
                    ({"data": "%%%"}, "base64"),
                    ({"gamma": 0}, "gamma"),
                    ({"session": session + 1}, "no autofocus session")):
                answer = client.call(LENS + "AutofocusFrame", {**good, **wrong})
                self.assertEqual(answer["error"], LENS + "InvalidRequest", wrong)
                self.assertIn(says, answer["parameters"]["message"])
            # It belongs to its connection.
            self.assertEqual(other.call(LENS + "AutofocusFrame", good)["error"], LENS + "InvalidRequest")
            answer = client.call(LENS + "AutofocusPixels", {"session": session, "offset": 5, "data": ""})
            self.assertIn("offset 0", answer["parameters"]["message"])
            self.assertEqual(client.call(LENS + "AutofocusFrame", good)["parameters"]["next"]["frame"], 2)
            self.assertEqual(client.call(LENS + "AutofocusEnd", {"session": session}), {"parameters": {}})
        self.wait_for(lambda: self.activity() == "idle")

    def test_a_frame_has_a_greatest_size(self):
        with self.daemon.client() as client:
            session, _ = self.begin(client)
            piece = base64.b64encode(bytes(700 << 10)).decode()
            sizes, answer = 0, {}
            while "error" not in answer and sizes < 32:
                answer = client.call(LENS + "AutofocusPixels",
                                     {"session": session, "offset": sizes * (700 << 10), "data": piece})
                sizes += 1
            self.assertEqual(answer["error"], LENS + "OutOfRange")
            self.assertEqual(sizes, 12)

    def test_sessions_are_few_and_end_with_their_connection(self):
        clients = [self.daemon.client() for _ in range(9)]
        try:
            sessions = []
            for client in clients[:8]:  # each is displaced by a move, and its end waits to be told
                sessions.append(self.begin(client)[0])
                self.move(500)
            self.assertEqual(clients[8].call(LENS + "AutofocusBegin", {"lens": "a"})["error"], LENS + "Busy")
            now = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
            score = {"sharpness": 1.0, "exposureStartNs": now, "exposureEndNs": now}
            answer = clients[0].call(LENS + "AutofocusScore", {"session": sessions[0], **score})
            self.assertEqual(answer["error"], LENS + "Superseded")
            self.begin(clients[8])  # there is room again
        finally:
            for client in clients:
                client.socket.close()
        self.wait_for(lambda: self.activity() == "idle")
        with self.daemon.client() as client:
            self.begin(client)

    def test_a_session_that_nobody_feeds_ends_by_itself(self):
        with self.daemon.client() as client:
            session, _ = self.begin(client, deadlineMs=200)
            self.wait_for(lambda: self.activity() == "idle")
            now = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
            answer = client.call(LENS + "AutofocusScore", {"session": session, "sharpness": 1.0, "exposureStartNs": now,
                                                           "exposureEndNs": now})
            self.assertFalse(answer["parameters"]["autofocus"]["focused"])
            self.assertIn("deadline", answer["parameters"]["autofocus"]["reason"])
            self.assertEqual(answer["parameters"]["autofocus"]["cause"], "deadline")
            for wrong in (0, 1e9):
                answer = client.call(LENS + "AutofocusBegin", {"lens": "a", "deadlineMs": wrong})
                self.assertEqual(answer["error"], LENS + "InvalidRequest")



class Stripes(unittest.TestCase):
    def test_one_period_at_any_contrast_is_no_subject_that_moved(self):
        """The wall of testing-your-program.md: far from focus its stripes turn round, or vanish, and it stands still."""
        with open(os.path.join(HERE, "..", "..", "docs", "testing-your-program.md"), encoding="utf-8") as page:
            text = page.read().split("```toml\n")[2].split("```")[0]
        self.assertIn("sinusoid_px", text)
        with tempfile.NamedTemporaryFile("w", suffix=".toml", encoding="utf-8") as scene:
            scene.write(text)
            scene.flush()
            daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene.name}"\n')
        try:
            with daemon.client(60 * PATIENCE) as client:
                for f_number, start in ((2.8, 2551), (5.6, 3860), (8.0, 3178)):
                    client.call(LENS + "Move", {"axis": "iris", "target": {"fNumber": f_number}})
                    client.call(LENS + "Move", {"axis": "focus", "target": {"position": start}})
                    found = client.call(LENS + "Autofocus", {})["parameters"]["autofocus"]
                    self.assertTrue(found["focused"], found)
        finally:
            daemon.stop()


if __name__ == "__main__":
    unittest.main()
