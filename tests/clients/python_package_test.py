"""Every way to the Python package gives all of it, though the repository keeps no generated file: the build folder,
script/client-types, the source archive, and the wheel of the checkout and of the archive."""
import importlib.util
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile

from situations import PACKAGE, PATIENCE, ROOT

WRITTEN = "Written by script/client-types"
HAS_SETUPTOOLS = importlib.util.find_spec("setuptools") is not None
HAS_WHEEL = HAS_SETUPTOOLS and importlib.util.find_spec("wheel") is not None


def methods_of_the_interface():
    with open(os.path.join(ROOT, "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
        return [line.split("(")[0].split()[1] for line in file if line.startswith("method ")]


def checkout(folder):
    """What a clone has of clients/ and what is generated from, without what is left in the tree."""
    for path in ("clients", "proto", "docs", "script"):
        shutil.copytree(os.path.join(ROOT, path), os.path.join(folder, path),
                        ignore=shutil.ignore_patterns("__pycache__", "build", "dist", "*.egg-info", "evidence"))
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

    @unittest.skipUnless(HAS_SETUPTOOLS, "setuptools is not installed")
    def test_archive_and_wheel(self):
        project = checkout(os.path.join(self.folder, "clone"))
        out = os.path.join(self.folder, "out")
        build = "import setuptools.build_meta as backend, sys; print(getattr(backend, sys.argv[1])(sys.argv[2]))"
        self.run_well(sys.executable, "-c", build, "build_sdist", out, cwd=project)
        archive, = os.listdir(out)
        with tarfile.open(os.path.join(out, archive)) as tar:
            tar.extractall(self.folder, filter="data") if hasattr(tarfile, "data_filter") else tar.extractall(self.folder)
        unpacked = os.path.join(self.folder, archive.removesuffix(".tar.gz"))
        self.is_whole(unpacked)
        for source in (project, unpacked):
            built = os.path.join(self.folder, "built")
            shutil.rmtree(built, ignore_errors=True)
            self.run_well(sys.executable, "setup.py", "-q", "build", "--build-base", built, "--build-lib", built, cwd=source)
            self.is_whole(built)
            if HAS_WHEEL:
                wheels = os.path.join(self.folder, "wheels")
                shutil.rmtree(wheels, ignore_errors=True)
                self.run_well(sys.executable, "-c", build, "build_wheel", wheels, cwd=source)
                wheel, = os.listdir(wheels)
                unzipped = os.path.join(wheels, "unzipped")
                with zipfile.ZipFile(os.path.join(wheels, wheel)) as file:
                    file.extractall(unzipped)
                self.is_whole(unzipped)

    @unittest.skipUnless(HAS_SETUPTOOLS, "setuptools is not installed")
    def test_a_folder_without_the_generator_says_what_to_do(self):
        project = checkout(os.path.join(self.folder, "clone"))
        shutil.rmtree(os.path.join(os.path.dirname(project), "generate"))
        done = subprocess.run([sys.executable, "setup.py", "-q", "build"], capture_output=True, text=True, check=False, cwd=project)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("take all of the repository", done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
