"""Calls over HTTP: what lensd answers comes through as it is, with the status that fits; and who may ask at all."""
import json
import os
import re
import shutil
import socketserver
import subprocess
import tempfile
import threading
import time
import unittest

from web_harness import BIN, HERE, LENS, MOVE_TOKEN, VIEW_TOKEN, Daemon, Reader, Stream, Web, WebTest, request, temporary_folder, token_file

# Of Debian's package prometheus, or where script/bootstrap long puts it.
UNPACKED = os.path.join(HERE, "..", "..", "build", "promtool", "usr", "bin", "promtool")
PROMTOOL = shutil.which("promtool") or shutil.which(UNPACKED)
JSON = {"Content-Type": "application/json"}


class Refusing(socketserver.StreamRequestHandler):
    """Answers a call with the error that its parameters name."""

    def handle(self):
        message = b""
        while not message.endswith(b"\0"):
            data = self.request.recv(65536)
            if not data:
                return
            message += data
        name = json.loads(message[:-1]).get("parameters", {}).get("name", LENS + "Internal")
        self.request.sendall(json.dumps({"error": name, "parameters": {"message": "no"}}).encode() + b"\0")


class StatusTest(unittest.TestCase):
    """Every error of the interface, and those of Varlink itself, has its status."""
    STATUSES = {400: "InvalidRequest OutOfRange BadData InvalidParameter ExpectedMore", 403: "NotPermitted",
                404: "LensNotFound PresetNotFound MethodNotFound InterfaceNotFound",
                409: "Busy Leased Superseded Cancelled NotHomed", 501: "Unsupported MethodNotImplemented",
                502: "Disconnected DeviceError ProtocolError", 503: "Overrun", 504: "Timeout"}

    def test_every_error(self):
        with open(os.path.join(HERE, "..", "..", "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
            names = [LENS + name for name in re.findall(r"^error (\w+)", file.read(), re.MULTILINE)]
        names += ["org.varlink.service." + name for name in ("InterfaceNotFound", "MethodNotFound", "MethodNotImplemented",
                                                             "InvalidParameter", "ExpectedMore", "PermissionDenied")]
        names += [LENS + "OfANewerLensd", "a.b.C"]
        self.assertGreater(len(names), 25)
        right = {name: status for status, words in self.STATUSES.items() for name in words.split()}
        with tempfile.TemporaryDirectory(prefix="lensd-status-") as folder, \
                socketserver.ThreadingUnixStreamServer(os.path.join(folder, "false"), Refusing) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            web = Web(server.server_address)
            try:
                for name in names:
                    status, told = web.call("Status", {"name": name})
                    self.assertEqual((status, told["error"]), (right.get(name.rsplit(".", 1)[1], 500), name))
            finally:
                self.assertEqual(web.stop(), 0)
                server.shutdown()


class CallTest(WebTest):
    def test_an_answer_is_lensds_own(self):
        status, listed = self.web.call("List")
        with self.daemon.client() as client:
            self.assertEqual((status, listed), (200, client.call(LENS + "List")["parameters"]))

    def test_a_move_is_made_and_told(self):
        status, told = self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 250}})
        self.assertEqual((status, told["move"]["reached"], told["move"]["position"]), (200, True, 250))
        with self.daemon.client() as client:
            axes = client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]["axes"]
        self.assertEqual(axes[0]["position"], 250)

    def test_errors_have_lensds_fields_and_a_status(self):
        cases = [("Status", {"lens": "nobody"}, 404, "LensNotFound"),
                 ("Move", {"lens": "a", "axis": "focus", "target": {"position": 1e6}}, 400, "OutOfRange"),
                 ("Move", {"lens": "a", "axis": "focus", "target": {}}, 400, "InvalidRequest"),
                 ("Status", {"what": 1}, 400, "InvalidParameter"),
                 ("Monitor", {}, 400, "ExpectedMore"),
                 ("Nothing", {}, 404, "MethodNotFound"),
                 ("Move", {"lens": "a", "axis": "zoom", "target": {"position": 1}}, 501, "Unsupported")]
        for method, parameters, status, error in cases:
            with self.subTest(error=error):
                got, told = self.web.call(method, parameters)
                self.assertEqual((got, told["error"].split(".")[-1]), (status, error))
        _, told = self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 1e6}})
        self.assertEqual((told["parameters"]["maximum"], told["parameters"]["unit"]), (4000, "steps"))

    def test_errors_may_come_as_answers(self):
        for headers in ({}, {"Accept": "text/event-stream"}):
            status, fields, body = self.web.ask("POST", "/call/Status?errors=body", '{"lens":"nobody"}', {**JSON, **headers})
            self.assertEqual((status, fields["content-type"], json.loads(body)["error"]), (200, "application/json", LENS + "LensNotFound"))

    def test_more_streams_every_reply(self):
        body = json.dumps({"lens": "b", "axis": "focus", "target": {"relative": 300}})
        with Stream(self.web, "/call/Move", "POST", body, {**JSON, "Accept": "text/event-stream"}) as stream:
            self.assertEqual((stream.status, stream.fields["content-type"]), (200, "text/event-stream"))
            replies = [stream.event()["data"]]
            while "move" not in replies[-1]:
                replies.append(stream.event()["data"])
            self.assertTrue(replies[-1]["move"]["reached"])
            self.assertIn("progress", replies[0])
            self.assertEqual(stream.reader.chunk(), b"", "the stream ends with its call")

    def test_a_stream_that_fails_at_once_is_no_stream(self):
        status, _, body = self.web.ask("POST", "/call/Monitor", '{"lens":"nobody"}', {**JSON, "Accept": "text/event-stream"})
        self.assertEqual((status, json.loads(body)["error"]), (404, LENS + "LensNotFound"))

    def test_who_leaves_ends_the_call(self):
        body = json.dumps({"lens": "a", "track": True})
        with Stream(self.web, "/call/Autofocus", "POST", body, {**JSON, "Accept": "text/event-stream"}) as stream:
            stream.event()
            self.assertEqual(self.activity("a"), "autofocus")
        self.wait_for(lambda: self.activity("a") == "idle")

    def activity(self, lens):
        return self.web.call("Status", {"lens": lens})[1]["lenses"][0]["activity"]

    def test_stop_comes_through_while_its_connection_waits_for_nothing(self):
        self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 0}})
        with self.web.connect() as moving:
            moving.sendall(request(self.web.port, "POST", "/call/Move", json.dumps(
                {"lens": "a", "axis": "focus", "target": {"position": 4000}}), JSON))
            self.wait_for(lambda: self.activity("a") == "moving")
            began = time.monotonic()
            self.assertEqual(self.web.call("Stop", {"lens": "a"}), (200, {}))
            print(f"Stop answered after {1000 * (time.monotonic() - began):.1f} ms")
            status, _, body = Reader(moving).answer()
        self.assertEqual((status, json.loads(body)["error"]), (409, LENS + "Cancelled"))

    def test_one_connection_takes_many_requests(self):
        with self.web.connect() as connection:
            reader = Reader(connection)
            for _ in range(3):
                connection.sendall(request(self.web.port, "POST", "/call/List", "{}", JSON))
                self.assertEqual(reader.answer()[0], 200)

    def test_what_is_no_call(self):
        for path, body, headers, status in (("/call/List", "[]", JSON, 400), ("/call/List", "{", JSON, 400),
                                            ("/call/a/b", "{}", JSON, 404), ("/call/org.varlink.service.GetInfo", "{}", JSON, 404),
                                            ("/call/View", '{"fd":true}', JSON, 400),
                                            ("/call/List", "{}", {"Content-Type": "text/plain"}, 415), ("/call/List", "{}", {}, 415),
                                            ("/call/List", "x" * ((1 << 20) + 1), JSON, None)):
            with self.subTest(path=path, status=status):
                try:
                    got = self.web.ask("POST", path, body, headers)[0]
                except (EOFError, ConnectionError):
                    got = None  # too long: the connection ends
                self.assertEqual(got, status)
        self.assertEqual(self.web.ask("GET", "/call/List")[0], 405)
        self.assertEqual(self.web.ask("DELETE", "/")[0], 405)

    def test_the_page_and_nothing_else_is_served(self):
        for path in ("/", "/page.js", "/blur.js", "/shots.js", "/page.css", "/uplot.js", "/uplot.css", "/favicon.ico"):
            status, fields, body = self.web.ask("GET", path)
            self.assertEqual((status, fields["x-content-type-options"]), (200, "nosniff"))
            self.assertIn("default-src 'none'", fields["content-security-policy"])
            self.assertGreater(len(body), 100)
        for path in ("/../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/page/page.js", "/page.js/", "/\\", "/%00", "/page.js%00"):
            self.assertEqual(self.web.ask("GET", path)[0], 404, path)

    def test_metrics_are_prometheus_text(self):
        self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 100}})
        status, fields, body = self.web.ask("GET", "/metrics")
        self.assertEqual((status, fields["content-type"]), (200, "text/plain; version=0.0.4; charset=utf-8"))
        lines = body.decode().splitlines()
        values = dict(line.rsplit(" ", 1) for line in lines if not line.startswith("#"))
        self.assertEqual((float(values["lensd_up"]), float(values['lensd_axis_position{lens="a",axis="focus"}'])), (1, 100))
        self.assertGreaterEqual(float(values['lensd_moves_total{lens="a"}']), 1)
        kinds = dict(line.split()[2:] for line in lines if line.startswith("# TYPE"))
        histograms = {name for name, kind in kinds.items() if kind == "histogram"}
        self.assertEqual(histograms, {"lensd_command_wait_seconds", "lensd_settle_seconds"})
        names = {each.split("{")[0] for each in values}
        parts = {name + part for name in histograms for part in ("_bucket", "_sum", "_count")}
        self.assertEqual(names, parts | set(kinds) - histograms)
        for name in histograms:
            ends = [(float(end), float(count)) for each, count in values.items()
                    for end in re.findall(name + r'_bucket\{lens="a",le="(.*)"\}', each)]
            self.assertEqual(ends, sorted(ends), "buckets hold those before them")
            self.assertEqual(ends[-1], (float("inf"), float(values[name + '_count{lens="a"}'])))
            self.assertEqual(sorted(count for _, count in ends), [count for _, count in ends])
        self.assertGreater(float(values['lensd_settle_seconds_sum{lens="a"}']), 0.05)  # 100 steps at 1,000 a second
        self.assertLess(float(values['lensd_settle_seconds_sum{lens="a"}']), 60)
        self.assertEqual((values['lensd_openings_total{lens="a"}'], values["lensd_files_waiting"]), ("1", "0"))

    @unittest.skipUnless(PROMTOOL, "promtool is not here: script/bootstrap long")
    def test_promtool_takes_the_metrics(self):
        self.web.call("Move", {"lens": "a", "axis": "focus", "target": {"position": 120}})
        for body in (self.web.ask("GET", "/metrics")[2], self.web.ask("GET", "/metrics")[2]):
            checked = subprocess.run([PROMTOOL, "check", "metrics"], input=body, capture_output=True, check=False)
            self.assertEqual((checked.returncode, checked.stderr), (0, b""))


