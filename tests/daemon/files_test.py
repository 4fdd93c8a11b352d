"""Damaged and edited files of the state folder: nothing false is believed, what was there is kept, the lens they belong to
says so, and every other lens lives. Damage is drawn anew for each file: flipped, cut, zeroed, doubled and inserted bytes."""
import json
import os
import random
import shutil
import tempfile
import unittest

from harness import HERE, Daemon

DAMAGES = {"fast": 12, "ci": 30, "long": 600}[os.environ.get("LENSD_TEST_LEVEL", "ci")]
SCENE = os.path.join(HERE, "small.toml")


def damaged(data, chance):
    kind = chance.choice(["flip", "cut", "zero", "double", "insert", "empty", "tail"])
    at = chance.randrange(len(data))
    size = chance.randint(1, max(1, len(data) // 4))
    if kind == "flip":
        return data[:at] + bytes([data[at] ^ (1 << chance.randrange(8))]) + data[at + 1:]
    if kind == "cut":
        return data[:at] + data[at + size:]
    if kind == "zero":
        return data[:at] + bytes(min(size, len(data) - at)) + data[at + size:]
    if kind == "double":
        return data[:at] + data[at:at + size] * 2 + data[at + size:]
    if kind == "insert":
        return data[:at] + bytes(chance.randrange(256) for _ in range(size)) + data[at:]
    return b"" if kind == "empty" else data[:at]


class FilesTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-files-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        self.whole = os.path.join(self.folder.name, "whole")

    def start(self):
        lenses = "".join(f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{SCENE}"\n' for name in ("a", "b"))
        return Daemon(config="version = 1\n" + lenses, arguments=("--state", self.state))

    def ask(self, daemon, *arguments, status=0):
        done = daemon.lensctl(*arguments, "--json")
        self.assertEqual(done.returncode, status, done.stderr + done.stdout)
        return json.loads(done.stdout) if done.stdout else None

    def prepare(self):
        daemon = self.start()
        self.ask(daemon, "calibrate", "a", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet", "--error", "8um")
        self.ask(daemon, "focus", "a", "@700")
        self.ask(daemon, "preset", "save", "a", "bench")
        self.assertEqual(daemon.stop(), 0)
        shutil.copytree(self.state, self.whole)

    def status(self, daemon, lens):
        return self.ask(daemon, "status", lens)

    def test_damage_is_never_believed_and_harms_its_lens_alone(self):
        self.prepare()
        files = ["a.position.json", "a.calibration.toml", "a.presets.toml"]
        seen = {"position": 0, "calibration": 0, "presets": 0, "by hand": 0}
        chance = random.Random(20)
        for i in range(DAMAGES):
            shutil.rmtree(self.state)
            shutil.copytree(self.whole, self.state)
            name = files[i % 3]
            path = os.path.join(self.state, name)
            with open(path, "rb") as file:
                before = file.read()
            after = before
            while after == before:
                after = damaged(before, chance)
            with open(path, "wb") as file:
                file.write(after)
            daemon = self.start()
            try:
                with self.subTest(file=name, text=after):
                    told = self.one(daemon, name, path, after)
                    seen[told] += 1
                    self.assertIn(name, daemon.log())
                    self.assertTrue(self.ask(daemon, "focus", "b", "@900")["reached"])
            finally:
                self.assertEqual(daemon.stop(), 0)
        print(seen)

    def one(self, daemon, name, path, after):
        """What was told of this damage; whatever it was, a copy is kept or the file still stands."""
        a = self.status(daemon, "a")
        focus = next((axis for axis in a["axes"] if axis["axis"] == "focus"), None)
        kept = path + ".damaged"
        if name == "a.position.json":
            self.assertFalse(focus["homed"], a)
            self.assertIn("checksum", a["warnings"][0])
            with open(kept, "rb") as file:
                self.assertEqual(file.read(), after)
            return "position"
        if a["warnings"] and "edited by hand" in a["warnings"][0]:
            with open(path, "rb") as file:
                self.assertEqual(file.read(), after)
            return "by hand"
        with open(kept, "rb") as file:
            self.assertEqual(file.read(), after)
        if name == "a.calibration.toml":
            self.assertEqual(a["connection"], "wrongDevice")
            self.assertIn(path, a["error"])
            return "calibration"
        self.assertIn(path, a["warnings"][0])
        self.assertTrue(focus["homed"])
        return "presets"

    def test_whole_files_are_taken_without_a_word(self):
        self.prepare()
        daemon = self.start()
        a = self.status(daemon, "a")
        self.assertEqual((a["warnings"], a["grade"]), ([], "approximate"))
        self.assertEqual([preset["label"] for preset in self.ask(daemon, "preset", "list", "a")], ["bench"])
        self.assertEqual(daemon.stop(), 0)

    def test_an_edit_by_hand_holds_and_is_said(self):
        self.prepare()
        path = os.path.join(self.state, "a.calibration.toml")
        with open(path, encoding="utf-8") as file:
            text = file.read()
        with open(path, "w", encoding="utf-8") as file:
            file.write("# the bench's own lens\n" + text)
        daemon = self.start()
        a = self.status(daemon, "a")
        self.assertEqual(a["grade"], "approximate")
        self.assertIn("edited by hand", a["warnings"][0])
        self.assertIn("edited by hand", daemon.lensctl("status", "a").stdout)
        self.assertEqual(daemon.stop(), 0)

    def test_what_a_killed_daemon_left_is_removed(self):
        os.mkdir(self.state)
        left = os.path.join(self.state, ".a.position.json.Ab3xYz")
        other = os.path.join(self.state, ".keep")
        for path in (left, other):
            with open(path, "w", encoding="utf-8") as file:
                file.write("x")
        daemon = self.start()
        self.assertEqual(daemon.stop(), 0)
        self.assertFalse(os.path.exists(left))
        self.assertTrue(os.path.exists(other))


if __name__ == "__main__":
    unittest.main()
