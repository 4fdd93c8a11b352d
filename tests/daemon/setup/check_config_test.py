"""lensd --check-config: every mistake at once, each as "file:line: what, why; did you mean", in the order of the files."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, HERE, PATIENCE  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")
GOOD = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{SCENE}"\n'
OPTICS = "[lens.optics]\nfocal_length_mm = 25\nf_number = [1.4, 16]\nextension_mm = [0.0, 1.6]\n"
REAL = 'version = 1\n[[lens]]\nname = "a"\ndriver = "lensconnect"\nserial = "x"\n'
BUS = 'version = 1\n[[bus]]\nname = "rs485"\ndriver = "modbus"\nhost = "127.0.0.1:1"\n'
DRIVES = (BUS + '[[lens]]\nname = "a"\ndriver = "modbus"\nbus = "rs485"\n'
          '[lens.drives.focus]\nunit = 1\nprofile = "moons"\nrange = [0, 4000]\n' + OPTICS)

# What is wrong, and every line that is told: its number and words that stand in it. GOOD has 5 lines.
WRONG = (
    ("", [(1, "version = 1")]),
    ("version = 2\n", [(1, "reads version 1")]),
    ("version = 1\nbogus = 1\n", [(2, 'unknown key "bogus" in the configuration')]),
    ("version = 1\n[[lense]]\n", [(2, 'unknown key "lense" in the configuration; did you mean "lens"?')]),
    (GOOD.replace("driver", "drivr"), [(4, 'unknown key "drivr" in [[lens]]; did you mean "driver"?')]),
    (GOOD.replace("name", "nmae"), [(3, 'unknown key "nmae"', 'did you mean "name"?')]),
    (GOOD.replace('name = "a"\n', ""), [(2, "[[lens]] name is missing: write name =")]),
    (GOOD.replace('"sim"', '"simm"'), [(4, 'there is no driver "simm"', 'did you mean "sim"?')]),
    (GOOD.replace('"a"', '"A b"'), [(3, "a name has small letters, digits and -")]),
    (GOOD.replace('"a"', '"focus"'), [(3, "cannot be named like an axis")]),
    (GOOD + 'strat = "home"\n', [(6, 'unknown key "strat" in driver "sim"; did you mean "start"?')]),
    (GOOD + "seeed = 3\n", [(6, 'unknown key "seeed" in driver "sim"; did you mean "seed"?')]),
    (GOOD + 'start = "soon"\n', [(6, "must be one of keep, home, on-demand")]),
    (GOOD + 'distance_from = 3\n', [(6, "must be a string, not an integer")]),
    (GOOD + 'bus = "x"\n', [(6, "has no buses")]),
    (GOOD + "[lens.focus]\nlimit = [1, 2]\n", [(7, 'unknown key "limit" in [lens.focus]; did you mean "limits"?')]),
    (GOOD + "[lens.focus]\nlimits = [9, 2]\n", [(7, "smaller number first")]),
    (GOOD + "[lens.focus]\nbacklash = nan\n", [(7, "nan is no number that is used here")]),
    (GOOD + "[lens.focus]\nbacklash = \"many\"\n", [(7, '"auto" or a number')]),
    (GOOD + "[lens.focus]\nlimits = [200, 300]\npark = 100\n", [(8, "must be within limits")]),
    (GOOD + "[lens.iris]\nshaper = \"zv\"\n", [(6, "if there is a shaper")]),
    (GOOD + OPTICS.replace("[1.4, 16]", "[1.4]"), [(8, "f_number must be an array of 2 numbers")]),
    (GOOD + OPTICS + "calibration = 3\n", [(10, "calibration must be a string")]),
    (GOOD + "[lens.temperature]\ncompensate = 1\n", [(7, "must be true or false")]),
    (GOOD + "[lens.temperature]\nrange_c = [80, -40]\n", [(7, "smaller number first")]),
    (GOOD + "[lens.temperature]\nrange_c = 80\n", [(7, "range_c must be an array of 2 numbers")]),
    (GOOD + "[lens.temperature]\nmax_c_per_min = 0\n", [(7, "max_c_per_min must be")]),
    (GOOD + "[lens.refocus]\nlook_every_s = 5\n", [(6, "every_s, temperature_c, filter or sharpness_loss")]),
    (GOOD + "[lens.refocus]\nevery_s = 60\ntemperature = 1\n", [(8, 'did you mean "temperature_c"?')]),
    (GOOD + "[lens.refocus]\nfilter = \"shift\"\n", [(6, "filter never starts anything: this lens has no filter")]),
    (GOOD + "on_failure = []\n", [(6, "path of a program")]),
    (GOOD + '[lens.camera]\ndriver = "warp"\n', [(7, 'there is no driver "warp"')]),
    (GOOD + f'[lens.camera]\ndriver = "sim"\nscene = "{SCENE}"\n', [(6, "brings a camera already")]),
    (GOOD + GOOD.split("\n", 1)[1], [(6, 'another lens "a"')]),
    (GOOD.replace("small", "no-such"), [(2, "no-such.toml")]),
    (GOOD + '[access]\nmove = "lens"\n', [(7, 'as ["lens"]')]),
    (REAL.replace("serial", "serail"), [(5, 'unknown key "serail"', 'did you mean "serial"?')]),
    ('version = 1\n[[bus]]\nname = "x"\n', [(2, "[[bus]] driver is missing")]),
    (BUS.replace('"modbus"', '"sim"'), [(4, "sim has no buses")]),
    (BUS + "baudd = 3\n", [(6, 'unknown key "baudd"', 'did you mean "baud"?')]),
    (DRIVES.replace('bus = "rs485"', 'bus = "other"'), [(9, 'no [[bus]] named "other"')]),
    (DRIVES.replace('"moons"', '"moon"'), [(12, 'there is no profile "moon"')]),
    (DRIVES.replace("unit = 1", "unit = 300"), [(11, "from 1 to 247")]),
    # No complaint follows from another.
    (GOOD.replace('name = "a"\n', ""), [(2, "name is missing")]),
    (GOOD.replace('"a"', "5"), [(3, "name must be a string")]),
    (GOOD.replace('"a"', '""'), [(3, "a name has small letters")]),
    # What people write who do not know TOML or the words of lensd.
    (GOOD.replace('"sim"', '"gige"'), [(4, 'there is no driver "gige"', 'did you mean "aravis"?')]),
    (GOOD.replace('"sim"', "sim"), [(4, 'text stands in quotes: write driver = "sim"')]),
    (GOOD.replace('"sim"', "si\bm"), [(4, "Error while parsing")]),  # bytes of a damaged file are not repeated
    (GOOD.replace('name = "a"', "name = bike # mine"), [(3, 'text stands in quotes: write name = "bike"')]),
    (GOOD + "[lens.focus]\nkeep = True\n", [(7, "write keep = true")]),
    (GOOD + "[lens.focus]\nsettle_ms = 2,5\n", [(7, "not after a comma: write settle_ms = 2.5")]),
    (GOOD.replace("version = 1\n", ""), [(1, "version is missing: write version = 1 as the first line of the file")]),
    (GOOD + "[focus]\ntolerance = 1\n", [(6, "focus belongs to a lens: write [lens.focus], below its [[lens]]")]),
    (GOOD + "[camera]\npixel_um = 1\n", [(6, "camera belongs to a lens: write [lens.camera], below its [[lens]]")]),
    # A line that is no TOML is told, and nothing else of it; what stands below is read.
    (GOOD.replace('"sim"', "sim") + "[lens.focus]\nlimit = [1, 2]\n", [(4, ""), (7, 'did you mean "limits"?')]),
    (GOOD + 'name = "b"\n' + "[lens.focus]\nlimit = [1, 2]\n", [(6, "redefine"), (8, 'did you mean "limits"?')]),
    (GOOD + "[lens.focus\nlimit = [1, 2]\n", [(6, "the rest of the file was not checked")]),
    # A bus with a mistake is told where it stands, not again by each lens on it; a lens of which the driver is not known
    # has its own tables looked at, not the driver's keys.
    (DRIVES.replace("host", "hots"), [(2, "host"), (5, 'unknown key "hots"', 'did you mean "host"?')]),
    (GOOD.replace("driver", "drivr") + "[lens.focus]\nlimit = [1, 2]\n", [(4, '"driver"'), (7, '"limits"')]),
    (DRIVES.replace("unit = 1", "unit = 300").replace("profile", "profil") + "[lens.drives.iris]\nunit = 2\n",
     [(11, "from 1 to 247"), (12, '"profile"'), (18, "range"), (18, "profile")]),
)

TEN = f"""version = 1
verbose = true
[[bus]]
name = "rs485"
driver = "modbuss"
[[lens]]
name = "Front"
drivr = "sim"
[[lens]]
name = "b"
driver = "sim"
scene = "{SCENE}"
strat = "home"
[lens.focus]
limit = [1, 2]
settle_ms = -3
[lens.iris]
retries = 1.5
[[lens]]
name = "c"
driver = "sim"
scene = "no-such.toml"
[lens.temperature]
compensate = "yes"
"""
TEN_SAYS = ((2, 'unknown key "verbose"'), (5, 'did you mean "modbus"?'), (7, "small letters"), (8, 'did you mean "driver"?'),
            (13, 'did you mean "start"?'), (15, 'did you mean "limits"?'), (16, "from 0 to 60000"), (18, "a whole number"),
            (19, "no-such.toml"), (24, "true or false"))


class CheckConfig(unittest.TestCase):

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.file = os.path.join(self.folder.name, "lensd.toml")

    def write(self, text, path=None):
        path = path or self.file
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def lensd(self, *arguments):
        return subprocess.run([os.path.join(BIN, "lensd"), *arguments], capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)

    def told(self):
        """The lines that are told, as (file, line, text), of a configuration with mistakes."""
        done = self.lensd("--config", self.file, "--check-config")
        self.assertEqual((done.returncode, done.stdout), (78, ""), done.stderr)
        lines = []
        for line in done.stderr.splitlines():
            found = re.fullmatch(r"([^:]+?\.toml)(?::(\d+))?: (.+)", line)
            self.assertTrue(found, f"{line!r} names no place")
            lines.append((found[1], int(found[2]) if found[2] else None, found[3]))
        return lines

    def says(self, told, expected):
        self.assertEqual([line for _, line, _ in told], [line for line, *_ in expected], told)
        for (_, _, text), (_, *words) in zip(told, expected):
            for word in words:
                self.assertIn(word, text)

    def test_each_mistake_is_told_with_its_place_and_what_was_meant(self):
        self.assertGreaterEqual(len(WRONG), 25)
        for text, expected in WRONG:
            with self.subTest(text=text):
                self.write(text)
                told = self.told()
                self.says(told, expected)
                self.assertEqual({file for file, _, _ in told}, {self.file})

    def test_ten_mistakes_are_told_at_once_in_their_order(self):
        self.assertEqual(len(TEN_SAYS), 10)
        self.write(TEN)
        self.says(self.told(), TEN_SAYS)

    def test_drop_ins_are_told_after_the_file_in_the_order_of_their_names(self):
        self.write(GOOD + "bogus = 1\n")
        self.write('version = 1\nlens = 3\n', self.file + ".d/20-b.toml")
        self.write('version = 1\n[[lens]]\nname = "c"\n', self.file + ".d/10-a.toml")
        self.assertEqual([(os.path.basename(file), line) for file, line, _ in self.told()],
                         [("lensd.toml", 6), ("10-a.toml", 2), ("20-b.toml", 2)])

    def test_mistakes_of_a_calibration_are_told_in_it_and_nothing_is_kept(self):
        named = GOOD + OPTICS + 'calibration = "cal.toml"\n'
        path = os.path.join(self.folder.name, "cal.toml")
        self.write(named)
        self.assertEqual(self.lensd("--config", self.file, "--check-config").returncode, 0)
        for text, line, word in (("version = 1\nmaed = 3\n", 2, '"maed"'), ("version = 1\nserial = 3\n", 2, "a string"),
                                 ("version = \n", 1, "")):
            with self.subTest(text=text):
                self.write(text, path)
                told = self.told()
                self.assertIn((path, line), [(file, at) for file, at, _ in told], told)
                self.assertTrue(any(word in message for file, _, message in told if file == path), told)
                self.assertEqual(sorted(os.listdir(self.folder.name)), ["cal.toml", "lensd.toml"])

    def test_mistakes_of_a_profile_are_told_in_every_table_of_it(self):
        self.write(DRIVES.replace('"moons"', '"drive.toml"').replace("unit = 1", "unit = 1\nscael = 2"))
        mistakes = (('version = 1', None), ('name = "x"', None), ('parrity = "none"', 'did you mean "parity"?'),
                    ("[parameters]", None), ('speed = "fast"', "names and whole numbers"),
                    ("[status]", None), ("address = 1", None), ("movng = 3", 'did you mean "moving"?'), ("ready = 40", "from 0 to 15"),
                    ("[position]", None), ("addres = 4", 'did you mean "address"?'), ('type = "s33"', "u16, s16, u32 or s32"),
                    ("[alarm]", None), ("address = 9", None), ('kind = "bit"', "code, bits"),
                    ("[alarm.names]", None), ('overload = "x"', 'such as 0x30 = "overload"'),
                    ("[[move]]", None), ("address = 7", None), ('values = ["u16 sped", "s32 target", "u8 1"]', '"sped" is neither'),
                    ("[[move]]", None), ("adress = 8", 'did you mean "address"?'), ("values = [1]", None),
                    ("[[stop]]", "values must be"), ("address = 70000", "from 0 to 65535"))
        path = os.path.join(self.folder.name, "drive.toml")
        self.write("\n".join(line for line, _ in mistakes) + "\n", path)
        told = self.told()
        of_profile = [(line, text) for file, line, text in told if file == path]
        expected = [(number, says) for number, (_, says) in enumerate(mistakes, 1) if says]
        expected.insert([line for line, _ in expected].index(20) + 1, (20, "types are u16, s16, u32 and s32"))
        self.assertEqual([line for line, _ in of_profile], [line for line, _ in expected], told)
        for (_, text), (_, says) in zip(of_profile, expected):
            self.assertIn(says, text)
        self.assertEqual([(line, 'did you mean "scale"?' in text) for file, line, text in told if file == self.file], [(12, True)], told)

    def test_mistakes_of_a_scene_are_told_in_the_scene(self):
        with open(SCENE, encoding="utf-8") as scene:
            text = scene.read()
        self.assertIn("[camera]", text)
        self.write(text.replace("[camera]", "[camera]\nwidht = 3").replace("[lens]", "[lens]\nsteeps = 3"),
                   os.path.join(self.folder.name, "scene.toml"))
        self.write(GOOD.replace(SCENE, "scene.toml") + "bogus = 1\n")
        told = self.told()
        self.assertEqual([os.path.basename(file) for file, _, _ in told], ["lensd.toml", "scene.toml", "scene.toml"])
        self.assertTrue('"width"' in told[1][2] and '"steps"' in told[2][2], told)

    def test_a_good_one_says_so_in_one_line(self):
        for text, says in ((GOOD, "is valid: 1 lens (a)"), ("version = 1\n", "is valid: no lens"),
                           (GOOD + GOOD.split("\n", 1)[1].replace('"a"', '"b"'), "is valid: 2 lenses (a, b)")):
            self.write(text)
            done = self.lensd("--config", self.file, "--check-config")
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, f"{self.file} {says}\n", ""))
        nothing = self.lensd("--check-config")
        self.assertEqual(nothing.returncode, 64)
        self.assertIn("lensd --check-config --config /etc/lensd/lensd.toml", nothing.stderr)

    def test_the_daemon_itself_refuses_with_the_first(self):
        self.write(TEN)
        done = self.lensd("--config", self.file, "--socket", os.path.join(self.folder.name, "s"))
        self.assertEqual(done.returncode, 78)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn("lensd.toml:2: unknown key \"verbose\"", done.stderr)
        self.write(GOOD + 'strat = "home"\n')
        done = self.lensd("--config", self.file, "--socket", os.path.join(self.folder.name, "s"))
        self.assertEqual(done.returncode, 78)
        self.assertIn('did you mean "start"?', done.stderr)


if __name__ == "__main__":
    unittest.main()
