#!/usr/bin/env python3
"""The packages on a machine that has never seen lensd: installed in a clean Debian 12, tried, upgraded with their state where
older ones are given, removed and purged, and nothing of them is left. Needs root and Debian's archive.

  script/package && tests/package/package_test.py build/package [FOLDER-OF-OLDER-PACKAGES]
"""
import glob
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

PACKAGES = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else ""
OLDER = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 and os.path.isdir(sys.argv[1]) else ""
BASE = os.path.join(os.path.dirname(PACKAGES), "package-base.tar")
NAMES = {"lensd", "lensctl", "lens-bench", "lens-web", "liblensd1", "liblensd-dev", "python3-lensd", "lensd-doc"}
# What any installation of anything writes.
OTHERS = ("./var/cache/", "./var/log/", "./var/lib/dpkg/", "./var/lib/apt/", "./tmp/", "./debs/", "./older/", "./proc/", "./dev/",
          "./run/", "./etc/ld.so.cache", "./root/")
EXAMPLE = "/usr/share/doc/lensd/examples/sim.toml"


class Machine:
    """A Debian 12 in a folder."""

    def __init__(self):
        if not os.path.exists(BASE):
            subprocess.run(["mmdebstrap", "--variant=minbase", "bookworm", BASE], check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
        self.root = tempfile.mkdtemp(prefix="lensd-package-")
        subprocess.run(["tar", "-x", "-f", BASE, "-C", self.root], check=True)
        with open(os.path.join(self.root, "usr/sbin/policy-rc.d"), "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\nexit 101\n")
        os.chmod(file.name, 0o755)
        for folder, packages in (("debs", PACKAGES), ("older", OLDER)):
            os.mkdir(os.path.join(self.root, folder))
            for package in glob.glob(os.path.join(packages, "*.deb")) if packages else ():
                if "-dbgsym" not in package:
                    shutil.copy(package, os.path.join(self.root, folder))
        self.run("apt-get -qq update")

    def close(self):
        shutil.rmtree(self.root)

    def run(self, command, check=True):
        done = subprocess.run(["unshare", "--mount", "--pid", "--fork", f"--mount-proc={self.root}/proc", "chroot", self.root, "sh", "-c",
                               command], capture_output=True, text=True, timeout=900, check=False,
                              env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C.UTF-8"})
        if check and done.returncode != 0:
            raise AssertionError(f"{command}: {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout

    def files(self):
        listed = subprocess.run(["find", ".", "-xdev"], cwd=self.root, capture_output=True, text=True, check=True).stdout.split("\n")
        return {name for name in listed if not name.startswith(OTHERS) and "__pycache__" not in name}

    def with_daemon(self, *commands):
        """Each command's output, with lensd on the example that it brings."""
        script = [f"lensd --config {EXAMPLE} --socket /run/l --state /var/lib/lensd 2>/tmp/log & daemon=$!",
                  "for i in $(seq 200); do [ -S /run/l ] && break; sleep 0.1; done", "export LENSD_SOCKET=/run/l",
                  "lensctl wait connected --timeout 20s >/dev/null"]
        script += [f"{command}; echo \"=== $?\"" for command in commands]
        script += ["kill $daemon", "wait $daemon"]
        return self.run("; ".join(script)).split("=== ")

    def packages(self):
        return set(self.run("dpkg-query -W -f '${db:Status-Status} ${Package}\\n' | sed -n 's/^installed //p'").split())


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.machine = Machine()
        cls.addClassCleanup(cls.machine.close)

    def test_installed_tried_upgraded_removed_and_purged(self):
        machine = self.machine
        with self.subTest("what it needs, so that its files are not taken for ours"):
            machine.run("apt-get -qq install -y --no-install-recommends /debs/*.deb")
            needed = machine.packages() - NAMES
            machine.run("dpkg --purge " + " ".join(sorted(NAMES)))  # apt knows none that left no configuration
            machine.run("apt-mark manual " + " ".join(sorted(needed)) + " >/dev/null")
            machine.run("apt-get -qq clean")
        before = machine.files()
        groups = machine.run("cat /etc/group")

        machine.run("apt-get -qq install -y --no-install-recommends " + ("/older/*.deb" if OLDER else "/debs/*.deb"))
        focused = machine.with_daemon("lensctl autofocus --json", "lensctl preset save bench --json", "lensctl status --json")
        self.assertTrue(json.loads(focused[0].splitlines()[-1])["focused"], focused)
        self.assertTrue(focused[1].startswith("0\n"), focused)
        place = json.loads(focused[2].splitlines()[1])["axes"][0]["position"]
        self.assertIn("lens", machine.run("getent group lens"))

        if OLDER:
            machine.run("apt-get -qq install -y --no-install-recommends /debs/*.deb")
        self.assertLessEqual(NAMES, machine.packages())
        again = machine.with_daemon("lensctl preset recall bench --json", "lensctl status --json")  # it starts at 0 every time
        self.assertTrue(again[1].startswith("0\n"), again)
        self.assertAlmostEqual(json.loads(again[1].splitlines()[1])["axes"][0]["position"], place, delta=1)
        self.try_the_rest()

        machine.run("apt-get -qq remove -y " + " ".join(sorted(NAMES)))
        self.assertTrue(os.path.exists(os.path.join(machine.root, "etc/lensd/lensd.toml")), "a configuration outlives removal")
        self.assertTrue(os.path.exists(os.path.join(machine.root, "var/lib/lensd")), "and so does the state")
        machine.run("dpkg --purge " + " ".join(sorted(NAMES)))  # apt knows none that left no configuration
        self.assertEqual(machine.files() - before, set())
        self.assertEqual(before - machine.files(), set())
        self.assertEqual(machine.run("cat /etc/group"), groups)

    def try_the_rest(self):
        machine = self.machine
        self.assertIn("feasible", machine.run("lensctl plan --focal-length 50mm --f-number 1.4..16 --extension 0mm..3mm --pixel 5um "
                                              "--sharp 2m..2.2m:2px --json"))
        self.assertIn("lensctl.1", machine.run("ls /usr/share/man/man1"))
        self.assertEqual(machine.run("lensctl completion words foc").strip(), "focus")
        self.assertIn("lens-bench", machine.run("lens-bench --help"))
        self.assertIn("lens-web", machine.run("lens-web --help"))
        self.assertIn("Lens", machine.run("python3 -c 'import lensd; print(lensd.Lens)'"))
        told = machine.with_daemon("python3 -c 'import lensd; print(lensd.Lens(\"/run/l\").status().name)'")
        self.assertTrue(told[0].startswith("sim\n"), told)


if __name__ == "__main__":
    unittest.main()
