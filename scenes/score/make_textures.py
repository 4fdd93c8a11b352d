#!/usr/bin/env python3
"""Makes the textures of the scoring scenes, the same bits every time (needs python3-numpy).

Nobody tuned anything on them. Each imitates one kind of thing that cameras look at: rough ground (a 1/f field cut by
edges), things in front of things (dead leaves: disks whose radii follow a power law, each hiding what it covers), a
printed page, woven cloth, leaves, and plaster with faint scratches. Bars, with texture along one direction only, are for
regimes/stripes.toml."""
import os
import struct
import zlib

import numpy as np

SIDE = 384
HERE = os.path.dirname(os.path.abspath(__file__))


def field(rng, slope):
    """Random field whose power falls like frequency^-slope; mean 0, standard deviation 1."""
    fx, fy = np.fft.rfftfreq(SIDE), np.fft.fftfreq(SIDE)[:, None]
    f = np.hypot(fx, fy)
    f[0, 0] = 1.0
    shaped = np.fft.rfft2(rng.standard_normal((SIDE, SIDE))) * f ** (-slope / 2)
    shaped[0, 0] = 0.0
    out = np.fft.irfft2(shaped, (SIDE, SIDE))
    return out / out.std()


def ground(rng):
    rough = field(rng, 2.2)
    stones = field(rng, 3.0) > 0.3
    return 0.45 + 0.09 * rough + 0.12 * stones


def dead_leaves(rng, leaf, count=9000, smallest=2.0, largest=60.0):
    """Occlusion model: radii with density r^-3, drawn from back to front. leaf(dx, dy, r, angle) says what is covered."""
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    image = np.full((SIDE, SIDE), 0.4)
    u = rng.random(count)
    radii = (smallest ** -2 - u * (smallest ** -2 - largest ** -2)) ** -0.5
    for r in radii:
        cx, cy = rng.random(2) * SIDE
        x0, x1 = max(int(cx - 2 * r) - 1, 0), min(int(cx + 2 * r) + 2, SIDE)
        y0, y1 = max(int(cy - 2 * r) - 1, 0), min(int(cy + 2 * r) + 2, SIDE)
        covered = leaf(x[y0:y1, x0:x1] - cx, y[y0:y1, x0:x1] - cy, r, rng.random() * np.pi)
        tone = np.clip(rng.normal(0.45, 0.18), 0.08, 0.9)
        image[y0:y1, x0:x1] = image[y0:y1, x0:x1] * (1 - covered) + tone * covered
    return image


def disk(dx, dy, r, _):
    return np.clip(r - np.hypot(dx, dy) + 0.5, 0, 1)


def blade(dx, dy, r, angle):
    along = dx * np.cos(angle) + dy * np.sin(angle)
    across = dy * np.cos(angle) - dx * np.sin(angle)
    return np.clip((1 - (along / (2 * r)) ** 2) * 0.6 * r - np.abs(across) + 0.5, 0, 1)


def leaves(rng):
    return dead_leaves(rng, disk)


def foliage(rng):
    return np.clip(dead_leaves(rng, blade, count=7000, smallest=2.5, largest=40.0) + 0.03 * field(rng, 2.0), 0, 1)


def page(rng):
    """Lines of words of strokes, like print seen from reading distance."""
    image = np.full((SIDE, SIDE), 0.85)
    top = 6
    while top < SIDE - 14:
        size = int(rng.choice([7, 9, 9, 9, 12]))
        left = 8 + int(rng.integers(0, 10))
        end = SIDE - 8 - int(rng.integers(0, 60))
        while left < end - 8:
            for _ in range(int(rng.integers(2, 9))):
                if left > SIDE - 14:
                    break
                kind = rng.random()
                width = max(2, int(size * 0.55))
                if kind < 0.7:
                    image[top:top + size, left:left + 2] -= 0.6
                if kind > 0.3:
                    row = top + int(rng.integers(0, size - 1))
                    image[row:row + 2, left:left + width] -= 0.55
                if kind > 0.6:
                    for k in range(size):
                        image[top + k, left + k * width // size] -= 0.5
                left += width + 2
            left += size // 2 + 1
        top += int(size * 1.8)
    return np.clip(image + 0.015 * field(rng, 1.5), 0.08, 0.95)


def cloth(rng):
    """Threads over and under each other, no two alike."""
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    warp = x + 0.8 * field(rng, 3.0)
    weft = y + 0.8 * field(rng, 3.0)
    over = (np.floor(warp / 7) + np.floor(weft / 7)) % 2
    thread = np.where(over > 0, np.abs(np.sin(np.pi * warp / 7)), np.abs(np.sin(np.pi * weft / 7)))
    tones = rng.normal(0, 0.05, (2, SIDE))
    tone = np.where(over > 0, tones[0][(warp / 7).astype(int) % SIDE], tones[1][(weft / 7).astype(int) % SIDE])
    return np.clip(0.2 + 0.3 * thread + tone + 0.06 * field(rng, 1.8) + 0.05 * field(rng, 2.8), 0, 1)


def plaster(rng):
    image = 0.6 + 0.05 * field(rng, 2.0) + 0.02 * field(rng, 1.0)
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    for _ in range(60):
        cx, cy, angle = rng.random() * SIDE, rng.random() * SIDE, rng.random() * np.pi
        along = (x - cx) * np.cos(angle) + (y - cy) * np.sin(angle)
        across = (y - cy) * np.cos(angle) - (x - cx) * np.sin(angle)
        image -= 0.15 * np.exp(-0.5 * (across / 1.2) ** 2) * (np.abs(along) < rng.uniform(10, 60))
    return np.clip(image, 0, 1)


def bars(rng):
    """Texture along one direction only: upright bars whose widths follow a power law, with soft edges."""
    row = np.empty(0)
    while row.size < SIDE:
        width = int((1.0 - rng.random()) ** -0.8 + 1)
        row = np.append(row, np.full(min(width, 40), np.clip(rng.normal(0.45, 0.2), 0.05, 0.95)))
    row = np.convolve(np.tile(row[:SIDE], 3), (0.25, 0.5, 0.25), "same")[SIDE:2 * SIDE]
    return np.tile(row, (SIDE, 1))


def write_png(path, image):
    pixels = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    raw = b"".join(b"\x01" + bytes(np.diff(row.astype(np.int16), prepend=0).astype(np.uint8)) for row in pixels)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 0, 0, 0, 0)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def main():
    for seed, make in enumerate((ground, leaves, foliage, page, cloth, plaster, bars), 7001):
        write_png(os.path.join(HERE, make.__name__ + ".png"), make(np.random.default_rng(seed)))


if __name__ == "__main__":
    main()
