#!/usr/bin/env python3
"""The packages on a machine that has never seen lensd: installed in a clean Debian 12, tried, upgraded with their state where
older ones are given, removed and purged, and nothing of them is left. Needs root and Debian's archive.

  script/package && tests/package/package_test.py build/package [FOLDER-OF-OLDER-PACKAGES]
"""
import json
import os
import sys
import unittest

sys.dont_write_bytecode = True
from machine import Machine  # noqa: E402

PACKAGES = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else ""
OLDER = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 and os.path.isdir(sys.argv[1]) else ""
NAMES = {"lensd", "lensctl", "lens-bench", "lens-web", "liblensd1", "liblensd-dev", "python3-lensd", "lensd-doc"}


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.machine = Machine(PACKAGES, older=OLDER) if OLDER else Machine(PACKAGES)
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
            version = "dpkg-query -W -f '${Version}' lensd"
            older = machine.run(version)
            machine.run("apt-get -qq install -y --no-install-recommends /debs/*.deb")
            machine.run(f"dpkg --compare-versions $({version}) gt {older}")
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
        self.assertIn("focus", machine.run("lensctl completion words foc").split())
        self.assertIn("lens-bench", machine.run("lens-bench --help"))
        self.assertIn("lens-web", machine.run("lens-web --help"))
        self.assertIn("Lens", machine.run("python3 -c 'import lensd; print(lensd.Lens)'"))
        told = machine.with_daemon("python3 -c 'import lensd; print(lensd.Lens(\"/run/l\").status().name)'")
        self.assertTrue(told[0].startswith("sim\n"), told)


if __name__ == "__main__":
    unittest.main()
