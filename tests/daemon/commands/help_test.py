"""lensctl helps: every example of every command's help runs as printed on a simulated lens called cam, what is mistyped is
named with what may have been meant, shells complete lenses, presets and methods, and the manual page has every option."""
import os
import re
import shlex
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, LENS, DaemonTest  # noqa: E402

LENSCTL = os.path.join(BIN, "lensctl")
# Of this machine and this lens, which has no filter wheel and may have no journal; its pictures need not be sharp.
# This lens has no filter, and so no shift of filters to forget.
MAY_FAIL = {"focus-at": (6, 64), "refocus": (64,), "filter": (8,), "focus-shift": (8, 64), "setup": (1,), "log": (1, 69), "doctor": (1,), "devices": (1,), "add": (64, 68, 69, 73, 77), "backup": (66, 77), "restore": (4, 66), "here": (8,), "verify": (1,)}
ENDLESS = ("monitor", "--watch")


def lensctl(*words, folder=None, **more):
    return subprocess.run([LENSCTL, *words], capture_output=True, text=True, timeout=120, check=False, cwd=folder, **more)


def commands():
    """Every command, and those of commands that have some, by the help itself."""
    for name in named(lensctl("--help").stdout, "Optics, without the daemon|Lenses, through the daemon|Protocol"):
        yield (name,)
        for inner in named(lensctl(name, "--help").stdout, "Commands"):
            yield name, inner


def named(text, titles):
    for block in re.findall(rf"^(?:{titles}):\n((?:  .*\n)+)", text, re.M):
        yield from re.findall(r"^  (\S+)", block, re.M)


def examples(text):
    return re.findall(r"^  (lensctl .*)$", text.split("\nExamples:\n")[1] if "\nExamples:\n" in text else "", re.M)


class Words(unittest.TestCase):
    def test_every_command_has_help_in_eighty_columns_and_an_example(self):
        count = 0
        for words in commands():
            with self.subTest(command=words):
                told = lensctl("help", *words)
                self.assertEqual((told.returncode, told.stderr), (0, ""))
                self.assertEqual(told.stdout, lensctl(*words, "--help").stdout)
                self.assertLessEqual(max(len(line) for line in told.stdout.splitlines() if not line.startswith("  lensctl ")), 80)
                self.assertRegex(told.stdout, rf"\nUsage: lensctl {' '.join(words)}\b")
                if len(words) == 1:
                    self.assertTrue(examples(told.stdout))
                count += 1
        self.assertGreater(count, 30)

    def test_what_was_meant_is_named(self):
        for words, says in ((["fokus"], "did you mean focus?"), (["autofocuss", "a"], "did you mean autofocus?"),
                            (["help", "aperure"], "did you mean aperture?"),
                            (["plan", "--focal-lenght", "50mm"], "did you mean --focal-length?"),
                            (["preset", "sav", "x"], "did you mean save?"),
                            (["focus"], "write lensctl focus [NAME] TARGET, a distance"),
                            (["aperture"], "write lensctl aperture [NAME] N"),
                            (["focus", "a", "b", "c"], "write lensctl focus [NAME] TARGET"),
                            (["qqq"], "there is no command 'qqq'; the name of a lens stands after the command; see lensctl --help")):
            with self.subTest(words=words):
                told = lensctl(*words)
                self.assertEqual((told.returncode, told.stdout), (64, ""), told.stderr)
                self.assertIn(says, told.stderr)
                self.assertEqual(told.stderr.count("\n"), 1)

    def test_the_manual_page_has_every_option_of_every_help(self):
        page = lensctl("help", "--roff")
        self.assertEqual(page.returncode, 0)
        plain = page.stdout.replace("\\-", "-")
        for words in commands():
            for option in re.findall(r"^  (?:-\w, )?(--[\w-]+)", lensctl("help", *words).stdout, re.M):
                self.assertIn(option, plain, words)
            self.assertIn(f"\n.SS lensctl {' '.join(words)} ", plain)
        checked = subprocess.run(["man", "--warnings", "-l", "-"], input=page.stdout, capture_output=True, text=True, check=False,
                                 env={**os.environ, "MANWIDTH": "80", "LC_ALL": "C.UTF-8", "MANPAGER": "cat"}) if man_is_there() else None
        if checked is not None:
            self.assertEqual((checked.returncode, checked.stderr), (0, ""))

    def test_completion_scripts_are_those_of_their_shells(self):
        for shell in ("bash", "zsh", "fish"):
            told = lensctl("completion", shell)
            self.assertEqual(told.returncode, 0)
            self.assertIn("lensctl completion words", told.stdout)
        self.assertEqual(subprocess.run(["bash", "-n"], input=lensctl("completion", "bash").stdout, text=True, check=False).returncode, 0)
        self.assertEqual(lensctl("completion", "tcsh").returncode, 64)


