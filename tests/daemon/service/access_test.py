"""Roles: whoever may connect may look and stop; moving and administering are for members of groups. Needs root, which may
become any user."""
import grp
import json
import os
import re
import signal
import socket
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, Daemon  # noqa: E402

PROTO = os.path.join(HERE, "..", "..", "proto", "io.lensd.Lens.varlink")
LENS_TABLE = f'[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{os.path.join(HERE, "small.toml")}"\n'
MOVERS, KEEPERS = "audio", "games"  # groups that every Debian has
STRANGER = 65534
# Everything that looks and changes nothing, and what stops.
FOR_ALL = {"ListFocusShifts", "FocusAtGet", "GetRefocus", "GetLearned", "List", "Status", "Metrics", "Monitor", "Devices", "GetCalibration", "GetExposure", "PresetList", "Snapshot", "View",
           "Stop"}
FOR_KEEPERS = {"Calibrate", "Reload", "RemoveFocusShift"}


def configuration(access):
    return "version = 1\n" + access + LENS_TABLE


@unittest.skipUnless(os.geteuid() == 0, "only root can become others")
class Roles(unittest.TestCase):
    def daemon(self, access):
        daemon = Daemon(config=configuration(access))
        self.addCleanup(lambda: self.assertEqual(daemon.stop(), 0))
        os.chmod(daemon.folder.name, 0o755)
        os.chmod(daemon.socket, 0o666)
        return daemon

    def as_member(self, daemon, groups, *arguments):
        numbers = [grp.getgrnam(group).gr_gid for group in groups]
        return daemon.lensctl(*arguments, user=STRANGER, group=STRANGER, extra_groups=numbers)

    def call(self, daemon, groups, method, parameters):
        """The error that a member of these groups gets, null: none."""
        done = self.as_member(daemon, groups, "call", "--timeout", "20s", LENS + method, json.dumps(parameters), "--json")
        return json.loads(done.stdout) if done.returncode != 0 else None

    def test_every_method_has_its_role(self):
        daemon = self.daemon(f'[access]\nmove = ["{MOVERS}"]\nadminister = ["{KEEPERS}"]\n')
        with open(PROTO, encoding="utf-8") as file:
            text = file.read()
        methods = dict(re.findall(r"^method (\w+)\((.*?)\) ->", text, re.M))
        words = {"string": "x", "int": 0, "float": 1.0, "bool": False, **dict(re.findall(r"^type (\w+) \((\w+),", text, re.M))}
        self.assertTrue(FOR_ALL | FOR_KEEPERS <= set(methods))
        allowed = {(): FOR_ALL | {"Plan"}, (MOVERS,): set(methods) - FOR_KEEPERS, (KEEPERS,): set(methods)}
        with daemon.client() as client:
            for groups, mine in allowed.items():
                for method, takes in methods.items():
                    # A lens that is not there: who may call hears of that, and nothing happens.
                    parameters = {"lens": "no-such-lens"} if "lens:" in takes else {}
                    for name, kind in re.findall(r"(\w+): ([^,()?\[]\w*)", takes):
                        parameters[name] = words.get(kind, {})
                    parameters.update((name, []) for name in re.findall(r"(\w+): \[\]", takes))
                    told = self.call(daemon, groups, method, parameters)
                    refused = told is not None and told["error"] == "not-permitted"
                    self.assertEqual(refused, method not in mine, (groups, method, told))
            self.assertNotIn("error", client.call(LENS + "Calibrate", {"lens": "a", "remove": True}))  # root

    def test_the_refused_hear_what_they_need(self):
        daemon = self.daemon(f'[access]\nmove = ["{MOVERS}"]\nadminister = ["{KEEPERS}"]\n')
        refused = self.as_member(daemon, [], "focus", "a", "@100", "--json")
        self.assertEqual(refused.returncode, 77, refused.stderr)
        told = json.loads(refused.stdout)
        self.assertEqual((told["error"], told["role"], told["groups"]), ("not-permitted", "move", [MOVERS, KEEPERS]))
        self.assertIn(MOVERS, refused.stderr)
        self.assertEqual(self.as_member(daemon, [], "status", "a").returncode, 0)
        self.assertEqual(self.as_member(daemon, [], "stop").returncode, 0)
        self.assertEqual(self.as_member(daemon, [], "plan", "a", "--sharp", "1m:1000um").returncode, 0)
        self.assertEqual(self.as_member(daemon, [], "plan", "a", "--sharp", "1m:1000um", "--apply").returncode, 77)
        self.assertEqual(self.as_member(daemon, [MOVERS], "focus", "a", "@100").returncode, 0)
        self.assertEqual(self.as_member(daemon, [MOVERS], "reload").returncode, 77)
        self.assertEqual(self.as_member(daemon, [KEEPERS], "focus", "a", "@120").returncode, 0)

    def test_only_administrators_take_a_lease_over(self):
        daemon = self.daemon(f'[access]\nmove = ["{MOVERS}"]\nadminister = ["{KEEPERS}"]\n')
        with daemon.client() as holder:
            holder.call(LENS + "TakeLease", {"lens": "a"})
            for groups, takes, wanted in (([], [], 77), ([MOVERS], [], 9), ([MOVERS], ["--take-over"], 77),
                                          ([KEEPERS], ["--take-over"], 0)):
                done = self.as_member(daemon, groups, "lease", "take", "a", "--for", "60s", *takes)
                self.assertEqual(done.returncode, wanted, (groups, takes, done.stderr))

    def hold(self, daemon, user, groups, count):
        """A process of this user that has so many connections for as long as the test runs: how many of them are served."""
        told, tell = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                os.setgroups([grp.getgrnam(group).gr_gid for group in groups])
                os.setgid(user)
                os.setuid(user)
                held = [socket.socket(socket.AF_UNIX) for _ in range(count)]
                for one in held:
                    one.connect(daemon.socket)
                    one.sendall(b'{"method":"org.varlink.service.GetInfo"}\0')
                served = sum(b"product" in one.recv(65536) for one in held)
                os.write(tell, str(served).encode())
                signal.pause()
            finally:
                os._exit(1)
        os.close(tell)
        self.addCleanup(os.waitpid, child, 0)
        self.addCleanup(os.kill, child, signal.SIGKILL)
        with os.fdopen(told, encoding="ascii") as pipe:
            return int(pipe.read(2))

    def test_no_crowd_keeps_an_administrator_out(self):
        daemon = self.daemon(f'[access]\nmove = ["{MOVERS}"]\nadminister = ["{KEEPERS}"]\n')
        for user in range(STRANGER - 4, STRANGER):
            self.assertEqual(self.hold(daemon, user, [MOVERS], 70), 64, "each has its own share")
        refused = self.as_member(daemon, [MOVERS], "focus", "a", "@100")
        self.assertEqual(refused.returncode, 4, refused.stderr)  # all that is for everybody is taken
        self.assertEqual(self.as_member(daemon, [], "stop").returncode, 0)
        self.assertEqual(self.as_member(daemon, [KEEPERS], "focus", "a", "@100").returncode, 0)
        with daemon.client() as root:
            self.assertIn("parameters", root.call(LENS + "Status"))
            # What is kept for administrators has an end too.
            self.assertEqual(self.hold(daemon, STRANGER, [KEEPERS], 20), 15)
            self.assertEqual(self.as_member(daemon, [KEEPERS], "status", "a").returncode, 4)
            self.assertEqual(self.as_member(daemon, [KEEPERS], "stop").returncode, 0)

    def test_a_group_that_is_not_there_lets_nobody_in_and_reload_changes_it(self):
        daemon = self.daemon("")  # the groups lens and lens-admin, which a machine without the package lacks
        with open(daemon.config, "w", encoding="utf-8") as file:
            file.write(configuration('[access]\nmove = ["no-such-group"]\n'))
        self.assertEqual(daemon.lensctl("reload").returncode, 0)
        self.assertEqual(self.as_member(daemon, [MOVERS], "focus", "a", "@10").returncode, 77)
        daemon.wait_log("no-such-group")
        with open(daemon.config, "w", encoding="utf-8") as file:
            file.write(configuration(f'[access]\nmove = ["{MOVERS}"]\n'))
        self.assertEqual(daemon.lensctl("reload").returncode, 0)
        self.assertEqual(self.as_member(daemon, [MOVERS], "focus", "a", "@10").returncode, 0)

    def test_what_the_configuration_cannot_mean(self):
        daemon = self.daemon("")
        for access, word in (('[access]\nmove = "lens"\n', "array"), ("[access]\nmove = [5]\n", "array"),
                             ('[access]\nmoves = ["lens"]\n', "moves")):
            with open(daemon.config, "w", encoding="utf-8") as file:
                file.write(configuration(access))
            refused = daemon.lensctl("reload")
            self.assertEqual(refused.returncode, 78)
            self.assertRegex(refused.stderr, rf"lensd\.toml:[23]: .*{word}")


if __name__ == "__main__":
    sys.exit(unittest.main())
