"""Which files are generated, and from what."""
import os
import sys

import cpp
import definition
import python

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "proto"))
from errors_and_methods import Tables  # noqa: E402, pylint: disable=wrong-import-position
PACKAGE = os.path.join("clients", "python", "lensd")  # the part of the package that is written by hand


def text_of(*path):
    with open(os.path.join(ROOT, *path), encoding="utf-8") as file:
        return file.read()


def interface():
    return definition.Definition(text_of("proto", "io.lensd.Lens.varlink"))


def python_modules():
    """Text by name: the generated modules of the Python package."""
    writer = python.Writer(interface())
    modules = {"types.py": writer.types(), "lens_errors.py": writer.errors(Tables().errors), "calls.py": writer.calls()}
    for name in ("streams", "pool", "lens"):
        source = f"_aio_{name}.py"
        modules[f"_{name}.py"] = python.blocking(text_of(PACKAGE, source), f"clients/python/lensd/{source}")
    return modules


def python_package():
    """Text by name: every file of the Python package, generated or not."""
    by_hand = [name for name in os.listdir(os.path.join(ROOT, PACKAGE)) if name.endswith(".py") or name == "py.typed"]
    return {**{name: text_of(PACKAGE, name) for name in by_hand}, **python_modules()}


def cpp_sources():
    """Text by path: the generated sources of liblensd."""
    writer = cpp.Writer(interface())
    return {"include/lensd/types.h": writer.header(), "src/types.cpp": writer.source(), "src/tables.h": cpp.tables(Tables())}


def write(folder, texts):
    """Writes what differs, so that nothing else is compiled anew."""
    for name, text in texts.items():
        path = os.path.join(folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                if file.read() == text:
                    continue
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
