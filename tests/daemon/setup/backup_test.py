"""lensctl backup and restore: a rig's files to another host, all of them or nothing."""
import base64
import json
import os
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, Daemon  # noqa: E402

LENSCTL = os.path.join(BIN, "lensctl")
SCENE = os.path.join(HERE, "small.toml")
CONFIG = (f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{SCENE}"\n'
          '[lens.optics]\ncalibration = "made/a.calibration.toml"\n')


def tree(folder):
    """Every file below it and what is in it."""
    found = {}
    for at, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(at, name)
            with open(path, "rb") as file:
                found[os.path.relpath(path, folder)] = file.read()
    return found


def checked(text):
    """With the checksum that lensd's own files have."""
    return '{"crc32":"%08x",' % zlib.crc32(text.encode()) + text[1:]


class Host:
    """Folders of a daemon, which runs when it is told to."""

    def __init__(self, config):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-backup-")
        self.config = os.path.join(self.folder.name, "etc", "lensd.toml")
        self.state = os.path.join(self.folder.name, "var")
        self.socket = os.path.join(self.folder.name, "s")
        for made in ("etc", "etc/made", "etc/lensd.toml.d", "var"):
            os.mkdir(os.path.join(self.folder.name, made))
        self.write("etc/lensd.toml", config)

    def write(self, path, text):
        with open(os.path.join(self.folder.name, path), "w", encoding="utf-8") as file:
            file.write(text)

    def lensctl(self, *words):
        return subprocess.run([LENSCTL, "--socket", self.socket, *words, "--config", self.config, "--state", self.state],
                              capture_output=True, text=True, timeout=120, check=False)

    def run(self):
        return Running(self)


class Running(Daemon):
    """lensd on the folders of a host, until the end of a with."""

    def __init__(self, host):  # pylint: disable=super-init-not-called
        self.folder, self.socket = host.folder, host.socket
        self.errors = open(os.path.join(host.folder.name, "stderr"), "w+", encoding="utf-8")
        self.process = subprocess.Popen([os.path.join(BIN, "lensd"), "--config", host.config, "--socket", host.socket,
                                         "--state", host.state], stderr=self.errors)
        self.wait_until_ready()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.process.terminate()
        self.process.wait(timeout=60)
        self.errors.close()

    def ask(self, method, **parameters):
        with self.client(60) as client:
            reply = client.call(LENS + method, {"lens": "a", **parameters})
        assert "error" not in reply, reply
        return reply["parameters"]

    def known(self):
        """What is to be the same on the other host."""
        status = self.ask("Status")["lenses"][0]
        return {"presets": self.ask("PresetList")["presets"], "calibration": self.ask("GetCalibration")["calibration"]["toml"],
                "axes": [axis["axis"] for axis in status["axes"]], "grade": status["grade"]}


