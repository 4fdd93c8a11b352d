"""The rules of the protocol: what closes a connection, what is answered with which error, order, limits."""
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, LENS, PATIENCE, Client, DaemonTest  # noqa: E402

INFO = "org.varlink.service.GetInfo"


class Protocol(DaemonTest):

    def assert_closes(self, data):
        with self.daemon.client() as client:
            client.send_bytes(data)
            self.assertIsNone(client.receive(), data[:80])

    def assert_serves(self):
        with self.daemon.client() as client:
            self.assertEqual(client.call(INFO)["parameters"]["product"], "lensd")

    def test_breaches_close_the_connection_and_nothing_else(self):
        call = '{"method":"%s"' % INFO
        for text in ("", "nonsense", "[]", "1", "{}", '{"method":1}', '{"method":null}', '{"parameters":{}}',
                     call + ',"more":1}', call + ',"oneway":"true"}', call + ',"more":null}',
                     call + ',"more":true,"oneway":true}', call + ',"oneway":true,"upgrade":true}',
                     call + ',"parameters":[]}', call + ',"parameters":1}', call + ',"bogus":1}', call + "} x"):
            with self.subTest(text=text):
                self.assert_closes(text.encode() + b"\0")
        self.assert_closes(b'{"method":"\xff\xfe"}\0')
        self.assert_closes(b'{"method":"x","parameters":' + b'{"a":' * 100000 + b"1" + b"}" * 100001 + b"\0")
        self.assert_closes(b'{"method":"%s","parameters":{"x":' % INFO.encode() + b"[" * 64 + b"]" * 64 + b"}}\0")
        self.assert_closes(b'{"method":"x","parameters":{"x":1e999}}\0')
        self.assert_serves()

    def test_prefixed_members_are_ignored(self):
        with self.daemon.client() as client:
            client.send_bytes(b'{"method":"%s","com.example.hint":1}\0' % INFO.encode())
            self.assertNotIn("error", client.receive())

    def test_a_message_has_at_most_one_mebibyte(self):
        def padded(size):
            start = b'{"method":"%s","com.example.padding":"' % INFO.encode()
            return start + b"x" * (size - len(start) - 2) + b'"}'
        with self.daemon.client() as client:
            client.send_bytes(padded(1 << 20) + b"\0")
            self.assertNotIn("error", client.receive())
        with self.daemon.client() as client:
            try:
                client.send_bytes(padded((1 << 20) + 1) + b"\0")
                self.assertIsNone(client.receive())
            except (BrokenPipeError, ConnectionResetError):
                pass
        with self.daemon.client() as client:  # without an end it is refused all the same
            with self.assertRaises((BrokenPipeError, ConnectionResetError)):
                for _ in range(64):
                    client.send_bytes(b"x" * 65536)
        self.assert_serves()

    def test_absent_null_and_empty_parameters_are_equal(self):
        with self.daemon.client() as client:
            replies = [client.call(INFO), client.call(INFO, {})]
            client.send_bytes(b'{"method":"%s","parameters":null}\0' % INFO.encode())
            replies.append(client.receive())
        self.assertEqual(replies[0], replies[1])
        self.assertEqual(replies[0], replies[2])

    def test_one_byte_at_a_time(self):
        with self.daemon.client() as client:
            for byte in b'{"method":"%s"}\0' % INFO.encode() * 2:
                client.send_bytes(bytes([byte]))
            self.assertEqual(client.receive(), client.receive())

    def test_pipelined_calls_are_answered_in_order(self):
        with self.daemon.client() as client:
            names = ["io.lensd.Lens", "org.varlink.service", "none.such"] * 200
            client.send_bytes(b"".join(
                json.dumps({"method": "org.varlink.service.GetInterfaceDescription",
                            "parameters": {"interface": name}}).encode() + b"\0" for name in names))
            for name in names:
                reply = client.receive()
                if name == "none.such":
                    self.assertEqual(reply["error"], "org.varlink.service.InterfaceNotFound")
                    self.assertEqual(reply["parameters"], {"interface": name})
                else:
                    self.assertIn(f"interface {name}\n", reply["parameters"]["description"])

    def test_a_slow_call_holds_back_the_ones_behind_it(self):
        with self.daemon.client() as client:
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"relative": 100}})
            client.send(INFO)
            self.assertIn("move", client.receive()["parameters"])
            self.assertIn("product", client.receive()["parameters"])

    def test_oneway_is_never_answered(self):
        with self.daemon.client() as client:
            client.send(INFO, oneway=True)
            client.send("none.such.Method", oneway=True)
            client.send(LENS + "Move", {"bogus": 1}, oneway=True)
            client.send(LENS + "Stop", {"lens": "a"}, oneway=True)
            self.assertIn("lenses", client.call(LENS + "List")["parameters"])

    def test_a_last_oneway_call_counts(self):
        before = self.position()["target"]
        with self.daemon.client() as client:
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"relative": 7}}, oneway=True)
        self.wait_for(lambda: self.position()["target"] == before + 7)

    def test_of_many_last_calls_those_that_want_no_reply_count(self):
        def labels():
            with self.daemon.client() as client:
                return {preset["label"] for preset in client.call(LENS + "PresetList", {"lens": "a"})["parameters"]["presets"]}

        sent = b"".join(json.dumps({"method": LENS + "PresetSave", "parameters": {"lens": "a", "label": f"last {number}"},
                                    "oneway": True}).encode() + b"\0" for number in range(60))
        wanted = json.dumps({"method": LENS + "PresetSave", "parameters": {"lens": "a", "label": "asked for"}}).encode() + b"\0"
        with self.daemon.client() as client:
            client.send_bytes(sent + wanted + sent.replace(b"last", b"very last"))
        expected = {f"{word} {number}" for word in ("last", "very last") for number in range(60)}
        self.wait_for(lambda: expected <= labels())

    def test_a_half_closed_client_gets_its_answers(self):
        with self.daemon.client() as client:
            client.send(INFO)
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"relative": 20}})
            client.socket.shutdown(socket.SHUT_WR)
            self.assertIn("product", client.receive()["parameters"])
            self.assertIn("move", client.receive()["parameters"])
            self.assertIsNone(client.receive())

    def test_errors_of_the_protocol(self):
        service = "org.varlink.service."
        for method, parameters, flags, error, details in (
                ("none.such.Method", None, {}, "InterfaceNotFound", {"interface": "none.such"}),
                ("nodots", None, {}, "InterfaceNotFound", {"interface": ""}),
                (LENS + "Nothing", None, {}, "MethodNotFound", {"method": "Nothing"}),
                (LENS + "List", {"x": 1}, {}, "InvalidParameter", {"parameter": "x"}),
                (LENS + "Status", {"lens": 3}, {}, "InvalidParameter", {"parameter": "lens"}),
                (LENS + "Move", {"lens": "a", "axis": "focus"}, {}, "InvalidParameter", {"parameter": "target"}),
                (LENS + "Move", {"axis": "nose", "target": {}}, {}, "InvalidParameter", {"parameter": "axis"}),
                (LENS + "Move", {"axis": "focus", "target": {"position": "1"}}, {}, "InvalidParameter",
                 {"parameter": "target.position"}),
                (LENS + "Plan", {"request": {"limits": [{"kind": "sharp", "limitUm": 1, "depths": [], "x": 1}]}}, {},
                 "InvalidParameter", {"parameter": "request.limits[0].x"}),
                (LENS + "Move", {"axis": "focus", "target": {"distanceM": 1}, "distanceFrom": "nose"}, {},
                 "InvalidParameter", {"parameter": "distanceFrom"}),
                (LENS + "Autofocus", {"lens": "a", "policy": "any"}, {}, "InvalidParameter", {"parameter": "policy"}),
                (LENS + "List", None, {"more": True}, "InvalidParameter", {"parameter": "more"}),
                (LENS + "Home", {"lens": "a"}, {"more": True}, "InvalidParameter", {"parameter": "more"}),
                (LENS + "Plan", {"request": {}}, {"more": True}, "InvalidParameter", {"parameter": "more"}),
                (LENS + "PresetList", {"lens": "a"}, {"more": True}, "InvalidParameter", {"parameter": "more"}),
                (LENS + "Monitor", None, {}, "ExpectedMore", None),
                (LENS + "Snapshot", {"lens": "a"}, {}, "ExpectedMore", None),
                (INFO, None, {"upgrade": True}, "MethodNotImplemented", {"method": "GetInfo"})):
            with self.subTest(method=method, parameters=parameters), self.daemon.client() as client:
                reply = client.call(method, parameters, **flags)
                self.assertEqual(reply["error"], service + error)
                self.assertEqual(reply.get("parameters") or None, details)

    def test_errors_of_the_lenses(self):
        for parameters, error in (({"lens": "nope", "axis": "focus", "target": {"position": 1}}, "LensNotFound"),
                                  ({"axis": "focus", "target": {"position": 1}}, "InvalidRequest"),
                                  ({"lens": "a", "axis": "focus", "target": {}}, "InvalidRequest"),
                                  ({"lens": "a", "axis": "focus", "target": {"position": 1, "nearer": 1}},
                                   "InvalidRequest"),
                                  ({"lens": "a", "axis": "focus", "target": {"position": 1e9}}, "OutOfRange"),
                                  ({"lens": "a", "axis": "focus", "target": {"distanceM": 0.01}}, "OutOfRange"),
                                  ({"lens": "a", "axis": "zoom", "target": {"position": 1}}, "Unsupported")):
            with self.subTest(parameters=parameters), self.daemon.client() as client:
                reply = client.call(LENS + "Move", parameters)
                self.assertEqual(reply["error"], LENS + error)
                self.assertGreater(len(reply["parameters"]["message"]), 10)

    def test_eighty_clients_of_an_administrator_and_not_one_more(self):
        clients = [self.daemon.client() for _ in range(64 + 16)]
        for client in clients:
            self.assertIn("parameters", client.call(INFO))
        with self.daemon.client() as extra:
            reply = extra.call(INFO)
            self.assertEqual(reply["error"], LENS + "Busy")
            self.assertIsNone(extra.receive())
        refused = self.daemon.lensctl("list")
        self.assertEqual(refused.returncode, 4, refused.stderr)
        self.assertIn("64 connections", refused.stderr)
        for client in clients:
            client.socket.close()
        self.wait_for(lambda: self.daemon.lensctl("list").returncode == 0)

    def test_answers_nobody_reads_hold_back_only_the_calls_behind_them(self):
        with self.daemon.client() as sleeper, self.daemon.client() as other:
            for _ in range(2000):
                sleeper.send("org.varlink.service.GetInterfaceDescription", {"interface": "io.lensd.Lens"})
            self.assertIn("parameters", other.call(INFO))
            for _ in range(2000):
                self.assertIn("interface", sleeper.receive()["parameters"]["description"])


