"""lensctl add: from an empty configuration to a plan that holds, in at most four commands and without a file edited; and nothing is
left behind where something is wrong."""
import contextlib
import fcntl
import json
import os
import pty
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import tomllib
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, ".."), os.path.join(HERE, "..", "..", "drivers", "aravis")]
from harness import BIN, LENS, PATIENCE, Daemon, played_node, quick_scene  # noqa: E402
from own_network import Turn  # noqa: E402

ROOT = os.path.join(HERE, "..", "..", "..")
GIGE = os.path.join(ROOT, "tests", "drivers", "aravis", "quick.toml")
EMPTY = "version = 1\n"
OPTICS = ("--focal-length", "25mm", "--f-number", "1.4..16", "--closest", "0.42m")
LENSCONNECT = ("--driver", "lensconnect", "--set", "serial=x")
COUNT = 200 if os.environ.get("LENSD_TEST_LEVEL") == "long" else 8
turn = Turn()


def setUpModule():
    turn.take()


def tearDownModule():
    turn.give()


@contextlib.contextmanager
def running(*command, ready):
    """A simulated device, once it has printed a line that `ready` finds."""
    with subprocess.Popen([os.path.join(BIN, command[0]), *command[1:]], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as process:
        try:
            line = process.stdout.readline()
            found = re.search(ready, line)
            assert found, "the simulated device did not start: " + line
            yield found.group(found.re.groups)
        finally:
            process.send_signal(signal.SIGTERM)
            process.stdin.close()
            process.wait(timeout=30 * PATIENCE)


class AddCase(unittest.TestCase):
    def start(self, config=EMPTY, **played):
        self.daemon = Daemon(config=config, **played)
        self.addCleanup(self.daemon.stop)
        self.folder = self.daemon.config + ".d"
        return self.daemon

    def done(self, *words, status=0, **options):
        done = self.daemon.lensctl(*words, **options)
        self.assertEqual(done.returncode, status, f"{words}: {done.stdout}{done.stderr}")
        return done

    def number_of(self, serial):
        """As lensctl counts them: other devices may be plugged into this machine."""
        found = json.loads(self.done("devices", "--json").stdout)
        return str(1 + [device["serial"] for device in found].index(serial))

    def names(self):
        with self.daemon.client() as client:
            return [one["name"] for one in client.call(LENS + "List")["parameters"]["lenses"]]

    def untouched(self):
        """Neither a file nor a folder is there that was not, and the configuration is as it was."""
        self.assertFalse(os.path.exists(self.folder), os.path.exists(self.folder) and os.listdir(self.folder))
        with open(self.daemon.config, encoding="utf-8") as file:
            self.assertEqual(file.read(), EMPTY)
        self.assertEqual(self.names(), [])


class FirstHour(AddCase):
    """Each device: lensctl add, what the page of the family says, and a plan that is applied."""

    def plan_holds(self, name):
        self.done("plan", name, "--sharp", "0.8m..1.6m:60um", "--apply")
        status = json.loads(self.done("status", name, "--json").stdout)
        status = status[0] if isinstance(status, list) else status
        self.assertEqual(status["connection"], "connected")

    def test_simulated(self):
        daemon = self.start()
        scene = quick_scene(daemon.folder.name)
        answer = json.loads(self.done("add", "--driver", "sim", "--set", "scene=" + scene, "--name", "bench", "--json").stdout)
        self.assertEqual(answer["file"], os.path.join(self.folder, "bench.toml"))
        self.assertIsNone(answer["reason"])
        self.assertTrue(0 < answer["picture"]["mean"] < 255, answer)
        self.assertGreater(answer["picture"]["sharpness"], 0)
        self.plan_holds("bench")

    @unittest.skipUnless(os.path.exists(os.path.join(BIN, "sim-gige-camera")), "built without GenICam")
    def test_genicam(self):
        with running("sim-gige-camera", "--scene", GIGE, "--serial", "TEST1", ready="(ready)"):
            self.start()
            number = self.number_of("TEST1")
            text = self.done("add", number, "--name", "gige", *OPTICS, "--closest-from", "lens").stdout
            self.assertRegex(text, r"picture: mean [0-9.]+ of 255, sharpness [0-9.e-]+")
            self.assertEqual(self.names(), ["gige"])
            self.plan_holds("gige")
            # It is in use by now, and a second time there is nothing to add.
            self.assertIn("in use already, by gige", self.done("add", self.number_of("TEST1"), "--name", "two", *OPTICS, status=64).stderr)
            self.assertEqual(os.listdir(self.folder), ["gige.toml"])

    def test_modbus(self):
        with running("sim-modbus-drive", "--tcp", "0", "--unit", "1", "--unit", "2", ready=r"(\d+)\s*$") as port:
            self.start()
            text = self.done("add", "--bus", "127.0.0.1:" + port, "--drive", "focus=1,oriental-az,0..4000",
                             "--drive", "iris=2,oriental-az,0..2000", "--direction", "near-positive", "--name", "ring",
                             "--set", "response_timeout_ms=500", *OPTICS).stdout
            self.assertIn("no picture: it has no camera", text)
            # Its optics are known, but not yet where its iris stands.
            said = self.done("focus", "ring", "hyperfocal", "--blur-limit", "60um", status=7).stderr
            self.assertIn("where the iris stands is not known", said)
            self.assertIn("lensctl home ring", said)
            self.assertNotIn("[lens.optics]", said)
            self.done("home", "ring")
            self.done("focus", "ring", "hyperfocal", "--blur-limit", "60um")
            self.plan_holds("ring")

    def test_v4l2(self):
        """A webcam of the kernel with motorised focus. No search finds a played node, since it is a file."""
        with tempfile.TemporaryDirectory(prefix="lensd-played-") as folder:
            node = self.played(folder)
            text = self.done("add", "--driver", "v4l2", "--set", "device=" + node, "--name", "desk", "--focal-length", "4mm",
                             "--f-number", "2.0", "--closest", "0.1m", "--pixel", "3um", "--direction", "near-positive").stdout
            self.assertRegex(text, r"picture: mean [0-9.]+ of 255, sharpness [0-9.e-]+")
            self.plan_holds("desk")

    def test_what_is_not_known_is_no_obstacle(self):
        with running("sim-modbus-drive", "--tcp", "0", "--unit", "1", ready=r"(\d+)\s*$") as port:
            self.start()
            text = self.done("add", "--bus", "127.0.0.1:" + port, "--drive", "focus=1,oriental-az,0..4000", "--name", "ring",
                             "--focal-length", "25mm", "--f-number", "unknown", "--closest", "unknown").stdout
            self.assertIn("its optics are not known", text)
            with open(os.path.join(self.folder, "ring.toml"), encoding="utf-8") as file:
                self.assertIn("# [lens.optics] focal_length_mm = 25\n", file.read())
            doctor = [one for one in json.loads(self.daemon.lensctl("doctor", "--json").stdout) if one["check"] == "lens ring"]
            self.assertIn("optics are not known", doctor[0]["message"])
            self.assertIn("[lens.optics]", doctor[0]["remedy"])

    def test_a_person_is_asked(self):
        """Again where an answer cannot be read, with what is wrong, and the answers before it count."""
        with running("sim-modbus-drive", "--tcp", "0", "--unit", "1", ready=r"(\d+)\s*$") as port:
            self.start()
            status, text = self.asked(("--bus", "127.0.0.1:" + port, "--drive", "focus=1,oriental-az,0..4000", "--name", "ring"),
                                      ("focal length, as", "25"), ("a bare number.*focal length, as", "25mm"),
                                      ("f-numbers, as", "1,4"), ("a point, not a comma.*f-numbers, as", "zero"),
                                      ("f-numbers, as", "1.4..16"), ("closest distance, as", "0.42m"))
            self.assertEqual(status, 0, text)
            self.assertIn("added ring: " + os.path.join(self.folder, "ring.toml"), text)
            # A blur in pixels needs their size, and the refusal says the option and the key.
            said = self.done("plan", "ring", "--sharp", "0.8m..1.6m:1px", status=64).stderr
            self.assertIn("--pixel", said)
            self.assertIn("pixel_um", said)
            self.assertNotIn("pixelUm", said)

    def test_three_wrong_answers_end_it_and_nothing_is_left(self):
        self.start()
        draw = random.Random(3)
        at = draw.randrange(3)
        questions = (("focal length, as", "25mm", "25px"), ("f-numbers, as", "2.8", "f/zero"), ("closest distance, as", "0.3m", "inf"))
        asked = [(question, good) for question, good, _ in questions[:at]] + [(questions[at][0], questions[at][2])] * 3
        status, text = self.asked(("--bus", "127.0.0.1:1", "--drive", "focus=1,oriental-az,0..4000", "--name", "ring"), *asked)
        self.assertEqual(status, 64, text)
        self.untouched()

    def test_a_person_is_asked_for_the_pixel_that_a_webcam_does_not_report(self):
        with tempfile.TemporaryDirectory(prefix="lensd-played-") as folder:
            node = self.played(folder)
            optics = ("--driver", "v4l2", "--set", "device=" + node, "--direction", "near-positive")
            status, text = self.asked((*optics, "--name", "desk"), ("focal length, as", "4mm"), ("f-numbers, as", "2.0"),
                                      ("closest distance, as", "0.1m"), ("size of a pixel.*, as", "3um"))
            self.assertEqual(status, 0, text)
            with self.daemon.client() as client:
                info = client.call(LENS + "List")["parameters"]["lenses"][0]
            self.assertAlmostEqual(info["camera"]["pixelUm"], 3)

    def test_what_does_not_fit_is_said_by_add_and_doctor(self):
        """A range of focal lengths without a zoom, and a direction that nobody knows: each alone and both, or neither."""
        draw = random.Random(48)
        for zoom, unknown in draw.sample([(True, True), (True, False), (False, True), (False, False)], 4):
            with running("sim-modbus-drive", "--tcp", "0", "--unit", "1", ready=r"(\d+)\s*$") as port:
                self.start()
                direction = () if unknown else ("--direction", draw.choice(["near-positive", "near-negative"]))
                text = self.done("add", "--bus", "127.0.0.1:" + port, "--drive", "focus=1,oriental-az,0..4000", "--name", "ring",
                                 "--focal-length", "8mm..48mm" if zoom else "25mm", *OPTICS[2:], *direction).stdout
                doctor = [one for one in json.loads(self.daemon.lensctl("doctor", "--json").stdout) if one["check"] == "lens ring"]
                for said in (text, " ".join(one["message"] + " " + str(one["remedy"]) for one in doctor)):
                    self.assertEqual("no motorised zoom" in said, zoom, said)
                    self.assertEqual("direction of its focus is not known" in said, unknown, said)
                    self.assertEqual("[lens.focus]" in said, unknown, said)
                self.daemon.stop()

    def played(self, folder):
        """lensd with a webcam of the kernel, and the path of its node."""
        node, table = os.path.join(folder, "video0"), os.path.join(folder, "table.ctl")
        with open(node, "w", encoding="utf-8"), open(table, "w", encoding="utf-8") as file:
            file.write("009a090a 1 0 250 1 0 40 0\n009a090c 2 0 1 1 0 1 0\n")
        self.start(preload=played_node(folder), environment={"FAKE_NODE": node, "FAKE_CTL": table, "FAKE_FMT": "320 240 GREY 30"})
        return node

    def asked(self, words, *questions):
        """lensctl add at a terminal: for each of `questions` (a pattern) it waits, then gives the answer."""
        leader, follower = pty.openpty()
        with subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "add", *words],
                              stdin=follower, stdout=subprocess.PIPE, stderr=follower, text=True) as process:
            os.close(follower)
            said = ""
            for question, answer in questions:
                while not re.search(question + r"[^\n]*: $", said, re.DOTALL):
                    said += os.read(leader, 4096).decode()
                said = ""
                os.write(leader, (answer + "\n").encode())
            text = process.stdout.read()
            status = process.wait(timeout=60 * PATIENCE)
        os.close(leader)
        return status, text


