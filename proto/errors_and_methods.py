#!/usr/bin/env python3
"""Reads proto/errors_and_methods.md: one row for every error, exit status and method. As a program it writes them as a C++ header:
    proto/errors_and_methods.py HEADER"""
import dataclasses
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.join(HERE, "errors_and_methods.md")
LENS, SIMULATOR = "io.lensd.Lens", "io.lensd.Simulator"
ROLES = {"observe": "Observe", "move": "Move", "administer": "Administer"}
LEASES = {"no": "No", "yes": "Yes", "to apply": "ToApply", "to change": "ToChange"}
CHANGES = {"no": "No", "yes": "Yes"}
REPLIES = {"one": "No", "or more": "Yes", "more": "Only"}
NOTHING = 0  # a program that never meets an error has no status for it


@dataclasses.dataclass
class ErrorRow:
    name: str  # with its interface
    codes: list  # of lensd::Code
    exit_status: int
    word: str
    http: int
    lens_run: int
    about: str

    @property
    def short(self):
        return self.name.rsplit(".", 1)[1]


@dataclasses.dataclass
class MethodRow:
    interface: str
    name: str
    role: str
    lease: str
    changes: str
    replies: str
    by_worker: bool
    takes_lease: bool  # it has a parameter for the key of a lease


def text_of(name):
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        return file.read()


def rows_of(page, heading):
    """The cells of each row below a heading, without backquotes around what is alone in a cell."""
    section = page.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line.startswith("|")][2:]
    return [[re.sub(r"^`([\w.]+)`$", r"\1", cell) for cell in row] for row in rows]


def members(kind, file):
    """What an interface file defines, each with its parameters as they are written."""
    return re.findall(rf"^{kind} (\w+) ?(\(.*)$", text_of(file), re.MULTILINE)


class Tables:
    """Fails where the tables and the interface files do not have the same errors and methods."""

    def __init__(self):
        page = text_of("errors_and_methods.md")
        self.exits = {int(status): word for status, word in rows_of(page, "Exit statuses of lensctl")}
        self.errors = [self._error(*cells) for cells in rows_of(page, "Errors")]
        lens, simulator = f"{LENS}.varlink", f"{SIMULATOR}.varlink"
        self._same("error", [name for name, _ in members("error", lens)], [row.short for row in self.errors if row.name.startswith(LENS)])
        known = {name: (LENS, given) for name, given in members("method", lens)}
        known.update({name: (SIMULATOR, given) for name, given in members("method", simulator)})
        cells = rows_of(page, "Methods")
        self._same("method", known, [row[0] for row in cells])
        self.methods = [self._method(*known[row[0]], *row) for row in cells]

    def _error(self, name, codes, lensctl, http, lens_run, about):
        if int(lensctl) not in self.exits:
            sys.exit(f"proto/errors_and_methods.md: {name} has exit status {lensctl}, which has no word")
        return ErrorRow(name if "." in name else f"{LENS}.{name}", codes.split(", ") if codes else [], int(lensctl),
                        self.exits[int(lensctl)], int(http), int(lens_run or NOTHING), about)

    @staticmethod
    def _method(interface, given, name, role, lease, changes, replies, by):
        for words, word in ((ROLES, role), (LEASES, lease), (CHANGES, changes), (REPLIES, replies), (("lens", "lensd"), by)):
            if word not in words:
                sys.exit(f"proto/errors_and_methods.md: {name} has \"{word}\", which is none of: {', '.join(words)}")
        takes_lease = re.search(r"\blease: \?string\b", given.split("->")[0]) is not None
        if lease != "no" and not takes_lease:
            sys.exit(f"proto/errors_and_methods.md: {name} needs the lens, but has no parameter for the key of a lease")
        return MethodRow(interface, name, ROLES[role], LEASES[lease], CHANGES[changes], REPLIES[replies], by == "lens", takes_lease)

    @staticmethod
    def _same(kind, defined, written):
        for wrong, what in ((set(defined) - set(written), "has no row"), (set(written) - set(defined), "is not in the interface file")):
            if wrong:
                sys.exit(f"proto/errors_and_methods.md: the {kind} {', '.join(sorted(wrong))} {what}")


def header(tables):
    errors = "".join(f'    {{"{row.name}", {row.exit_status}, {row.http}, {row.lens_run}}},\n' for row in tables.errors)
    exits = "".join(f'    {{{status}, "{word}"}},\n' for status, word in tables.exits.items())
    cases = "".join("".join(f"    case Code::{code}:\n" for code in row.codes) + f"      return kErrors[{number}];\n"
                    for number, row in enumerate(tables.errors) if row.codes)
    internal = next(number for number, row in enumerate(tables.errors) if row.codes == ["Internal"])
    methods = "".join(f'    {{"{row.interface}", "{row.name}", Role::{row.role}, NeedsLease::{row.lease}, MayChangeState::{row.changes}, '
                      f'Streams::{row.replies}, {str(row.takes_lease).lower()}}},\n' for row in tables.methods)
    return f"""// Every error, exit status and method.
// Written by proto/errors_and_methods.py from proto/errors_and_methods.md and the interface files: change those, not this.
#pragma once

#include "proto/rows.h"

namespace lensd::proto {{

inline constexpr ErrorRow kErrors[] = {{
{errors}}};

/// The words of lensctl's exit statuses.
inline constexpr ExitWord kExitWords[] = {{
{exits}}};

/// Of both interfaces.
inline constexpr MethodRow kMethods[] = {{
{methods}}};

/// The error that a code is.
constexpr const ErrorRow& ErrorOf(Code code) {{
  switch (code) {{
{cases}  }}
  return kErrors[{internal}];
}}

}}  // namespace lensd::proto
"""


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    os.makedirs(os.path.dirname(os.path.abspath(sys.argv[1])), exist_ok=True)
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write(header(Tables()))


if __name__ == "__main__":
    main()