class SlowReader(unittest.TestCase):
    """Against the test server, which can be told to flood a client."""

    def test_a_client_that_does_not_read_a_stream_is_dropped(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "s")
            server = subprocess.Popen([os.path.join(BIN, "certification_server"), path], stderr=subprocess.DEVNULL)
            try:
                sleeper = connect_patiently(path)
                sleeper.send("io.lensd.test.Flood", {"megabytes": 16}, more=True)
                with Client(path) as other:
                    self.assertIn("parameters", other.call(INFO))
                received = 0
                while sleeper.receive() is not None:
                    received += 1
                sleeper.socket.close()
                # The queue holds 4 MiB of messages of 1 KiB, the kernel some more; never all 16.
                self.assertLess(received, 5 << 10)
                with Client(path) as reader:
                    reader.send("io.lensd.test.Flood", {"megabytes": 1}, more=True)
                    replies = [reader.receive() for _ in range(1025)]
                self.assertTrue(all(reply["continues"] for reply in replies[:1024]))
                self.assertNotIn("continues", replies[1024])
            finally:
                server.terminate()
                self.assertEqual(server.wait(timeout=30), 0)


def connect_patiently(path):
    deadline = time.monotonic() + 20 * PATIENCE
    while True:
        try:
            return Client(path)
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.02)


if __name__ == "__main__":
    unittest.main()