class AccessTest(WebTest):
    def setUp(self):
        self.host = f"127.0.0.1:{self.web.port}"

    def status(self, **headers):
        return self.web.ask("POST", "/call/List", "{}", {**JSON, **headers})[0]

    def test_only_our_own_host_is_served(self):
        for host in ("evil.example", f"evil.example:{self.web.port}", "127.0.0.1.evil.example", "", "localhost.", "[::2]", "127.0.0.1@evil"):
            self.assertEqual(self.status(Host=host), 421, host)
        for host in (f"localhost:{self.web.port}", "LOCALHOST:9", "127.0.0.1", "[::1]:80"):
            self.assertEqual(self.status(Host=host), 200, host)
        self.assertIn(self.status(Host=None), (400, 421))

    def test_pages_of_elsewhere_are_refused(self):
        for origin in ("http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1.evil.example", f"ftp://{self.host}"):
            self.assertEqual(self.status(Origin=origin), 403, origin)
        self.assertEqual(self.status(Origin=f"http://{self.host}"), 200)
        self.assertEqual(self.web.ask("GET", "/live.mjpg?lens=a", headers={"Sec-Fetch-Site": "cross-site"})[0], 403)
        self.assertEqual(self.web.ask("GET", "/", headers={"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"})[0], 200)
        self.assertEqual(self.web.ask("GET", "/metrics", headers={"Sec-Fetch-Site": "same-origin"})[0], 200)