class Saved(AddCase):
    """lensctl setup --save, into the file of lensctl add alone."""

    def test_what_was_measured_is_in_the_file(self):
        daemon = self.start()
        scene = quick_scene(daemon.folder.name)
        self.done("add", "--driver", "sim", "--set", "scene=" + scene, "--name", "bench")
        path = os.path.join(self.folder, "bench.toml")
        with open(path, encoding="utf-8") as file:
            before = file.read()
        # What a person wrote stays: comments, other keys, and a key of that name in another table.
        own = "[lens.focus] # the ring\ndeadband = 0\n  speed=7 # a guess\n[lens.iris]\n# speed = 3\nretries = 3\n"
        with open(path, "w", encoding="utf-8") as file:
            file.write(before + own)
        self.done("reload")
        done = daemon.lensctl("setup", "bench", "--save", "--json")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        what = "speed and backlash" if (json.loads(done.stdout)["backlash"] or {}).get("known") else "speed"
        self.assertIn(f"saved {what} in {path}", done.stderr)
        found = {axis["axis"]: axis for axis in json.loads(done.stdout)["axes"]}
        with open(path, encoding="utf-8") as file:
            text = file.read()
        self.assertTrue(text.startswith(before + "[lens.focus] # the ring\n"))
        with open(path, "rb") as file:
            lens = tomllib.load(file)["lens"][0]
        self.assertEqual(lens["focus"]["deadband"], 0)
        self.assertEqual(lens["iris"]["retries"], 3)
        self.assertIn("# speed = 3\n", text)
        for axis in ("focus", "iris"):
            if found[axis]["speed"]:
                self.assertAlmostEqual(lens[axis]["speed"], found[axis]["speed"]["value"], delta=1e-3 * lens[axis]["speed"])
        self.assertTrue(found["focus"]["speed"])
        self.assertEqual(self.names(), ["bench"])

    def test_another_file_is_not_touched(self):
        self.daemon = Daemon(lenses=("a",), quick=True)
        self.addCleanup(self.daemon.stop)
        self.assertIn("lensctl add", self.done("setup", "a", "--save", status=68).stderr)
        folder = self.daemon.config + ".d"
        os.mkdir(folder)
        text = 'version = 1\n[[lens]]\nname = "a"\n[[lens]]\nname = "b"\n'
        with open(os.path.join(folder, "a.toml"), "w", encoding="utf-8") as file:
            file.write(text)
        self.assertIn("of this lens alone", self.done("setup", "a", "--save", status=68).stderr)
        with open(os.path.join(folder, "a.toml"), encoding="utf-8") as file:
            self.assertEqual(file.read(), text)


