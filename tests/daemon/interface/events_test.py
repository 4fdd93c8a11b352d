"""Events that can be relied on: every kind of them, caused by somebody else."""
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "setup"))
from calibration_test import ROOT  # noqa: E402
from calibration_test import SCENE as QUICK_SCENE  # noqa: E402
from event_stream import Stream, kind_of, numbers  # noqa: E402
from harness import BIN, HERE, LENS, PATIENCE, Daemon, DaemonTest  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")


class EveryKind(DaemonTest):
    """Each is caused by another client."""
    lenses = ("a", "b", "quick")
    quick = ("quick",)

    def call(self, method, **parameters):
        with self.daemon.client(120 * PATIENCE) as other:
            reply = other.call(LENS + method, parameters)
        self.assertNotIn("error", reply, method)
        return reply["parameters"]

    def test_moves_tell_how_far_they_are_and_how_they_end(self):
        with Stream(self.daemon, lens="a", minIntervalMs=10) as stream:
            target = 900 if self.position()["position"] < 450 else 0
            result = self.call("Move", lens="a", axis="focus", target={"position": target})["move"]
            self.assertEqual(stream.of("move"), result)
            way = [event["progress"]["move"] for event in stream.told if "progress" in event]
            self.assertGreater(len(way), 3)
            self.assertEqual({(step["axis"], step["target"]) for step in way}, {("focus", target)})
            self.assertEqual(stream.told[-2]["status"]["axes"][0]["position"], target)  # the state is new before it
            self.call("Home", lens="a", axis="focus")
            self.assertEqual(stream.of("move")["axis"], "focus")

    def test_autofocus_and_its_progress(self):
        with Stream(self.daemon, lens="quick", minIntervalMs=10) as stream:
            result = self.call("Autofocus", lens="quick")["autofocus"]
            self.assertEqual(stream.of("autofocus"), result)
            steps = [event["progress"]["autofocus"] for event in stream.told if "autofocus" in event.get("progress", {})]
            self.assertGreater(len(steps), 0)
            self.assertLessEqual(steps[-1]["frames"], result["frames"])

    def test_a_session_with_frames_of_the_client_is_seen_too(self):
        with Stream(self.daemon, lens="a", minIntervalMs=10) as stream, self.daemon.client(60 * PATIENCE) as other:
            reply = other.call(LENS + "AutofocusBegin", {"lens": "a", "scores": True})["parameters"]
            session = reply["session"]
            for _ in range(3):
                now = time.monotonic_ns()
                reply = other.call(LENS + "AutofocusScore", {
                    "session": session, "exposureStartNs": now, "exposureEndNs": now,
                    "sharpness": 1e6 - abs(reply["next"]["position"] - 2000)})["parameters"]
            progress = stream.until(lambda kind, value, _: kind == "progress" and "autofocus" in value)
            self.assertGreater(progress["progress"]["autofocus"]["frames"], 0)
            self.assertEqual(other.call(LENS + "AutofocusEnd", {"session": session}), {"parameters": {}})

    def test_leases_from_their_taking_to_each_of_their_ends(self):
        with Stream(self.daemon, lens="a") as stream, self.daemon.client() as other:
            self.assertIsNone(stream.next()["status"]["lease"])
            key = other.call(LENS + "TakeLease", {"lens": "a"})["parameters"]["lease"]
            taken = stream.of("lease")
            self.assertEqual((taken["change"], taken["untilNs"], taken["cause"]), ("taken", None, None))
            self.assertIn(f"[{os.getpid()}]", taken["holder"])
            self.assertEqual(stream.told[-2]["status"]["lease"], {"holder": taken["holder"], "untilNs": None})

            before = time.monotonic_ns()
            again = other.call(LENS + "TakeLease", {"lens": "a", "forMs": 600e3})["parameters"]["lease"]
            self.assertEqual(again, key)
            renewed = stream.of("lease")
            self.assertEqual((renewed["change"], renewed["holder"]), ("renewed", taken["holder"]))
            self.assertTrue(before + 600e9 <= renewed["untilNs"] <= time.monotonic_ns() + 600e9, renewed)

            self.assertEqual(self.daemon.lensctl("lease", "take", "a", "--for", "60s").returncode, 9)  # without the key
            done = self.daemon.lensctl("lease", "take", "a", "--for", "60s", env={**os.environ, "LENSD_LEASE": key})
            self.assertEqual(done.stdout.strip(), key)
            over = stream.of("lease")
            self.assertEqual(over["change"], "takenOver")
            self.assertRegex(over["holder"], r"^lensctl\[")

            other.call(LENS + "DropLease", {"lens": "a", "lease": key})
            self.assertEqual(stream.of("lease"), {**over, "change": "ended", "cause": "dropped"})
            self.assertIsNone(stream.told[-2]["status"]["lease"])

            other.call(LENS + "TakeLease", {"lens": "a", "forMs": 200})
            taken = stream.of("lease", change="taken")
            ended = stream.of("lease")
            self.assertEqual((ended["change"], ended["cause"]), ("ended", "expired"))
            self.assertGreaterEqual(time.monotonic_ns(), taken["untilNs"])
            with self.daemon.client() as third:
                third.call(LENS + "TakeLease", {"lens": "a"})
                stream.of("lease", change="taken")
            self.assertEqual(stream.of("lease")["cause"], "disconnected")

    def test_a_lease_that_is_renewed_ends_at_its_new_time(self):
        with Stream(self.daemon, lens="b") as stream, self.daemon.client() as other:
            key = other.call(LENS + "TakeLease", {"lens": "b"})["parameters"]["lease"]
            other.call(LENS + "TakeLease", {"lens": "b", "forMs": 60e3, "lease": key})
            other.call(LENS + "TakeLease", {"lens": "b", "forMs": 400, "lease": key})
            stream.of("lease", change="renewed")
            until = stream.of("lease", change="renewed")["untilNs"]
            ended = stream.of("lease")
            self.assertEqual((ended["change"], ended["cause"], ended["untilNs"]), ("ended", "expired", until))
            self.assertGreaterEqual(time.monotonic_ns(), until)

    def test_calibration_and_presets(self):
        with Stream(self.daemon, lens="a") as stream:
            self.call("Calibrate", lens="a", approximate=True, errorUm=5,
                      points=[{"position": 0, "extensionMm": 0}, {"position": 4000, "extensionMm": 1.6}])
            self.assertEqual(stream.of("calibration")["grade"], "approximate")
            self.call("Calibrate", lens="a", remove=True)
            self.assertEqual(stream.of("calibration")["grade"], "uncalibrated")
            self.call("PresetSave", lens="a", label="one")
            self.assertEqual(stream.of("preset"), {"change": "saved", "label": "one"})
            self.call("PresetRecall", lens="a", label="one")
            self.call("PresetRemove", lens="a", label="one")
            self.assertEqual(stream.of("preset"), {"change": "removed", "label": "one"})

    def shown_by_lensctl(self, *options):
        """The lines it prints while others move, save, calibrate and lease."""
        command = [os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "monitor", "b", *options]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as monitor:
            lines = [monitor.stdout.readline()]  # it looks on now
            self.call("Move", lens="b", axis="focus", target={"position": 500})
            self.call("Move", lens="b", axis="focus", target={"position": 100})
            self.call("PresetSave", lens="b", label="two")
            self.call("Calibrate", lens="b", remove=True)
            key = self.call("TakeLease", lens="b", forMs=50e3)["lease"]
            self.call("DropLease", lens="b", lease=key)
            while "ended" not in lines[-1]:
                lines.append(monitor.stdout.readline())
                self.assertTrue(lines[-1], lines)
            monitor.send_signal(signal.SIGINT)
            monitor.stdout.read()
        return lines

    def test_lensctl_shows_a_line_for_each(self):
        lines = self.shown_by_lensctl()
        for line in lines:
            self.assertTrue(line.startswith("b: "), line)
        for words in (r"^b: idle", r"^b: focus on its way, \d+ -> \d+$", r"^b: focus at 500, ", r'^b: preset "two" saved$',
                      r"^b: calibration changed, now uncalibrated$",
                      r"^b: lease taken by \S+\[\d+\] of user \d+ for another \d+ s$", r"^b: lease of .* ended \(dropped\)$"):
            self.assertRegex("".join(lines), re.compile(words, re.MULTILINE))

    def test_lensctl_shows_an_object_a_line_for_programs(self):
        events = [json.loads(line) for line in self.shown_by_lensctl("--json")]
        self.assertEqual({kind_of(event) for event in events},
                         {"status", "progress", "move", "preset", "calibration", "lease"})
        counted = [event["sequence"] for event in events]
        self.assertEqual(counted, sorted(set(counted)))


