"""Damaged and edited files of the state folder: nothing false is believed, what was there is kept, the lens they belong to
says so, and every other lens lives. Damage is drawn anew for each file: flipped, cut, zeroed, doubled and inserted bytes."""
import json
import os
import random
import re
import shutil
import sys
import tempfile
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import LENS, Daemon, quick_scene  # noqa: E402

DAMAGES = {"fast": 12, "ci": 30, "long": 600}[os.environ.get("LENSD_TEST_LEVEL", "ci")]


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


def signed_object(text):
    """A position file whose checksum is right, whatever it says."""
    return b'{"crc32":"%08x",' % zlib.crc32(text) + text[1:]


def signed_lines(text):
    return text + b"# crc32 %08x\n" % zlib.crc32(text)


def another_type(data, name, chance):
    """A number where a text was, or the other way round, and a checksum that says that lensd wrote it so."""
    if name == "position.json":
        plain = b"{" + data.split(b'",', 1)[1]
        keys = [b'"position":', b'"inMotion":', b'"known":', b'"slack":', b'"version":', b'"axes":']
        key = chance.choice(keys)
        others = [b'"x"', b"[]", b"null", b"1e999"]
        at = plain.index(key) + len(key)
        value = re.match(rb'(\{.*\}\}|[^,}]+)', plain[at:]).group(0)
        return signed_object(plain[:at] + chance.choice(others) + plain[at + len(value):])
    lines = data.split(b"\n")[:-2]
    at = chance.choice([i for i, line in enumerate(lines) if b" = " in line])
    lines[at] = lines[at].split(b" = ")[0] + b" = " + chance.choice([b"[[]]", b"{}", b"1979-05-27", b"nan", b'"""'])
    return signed_lines(b"\n".join(lines) + b"\n")


STRANGE = ("folder", "pipe", "loop", "huge", "binary", "one line", "type")


def put_in_place(path, name, kind, chance):
    """Something that is no file of lensd's."""
    with open(path, "rb") as file:
        data = file.read()
    os.unlink(path)
    if kind == "folder":
        os.mkdir(path)
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "loop":  # nobody can read it, not even root
        os.symlink(path, path)
    else:
        with open(path, "wb") as file:
            if kind == "huge":
                file.truncate(1 << 34)
            elif kind == "binary":
                file.write(chance.randbytes(chance.randrange(1, 100000)))
            elif kind == "one line":
                file.write(b"a." * 100000 + b"a = 1\n")
            else:
                file.write(another_type(data, name, chance))


