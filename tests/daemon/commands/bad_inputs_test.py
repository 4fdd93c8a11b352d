"""120 wrong commands over lensctl, lensd and lens-bench: each ends with its status and one line that says what is wrong and what to type
instead. The texts stand here as people read them; one that gets worse has to be changed here too."""
import os
import shlex
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import BIN, Daemon  # noqa: E402

PLAN = "plan --focal-length 50mm --f-number 1.4..16 --extension 0mm..3mm "
DOF = "dof --focal-length 50mm --f-number 2.8 --blur-limit 20um "
BLUR = "blur --focal-length 50mm --f-number 2.8 "
VERIFY = "verify a.png --depth-map d.png "
LENGTH = "a length in nm um mm cm m km in ft, such as 850mm or 5ft7in"
DEPTH = "a distance in um mm cm m km in ft (0.8m, 33in), a vergence in D (2.5D), or inf"
DOF_EXAMPLE = "for example: lensctl dof --focal-length 50mm --f-number 2.8 --focus 6ft --blur-limit 20um; see lensctl dof --help"
NOBODY = 'there is no lens "nobody"; there is a, b'
WHICH = "say which lens: there is a, b"
CHART = "charts are SVG or PNG, so the name has to end in .svg or .png"

# status, command (lensctl unless it begins with lensd or lens-bench), and what the line says
WRONG = (
    # words
    (64, "", "say which command; see lensctl --help"),
    (64, "focuss a 1m", "there is no command 'focuss' (did you mean focus?); see lensctl --help"),
    (64, "Plan --sharp 2m:20um", "there is no command 'Plan' (did you mean plan?)"),
    (64, "--jsn list", "lensctl list has no option --jsn (did you mean --json?); see lensctl list --help"),
    (64, "help focuss", "has no command 'focuss' (did you mean focus?); see lensctl help"),
    (64, "preset", "say which command: lensctl preset has save, recall, remove, list; see lensctl preset --help"),
    (64, "preset load a x", "there is no command 'load': lensctl preset has save, recall, remove, list; see lensctl preset --help"),
    (64, "lease tak a", "there is no command 'tak' (did you mean take?): lensctl lease has take, drop; see lensctl lease --help"),
    (64, "reload extra", "lensctl reload takes no 'extra'"),
    (64, "doctor extra", "lensctl doctor takes no 'extra'"),
    (64, "devices --write-confi x", "has no option --write-confi (did you mean --write-config?)"),
    (64, "list --timeout 5", "--timeout '5': a bare number; give its unit: a time in ns us ms s min h, such as 500ms or 1/250s"),
    # dof
    (64, "dof", "--focal-length is required; " + DOF_EXAMPLE),
    (64, "dof --focal-length 50mm", "--f-number is required; " + DOF_EXAMPLE),
    (64, "dof --focal-length 50mm --f-number 2.8", "--blur-limit is required; " + DOF_EXAMPLE),
    (64, "dof --focal-lenght 50mm", "has no option --focal-lenght (did you mean --focal-length?)"),
    (64, "dof --focal-length 50 --f-number 2.8 --blur-limit 20um", "--focal-length '50': a bare number; give its unit: " + LENGTH),
    (64, "dof --focal-length 50kg --f-number 2.8 --blur-limit 20um", "--focal-length '50kg': not a quantity; write " + LENGTH),
    (64, "dof --focal-length=-50mm --f-number 2.8 --blur-limit 20um", "--focal-length '-50mm': must be greater than zero"),
    (64, "dof --focal-length 50mm --f-number 0 --blur-limit 20um", "--f-number '0': an f-number must be greater than zero"),
    (64, "dof --focal-length 50mm --f-number 2mm --blur-limit 20um", "'2mm': not an f-number; write a number without a unit, such as 2.8"),
    (64, "dof --focal-length 50mm --f-number 2.8 --blur-limit 2px", "a limit in px needs the size of a pixel: add --pixel, or write it in um"),
    (64, DOF + "--focus 50mm", "at or inside the focal length: the closest focus is just beyond 50 mm"),
    (64, DOF + "--focus=-1m", "--focus '-1m': a distance must be greater than zero"),
    (64, DOF + "--focus 2", "--focus '2': a bare number; give its unit: " + DEPTH),
    (64, DOF + "--wavelength 550", "--wavelength '550': a bare number; give its unit: " + LENGTH),
    (1, "dof --focal-length 50mm --f-number 22 --blur-limit 2um --wavelength 550nm", "nothing is sharp; open the lens (a smaller --f-number)"),
    (64, DOF + "--plot e.jpg", "--plot 'e.jpg': " + CHART),
    (73, DOF + "--plot /nonexistent/e.svg", "/nonexistent/e.svg: cannot create a file beside it: No such file or directory"),
    (64, DOF + "--plot e.svg --plot-theme blue", "--plot-theme 'blue': say light or dark, as in --plot-theme dark"),
    (64, DOF + "--plot-theme dark", "--plot-theme requires --plot; " + DOF_EXAMPLE),
    # blur, points, light
    (64, BLUR + "--at 1m", "say where the sensor stands, once: --focus, --extension or --sensor-distance, such as --focus 2m"),
    (64, BLUR + "--focus 2m", "--at is required; for example: lensctl blur --focal-length 50mm --f-number 2.8 --focus 2m --at 1.5m"),
    (64, "blur --focal-length 50mm --focus 2m --at 1m", "give the opening once: --f-number or --aperture-diameter, such as --f-number 2.8"),
    (64, BLUR + "--focus 2m --extension 1mm --at 1m", "say where the sensor stands, once"),
    (64, BLUR + "--focus hyperfocal --at 1m", "needs --blur-limit: the blur that still counts as sharp, such as 20um"),
    (64, BLUR + "--focus 2m --at=-1m", "--at '-1m': a distance must be greater than zero"),
    (64, BLUR + "--focus 2m --at 1m --model fish", "--model 'fish': say pinhole, aperture, thin or diffraction"),
    (64, "blur --model pinhole --at 1m", "needs --sensor-distance, such as --sensor-distance 50mm"),
    (64, BLUR + "--focus 2m --at 1m --plot b.gif", "--plot 'b.gif': " + CHART),
    (64, "conjugate --focal-length 50mm", "--point is required; for example: lensctl conjugate --focal-length 50mm --point 0.1m,0m,2m"),
    (64, "conjugate --focal-length 50mm --point 1m,2m", "write three lengths X,Y,Z such as 0mm,10mm,2m"),
    (64, "project --focal-length 50mm --f-number 2.8 --focus 2m", "give --point X,Y,Z for the area of the sensor it lights"),
    (64, "light --focal-length 50mm", "give the opening once: --f-number or --aperture-diameter, such as --f-number 2.8"),
    # plan
    (64, "plan --f-number 2.8 --focal-length x", "--focal-length 'x': not a quantity; write " + LENGTH),
    (64, "plan --focal-length 50mm --extension 0mm..3mm --sharp 2m:20um", "--f-number is required, such as 1.4..22 or 1.4,2,2.8"),
    (64, "plan --focal-length 50mm --f-number 2.8 --sharp 2m:20um", "--extension is required, such as 0mm..8mm (or --sensor-distance)"),
    (64, PLAN + "--sharp 2m", "--sharp '2m': add a blur limit such as :8um, or give --pixel for 1px"),
    (64, PLAN + "--sharp 2m:20", "a bare number; give its unit: a blur diameter such as 8um or 1.5px"),
    (64, PLAN + "--sharp 2m..3m..4m:20um", "--sharp '3m..4m': not a quantity; write " + DEPTH),
    (64, PLAN + "--sharp 2m:20um:behind", "a side is for --blurred only"),
    (64, PLAN + "--sharp 2m:20um --blurred 5m:60um:left", "write [NAME=]WHERE[:LIMIT][:behind|:front]"),
    (64, PLAN + "--sharp 'plane(1,2):20um'", "takes three vergences in dioptres, such as plane(0.8,0.3,0)"),
    (64, PLAN + "--sharp @1:20um", "classes such as @1 need --depth-map F.png"),
    (64, PLAN + "--sharp 2m:20um --objective depth", "needs --focus and --blur-limit, such as --focus 2m --blur-limit 20um"),
    (64, PLAN + "--sharp 2m:20um --objective best", "--objective 'best': say light, sharp or depth"),
    (64, PLAN + "--sharp 2m:20um --f-number-tolerance 150%", "the f-number tolerance must be a ratio from 0 to below 1"),
    (64, PLAN + "--sharp 2m:20um --from moon", "--from 'moon': say lens, sensor or front"),
    (64, PLAN + "--sharp 2m:20um --units yd", "--units 'yd': say m, mm, ft, in or D"),
    (64, PLAN + "--sharp 2m:20um --aperture-diameter 3mm..20mm", "give the opening once"),
    (64, PLAN + "--sharp 2m:20um --plot e.pdf", "--plot 'e.pdf': " + CHART),
    (66, PLAN + "--sharp @1:20um --depth-map /nonexistent.png", "/nonexistent.png: No such file or directory"),
    (65, PLAN + "--sharp @1:20um --depth-map /etc/passwd", "/etc/passwd: not a PNG file"),
    (68, "plan nobody --sharp 2m:20um", 'there is no lens "nobody"; see lensctl list'),
    (64, "plan a --apply --stack --sharp 2m:20um", "--apply is for one plan; leave --stack out, or take the stack: lensctl stack -o DIR"),
    # the proof by picture
    (64, "verify", "PICTURE is required; for example: lensctl verify picture.png --reference a.png"),
    (64, VERIFY + "--reference b.png", "--reference is needed twice or more"),
    (66, VERIFY + "--reference b.png --reference c.png", "a.png: No such file or directory"),
    (64, VERIFY + "--reference b.png --reference c.png --sharp 1m..2m:5um", "needs the size of a pixel: add --pixel"),
    # moves
    (64, "focus", "write lensctl focus [NAME] TARGET, a distance or vergence (0.8m, 1.2D, inf)"),
    (64, "focus a 5", "TARGET '5': a bare number; write 5m or 5mm for a distance, 5D for a vergence, @5 for this position of the motor, or +5 to move by"),
    (64, "focus 2.3", "TARGET '2.3': a bare number; write 2.3m"),
    (64, "focus 2,3m", "TARGET '2,3m': decimals stand after a point, not after a comma: write 2.3m"),
    (64, "focus 1.5M", "TARGET '1.5M': the unit is written m: write 1.5m"),
    (64, "focus 2m a", "'2m a': the name of the lens stands first; write lensctl focus a 2m"),
    (64, "focus 1.2 m", "'1.2 m': a number and its unit are one word; write lensctl focus 1.2m"),
    (64, "focus 2m-3m", "TARGET '2m-3m': one quantity belongs here, not a range"),
    (64, "aperture 2.8 a", "'2.8 a': the name of the lens stands first; write lensctl aperture a 2.8"),
    (64, "iris a 2.8", "there is no command 'iris': write lensctl aperture a 2.8"),
    (64, "a --help", "there is no command 'a'; the name of a lens stands after the command; see lensctl --help"),
    (64, "focsu --help", "there is no command 'focsu' (did you mean focus?)"),
    (64, "preset load --help", "there is no command 'load': lensctl preset has save"),
    (64, DOF + "--focus 1.2 m", "'m' stands alone: a number and its unit are one word, such as 1.2m"),
    (64, DOF + "--focus 1,5m", "--focus '1,5m': decimals stand after a point, not after a comma: write 1.5m"),
    (64, PLAN + "--sharp 2m-3m:20um", "--sharp '2m-3m': a range has two dots between its ends: write 2m..3m"),
    (64, "autofocus a --method swep", "; did you mean sweep?"),
    (64, "autofocus a --roi 256,192,128,96", "--roi '256,192,128,96': these are pixels; write fractions of the frame"),
    (64, "focus a +100mm", "a distance has no sign; +N, -N, near:N and far:N move by N steps, ext:2.6mm is an extension"),
    (64, "focus a @", "the position is missing, as in @1200"),
    (64, "focus a @x", "TARGET 'x': not a quantity; write a plain number"),
    (64, "focus a ext:3", "TARGET '3': a bare number; give its unit: " + LENGTH),
    (64, "focus a 2m 3m", "write lensctl focus [NAME] TARGET"),
    (64, "focus a f/2", "TARGET 'f/2': not a quantity; write " + DEPTH),
    (6, "focus a @99999", "99999 steps is outside what focus may reach: 0 steps to 4000 steps"),
    (6, "focus a 1mm", "the closest focus is 415.625 mm"),
    (68, "focus nobody 1m", NOBODY),
    (64, "focus 1m", WHICH),
    (64, "aperture a x", "N 'x': not an f-number; write a number without a unit, such as 2.8 or f/2.8"),
    (6, "aperture a 0.5", "f/0.5 is outside what iris may reach: f/1.4 to f/16"),
    (64, "zoom", "write lensctl zoom [NAME] F, a focal length, such as 35mm"),
    (64, "zoom a 35mm --free --tolerance 5um", "--tolerance is for a focus that follows, and with --free it does not follow"),
    (64, "focus a", "'a' is a lens, and the TARGET is missing"),
    (64, "focus a " + "x" * 5000, "TARGET '" + "x" * 60 + "...': not a quantity"),
    (64, "wait a", "'a' is a lens, and the STATE is missing: say idle, connected or homed"),
    (64, "autofocus a --policy best", "best not in {nearest,farthest,widest}"),
    (64, "hold a --for 2h", "--for '2h': an hour at most"),
    (64, "autofocus a --roi 0.5,0.5,0.6,0.1", "--roi: it is not within the frame"),
    (64, "zoom a 35", "F '35': a bare number; give its unit: " + LENGTH),
    (8, "zoom a 35mm", "this lens has no motorised zoom"),
    (8, "filter a 1", "this lens has no motorised filter"),
    (64, "home a nose", "there is no axis 'nose': the axes are focus, iris, zoom and filter"),
    (64, "home", WHICH),
    (68, "stop nobody", NOBODY),
    (68, "status nobody", NOBODY),
    (68, "undo nobody", NOBODY),
    (64, "wait a asleep", "STATE 'asleep': say idle, connected or homed"),
    (64, "exposure a 5", "the exposure time '5': a bare number; give its unit: a time in"),
    (64, "plan a --apply", "--apply moves the lens to a plan, and this plan has no limit: say what has to be sharp, as in --sharp 1m..2m:2px"),
    (6, "focus a 2in", " in is outside what focus may reach: "),
    (64, "calibrate a --show --all", "--all belongs to --remove"),
    # autofocus, calibration, pictures
    (64, "autofocus a --roi 1,2,3", "--roi: say X,Y,W,H as fractions of the frame, such as 0.4,0.4,0.2,0.2"),
    (64, "autofocus a --method magic", "there is no autofocus method 'magic'; there are: auto"),
    (64, "autofocus a --range 1m", "two places with .. between them, such as 0.8m..2m"),
    (64, "autofocus a --step x", "a number of native steps such as 20steps"),
    (64, "autofocus a --plot e.bmp", "--plot 'e.bmp': " + CHART),
    (64, "autofocus a --track --plot e.svg", "--track continues after its answer, but --plot and --record are for one search"),
    (64, "calibrate a", "say one of --at DEPTH (guided), --point STEPS=DEPTH, --from-file FILE, --show and --remove"),
    (64, "calibrate a --point 5", "--point '5': write STEPS=DEPTH, such as 1200=0.8m or 0=inf"),
    (66, "calibrate a --from-file /nonexistent", "/nonexistent: cannot be read"),
    (1, "calibrate a --show --plot c.svg", "has no measured curve of focus to draw (uncalibrated): lensctl calibrate a --at"),
    (64, "calibrate a --remove --plot c.svg", "draw it before: lensctl calibrate --show --plot curve.svg"),
    (64, "calibrate a --repeat 0 --at 1m", "--repeat: Value 0 not in range 1 to 20; for example: lensctl calibrate"),
    (64, "backlash a --steps=-5", "--steps '-5': backlash is not negative; write its native steps, such as 12"),
    (8, "backlash b iris", "only the backlash of focus can be measured by looking; say how many steps it is instead"),
    (64, "snapshot a", "-o is required; for example: lensctl snapshot"),
    (64, "snapshot a -o e.gif", "a picture is PNG or JPEG by its name's ending, .png, .jpg or .jpeg"),
    (73, "snapshot a -o /nonexistent/e.png", "/nonexistent/e.png: No such file or directory"),
    (64, "snapshot a -o x.png --scale-to 5", "--scale-to: say WIDTHxHEIGHT in pixels, such as 640x480"),
    (64, "stack a --sharp 1m..2m:20um", "-o is required; for example: lensctl stack"),
    (73, "stack a --sharp 1m..2m:20um -o /proc/nothing", "/proc/nothing: No such file or directory"),
    # presets, calls, files, sockets
    (64, "preset save", "write lensctl preset save [NAME] LABEL"),
    (64, "preset save a 9x!", "a label has letters (a to z, A to Z), digits, '-', '_', '.' and spaces inside, at most 64"),
    (68, "preset recall a nothing", 'there is no preset "nothing"; none is saved'),
    (64, "call", "METHOD is required; for example: lensctl call"),
    (8, "call Nope", "the daemon has no method 'Nope'; lensctl introspect says which it has"),
    (64, "call io.lensd.Lens.Status '{'", "the parameters must be one JSON object, such as"),
    (64, """call io.lensd.Lens.Status '{"lens":5}'""", "the parameter 'lens' is missing, unknown or of the wrong kind; see lensctl introspect"),
    (8, "introspect a.b.c", "the daemon has no interface 'a.b.c'; lensctl introspect says which it has"),
    (64, "backup", "FILE is required; for example: lensctl backup"),
    (66, "restore /nonexistent", "/nonexistent: No such file or directory"),
    (64, "completion", "SHELL is required; for example: "),
    (64, "completion tcsh", "SHELL 'tcsh': say bash, zsh or fish"),
    (69, "--socket /nonexistent/s list", "start lensd, or name its socket with --socket or LENSD_SOCKET"),
    # lensd
    (64, "lensd --config", "--config needs a value; for example: lensd --config /etc/lensd/lensd.toml"),
    (64, "lensd --cofnig x", "there is no option --cofnig; did you mean --config?; for example: lensd --config"),
    (64, "lensd extra", "'extra' is no option; for example: lensd --config /etc/lensd/lensd.toml"),
    (64, "lensd --check-config", "--check-config needs a file to check: lensd --check-config --config /etc/lensd/lensd.toml"),
    (78, "lensd --config /nonexistent.toml", "/nonexistent.toml: No such file or directory"),
    # lens-bench
    (64, "lens-bench plann", "there is no command 'plann'; did you mean plan?; lens-bench --help lists them"),
    (64, "lens-bench autofocus", "give either --scene or --replay, as in --scene scenes/brick.toml"),
    (74, "lens-bench autofocus --scene /nonexistent.toml", "/nonexistent.toml: No such file or directory"),
    (64, "lens-bench autofocus --runs 0 --scene x.toml", "--runs: Value 0 not in range 1 to 1000000; see lens-bench autofocus --help"),
    (64, "lens-bench verify", "this is a command of lensctl now: lensctl verify"),
    (64, "lens-bench report", "--output is required; write lens-bench report --output"),
    (64, "lens-bench render --bogus", "there is no option --bogus; see lens-bench render --help"),
    (64, "lens-bench evidence extra", "'extra' is no option; see lens-bench evidence --help"),
)