def man_is_there():
    return any(os.access(os.path.join(folder, "man"), os.X_OK) for folder in os.environ["PATH"].split(":"))


def wall_at(millimetres, width, height):
    """A depth map of one depth."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = (b"\0" + struct.pack(">H", millimetres) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class OnALens(DaemonTest):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory(prefix="lensd-help-")
        with open(os.path.join(HERE, "../../scenes/brick.toml"), encoding="utf-8") as file:
            scene = file.read().replace("focal_length_mm = 25.0", "focal_length_mm = [25.0, 50.0]").replace("[0.0, 1.0]", "[0.0, 4.0]")
        for slow, quick in (("frame_rate_hz = 60", "frame_rate_hz = 240"), ("speed_steps_per_s = 8000", "speed_steps_per_s = 80000"),
                            ("acceleration_steps_per_s2 = 200000", "acceleration_steps_per_s2 = 2000000")):
            assert slow in scene, slow
            scene = scene.replace(slow, quick)  # nothing of time is judged
        scene = re.sub(r'texture = "', f'texture = "{os.path.realpath(os.path.join(HERE, "../../scenes"))}/', scene)
        with open(os.path.join(cls.work.name, "scene.toml"), "w", encoding="utf-8") as file:
            file.write(scene)
        cls.config = f'version = 1\n[[lens]]\nname = "cam"\ndriver = "sim"\nscene = "{cls.work.name}/scene.toml"\n'
        super().setUpClass()
        taken = cls.daemon.lensctl("stack", "--sharp", "0.8m..1.2m:1.5px", "-o", os.path.join(cls.work.name, "shots"))
        assert taken.returncode == 0, taken.stderr  # what the examples of merge are about
        for words in (("aperture", "2.8"), ("snapshot", "-o", "picture.png"), ("aperture", "16"), ("snapshot", "-o", "a.png"),
                      ("snapshot", "-o", "b.png")):  # and that of verify
            done = cls.daemon.lensctl(*words, cwd=cls.work.name)
            assert done.returncode == 0, done.stderr
        with open(os.path.join(cls.work.name, "distances.png"), "wb") as file:
            file.write(wall_at(1200, 640, 480))

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.work.cleanup()

    def run_example(self, line):
        words = shlex.split(line)[1:]
        timeout = "1s" if any(word in ENDLESS for word in words) else "60s" if words[0] == "devices" else None
        done = lensctl(*words, *(("--timeout", timeout) if timeout else ()), folder=self.work.name,
                       env={**os.environ, "LENSD_SOCKET": self.daemon.socket})
        self.assertIn(done.returncode, (0, *MAY_FAIL.get(words[0], ())), line + "\n" + done.stdout + done.stderr)
        return done

    def test_every_example_runs_as_printed(self):
        ran = 0
        for words in [(), *commands()]:
            for line in examples(lensctl(*words, "--help").stdout):
                with self.subTest(line=line):
                    done = self.run_example(line)
                    if "lease take" in line:  # the examples that follow are another client's
                        with self.daemon.client() as client:
                            client.call(LENS + "DropLease", {"lens": "cam", "lease": done.stdout.strip()})
                    ran += 1
        self.assertGreater(ran, 45)

    def complete(self, *words):
        return lensctl("completion", "words", *words, env={**os.environ, "LENSD_SOCKET": self.daemon.socket}).stdout.split("\n")[:-1]

    def test_shells_are_offered_what_there_is(self):
        self.assertEqual(self.complete("foc"), ["focus", "focus-map", "focus-shift", "focus-at"])
        self.assertEqual(self.complete("status", ""), ["cam"])
        self.assertEqual(self.complete("--socket", self.daemon.socket, "status", "c"), ["cam"])
        self.assertEqual(self.complete("status", "--wat"), ["--watch"])
        self.assertEqual(self.complete("here", ""), ["cam", "focus", "iris", "zoom", "filter"])
        self.assertEqual(self.complete("plan", "--focal"), ["--focal-length"])
        self.assertEqual(self.complete("--units", ""), ["m", "mm", "ft", "in", "D"])
        self.assertEqual(self.complete("lease", ""), ["take", "drop"])
        self.assertEqual(self.complete("call", "PresetRec"), ["PresetRecall"])
        self.assertIn("iris", self.complete("home", "cam", ""))
        self.assertIn("idle", self.complete("wait", "cam", ""))
        self.assertEqual(self.complete("snapshot", "--encoding", "j"), ["jpeg"])
        self.assertEqual(self.daemon.lensctl("preset", "save", "tele").returncode, 0)
        self.assertEqual(self.complete("preset", "recall", "cam", ""), ["tele"])
        self.assertEqual(self.complete("preset", "remove", "te"), ["tele"])

    def test_nothing_is_offered_without_a_daemon_and_soon(self):
        told = lensctl("completion", "words", "status", "", env={**os.environ, "LENSD_SOCKET": "/nonexistent"})
        self.assertEqual((told.returncode, told.stdout), (0, ""))

    def test_wait_ends_when_the_lens_is_so_and_says_how_it_is_where_it_is_not(self):
        self.assertEqual(self.daemon.lensctl("focus", "cam", "@0").returncode, 0)
        moving = subprocess.Popen([LENSCTL, "--socket", self.daemon.socket, "focus", "cam", "@1500"], stdout=subprocess.DEVNULL)
        done = self.daemon.lensctl("wait", "cam", "idle", "--timeout", "60s")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(moving.wait(60), 0)
        self.assertEqual(self.daemon.lensctl("wait", "connected").returncode, 0)
        self.assertEqual(self.daemon.lensctl("wait", "cam", "asleep").returncode, 64)
        self.assertEqual(self.daemon.lensctl("wait", "nobody", "idle").returncode, 68)

    def test_reset_ends_a_latch(self):
        with self.daemon.client() as client:
            client.call(LENS + "Stop", {"lens": "cam", "latch": True})
        self.assertEqual(self.daemon.lensctl("focus", "cam", "@100").returncode, 2)
        late = self.daemon.lensctl("reset", "cam")
        self.assertEqual(late.returncode, 0, late.stderr)
        self.assertIn("cam: idle", late.stdout)
        self.assertEqual(self.daemon.lensctl("focus", "cam", "@100").returncode, 0)
        self.assertEqual(self.daemon.lensctl("reset", "cam", "foot").returncode, 64)

    def test_hyperfocal_is_where_infinity_is_just_sharp(self):
        self.assertEqual(self.daemon.lensctl("zoom", "25mm").returncode, 0)
        self.assertEqual(self.daemon.lensctl("aperture", "8").returncode, 0)
        done = self.daemon.lensctl("focus", "hyperfocal", "--blur-limit", "5px", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        with self.daemon.client() as client:
            now = client.call(LENS + "Status", {"lens": "cam"})["parameters"]["lenses"][0]
            pixel_um = client.call(LENS + "List")["parameters"]["lenses"][0]["camera"]["pixelUm"]
        # Infinity is blurred by e/N: by hand, 5 px of it.
        self.assertAlmostEqual(now["extensionMm"] * 1e3 / now["fNumber"] / pixel_um, 5, delta=0.5)
        self.assertEqual(self.daemon.lensctl("focus", "2m", "--blur-limit", "5px").returncode, 64)


if __name__ == "__main__":
    unittest.main()