class SideBySide(AddCase):
    """Two people add a lens at once: one after the other is served, and both see a picture."""

    def begin(self, scene, name):
        return subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "add", "--driver", "sim", "--set",
                                 "scene=" + scene, "--name", name, "--json"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def ends_well(self, process, name):
        said, complained = process.communicate(timeout=120 * PATIENCE)
        self.assertEqual(process.returncode, 0, complained)
        answer = json.loads(said)
        self.assertEqual((answer["name"], answer["reason"]), (name, None))
        self.assertTrue(0 < answer["picture"]["mean"] < 255, answer)

    def test_all_are_added(self):
        draw = random.Random(20261128)
        for _ in range(9 if COUNT > 8 else 1):
            daemon = self.start()
            scene = quick_scene(daemon.folder.name)
            names = [f"cam-{number}" for number in draw.sample(range(100), draw.choice([2, 3]))]
            begun = [(self.begin(scene, name), name) for name in names]
            for process, name in begun:
                self.ends_well(process, name)
            self.assertEqual(sorted(self.names()), sorted(names))
            self.assertEqual(sorted(os.listdir(self.folder)), sorted(name + ".toml" for name in names))
            daemon.stop()

    def test_one_waits_for_the_folder(self):
        daemon = self.start()
        scene = quick_scene(daemon.folder.name)
        os.mkdir(self.folder)
        folder = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            process = self.begin(scene, "cam")
            with self.assertRaises(subprocess.TimeoutExpired):
                process.wait(timeout=2)
            self.assertEqual(os.listdir(self.folder), [])
        finally:
            os.close(folder)
        self.ends_well(process, "cam")