class Backup(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.host = Host(CONFIG)
        cls.host.write("etc/lensd.toml.d/access.toml", 'version = 1\n[access]\nmove = ["video"]\n')
        with cls.host.run() as lensd:
            lensd.ask("Calibrate", errorUm=5, approximate=True,
                      points=[{"position": 0, "extensionMm": 0}, {"position": 4000, "extensionMm": 1.5}])
            lensd.ask("Move", axis="focus", target={"position": 420})
            lensd.ask("PresetSave", label="here")
            lensd.ask("FocusAtAdd", at=[{"name": "x", "value": 1.5, "unit": "mm"}], position=20, sigma=1)
            cls.known = lensd.known()
        cls.file = os.path.join(cls.host.folder.name, "rig.lensd")
        cls.files = tree(cls.host.folder.name)
        cls.told = cls.host.lensctl("--json", "backup", cls.file)
        with open(cls.file, encoding="utf-8") as file:
            cls.text = file.read()

    @classmethod
    def tearDownClass(cls):
        cls.host.folder.cleanup()

    def test_another_host_goes_on_where_this_one_stood(self):
        told = json.loads(self.told.stdout)
        self.assertEqual(set(told["files"]), {"lensd.toml", "lensd.toml.d/access.toml", "made/a.calibration.toml",
                                              "a.position.json", "a.presets.toml"})
        self.assertEqual(told["leftOut"], [SCENE])
        self.assertIn(SCENE, self.told.stderr)
        other = Host("version = 1\n")
        other.write("etc/lensd.toml.d/old.toml", "version = 1\n")
        other.write("var/b.presets.toml", "version = 1\n")
        before = tree(other.folder.name)
        done = other.lensctl("restore", self.file)
        self.assertEqual(done.returncode, 0, done.stderr)
        after = tree(other.folder.name)
        # A simulated lens begins where its scene says; where a real one stood is in its file.
        for path in ("var/a.position.json", "var/a.presets.toml", "etc/made/a.calibration.toml"):
            self.assertEqual(after[path], self.files[path])
        self.assertIn(b"420", after["var/a.position.json"])
        for path in ("etc/lensd.toml", "etc/lensd.toml.d/old.toml", "var/b.presets.toml"):
            self.assertEqual(after[path + ".before-restore"], before[path])
            self.assertIn(os.path.join(other.folder.name, path) + ".before-restore", done.stdout)
        self.assertNotIn("etc/lensd.toml.d/old.toml", after)
        self.assertNotIn("var/b.presets.toml", after)
        self.assertFalse([path for path in after if path.endswith(".restoring")])
        with other.run() as lensd:
            self.assertEqual(lensd.known(), self.known)
        other.folder.cleanup()

    def refused(self, text, status, says, host=None):
        """A restore that is refused leaves everything as it was, byte for byte."""
        host = host or Host("version = 1\n")
        path = os.path.join(host.folder.name, "given.lensd")
        with open(path, "wb") as file:
            file.write(text if isinstance(text, bytes) else text.encode())
        before = tree(host.folder.name)
        done = host.lensctl("restore", path)
        self.assertEqual((done.returncode, done.stdout), (status, ""), done.stderr)
        self.assertRegex(done.stderr, says)
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertIn("nothing has been changed", done.stderr)
        self.assertEqual(tree(host.folder.name), before)
        host.folder.cleanup()

    def test_what_is_damaged_or_foreign_is_refused(self):
        middle = len(self.text) // 2
        flipped = self.text[:middle] + ("A" if self.text[middle] != "A" else "B") + self.text[middle + 1:]
        for text, says in ((flipped, "checksum is wrong"), (self.text[:-9], "checksum is wrong"), ("", "no backup"),
                           ("{}", "no backup"), (b"\x89PNG\r\n\x1a\n\0\xff", "no backup"), (self.text[5:], "no backup"),
                           (checked('{"lens":"a"}'), "no backup")):
            with self.subTest(says=says, text=text[:40]):
                self.refused(text, 65, says)

    def crafted(self, **changed):
        whole = json.loads(self.text)
        del whole["crc32"]
        return checked(json.dumps({**whole, **changed}, separators=(",", ":")))

    def test_what_makes_no_sense_is_refused(self):
        def one(path, text, where="config"):
            return {"in": where, "path": path, "data": base64.b64encode(text.encode()).decode()}
        config = one("lensd.toml", CONFIG)
        self.refused(self.crafted(version=2), 65, "another version")
        self.refused(self.crafted(files=[]), 65, "no configuration")
        for path in ("../evil", "/etc/passwd", "a/../../b", ""):
            with self.subTest(path=path):
                self.refused(self.crafted(files=[config, one(path, "x", "state")]), 65, "makes no sense")
        self.refused(self.crafted(files=[one("lensd.toml", 'version = 1\n[[lens]]\nname = "a"\ndrivr = "sim"\n')]), 65,
                     r"does not take the configuration.* lensd.toml:4: .*did you mean .driver.\?")

    def test_it_waits_for_the_end_of_lensd(self):
        host = Host("version = 1\n")
        with host.run():
            path = os.path.join(host.folder.name, "rig.lensd")
            with open(path, "w", encoding="utf-8") as file:
                file.write(self.text)
            done = host.lensctl("restore", path)
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertIn("lensd is running: end it first", done.stderr)
        with open(host.config, encoding="utf-8") as file:
            self.assertEqual(file.read(), "version = 1\n")
        host.folder.cleanup()

    def test_what_fails_midway_is_taken_back(self):
        for blocked in ("var/a.presets.toml.restoring/x", "etc/lensd.toml.before-restore/x"):
            with self.subTest(blocked=blocked):
                host = Host("version = 1\n")
                os.mkdir(os.path.join(host.folder.name, os.path.dirname(blocked)))
                host.write(blocked, "in the way")
                self.refused(self.text, 73, os.path.dirname(blocked), host)

    def test_what_cannot_be_read_is_said(self):
        done = self.host.lensctl("restore", "/nowhere/rig.lensd")
        self.assertEqual(done.returncode, 66)
        done = subprocess.run([LENSCTL, "backup", "/dev/null/x", "--config", "/nowhere.toml"], capture_output=True, text=True,
                              timeout=120, check=False)
        self.assertEqual((done.returncode, done.stdout), (66, ""))
        self.assertIn("/nowhere.toml", done.stderr)
        done = self.host.lensctl("backup", "/nowhere/rig.lensd")
        self.assertEqual(done.returncode, 73)

    def test_names_without_a_folder_are_those_of_the_one_here(self):
        with tempfile.TemporaryDirectory(prefix="lensd-backup-here-") as here:
            done = subprocess.run([LENSCTL, "--socket", here + "/none", "restore", self.file, "--config", "conf.toml", "--state", "state"],
                                  capture_output=True, text=True, timeout=120, check=False, cwd=here)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(os.path.exists(os.path.join(here, "conf.toml")))
            done = subprocess.run([LENSCTL, "backup", "rig.lensd", "--config", "conf.toml", "--state", "state"],
                                  capture_output=True, text=True, timeout=120, check=False, cwd=here)
            self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("backup", "restore"):
            done = self.host.lensctl(name, "")
            self.assertEqual(done.returncode, 64)
            self.assertIn("FILE is empty", done.stderr)


if __name__ == "__main__":
    unittest.main()
