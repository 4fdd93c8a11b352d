#!/usr/bin/env python3
"""The arm64 packages run, under an emulator of its instructions (qemu-user), on a Debian 12 that has never seen lensd: lensctl answers
as the amd64 one does, digit by digit, lensd serves the simulated lens, finds its focus and takes its picture, and a program is
compiled against liblensd. Needs root and Debian's archive.

  script/package && script/package --arch arm64 && tests/package/arm64_test.py build/package-arm64 build/package
"""
import glob
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
from machine import Machine  # noqa: E402

if len(sys.argv) < 3:
    sys.exit("usage: arm64_test.py FOLDER-OF-ARM64-PACKAGES FOLDER-OF-AMD64-PACKAGES")
ARM64, AMD64 = (os.path.abspath(sys.argv.pop(1)) for _ in range(2))
README = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "README.md")
PROGRAMS = ("lensd", "lensctl", "lens-web", "lens-bench")
OPTICS = "--focal-length 50mm --f-number 1.4..16 --extension 0mm..2.8mm --pixel 5um"
QUESTIONS = (
    f"plan {OPTICS} --sharp 2.1m..2.5m:10px --blurred 4.3m..inf:40px:behind",
    f"plan {OPTICS} --sharp 2.1m..2.5m:3px --blurred 2.6m..inf:40px:behind",  # cannot be done
    f"plan {OPTICS} --sharp 2.1m..2.5m:10px --wavelength 550nm",
    f"plan {OPTICS} --sharp 0.9m..6m:1px --stack",
    "dof --focal-length 50mm --f-number 2.8 --focus 2m --blur-limit 30um",
    "dof --focal-length 35mm --f-number 5.6 --focus 1.23m --blur-limit 7um --pixel 3.45um --wavelength 550nm",
    "blur --focal-length 50mm --f-number 2.8 --focus 2m --at 1m..4m --pixel 5um",
)


class Arm64(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.machine = machine = Machine(ARM64)
        cls.addClassCleanup(machine.close)
        machine.run("dpkg --add-architecture arm64 && apt-get -qq update")
        machine.run("apt-get -qq install -y --no-install-recommends qemu-user-static g++-aarch64-linux-gnu pkg-config")
        machine.run("apt-get -qq install -y --no-install-recommends /debs/*.deb")
        for program in PROGRAMS:
            machine.write(f"usr/local/bin/{program}", f'#!/bin/sh\nexec qemu-aarch64-static /usr/bin/{program} "$@"\n')
        amd64 = tempfile.TemporaryDirectory()
        cls.addClassCleanup(amd64.cleanup)
        cls.amd64 = os.path.join(amd64.name, "usr/bin/lensctl")
        package, = glob.glob(os.path.join(AMD64, "lensctl_*_amd64.deb"))
        subprocess.run(["dpkg", "-x", package, amd64.name], check=True)

    def test_programs_are_of_arm64(self):
        for program in PROGRAMS:
            with open(os.path.join(self.machine.root, "usr/bin", program), "rb") as file:
                self.assertEqual(file.read(20)[18:], b"\xb7\0", program)  # ELF's e_machine: 183 is AArch64
            self.assertIn(program, self.machine.run(f"{program} --help"))

    def test_answers_as_readme_prints_them(self):
        with open(README, encoding="utf-8") as file:
            printed = re.findall(r"^\$ (lensctl (?:plan|dof) --focal-length(?:.*\\\n)*.*)\n((?:[^$`\n].*\n|\n(?!\$))+)", file.read(), re.M)
        self.assertEqual(len(printed), 2, printed)
        for command, answer in printed:
            self.assertEqual(self.machine.run(command).strip(), answer.strip(), command)

    def test_answers_as_amd64_does(self):
        told = 0
        for question in QUESTIONS:
            for form in ("", " --json"):
                with self.subTest(question + form):
                    native = subprocess.run(f"{self.amd64} {question}{form}", shell=True, capture_output=True, text=True, timeout=60,
                                            check=False)
                    self.assertIn(native.returncode, (0, 1), native.stderr)
                    self.assertEqual(self.machine.run(f"lensctl {question}{form}; echo $?"), f"{native.stdout}{native.returncode}\n")
                    told += len(re.findall(r"\d+(?:\.\d+)?", native.stdout))
        print(f"{told} numbers of {2 * len(QUESTIONS)} answers as on amd64")

    def test_finds_focus_and_takes_its_picture(self):
        truth = "lensctl call io.lensd.Simulator.Truth '{\"lens\": \"sim\"}'"
        focused, picture, stands = self.machine.with_daemon("lensctl autofocus --json --deadline 300s", "lensctl snapshot -o /root/wall.png",
                                                            truth)[:3]
        self.assertTrue(json.loads(focused.splitlines()[-1])["focused"], focused)
        with open(os.path.join(self.machine.root, "root/wall.png"), "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n", picture)
        stands = json.loads(stands.splitlines()[1])
        wall_d, pixel_d = 1 / 1.2, 3.45e-6 * stands["fNumber"] / 0.025**2  # where the wall is; what blurs it by a pixel
        print(f"focused {abs(stands['focalPlaneD'] - wall_d) / pixel_d:.2f} px of blur from the wall")
        self.assertLess(abs(stands["focalPlaneD"] - wall_d), pixel_d, stands)

    def test_clients(self):
        example = "/usr/share/doc/liblensd-dev/examples/list_and_status.cpp"
        self.machine.run(f"aarch64-linux-gnu-g++ -std=c++17 -o /usr/local/bin/listing.arm64 {example} "
                         "$(PKG_CONFIG_LIBDIR=/usr/lib/aarch64-linux-gnu/pkgconfig pkg-config --cflags --libs lensd)")
        cpp, python = self.machine.with_daemon("qemu-aarch64-static /usr/local/bin/listing.arm64 /run/l",
                                               "python3 -c 'import lensd; print(lensd.Lens(\"/run/l\").status().name)'")[:2]
        self.assertTrue(cpp.startswith("sim: "), cpp)
        self.assertIn("focus at 0", cpp)
        self.assertIn("sim", python.splitlines())


if __name__ == "__main__":
    unittest.main()
