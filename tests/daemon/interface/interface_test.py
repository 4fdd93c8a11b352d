"""What the daemon answers is what its interface file says: every reply and every event, field by field, by a reader of
the definition that shares no code with the daemon's."""
import json
import os
import re
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, DaemonTest  # noqa: E402

TOKEN = re.compile(r"#[^\n]*|\s+|(\[string\]|\[\]|->|[A-Za-z][A-Za-z0-9_.]*|[():,?])")


class Definition:
    """A Varlink interface: types by name, and input and output of each method."""

    def __init__(self, text):
        self.tokens = [match.group(1) for match in TOKEN.finditer(text) if match.group(1)]
        self.types, self.methods, self.errors = {}, {}, {}
        assert self.take() == "interface"
        self.name = self.take()
        while self.tokens:
            keyword, name = self.take(), self.take()
            if keyword == "method":
                given = self.parse()
                assert self.take() == "->"
                self.methods[name] = (given, self.parse())
            else:
                {"type": self.types, "error": self.errors}[keyword][name] = self.parse()

    def take(self):
        return self.tokens.pop(0)

    def parse(self):
        token = self.take()
        if token in ("?", "[]", "[string]"):
            return (token, self.parse())
        if token != "(":
            return token
        fields, values = {}, []
        while self.tokens[0] != ")":
            name = self.take()
            if self.tokens[0] == ":":
                self.take()
                fields[name] = self.parse()
            else:
                values.append(name)
            if self.tokens[0] == ",":
                self.take()
        self.take()
        return ("enum", values) if values else ("struct", fields)

    def wrong(self, kind, value, path):
        """Everything in which a value differs from its type."""
        if isinstance(kind, str):
            if kind in self.types:
                return self.wrong(self.types[kind], value, path)
            good = {"bool": isinstance(value, bool), "string": isinstance(value, str) and value != "",
                    "int": isinstance(value, int) and not isinstance(value, bool), "object": isinstance(value, dict),
                    "float": isinstance(value, (int, float)) and not isinstance(value, bool)}[kind]
            return [] if good else [f"{path}: {json.dumps(value)[:80]} is no {kind}"]
        what, inner = kind
        if what == "?":
            return [] if value is None else self.wrong(inner, value, path)
        if what == "enum":
            return [] if value in inner else [f"{path}: {value!r} is none of {inner}"]
        if what == "[]":
            return sum((self.wrong(inner, each, f"{path}[{i}]") for i, each in enumerate(value)), [])
        if not isinstance(value, dict):
            return [f"{path}: {json.dumps(value)[:80]} is no object"]
        found = [f"{path}.{name} is not in the interface" for name in value if name not in inner]
        for name, field in inner.items():
            if name in value:
                found += self.wrong(field, value[name], f"{path}.{name}")
            elif not (isinstance(field, tuple) and field[0] == "?"):
                found.append(f"{path}.{name} is missing")
        return found


