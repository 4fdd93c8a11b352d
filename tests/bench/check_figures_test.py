"""script/check-figures finds figures that evidence does not say, and those that no evidence stands behind."""
import importlib.machinery
import importlib.util
import os
import unittest

SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "script", "check-figures")
loader = importlib.machinery.SourceFileLoader("check_figures", SCRIPT)
checker = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_figures", loader))
loader.exec_module(checker)

ROWS = {("measure", "1080p", "lensd", "time", ""): {"middle": "0.30812", "unit": "ms"},
        ("autofocus", "page", "auto", "within", "30"): {"middle": "0.9875", "unit": "share"}}


class CheckFiguresTest(unittest.TestCase):
    def found(self, text):
        problems, untraced = checker.check("x.md", text, ROWS)
        return len(problems), untraced

    def test_right_figures_pass(self):
        self.assertEqual(self.found("takes 0.31 ms<!-- evidence: measure :: 1080p :: lensd :: time -->"), (0, []))
        self.assertEqual(self.found("98.8 %<!-- evidence: autofocus :: page :: auto :: within :: 30 -->"), (0, []))

    def test_planted_figures_are_found(self):
        self.assertEqual(self.found("takes 0.29 ms<!-- evidence: measure :: 1080p :: lensd :: time -->")[0], 1)
        self.assertEqual(self.found("takes 0.31 ms<!-- evidence: measure :: 4k :: lensd :: time -->")[0], 1)
        self.assertEqual(self.found("takes 0.31 ms<!-- evidence: measure -->")[0], 1)
        self.assertEqual(self.found("quick<!-- evidence: measure :: 1080p :: lensd :: time -->")[0], 1)

    def test_figures_of_nowhere_are_found(self):
        self.assertEqual(self.found("As `lens-bench measure` says, it takes 0.3 ms.")[1], [1])
        self.assertEqual(self.found("By `lens-bench measure`:\n\n| it | 0.3 ms |")[1], [1])
        self.assertEqual(self.found("`lens-bench measure` prints figures.\n\n```\n0.3 ms\n```")[1], [])
        self.assertEqual(self.found("`lens-bench measure`: 0.31 ms<!-- evidence: measure :: 1080p :: lensd :: time -->")[1], [])


if __name__ == "__main__":
    unittest.main()