class Backlash(unittest.TestCase):
    """On a quick lens that has some."""

    def test_backlash_and_its_progress(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "scene.toml")
            with open(path, "w", encoding="utf-8") as file:
                file.write(QUICK_SCENE.format(focal="25.0", distance=1.2, root=ROOT))
            daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{path}"\n')
            try:
                with Stream(daemon, minIntervalMs=10) as stream, daemon.client(120 * PATIENCE) as other:
                    other.send(LENS + "MeasureBacklash", {"lens": "a", "pairs": 3})
                    told = stream.of("backlash")
                    self.assertEqual(other.receive()["parameters"]["backlash"], told)
                    self.assertTrue(told["known"], told)
                    sweeps = [event["progress"]["backlash"]["sweep"] for event in stream.told
                              if "backlash" in event.get("progress", {})]
                    self.assertGreater(len(sweeps), 1)
                    self.assertEqual(sweeps, sorted(sweeps))
                    self.assertIn("calibration", [kind_of(event) for event in stream.told])  # it is part of that
            finally:
                self.assertEqual(daemon.stop(), 0)


class Coming(DaemonTest):
    """Lenses that come, go, and complain."""

    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def test_reload_tells_what_became_of_the_list(self):
        def lens(name, more=""):
            return f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{SCENE}"\n{more}'

        daemon = Daemon(("a", "b", "c"))
        try:
            with Stream(daemon) as everything, Stream(daemon, lens="c") as only, daemon.client() as holder:
                self.assertEqual({everything.next()["lens"] for _ in range(3)}, {"a", "b", "c"})
                only.next()
                holder.call(LENS + "TakeLease", {"lens": "b"})
                everything.of("lease", change="taken")
                before = numbers(everything.last["b"])
                with open(daemon.config, "w", encoding="utf-8") as file:
                    file.write("version = 1\n" + lens("a") + lens("b", "[lens.focus]\nlimits = [100, 3000]\n") + lens("d"))
                self.assertEqual(daemon.lensctl("reload").returncode, 0)
                wanted = {("b", "reopened"), ("b", "opened"), ("c", "removed"), ("d", "added"), ("d", "opened")}
                seen = set()
                while seen != wanted:
                    event = everything.until(lambda kind, value, _: kind == "list")
                    seen.add((event["lens"], event["list"]["change"]))
                    self.assertLessEqual(seen, wanted)
                leases = [event["lease"] for event in everything.told if "lease" in event]
                self.assertEqual([lease["change"] for lease in leases], ["taken", "renewed"])  # it outlives the reload
                self.assertGreater(numbers(everything.last["b"]), before)  # opened anew, and not counted anew
                while only.next():
                    pass
                self.assertEqual(only.told[-1]["list"]["change"], "removed")
                self.assertEqual((only.end["error"], only.end["parameters"]["lens"]), (LENS + "LensNotFound", "c"))
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_faults_and_a_lens_that_goes_and_comes_back(self):
        faults = ('[[fault]]\nkind = "stall"\nat_ms = 1000\nfor_ms = 8000\naxis = "focus"\n'
                  '[[fault]]\nkind = "disconnect"\nat_ms = 12000\n[[fault]]\nkind = "reconnect"\nat_ms = 13000\n')
        with tempfile.TemporaryDirectory() as folder, open(SCENE, encoding="utf-8") as scene:
            path = os.path.join(folder, "scene.toml")
            with open(path, "w", encoding="utf-8") as file:
                file.write(scene.read() + faults)
            daemon = Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{path}"\n')
            try:
                with Stream(daemon) as stream, daemon.client(60 * PATIENCE) as other:
                    other.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
                    fault = stream.of("fault")
                    self.assertEqual((fault["axis"], fault["fault"]), ("focus", "stalled"))
                    state = [event["status"] for event in stream.told if "status" in event][-1]
                    self.assertEqual(state["axes"][0]["fault"], "stalled")  # it is new before it
                    self.assertFalse(other.receive()["parameters"]["move"]["reached"])
                    self.assertFalse(stream.of("move")["reached"])
                    gone = stream.of("list")
                    self.assertEqual((gone["change"], gone["connection"]), ("gone", "absent"))
                    self.assertIsNotNone(gone["reason"])
                    self.assertEqual(stream.of("list")["change"], "opened")
                    self.assertIn({"axis": "focus", "fault": None},
                                  [event.get("fault") for event in stream.told])
            finally:
                daemon.stop()


if __name__ == "__main__":
    unittest.main()