class RepliesTest(DaemonTest):
    quick = True

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.daemon.client() as client:
            reply = client.call("org.varlink.service.GetInterfaceDescription", {"interface": "io.lensd.Lens"})
        cls.definition = Definition(reply["parameters"]["description"])

    def judge(self, method, reply):
        self.assertNotIn("error", reply, method)
        self.assertEqual(self.definition.wrong(self.definition.methods[method][1], reply["parameters"], method), [])
        return reply["parameters"]

    def test_every_reply_keeps_to_the_interface(self):
        with self.daemon.client() as client:
            for method, parameters in (
                    ("List", {}), ("Status", {}), ("Metrics", {}), ("Devices", {}),
                    ("Move", {"axis": "focus", "target": {"position": 700}}),
                    ("Move", {"axis": "focus", "target": {"distanceM": 1.5}, "distanceFrom": "sensor"}),
                    ("Move", {"axis": "iris", "target": {"fNumber": 4}}),
                    ("Move", {"axis": "iris", "target": {"fNumber": 5.6}, "keepBrightness": True}),
                    ("Home", {}), ("Home", {"axis": "focus"}), ("GetCalibration", {}),
                    ("Calibrate", {"points": [{"position": 0, "extensionMm": 0}, {"position": 4000, "extensionMm": 0.8}],
                                   "errorUm": 5, "approximate": True}),
                    ("Calibrate", {"remove": True}), ("MeasureBacklash", {"axis": "focus", "size": 3}),
                    ("PresetSave", {"label": "one"}), ("PresetList", {}), ("PresetRecall", {"label": "one"}), ("Undo", {}),
                    ("PresetRemove", {"label": "one"}), ("Autofocus", {}), ("Autofocus", {"conditions": {"exposureMs": 5}}),
                    ("ListFocusShifts", {}),
                    ("FocusAtAdd", {"at": [{"name": "x", "value": 1}]}),
                    ("FocusAtAdd", {"at": [{"name": "x", "value": 3}], "position": 900, "sigma": 2}),
                    ("FocusAtGet", {"at": [{"name": "x", "value": 2}]}), ("FocusAt", {"at": [{"name": "x", "value": 2}]}),
                    ("FocusAtForget", {"sample": 1}), ("FocusAtGet", {}), ("FocusAtForget", {}), ("GetRefocus", {}), ("GetLearned", {}), ("ForgetLearned", {}), ("ForgetDrift", {}), ("Hold", {"untilNs": time.monotonic_ns() + 600 * 10**9}), ("Release", {}), ("TakeLease", {}),
                    ("DropLease", {}), ("Stop", {}), ("ResetFaults", {}),
                    ("Plan", {"request": {"limits": [{"kind": "sharp", "limitUm": 20, "depths": [
                        {"oneEnd": {"distanceM": 1}, "otherEnd": {"distanceM": 1.2}}]}]}, "apply": True,
                              "showRequest": True}),
                    ("Plan", {"request": {"limits": [{"kind": "sharp", "limitUm": 0.1, "depths": [
                        {"oneEnd": {"distanceM": 0.6}, "otherEnd": {"vergenceD": 0}}]}]}}),
                    ("Plan", {"request": {"stack": True, "wavelengthNm": 550, "limits": [
                        {"kind": "sharp", "limitUm": 0.01,
                         "depths": [{"oneEnd": {"distanceM": 1}, "otherEnd": {"distanceM": 1.1}}]}]}})):
                if "lens" in self.definition.methods[method][0][1] and method not in ("Status", "Metrics"):
                    parameters = {"lens": "a", **parameters}
                with self.subTest(method=method, parameters=parameters):
                    self.judge(method, client.call(LENS + method, parameters))

    def test_streams_keep_to_it_and_tell_every_cause(self):
        with self.daemon.client() as client, self.daemon.client() as monitor:
            monitor.send(LENS + "Monitor", {"lens": "b", "minIntervalMs": 10}, more=True)
            for method, parameters, end in (
                    ("Move", {"axis": "focus", "target": {"position": 3000}}, "move"),
                    ("Autofocus", {}, "autofocus"), ("Snapshot", {}, None)):
                client.send(LENS + method, {"lens": "b", **parameters}, more=True)
                reply = {"continues": True}
                while reply.get("continues"):
                    reply = client.receive()
                    told = self.judge(method, reply)
                if end:
                    result = told[end]
                    self.assertEqual(result["cause"] is None, result["reason"] is None)
                    event = {}
                    while end not in event:
                        event = self.judge("Monitor", monitor.receive())["event"]
                    self.assertEqual(event[end], result)

    def test_nothing_of_the_first_names_is_left(self):
        """Of an interface that was changed once, and then kept."""
        names = set()
        kinds = list(self.definition.types.values()) + sum(map(list, self.definition.methods.values()), [])
        while kinds:
            kind = kinds.pop()
            if isinstance(kind, tuple) and kind[0] == "struct":
                names |= set(kind[1])
                kinds += kind[1].values()
            elif isinstance(kind, tuple) and kind[0] != "enum":
                kinds.append(kind[1])
        old = {"steps", "native", "bound", "boundUm", "focusM", "readAtMs", "rateHz", "remark", "focusSteps", "irisSteps",
               "zoomSteps", "filter", "lowSteps", "highSteps"}
        self.assertEqual(names & old, set())
        self.assertNotIn("Calibration", self.definition.methods)
        self.assertNotIn("Backlash", self.definition.methods)


if __name__ == "__main__":
    unittest.main()
