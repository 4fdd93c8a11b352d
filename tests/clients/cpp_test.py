"""liblensd against a real lensd: what `client_probe` says of it is judged here; its examples; and what is installed of it."""
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest

from situations import PATIENCE, ROOT, Daemon, FalseDaemon, Situations

BIN = os.environ["LENSD_BIN"]


def probe(*words):
    done = subprocess.run([os.path.join(BIN, "client_probe"), *words], capture_output=True, text=True, timeout=120 * PATIENCE,
                          check=False)
    assert done.returncode == 0, (words, done)
    return json.loads(done.stdout)


class Errors(Situations, unittest.TestCase):
    """Every situation through lensd::Client."""

    def refusal(self, path, method, parameters, name=None):
        told = probe("call", path, method, json.dumps(parameters))
        self.assertNotIn("wrong", told)
        return told if "error" in told else None


class Behaviour(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(("a", "b"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    def test_a_picture_of_a_view_lies_in_lensds_memory(self):
        told = probe("view", self.daemon.socket, "b")
        ranges = [[int(end, 16) for end in line.split()[0].split("-")] + [line.split()[1]] for line in told["mappings"]]
        at = int(told["address"], 16)
        self.assertEqual([access for start, end, access in ranges if start <= at < end], ["r--s"], told)
        print(f"picture at {at:#x}: {told['mappings'][0]}")
        self.assertEqual((told["size"], told["mappingsAfter"], told["sameAsSnapshot"]), (64 * 48, 0, True))
        self.assertEqual(told["filesAfter"], told["filesBefore"])

    def test_stop_ends_the_move_of_another_thread(self):
        told = probe("threads", self.daemon.socket, "a")
        self.assertEqual((told["error"], told["lens"], told["axis"]), ("Cancelled", "a", "focus"))
        self.assertEqual((told["answers"], told["movedMeanwhile"]), (60, True))

    def test_a_deadline_ends_the_call_and_not_the_client(self):
        told = probe("deadline", self.daemon.socket, "a")
        self.assertEqual((told["error"], told["exit_status"], told["isTimeout"]), ("DeadlinePassed", 5, True))

    def test_streams_can_be_cancelled_and_run_in_an_event_loop(self):
        told = probe("streams", self.daemon.socket, "b")
        self.assertEqual((told["first"], told["ended"], told["reached"]), ("b", True, True))
        self.assertGreater(told["changes"], 1)

    def test_what_grab_throws_ends_the_search(self):
        told = probe("grab", self.daemon.socket, "a")
        self.assertEqual((told["error"], told["exit_status"]), ("InvalidRequest", 64))  # a frame exposed long ago

    def test_texts_are_read_as_lensctl_reads_them(self):
        calls = []

        def keep(client):
            client.sendall(b'{"error":"io.lensd.Lens.Internal","parameters":{"message":"none"}}\0')

        class Recorder(FalseDaemon):
            def run(self):
                client, _ = self.listening.accept()
                calls.append(json.loads(client.recv(65536).rstrip(b"\0"))["parameters"]["target"])
                self.act(client)
                client.close()
        for axis, text, target in (("focus", "2m", {"distanceM": 2.0}), ("focus", "5ft7in", {"distanceM": 1.7018}),
                                   ("focus", "850mm", {"distanceM": 0.85}), ("focus", "33in", {"distanceM": 0.8382}),
                                   ("focus", "1.2e-5D", {"vergenceD": 1.2e-5}), ("focus", "inf", {"vergenceD": 0.0}),
                                   ("focus", "@5", {"position": 5.0}), ("focus", "-7", {"relative": -7.0}),
                                   ("focus", "far:3", {"nearer": -3.0}), ("focus", "ext:2.6mm", {"extensionMm": 2.6}),
                                   ("iris", "f/2.8", {"fNumber": 2.8}), ("zoom", "35mm", {"focalLengthMm": 35.0})):
            with Recorder(self.daemon.folder.name, keep) as path:
                self.assertEqual(probe("text", path, axis, text)["error"], "Internal")
            self.assertEqual(calls.pop(), target, text)
        for wrong in ("+100mm", "5", "", "2 m", "-1m", "0m", "@", "near:x", "f/0"):
            told = probe("text", "/nonexistent/socket", "focus", wrong)
            self.assertEqual((told["error"], told["exit_status"]), ("BadText", 64), wrong)


class Ends(unittest.TestCase):
    """lensd ends in the middle of a call."""

    def end_in_mid_call(self, end):
        daemon, told = Daemon(("a",)), []
        mover = threading.Thread(target=lambda: told.append(probe("move", daemon.socket, "a", "@3900", "60000")))
        with daemon.client() as client:
            mover.start()
            deadline = time.monotonic() + 20 * PATIENCE
            while not client.call("io.lensd.Lens.Status")["parameters"]["lenses"][0]["axes"][0]["moving"]:
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.005)
        end(daemon)
        mover.join()
        return told[0]["error"], told[0]["exit_status"]

    def test_killed_and_told_to_end(self):
        self.assertEqual(self.end_in_mid_call(Daemon.kill), ("Unavailable", 69))

        def end(daemon):
            daemon.process.send_signal(signal.SIGTERM)
            daemon.stop()
        self.assertEqual(self.end_in_mid_call(end), ("Cancelled", 2))


class Examples(unittest.TestCase):
    """Each runs as it stands."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(("a", "b"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    def run_example(self, name, *arguments):
        done = subprocess.run([os.path.join(BIN, "example_" + name), self.daemon.socket, *arguments], capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)
        return done.returncode, done.stdout, done.stderr

    def test_list_and_status(self):
        status, out, err = self.run_example("list_and_status")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"a: simulated thin lens, driver sim, idle\n  focus at \d+\n  iris at [\d.]+\nb: ")

    def test_move_and_wait(self):
        status, out, err = self.run_example("move_and_wait", "a", "1.2m")
        self.assertEqual((status, err), (0, ""))
        self.assertIn("reached: focus at 1330 within ", out)
        status, _, err = self.run_example("move_and_wait", "a", "0.1m")
        self.assertEqual(status, 6)
        self.assertIn("from 0.415625 m", err)

    def test_plan_and_apply(self):
        status, out, err = self.run_example("plan_and_apply", "a")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"wall: 1[012]\.\d um of 12 um\nbackground: \d+\.\d um of 20 um\n$")

    def test_live_view(self):
        status, out, err = self.run_example("live_view", "b", "100", "1")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"frame \d+: 64 x 48, middle \d+")
        print("live view of 64 x 48:", out.splitlines()[-1])

    def test_autofocus_own_frames(self):
        status, out, err = self.run_example("autofocus_own_frames", "a")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"at 1\.(19|20|21)\d m\n")


class Page(unittest.TestCase):
    def test_its_program_is_the_example(self):
        with open(os.path.join(ROOT, "docs", "clients.md"), encoding="utf-8") as file:
            shown = file.read().split("```cpp\n")[1].split("```")[0]
        with open(os.path.join(ROOT, "clients", "cpp", "examples", "move_and_wait.cpp"), encoding="utf-8") as file:
            self.assertEqual(shown, file.read())


class Library(unittest.TestCase):
    """What the library shows to the outside."""
    path = os.path.join(os.path.dirname(BIN), "lib", "liblensd.so.1")

    def test_only_its_own_symbols_are_seen(self):
        listed = subprocess.run(["nm", "-DC", "--defined-only", self.path], capture_output=True, text=True, check=True).stdout
        names = [line.split(None, 2)[2] for line in listed.splitlines()]
        seen = [name for name in names if "lensd::v1::" not in name and not name.startswith("LENSD_1")]
        self.assertEqual(seen, [])
        self.assertGreater(len(names), 300)
        headers = subprocess.run(["readelf", "-d", self.path], capture_output=True, text=True, check=True).stdout
        self.assertIn("Library soname: [liblensd.so.1]", headers)

    def test_a_program_outside_finds_it_by_cmake_and_by_pkg_config(self):
        with tempfile.TemporaryDirectory(prefix="lensd-install-") as folder:
            prefix, project = os.path.join(folder, "usr"), os.path.join(folder, "project")
            self.run_well("cmake", "--install", os.path.join(os.path.dirname(BIN), "clients"), "--prefix", prefix)
            examples = os.path.join(prefix, "share", "doc", "liblensd-dev", "examples")
            os.mkdir(project)
            shutil.copy(os.path.join(examples, "list_and_status.cpp"), project)
            with open(os.path.join(ROOT, "docs", "clients.md"), encoding="utf-8") as page:
                shown, = re.findall(r"^```cmake\n(.*?)^```", page.read(), re.M | re.S)
            with open(os.path.join(project, "CMakeLists.txt"), "w", encoding="utf-8") as file:
                file.write("cmake_minimum_required(VERSION 3.13)\nproject(outside CXX)\nset(CMAKE_CXX_STANDARD 17)\n"
                           "add_executable(mine list_and_status.cpp)\n" + shown)
            flags = os.environ.get("LENSD_CLIENT_FLAGS", "")
            self.run_well("cmake", "-S", project, "-B", os.path.join(project, "build"), f"-DCMAKE_PREFIX_PATH={prefix}",
                          f"-DCMAKE_CXX_COMPILER={os.environ.get('LENSD_CXX', 'c++')}", f"-DCMAKE_CXX_FLAGS={flags}")
            self.run_well("cmake", "--build", os.path.join(project, "build"))
            self.says_what_is_wrong(os.path.join(project, "build", "mine"), {})
            found = [os.path.join(at, "lensd.pc") for at, _, files in os.walk(prefix) if "lensd.pc" in files]
            self.assertEqual(len(found), 1)
            with open(found[0], encoding="utf-8") as file:
                self.assertIn("-llensd", file.read())
            told = subprocess.run(["pkg-config", f"--define-variable=prefix={prefix}", "--cflags", "--libs", "lensd"], text=True,
                                  capture_output=True, check=True, env={**os.environ, "PKG_CONFIG_PATH": os.path.dirname(found[0])})
            by_hand = os.path.join(project, "by-hand")
            self.run_well(os.environ.get("LENSD_CXX", "c++"), "-std=c++17", *flags.split(), os.path.join(project, "list_and_status.cpp"),
                          "-o", by_hand, *told.stdout.split())
            library = os.path.dirname(os.path.dirname(found[0]))
            self.says_what_is_wrong(by_hand, {"LD_LIBRARY_PATH": library})
            self.assertTrue(os.path.exists(os.path.join(prefix, "lib", "python3", "dist-packages", "lensd", "py.typed")))

    def run_well(self, *words):
        done = subprocess.run(words, capture_output=True, text=True, timeout=120 * PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, (words, done.stdout, done.stderr))

    def says_what_is_wrong(self, program, environment):
        """It runs, and what the library throws is an exception that the C++ runtime of the program knows by name."""
        done = subprocess.run([program, "/nonexistent/socket"], capture_output=True, text=True, check=False,
                              env={**os.environ, **environment})
        self.assertIn("LensdError", done.stderr)
        self.assertIn("no lensd answers at /nonexistent/socket", done.stderr)


if __name__ == "__main__":
    assert os.path.exists(os.path.join(ROOT, "clients"))
    unittest.main()
