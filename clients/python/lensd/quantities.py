"""What lensctl reads, in this package too: "2m", "1.2 m", "5'7\"", "1.2D", "f/2.8", "2m..inf", "1/250s". Numbers are exact until
they are sent. A text that lensctl refuses is a ValueError here, with the advice that lensctl gives."""
from __future__ import annotations

import dataclasses
import fractions
import math
import re
from typing import Callable, Iterable, NoReturn, Optional, Union

from .types import BlurLimit, CalibrationPoint, Depth, DepthInterval, DistanceFrom, Target

Exact = fractions.Fraction

# Each unit's kind, and how many of the kind's own unit (m, 1/m, px, s, C, 1) it is. A unit in the wrong case is looked for in this order.
_UNITS = {
    "nm": ("length", "1e-9"), "um": ("length", "1e-6"), "\u00b5m": ("length", "1e-6"), "\u03bcm": ("length", "1e-6"),
    "mm": ("length", "1e-3"), "cm": ("length", "1e-2"), "m": ("length", "1"), "km": ("length", "1e3"), "in": ("length", "0.0254"),
    "ft": ("length", "0.3048"), "D": ("vergence", "1"), "px": ("pixels", "1"), "ns": ("time", "1e-9"), "us": ("time", "1e-6"),
    "ms": ("time", "1e-3"), "s": ("time", "1"), "min": ("time", "60"), "h": ("time", "3600"), "C": ("temperature", "1"),
    "%": ("percent", "1e-2"), "": ("plain", "1"), "'": ("length", "0.3048"), '"': ("length", "0.0254")}
_FOOT, _INCH = Exact("0.3048"), Exact("0.0254")
_LENGTHS = "a length in nm um mm cm m km in ft, such as 850mm or 5ft7in"
_DEPTHS = "a distance in um mm cm m km in ft (0.8m, 33in), a vergence in D (2.5D), or inf"
_BLURS = "a blur diameter such as 8um or 1.5px"
_TIMES = "a time in ns us ms s min h, such as 500ms or 1/250s"
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_MOST_DIGITS, _LARGEST_EXPONENT = 200, 1000
# Spaces and signs that programs put into text, and the ASCII character for each.
_ASCII = str.maketrans({"\u00a0": " ", "\u2009": " ", "\u202f": " ", "\u2212": "-", "\u2019": "'", "\u2032": "'", "\u2033": '"', "\t": " "})
_ORIGINS: tuple[tuple[str, DistanceFrom], ...] = ((" from the lens centre", "lens"), (" from the sensor", "sensor"))


@dataclasses.dataclass(frozen=True)
class _Measure:
    """A number in its kind's own unit."""

    value: Exact
    kind: str


def _refuse(text: str, why: str) -> NoReturn:
    most = 60  # of a text that makes no sense, the rest adds nothing
    raise ValueError(f"'{text if len(text) <= most else text[:most] + '...'}': {why}")


def _ascii(text: str) -> str:
    return text.translate(_ASCII).strip(" ")


def _take(text: str) -> Optional[tuple[Exact, str]]:
    """The number that a text begins with, and what follows it. None: it begins with none, or with an absurd one."""
    found = _NUMBER.match(text)
    if found is None:
        return None
    mantissa, _, exponent = found[0].lower().partition("e")
    power = exponent.lstrip("+-").lstrip("0")
    if sum(letter.isdigit() for letter in mantissa) > _MOST_DIGITS or len(power) > 4 or int(power or 0) > _LARGEST_EXPONENT:
        return None
    return Exact(found[0]), text[found.end():]


def _measure(written: str) -> Optional[_Measure]:
    """Number and unit, also with a space between them; feet with inches included. None: it is neither."""
    number = _take(_ascii(written))
    if number is None:
        return None
    value, unit = number[0], number[1].lstrip(" ")
    feet = "ft" if unit.startswith("ft") else "'" if unit.startswith("'") else ""
    if feet and len(unit) > len(feet):
        below = unit[len(feet):].lstrip(" ")
        inches = _take(below)
        if inches is None or inches[1].lstrip(" ") not in ("in", '"') or below[0] in "+-" or value < 0:
            return None
        return _Measure(value * _FOOT + inches[0] * _INCH, "length")
    if unit not in _UNITS:
        return None
    kind, factor = _UNITS[unit]
    return _Measure(value * Exact(factor), kind)


