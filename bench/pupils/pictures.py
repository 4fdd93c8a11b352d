"""Pictures of flat textures through lenses with aberrations, from rays through a pupil. Shares nothing with sim/: another
language, another kind of kernel (landing places of rays instead of disks), textures drawn here, and the place of best focus
from the texture's and the kernel's spectra.

Lengths on the sensor are px. A ray through the pupil at (u, v), |(u, v)| <= 1, lands at half the blur diameter times (u, v)
plus what the aberrations add. Everything periodic: what blur moves out on one side comes in on the other.
"""
import numpy as np

OVER = 2          # samples per px along each side
SIDE = 288        # px of the texture
FRAME = 192       # px of the picture, from its middle


class Optics:
    """What one lens does besides defocus; every figure is 0 or None for an ideal one."""

    def __init__(self, spherical=0.0, coma=0.0, astigmatism=0.0, angle=0.0, colour=(0.0, 0.0, 0.0), obstruction=0.0,
                 blades=0, catseye=0.0):
        self.spherical = spherical      # px that a marginal ray lands off, paraxial focus
        self.coma = coma                # px, the sagittal radius
        self.astigmatism = astigmatism  # px, half the line at either focus
        self.angle = angle              # rad, of the field
        self.colour = colour            # px of blur diameter by which red, green, blue are focused apart
        self.obstruction = obstruction  # radius, of the pupil's
        self.blades = blades            # 0: round
        self.catseye = catseye          # shift of a second rim of the same radius, in pupil radii

    def open_at(self, u, v):
        r2 = u * u + v * v
        light = (r2 <= 1.0) & (r2 >= self.obstruction ** 2)
        if self.blades:
            turn = np.arctan2(v, u) - 0.3
            part = 2 * np.pi / self.blades
            edge = np.cos(part / 2) / np.cos((turn % part) - part / 2)
            light &= r2 <= edge ** 2
        if self.catseye:
            c, s = np.cos(self.angle), np.sin(self.angle)
            light &= (u - self.catseye * c) ** 2 + (v - self.catseye * s) ** 2 <= 1.0
        return light

    def landing(self, u, v, diameter):
        c, s = np.cos(self.angle), np.sin(self.angle)
        a, b = c * u + s * v, -s * u + c * v                     # along the field, and across
        r2 = u * u + v * v
        x = 0.5 * diameter * a + self.spherical * r2 * a + self.coma * (3 * a * a + b * b - 1.0) + self.astigmatism * a
        y = 0.5 * diameter * b + self.spherical * r2 * b + self.coma * 2 * a * b - self.astigmatism * b
        return c * x - s * y, s * x + c * y

    def kernel(self, diameter, random):
        """OVER-sampled, periodic, its origin at [0, 0]; sums to 1."""
        size = SIDE * OVER
        total = np.zeros(size * size)
        shades = [(0.3, self.colour[0]), (0.6, self.colour[1]), (0.1, self.colour[2])] if any(self.colour) else [(1.0, 0.0)]
        for weight, shift in shades:
            reach = abs(diameter + shift) + 2 * abs(self.spherical) + 6 * abs(self.coma) + 2 * abs(self.astigmatism)
            count = int(np.clip(3 * OVER * reach, 48, 700))
            u, v = np.meshgrid(np.arange(count), np.arange(count))
            u = (u + random.random(u.shape)) * (2.0 / count) - 1.0   # one ray somewhere in each cell of the pupil
            v = (v + random.random(v.shape)) * (2.0 / count) - 1.0
            through = self.open_at(u, v)
            x, y = self.landing(u[through], v[through], diameter + shift)
            x, y = x * OVER, y * OVER
            i, j = np.floor(x).astype(int), np.floor(y).astype(int)
            fx, fy = x - i, y - j
            for di, dj, part in ((0, 0, (1 - fx) * (1 - fy)), (1, 0, fx * (1 - fy)), (0, 1, (1 - fx) * fy), (1, 1, fx * fy)):
                at = ((j + dj) % size) * size + (i + di) % size
                total += np.bincount(at, part, size * size) * (weight / len(x))
        return total.reshape(size, size)


