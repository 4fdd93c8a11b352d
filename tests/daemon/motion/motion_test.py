"""Moving lenses through the daemon: who wins, who may stop, and what a client that dies leaves behind."""
import base64
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, LENS, PATIENCE, DaemonTest  # noqa: E402

FAR_AWAY = {"position": 4000}
# What the rig asks of the simulated lens while it moves, plus what two connections and a thread cost.
POLL_PERIOD_S = 0.02


class Motion(DaemonTest):
    lenses = ("a", "b", "quick")
    quick = ("quick",)

    def setUp(self):
        """At zero. Where no reading shows it, a motor that only counts and is sent elsewhere within ten steps of zero may be taken for
        one that lost its power (docs/plan.md), and refuses whatever follows: no test does that."""
        with self.daemon.client() as client:
            client.call(LENS + "Stop", {"lens": "a"})
            client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 0}})

    def start_far_move(self, client, **flags):
        client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": FAR_AWAY}, **flags)
        self.wait_for(lambda: self.position()["moving"] and self.position()["position"] > 100)

    def test_a_finished_move_says_everything(self):
        with self.daemon.client() as client:
            move = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"distanceM": 1.2}})
        move = move["parameters"]["move"]
        self.assertTrue(move["reached"] and move["settled"] and not move["verified"])
        self.assertEqual((move["cause"], move["reason"]), ("counted", "steps counted, not measured"))
        extension_mm = 25.0 ** 2 / (1200.0 - 25.0)
        step_mm = 1.6 / 4000
        self.assertAlmostEqual(move["extensionMm"], extension_mm, delta=0.51 * step_mm)
        self.assertAlmostEqual(1 / move["vergenceD"], 1.2, delta=0.001)
        self.assertLess(abs(move["extensionMm"] - extension_mm) * 1e3, move["extensionBoundUm"] * 1.001)
        self.assertGreater(move["elapsedMs"], 1000.0 * extension_mm / step_mm / 1000 * 0.9)

    def test_the_newest_command_wins(self):
        with self.daemon.client() as first, self.daemon.client() as second:
            self.start_far_move(first)
            second.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 300}})
            self.assertEqual(first.receive()["error"], LENS + "Superseded")
            self.assertEqual(second.receive()["parameters"]["move"]["position"], 300)

    def test_stop_from_a_second_client_ends_a_move_within_a_poll_period(self):
        took = []
        for _ in range(5):
            with self.daemon.client() as mover, self.daemon.client() as stopper:
                self.start_far_move(mover)
                began = time.monotonic()
                self.assertEqual(stopper.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
                self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
                took.append(time.monotonic() - began)
            self.wait_for(lambda: not self.position()["moving"], seconds=1)  # it has to brake first
            self.assertLess(self.position()["position"], 3900)
        print(f"stop: {min(took) * 1e3:.1f} to {max(took) * 1e3:.1f} ms")
        self.assertLess(min(took), POLL_PERIOD_S * PATIENCE)

    def test_a_client_killed_in_mid_move_leaves_everything_in_order(self):
        mover = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "focus", "a", "@600"])
        self.wait_for(lambda: self.position()["moving"])
        mover.send_signal(signal.SIGKILL)
        mover.wait()
        with self.daemon.client() as other:  # others are served, and the other lens moves
            self.assertIn("lenses", other.call(LENS + "Status")["parameters"])
            moved = other.call(LENS + "Move", {"lens": "b", "axis": "focus", "target": {"relative": 10}})
            self.assertTrue(moved["parameters"]["move"]["reached"])
        self.wait_for(lambda: not self.position()["moving"])
        self.assertEqual(self.position()["position"], 600)  # a plain move goes on to where it was allowed to go

    def test_many_killed_clients(self):
        for round_number in range(10):
            mover = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "focus", "a",
                                      f"@{200 + 50 * round_number}"], stderr=subprocess.DEVNULL)
            time.sleep(0.02 * round_number)
            mover.send_signal(signal.SIGKILL)
            mover.wait()
        self.wait_for(lambda: not self.position()["moving"])
        with self.daemon.client() as client:
            self.assertIn("move", client.call(LENS + "Move", {"lens": "a", "axis": "focus",
                                                              "target": {"position": 0}})["parameters"])

    def test_control_c_stops_what_lensctl_moves(self):
        mover = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "focus", "a", "@4000"],
                                 stderr=subprocess.PIPE, text=True)
        self.wait_for(lambda: self.position()["moving"] and self.position()["position"] > 100)
        mover.send_signal(signal.SIGINT)
        _, errors = mover.communicate(timeout=20 * PATIENCE)
        self.assertEqual(mover.returncode, 130, errors)
        self.wait_for(lambda: not self.position()["moving"])
        self.assertLess(self.position()["position"], 3900)

    def test_progress_comes_before_the_result(self):
        with self.daemon.client() as client:
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 500}}, more=True)
            positions = []
            reply = client.receive()
            while reply.get("continues"):
                positions.append(reply["parameters"]["progress"]["position"])
                reply = client.receive()
            self.assertEqual(reply["parameters"]["move"]["position"], 500)
            self.assertGreater(len(positions), 3)
            self.assertEqual(positions, sorted(positions))

    def test_monitors_get_the_present_state_first_and_then_what_happens(self):
        with self.daemon.client() as monitor, self.daemon.client() as mover:
            monitor.send(LENS + "Monitor", {"lens": "a"}, more=True)
            first = monitor.receive()
            self.assertTrue(first["continues"])
            self.assertEqual(first["parameters"]["event"]["status"]["name"], "a")
            mover.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 100}})
            events = []
            while not events or "move" not in events[-1]:
                events.append(monitor.receive()["parameters"]["event"])
            self.assertEqual(events[-1]["move"]["position"], 100)
            self.assertEqual(events[-2]["status"]["axes"][0]["position"], 100)  # the state is new before the result

    def test_snapshot_is_a_png_in_pieces(self):
        with self.daemon.client() as client:
            client.send(LENS + "Snapshot", {"lens": "a"}, more=True)
            png, frame, reply = b"", None, {"continues": True}
            while reply.get("continues"):
                reply = client.receive()
                piece = reply["parameters"]
                self.assertEqual(piece["offset"], len(png))
                self.assertLessEqual(len(piece["data"]), 512 << 10)
                frame = piece.get("frame") or frame
                png += base64.b64decode(piece["data"], validate=True)
            self.assertEqual(len(png), piece["size"])
        self.assertTrue(png.startswith(b"\x89PNG\r\n\x1a\n"))
        self.assertEqual((frame["widthPx"], frame["heightPx"], frame["moving"]), (64, 48, False))

    def test_a_frame_says_that_the_lens_moved_during_it(self):
        with self.daemon.client() as mover, self.daemon.client() as viewer:
            start = self.position()["position"]
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000 if start < 2000 else 0}})
            self.wait_for(lambda: self.position()["moving"])
            viewer.send(LENS + "Snapshot", {"lens": "a", "inMotion": True}, more=True)
            frame = viewer.receive()["parameters"]["frame"]
            self.assertTrue(frame["moving"])
            self.assertTrue(mover.receive()["parameters"]["move"]["reached"])
            viewer.send(LENS + "Snapshot", {"lens": "a"}, more=True)  # a small picture: one piece
            self.assertFalse(viewer.receive()["parameters"]["frame"]["moving"])

    def test_closing_the_connection_ends_an_autofocus(self):
        client = self.daemon.client()
        client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 1000}})
        client.send(LENS + "Autofocus", {"lens": "a"}, more=True)
        self.wait_for(lambda: self.activity() == "autofocus")
        client.socket.close()
        self.wait_for(lambda: self.activity() == "idle" and not self.position()["moving"], seconds=5)  # it has to brake first

    def activity(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["activity"]

    def test_plan_and_apply(self):
        limits = [{"name": "s", "kind": "sharp", "limitUm": 20.0,
                   "depths": [{"oneEnd": {"distanceM": 1.1}, "otherEnd": {"distanceM": 1.3}}]}]
        with self.daemon.client() as client:
            answer = client.call(LENS + "Plan", {"lens": "quick", "request": {"limits": limits}, "apply": True})
            plan, applied = answer["parameters"]["plan"], answer["parameters"]["applied"]
            by_axis = {move["axis"]: move for move in applied}
            self.assertTrue(plan["feasible"] and all(move["reached"] for move in applied))
            self.assertTrue(answer["parameters"]["reached"]["feasible"])
            self.assertEqual(by_axis["focus"]["extensionMm"], plan["extensionMm"])  # planned on a step, not rounded to
            self.assertEqual(by_axis["iris"]["fNumber"], plan["fNumber"])
            # What was reached meets the limit by the textbook formula, not only what was planned.
            extension = by_axis["focus"]["extensionMm"] / 1e3
            f_number, f = by_axis["iris"]["fNumber"], 0.025
            for distance in (1.1, 1.3):
                blur = f / f_number * abs((f + extension) * (1 / f - 1 / distance) - 1)
                self.assertLessEqual(blur * 1e6, 20.0 * (1 + 1e-9))
            limits[0]["limitUm"] = 0.01
            answer = client.call(LENS + "Plan", {"lens": "quick", "request": {"limits": limits}, "apply": True})
            self.assertFalse(answer["parameters"]["plan"]["feasible"])
            self.assertIn("s", answer["parameters"]["plan"]["conflict"])
            self.assertNotIn("applied", answer["parameters"])

    def test_a_stack_covers_its_range_with_pictures(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.daemon.lensctl("stack", "quick", "--sharp", "1m..2m:8um", "--f-number", "2..2.8", "-o", folder,
                                       "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            shots = json.loads(done.stdout)["shots"]
            self.assertEqual(sorted(os.listdir(folder)), [f"shot-{i + 1}.png" for i in range(len(shots))])
            self.assertGreater(len(shots), 1)
            for shot in shots:  # at both ends of what a shot covers, where the lens really stood
                f, frame = 0.025, shot["frame"]
                for vergence in (shot["nearD"], shot["farD"]):
                    blur = f / frame["fNumber"] * abs((f + frame["extensionMm"] / 1e3) * (1 / f - vergence) - 1)
                    self.assertLessEqual(blur * 1e6, 8.0 * (1 + 1e-9))

    def test_many_clients_at_once(self):
        errors = []

        def work(number):
            try:
                with self.daemon.client() as client:
                    for turn in range(30):
                        # Not near zero, see setUp().
                        target = {"position": 100 + (number * 37 + turn * 11) % 200}
                        reply = client.call(LENS + ("Move" if turn % 3 else "Status"), {
                            "lens": "ab"[number % 2], **({"axis": "focus", "target": target} if turn % 3 else {})})
                        if reply is None or reply.get("error", LENS + "Superseded") != LENS + "Superseded":
                            errors.append(json.dumps(reply))
            except OSError as error:
                errors.append(str(error))
        threads = [threading.Thread(target=work, args=(number,)) for number in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(errors, [])


if __name__ == "__main__":
    unittest.main()
