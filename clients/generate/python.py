"""Writes the generated modules of the Python package: types, errors, calls; and the blocking Lens out of the asyncio one."""
import builtins
import keyword
import re
import textwrap

BASIC = {"string": "str", "int": "int", "float": "float", "bool": "bool", "object": "dict[str, Any]"}
WIDTH = 120


def head_of(about, source):
    about = textwrap.fill('"""' + about, WIDTH)
    written = textwrap.fill(f'Written by script/client-types from {source}: change that, not this."""', WIDTH)
    return f"{about}\n\n{written}\nfrom __future__ import annotations\n\n"



def snake(name):
    """distanceM: distance_m. The codec turns it back, which is checked here for every name."""
    turned = re.sub(r"([A-Z])", lambda match: "_" + match.group(1).lower(), name)
    if re.sub(r"_([a-z])", lambda match: match.group(1).upper(), turned) != name:
        raise ValueError(f"the name {name} does not come back from {turned}")
    return turned + "_" if keyword.iskeyword(turned) else turned


def camel(name):
    return name[0].upper() + name[1:]


def wrapped(text, indent, quote=False):
    text = text.replace("\\", "\\\\")
    if quote:
        return textwrap.fill(f'"""{text}"""', WIDTH, initial_indent=indent, subsequent_indent=indent) + "\n"
    return textwrap.fill(text, WIDTH, initial_indent=indent + "# ", subsequent_indent=indent + "# ") + "\n" if text else ""