def texture(kind, random):
    """Light of the subject, 0 to 1, OVER-sampled."""
    size = SIDE * OVER
    if kind == "noise":
        f = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None, :])
        f[0, 0] = 1.0
        spectrum = np.fft.rfft2(random.normal(size=(size, size))) / np.maximum(f, 2.0 / size) ** random.uniform(1.0, 1.6)
        spectrum[0, 0] = 0.0
        field = np.fft.irfft2(spectrum, s=(size, size))
        return np.clip(0.4 + random.uniform(0.08, 0.2) * field / field.std(), 0.02, 0.98)
    if kind == "leaves":
        field = np.full((size, size), 0.5)
        radii = np.sort(4.0 * (1.0 - random.random(700)) ** -0.5)[::-1]
        for radius in np.minimum(radii, 120.0):                  # from the largest: a leaf of each radius on the last
            cx, cy = random.integers(0, size, 2)
            dx = np.abs(np.arange(size) - cx); dx = np.minimum(dx, size - dx)
            dy = np.abs(np.arange(size) - cy); dy = np.minimum(dy, size - dy)
            columns, rows = np.flatnonzero(dx <= radius), np.flatnonzero(dy <= radius)
            inside = dx[columns][None, :] ** 2 + dy[rows][:, None] ** 2 <= radius * radius
            field[np.ix_(rows, columns)] = np.where(inside, random.uniform(0.08, 0.8), field[np.ix_(rows, columns)])
        return field
    if kind == "strokes":
        field = np.full((size, size), 0.75)
        for _ in range(260):
            cx, cy, turn = random.integers(0, size), random.integers(0, size), random.uniform(0, np.pi)
            length, width = random.uniform(10, 60), random.uniform(1.5, 5.0)
            rows, columns = np.arange(cy - 40, cy + 40), np.arange(cx - 40, cx + 40)
            dx, dy = (columns - cx)[None, :], (rows - cy)[:, None]
            along, across = dx * np.cos(turn) + dy * np.sin(turn), dy * np.cos(turn) - dx * np.sin(turn)
            inside = (np.abs(along) < length / 2) & (np.abs(across) < width / 2)
            part = np.ix_(rows % size, columns % size)
            field[part] = np.where(inside, random.uniform(0.05, 0.4), field[part])
        return field
    if kind == "blank":
        return np.full((size, size), 0.4)
    raise ValueError(kind)


class Scene:
    """One texture, one lens, one sensor."""

    def __init__(self, kind, optics, random, electrons=10000.0, breathing=0.0, lights=0, dirt=0, hot=0):
        self.optics, self.random, self.electrons, self.breathing = optics, random, electrons, breathing
        self.light = texture(kind, random)
        size = SIDE * OVER
        self.lights = np.zeros((size, size))
        for _ in range(lights):
            i, j = random.integers(0, size, 2)
            self.lights[i:i + 2, j:j + 2] = random.uniform(10.0, 400.0)
        self.shade = np.ones((FRAME, FRAME))                     # dust: the same pixels in every frame
        y, x = np.mgrid[0:FRAME, 0:FRAME]
        for _ in range(dirt):
            distance = np.hypot(x - random.uniform(0, FRAME), y - random.uniform(0, FRAME))
            radius = random.uniform(1.5, 8.0)
            self.shade *= 1.0 - random.uniform(0.1, 0.5) / (1.0 + np.exp((distance - radius) / random.uniform(0.4, 1.5)))
        self.hot = np.zeros((FRAME, FRAME))
        for _ in range(hot):
            self.hot[random.integers(0, FRAME), random.integers(0, FRAME)] += random.uniform(0.1, 0.6)

    def picture(self, diameter):
        """8 bits; `diameter`: signed blur of an ideal lens at this place."""
        size = SIDE * OVER
        scene = self.light + self.lights
        if self.breathing:
            scale = 1.0 + self.breathing * diameter
            place = (np.arange(size) - size / 2) / scale + size / 2
            low = np.floor(place).astype(int); part = place - low
            rows = scene[low % size] * (1 - part)[:, None] + scene[(low + 1) % size] * part[:, None]
            scene = rows[:, low % size] * (1 - part)[None, :] + rows[:, (low + 1) % size] * part[None, :]
        blurred = np.fft.irfft2(np.fft.rfft2(scene) * np.fft.rfft2(self.optics.kernel(diameter, self.random)), s=(size, size))
        pixels = blurred.reshape(SIDE, OVER, SIDE, OVER).mean(axis=(1, 3))
        edge = (SIDE - FRAME) // 2
        light = np.clip(pixels[edge:edge + FRAME, edge:edge + FRAME], 0.0, None) * self.shade
        counted = self.random.poisson(light * self.electrons) + self.random.normal(0.0, 6.0, light.shape)
        return np.clip(np.rint(255.0 * (counted / self.electrons + self.hot)), 0, 255).astype(np.uint8)

    def best(self):
        """Blur diameter of an ideal lens where this one is sharpest on this texture: the mean of the places with the most
        energy of the gradient and of the Laplacian, without noise, lights and dirt."""
        size = SIDE * OVER
        fy, fx = np.meshgrid(np.fft.fftfreq(size, 1 / OVER), np.fft.rfftfreq(size, 1 / OVER), indexing="ij")
        pixel = np.sinc(fx) * np.sinc(fy)
        power = np.abs(np.fft.rfft2(self.light)) ** 2 * pixel ** 2
        places = np.arange(-14.0, 14.1, 1.0)
        gradient, laplacian = [], []
        for place in places:
            seen = power * np.abs(np.fft.rfft2(self.optics.kernel(place, self.random))) ** 2
            gradient.append((seen * (np.sin(2 * np.pi * fx) ** 2 + np.sin(2 * np.pi * fy) ** 2)).sum())
            laplacian.append((seen * (np.sin(np.pi * fx) ** 2 + np.sin(np.pi * fy) ** 2) ** 2).sum())
        tops = []
        for curve in (gradient, laplacian):
            k = int(np.clip(np.argmax(curve), 1, len(places) - 2))
            a, b, c = np.log(curve[k - 1:k + 2])
            tops.append(places[k] + 0.5 * (a - c) / (a - 2 * b + c))
        return float(np.mean(tops))
