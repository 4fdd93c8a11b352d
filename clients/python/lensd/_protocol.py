"""Varlink without any socket: calls to bytes, bytes and files to replies and exceptions. Both variants share it."""
from __future__ import annotations

import collections
import dataclasses
import functools
import json
import math
import os
import time
import typing
from typing import Any, Generic, Mapping, Optional, TypeVar

from . import _codec
from .client_errors import BrokenReply, DeadlinePassed, UnknownError
from .errors import LensdError
from .lens_errors import BY_NAME

R = TypeVar("R")
DEFAULT_SOCKET = "/run/lensd/io.lensd.Lens"
# How long a call may take when nobody says: a question, what moves a lens, and a search, which lensd ends after an hour.
QUESTION_S, MOTION_S, SEARCH_S = 60.0, 600.0, 3700.0
PIECE_BYTES = 384 * 1024  # of a frame that is sent: well below the 1 MiB that a call may have


@dataclasses.dataclass(frozen=True)
class Call(Generic[R]):
    """A method, its parameters (None: left out) and the type of its answer."""

    method: str
    parameters: Mapping[str, Any]
    reply: type[R]

    def filled(self, **parameters: Any) -> Call[R]:
        """The same with those of these parameters that it takes and that it does not say itself."""
        new = {name: value for name, value in parameters.items() if name in self.parameters and self.parameters[name] is None}
        return dataclasses.replace(self, parameters={**self.parameters, **new})

    def encoded(self, more: bool = False) -> bytes:
        message: dict[str, Any] = {"method": self.method}
        given = {name: _codec.to_wire(value) for name, value in self.parameters.items() if value is not None}
        if given:
            message["parameters"] = given
        if more:
            message["more"] = True
        return json.dumps(message, allow_nan=False).encode() + b"\0"

    def decoded(self, message: Message) -> R:
        """The answer; raises the error that it is instead."""
        if message.error is not None:
            raise error_of(message.error, message.parameters)
        reply: Any = self.reply
        try:
            return typing.cast(R, _codec.decoder(reply)(message.parameters, self.method))
        except _codec.Mismatch as wrong:
            raise BrokenReply(f"lensd answered what its interface does not allow: {wrong}") from None


@dataclasses.dataclass(frozen=True)
class Message:
    """One reply as it came."""

    parameters: dict[str, Any]
    error: Optional[str]
    continues: bool


class Receiver:
    """Cuts what comes from a socket into messages, and keeps the files that came with them. It closes those nobody takes."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []  # of the message under way: joined once, since pictures are long
        self._messages: collections.deque[bytes] = collections.deque()
        self._files: collections.deque[int] = collections.deque()

    def feed(self, data: bytes, files: list[int]) -> None:
        self._files.extend(files)
        *ended, rest = data.split(b"\0")
        for end in ended:
            self._messages.append(b"".join((*self._parts, end)))
            self._parts.clear()
        if rest:
            self._parts.append(rest)

    def next(self) -> Optional[Message]:
        """The next whole message, None as long as there is none."""
        if not self._messages:
            return None
        text = self._messages.popleft()
        try:
            message = json.loads(text)
            parameters, error = message.get("parameters") or {}, message.get("error")
            if not isinstance(parameters, dict) or not isinstance(error, (str, type(None))):
                raise ValueError
            return Message(parameters, error, bool(message.get("continues")))
        except (ValueError, AttributeError, RecursionError):
            raise BrokenReply(f"what came is no Varlink reply: {text[:80]!r}; is it lensd that listens there?") from None

    def take_file(self) -> int:
        """The file that came with the message handed out last; the caller closes it."""
        if not self._files:
            raise BrokenReply("a reply names a file, and none came with it")
        return self._files.popleft()

    def close(self) -> None:
        while self._files:
            os.close(self._files.popleft())


WITHOUT_MESSAGE = {
    "InvalidParameter": "the parameter '{parameter}' is missing, unknown or of the wrong kind; docs/interface.md has those of every method",
    "ExpectedMore": "this call answers several times: stream() makes it",
    "MethodNotFound": "this lensd has no method '{method}': it is older than this package",
    "MethodNotImplemented": "this lensd has no method '{method}': it is older than this package",
    "InterfaceNotFound": "this lensd has no interface '{interface}'",
}


@functools.lru_cache(maxsize=None)
def _fields_of_error(kind: Any) -> list[tuple[str, str, _codec.Decoder]]:
    hints = {name: hint for name, hint in typing.get_type_hints(kind).items() if typing.get_origin(hint) is not typing.ClassVar}
    return [(name, _codec.camel(name), _codec.decoder_of(hint)) for name, hint in hints.items()]


def error_of(name: str, parameters: dict[str, Any]) -> LensdError:
    """The exception that an error is, with every field it may have."""
    kind: Any = BY_NAME.get(name, UnknownError)
    short = name.rsplit(".", 1)[-1]
    message = parameters.get("message")
    if short == "InvalidParameter" and parameters.get("parameter") == "more":
        message = "this call answers once: call() makes it"
    if not isinstance(message, str):
        told = collections.defaultdict(lambda: "?", {key: str(value) for key, value in parameters.items()})
        message = (WITHOUT_MESSAGE[short].format_map(told) if short in WITHOUT_MESSAGE
                   else f"lensd answered {name} {json.dumps(parameters)}")
    error: LensdError = kind(message, **{key: value for key, value in parameters.items() if key != "message"})
    for field, wire, decode in _fields_of_error(kind):
        try:
            setattr(error, field, decode(parameters.get(wire), wire))
        except _codec.Mismatch:
            setattr(error, field, None)
    if isinstance(error, UnknownError):
        error.name = name
    return error


class Deadline:
    """When a call has to be through; `math.inf`: it may wait for ever."""

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._end = time.monotonic() + timeout_s

    def left_s(self) -> Optional[float]:
        """Seconds left, above 0; raises DeadlinePassed where none are."""
        if self._end == math.inf:
            return None
        left = self._end - time.monotonic()
        if left <= 0:
            raise self.passed()
        return left

    def passed(self) -> DeadlinePassed:
        return DeadlinePassed(f"lensd did not answer within {self.timeout_s:g} s; the connection is closed, and a plain move goes on: "
                              "stop() ends it")


def socket_path(address: Optional[str], rig: Optional[str]) -> str:
    """A path, "unix:PATH", or the name of a rig (lensd@NAME.service); otherwise $LENSD_SOCKET, or the socket of the service."""
    if address is not None and rig is not None:
        raise ValueError("a path and a rig both say which lensd; give one of them")
    if rig is not None:
        if not rig or not all(letter.isascii() and (letter.isalnum() or letter in "-_") for letter in rig):
            raise ValueError(f"rig {rig!r}: a name has letters, digits, - and _")
        return f"/run/lensd/{rig}/io.lensd.Lens"
    path = address or os.environ.get("LENSD_SOCKET") or DEFAULT_SOCKET
    if path.startswith("unix:"):
        path = path[len("unix:"):].split(";", 1)[0]
        path = "\0" + path[1:] if path.startswith("@") else path
    return path
