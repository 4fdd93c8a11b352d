"""Every way to the Python package gives all of it, though the repository keeps no generated file: the build folder,
script/client-types, the source archive, and the wheel of the checkout and of the archive; pip installs both, script/package makes them."""
import base64
import hashlib
import importlib.util
import io
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile

from situations import PACKAGE, PATIENCE, ROOT, Daemon

WRITTEN = "Written by script/client-types"
HAS_PIP = importlib.util.find_spec("pip") is not None and importlib.util.find_spec("venv") is not None


def methods_of_the_interface():
    with open(os.path.join(ROOT, "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
        return [line.split("(")[0].split()[1] for line in file if line.startswith("method ")]


def checkout(folder):
    """What a clone has of clients/ and what is generated from, without what is left in the tree."""
    for path in ("clients", "proto", "docs", "script"):
        shutil.copytree(os.path.join(ROOT, path), os.path.join(folder, path),
                        ignore=shutil.ignore_patterns("__pycache__", "build", "dist", "*.egg-info", "evidence"))
    shutil.copy(os.path.join(ROOT, "LICENSE"), folder)
    return os.path.join(folder, "clients", "python")


class Ways(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="lensd-package-")
        self.addCleanup(shutil.rmtree, self.folder)

    def run_well(self, *words, cwd=None, **environment):
        done = subprocess.run(words, capture_output=True, text=True, timeout=60 * PATIENCE, check=False, cwd=cwd,
                              env={**os.environ, **environment})
        self.assertEqual(done.returncode, 0, (words, done.stdout, done.stderr))
        return done.stdout

    def is_whole(self, path):
        """It has a class of every reply, and is imported from there with the standard library alone."""
        told = self.run_well(sys.executable, "-S", "-c", "import lensd; print(lensd.__file__); "
                             "print(' '.join(dir(lensd.calls)), lensd.Lens, lensd.OutOfRange)", cwd=self.folder, PYTHONPATH=path)
        where, names = told.split("\n", 1)
        self.assertTrue(where.startswith(path), where)
        self.assertEqual([name for name in methods_of_the_interface() if name + "Reply" not in names.split()], [])

    def test_the_repository_keeps_nothing_that_is_generated(self):
        if not os.path.exists(os.path.join(ROOT, ".git")):
            self.skipTest("no repository here")
        listed = self.run_well("git", "-C", ROOT, "ls-files", "clients").splitlines()
        self.assertGreater(len(listed), 20)
        for path in listed:
            if "/generate/" in path or path.endswith("_test.py") or not os.path.exists(os.path.join(ROOT, path)):
                continue
            with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                self.assertNotIn(WRITTEN, file.read(), path)

    def test_the_build_folder(self):
        self.is_whole(PACKAGE)

    def test_client_types_without_cmake(self):
        checkout(os.path.join(self.folder, "clone"))
        out = os.path.join(self.folder, "out")
        script = os.path.join(self.folder, "clone", "script", "client-types")
        self.run_well(script, out)
        self.is_whole(os.path.join(out, "python"))
        old = os.path.join(out, "python", "lensd", "of_an_older_checkout.py")
        with open(old, "w", encoding="utf-8"):
            pass
        header = os.path.join(out, "cpp", "include", "lensd", "types.h")
        before = os.stat(header).st_mtime_ns
        self.run_well(script, out)
        self.assertFalse(os.path.exists(old))
        self.assertEqual(os.stat(header).st_mtime_ns, before, "what is the same is compiled anew")
        done = subprocess.run([script, "/proc/nowhere"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (73, 1), done.stderr)

    def build(self, project, out, what):
        """By the backend that pip calls; the path of what it made."""
        made = self.run_well(sys.executable, "-B", "-c", "import backend, sys; print(getattr(backend, sys.argv[1])(sys.argv[2]))", what, out,
                             cwd=project)
        return os.path.join(out, made.strip())

    def test_archive_and_wheel(self):
        """Of one checkout, and of the archive made of it, the wheel is one to the byte; its list of files has each with its digest."""
        project = checkout(os.path.join(self.folder, "clone"))
        archive = self.build(project, os.path.join(self.folder, "out"), "build_sdist")
        with tarfile.open(archive) as tar:
            tar.extractall(self.folder, filter="data") if hasattr(tarfile, "data_filter") else tar.extractall(self.folder)
        unpacked = os.path.join(self.folder, os.path.basename(archive).removesuffix(".tar.gz"))
        self.is_whole(unpacked)
        wheels = []
        for number, source in enumerate((project, unpacked)):
            out = os.path.join(self.folder, f"wheel-{number}")
            with open(self.build(source, out, "build_wheel"), "rb") as file:
                wheels.append(file.read())
            unzipped = os.path.join(out, "unzipped")
            with zipfile.ZipFile(io.BytesIO(wheels[-1])) as file:
                file.extractall(unzipped)
                names = set(file.namelist())
                about, = {name.split("/")[0] for name in names} - {"lensd"}
                record = file.read(f"{about}/RECORD").decode().splitlines()
                for name, digest, size in (line.split(",") for line in record if not line.startswith(f"{about}/RECORD,")):
                    data = file.read(name)
                    self.assertEqual((digest, int(size)), ("sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("="),
                                                           len(data)), name)
                self.assertEqual({line.split(",")[0] for line in record}, names)
            self.assertIn("lensd/py.typed", names)
            self.is_whole(unzipped)
        self.assertEqual(wheels[0], wheels[1])

    def install(self, what):
        """By pip into a fresh environment without a network, where no program but Python is found; its Python."""
        fresh = os.path.join(self.folder, "fresh-" + os.path.basename(what))
        self.run_well(sys.executable, "-m", "venv", "--without-pip", fresh)
        python = os.path.join(fresh, "bin", "python")
        self.run_well(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-index", "--disable-pip-version-check", what,
                      cwd=self.folder, PATH=os.path.join(fresh, "bin"), PIP_NO_INDEX="1", PIP_FIND_LINKS="", PIP_CONFIG_FILE="/dev/null")
        return python

    @unittest.skipUnless(HAS_PIP, "pip is not installed")
    def test_pip_installs_without_network_and_without_cmake(self):
        made = os.path.join(self.folder, "made")
        project = checkout(os.path.join(self.folder, "clone"))
        daemon = Daemon(("cam",))
        try:
            for what in (self.build(project, made, "build_wheel"), self.build(project, made, "build_sdist")):
                with self.subTest(what=os.path.basename(what)):
                    python = self.install(what)
                    program = ("import importlib.metadata, lensd, os, sys; print(importlib.metadata.version('lensd'))\n"
                               "print(os.path.exists(os.path.join(os.path.dirname(lensd.__file__), 'py.typed')), lensd.__file__)\n"
                               "print(lensd.Lens(sys.argv[1]).status().name, *dir(lensd.calls))")
                    version, file, names = self.run_well(python, "-I", "-c", program, daemon.socket).strip().split("\n")
                    self.assertEqual(version, "0.1.0")
                    self.assertRegex(file, "^True " + os.path.dirname(os.path.dirname(python)))
                    self.assertEqual(names.split()[0], "cam")
                    self.assertEqual([name for name in methods_of_the_interface() if name + "Reply" not in names.split()], [])
        finally:
            self.assertEqual(daemon.stop(), 0)

    @unittest.skipUnless(os.path.exists(os.path.join(ROOT, ".git")), "no repository here")
    def test_script_package_makes_both(self):
        clone = os.path.join(self.folder, "repository")
        self.run_well("git", "clone", "-q", "--shared", ROOT, clone)
        made = self.run_well(os.path.join(clone, "script", "package"), "--python").splitlines()
        self.assertEqual([os.path.dirname(path) for path in made], [os.path.join(clone, "build", "package-python")] * 2)
        commit = self.run_well("git", "-C", clone, "rev-parse", "HEAD")
        for path in made:
            self.assertRegex(os.path.basename(path), rf"^lensd-\d+\.\d+\.\d+\+git\d{{8}}\.\d{{6}}\.{commit[:7]}[0-9a-f]*(\.tar\.gz|-py3-none-any\.whl)$")
        with zipfile.ZipFile(made[1]) as wheel:
            wheel.extractall(os.path.join(self.folder, "wheel"))
        self.is_whole(os.path.join(self.folder, "wheel"))
        for wrong in (["--python", "HEAD", "HEAD"], ["--pyhton"], ["--python", "no-such-commit"]):
            done = subprocess.run([os.path.join(clone, "script", "package"), *wrong], capture_output=True, text=True, check=False, timeout=60)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (64, "", 1), done.stderr)

    def test_a_folder_without_the_generator_says_what_to_do(self):
        project = checkout(os.path.join(self.folder, "clone"))
        shutil.rmtree(os.path.join(os.path.dirname(project), "generate"))
        done = subprocess.run([sys.executable, "-B", "backend.py", self.folder], capture_output=True, text=True, check=False, cwd=project)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("take all of the repository", done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
