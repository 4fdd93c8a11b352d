"""A disk that takes nothing any more: what was moved, changed or stands still says so in its reply, in the log and in
`Status`, since when, and no longer once the disk works again. Nothing that was not written is believed after a kill."""
import json
import os
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from faulty_daemon import FaultyDaemon  # noqa: E402
from harness import BIN, HERE, LENS, PATIENCE, Daemon  # noqa: E402

SCENE = os.path.join(HERE, "small.toml")

# While the file in LENSD_TEST_FAULT is there, the call that it names fails for files of the state folder.
SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
static int fails(const char *call) {
  char kind[32] = "";
  const char *path = getenv("LENSD_TEST_FAULT");
  const int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
  if (fd < 0) return 0;
  const ssize_t got = read(fd, kind, sizeof kind - 1);
  close(fd);
  return got > 0 && strncmp(kind, call, strlen(call)) == 0;
}
static int of_state(int fd) {
  char link[64], path[512];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t got = readlink(link, path, sizeof path - 1);
  if (got <= 0) return 0;
  path[got] = 0;
  return strstr(path, "/state/") != NULL;
}
ssize_t write(int fd, const void *data, size_t size) {
  if (of_state(fd) && fails("write")) return errno = ENOSPC, -1;
  return ((ssize_t (*)(int, const void *, size_t))dlsym(RTLD_NEXT, "write"))(fd, data, size);
}
int fsync(int fd) {
  if (of_state(fd) && fails("fsync")) return errno = EIO, -1;
  return ((int (*)(int))dlsym(RTLD_NEXT, "fsync"))(fd);
}
int rename(const char *from, const char *to) {
  if (strstr(to, "/state/") && fails("rename")) return errno = EIO, -1;
  return ((int (*)(const char *, const char *))dlsym(RTLD_NEXT, "rename"))(from, to);
}
int mkostemp(char *name, int flags) {
  if (strstr(name, "/state/") && fails("mkostemp")) return errno = EROFS, -1;
  return ((int (*)(char *, int))dlsym(RTLD_NEXT, "mkostemp"))(name, flags);
}
int mkostemp64(char *name, int flags) {
  if (strstr(name, "/state/") && fails("mkostemp")) return errno = EROFS, -1;
  return ((int (*)(char *, int))dlsym(RTLD_NEXT, "mkostemp64"))(name, flags);
}
"""
WORDS = {"write": "No space left on device", "fsync": "Input/output error", "rename": "Input/output error",
         "mkostemp": "Read-only file system"}


def has_address_sanitizer():
    return "libasan" in subprocess.run(["ldd", os.path.join(BIN, "lensd")], capture_output=True, text=True, check=False).stdout


@unittest.skipIf(has_address_sanitizer(), "AddressSanitizer takes no library before its own")
class DiskTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-disk-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        self.fault = os.path.join(self.folder.name, "fault")
        source, self.library = os.path.join(self.folder.name, "shim.c"), os.path.join(self.folder.name, "shim.so")
        with open(source, "w", encoding="utf-8") as file:
            file.write(SHIM)
        subprocess.run(["cc", "-shared", "-fPIC", "-w", "-o", self.library, source, "-ldl"], check=True)
        os.environ["LENSD_TEST_FAULT"] = self.fault
        self.addCleanup(os.environ.pop, "LENSD_TEST_FAULT")
        self.daemon = None

    def start(self):
        lenses = "".join(f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{SCENE}"\n' for name in ("a", "b"))
        self.daemon = Daemon(config="version = 1\n" + lenses, arguments=("--state", self.state), preload=self.library)
        self.addCleanup(self.finish, self.daemon)
        return self.daemon.client()

    def finish(self, daemon):
        if daemon.process.poll() is None:
            self.assertEqual(daemon.stop(), 0)

    def break_disk(self, call):
        with open(self.fault + ".new", "w", encoding="ascii") as file:
            file.write(call)
        os.rename(self.fault + ".new", self.fault)

    def mend_disk(self):
        os.unlink(self.fault)

    def status(self, client, lens="a"):
        return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]

    def wait_status(self, client, condition):
        deadline = time.monotonic() + 20 * PATIENCE
        while not condition(status := self.status(client)):
            self.assertLess(time.monotonic(), deadline, status)
            time.sleep(0.02)
        return status

    def move(self, client, to, lens="a"):
        return client.call(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": to}})

    def remembered(self):
        with open(os.path.join(self.state, "a.position.json"), encoding="utf-8") as file:
            return json.load(file)["axes"]["focus"]

    def in_mid_move(self, call):
        with self.start() as client, self.daemon.client() as watcher:
            self.assertEqual(self.status(client)["unwritten"], [])
            began = time.monotonic_ns()
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 1400}})  # long: the disk breaks on the way
            self.wait_status(watcher, lambda status: status["activity"] == "moving")
            self.break_disk(call)
            moved = client.receive()["parameters"]["move"]
            self.assertTrue(moved["reached"], moved)
            self.assertIs(moved["kept"], False)
            self.assertIn(WORDS[call], moved["reason"])
            told = self.wait_status(watcher, lambda status: status["unwritten"])["unwritten"]
            self.assertEqual([each["file"] for each in told], ["positions"])
            self.assertLess(began, told[0]["sinceNs"])
            self.assertLess(told[0]["sinceNs"], time.monotonic_ns())
            self.assertIn(WORDS[call], told[0]["reason"])
            self.assertIn("a.position.json", told[0]["reason"])
            time.sleep(1.1)  # more attempts than one: still one line, and the time of the first
            again = self.status(watcher)["unwritten"]
            self.assertEqual(again[0]["sinceNs"], told[0]["sinceNs"])
            self.daemon.wait_log("a: its positions", WORDS[call], times=1)
            self.assertIn(WORDS[call], self.daemon.lensctl("status", "a").stdout)
            self.assertIn(WORDS[call], self.daemon.lensctl("doctor").stdout)
            self.assertEqual(self.status(watcher, "b")["unwritten"], [])
            # A motor that cannot be remembered does not turn, and the reply says why.
            refused = self.move(client, 900, "b")
            self.assertEqual(refused["error"], LENS + "NotKept")
            self.assertIn(WORDS[call], refused["parameters"]["message"])
            if call != "fsync":  # where that fails alone, the new file may be there
                self.assertTrue(self.remembered()["inMotion"])
            self.mend_disk()
            self.wait_status(watcher, lambda status: not status["unwritten"])
            self.assertEqual((self.remembered()["position"], self.remembered()["inMotion"]), (1400, False))
            self.daemon.wait_log("a: its positions", "up to date again", times=1)
            moved = self.move(client, 1500)["parameters"]["move"]
            self.assertIs(moved["kept"], True)
            self.assertNotIn(WORDS[call], moved["reason"] or "")

    def test_a_full_disk_in_mid_move(self):
        self.in_mid_move("write")

    def test_a_disk_that_fails_to_flush_in_mid_move(self):
        self.in_mid_move("fsync")

    def test_a_disk_that_fails_to_rename_in_mid_move(self):
        self.in_mid_move("rename")

    def test_a_disk_that_became_read_only_in_mid_move(self):
        self.in_mid_move("mkostemp")

    def test_where_a_stopped_axis_rests_is_not_on_disk(self):
        with self.start() as client, self.daemon.client() as mover:
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
            self.wait_status(client, lambda status: status["activity"] == "moving")
            self.break_disk("write")
            self.assertEqual(client.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
            self.assertEqual(mover.receive()["error"], LENS + "Cancelled")
            told = self.wait_status(client, lambda status: status["unwritten"])
            self.assertEqual(told["activity"], "idle")
            self.assertEqual(told["unwritten"][0]["file"], "positions")
            self.daemon.wait_log("a: its positions", WORDS["write"], times=1)
            self.mend_disk()
            self.wait_status(client, lambda status: not status["unwritten"])
            self.assertEqual(self.remembered()["position"], self.status(client)["axes"][0]["position"])

    def test_a_calibration_is_in_force_and_written_later(self):
        path = os.path.join(self.state, "a.calibration.toml")
        points = {"lens": "a", "points": [{"position": 0, "vergenceD": 0.0}, {"position": 4000, "extensionMm": 3.0}],
                  "errorUm": 5.0}
        with self.start() as client:
            self.break_disk("write")
            refused = client.call(LENS + "Calibrate", points)
            self.assertEqual(refused["error"], LENS + "NotKept", refused)
            self.assertIn(WORDS["write"], refused["parameters"]["message"])
            told = self.wait_status(client, lambda status: status["unwritten"])
            self.assertEqual([each["file"] for each in told["unwritten"]], ["calibration"])
            self.assertEqual(told["grade"], "calibrated")
            self.assertFalse(os.path.exists(path))
            self.mend_disk()
            self.wait_status(client, lambda status: not status["unwritten"])
            self.assertTrue(os.path.exists(path))
            self.daemon.wait_log("a: its calibration", "up to date again", times=1)

    def calibrated_while_the_disk_is_full(self, client):
        points = {"lens": "a", "points": [{"position": 0, "vergenceD": 0.0}, {"position": 4000, "extensionMm": 3.0}],
                  "errorUm": 5.0}
        self.break_disk("write")
        self.assertEqual(client.call(LENS + "Calibrate", points)["error"], LENS + "NotKept")
        return client.call(LENS + "GetCalibration", {"lens": "a"})["parameters"]["calibration"]["toml"]

    def still_holds(self, client, toml):
        """Opened anew the lens has what is not on disk, says so, and writes it once that works."""
        path = os.path.join(self.state, "a.calibration.toml")
        again = self.wait_status(client, lambda status: status["connected"] and status["unwritten"])
        self.assertEqual((again["grade"], [each["file"] for each in again["unwritten"]]), ("calibrated", ["calibration"]))
        self.assertEqual(client.call(LENS + "GetCalibration", {"lens": "a"})["parameters"]["calibration"]["toml"], toml)
        self.assertFalse(os.path.exists(path))
        self.mend_disk()
        self.wait_status(client, lambda status: not status["unwritten"])
        with open(path, encoding="utf-8") as file:
            self.assertTrue(file.read().startswith(toml))

    def test_a_calibration_outlives_its_lens_that_is_opened_anew(self):
        self.daemon = FaultyDaemon(("a", "b"), arguments=("--state", self.state), preload=self.library)
        self.addCleanup(self.finish, self.daemon)
        with self.daemon.client() as client:
            toml = self.calibrated_while_the_disk_is_full(client)
            self.daemon.fault("a", "read throw", "open throw")
            self.wait_status(client, lambda status: not status["connected"])
            self.daemon.fault("a")
            self.still_holds(client, toml)

    def test_a_calibration_outlives_its_lens_that_is_configured_anew(self):
        with self.start() as client:
            toml = self.calibrated_while_the_disk_is_full(client)
            with open(self.daemon.config, encoding="utf-8") as file:
                before = file.read()
            with open(self.daemon.config, "w", encoding="utf-8") as file:
                file.write(before.replace('name = "a"\n', 'name = "a"\ndistance_from = "sensor"\n'))
            self.assertEqual(client.call(LENS + "Reload")["parameters"]["reopened"], ["a"])
            self.still_holds(client, toml)

    def test_presets_that_cannot_be_written_are_not_there(self):
        with self.start() as client:
            self.break_disk("write")
            refused = client.call(LENS + "PresetSave", {"lens": "a", "label": "x"})
            self.assertEqual(refused["error"], LENS + "NotKept", refused)
            self.assertEqual(client.call(LENS + "PresetList", {"lens": "a"})["parameters"]["presets"], [])
            self.assertEqual(self.status(client)["unwritten"], [])  # the file is as true as before
            self.mend_disk()
            self.assertNotIn("error", client.call(LENS + "PresetSave", {"lens": "a", "label": "x"}))

    def test_killed_while_the_disk_is_full_nothing_false_is_known(self):
        with self.start() as client:
            self.break_disk("write")
            self.assertEqual(self.move(client, 400)["error"], LENS + "NotKept")
            self.mend_disk()
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 1400}})
            with self.daemon.client() as watcher:
                self.wait_status(watcher, lambda status: status["activity"] == "moving")
            self.break_disk("write")
            self.assertIs(client.receive()["parameters"]["move"]["kept"], False)
        self.daemon.kill()
        self.mend_disk()
        with self.start() as client:
            self.assertFalse(self.status(client)["axes"][0]["homed"])


if __name__ == "__main__":
    unittest.main()
