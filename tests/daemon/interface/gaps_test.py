"""What a monitor was not told it sees from the numbers of the events that it was told."""
import concurrent.futures
import os
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from event_stream import PASSING, Stream, kind_of, numbers  # noqa: E402
from harness import LENS, Daemon, DaemonTest  # noqa: E402


class Gaps(DaemonTest):
    """The numbers alone say what was missed."""

    def lease_storm(self, times, lens="a"):
        """Two lasting events each."""
        with self.daemon.client() as other:
            for _ in range(times):
                other.call(LENS + "TakeLease", {"lens": lens})
                other.call(LENS + "DropLease", {"lens": lens})

    def first(self, lens):
        with Stream(self.daemon, lens=lens) as stream:
            return stream.next()

    def test_what_happens_while_nobody_looks_is_counted_by_lens(self):
        before, other = self.first("a"), self.first("b")
        self.assertEqual(numbers(self.first("a")), numbers(before))
        self.lease_storm(7)
        after = self.first("a")
        self.assertEqual(after["lasting"] - before["lasting"], 14)
        self.assertEqual(after["sequence"] - before["sequence"], 28)  # the state tells of the lease each time
        self.assertEqual(numbers(self.first("b")), numbers(other))

    def test_everybody_is_told_the_same_numbers(self):
        with Stream(self.daemon, minIntervalMs=10) as often, Stream(self.daemon, minIntervalMs=10000) as seldom:
            with self.daemon.client() as other:
                for target in (100, 400, 100):
                    other.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": target}})
            moves = [[stream.until(lambda kind, *_: kind == "move") for _ in range(3)] for stream in (often, seldom)]
            self.assertEqual(*moves)
            self.assertLess(len(seldom.told), len(often.told))
            first, last = often.told[0], often.last["a"]
            told = sum(event["lens"] == "a" for event in seldom.told)
            self.assertGreater(last["sequence"] - first["sequence"] + 1, told)

    def test_a_monitor_that_does_not_read_gets_the_newest_state_and_every_result(self):
        with Stream(self.daemon, buffer=4096, lens="a", minIntervalMs=10) as slow:
            slow.next()
            with self.daemon.client() as other:
                ends = [200 + 150 * number for number in range(8)]
                for target in ends:
                    other.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": target}})
            while sum("move" in event for event in slow.told) < 8:
                slow.next()
            self.assertEqual([event["move"]["position"] for event in slow.told if "move" in event], ends)
            happened = slow.told[-1]["sequence"] - slow.told[0]["sequence"]
            self.assertLess(len(slow.told), happened / 2)  # states were left out, and the numbers say so

    def test_a_monitor_that_results_overrun_is_ended_and_told_up_to_where(self):
        with Stream(self.daemon, buffer=4096) as slow:
            began = {name: numbers(self.first(name)) for name in "ab"}
            storm = 1500
            self.lease_storm(storm)
            while slow.next():
                pass
            self.assertEqual(slow.end["error"], LENS + "Overrun")
            error = slow.end["parameters"]
            self.assertEqual(slow.definition.wrong(("struct", slow.definition.errors["Overrun"][1]), error, "Overrun"), [])
            self.assertEqual((error["received"], error["instance"]), (len(slow.told), slow.instance))
            self.assertEqual(error["last"], [{"lens": name, "sequence": slow.last[name]["sequence"],
                                              "lasting": slow.last[name]["lasting"]} for name in "ab"])
            now = self.first("a")
            told = sum(kind_of(event) not in PASSING for event in slow.told)
            self.assertLess(told, 2 * storm)
            self.assertEqual(now["lasting"] - slow.last["a"]["lasting"], 2 * storm - told)
            self.assertEqual(now["lasting"] - began["a"][1], 2 * storm)

    def test_another_run_has_another_name(self):
        daemons = [self.daemon, Daemon(("a",))]
        try:
            names = []
            for daemon in daemons:
                with daemon.client() as client:
                    listed = client.call(LENS + "List")["parameters"]["instance"]
                with Stream(daemon) as stream:
                    self.assertEqual(stream.next()["instance"], listed)
                names.append(listed)
            self.assertNotEqual(*names)
        finally:
            self.assertEqual(daemons[1].stop(), 0)

    def test_a_restart_is_seen_where_the_stream_is_begun_again(self):
        daemon = Daemon(("a",))
        with Stream(daemon) as stream, daemon.client() as other:
            other.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 50}})
            before = stream.until(lambda kind, *_: kind == "move")
        daemon.process.kill()
        daemon.process.wait()
        with open(daemon.config, encoding="utf-8") as file:
            config = file.read()
        again = Daemon(config=config)
        try:
            with Stream(again) as stream:
                after = stream.next()
            self.assertNotEqual(after["instance"], before["instance"])
            self.assertLess(after["lasting"], before["lasting"] + 1)  # it counts anew
        finally:
            self.assertEqual(again.stop(), 0)
            daemon.kill()


class Many(DaemonTest):
    lenses = tuple("abcdefghijklmnop")

    def test_sixteen_lenses_that_move_and_a_rate_that_holds(self):
        with Stream(self.daemon, minIntervalMs=250) as seldom, Stream(self.daemon, minIntervalMs=20) as often:
            began = time.monotonic()
            for stream in (seldom, often):
                for _ in self.lenses:
                    stream.next()
            with self.daemon.client() as other:
                for lens in self.lenses:
                    other.send(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": 2000}}, oneway=True)

            def until_all_arrived(stream):
                arrived = set()
                while len(arrived) < 16:
                    arrived.add(stream.until(lambda kind, *_: kind == "move")["lens"])
                return time.monotonic() - began

            with concurrent.futures.ThreadPoolExecutor() as readers:
                times = list(readers.map(until_all_arrived, (seldom, often)))
            rates = []
            for stream, interval, took in ((seldom, 0.25, times[0]), (often, 0.02, times[1])):
                for lens in self.lenses:
                    states = sum("status" in event for event in stream.told if event["lens"] == lens)
                    way = sum("progress" in event for event in stream.told if event["lens"] == lens)
                    self.assertLessEqual(states, took / interval + 3, lens)  # at first, and before the result
                    self.assertLessEqual(way, took / interval + 2, lens)
                    self.assertGreater(way, 2, lens)
                passing = sum(kind_of(event) in PASSING for event in stream.told)
                happened = sum(stream.last[lens]["sequence"] for lens in self.lenses)
                rates.append(f"{1e3 * interval:.0f} ms: {passing} of {happened} passing events in {took:.1f} s")
            print("16 lenses moving: " + "; ".join(rates))


if __name__ == "__main__":
    unittest.main()