def _is_infinity(text: str) -> bool:
    return _ascii(text).lower() in ("inf", "infinity", "\u221e")


def _ends_of_other_range(text: str) -> Optional[tuple[str, str]]:
    """The ends of what is written as a range, but not with two dots: 2m-3m, 2-3m, 2m to 3m, 2m...3m."""
    for between in ("...", "\u2026", " to ", "\u2013", "\u2014", "-"):
        at = text.find(between, 1)
        if at < 0 or at + len(between) >= len(text):
            continue
        first, second = _ascii(text[:at]), _ascii(text[at + len(between):])
        near, far = _measure(first), _measure(second)
        if (near is None and not _is_infinity(first)) or (far is None and not _is_infinity(second)):
            continue
        if near is not None and far is not None and near.kind == "plain" and far.kind != "plain":
            number = _take(second)
            return first + (number[1] if number else ""), second
        return first, second
    return None


def _advice_on(written: str) -> Optional[str]:
    """What is wrong with a number and its unit, and how it is written right. None: that cannot be seen."""
    text, wrong = _ascii(written), []
    if text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
        wrong.append("decimals stand after a point, not after a comma")
    number = _take(text)
    if number is not None and _measure(text) is None:
        meant = next((unit for unit in _UNITS if unit.lower() == number[1].lstrip(" ").lower()), None)
        if meant is None:
            return None
        text = text[:len(text) - len(number[1])] + meant
        wrong.append(f"the unit is written {meant}")
    return f"{', and '.join(wrong)}: write {text}" if wrong and _measure(text) is not None else None


def _parse(text: str, kinds: tuple[str, ...], fits: str) -> _Measure:
    measure = _measure(text)
    if measure is None:
        advice = _advice_on(text)
        if advice is not None:
            _refuse(text, advice)
        if _ends_of_other_range(text) is not None:
            _refuse(text, f"one quantity belongs here, not a range; write {fits}")
        _refuse(text, f"not a quantity; write {fits}")
    if measure.kind in kinds:
        return measure
    if measure.kind == "plain":
        _refuse(text, f"a bare number; give its unit: {fits}")
    _refuse(text, f"the wrong kind of quantity here; write {fits}")


def _nearest(exact: Exact, text: str) -> float:
    """The double next to it, where there is one."""
    try:
        value = float(exact)
    except OverflowError:
        value = math.inf
    if math.isinf(value) or (value == 0 and exact != 0):
        _refuse(text, "too large or too small to represent")
    return value


def _plain(text: str) -> float:
    return _nearest(_parse(text, ("plain",), "a plain number").value, text)


def _is_plain(text: str) -> bool:
    """A number without a unit, which a double can hold."""
    try:
        _plain(text)
    except ValueError:
        return False
    return True


def _length(text: str) -> Exact:
    length = _parse(text, ("length",), _LENGTHS).value
    _nearest(length, text)
    return length


def _steps(text: str) -> Optional[Target]:
    """"@1200", "+50", "-50"; None for anything else."""
    if text == "@":
        _refuse(text, "the position is missing, as in @1200")
    if text.startswith("@"):
        return Target(position=_plain(text[1:]))
    if text.startswith(("+", "-")) and _is_plain(text):
        return Target(relative=_plain(text))
    return None


def _without_twin(text: str) -> str:
    """lensctl prints a depth twice, "2.31 m (0.433 D)": the first of them, or the second of "past infinity (-0.1 D)"."""
    first, bracket, rest = text.partition(" (")
    if not bracket or not rest.endswith(")"):
        return text
    twin = rest[:-1]
    if first == "past infinity":
        return twin
    return first if _measure(twin) is not None or _is_infinity(twin) or twin == "past infinity" else text


def without_origin(text: str) -> tuple[str, Optional[DistanceFrom]]:
    """"1.2 m from the sensor" as lensctl prints it: the distance, and where it starts. None: it does not say where."""
    for end, origin in _ORIGINS:
        if text.endswith(end):
            return text[:-len(end)], origin
    return text, None