class TokenTest(WebTest):
    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.arguments = ("--token-file", token_file(cls.folder.name), "--host", "lenses.example")
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def call(self, token, method, parameters=None):
        return self.web.call(method, parameters, Authorization=f"Bearer {token}")[0]

    def test_nothing_without_a_token(self):
        for token in ("", "x", VIEW_TOKEN[:-1], VIEW_TOKEN + "v", MOVE_TOKEN.upper()):
            self.assertEqual(self.call(token, "List"), 401)
        for path in ("/metrics", "/events", "/history", "/live.mjpg", "/snapshot.png", "/nothing"):
            self.assertEqual(self.web.ask("GET", path)[0], 401, path)
        self.assertEqual(self.web.ask("GET", "/")[0], 200)

    def test_who_looks_on_may_stop_and_not_move(self):
        move = {"lens": "a", "axis": "focus", "target": {"relative": 1}}
        plan = {"lens": "a", "request": {"limits": [{"kind": "sharp", "limitUm": 10, "depths": [
            {"oneEnd": {"distanceM": 1.2}, "otherEnd": {"distanceM": 1.2}}]}]}}
        for method, parameters in (("Status", {}), ("List", {}), ("Stop", {"lens": "a"}), ("io.lensd.Lens.Stop", {"lens": "a"}), ("Plan", plan)):
            self.assertEqual(self.call(VIEW_TOKEN, method, parameters), 200, method)
        for method, parameters in (("Move", move), ("io.lensd.Lens.Move", move), ("Plan", {**plan, "apply": True}), ("Reload", {}),
                                   ("io.lensd.Simulator.Inject", {"lens": "a", "kind": "stall"}), ("Home", {"lens": "a"})):
            self.assertEqual(self.call(VIEW_TOKEN, method, parameters), 403, method)
        self.assertEqual(self.call(MOVE_TOKEN, "Move", move), 200)

    def test_who_looks_on_may_call_what_only_tells(self):
        """Every method: those of lenses that read and do nothing else, and Stop."""
        with open(os.path.join(HERE, "..", "..", "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
            methods = re.findall(r"^method (\w+)", file.read(), re.MULTILINE)
        self.assertGreater(len(methods), 40)
        reads = re.compile("Get.*|List.*|.*List|.*Get|Status|Metrics|Monitor|Devices|Snapshot|View|Stop|Plan")
        for method in methods:
            # No such parameter: who may call is told from who may not, and nothing is done.
            told = self.web.call(method, {"nonsense": 1}, Authorization=f"Bearer {VIEW_TOKEN}")
            self.assertEqual(told[0], 400 if reads.fullmatch(method) else 403, (method, told))

    def test_a_page_gets_a_cookie_for_its_token(self):
        def session(token):
            return self.web.ask("POST", "/session", json.dumps({"token": token}), JSON)
        self.assertEqual(session("nonsense")[0], 401)
        status, fields, body = session(MOVE_TOKEN)
        self.assertEqual((status, json.loads(body)), (200, {"role": "move", "tokenNeeded": True}))
        self.assertIn("httponly", fields["set-cookie"])
        self.assertIn("samesite=strict", fields["set-cookie"])
        cookie = fields["set-cookie"].split(";")[0]
        self.assertEqual(self.web.call("List", Cookie=cookie)[0], 200)
        self.assertEqual(json.loads(self.web.ask("GET", "/session", headers={"Cookie": cookie})[2])["role"], "move")

    def test_a_proxys_name_is_served(self):
        headers = {"Host": "lenses.example", "Origin": "https://lenses.example", "Authorization": f"Bearer {MOVE_TOKEN}"}
        self.assertEqual(self.web.call("List", **headers)[0], 200)


class StartTest(unittest.TestCase):
    def run_web(self, *arguments):
        done = subprocess.run([os.path.join(BIN, "lens-web"), *arguments], capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, done.stderr

    def test_what_cannot_be_is_refused(self):
        status, told = self.run_web("--listen", "0.0.0.0:0")
        self.assertEqual(status, 64)
        self.assertIn("--token-file", told)
        self.assertEqual(self.run_web("--listen", "nowhere")[0], 64)
        with temporary_folder() as folder:
            self.assertEqual(self.run_web("--token-file", os.path.join(folder, "none"))[0], 74)
            self.assertEqual(self.run_web("--listen", "127.0.0.1:0", "--token-file", token_file(folder, 0o644))[0], 74)
            for text in ("", "move short\n", "admin " + "x" * 40 + "\n", "move " + "x" * 40 + " more\n"):
                path = os.path.join(folder, "bad")
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                os.chmod(path, 0o600)
                self.assertEqual(self.run_web("--listen", "127.0.0.1:0", "--token-file", path)[0], 78, text)

    def test_lensd_may_come_later_and_go(self):
        with temporary_folder() as folder:
            path = os.path.join(folder, "s")
            web = Web(path)
            try:
                status, told = web.call("List")
                self.assertEqual((status, told["error"]), (503, "NoDaemon"))
                self.assertIn("start lensd", told["parameters"]["message"])
                self.assertIn(b"\nlensd_up 0\n", web.ask("GET", "/metrics")[2])
                with Stream(web, "/events") as stream:
                    self.assertFalse(stream.event()["data"]["connected"])
                    daemon = Daemon(("a",))
                    os.symlink(daemon.socket, path)
                    event = stream.event()
                    while event.get("event") != "daemon" or not event["data"]["connected"]:
                        event = stream.event()
                    while "status" not in event["data"]:
                        event = stream.event()
                    self.assertEqual(web.call("List")[0], 200)
                    self.assertEqual(daemon.stop(), 0)
                    while event.get("event") != "daemon":
                        event = stream.event()
                    self.assertFalse(event["data"]["connected"])
            finally:
                self.assertEqual(web.stop(), 0)


if __name__ == "__main__":
    unittest.main()
