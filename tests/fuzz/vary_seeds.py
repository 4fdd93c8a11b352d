#!/usr/bin/env python3
"""Seeds of text made worse in every place, one place a file, so that a fuzzer begins where luck would lead it late.

    vary_seeds.py edges SEEDS OUT    each number of the short seeds becomes each number on an edge
    vary_seeds.py long SEEDS OUT     each word with the mark behind it is repeated to 128 KiB: what nests gets deep
"""
import os
import re
import sys

EDGES = (b"0", b"-0.0", b"4.9e-324", b"-4.9e-324", b"2.3e-308", b"1e-300", b"1.7e308", b"-1.7e308", b"nan", b"inf",
         b"9223372036854775807", b"-9223372036854775808", b"18446744073709551616")
SHORT, LONG = 256, 128 << 10


def edges(seed):
    if len(seed) <= SHORT:
        for number in re.finditer(rb"(?<![\w.])\d+(\.\d+)?(?![\w.])", seed):
            for edge in EDGES:
                yield seed[:number.start()] + edge + seed[number.end():]


def long(seed):
    seen = set()
    for token in re.finditer(rb"[\w-]*[^\w\s-]", seed):
        if token[0] not in seen:
            seen.add(token[0])
            yield seed[:token.start()] + token[0] * (LONG // len(token[0])) + seed[token.end():]


def main(what, folder, out):
    os.makedirs(out, exist_ok=True)
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), "rb") as file:
            seed = file.read()
        for number, varied in enumerate({"edges": edges, "long": long}[what](seed)):
            with open(os.path.join(out, f"{what}-{name}-{number}"), "wb") as file:
                file.write(varied)


if __name__ == "__main__":
    if len(sys.argv) != 4 or sys.argv[1] not in ("edges", "long"):
        sys.exit(__doc__)
    main(*sys.argv[1:])
