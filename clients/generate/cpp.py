"""Writes the generated sources of liblensd: the classes of types, parameters and replies, and the table of errors."""
import textwrap

WIDTH = 120
BASIC = {"string": "std::string", "int": "std::int64_t", "float": "double", "bool": "bool"}
# Names that a member function cannot have, as far as any interface would think of them.
TAKEN = {"default", "switch", "register", "operator", "class", "union", "json"}


def head_of(about, source):
    lines = textwrap.wrap(about, WIDTH - 3) + textwrap.wrap(f"Written by script/client-types from {source}: change that, not this.", WIDTH - 3)
    return "".join(f"// {line}\n" for line in lines)


def comment(text, indent):
    return textwrap.fill(text, WIDTH, initial_indent=indent + "/// ", subsequent_indent=indent + "/// ") + "\n" if text else ""


def camel(name):
    return name[0].upper() + name[1:]


class Writer:
    """Classes in the order of the file; a struct without a name gets one from the field that has it."""

    def __init__(self, definition):
        self.definition = definition
        self.structs = []  # name, comment, fields
        self.given = set()  # names of those that a caller writes
        self.words = {each.name for each in definition.types if each.kind[0] == "enum"}
        for each in definition.types:
            if each.kind[0] == "struct":
                self.add(each.name, each.comment, each.kind[1])
        for method in definition.methods:
            self.mark_given(method.given)

    def add(self, name, about, fields):
        self.structs.append((name, about, fields))
        for field in fields:
            kind = field.kind
            while kind[0] in ("?", "[]"):
                kind = kind[1]
            if kind[0] == "struct":
                self.add(name + camel(field.name), field.comment, kind[1])

    def mark_given(self, fields):
        for field in fields:
            name = self.cpp_type(field.kind, "", bare=True)
            for known, _, inner in self.structs:
                if known == name and name not in self.given:
                    self.given.add(name)
                    self.mark_given(inner)

    def cpp_type(self, kind, owner, bare=False):
        if isinstance(kind, str):
            return BASIC.get(kind) or ("std::string" if kind in self.words else kind)
        what, inside = kind
        if what == "enum":
            return "std::string"
        if what == "struct":
            return owner
        inner = self.cpp_type(inside, owner, bare)
        return inner if bare else f"std::{'optional' if what == '?' else 'vector'}<{inner}>"

    def members(self, name, fields, reads, writes):
        """Declarations and definitions."""
        declared, defined = "", ""
        for field in fields:
            if field.name in TAKEN:
                raise ValueError(f"{name}.{field.name} cannot be the name of a function")
            kind = self.cpp_type(field.kind, name + camel(field.name))
            declared += comment(field.comment, "  ")
            if reads:
                told, end = kind, ""
                if kind.startswith("std::optional<std::vector<"):  # a loop over *optional() would look at what is gone
                    told, end = kind[len("std::optional<"):-1], ".value_or(std::vector<" + kind.split("<", 2)[2][:-2] + ">())"
                declared += f"  {told} {field.name}() const;\n"
                defined += f'{told} {name}::{field.name}() const {{\n  return Access::Get<{kind}>(*this, "{field.name}"){end};\n}}\n'
            if writes:
                plain = self.cpp_type(field.kind[1], name + camel(field.name)) if field.kind[0] == "?" else kind
                value = plain if plain in ("double", "bool", "std::int64_t") else f"const {plain}&"
                declared += f"  {name}& {field.name}({value} value);\n"
                defined += (f"{name}& {name}::{field.name}({value} value) {{\n  Access::Set(*this, \"{field.name}\", value);\n"
                            "  return *this;\n}\n")
        return declared, defined

    def classes(self):
        """(name, comment, declarations, definitions) of everything."""
        for name, about, fields in self.structs:
            yield (name, about, *self.members(name, fields, True, name in self.given))
        for method in self.definition.methods:
            name = method.name + "Reply"
            yield (name, f"The answer to {method.name}.", *self.members(name, method.answered, True, False))
            name = method.name + "Parameters"
            declared, defined = self.members(name, method.given, False, True)
            declared = f'  using Reply = {method.name}Reply;\n  static const char* Method() {{ return "{method.name}"; }}\n' + declared
            yield (name, method.comment, declared, defined)

    def header(self):
        every = list(self.classes())
        forward = "".join(f"class {name};\n" for name, *_ in every)
        body = "".join(f"\n{comment(about, '')}class LENSD_API {name} : public Value {{\n public:\n{declared}}};\n"
                       for name, about, declared, _ in every)
        return (head_of("The types of io.lensd.Lens, and of each method its parameters and its answer. Names are those of "
                        "docs/interface.md; enumerations are their words, and may get more; a list that is left out is empty.", "proto/io.lensd.Lens.varlink")
                + "#ifndef LENSD_TYPES_H_\n#define LENSD_TYPES_H_\n\n#include <cstdint>\n#include <optional>\n#include <string>\n"
                + "#include <vector>\n\n#include \"lensd/value.h\"\n\nnamespace lensd {\ninline namespace v1 {\n\n"
                + f"{forward}{body}\n}}  // namespace v1\n}}  // namespace lensd\n\n#endif\n")

    def source(self):
        return (head_of("What the classes of lensd/types.h do.", "proto/io.lensd.Lens.varlink")
                + '#include "lensd/types.h"\n\n#include "access.h"\n\nnamespace lensd {\ninline namespace v1 {\n\n'
                + "".join(defined for *_, defined in self.classes()) + "\n}  // namespace v1\n}  // namespace lensd\n")


def tables(known):
    rows = "".join(f'    {{"{row.name}", "{row.short}", "{row.word}", {row.exit_status}}},\n' for row in known.errors)
    driving = ", ".join(f'"{row.name}"' for row in known.methods if row.takes_lease)
    return (head_of("Every error that lensd answers with (its name on the wire, its name here, what lensctl ends with), and the methods "
                    "that drive a lens.", "proto/errors_and_methods.md and the interface files")
            + '#pragma once\n\n#include <string_view>\n\n#include "error_row.h"\n\nnamespace lensd {\ninline namespace v1 {\n\n'
            + f"inline constexpr ErrorRow kErrorsOfLensd[] = {{\n{rows}}};\n\n"
            + textwrap.fill(f"inline constexpr std::string_view kDrivingMethods[] = {{{driving}}};", WIDTH, subsequent_indent="    ")
            + "\n\n}  // namespace v1\n}  // namespace lensd\n")
