"""Crops of PNG pictures, twice as large, for pages that show pictures small. The standard library alone."""
import struct
import zlib

ENLARGED = 2


def _rows(path):
    """Width in bytes a pixel and the rows of an RGB or grey PNG of 8 or 16 bits that is not interlaced."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, head = 8, b"", None
    while at < len(data):
        size, = struct.unpack(">I", data[at:at + 4])
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            head = struct.unpack(">IIBB", body[:10])
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    width, height, bits, colour = head
    pixel = {0: 1, 2: 3}[colour] * bits // 8
    raw, stride, rows, above = zlib.decompress(packed), width * pixel, [], None
    for y in range(height):
        start = y * (stride + 1)
        row = bytearray(raw[start + 1:start + 1 + stride])
        _unfilter(raw[start], row, above or bytearray(stride), pixel)
        rows.append(row)
        above = row
    return bits // 8, pixel, rows


def _unfilter(kind, row, above, pixel):
    for i, value in enumerate(row):
        left = row[i - pixel] if i >= pixel else 0
        corner = above[i - pixel] if i >= pixel else 0
        if kind == 4:  # Paeth: whichever neighbour is nearest to left + above - corner
            guess = left + above[i] - corner
            away = abs(guess - left), abs(guess - above[i]), abs(guess - corner)
            add = (left, above[i], corner)[away.index(min(away))]
        else:
            add = (0, left, above[i], (left + above[i]) // 2)[kind]
        row[i] = (value + add) & 255


def save_crop(source, where, gain, target):
    """Saves the rectangle x, y, width, height of a picture in 8 bits, brighter by `gain`, each pixel a square of four."""
    sample, pixel, rows = _rows(source)
    x, y, width, height = where
    out = b""
    for row in rows[y:y + height]:
        line = bytearray()
        for i in range(x * pixel, (x + width) * pixel, pixel):
            values = (int.from_bytes(row[j:j + sample], "big") / (256 ** (sample - 1)) for j in range(i, i + pixel, sample))
            line += bytes(min(255, round(gain * value)) for value in values) * ENLARGED
        out += (b"\0" + bytes(line)) * ENLARGED
    head = struct.pack(">IIBBBBB", width * ENLARGED, height * ENLARGED, 8, 2 if pixel // sample == 3 else 0, 0, 0, 0)
    with open(target, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, body in ((b"IHDR", head), (b"IDAT", zlib.compress(out, 9)), (b"IEND", b"")):
            file.write(struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)))
