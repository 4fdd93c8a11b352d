"""A live view: pictures as they come, at most so many a second, without copying a pixel."""
import sys
import time

import lensd

path, name, rate_hz, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
with lensd.Lens(path, name) as lens, lens.view(max_rate_hz=rate_hz, encoding="gray8") as view:
    begun, count = time.monotonic(), 0
    for picture in view:
        # numpy.asarray(picture.samples) is an array of rows and columns on the same memory.
        rows, columns = picture.info.height_px, picture.info.width_px
        middle = picture.data[rows // 2 * columns + columns // 2]
        count += 1
        if count % 30 == 1:
            print(f"frame {picture.frame.sequence}: {columns} x {rows}, middle {middle}, sharpness {picture.info.sharpness:.3g}, "
                  f"{picture.dropped} dropped")
        if time.monotonic() - begun > seconds:
            break
    print(f"{count / (time.monotonic() - begun):.1f} pictures a second")