class BadInputs(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.folder = tempfile.TemporaryDirectory()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()
        cls.daemon.stop()

    def run_wrong(self, command):
        words = shlex.split(command)
        program = words.pop(0) if words and words[0] in ("lensd", "lens-bench") else "lensctl"
        if program == "lens-bench" and not os.path.exists(os.path.join(BIN, program)):
            self.skipTest("sanitizer builds have no lens-bench")
        environment = {**os.environ, "LENSD_SOCKET": self.daemon.socket}
        return program, subprocess.run([os.path.join(BIN, program), *words], capture_output=True, text=True, check=False, timeout=120,
                                       cwd=self.folder.name, env=environment)

    def test_each_says_what_is_wrong_and_what_to_do(self):
        self.assertGreaterEqual(len(WRONG), 120)
        self.assertEqual(len({command for _, command, _ in WRONG}), len(WRONG))
        for status, command, says in WRONG:
            with self.subTest(command=command):
                program, done = self.run_wrong(command)
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertIn(says, done.stderr)
                self.assertEqual((done.stdout, done.stderr.count("\n")), ("", 1), done.stderr)
                if status != 78:  # that is a line of the log
                    self.assertTrue(done.stderr.startswith(program), done.stderr)
                if "is required" in done.stderr:
                    self.assertRegex(done.stderr, r"is required(, such as |; for example: lensctl |; write lens-bench )\S")
        self.assertEqual(os.listdir(self.folder.name), [])  # nothing was written by what was refused

    def test_the_daemon_is_as_it_was(self):
        done = self.daemon.lensctl("list")
        self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
