"""What suites of simulated lenses share: the kinds of faults, and a reader of PNG files of its own."""
import struct
import zlib

SIM = "io.lensd.Simulator."
KINDS = ("stall", "jump", "disconnect", "reconnect", "drop-reply", "late-reply", "stale-readback", "freeze-frames",
         "lose-frames", "wrong-exposure", "missed-steps")


def rows_of(png):
    """Grey samples of a PNG whose rows are not filtered in a way this reader does not know."""
    width, height, bits, colour = struct.unpack(">IIBB", png[16:26])
    assert colour == 0 and png[:8] == b"\x89PNG\r\n\x1a\n"
    data, at = b"", 8
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        data += png[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += size + 12
    data, pixel = zlib.decompress(data), bits // 8
    rows, before, length = [], bytearray(width * pixel), width * pixel
    for y in range(height):
        how, line = data[y * (length + 1)], bytearray(data[y * (length + 1) + 1:(y + 1) * (length + 1)])
        for i in range(length):
            left, up = line[i - pixel] if i >= pixel else 0, before[i]
            corner = before[i - pixel] if i >= pixel else 0
            near = min((abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, near[2])[how]) & 255
        rows.append(list(line))
        before = line
    return rows
