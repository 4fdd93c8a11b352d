"""Reads an interface file: its types, methods and errors with their comments."""
import dataclasses
import re

TOKEN = re.compile(r"(?P<comment>#[^\n]*)|(?P<blank>\n[ \t]*\n)|\s+|(?P<token>\[string\]|\[\]|->|[A-Za-z][A-Za-z0-9_.]*|[():,?])")


@dataclasses.dataclass
class Field:
    name: str
    kind: object  # str: a basic type or a name; ("?", kind), ("[]", kind), ("enum", words), ("struct", fields)
    comment: str = ""


@dataclasses.dataclass
class Member:
    name: str
    comment: str
    kind: object = None  # of a type
    given: list = dataclasses.field(default_factory=list)  # of a method; the fields of an error
    answered: list = dataclasses.field(default_factory=list)


class Definition:
    """One interface file. Fails on what it does not understand."""

    def __init__(self, text):
        self.tokens = []
        self.read_tokens(text)
        self.types, self.methods, self.errors = [], [], []
        self.expect("interface")
        self.name = self.take()
        while self.tokens:
            self.read_member()

    def read_tokens(self, text):
        """Every token with the comment right above it; a blank line ends what a comment belongs to."""
        comment, at = [], 0
        for match in TOKEN.finditer(text):
            if match.start() != at:
                raise ValueError(f"not Varlink: {text[at:at + 40]!r}")
            at = match.end()
            if match["comment"]:
                comment.append(match["comment"].lstrip("# ").rstrip())
            elif match["blank"]:
                comment = []
            elif match["token"]:
                self.tokens.append((match["token"], " ".join(comment)))
                comment = []
        if at != len(text):
            raise ValueError(f"not Varlink: {text[at:at + 40]!r}")

    def take(self):
        return self.tokens.pop(0)[0]

    def expect(self, token):
        taken = self.take()
        if taken != token:
            raise ValueError(f"{token!r} expected, not {taken!r}")

    def read_member(self):
        keyword, comment = self.tokens.pop(0)
        member = Member(self.take(), comment)
        if keyword == "method":
            member.given = self.fields()
            self.expect("->")
            member.answered = self.fields()
            self.methods.append(member)
        elif keyword == "error":
            member.given = self.fields()
            self.errors.append(member)
        elif keyword == "type":
            member.kind = self.kind()
            self.types.append(member)
        else:
            raise ValueError(f"{keyword!r} begins no member")

    def fields(self):
        what, fields = self.kind()
        if fields and what != "struct":
            raise ValueError("a list of fields expected")
        return fields

    def kind(self):
        token = self.take()
        if token in ("?", "[]", "[string]"):
            return (token, self.kind())
        if token != "(":
            return token
        fields, words = [], []
        while self.tokens[0][0] != ")":
            name, comment = self.tokens.pop(0)
            if self.tokens[0][0] == ":":
                self.take()
                fields.append(Field(name, self.kind(), comment))
            else:
                words.append(name)
            if self.tokens[0][0] == ",":
                self.take()
        self.take()
        return ("enum", words) if words else ("struct", fields)
