"""Undo: back to the optical state before the last command that moved the lens, and forth again; judged by where the simulated
mechanism truly stands."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bench import SIM  # noqa: E402
from harness import LENS, DaemonTest  # noqa: E402


class Undo(DaemonTest):
    lenses = ("a", "b", "c", "fresh", "slow")
    quick = ("a", "b", "c", "fresh")

    def call(self, method, **parameters):
        with self.daemon.client(60) as client:
            return client.call(method if "." in method else LENS + method, parameters)

    def done(self, method, **parameters):
        reply = self.call(method, **parameters)
        self.assertNotIn("error", reply)
        return reply["parameters"]

    def move(self, lens, axis="focus", **target):
        self.assertTrue(self.done("Move", lens=lens, axis=axis, target=target)["move"]["reached"])

    def truth(self, lens):
        return self.done(SIM + "Truth", lens=lens)

    def undo(self, lens):
        undo = self.done("Undo", lens=lens)["undo"]
        self.assertTrue(undo["undone"], undo)
        return undo

    def test_there_is_nothing_to_undo_before_the_first_move(self):
        before = self.truth("fresh")
        undo = self.done("Undo", lens="fresh")["undo"]
        self.assertEqual((undo["undone"], undo["moves"]), (False, []))
        self.assertIn("nothing to undo", undo["note"])
        told = self.daemon.lensctl("undo", "fresh")
        self.assertEqual(told.returncode, 1, told.stderr)
        self.assertIn("nothing to undo", told.stdout)
        after = self.truth("fresh")
        self.assertEqual(after["focusPosition"], before["focusPosition"])

    def test_back_and_forth_again_within_the_bound_told(self):
        self.move("a", position=300)
        self.move("a", axis="iris", position=20)
        self.move("a", position=900)
        away = self.truth("a")
        undo = self.undo("a")
        back = self.truth("a")
        self.assertAlmostEqual(back["focusPosition"], 300, delta=0.5)
        self.assertAlmostEqual(back["irisPosition"], 20, delta=0.5)
        z = 25.0 + back["extensionMm"]
        self.assertAlmostEqual(1e3 * (1 / 25.0 - 1 / z), 1e3 * (1 / 25.0 - 1 / (25.0 + 1.6 * 300 / 4000)),
                               delta=undo["vergenceBoundD"])
        self.assertGreater(undo["vergenceBoundD"], 0)
        self.undo("a")
        self.assertAlmostEqual(self.truth("a")["focusPosition"], away["focusPosition"], delta=0.5)
        self.undo("a")
        self.assertAlmostEqual(self.truth("a")["focusPosition"], back["focusPosition"], delta=0.5)

    def test_what_moved_nothing_leaves_no_trace(self):
        self.move("b", position=200)
        self.move("b", position=500)
        self.assertEqual(self.call("Move", lens="b", axis="focus", target={"position": 99999})["error"], LENS + "OutOfRange")
        self.move("b", position=500)
        with self.daemon.client(60) as client:
            client.send(LENS + "Snapshot", {"lens": "b"}, more=True)
            while client.receive().get("continues"):
                pass
        self.undo("b")
        self.assertAlmostEqual(self.truth("b")["focusPosition"], 200, delta=0.5)

    def test_a_step_is_a_whole_call_and_a_single_position_counts(self):
        self.move("c", position=400)
        self.assertTrue(self.done("Autofocus", lens="c")["autofocus"]["focused"])
        found = self.truth("c")["focusPosition"]
        self.assertGreater(abs(found - 400), 50)
        self.undo("c")
        self.assertAlmostEqual(self.truth("c")["focusPosition"], 400, delta=0.5)
        self.move("c", relative=1)
        self.undo("c")
        self.assertAlmostEqual(self.truth("c")["focusPosition"], 400, delta=0.5)

    def test_a_stop_on_the_way_and_a_move_under_way_go_back_to_where_they_began(self):
        self.move("slow", position=1000)
        with self.daemon.client(60) as mover:
            mover.send(LENS + "Move", {"lens": "slow", "axis": "focus", "target": {"position": 3900}})
            self.wait_for(lambda: self.position("slow")["position"] > 1050)
            self.done("Stop", lens="slow")
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
            self.undo("slow")
            self.assertAlmostEqual(self.truth("slow")["focusPosition"], 1000, delta=0.5)
            mover.send(LENS + "Move", {"lens": "slow", "axis": "focus", "target": {"position": 3900}})
            self.wait_for(lambda: self.position("slow")["position"] > 1050)
            self.undo("slow")
            self.assertEqual(mover.receive()["error"], LENS + "Superseded")
        self.assertAlmostEqual(self.truth("slow")["focusPosition"], 1000, delta=0.5)

    def test_lensctl_says_what_it_did_and_a_lease_keeps_others_from_it(self):
        self.move("b", position=250)
        self.move("b", position=350)
        told = self.daemon.lensctl("undo", "b")
        self.assertEqual((told.returncode, told.stderr), (0, ""))
        self.assertRegex(told.stdout, r"b: focus at 250, .*\n(.*\n)*b: back where it was, plane in focus within [\d.]+ D")
        with self.daemon.client() as holder:
            key = holder.call(LENS + "TakeLease", {"lens": "b"})["parameters"]["lease"]
            self.assertEqual(self.call("Undo", lens="b")["error"], LENS + "Leased")
            self.assertTrue(self.done("Undo", lens="b", lease=key)["undo"]["undone"])
        self.assertAlmostEqual(self.truth("b")["focusPosition"], 350, delta=0.5)


class Bounds(DaemonTest):
    lenses = ("a",)

    def test_a_state_at_rest_has_the_bounds_of_a_move_and_one_in_motion_has_none(self):
        with self.daemon.client(60) as client:
            def state():
                return client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]
            move = client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 1500}})["parameters"]["move"]
            self.assertGreater(move["vergenceBoundD"], 0)
            self.assertAlmostEqual(state()["vergenceBoundD"], move["vergenceBoundD"], 12)
            client.send(LENS + "Snapshot", {"lens": "a"}, more=True)
            frame = client.receive()
            while frame.get("continues") and "frame" not in frame["parameters"]:
                frame = client.receive()
            self.assertAlmostEqual(state()["fNumberBound"], frame["parameters"]["frame"]["fNumberBound"], 12)
        with self.daemon.client(60) as client, self.daemon.client(60) as looker:
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 3900}})
            def state_now():
                return looker.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]
            self.wait_for(lambda: state_now()["axes"][0]["moving"])
            moving = state_now()
            if moving["axes"][0]["moving"]:  # a busy machine may have slept through it
                self.assertIsNone(moving["vergenceBoundD"])
                self.assertIsNotNone(moving["fNumberBound"])
            looker.call(LENS + "Stop", {"lens": "a"})


if __name__ == "__main__":
    unittest.main()
