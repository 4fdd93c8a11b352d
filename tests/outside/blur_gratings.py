#!/usr/bin/python3
"""Snapshots of gratings at known blur keep 2 J1(x)/x of their contrast, in place (no quadrature), whatever shows them."""
import os, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("gratings")
LENSES = int(os.environ.get("OUTSIDE_LENSES", "10"))
SIZE, EDGE = 160, 40
LIMIT = 0.02    # frames of the simulated camera are made to two levels of 255; renderers themselves promise 0.01


def Png16(width, height, rows, bits=16):
    raw = b"".join(b"\0" + (struct.pack(">%dH" % width, *row) if bits == 16 else bytes(row)) for row in rows)
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(raw, 1)) + chunk(b"IEND", b""))


def Draw(i):
    lens = dict(name="g%d" % i, f=round(random.uniform(8, 80), 2), n=round(random.uniform(1.2, 4), 2), pixel=round(random.uniform(2, 12), 2))
    lens["kind"] = random.choice(["sinusoid", "texture", "plane", "depth-map", "layers"])
    period = random.uniform(2.5, 16)
    angle = random.choice([0, math.pi / 2, random.uniform(0.2, 1.3)]) if lens["kind"] == "sinusoid" else random.choice([0, math.pi / 2, random.uniform(0.2, 1.3)])
    k = (math.cos(angle) / period, math.sin(angle) / period)
    lens["k"] = tuple(0.0 if abs(x) < 1e-9 else x for x in k)
    lens["period"] = 1 / math.hypot(*lens["k"])
    lens["distance"] = round(lens["f"] * random.uniform(20, 200) / 1000, 4)
    return lens


def Files(lens):
    z = lens["distance"]
    e = lens["f"] ** 2 / (z * 1000 - lens["f"])
    reach = 8 * lens["pixel"] / 1000 * lens["n"]
    lens["e"] = (max(0.0, e - reach), e + reach)
    name = lens["name"]
    files = {}
    text = "version=1\n[camera]\nwidth=%d\nheight=%d\npixel_um=%r\nbits=16\nexposure_ms=1\nframe_rate_hz=200\n" % (SIZE, SIZE, lens["pixel"])
    text += "[lens]\nfocal_length_mm=%r\nf_number=%r\nextension_mm=[%r,%r]\nsteps=20000\nspeed_steps_per_s=1e6\nacceleration_steps_per_s2=1e8\nsettle_ms=1\n" % (
        lens["f"], lens["n"], lens["e"][0], lens["e"][1])
    text += "initial_f_number=%r\n" % lens["n"]
    kx, ky = lens["k"]
    if lens["kind"] == "sinusoid":
        text += '[[surface]]\nkind="wall"\ndistance_m=%r\nsinusoid_px=[%r,%r]\n' % (z, 1 / kx if kx else 0.0, 1 / ky if ky else 0.0)
    else:
        sinc = lambda t: math.sin(math.pi * t) / (math.pi * t) if t else 1.0
        share = 0.4 * sinc(kx) * sinc(ky)   # pixel means of a grating
        rows = [[int(round(65535 * (0.5 + share * math.cos(2 * math.pi * (kx * (x + 0.5) + ky * (y + 0.5)))))) for x in range(SIZE)]
                for y in range(SIZE)]
        files[name + ".png"] = Png16(SIZE, SIZE, rows)
        if lens["kind"] in ("texture", "layers"):
            text += '[[surface]]\nkind="wall"\ndistance_m=%r\ntexture="%s.png"\n' % (z, name)
            if lens["kind"] == "layers":
                text += '[[surface]]\nkind="wall"\ndistance_m=%r\nconstant=0.3\nregion=[0.0,0.0,0.06,0.06]\n' % (z * 0.97)
        elif lens["kind"] == "plane":
            text += '[[surface]]\nkind="plane"\nvergence_d=[%r,0.0,0.0]\ntexture="%s.png"\n' % (1 / z, name)
        else:
            files[name + "-d.png"] = Png16(SIZE, SIZE, [[int(round(z * 1000))] * SIZE] * SIZE)
            lens["distance"] = int(round(z * 1000)) / 1000
            text += '[[surface]]\nkind="depth-map"\nfile="%s-d.png"\ntexture="%s.png"\n' % (name, name)
    files[name + ".toml"] = text
    return files


def Amplitude(rows, k):
    """Mean, cosine and sine part by least squares on the middle of the frame."""
    n = [[0.0] * 4 for _ in range(3)]
    for y in range(EDGE, SIZE - EDGE):
        row = rows[y]
        for x in range(EDGE, SIZE - EDGE):
            w = 2 * math.pi * (k[0] * (x + 0.5) + k[1] * (y + 0.5))
            b = (1.0, math.cos(w), math.sin(w))
            v = row[x]
            for i in range(3):
                for j in range(3):
                    n[i][j] += b[i] * b[j]
                n[i][3] += b[i] * v
    for i in range(3):
        for j in range(i + 1, 3):
            q = n[j][i] / n[i][i]
            for c in range(i, 4):
                n[j][c] -= q * n[i][c]
    x = [0.0] * 3
    for i in (2, 1, 0):
        x[i] = (n[i][3] - sum(n[i][j] * x[j] for j in range(i + 1, 3))) / n[i][i]
    return x


lenses = [Draw(i) for i in range(LENSES)]
files = {}
for lens in lenses:
    files.update(Files(lens))
files["lensd.toml"] = "version=1\n" + "".join('[[lens]]\nname="%s"\ndriver="sim"\nscene="%s.toml"\n' % (l["name"], l["name"]) for l in lenses)
worst = {}
with Daemon(bins, files) as daemon:
    daemon.wait_connected()
    client = daemon.client()
    for lens in lenses:
        f, a, pixel = lens["f"], lens["f"] / lens["n"], lens["pixel"] / 1000
        u = 1 / (lens["distance"] * 1000)
        focus = f * f / (1 / u - f)

        def Look(e):
            client.call("Move", lens=lens["name"], axis="focus", target={"extensionMm": e})
            frame, (_, _, _, _, rows) = client.snapshot(lens["name"])
            blur = SignedBlur(f, a, f + frame["extensionMm"], u) / pixel
            return blur, Amplitude(rows, lens["k"])

        b0, (m0, c0, s0) = Look(focus)
        strength = math.hypot(c0, s0)
        for _ in range(int(os.environ.get("OUTSIDE_BLURS", "4"))):
            want = random.choice([-1, 1]) * random.choice([random.uniform(0, 1), random.uniform(0, 6)])
            e = focus + want * pixel * lens["n"]
            if not lens["e"][0] <= e <= lens["e"][1]:
                continue
            b, (m, c, s) = Look(e)
            signed = (c * c0 + s * s0) / strength / m / (strength / m0)
            quadrature = (s * c0 - c * s0) / strength / m / (strength / m0)
            expected = Kept(b, lens["period"]) / Kept(b0, lens["period"])
            off = max(abs(signed - expected), abs(quadrature))
            worst[lens["kind"]] = max(worst.get(lens["kind"], 0), off)
            report.check(lens["kind"], off <= LIMIT, "%s period %.3f px %s blur %.3f px: kept %.4f, want %.4f, quadrature %.4f" % (
                lens["kind"], lens["period"], lens["k"], b, signed, expected, quadrature))
print({k: round(v, 4) for k, v in worst.items()})
sys.exit(report.end())
