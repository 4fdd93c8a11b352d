"""A monitor for tests, which holds every event against the interface and against its own numbers."""
import json
import os
import socket
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "interface"))
from harness import LENS, PATIENCE, Client  # noqa: E402
from interface_test import Definition  # noqa: E402

PASSING = {"status", "progress"}
FRAME = {"instance", "lens", "sequence", "lasting"}


def definition_of(daemon):
    with daemon.client() as client:
        reply = client.call("org.varlink.service.GetInterfaceDescription", {"interface": "io.lensd.Lens"})
    return reply["parameters"]["description"]


def kind_of(event):
    """The one field that says what happened."""
    kinds = set(event) - FRAME
    assert len(kinds) == 1, event
    return kinds.pop()


class Stream:
    """A monitor that believes nothing: every event is held against the interface and against its numbers."""

    def __init__(self, daemon, timeout=10 * PATIENCE, buffer=None, **parameters):
        self.definition = Definition(definition_of(daemon))
        self.client = Client(daemon.socket, timeout)
        if buffer:
            self.client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        self.client.send(LENS + "Monitor", parameters, more=True)
        self.last, self.told, self.instance, self.end = {}, [], None, None

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.client.socket.close()

    def next(self):
        """The next event, None once the stream has ended."""
        reply = self.client.receive()
        assert reply is not None, "lensd closed the connection"
        if "error" in reply:
            self.end = reply
            return None
        wrong = self.definition.wrong(self.definition.methods["Monitor"][1], reply["parameters"], "Monitor")
        assert not wrong, wrong
        event = reply["parameters"]["event"]
        kind, lens = kind_of(event), event["lens"]
        self.instance = self.instance or event["instance"]
        assert event["instance"] == self.instance, event
        if lens in self.last:
            before = self.last[lens]
            assert event["sequence"] > before["sequence"], (before, event)
            assert event["lasting"] == before["lasting"] + (kind not in PASSING), (before, event)
        else:
            assert kind in ("status", "list"), event  # first where it stands, or that it is new
        for inner in ("status", "move", "autofocus", "backlash"):
            if inner in event:
                assert lens in (event[inner].get("lens"), event[inner].get("name")), event
        self.last[lens] = event
        self.told.append(event)
        return event

    def until(self, wanted):
        """The next event for which `wanted(kind, value, lens)` is true."""
        deadline = time.monotonic() + 10 * PATIENCE
        while time.monotonic() < deadline:
            event = self.next()
            assert event is not None, self.end
            kind = kind_of(event)
            if wanted(kind, event[kind], event["lens"]):
                return event
        raise AssertionError("it never came; the last were " + json.dumps(self.told[-5:]))

    def of(self, kind, **values):
        found = self.until(lambda is_kind, value, _: is_kind == kind and
                           all(value.get(name) == wanted for name, wanted in values.items()))
        return found[kind]


def numbers(event):
    return event["sequence"], event["lasting"]
