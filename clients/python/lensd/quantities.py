"""What lensctl reads, in this package too: "2m", "1.2D", "f/2.8", "2m..inf". Numbers are exact until they are sent."""
from __future__ import annotations

import fractions
import re
from typing import Optional

from .types import BlurLimit, Depth, DepthInterval, Target

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_METRES = {"nm": "1e-9", "um": "1e-6", "\u00b5m": "1e-6", "\u03bcm": "1e-6", "mm": "1e-3", "cm": "1e-2", "m": "1", "km": "1e3",
           "in": "0.0254", "ft": "0.3048"}
_LENGTHS = "a length such as 850mm, 2m or 5ft7in"
_DEPTHS = "a distance (0.8m, 33in), a vergence (2.5D) or inf"


def _number(text: str) -> Optional[fractions.Fraction]:
    return fractions.Fraction(text) if re.fullmatch(_NUMBER, text) else None


def _native(text: str, whole: str) -> float:
    number = _number(text)
    if number is None:
        raise ValueError(f"{whole!r}: a number of native units is missing, as in @1200, +50 or near:10")
    return float(number)


def _metres(text: str) -> Optional[fractions.Fraction]:
    """A length, None where the text is none."""
    feet = re.fullmatch(rf"({_NUMBER})ft((?:\d+\.?\d*|\.\d+))in", text)
    if feet:
        return fractions.Fraction(feet[1]) * fractions.Fraction("0.3048") + fractions.Fraction(feet[2]) * fractions.Fraction("0.0254")
    length = re.fullmatch(rf"({_NUMBER})([a-z\u00b5\u03bc]+)", text)
    if not length or length[2] not in _METRES:
        return None
    return fractions.Fraction(length[1]) * fractions.Fraction(_METRES[length[2]])


def _length(text: str, whole: str) -> fractions.Fraction:
    length = _metres(text)
    if length is None:
        raise ValueError(f"{whole!r} is not {_LENGTHS}")
    return length


def _steps(text: str) -> Optional[Target]:
    """"@1200", "+50", "-50"; None for anything else."""
    if text.startswith("@"):
        return Target(position=_native(text[1:], text))
    if text.startswith(("+", "-")) and _number(text) is not None:
        return Target(relative=_native(text, text))
    return None


def depth(text: str) -> Depth:
    """"2m", "1.2D", "inf"."""
    if text == "inf":
        return Depth(vergence_d=0.0)
    if text.endswith("D") and _number(text[:-1]) is not None:
        return Depth(vergence_d=float(fractions.Fraction(text[:-1])))
    length = _metres(text)
    if length is None:
        raise ValueError(f"{text!r} is not {_DEPTHS}")
    if length <= 0 or text.startswith("+"):
        raise ValueError(f"{text!r}: a distance is above 0 and has no sign; +N and -N are counts of steps")
    return Depth(distance_m=float(length))


def depths(text: str) -> DepthInterval:
    """"2.1m..2.5m", "4m..inf", or one depth."""
    first, dots, second = text.partition("..")
    return DepthInterval(one_end=depth(first), other_end=depth(second if dots else first))


def focus_target(text: str) -> Target:
    """"2m", "1.2D", "inf", "@1200", "+50", "near:10", "far:10", "ext:2.6mm"."""
    for word, sign in (("near:", 1.0), ("far:", -1.0)):
        if text.startswith(word):
            return Target(nearer=sign * _native(text[len(word):], text))
    if text.startswith("ext:"):
        return Target(extension_mm=float(_length(text[4:], text) * 1000))
    steps = _steps(text)
    if steps is not None:
        return steps
    where = depth(text)
    return Target(distance_m=where.distance_m, vergence_d=where.vergence_d)


def aperture_target(text: str) -> Target:
    """"f/2.8", "f2.8", "2.8", "@12", "+5"."""
    steps = _steps(text)
    if steps is not None:
        return steps
    f_number = _number(re.sub(r"^[fF]/?", "", text))
    if f_number is None or f_number <= 0:
        raise ValueError(f"{text!r} is not an f-number such as 2.8 or f/2.8")
    return Target(f_number=float(f_number))


def zoom_target(text: str) -> Target:
    """"35mm", "@120", "+5"."""
    steps = _steps(text)
    if steps is not None:
        return steps
    length = _length(text, text)
    if length <= 0 or text.startswith("+"):
        raise ValueError(f"{text!r}: a focal length is above 0 and has no sign; +N and -N are counts of steps")
    return Target(focal_length_mm=float(length * 1000))


def _limit(kind: str, where: str, limit: Optional[str], name: Optional[str], side: Optional[str]) -> BlurLimit:
    limit_um = limit_px = None
    if limit is not None and limit.endswith("px") and _number(limit[:-2]) is not None:
        limit_px = float(fractions.Fraction(limit[:-2]))
    elif limit is not None:
        limit_um = float(_length(limit, limit) * 1000000)
    return BlurLimit(name=name, kind=kind, limit_um=limit_um, limit_px=limit_px, depths=[depths(where)], side=side)  # type: ignore[arg-type]


def sharp(where: str, limit: Optional[str] = None, name: Optional[str] = None) -> BlurLimit:
    """For `Lens.plan`: the blur is at most `limit` ("8um", "1.5px"; a pixel when left out) everywhere in `where` ("2m..3m")."""
    return _limit("sharp", where, limit, name, None)


def blurred(where: str, limit: Optional[str] = None, name: Optional[str] = None, side: Optional[str] = None) -> BlurLimit:
    """The same with at least `limit`; `side` "behind" or "front" of the plane in focus, either when left out."""
    return _limit("blurred", where, limit, name, side)