def depth(written: str) -> Depth:
    """"2m", "1.2D", "inf", "1.2 m (0.8333 D)"."""
    text = _without_twin(written)
    if _is_infinity(text):
        return Depth(vergence_d=0.0)
    measure = _parse(text, ("length", "vergence"), _DEPTHS)
    value = _nearest(measure.value, text)
    if measure.kind == "vergence":
        return Depth(vergence_d=value)
    if value <= 0:
        _refuse(text, "a distance must be greater than zero")
    try:
        _nearest(1 / measure.value, text)
    except ValueError:
        _refuse(text, "too small to represent as a vergence")
    return Depth(distance_m=value)


def _subject(text: str) -> Depth:
    where = depth(text)
    if where.vergence_d is not None and where.vergence_d < 0:
        _refuse(text, "a negative vergence is past infinity, where there are no subjects; write 0D or inf")
    return where


def depths(text: str) -> DepthInterval:
    """"2.1m..2.5m", "4m..inf", or one depth."""
    if (".." not in text or "..." in text) and _measure(text) is None:
        ends = _ends_of_other_range(text)
        if ends is not None:
            _refuse(text, f"a range has two dots between its ends: write {ends[0]}..{ends[1]}")
    first, dots, second = text.partition("..")
    return DepthInterval(one_end=_subject(first), other_end=_subject(second if dots else first))


def focus_target(text: str) -> Target:
    """"2m", "1.2D", "inf", "@1200", "+50", "near:10", "far:10", "ext:2.6mm"."""
    for word, sign in (("near:", 1.0), ("far:", -1.0)):
        if text.startswith(word):
            return Target(nearer=sign * _plain(text[len(word):]))
    steps = _steps(text)
    if steps is not None:
        return steps
    if text.startswith("ext:"):
        return Target(extension_mm=float(_length(text[4:]) * 1000))
    if _is_plain(text):
        _refuse(text, f"a bare number; write {text}m or {text}mm for a distance, {text}D for a vergence, @{text} for this position of "
                      f"the motor, or +{text} to move by so many steps")
    where = depth(text)
    if where.distance_m is not None and text.startswith(("+", "-")):
        _refuse(text, "a distance has no sign; +N, -N, near:N and far:N move by N steps, ext:2.6mm is an extension")
    return Target(distance_m=where.distance_m, vergence_d=where.vergence_d)


def aperture_target(text: str) -> Target:
    """"f/2.8", "f2.8", "1:2.8", "2.8", "@12", "+5"."""
    steps = _steps(text)
    if steps is not None:
        return steps
    number = re.sub(r"^(?:1:[fF]?/?|[fF]/?)", "", _ascii(text))
    measure = _measure(number)
    if measure is None or measure.kind != "plain":
        _refuse(text, _advice_on(number) or "not an f-number; write a number without a unit, such as 2.8 or f/2.8")
    if measure.value <= 0:
        _refuse(text, "an f-number must be greater than zero")
    return Target(f_number=_nearest(measure.value, text))


def zoom_target(text: str) -> Target:
    """"35mm", "@120", "+5"."""
    steps = _steps(text)
    if steps is not None:
        return steps
    length = _length(text)
    if length <= 0:
        _refuse(text, "must be greater than zero")
    if text.startswith("+"):
        _refuse(text, "a focal length has no sign; +N and -N are counts of steps")
    return Target(focal_length_mm=float(length * 1000))


def _seconds_of_fraction(text: str) -> Optional[Exact]:
    """"1/250s", as cameras show it; None for anything else."""
    above, slash, below = text.partition("/")
    whole, divisor = _measure(above), _take(_ascii(below))
    if not slash or whole is None or whole.kind != "plain" or divisor is None or divisor[0] <= 0:
        return None
    kind, factor = _UNITS.get(divisor[1].lstrip(" "), ("", "0"))
    if kind != "time":
        return None
    try:
        _nearest(divisor[0], text)
        _nearest(whole.value * Exact(factor), text)
    except ValueError:
        return None
    return whole.value * Exact(factor) / divisor[0]