class Writer:
    """Types by their place: an enumeration or a struct without a name gets one from the field that has it."""

    def __init__(self, definition):
        self.definition = definition
        self.inner = []  # classes that nameless structs need, before the class that uses them

    def python_type(self, kind, owner):
        if isinstance(kind, str):
            return BASIC.get(kind, kind)
        what, inside = kind
        if what == "?":
            return f"Optional[{self.python_type(inside, owner)}]"
        if what == "[]":
            return f"list[{self.python_type(inside, owner)}]"
        if what == "enum":
            return "Literal[" + ", ".join(f'"{word}"' for word in inside) + "]"
        if what == "struct":
            self.inner.append((owner, inside))
            return owner
        raise ValueError(f"no Python type for {kind}")

    def struct(self, name, comment, fields):
        lines, self.inner = [], []
        for field in fields:
            kind = self.python_type(field.kind, name + camel(field.name))
            default = " = None" if kind.startswith("Optional") else ""
            lines.append(wrapped(field.comment, "    ") + f"    {snake(field.name)}: {kind}{default}\n")
        before = "".join(self.struct(inner, f"{name}.{inner}", inner_fields) for inner, inner_fields in list(self.inner))
        body = "".join(lines)
        return (f"{before}\n\n@dataclass(frozen=True, slots=True, kw_only=True)\nclass {name}:\n"
                f"{wrapped(comment or name, '    ', quote=True)}" + (f"\n{body}" if body else ""))

    def types(self):
        text = "".join(self.enumeration(each) if each.kind[0] == "enum" else self.struct(each.name, each.comment, each.kind[1])
                       for each in self.definition.types)
        return (head_of("The types of io.lensd.Lens. Names are those of docs/interface.md in snake_case; an enumeration may "
                               "get values later.", "proto/io.lensd.Lens.varlink")
                + "from dataclasses import dataclass\nfrom typing import Literal, Optional\n" + text)

    def enumeration(self, each):
        words = ", ".join(f'"{word}"' for word in each.kind[1])
        line = f"{each.name} = Literal[{words}]"
        if len(line) > WIDTH:
            line = f"{each.name} = Literal[\n" + textwrap.fill(words, WIDTH, initial_indent="    ", subsequent_indent="    ") + "]"
        return f"\n{wrapped(each.comment, '')}{line}\n"

    def errors(self, rows):
        text, named = "", []
        for row in rows:
            name = row.short
            found = [each for each in self.definition.errors if row.name == f"{self.definition.name}.{each.name}"]
            comment = found[0].comment if found else ""
            fields = [field for field in (found[0].given if found else []) if field.name != "message"]
            hints = "".join(f"    {snake(field.name)}: {self.optional(field.kind)} = None\n" for field in fields if field.name not in COMMON)
            text += (f"\n\nclass {name}(LensdError):\n{wrapped(comment or row.name, '    ', quote=True)}\n"
                     f'    error_name = "{row.name}"\n    code = "{row.word}"\n    exit_status = {row.exit_status}\n{hints}')
            named.append(name)
        used = sorted({word for word in ("Activity", "Role", "EventMark") if re.search(rf"\b{word}\b(?=\]|$)", text, re.M)})
        return (head_of("One exception class for every error of io.lensd.Lens, with the exit status that lensctl ends with.",
                               "proto/io.lensd.Lens.varlink and proto/errors_and_methods.md")
                + "from typing import Optional\n\nfrom .errors import LensdError\nfrom .types import "
                + ", ".join(used) + "\n" + text + "\n\nBY_NAME: dict[str, type[LensdError]] = {each.error_name: each for each in (\n"
                + textwrap.fill(", ".join(named), WIDTH, initial_indent="    ", subsequent_indent="    ") + ")}\n__all__ = [\n"
                + textwrap.fill(", ".join(f'"{name}"' for name in named), WIDTH, initial_indent="    ", subsequent_indent="    ") + "]\n")

    def optional(self, kind):
        """What every field of an error is: where a newer or older lensd does not tell it, it is None."""
        told = self.python_type(kind, "")
        return told if told.startswith("Optional") else f"Optional[{told}]"

    def calls(self):
        text = ""
        for method in self.definition.methods:
            text += self.struct(method.name + "Reply", f"The answer to {method.name}.", method.answered) + self.call(method)
        names = {each.name for each in self.definition.types}
        used = sorted(name for name in names if re.search(rf"(?<![\"'\w.]){name}\b(?=[\],)]| =|$)", text, re.M))
        return (head_of("Every method of io.lensd.Lens as a Call, for `Lens.call` and `Lens.stream` of both variants. Parameters "
                               "that are None are left out; `lens` and `lease` are then filled in by the Lens.",
                               "proto/io.lensd.Lens.varlink")
                + "from dataclasses import dataclass\nfrom typing import Optional\n\n"
                + "from ._protocol import Call\nfrom .types import (\n"
                + textwrap.fill(", ".join(used), WIDTH, initial_indent="    ", subsequent_indent="    ") + ")\n" + text)

    def call(self, method):
        fields = sorted(method.given, key=lambda each: each.kind[0] == "?")
        given = [f"{snake(each.name)}: {self.python_type(each.kind, '')}" + (" = None" if each.kind[0] == "?" else "") for each in fields]
        name = snake(method.name[0].lower() + method.name[1:])
        head = f"def {name}{'_' if hasattr(builtins, name) else ''}("
        arguments = textwrap.fill(", ".join(["*"] + given) if given else "", WIDTH, initial_indent=head,
                                  subsequent_indent=" " * len(head)) or head
        values = ", ".join(f'"{each.name}": {snake(each.name)}' for each in method.given)
        body = textwrap.fill(f'return Call("{self.definition.name}.{method.name}", {{{values}}}, {method.name}Reply)', WIDTH,
                             initial_indent="    ", subsequent_indent="                ")
        return f"\n\n{arguments}) -> Call[{method.name}Reply]:\n{wrapped(method.comment, '    ', quote=True)}{body}\n"


# Fields that every exception has, whatever its error.
COMMON = ("lens", "axis", "parameter", "minimum", "maximum", "unit")

BLOCKING = (("async def ", "def "), ("async with ", "with "), ("async for ", "for "), ("await ", ""), ("__aenter__", "__enter__"),
            ("__aexit__", "__exit__"), ("__aiter__", "__iter__"), ("__anext__", "__next__"), ("StopAsyncIteration", "StopIteration"),
            ("AsyncIterator", "Iterator"), (", Awaitable[Union[Frame, Score]]]", "]"), ("Any, Awaitable, Callable", "Any, Callable"), ("_aio_connection", "_connection"), ("_aio_streams", "_streams"), ("_aio_pool", "_pool"))


def blocking(text, source):
    """The blocking variant of an asyncio module: the same words without waiting for the loop."""
    head, body = text.split('"""\n', 1)
    for word, instead in BLOCKING:
        body = body.replace(word, instead)
    about = head.lstrip('"').replace("asyncio", "blocking")
    return f'"""{about}\n\nWritten by script/client-types from {source}: change that, not this."""\n{body}'
