"""SIGTERM at any moment and a disk of any slowness: what was in force, or was answered, is on disk afterwards, or named in the
log as lost. What that is, is worked out here from the answers alone."""
import concurrent.futures
import contextlib
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from disk_test import has_address_sanitizer  # noqa: E402
from harness import HERE, LENS, PATIENCE, Daemon  # noqa: E402

# lensd leaves threads unjoined on purpose where a task is still in progress at its end: ThreadSanitizer need not report these.
os.environ["TSAN_OPTIONS"] = " ".join([*filter(None, [os.environ.get("TSAN_OPTIONS")]), "report_thread_leaks=0"])
LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"
SEED = int(os.environ.get("LENSD_TEST_SEED", "38"))
TEXTURES = os.path.join(HERE, "..", "..", "scenes", "textures")
SCENE = f"""version = 1
[camera]
width = 256
height = 192
exposure_ms = 2
frame_rate_hz = 200
[lens]
f_number = [2.8, 16.0]
extension_mm = [0.0, 1.2]
speed_steps_per_s = %d
initial_f_number = 2.8
[[surface]]
kind = "wall"
distance_m = 1.2
texture = "{TEXTURES}/brick.png"
"""
# Every fsync in the state folder takes as many ms as the file `disk` beside it says; at -1 that of every file but those of
# positions fails (without them nothing moves), at -2 every one.
SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
int fsync(int fd) {
  char link[64], path[512], text[32] = "0";
  int spared = 0;
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t got = readlink(link, path, sizeof path - 1);
  path[got > 0 ? got : 0] = 0;
  char *state = strstr(path, "/state");
  if (state) {
    spared = strstr(state, "position") || !strchr(state + 1, '/');
    strcpy(state, "/disk");
    const int disk = open(path, O_RDONLY | O_CLOEXEC);
    if (disk >= 0 && read(disk, text, sizeof text - 1) < 0) text[0] = 0;
    if (disk >= 0) close(disk);
    const int ms = atoi(text);
    if (ms == -2 || (ms == -1 && !spared)) return errno = EIO, -1;
    if (ms > 0) usleep(ms * 1000);
  }
  return ((int (*)(int))dlsym(RTLD_NEXT, "fsync"))(fd);
}
"""
POSITIONS, CALIBRATION, PRESETS = "its positions", "its calibration", "its presets"
BLUR, TEMPERATURE = "what was learned of blur", "what was learned of focus"


def stop_timeout():
    """What the unit says: until then systemd waits."""
    with open(os.path.join(HERE, "..", "..", "systemd", "lensd.service.in"), encoding="utf-8") as file:
        return float(re.search(r"^TimeoutStopSec=(\d+)$", file.read(), re.MULTILINE).group(1))


class Life:
    """One lensd: what is done with it, and what has to be on disk when it has ended."""

    def __init__(self, seed, library):
        self.draw = random.Random(seed)
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-end-")
        self.state, self.disk = (os.path.join(self.folder.name, name) for name in ("state", "disk"))
        config = "version = 1\n"
        for name, speed in (("a", 60000), ("b", 3000)):  # one searches, the other is on its way for long
            scene = os.path.join(self.folder.name, f"{name}.toml")
            with open(scene, "w", encoding="utf-8") as file:
                file.write(SCENE % speed)
            config += f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{scene}"\n[lens.refocus]\nevery_s = 3600\n'
        self.daemon = Daemon(config=config, arguments=("--state", self.state), preload=library)
        self.calibration = None
        self.presets = []  # label, answer
        self.learned = (0, 0)
        self.moved = False
        self.threads = []

    def set_disk(self, ms):
        with open(self.disk + ".new", "w", encoding="ascii") as file:
            file.write(str(ms))
        os.rename(self.disk + ".new", self.disk)

    def ask(self, call, **parameters):
        with self.daemon.client() as client:
            return client.call(LENS + call, parameters)["parameters"]

    def later(self, method, answer, **parameters):
        """A call on a connection of its own, whose answer comes when it comes."""
        client = self.daemon.client()
        client.send(LENS + method, parameters)

        def wait():
            with contextlib.suppress(OSError), client:
                answer.append(client.receive())
        thread = threading.Thread(target=wait, daemon=True)
        thread.start()
        self.threads.append(thread)
        for _ in range(2):
            self.ask("Status")  # lensd has read the call before it by now

    def calibrate(self):
        number = f"{self.draw.uniform(2.0, 3.0):.6f}"
        points = [{"position": 0, "vergenceD": 0.0}, {"position": 4000, "extensionMm": float(number)}]
        answer = []
        self.later("Calibrate", answer, lens="b", points=points, errorUm=5.0)
        deadline = time.monotonic() + 10 * PATIENCE
        wanted = float(number)
        while wanted not in self.extensions(self.ask("GetCalibration", lens="b")["calibration"]["toml"] or ""):
            if answer and answer[0].get("error") not in (None, LENS + "NotKept"):
                return  # refused
            assert time.monotonic() < deadline, ("it is never in force", answer)
            time.sleep(0.005)
        self.calibration = wanted

    @staticmethod
    def extensions(toml):
        return {round(float(number), 6) for number in re.findall(r"\d+\.\d+", toml)}

    def preset(self):
        answer = []
        label = f"p{len(self.presets)}"
        self.presets.append((label, answer))
        self.later("PresetSave", answer, lens=self.draw.choice("ab") if self.moved else "a", label=label)

    def move(self):
        self.moved = True
        self.later("Move", [], lens="b", axis="focus", target={"position": self.draw.randint(100, 4000)})

    def search(self):
        self.ask("Move", lens="a", axis="focus", target={"position": self.draw.randint(400, 3300)})
        # One teaches of blur, the other of focus.
        how = self.draw.choice(({"region": {"x": 0.05, "y": 0.1, "w": 0.4, "h": 0.8}}, {"method": "sweep", "region": {"x": 0.1, "y": 0.1, "w": 0.8, "h": 0.8}}))
        self.ask("Autofocus", lens="a", **how)
        self.learned = (len(self.ask("GetLearned", lens="a")["learned"]["runs"]),
                        len(self.ask("GetRefocus", lens="a")["refocus"]["results"]))

    def live(self):
        acts = [self.calibrate, self.calibrate, self.preset, self.preset, self.preset, self.move, self.move,
                *self.draw.choices([self.calibrate, self.preset, self.move], k=4)]
        self.draw.shuffle(acts)
        if self.draw.random() < 0.5:
            acts.insert(self.draw.randint(0, len(acts)), self.search)
        for act in acts:
            act()
            time.sleep(self.draw.choice((0, 0, 0.03, 0.2)) * self.draw.random())

    def end(self, meanwhile=None):
        """SIGTERM, and the time until lensd has ended."""
        time.sleep(self.draw.choice((0, 0.05, 0.5)) * self.draw.random())
        sent = time.monotonic()
        self.daemon.process.send_signal(signal.SIGTERM)
        if meanwhile:
            meanwhile()
        status = self.daemon.process.wait(timeout=60 * PATIENCE)
        took = time.monotonic() - sent
        assert status == 0, (status, self.daemon.log())
        for thread in self.threads:
            thread.join(10 * PATIENCE)
        return took

    def text(self, name):
        path = os.path.join(self.state, name)
        if not os.path.exists(path):
            return ""
        with open(path, encoding="utf-8") as file:
            return file.read()

    def lost(self):
        """What is not on disk, by lens."""
        lost = set()
        if self.calibration is not None and self.calibration not in self.extensions(self.text("b.calibration.toml")):
            lost.add(("b", CALIBRATION))
        kept = {each["label"] for lens in "ab" for each in tomllib.loads(self.text(lens + ".presets.toml")).get("preset", [])}
        for label, answer in self.presets:
            if answer and answer[0]:
                good = "error" not in answer[0]
                assert good or answer[0]["error"] in (LENS + "Cancelled", LENS + "NotKept", LENS + "Busy"), answer
                assert not good or label in kept, (label, "was answered and is not kept")
            else:  # it was read, and nobody heard of it any more
                lost.add(("ab", PRESETS))
        if self.text("a.slope.toml").count("[[run]]") != self.learned[0]:
            lost.add(("a", BLUR))
        if self.text("a.refocus.toml").count("[[result]]") != self.learned[1]:
            lost.add(("a", TEMPERATURE))
        axes = json.loads(self.text("b.position.json") or '{"axes": {}}')["axes"]
        if self.moved and not (axes and all(axis["known"] and not axis["inMotion"] for axis in axes.values())):
            lost.add(("b", POSITIONS))
        return lost

    def close(self):
        if self.daemon.process.poll() is None:
            self.daemon.kill()
        else:
            self.daemon.errors.close()
            self.daemon.folder.cleanup()
        self.folder.cleanup()


@unittest.skipIf(has_address_sanitizer(), "AddressSanitizer takes no library before its own")
class End(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-end-")
        source, cls.library = os.path.join(cls.folder.name, "shim.c"), os.path.join(cls.folder.name, "shim.so")
        with open(source, "w", encoding="utf-8") as file:
            file.write(SHIM)
        subprocess.run(["cc", "-shared", "-fPIC", "-w", "-o", cls.library, source, "-ldl"], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def play(self, seed, story):
        life = Life(seed, self.library)
        try:
            lost, took = story(life)
            log = life.daemon.log()
            for lens, what in lost:
                named = any(any(f"{each}: {what}" in line for each in lens) and "not on disk" in line for line in log.splitlines())
                self.assertTrue(named, f"seed {seed}: {what} of {lens} is lost without a word:\n{log}")
            self.assertLess(took, stop_timeout() * max(1, PATIENCE / 3), f"seed {seed}:\n{log}")
            return lost, took
        finally:
            life.close()

    def play_all(self, story, count, first):
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            return list(pool.map(lambda number: (number, *self.play(number, story)), range(first, first + count)))

    def test_a_slow_disk_loses_nothing(self):
        def story(life):
            life.set_disk(round(10 ** life.draw.uniform(1, 2.8 if LONG else 2.3)))  # two for a file
            life.live()
            took = life.end()
            return life.lost(), took
        ends = self.play_all(story, 200 if LONG else 4, 1000 * SEED)
        self.assertEqual([(seed, lost) for seed, lost, _ in ends if lost], [])
        print(f"slow disk: {len(ends)} ends, nothing lost, the longest {max(took for _, _, took in ends):.1f} s")

    def test_a_disk_that_is_mended_before_the_limit_loses_nothing(self):
        def story(life):
            life.set_disk(0)
            life.search()
            life.calibrate()
            life.set_disk(-1)
            life.search()
            life.calibrate()
            pause = life.draw.uniform(0, 5 if LONG else 1)

            def mend():
                time.sleep(pause)
                life.set_disk(0)
            took = life.end(mend)
            return life.lost(), took
        ends = self.play_all(story, 100 if LONG else 2, 1000 * SEED + 500)
        self.assertEqual([(seed, lost) for seed, lost, _ in ends if lost], [])

    @unittest.skipUnless(LONG, "each takes until the limit")
    def test_what_a_hung_disk_does_not_take_is_named(self):
        def story(life):
            life.live()
            life.set_disk(life.draw.choice((60000, -2)))
            acts = [life.calibrate, life.preset, life.preset]
            life.draw.shuffle(acts)
            for act in [*acts, life.move]:  # behind a move that waits for the disk everything of its lens waits
                act()
            took = life.end()
            return life.lost(), took
        ends = self.play_all(story, 16, 1000 * SEED + 900)
        print(f"hung disk: {sum(len(lost) for _, lost, _ in ends)} lost and named in {len(ends)} ends, "
              f"the longest {max(took for _, _, took in ends):.1f} s")


if __name__ == "__main__":
    unittest.main()
