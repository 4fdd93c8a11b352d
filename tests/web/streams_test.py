"""Pictures and events as streams: whole, shared, newest first, and what was missed is told."""
import contextlib
import json
import os
import socket
import threading
import time
import unittest

from web_harness import LENS, Stream, Web, WebTest, temporary_folder
from viewer import next_picture, view

COLOUR = """version = 1
[camera]
width = 64
height = 48
bits = 12
frame_rate_hz = 100
exposure_ms = 1
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 4001
speed_steps_per_s = 1000
[[surface]]
kind = "wall"
distance_m = 1.2
gradient = [0.05, 0.95]
"""


class PictureTest(WebTest):
    def metric(self, name):
        body = self.web.ask("GET", "/metrics")[2].decode()
        return next(float(line.split()[-1]) for line in body.splitlines() if line.startswith(name + " "))

    def test_jpegs_come_one_after_the_other(self):
        with Stream(self.web, "/live.mjpg?lens=a") as stream:
            self.assertEqual((stream.status, stream.fields["content-type"]), (200, "multipart/x-mixed-replace; boundary=f"))
            sequences = []
            for _ in range(5):
                fields, data = stream.picture()
                self.assertEqual((fields["Content-Type"], data[:3], data[-2:]), ("image/jpeg", b"\xff\xd8\xff", b"\xff\xd9"))
                about = json.loads(fields["X-Picture"])
                self.assertEqual((about["frame"]["widthPx"], sum(about["picture"]["histogram"])), (64, 64 * 48))
                sequences.append(about["frame"]["sequence"])
            self.assertEqual(sequences, sorted(set(sequences)))

    def test_raw_pixels_are_those_of_view(self):
        with Stream(self.web, "/live.mjpg?lens=a&encoding=gray8&width=32&height=32&rate=5") as stream:
            fields, data = stream.picture()
        picture = json.loads(fields["X-Picture"])["picture"]
        self.assertEqual((picture["widthPx"], picture["heightPx"], picture["encoding"], len(data)), (32, 24, "gray8", 32 * 24))
        with self.daemon.client() as client:
            view(client, lens="a", encoding="gray8", scaleTo={"widthPx": 32, "heightPx": 32})
            self.assertEqual(next_picture(client)[1], data)

    def test_a_part_is_shown_enlarged(self):
        with Stream(self.web, "/live.mjpg?lens=a&encoding=gray8&x=0.5&y=0.5&w=0.25&h=0.5") as stream:
            picture = json.loads(stream.picture()[0]["X-Picture"])["picture"]
        self.assertEqual([picture[name] for name in ("leftPx", "topPx", "widthPx", "heightPx")], [32, 24, 16, 24])

    def test_viewers_of_the_same_share_a_view_that_ends_with_the_last(self):
        self.wait_for(lambda: self.metric("lens_web_views") == 0)
        streams = [Stream(self.web, "/live.mjpg?lens=a&width=48") for _ in range(3)]
        other = Stream(self.web, "/live.mjpg?lens=b&width=48")
        for stream in (*streams, other):
            stream.picture()
        self.assertEqual(self.metric("lens_web_views"), 2)
        for stream in streams:
            stream.connection.close()
        self.wait_for(lambda: self.metric("lens_web_views") == 1)
        other.connection.close()
        self.wait_for(lambda: self.metric("lens_web_views") == 0)
        self.wait_for(lambda: self.metric("lens_web_streams") == 0)

    def test_who_reads_late_gets_the_newest(self):
        with Stream(self.web, "/live.mjpg?lens=a&encoding=png&rate=100") as fast, \
                Stream(self.web, "/live.mjpg?lens=a&encoding=png&rate=100") as slow:
            slow.picture()
            newest = 0
            deadline = time.monotonic() + 5
            while self.metric("lens_web_frames_dropped_total") == 0 and time.monotonic() < deadline:
                for _ in range(20):
                    newest = json.loads(fast.picture()[0]["X-Picture"])["frame"]["sequence"]
            # What the sockets hold is old; then nothing lies between it and the newest.
            last = 0
            while last < newest:
                last = json.loads(slow.picture()[0]["X-Picture"])["frame"]["sequence"]

    def test_the_picture_goes_on_while_the_lens_moves(self):
        self.web.call("Move", {"lens": "b", "axis": "focus", "target": {"position": 0}})
        with Stream(self.web, "/live.mjpg?lens=b&rate=60") as stream, self.daemon.client() as client:
            stream.picture()
            client.send(LENS + "Move", {"lens": "b", "axis": "focus", "target": {"position": 2000}})
            moving, deadline = 0, time.monotonic() + 20
            while moving < 5 and time.monotonic() < deadline:
                moving += json.loads(stream.picture()[0]["X-Picture"])["frame"]["moving"]
            self.assertEqual(moving, 5)
            client.call(LENS + "Stop", {"lens": "b"})

    def test_why_there_is_no_picture(self):
        self.assertEqual(self.web.ask("GET", "/live.mjpg?lens=nobody")[0], 404)
        self.assertEqual(self.web.ask("GET", "/live.mjpg?lens=a&encoding=bmp")[0], 400)
        self.assertEqual(self.web.ask("GET", "/live.mjpg?lens=a&encoding=rgb8")[0], 501)
        for query in ("width=x", "width=-1", "rate=0", "rate=nan", "x=0&y=0&w=2&h=1", "height=1e9"):
            self.assertEqual(self.web.ask("GET", f"/live.mjpg?lens=a&{query}")[0], 400, query)

    def test_a_snapshot_is_a_png(self):
        status, fields, body = self.web.ask("GET", "/snapshot.png?lens=a")
        self.assertEqual((status, fields["content-type"], body[:8]), (200, "image/png", b"\x89PNG\r\n\x1a\n"))
        self.assertEqual(self.web.ask("GET", "/snapshot.png?lens=nobody")[0], 404)