class Refused(AddCase):
    """What goes wrong leaves nothing behind."""

    def test_bad_quantities_and_keys(self):
        daemon = self.start()
        draw = random.Random(20261128)
        scene = quick_scene(daemon.folder.name)
        good = {"--focal-length": "25mm", "--f-number": "1.4..16", "--closest": "0.3m"}
        wrong = {"--focal-length": ["25", "25px", "-3mm", "mm"], "--f-number": ["zero", "2..", "-1"], "--closest": ["inf", "0.3", "-1m"]}
        for _ in range(COUNT):
            option = draw.choice(list(wrong))
            chosen = {**good, option: draw.choice(wrong[option])}
            words = [word for pair in chosen.items() for word in (pair[0] + "=" + pair[1],)]
            with self.subTest(words=words):
                said = self.done("add", *LENSCONNECT, "--name", "a", *words, status=64).stderr
                self.assertIn(option, said)
                self.untouched()
        for words, status, part in ((LENSCONNECT, 64, "--focal-length"),
                                    (("--driver", "sim", "--set", "scene"), 64, "--set"),
                                    *((("--driver", "sim", "--set", "scene=" + scene, *words), 64, words[0] + ": a simulated lens takes its optics")
                                      for words in (OPTICS[:2], OPTICS[2:4], OPTICS[4:], ("--model", "x"), ("--pixel", "3um"),
                                                    ("--closest-from", "front"))),
                                    ((*LENSCONNECT, "--model", "x", *OPTICS[2:4]), 64, "--f-number: --model names"),
                                    (("--driver", "sim", "--set", "on_failure=/bin/true"), 64, "names a program"),
                                    (("--driver", "sim", "--set", "scene=" + scene, "--name", "../a"), 64, "--name"),
                                    (("--driver", "sim", "--set", "scene=" + scene, "--set", "seeed=3"), 78, 'did you mean "seed"'),
                                    (("--driver", "simm"), 64, "--focal-length"),
                                    (("--driver", "sim", "--set", "scene=/no/such.toml"), 78, "such.toml"),
                                    (("--bus", "127.0.0.1:1", "--name", "r"), 64, "--drive"),
                                    (("--bus", "127.0.0.1:1", "--drive", "focus=1,moons"), 64, "--drive"),
                                    (("--bus", "127.0.0.1:1", "--drive", "focus=1,moonz,0..9", *OPTICS), 78, "moonz"),
                                    (("99",), 68, "there is no device 99")):
            with self.subTest(words=words):
                self.assertIn(part, self.done("add", *words, status=status).stderr)
                self.untouched()

    def test_a_list_of_f_numbers_is_no_range(self):
        """Since 2,8 is how many people write 2.8. What to write instead is said for both meanings."""
        draw = random.Random(28)
        self.start()
        for _ in range(COUNT):
            low, high = sorted(draw.sample(range(1, 40), 2))
            first, second = draw.choice([(low, high), (high, low)])
            said = self.done("add", *LENSCONNECT, "--name", "a", *OPTICS[:2], "--f-number", f"{first},{second}", status=64).stderr
            with self.subTest(first=first, second=second):
                written = re.search(r"write ([0-9.]+) or (\d+)\.\.(\d+)", said)
                self.assertIsNotNone(written, said)
                self.assertEqual([float(one) for one in written.groups()], [float(f"{first}.{second}"), low, high])
        self.untouched()

    def test_no_option_beside_a_model_is_dropped(self):
        self.start()
        draw = random.Random(8)
        for _ in range(COUNT):
            option, value = draw.choice([("--focal-length", "25mm"), ("--f-number", "2.8"), ("--closest", "0.3m"), ("--closest-from", "sensor")])
            value = value if option == "--closest-from" else draw.choice([value, "unknown"])
            said = self.done("add", *LENSCONNECT, "--name", "a", "--model", "hasselblad-hcd-50-ii", option, value, status=64).stderr
            with self.subTest(option=option, value=value):
                self.assertIn(option + ": --model names the optics already", said)
        self.untouched()

    def test_numbers_are_text_where_every_driver_takes_text(self):
        """Then the device is looked for, and is not there; a configuration with a number would be refused."""
        self.start()
        draw = random.Random(40123456)
        for _ in range(3):
            number = draw.choice(["40123456", "007", "4e7", "-5", "1.5"])
            said = self.done("add", "--driver", "v4l2", "--set", draw.choice(["serial", "id_path"]) + "=" + number, *OPTICS, status=69).stderr
            self.assertIn("nothing was added", said)
            self.untouched()

    def test_a_file_where_the_folder_belongs(self):
        daemon = self.start()
        with open(self.folder, "w", encoding="utf-8") as file:
            file.write("mine")
        self.assertIn("is no folder", self.done("add", "--driver", "sim", "--set", "scene=" + quick_scene(daemon.folder.name), status=73).stderr)
        with open(self.folder, encoding="utf-8") as file:
            self.assertEqual(file.read(), "mine")

    def test_a_terminal_that_goes_takes_the_file_with_it(self):
        """The device is being opened just then: it takes the connection and does not answer."""
        with socket.create_server(("127.0.0.1", 0)) as silent:
            daemon = self.start()
            with subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", daemon.socket, "add", "--bus",
                                   f"127.0.0.1:{silent.getsockname()[1]}", "--drive", "focus=1,oriental-az,0..4000", "--name", "ring",
                                   "--set", "response_timeout_ms=3000", *OPTICS], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
                silent.settimeout(60 * PATIENCE)
                taken = silent.accept()[0]
                while not os.path.exists(os.path.join(self.folder, "ring.toml")):  # that was the check before
                    taken.close()
                    taken = silent.accept()[0]
                with taken:
                    process.send_signal(signal.SIGHUP)
                    said = process.stderr.read().decode()
                    self.assertEqual(process.wait(timeout=60 * PATIENCE), 130, said)
            self.untouched()

    def test_doctor_names_the_command(self):
        self.start()
        found = json.loads(self.done("devices", "--json").stdout)
        doctor = json.loads(self.daemon.lensctl("doctor", "--json").stdout)
        remedy = next(one["remedy"] for one in doctor if one["check"] == "configuration")
        self.assertIn("sudo lensctl add", remedy)
        self.assertEqual("lensctl add --driver NAME" in remedy, not any(one["lens"] for one in found))
        self.assertNotIn(self.daemon.config, remedy)

    def test_a_device_that_is_not_there(self):
        self.start()
        said = self.done("add", "--bus", "127.0.0.1:1", "--drive", "focus=1,moons,0..4000", *OPTICS, status=69).stderr
        self.assertIn("nothing was added", said)
        self.untouched()

    def test_names_that_exist(self):
        daemon = self.start()
        scene = quick_scene(daemon.folder.name)
        add = ("add", "--driver", "sim", "--set", "scene=" + scene, "--name", "cam")
        os.mkdir(self.folder)
        path = os.path.join(self.folder, "cam.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write("version = 1\n# mine\n")
        self.assertIn("is there already and stays", self.done(*add, status=73).stderr)
        with open(path, encoding="utf-8") as file:
            self.assertEqual(file.read(), "version = 1\n# mine\n")
        os.unlink(path)
        self.done(*add)
        with open(path, encoding="utf-8") as file:
            before = file.read()
        self.assertIn('there is a lens "cam" already', self.done(*add, status=64).stderr)
        with open(path, encoding="utf-8") as file:
            self.assertEqual(file.read(), before)
        self.assertEqual(os.listdir(self.folder), ["cam.toml"])

    def test_a_refused_reload(self):
        daemon = self.start()
        scene = quick_scene(daemon.folder.name)
        with open(daemon.config, "a", encoding="utf-8") as file:
            file.write("bogus = 1\n")
        said = self.done("add", "--driver", "sim", "--set", "scene=" + scene, "--name", "cam", status=78).stderr
        self.assertIn("bogus", said)
        self.assertFalse(os.path.exists(self.folder))
        self.assertEqual(self.names(), [])

    @unittest.skipUnless(os.geteuid() == 0, "only root can become somebody else")
    def test_no_rights(self):
        daemon = self.start()
        for path, mode in ((daemon.folder.name, 0o755), (daemon.socket, 0o666)):
            os.chmod(path, mode)
        said = self.done("add", "--driver", "sim", status=77, user=65534, group=65534, extra_groups=[]).stderr
        self.assertIn("sudo lensctl add", said)
        self.untouched()


if __name__ == "__main__":
    unittest.main()
