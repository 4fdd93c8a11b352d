"""Adds the modules that clients/generate writes to what is built and to the source archive: the repository does not keep them."""
import os
import sys

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = os.path.dirname(os.path.abspath(__file__))
GENERATOR = os.path.join(HERE, os.pardir, "generate")


def add_modules(folder):
    """A source archive has them already, and no generator."""
    if os.path.isdir(GENERATOR):
        sys.path.insert(0, GENERATOR)
        import files  # pylint: disable=import-error,import-outside-toplevel
        files.write(folder, files.python_modules())
    elif not os.path.exists(os.path.join(HERE, "lensd", "types.py")):
        sys.exit("lensd: clients/generate is not beside this folder, and writes modules that are missing here: take all of the repository")


class Build(build_py):
    def run(self):
        if getattr(self, "editable_mode", False):
            sys.exit("lensd: some modules are written by a program, so there is no editable install: "
                     "run script/client-types and set PYTHONPATH=build/clients/python")
        super().run()
        add_modules(os.path.join(self.build_lib, "lensd"))


class Archive(sdist):
    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        add_modules(os.path.join(base_dir, "lensd"))


setup(cmdclass={"build_py": Build, "sdist": Archive})