class EventTest(WebTest):
    def move(self, lens, position):
        status, told = self.web.call("Move", {"lens": lens, "axis": "focus", "target": {"position": position}})
        self.assertEqual((status, told["move"]["reached"]), (200, True))

    def until_move(self, stream):
        """Ids and events up to the next finished move."""
        seen = []
        while not seen or "move" not in seen[-1][1]:
            event = stream.event()
            self.assertEqual(event.get("event", "message"), "message", event)
            seen.append((event.get("id"), event["data"]))
        return seen

    def begun(self, path="/events", **headers):
        stream = Stream(self.web, path, headers=headers)
        self.assertEqual(stream.fields["content-type"], "text/event-stream")
        return stream

    def test_a_stream_begins_with_how_things_stand(self):
        self.web.call("Status")
        with self.begun() as stream:
            self.assertEqual(stream.event()["event"], "daemon")
            lenses = {stream.event()["data"]["lens"] for _ in range(2)}
            self.assertEqual(lenses, {"a", "b"})
            self.move("a", 40)
            events = self.until_move(stream)
        self.assertEqual(events[-1][1]["move"]["position"], 40)
        self.assertIn("sequence", events[-1][1])

    def test_states_of_the_beginning_have_the_numbers_of_what_happened_last(self):
        with self.begun() as stream:
            stream.event()
            self.move("a", 50)
            last = self.until_move(stream)[-1][1]
            with self.begun("/events?lens=a") as late:
                late.event()
                state = late.event()["data"]
        self.assertIsNotNone(state.get("status"))
        self.assertEqual((state["sequence"], state["lasting"]), (last["sequence"], last["lasting"]))

    def test_one_lens_alone(self):
        with self.begun("/events?lens=b") as stream:
            stream.event()
            self.move("a", 60)
            self.move("b", 60)
            events = self.until_move(stream)
        self.assertEqual({event["lens"] for _, event in events}, {"b"})

    def test_coming_back_goes_on_without_a_gap(self):
        with self.begun() as stream:
            stream.event()
            self.move("a", 80)
            last = self.until_move(stream)[-1]
        self.move("a", 90)
        with self.begun(**{"Last-Event-ID": last[0]}) as stream:
            events = self.until_move(stream)
        self.assertEqual(events[-1][1]["move"]["position"], 90)
        self.assertEqual(events[-1][1]["lasting"], last[1]["lasting"] + 1)

    def test_what_is_missed_is_said(self):
        for name in ("nonsense", "1-5", "99999999999999999999-1"):
            with self.begun(**{"Last-Event-ID": name}) as stream:
                event = stream.event()
                self.assertEqual((event["event"], event["data"]), ("gap", {"missed": None}))
        with self.begun() as stream:
            first = stream.event()["id"]
        run, number = first.rsplit("-", 1)
        for i in range(600):  # more than are kept
            with self.daemon.client() as client:
                client.call(LENS + ("TakeLease" if i % 2 == 0 else "DropLease"), {"lens": "b"})
            if i % 50 == 0:
                with self.begun(**{"Last-Event-ID": first}) as stream:
                    if stream.event().get("event") == "gap":
                        break
        with self.begun(**{"Last-Event-ID": first}) as stream:
            event = stream.event()
            self.assertEqual(event["event"], "gap")
            self.assertGreater(event["data"]["missed"], 500)
            self.assertEqual(stream.event()["event"], "daemon")
        with self.begun(**{"Last-Event-ID": f"{run}-{int(number) + 10**9}"}) as stream:
            self.assertEqual(stream.event()["data"], {"missed": None})

    def test_the_last_hour(self):
        began = time.time() * 1000 - 1000
        with self.begun() as stream:
            stream.event()
            self.move("a", 100)
            self.until_move(stream)
        events = json.loads(self.web.ask("GET", "/history")[2])["events"]
        moves = [one for one in events if one["event"].get("move") and one["event"]["move"]["position"] == 100]
        self.assertEqual(len(moves), 1)
        self.assertGreater(moves[0]["atMs"], began)
        self.assertFalse(any(one["event"].get("status") for one in events))

    def test_who_comes_and_goes_loses_nobody_an_event(self):
        def moves():
            events = json.loads(self.web.ask("GET", "/history")[2])["events"]
            return sum(one["event"]["lens"] == "a" and one["event"].get("move") is not None for one in events)
        before = moves()
        self.move("a", 0)
        self.wait_for(lambda: moves() == before + 1)  # its event may come after its answer
        before = moves()
        with self.daemon.client() as client:
            for i in range(200):
                stream = self.begun() if i % 2 == 0 else stream
                client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": i % 2}})
                if i % 2 == 1:
                    stream.connection.close()
        self.wait_for(lambda: moves() >= before + 200)
        self.assertEqual(moves(), before + 200)

    def test_one_lens_does_not_push_the_others_out_of_history(self):
        self.move("b", 200)
        for _ in range(1100):  # the lease ends with its call, soon after its answer: two events each
            self.wait_for(lambda: self.web.call("TakeLease", {"lens": "a"})[0] == 200)

        def told():
            events = json.loads(self.web.ask("GET", "/history")[2])["events"]
            return len(events), any(one["event"]["lens"] == "b" and one["event"].get("move") for one in events)
        self.wait_for(lambda: told()[0] == 2000)
        self.assertEqual(told(), (2000, True))


