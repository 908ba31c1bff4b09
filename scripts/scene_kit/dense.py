"""Meshes of many triangles as flat arrays, positions only: what the scenes for measuring rays are made of. Metres."""
import math
from array import array

from .vector import cross, dot, scale, sub, unit


class Dense:
    """Triangles that a file holds as one mesh: `positions` x, y, z and `indices` a, b, c, one after the other."""

    def __init__(self):
        self.positions, self.indices = array("d"), array("I")

    @property
    def triangles(self):
        return len(self.indices) // 3

    def add(self, positions, indices):
        """Appends flat lists; the indices count from the first of these positions."""
        base = len(self.positions) // 3
        self.positions.extend(positions)
        self.indices.extend([i + base for i in indices])
        return self

    def grid(self, point, columns, rows, wraps=False):
        """A surface (columns x rows cells) of `point(u, v)` with u, v in [0, 1]; `wraps` closes it in u."""
        across = columns if wraps else columns + 1
        positions = []
        for j in range(rows + 1):
            v = j / rows
            for i in range(across):
                positions.extend(point(i / columns, v))
        indices = []
        for j in range(rows):
            low, high = j * across, (j + 1) * across
            for i in range(columns):
                k = (i + 1) % across
                indices += (low + i, low + k, high + k, low + i, high + k, high + i)
        return self.add(positions, indices)

    def shape(self, shape):
        """Appends a Shape of `shapes`."""
        return self.add([x for p in shape.positions for x in p], [i for t in shape.triangles for i in t])

    def box(self, low, high):
        """Appends a box of 8 corners and 12 triangles."""
        corners = [x for k in range(8) for x in (high[0] if k & 1 else low[0], high[1] if k & 2 else low[1], high[2] if k & 4 else low[2])]
        quads = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
        return self.add(corners, [i for a, b, c, d in quads for i in (a, b, c, a, c, d)])

    def placed(self, other, at=(0.0, 0.0, 0.0), size=1.0, turn=None):
        """Appends `other` scaled, then turned by three rows of a rotation (`rotation`), then moved to `at`."""
        (a, b, c), (d, e, f), (g, h, i) = turn or ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        x, y, z = at
        source, positions = other.positions, []
        for k in range(0, len(source), 3):
            p, q, r = source[k] * size, source[k + 1] * size, source[k + 2] * size
            positions += (a * p + b * q + c * r + x, d * p + e * q + f * r + y, g * p + h * q + i * r + z)
        return self.add(positions, other.indices)


def rotation(random):
    """Three rows of a rotation, uniform over all of them: from a random unit quaternion."""
    while True:
        q = [2 * random.random() - 1 for _ in range(4)]
        size = sum(c * c for c in q)
        if 0.05 < size < 1:
            break
    w, x, y, z = (c / math.sqrt(size) for c in q)
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))


def turned(degrees):
    """Rows of a turn about +Y."""
    s, c = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return ((c, 0, s), (0, 1, 0), (-s, 0, c))


def knot(turns, twists, thick, along, across, relief=0.0):
    """A tube around a torus knot within 1.4 m of the origin; `relief` is the depth of its dents."""
    tau, h = 2 * math.pi, 1e-3

    def centre(u):
        a, b = tau * turns * u, tau * twists * u
        r = 1 + 0.35 * math.cos(b)
        return (r * math.cos(a), 0.35 * math.sin(b), -r * math.sin(a))

    frames = []
    for i in range(along + 1):
        u = (i % along) / along
        p = centre(u)
        ahead = unit(sub(centre(u + h), centre(u - h)))
        side = unit(sub(p, scale(ahead, dot(p, ahead))))
        frames.append((p, side, cross(side, ahead)))
    circle = [(math.cos(tau * j / across), math.sin(tau * j / across)) for j in range(across)]
    wave = [math.sin(3 * tau * j / across) for j in range(across)]

    def point(u, v):
        i, j = round(v * along), round(u * across) % across
        p, n, b = frames[i]
        r = thick * (1 + relief * wave[j] * math.sin(tau * 40 * v))
        c, s = r * circle[j][0], r * circle[j][1]
        return (p[0] + n[0] * c + b[0] * s, p[1] + n[1] * c + b[1] * s, p[2] + n[2] * c + b[2] * s)

    return Dense().grid(point, across, along, wraps=True)


