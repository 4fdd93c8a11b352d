"""Dataclasses to JSON and back. Python names are those of the interface in snake_case; unknown fields are ignored, as the
interface asks of its clients."""
from __future__ import annotations

import dataclasses
import functools
import re
import types
import typing
from typing import Any, Callable

Decoder = Callable[[Any, str], Any]


class Mismatch(Exception):
    """A value is not of the type that the interface gives it."""


def camel(name: str) -> str:
    """distance_m: distanceM; from_: from."""
    return re.sub(r"_([a-z])", lambda match: match.group(1).upper(), name.rstrip("_"))


def to_wire(value: Any) -> Any:
    """A parameter as JSON; fields that are None are left out."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        given = ((each.name, getattr(value, each.name)) for each in dataclasses.fields(value))
        return {camel(name): to_wire(inner) for name, inner in given if inner is not None}
    if isinstance(value, (list, tuple)):
        return [to_wire(each) for each in value]
    return value


def _of_basic(basic: type) -> Decoder:
    def decode(value: Any, path: str) -> Any:
        if type(value) is not basic:
            raise Mismatch(f"{path}: {value!r:.80} is no {basic.__name__}")
        return value
    return decode


def _of_float(value: Any, path: str) -> float:
    if type(value) not in (int, float):
        raise Mismatch(f"{path}: {value!r:.80} is no number")
    return float(value)


def _of_list(inner: Decoder) -> Decoder:
    def decode(value: Any, path: str) -> Any:
        if not isinstance(value, list):
            raise Mismatch(f"{path}: {value!r:.80} is no list")
        return [inner(each, path) for each in value]
    return decode


def _of_optional(inner: Decoder) -> Decoder:
    return lambda value, path: None if value is None else inner(value, path)


def _of_struct(struct: type) -> Decoder:
    def decode(value: Any, path: str) -> Any:
        if not isinstance(value, dict):
            raise Mismatch(f"{path}: {value!r:.80} is no object")
        given = {}
        for name, wire, decoder in _fields_of(struct):
            try:
                given[name] = decoder(value.get(wire), f"{path}.{wire}")
            except Mismatch:
                if wire in value:
                    raise
                raise Mismatch(f"{path}.{wire} is missing") from None
        return struct(**given)
    return decode


@functools.lru_cache(maxsize=None)
def _fields_of(struct: type) -> list[tuple[str, str, Decoder]]:
    hints = typing.get_type_hints(struct)
    return [(each.name, camel(each.name), decoder_of(hints[each.name])) for each in dataclasses.fields(struct)]


def decoder_of(hint: Any) -> Decoder:
    """What reads a value of this type; an enumeration takes every word, since newer ones may have more."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return _of_optional(decoder_of(next(each for each in inner if each is not type(None))))
    if origin is typing.Literal:
        return _of_basic(str)
    if origin is list:
        return _of_list(decoder_of(inner[0]))
    if hint is float:
        return _of_float
    return _of_struct(hint) if dataclasses.is_dataclass(hint) else _of_basic(hint)


@functools.lru_cache(maxsize=None)
def decoder(hint: Any) -> Decoder:
    """The same, made once."""
    return decoder_of(hint)
