"""The interface keeps to its rules of growth: what a client of 1.0 relies on stays."""
import os
import re
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from event_stream import definition_of  # noqa: E402
from harness import HERE, LENS, DaemonTest  # noqa: E402
from interface_test import Definition  # noqa: E402


def broken_promises(before, after):
    """In what `after` breaks the rules of growth: what a client written for `before` would stumble over."""
    found = []

    def kept(old, new, path, given):
        if isinstance(old, str) or isinstance(new, str) or old[0] != new[0]:
            return [] if old == new else [f"{path}: {old} became {new}"]
        if old[0] == "enum":
            return [f"{path}: {word} is gone" for word in old[1] if word not in new[1]]
        if old[0] != "struct":
            return kept(old[1], new[1], path, given)
        wrong = []
        for name, kind in old[1].items():
            wrong += kept(kind, new[1][name], f"{path}.{name}", given) if name in new[1] else [f"{path}.{name} is gone"]
        return wrong + [f"{path}.{name} must be given" for name, kind in new[1].items()
                        if given and name not in old[1] and kind[0] != "?"]

    given_types = set()
    def given_by_clients(kind):
        if isinstance(kind, str):
            if kind in before.types and kind not in given_types:
                given_types.add(kind)
                given_by_clients(before.types[kind])
        elif kind[0] == "struct":
            for inner in kind[1].values():
                given_by_clients(inner)
        elif kind[0] != "enum":
            given_by_clients(kind[1])

    for given, _ in before.methods.values():
        given_by_clients(given)
    for what in ("types", "methods", "errors"):
        for name, old in getattr(before, what).items():
            new = getattr(after, what).get(name)
            if new is None:
                found.append(f"{name} is gone")
            elif what == "methods":
                found += kept(old[0], new[0], name, True) + kept(old[1], new[1], name + " ->", False)
            else:
                found += kept(old, new, name, what == "types" and name in given_types)
    return found


class Growth(DaemonTest):
    lenses = ("a",)

    def test_nothing_of_1_0_is_gone_or_another_thing(self):
        with open(os.path.join(HERE, "interface-1.0.varlink"), encoding="utf-8") as file:
            first = Definition(file.read())
        now = Definition(definition_of(self.daemon))
        self.assertEqual(broken_promises(first, now), [], "1.0 stays as it is; see the rules of growth in docs/interface.md")

    def test_the_rules_see_what_breaks_them_and_let_grow_what_may(self):
        text = definition_of(self.daemon)
        now = Definition(text)
        for old, new, wrong in (("  fNumber: ?float,\n", "  fStop: ?float,\n", ".fNumber is gone"),
                                ("  step: int,\n", "  step: float,\n", "step: int became float"),
                                ("method Stop(lens: ?string", "method Stop(lens: string", "Stop.lens"),
                                ("method Stop(", "method Stop(hard: bool, ", "Stop.hard must be given"),
                                ("type Size (\n", "type Size (\n  more: int,\n", "Size.more must be given"),
                                ("(nearest, farthest, widest)", "(nearest, widest)", "farthest is gone"),
                                ("error Leased (message: string, ", "error Leased (", "Leased.message is gone"),
                                ("method Metrics(", "method Measures(", "Metrics is gone")):
            self.assertIn(old, text)
            found = broken_promises(now, Definition(text.replace(old, new)))
            self.assertTrue(any(wrong in each for each in found), (wrong, found))
        for old, new in (("method Stop(", "method Stop(hard: ?bool, "), ("(nearest, farthest, widest)", "(nearest, farthest, widest, best)"),
                         ("  step: int,\n", "  step: int,\n  more: int,\n"), ("method Metrics(", "method New() -> ()\nmethod Metrics("),
                         ("type Size (\n", "type Size (\n  more: ?int,\n"), ("error Leased (", "error Leased (since: float, ")):
            self.assertIn(old, text)
            self.assertEqual(broken_promises(now, Definition(text.replace(old, new))), [], new)

    def test_features_are_those_that_the_comments_name(self):
        with self.daemon.client() as client:
            features = client.call(LENS + "List")["parameters"]["features"]
        comments = " ".join(line.strip().lstrip("# ") for line in definition_of(self.daemon).splitlines() if "#" in line)
        named = set(re.findall(r'Feature "([^"]+)"', comments)) - {"name"}  # "name" is how the rule itself is written
        self.assertEqual(set(features), named)
        self.assertEqual(len(features), len(set(features)))


if __name__ == "__main__":
    unittest.main()