class Relay:
    """Between lensd's socket and a client; it can drop every connection, and then takes none."""

    def __init__(self, target, path):
        self.target, self.ends, self.listener, self.shut = target, [], socket.socket(socket.AF_UNIX), False
        self.listener.bind(path)
        self.listener.listen()
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                near = self.listener.accept()[0]
            except OSError:
                return
            if self.shut:
                near.close()
                continue
            far = socket.socket(socket.AF_UNIX)
            far.connect(self.target)
            self.ends += [near, far]
            for pair in ((near, far), (far, near)):
                threading.Thread(target=self.carry, args=pair, daemon=True).start()

    @staticmethod
    def carry(source, sink):
        try:
            while data := source.recv(65536):
                sink.sendall(data)
        except OSError:
            pass
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def drop(self):
        self.shut = True
        for end in self.ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


class LostMonitorTest(WebTest):
    lenses = ("a",)

    def test_what_happened_while_lensd_was_not_heard_is_counted(self):
        with temporary_folder() as folder:
            path = os.path.join(folder, "relay")
            relay = Relay(self.daemon.socket, path)
            web = Web(path)
            try:
                with Stream(web, "/events") as stream, self.daemon.client() as client:
                    while stream.event()["data"].get("status") is None:
                        pass
                    relay.drop()
                    self.assertFalse(stream.event()["data"]["connected"])
                    for position in (10, 20, 30):
                        client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": position}})
                    relay.shut = False  # lens-web tries again by itself, the first time after 250 ms
                    while (event := stream.event()).get("event") != "gap":
                        pass
                    self.assertEqual(event["data"]["missed"], 3)
            finally:
                self.assertEqual(web.stop(), 0)


class WideTest(WebTest):
    """A lens with deeper pixels."""
    lenses = ("c",)

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        scene = os.path.join(cls.folder.name, "scene.toml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(COLOUR)
        cls.config = f'version = 1\n[[lens]]\nname = "c"\ndriver = "sim"\nscene = "{scene}"\n'
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_raw_has_all_its_bits(self):
        with Stream(self.web, "/live.mjpg?encoding=raw") as stream:
            fields, data = stream.picture()
        picture = json.loads(fields["X-Picture"])["picture"]
        self.assertEqual((picture["bits"], len(data)), (12, 2 * 64 * 48))
        self.assertEqual(fields["Content-Type"], "application/octet-stream")


if __name__ == "__main__":
    unittest.main()