class ManyLensesTest(unittest.TestCase):
    """158 kinds of damage drawn at random, many lenses at a time: each harms its own lens alone."""
    LENSES = [f"l{i}" for i in range(15)]
    WHOLE = "whole"
    NAMES = ("position.json", "calibration.toml", "presets.toml")

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-files-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        self.scene = quick_scene(self.folder.name)

    def start(self, lenses):
        text = "".join(f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{self.scene}"\n' for name in lenses)
        return Daemon(config="version = 1\n" + text, arguments=("--state", self.state))

    def prepare(self):
        daemon = self.start(["a"])
        with daemon.client() as client:
            points = [{"position": 0, "vergenceD": 0.0}, {"position": 4000, "extensionMm": 3.0}]
            for method, parameters in (("Calibrate", {"points": points, "errorUm": 8.0}),
                                       ("Move", {"axis": "focus", "target": {"position": 300}}),
                                       ("PresetSave", {"label": "bench"})):
                self.assertNotIn("error", client.call(LENS + method, parameters))
        self.assertEqual(daemon.stop(), 0)
        whole = {}
        for name in self.NAMES:
            with open(os.path.join(self.state, "a." + name), "rb") as file:
                whole[name] = file.read()
        return whole

    def lay_out(self, whole, chance):
        """Kind of damage by lens and name of the file."""
        shutil.rmtree(self.state)
        os.mkdir(self.state)
        done = {}
        for i, lens in enumerate([*self.LENSES, self.WHOLE]):
            for name, data in whole.items():
                with open(os.path.join(self.state, f"{lens}.{name}"), "wb") as file:
                    file.write(data)
            if lens == self.WHOLE:
                continue
            name = self.NAMES[i % 3]
            path = os.path.join(self.state, f"{lens}.{name}")
            kind = chance.choice(STRANGE + ("bytes",) * 7)
            if kind == "bytes":
                after = whole[name]
                while after == whole[name]:
                    after = damaged(whole[name], chance)
                with open(path, "wb") as file:
                    file.write(after)
            else:
                put_in_place(path, name, kind, chance)
            done[lens] = (name, kind)
        return done

    def test_each_harms_its_lens_alone(self):
        whole = self.prepare()
        chance = random.Random(158)
        seen = {}
        rounds = (158 + 14) // 15 if DAMAGES > 12 else 3
        for number in range(rounds * (4 if DAMAGES > 100 else 1)):
            done = self.lay_out(whole, chance)
            daemon = self.start([*self.LENSES, self.WHOLE])
            try:
                self.judge(daemon, done, seen)
            finally:
                if number:  # what nothing can replace holds the end up for as long as lensd tries to; once is enough
                    self.clear_the_way(done)
                self.assertEqual(daemon.stop(), 0)
        print(sum(seen.values()), "damages:", seen)

    def clear_the_way(self, done):
        for lens, (name, kind) in done.items():
            path = os.path.join(self.state, f"{lens}.{name}")
            if kind == "folder":
                os.rmdir(path)
            elif kind == "loop" and os.path.islink(path):
                os.unlink(path)

    def judge(self, daemon, done, seen):
        with daemon.client() as client:
            lenses = {each["name"]: each for each in client.call(LENS + "Status")["parameters"]["lenses"]}
            self.assertEqual((lenses[self.WHOLE]["warnings"], lenses[self.WHOLE]["grade"]), ([], "calibrated"))
            for lens in lenses:
                client.send(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": 320}})
            moved = {lens: client.receive() for lens in lenses}
            doctor = daemon.lensctl("doctor").stdout
            for lens, (name, kind) in done.items():
                with self.subTest(lens=lens, file=name, kind=kind):
                    status = lenses[lens]
                    self.assertEqual((status["connection"], status["error"]), ("connected", None))
                    self.assertEqual(len(status["warnings"]), 1, status)
                    warning = status["warnings"][0]
                    self.assertIn(f"{lens}.{name}", warning)
                    daemon.wait_log(warning)
                    self.assertIn(warning, doctor)
                    told = self.one(client, lens, name, status, moved[lens])
                    seen[told] = seen.get(told, 0) + 1
                    if kind not in ("folder", "pipe", "loop", "huge"):
                        self.assertEqual(os.path.exists(os.path.join(self.state, f"{lens}.{name}.damaged")), told != "by hand")

    def one(self, client, lens, name, status, moved):
        homed = next(axis["homed"] for axis in status["axes"] if axis["axis"] == "focus")
        self.assertEqual(homed, name != "position.json")
        if name == "position.json":
            self.assertEqual(moved["error"], LENS + "NotHomed")
            return name
        self.assertTrue(moved["parameters"]["move"]["reached"], moved)
        if "edited by hand" in status["warnings"][0]:
            return "by hand"
        self.assertEqual(status["grade"], "uncalibrated" if name == "calibration.toml" else "calibrated")
        if name == "presets.toml":
            refused = client.call(LENS + "PresetSave", {"lens": lens, "label": "new"})
            self.assertEqual(refused["error"], LENS + "NotKept")
        return name


class FilesTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-files-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        self.whole = os.path.join(self.folder.name, "whole")
        self.scene = quick_scene(self.folder.name)

    def start(self):
        lenses = "".join(f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{self.scene}"\n' for name in ("a", "b"))
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
                    daemon.wait_log(name)
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
        self.assertEqual(a["connection"], "connected")
        self.assertIn(path, a["warnings"][0])
        if name == "a.calibration.toml":
            self.assertEqual(a["grade"], "uncalibrated")
            return "calibration"
        self.assertTrue(focus["homed"])
        return "presets"

    def test_whole_files_are_taken_without_a_word(self):
        self.prepare()
        daemon = self.start()
        a = self.status(daemon, "a")
        self.assertEqual((a["warnings"], a["grade"]), ([], "approximate"))
        self.assertEqual([preset["label"] for preset in self.ask(daemon, "preset", "list", "a")], ["bench"])
        self.assertEqual(daemon.stop(), 0)

    def test_a_damaged_calibration_is_mended_or_written_anew(self):
        self.prepare()
        path = os.path.join(self.state, "a.calibration.toml")
        with open(path, encoding="utf-8") as file:
            whole = file.read()
        with open(path, "w", encoding="utf-8") as file:
            file.write(whole[:len(whole) // 2])
        daemon = self.start()
        try:
            a = self.status(daemon, "a")
            self.assertEqual((a["connection"], a["grade"], len(a["warnings"])), ("connected", "uncalibrated", 1))
            self.assertIn("lensctl reload", a["warnings"][0])
            self.assertIn(a["warnings"][0], daemon.lensctl("status", "a").stdout)
            # Mended: it is noticed when the configuration is read again, and of the other lens nothing is.
            with open(path, "w", encoding="utf-8") as file:
                file.write(whole)
            reloaded = self.ask(daemon, "reload")
            self.assertEqual((reloaded["reopened"], reloaded["unchanged"]), (["a"], ["b"]))
            with daemon.client() as client:
                while (a := client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0])["connection"] == "connecting":
                    pass
            self.assertEqual((a["grade"], a["warnings"]), ("approximate", []))
            daemon.wait_log(path)
            # What lensd writes itself is no change.
            self.ask(daemon, "calibrate", "a", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet", "--error", "9um")
            self.assertEqual(self.ask(daemon, "reload")["unchanged"], ["a", "b"])
        finally:
            self.assertEqual(daemon.stop(), 0)

    def test_a_calibration_that_is_written_anew_takes_its_warning_away(self):
        self.prepare()
        path = os.path.join(self.state, "a.calibration.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write("version = ")
        daemon = self.start()
        try:
            self.assertEqual(len(self.status(daemon, "a")["warnings"]), 1)
            self.ask(daemon, "calibrate", "a", "--point", "0=inf", "--point", "4000=ext:3mm", "--data-sheet", "--error", "8um")
            a = self.status(daemon, "a")
            self.assertEqual((a["grade"], a["warnings"]), ("approximate", []))
            with open(path + ".damaged", encoding="utf-8") as file:
                self.assertEqual(file.read(), "version = ")
        finally:
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