def ball(around, down, bumps=0.0, frequency=6.0, crowd=1.0):
    """A sphere of radius 1 by longitude and latitude, dented; `crowd` > 1 crowds its rows at the upper pole.
    The poles are left out: there its triangles would have no area."""
    tau = 2 * math.pi

    def point(u, v):
        theta, phi = math.pi * (0.004 + 0.992 * v ** crowd), tau * u
        s = math.sin(theta)
        x, y, z = s * math.cos(phi), math.cos(theta), s * math.sin(phi)
        r = 1 + bumps * math.sin(frequency * x + 1) * math.sin(frequency * y) * math.sin(frequency * z + 2)
        return (r * x, r * y, r * z)

    return Dense().grid(point, around, down, wraps=True)


def vase(profile, around, flutes=0, depth=0.0):
    """A surface of revolution of (radius, height) rows about +Y, with `flutes` of relative `depth` round it."""
    tau, last = 2 * math.pi, len(profile) - 1

    def point(u, v):
        r, y = profile[round(v * last)]
        if flutes:
            r *= 1 + depth * math.cos(tau * flutes * u)
        return (r * math.sin(tau * u), y, r * math.cos(tau * u))

    return Dense().grid(point, around, last, wraps=True)


def cable(start, stop, sag, radius, segments, sides):
    """A hanging tube: long thin triangles."""
    tau = 2 * math.pi
    along = unit(sub(stop, start))
    side = unit(cross(along, (0.0, 1.0, 0.0)))
    over = cross(side, along)

    def point(u, v):
        down = 4 * sag * v * (1 - v)
        c, s = radius * math.cos(tau * u), radius * math.sin(tau * u)
        p = [start[k] + (stop[k] - start[k]) * v + side[k] * c + over[k] * s for k in range(3)]
        return (p[0], p[1] - down, p[2])

    return Dense().grid(point, sides, segments, wraps=True)


def cube_sphere(cells, shape):
    """12 cells^2 triangles: `shape(x, y, z)` of the points of a sphere laid out as a cube's six faces, closed only to rounding."""
    mesh = Dense()
    faces = (lambda a, b: (1, a, -b), lambda a, b: (-1, a, b), lambda a, b: (a, 1, -b),
             lambda a, b: (a, -1, b), lambda a, b: (a, b, 1), lambda a, b: (-a, b, -1))
    for face in faces:
        mesh.grid(lambda u, v, face=face: shape(*unit(face(2 * u - 1, 2 * v - 1))), cells, cells)
    return mesh


def height_field(random, power, roughness, width, height):
    """2 * 4^power triangles over a square of `width` metres: midpoint displacement (diamond and square steps)."""
    n = 1 << power
    rows = [[0.0] * (n + 1) for _ in range(n + 1)]
    step, amount = n, height
    while step > 1:
        half = step // 2
        for y in range(half, n, step):
            above, below, row = rows[y - half], rows[y + half], rows[y]
            for x in range(half, n, step):
                mean = above[x - half] + above[x + half] + below[x - half] + below[x + half]
                row[x] = 0.25 * mean + amount * (random.random() - 0.5)
        for y in range(0, n + 1, half):
            row = rows[y]
            above, below = rows[y - half] if y else None, rows[y + half] if y < n else None
            for x in range(0 if y // half % 2 else half, n + 1, step):
                around = [r[x] for r in (above, below) if r]
                if x:
                    around.append(row[x - half])
                if x < n:
                    around.append(row[x + half])
                row[x] = sum(around) / len(around) + amount * (random.random() - 0.5)
        step, amount = half, amount * roughness
    at = [width * (x / n - 0.5) for x in range(n + 1)]
    positions, indices = array("d"), array("I")
    for y, row in enumerate(rows):
        z = at[y]
        for x, h in zip(at, row):
            positions.extend((x, h, z))
    for y in range(n):
        first = y * (n + 1)
        for a in range(first, first + n):
            indices.extend((a, a + n + 1, a + n + 2, a, a + n + 2, a + 1))
    mesh = Dense()
    mesh.positions, mesh.indices = positions, indices
    return mesh
