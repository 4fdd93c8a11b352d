"""Clients that mean no good: many, slow, and senseless. A Stop comes through all the same, and nothing grows without end."""
import contextlib
import json
import os
import random
import socket
import time
import unittest

from web_harness import MOVE_TOKEN, PATIENCE, VIEW_TOKEN, Stream, WebTest, request, temporary_folder, token_file

JSON = {"Content-Type": "application/json"}
LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"


def resident_kib(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS"))


class HostileTest(WebTest):
    def stop_ms(self):
        began = time.monotonic()
        self.assertEqual(self.web.call("Stop", {"lens": "a"}), (200, {}))
        return 1000 * (time.monotonic() - began)

    def median_stop_ms(self):
        return sorted(self.stop_ms() for _ in range(9))[4]

    def test_64_slow_readers(self):
        with contextlib.ExitStack() as stack:
            streams = [stack.enter_context(Stream(self.web, "/live.mjpg?lens=a&encoding=png&rate=60")) for _ in range(64)]
            self.assertEqual({stream.status for stream in streams}, {200})
            self.assertEqual(self.web.ask("GET", "/live.mjpg?lens=a")[0], 503, "the next one is refused")
            self.assertEqual(self.web.ask("GET", "/events")[0], 503)
            before = resident_kib(self.web.process)
            time.sleep(1)
            took = self.median_stop_ms()
            print(f"Stop beside 64 slow readers: {took:.1f} ms; memory grew by {resident_kib(self.web.process) - before} KiB")
            self.assertLess(took, 30 * PATIENCE)
            self.assertLess(resident_kib(self.web.process) - before, 64 * 1024)
        self.wait_for(lambda: self.web.ask("GET", "/history")[0] == 200)
        self.wait_for(lambda: b"\nlens_web_streams 0\n" in self.web.ask("GET", "/metrics")[2])

    def test_slow_loris(self):
        with contextlib.ExitStack() as stack:
            dripping = [stack.enter_context(self.web.connect(60)) for _ in range(300)]  # more than are taken
            for connection in dripping:
                with contextlib.suppress(OSError):
                    connection.sendall(b"POST /call/List HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Drip: ")
            took = self.median_stop_ms()
            print(f"Stop beside 300 unfinished requests: {took:.1f} ms")
            self.assertLess(took, 100 * PATIENCE)
            # One byte a second keeps nobody's connection open for ever.
            last, deadline = dripping[-1], time.monotonic() + 40 * PATIENCE
            with contextlib.suppress(OSError):
                while time.monotonic() < deadline:
                    last.sendall(b"x")
                    last.settimeout(1)
                    with contextlib.suppress(socket.timeout):
                        if not last.recv(4096):
                            break
            self.assertLess(time.monotonic(), deadline, "it was never closed")

    def test_many_calls_that_wait(self):
        """Each viewer's call takes a connection to lensd: those beyond are refused, Stop is not."""
        with contextlib.ExitStack() as stack:
            statuses = []
            for _ in range(50):
                stream = stack.enter_context(Stream(self.web, "/call/Monitor", "POST", "{}", {**JSON, "Accept": "text/event-stream"}))
                statuses.append(stream.status)
            self.assertEqual((statuses.count(200), statuses.count(503)), (40, 10))
            self.stop_ms()
        self.wait_for(lambda: self.web.call("List")[0] == 200)

    def test_fuzzed_requests(self):
        """Changed and cut requests; --long sends 10^7."""
        chance = random.Random(7)
        whole = [request(self.web.port, "POST", "/call/Status", '{"lens":"a"}', JSON),
                 request(self.web.port, "GET", "/live.mjpg?lens=nobody&width=9&x=1"),
                 request(self.web.port, "POST", "/session", '{"token":"abc"}', JSON),
                 request(self.web.port, "GET", "/page.js", headers={"Cookie": "lensd_token=1; a=b", "Range": "bytes=0-1"}),
                 request(self.web.port, "POST", "/call/Plan", json.dumps({"lens": "a", "request": {"limits": []}}), {**JSON, "Authorization": "Bearer x"})]
        before, sent, deadline = resident_kib(self.web.process), 0, time.monotonic() + (86400 if LONG else 3)
        while sent < (10**7 if LONG else 20000) and time.monotonic() < deadline:
            with contextlib.suppress(OSError), self.web.connect() as connection:
                for _ in range(20):
                    data = bytearray(chance.choice(whole))
                    for _ in range(chance.randrange(4)):
                        data[chance.randrange(len(data))] = chance.randrange(256)
                    if chance.random() < 0.2:
                        del data[chance.randrange(len(data)):]
                    connection.sendall(data)
                    sent += 1
                connection.setblocking(False)
                connection.recv(1 << 20)
        print(f"{sent} fuzzed requests; memory grew by {resident_kib(self.web.process) - before} KiB")
        self.assertIsNone(self.web.process.poll())
        self.assertEqual(self.web.call("List")[0], 200)
        self.assertLess(resident_kib(self.web.process) - before, 64 * 1024)


class TokenTest(WebTest):
    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.arguments = ("--token-file", token_file(cls.folder.name))
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_whoever_takes_too_much_takes_it_from_nobody_else(self):
        greedy, other = ({"Authorization": "Bearer " + token} for token in (VIEW_TOKEN, MOVE_TOKEN))
        waits = {**JSON, "Accept": "text/event-stream"}
        with contextlib.ExitStack() as stack:
            taken = {"calls": [], "streams": []}
            for _ in range(25):
                taken["calls"].append(stack.enter_context(Stream(self.web, "/call/Monitor", "POST", "{}", {**waits, **greedy})).status)
            for _ in range(40):
                taken["streams"].append(stack.enter_context(Stream(self.web, "/events", headers=greedy)).status)
            self.assertEqual((taken["calls"].count(200), taken["calls"].count(429)), (20, 5))
            self.assertEqual((taken["streams"].count(200), taken["streams"].count(429)), (32, 8))
            status, told = self.web.call("Status", {"lens": "a"}, **greedy)
            self.assertEqual((status, told["error"]), (429, "TooMany"))
            self.assertIn("this token", told["parameters"]["message"])
            self.assertEqual(self.web.call("Stop", {"lens": "a"}, **greedy)[0], 200)
            # The other one notices nothing of it.
            self.assertEqual(self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 100}}, **other)[0], 200)
            with Stream(self.web, "/events", headers=other) as events:
                self.assertEqual(events.status, 200)
        self.wait_for(lambda: self.web.call("Status", {"lens": "a"}, **greedy)[0] == 200)


if __name__ == "__main__":
    unittest.main()
