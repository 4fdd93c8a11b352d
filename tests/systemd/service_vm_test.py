#!/usr/bin/env python3
"""In the virtual machine, under systemd: lensd installed as `cmake --install` does it, with its own unit, socket, udev rules
and list of modules, beside a LensConnect lens on uhid. Order and state are asserted, never time."""
import glob
import grp
import http.client
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

ROOT, BUILD, CMAKE = sys.argv[1:4]
del sys.argv[1:4]
LIMIT_S = 90
LENSCTL = "/usr/local/bin/lensctl"
SOCKET = "/run/lensd/io.lensd.Lens"
CONFIG = """version = 1
[[lens]]
name = "here"
driver = "sim"
scene = "/etc/lensd/small.toml"
[[lens]]
name = "usb"
driver = "lensconnect"
process = "own"
serial = "SERVICE1"
focus_pps = 400
"""
# The watchdog is quicker than on a machine, for the test's sake. LeakSanitizer, in builds that have it, stops its own
# process with ptrace, which the unit forbids, and AddressSanitizer asks for resource limits.
DROP_IN = """[Service]
WatchdogSec=8
Environment=ASAN_OPTIONS=detect_leaks=0
"""


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False, **options)


def must(*command, **options):
    done = run(*command, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(command)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def journal():
    """Of the service, oldest first."""
    return [json.loads(line) for line in must("journalctl", "--unit=lensd", "--output=json").splitlines()]


def said():
    return "\n".join(str(line.get("MESSAGE")) for line in journal()[-30:])


def shown(what, unit="lensd.service"):
    return must("systemctl", "show", "--value", "--property=" + what, unit).strip()


def eventually(what, look):
    deadline = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline:
        found = look()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError(f"never: {what}\n{said()}")


def main_pid():
    pid = int(shown("MainPID"))
    if pid == 0:
        raise AssertionError("lensd does not run\n" + said())
    return pid


def ctl(*arguments, **options):
    return run(LENSCTL, "--socket", SOCKET, "--timeout", "60s", *arguments, **options)


def status(lens):
    done = ctl("status", lens, "--json")
    if done.returncode != 0:
        raise AssertionError(f"{done.stderr}\n{said()}")
    answer = json.loads(done.stdout)
    return answer[0] if isinstance(answer, list) else answer


def focus_of(lens):
    return next(axis for axis in status(lens)["axes"] if axis["axis"] == "focus")


class Service(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        must(CMAKE, "--install", BUILD)
        with open("/etc/lensd/lensd.toml", "w", encoding="utf-8") as file:
            file.write(CONFIG)
        shutil.copy(os.path.join(ROOT, "tests", "daemon", "small.toml"), "/etc/lensd/small.toml")
        os.makedirs("/etc/systemd/system/lensd.service.d")
        with open("/etc/systemd/system/lensd.service.d/test.conf", "w", encoding="utf-8") as file:
            file.write(DROP_IN)
        must("systemd-sysusers")
        must("udevadm", "control", "--reload")
        must("systemctl", "daemon-reload")
        must("systemctl", "restart", "systemd-modules-load.service")
        must("systemctl", "enable", "--now", "lensd.socket")
        cls.lens = subprocess.Popen([os.path.join(BUILD, "bin", "uhid_lens"), "SERVICE1"], stdin=subprocess.PIPE,
                                    stdout=subprocess.PIPE, text=True)

    @classmethod
    def tearDownClass(cls):
        cls.lens.stdin.close()
        cls.lens.wait(timeout=LIMIT_S)
        cls.lens.stdout.close()

    def tell(self, command):
        self.lens.stdin.write(command + "\n")
        self.lens.stdin.flush()
        answer = self.lens.stdout.readline().strip()
        self.assertFalse(answer.startswith("error"), answer)
        return answer

    def test_1_a_call_wakes_the_service(self):
        self.assertEqual((shown("ActiveState", "lensd.socket"), shown("ActiveState")), ("active", "inactive"))
        about = os.stat(SOCKET)
        self.assertEqual((grp.getgrgid(about.st_gid).gr_name, about.st_mode & 0o777), ("lens", 0o660))
        self.assertEqual(os.path.realpath("/run/varlink/registry/io.lensd.Lens"), SOCKET)
        listed = ctl("list", "--json")
        self.assertEqual(listed.returncode, 0, listed.stderr + said())
        self.assertEqual([lens["name"] for lens in json.loads(listed.stdout)], ["here", "usb"])
        # Type=notify: it is active only because it said that it is ready.
        self.assertEqual((shown("ActiveState"), shown("SubState"), shown("Type")), ("active", "running", "notify"))

    def test_2_only_the_group_may_call(self):
        lens, keepers = grp.getgrnam("lens").gr_gid, grp.getgrnam("lens-admin").gr_gid
        for command, groups, wanted in (("list", [], 77), ("list", [lens], 0), ("reload", [lens], 77),
                                        ("reload", [lens, keepers], 0)):
            done = ctl(command, user=65534, group=65534, extra_groups=groups)
            self.assertEqual(done.returncode, wanted, (command, groups, done.stdout, done.stderr))
        moved = ctl("focus", "here", "@300", user=65534, group=65534, extra_groups=[lens])
        self.assertEqual(moved.returncode, 0, moved.stderr)

    def test_3_it_is_nobody_and_keeps_its_state(self):
        self.assertTrue(json.loads(ctl("focus", "here", "@700", "--json").stdout)["reached"])
        owner = os.stat(f"/proc/{main_pid()}").st_uid
        self.assertTrue(61184 <= owner <= 65519, owner)  # systemd's range of dynamic users
        kept = glob.glob("/var/lib/private/lensd/*")
        self.assertTrue(kept)
        self.assertEqual({os.stat(file).st_uid for file in kept}, {owner})

    def test_4_a_lens_that_is_plugged_in_is_found_by_an_unprivileged_service(self):
        self.assertFalse(status("usb")["connected"])
        self.tell("plug")
        eventually("the lens is connected", lambda: status("usb")["connected"])
        homed = ctl("home", "usb", "focus", "--json")
        self.assertEqual(homed.returncode, 0, homed.stderr + said())
        moved = ctl("focus", "usb", "@1000", "--json")
        self.assertEqual(moved.returncode, 0, moved.stderr + said())
        self.assertTrue(json.loads(moved.stdout)["reached"])
        self.assertEqual(self.tell("position 1"), "1000")

    def test_4b_its_driver_is_a_confined_process(self):
        number = status("usb")["process"]
        with open(f"/proc/{number}/status", encoding="ascii") as file:
            about = dict(line.rstrip("\n").split(":\t", 1) for line in file)
        self.assertEqual((about["Name"], about["PPid"], about["NoNewPrivs"], about["Seccomp"]),
                         ("lensd-driver", str(main_pid()), "1", "2"))
        # One filter more than lensd itself has.
        with open(f"/proc/{main_pid()}/status", encoding="ascii") as file:
            of_lensd = dict(line.rstrip("\n").split(":\t", 1) for line in file)
        self.assertEqual(int(about["Seccomp_filters"]), int(of_lensd["Seccomp_filters"]) + 1)
        self.assertNotIn("not confined: ", must("journalctl", "--output=cat", "--unit=lensd"))
        self.assertEqual((shown("KillMode"), shown("OOMPolicy")), ("mixed", "continue"))
        exposure = must("systemd-analyze", "security", "--no-pager", "lensd.service").splitlines()[-1]
        self.assertLessEqual(float(re.search(r"([0-9.]+) [A-Z]+", exposure)[1]), 1.4, exposure)

    def test_5_the_journal_has_lines_with_fields(self):
        lines = [line for line in journal() if line.get("SYSLOG_IDENTIFIER") == "lensd" and "MESSAGE_ID" in line]
        self.assertTrue(any("serving 2 lenses" in line["MESSAGE"] for line in lines), lines)
        of_the_lens = [line for line in lines if line.get("LENS") == "usb"]
        self.assertTrue(of_the_lens, lines)
        for line in lines:
            self.assertEqual((line["_TRANSPORT"], line["_SYSTEMD_UNIT"]), ("journal", "lensd.service"), line)
        found = must("journalctl", "--output=cat", "LENS=usb", "MESSAGE_ID=" + of_the_lens[-1]["MESSAGE_ID"])
        self.assertIn(of_the_lens[-1]["MESSAGE"], found)

    def test_5b_a_move_that_fails_is_in_the_journal_with_its_axis(self):
        inject = ["call", "io.lensd.Simulator.Inject"]
        must(LENSCTL, "--socket", SOCKET, *inject, json.dumps({"lens": "here", "kind": "stall"}))
        self.assertEqual(ctl("focus", "here", "@2500").returncode, 1)
        must(LENSCTL, "--socket", SOCKET, *inject, json.dumps({"lens": "here", "kind": "stall", "forMs": 1}))

        def told():
            lines = must("journalctl", "--output=cat", "LENS=here", "AXIS=focus").splitlines()
            return [line for line in lines if "did not get to its target" in line]

        self.assertEqual(len(eventually("it is in the journal", told)), 1)

    def test_6_told_to_stop_in_mid_move_it_stops_the_lens(self):
        mover = subprocess.Popen([LENSCTL, "--socket", SOCKET, "focus", "usb", "@4000"], stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)
        eventually("the lens moves", lambda: int(self.tell("position 1")) > 1010)
        must("systemctl", "stop", "lensd.service")
        self.assertEqual((shown("Result"), shown("ExecMainCode"), shown("ExecMainStatus")), ("success", "1", "0"), said())
        self.assertEqual(self.tell("busy 1"), "0")
        where = int(self.tell("position 1"))
        self.assertTrue(1000 < where < 4000, where)
        _, told = mover.communicate(timeout=LIMIT_S)
        self.assertNotEqual(mover.returncode, 0)
        self.assertTrue(told)
        # The socket is still there, and the next call starts it again; the lens is where it was left.
        self.assertEqual((shown("ActiveState", "lensd.socket"), shown("ActiveState")), ("active", "inactive"))
        eventually("the lens is back", lambda: status("usb")["connected"])
        self.assertEqual(focus_of("usb")["position"], where)

    def test_7_a_hung_daemon_is_replaced_and_its_callers_are_served(self):
        old, restarts = main_pid(), int(shown("NRestarts"))
        os.kill(old, signal.SIGSTOP)
        caller = subprocess.Popen([LENSCTL, "--socket", SOCKET, "--timeout", f"{LIMIT_S}s", "list", "--json"],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        eventually("it was started again",
                   lambda: int(shown("NRestarts")) > restarts and shown("SubState") == "running")
        listed, complaint = caller.communicate(timeout=LIMIT_S)
        self.assertEqual(caller.returncode, 0, complaint + said())
        self.assertEqual(len(json.loads(listed)), 2)
        self.assertNotIn(int(shown("MainPID")), (0, old))
        text = "\n".join(must("journalctl", "--output=cat", "--unit=lensd").splitlines()[-40:])
        self.assertIn("Watchdog timeout", text)
        eventually("the lens is back", lambda: status("usb")["connected"])

    def test_8_killed_in_mid_move_the_motor_stops_and_it_comes_back(self):
        # A way that a slow machine does not miss: from one stop of the travel to the other.
        self.assertEqual(ctl("focus", "usb", "@4000").returncode, 0)
        where = int(self.tell("position 1"))
        self.assertGreater(where, 3900)
        mover = subprocess.Popen([LENSCTL, "--socket", SOCKET, "focus", "usb", "@0"], stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        eventually("the lens moves", lambda: int(self.tell("position 1")) < where)
        old = main_pid()
        os.kill(old, signal.SIGKILL)
        eventually("the motor stands", lambda: self.tell("busy 1") == "0")
        self.assertGreater(int(self.tell("position 1")), 0)
        mover.wait(timeout=LIMIT_S)
        eventually("it was started again", lambda: int(shown("MainPID")) not in (0, old) and shown("SubState") == "running")
        self.assertEqual(ctl("list").returncode, 0)

    def test_9_0_a_rig_of_its_own(self):
        with open("/etc/lensd/left.toml", "w", encoding="utf-8") as file:
            file.write('version = 1\n[[lens]]\nname = "other"\ndriver = "sim"\nscene = "/etc/lensd/small.toml"\n')
        must("systemctl", "start", "lensd@left.socket")
        moved = run(LENSCTL, "--rig", "left", "--timeout", "60s", "focus", "other", "@500", "--json")
        self.assertEqual(moved.returncode, 0, moved.stderr)
        self.assertEqual([lens["name"] for lens in json.loads(ctl("list", "--json").stdout)], ["here", "usb"])
        self.assertEqual(shown("ActiveState", "lensd@left.service"), "active")
        self.assertTrue(glob.glob("/var/lib/private/lensd-left/*"))
        nobody = run(LENSCTL, "--rig", "right", "list")
        self.assertEqual(nobody.returncode, 69, nobody.stderr)
        must("systemctl", "stop", "lensd@left.socket", "lensd@left.service")

    def web(self, method, token, parameters=None):
        """Status and answer of a call by HTTP."""
        connection = http.client.HTTPConnection("127.0.0.1", 8480, timeout=LIMIT_S)
        connection.request("POST", "/call/" + method, json.dumps(parameters or {}),
                           {"Content-Type": "application/json", "Authorization": "Bearer " + token})
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())

    def test_9_1_a_page_with_tokens_of_its_own_user(self):
        must("ip", "link", "set", "lo", "up")
        self.assertNotEqual(run("systemctl", "start", "lens-web.socket").returncode, 0, "there are no tokens yet")
        view, move = "v" * 40, "m" * 40
        with open(os.open("/etc/lensd/web-tokens", os.O_CREAT | os.O_WRONLY, 0o600), "w", encoding="ascii") as file:
            file.write(f"view {view}\nmove {move}\n")
        must("systemctl", "start", "lens-web.socket")
        self.assertEqual(shown("ActiveState", "lens-web.service"), "inactive")
        target = {"lens": "here", "axis": "focus", "target": {"position": 321}}
        self.assertEqual(self.web("Status", "x" * 40)[0], 401)
        self.assertEqual(self.web("Move", view, target)[0], 403)
        status, told = self.web("Move", move, target)
        self.assertEqual((status, told.get("move", told).get("position")), (200, 321))
        # It is a member of the group lens, and no administrator.
        status, told = self.web("Calibrate", move, {"lens": "here", "remove": True})
        self.assertEqual((status, told["error"]), (403, "io.lensd.Lens.NotPermitted"))
        self.assertEqual(shown("ActiveState", "lens-web.service"), "active")
        must("systemctl", "stop", "lens-web.socket", "lens-web.service")
        self.assertEqual((shown("Result", "lens-web.service"), shown("ExecMainStatus", "lens-web.service")), ("success", "0"))

    def test_9_a_wrong_configuration_is_not_tried_again(self):
        must("systemctl", "stop", "lensd.socket", "lensd.service")
        with open("/etc/lensd/lensd.toml", "a", encoding="utf-8") as file:
            file.write("apeture = 3\n")
        self.assertNotEqual(run("systemctl", "start", "lensd.service").returncode, 0)
        self.assertEqual((shown("ActiveState"), shown("Result"), shown("ExecMainStatus"), shown("NRestarts")),
                         ("failed", "exit-code", "78", "0"))
        self.assertIn("apeture", said())


if __name__ == "__main__":
    unittest.main(verbosity=2, failfast=True)  # each test begins where the one before ended