def milliseconds(text: str) -> float:
    """"8ms", "1/250s", rounded to a nanosecond."""
    fraction = _seconds_of_fraction(text)
    seconds = _parse(text, ("time",), _TIMES).value if fraction is None else fraction
    if not Exact("0.5e-9") <= seconds <= Exact("9e9"):
        _refuse(text, "must be between 1ns and 9e9s")
    return math.floor(seconds * 10 ** 9 + Exact(1, 2)) / 1e6


def calibration_point(position: float, text: str) -> CalibrationPoint:
    """A focus position and the depth that is in focus there: "0.8m", "inf", "ext:0.8mm"."""
    if text.startswith("ext:"):
        return CalibrationPoint(position=float(position), extension_mm=float(_length(text[4:]) * 1000))
    where = depth(text)
    return CalibrationPoint(position=float(position), distance_m=where.distance_m, vergence_d=where.vergence_d)


def _bare(call: str, number: object, example: str, names: Iterable[str]) -> TypeError:
    ways = ", ".join(f"{call}({name}={number!r})" for name in names)
    return TypeError(f"{call}({number!r}) does not say what the number counts; write {call}({example!r}) with the text that lensctl reads, "
                     f"or name the number: {ways}")


def exposure_of(duration: Optional[str], exposure_ms: Optional[float]) -> Optional[float]:
    """Milliseconds of exposure("8ms") or exposure(exposure_ms=8); None: neither is given."""
    if duration is None:
        return exposure_ms
    if not isinstance(duration, str):
        raise _bare("exposure", duration, "8ms", ["exposure_ms", "gain"])
    if exposure_ms is not None:
        raise TypeError(f"exposure({duration!r}, exposure_ms=...) has two exposure times; give one of them")
    return milliseconds(duration)


def target_of(call: str, where: Union[str, float, None], read: Callable[[str], Target], example: str,
              **numbers: Optional[float]) -> Target:
    """The target of a call such as focus("2m") or focus(position=812). TypeError: it has none, several, or a number that does not say
    what it counts."""
    given = {name: value for name, value in numbers.items() if value is not None}
    if isinstance(where, str):
        if given:
            raise TypeError(f"{call}({where!r}, {next(iter(given))}=...) has two targets; give one of them")
        return read(where)
    if where is not None:
        raise _bare(call, where, example, numbers)
    if len(given) != 1:
        raise TypeError(f"{call}({', '.join(f'{name}=...' for name in given)}) has {'several targets' if given else 'no target'}; write "
                        f"{call}({example!r}) with the text that lensctl reads, or one of " + ", ".join(f"{call}({name}=...)" for name in numbers))
    name, value = given.popitem()
    if isinstance(value, (str, bool)):
        raise TypeError(f"{call}({name}={value!r}): {name} is a number; a text with its unit stands alone: {call}({example!r})")
    return Target(**{name: float(value)})


def _limit(kind: str, where: str, limit: Optional[str], name: Optional[str], side: Optional[str]) -> BlurLimit:
    interval, limit_um, limit_px = depths(where), None, None
    if limit is not None:
        measure = _parse(limit, ("length", "pixels"), _BLURS)
        if measure.value <= 0:
            _refuse(limit, "a blur limit must be greater than zero")
        _nearest(measure.value, limit)
        limit_px = float(measure.value) if measure.kind == "pixels" else None
        limit_um = float(measure.value * 10 ** 6) if measure.kind == "length" else None
    return BlurLimit(name=name, kind=kind, limit_um=limit_um, limit_px=limit_px, depths=[interval], side=side)  # type: ignore[arg-type]


def sharp(where: str, limit: Optional[str] = None, name: Optional[str] = None) -> BlurLimit:
    """For `Lens.plan` and `Lens.stack`: the blur is at most `limit` ("8um", "1.5px"; a pixel when left out) everywhere in `where`
    ("2m..3m")."""
    return _limit("sharp", where, limit, name, None)


def blurred(where: str, limit: Optional[str] = None, name: Optional[str] = None, side: Optional[str] = None) -> BlurLimit:
    """For `Lens.plan`: the blur is at least `limit` everywhere in `where`; `side` "behind" or "front" of the plane in focus, either
    when left out."""
    return _limit("blurred", where, limit, name, side)
