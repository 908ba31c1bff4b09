"""Triangle shapes: flat panels and boxes, surfaces of revolution, icosphere, tube, torus knot. Metres, CCW fronts."""
import math
from dataclasses import dataclass

from .vector import add, cross, dot, length, scale, sub, unit


@dataclass
class Shape:
    positions: list
    triangles: list
    normals: list = None
    uvs: list = None
    tangents: list = None

    def without(self, *names):
        """The same shape less some attributes (normals, uvs, tangents)."""
        return Shape(self.positions, self.triangles, *(None if n in names else getattr(self, n) for n in ("normals", "uvs", "tangents")))

    def flipped(self):
        """The same surface seen from the other side."""
        normals = [scale(n, -1) for n in self.normals] if self.normals else None
        return Shape(self.positions, [(a, c, b) for a, b, c in self.triangles], normals, self.uvs, None)


def joined(*shapes):
    """One shape of several that have the same attributes."""
    out = Shape([], [], *([] if getattr(shapes[0], n) else None for n in ("normals", "uvs", "tangents")))
    for s in shapes:
        base = len(out.positions)
        out.triangles += [(a + base, b + base, c + base) for a, b, c in s.triangles]
        for name in ("positions", "normals", "uvs", "tangents"):
            if getattr(out, name) is not None:
                getattr(out, name).extend(getattr(s, name))
    return out


def panel(corner, right, up, uv_per_metre=1.0, mirrored=False, uv_at=(0.0, 0.0)):
    """Parallelogram facing right x up. u runs along `right` (against it when mirrored), v downwards."""
    n = unit(cross(right, up))
    u, v = length(right) * uv_per_metre, length(up) * uv_per_metre
    sign = -1.0 if mirrored else 1.0
    uvs = [(uv_at[0] + sign * x * u, uv_at[1] + (1 - y) * v) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    corners = [corner, add(corner, right), add(add(corner, right), up), add(corner, up)]
    tangent = scale(unit(right), sign) + (sign,)
    return Shape(corners, [(0, 1, 2), (0, 2, 3)], [n] * 4, uvs, [tangent] * 4)


def holed_panel(corner, right, up, hole):
    """Panel with a rectangular hole (x0, x1, y0, y1) in shares of right and up; the ring shares its corners, so it has no cracks."""
    x0, x1, y0, y1 = hole
    places = [(0, 0), (1, 0), (1, 1), (0, 1), (x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    at = [add(corner, add(scale(right, x), scale(up, y))) for x, y in places]
    ring = [t for i in range(4) for t in ((i, (i + 1) % 4, 4 + (i + 1) % 4), (i, 4 + (i + 1) % 4, 4 + i))]
    return Shape(at, ring)


def box(low, high, uv_per_metre=1.0):
    (x0, y0, z0), (x1, y1, z1) = low, high
    w, h, d = x1 - x0, y1 - y0, z1 - z0
    faces = (
        ((x0, y0, z1), (w, 0, 0), (0, h, 0)), ((x1, y0, z0), (-w, 0, 0), (0, h, 0)),
        ((x1, y0, z1), (0, 0, -d), (0, h, 0)), ((x0, y0, z0), (0, 0, d), (0, h, 0)),
        ((x0, y1, z1), (w, 0, 0), (0, 0, -d)), ((x0, y0, z0), (w, 0, 0), (0, 0, d)),
    )
    return joined(*(panel(*face, uv_per_metre) for face in faces))


def block(low, high):
    """Box with neither normals nor UVs: shaded flat."""
    return box(low, high).without("normals", "uvs", "tangents")


def lathe(pieces, around, uv_repeat=(1.0, 1.0)):
    """Surface of revolution about +Y. `pieces`: smooth runs of (radius, height), the outside to the right of the run
    when heights grow upwards; a new piece makes a crease. Normals point outwards."""
    shapes = []
    total = sum(math.dist(a, b) for run in pieces for a, b in zip(run, run[1:]))
    done = 0.0
    for run in pieces:
        out = Shape([], [], [], [], [])
        closed, last = math.dist(run[0], run[-1]) < 1e-6, len(run) - 1
        for i, (r, y) in enumerate(run):
            before = run[i - 1] if i else run[last - 1 if closed else 0]
            after = run[i + 1] if i < last else run[1 if closed else last]
            dr, dy = after[0] - before[0], after[1] - before[1]
            if r == 0:
                dr, dy = 1.0 if i == 0 else -1.0, 0.0  # a pole: the normal is the axis
            size = math.hypot(dr, dy)
            nr, ny = dy / size, -dr / size
            if i:
                done += math.dist(run[i - 1], run[i])
            v = uv_repeat[1] * (1 - done / total)
            for j in range(around + 1):
                angle = 2 * math.pi * (j % around) / around
                s, c = math.sin(angle), math.cos(angle)
                out.positions.append((r * s, y, r * c))
                out.normals.append((nr * s, ny, nr * c))
                out.uvs.append((uv_repeat[0] * j / around, v))
                out.tangents.append((c, 0.0, -s, 1.0))
        for i in range(len(run) - 1):
            for j in range(around):
                a = i * (around + 1) + j
                b, c, d = a + 1, a + around + 2, a + around + 1
                if run[i][0] > 0:
                    out.triangles.append((a, b, c))
                if run[i + 1][0] > 0:
                    out.triangles.append((a, c, d))
        shapes.append(out)
    return joined(*shapes)


def arc(centre, radius, start, stop, steps):
    """Points (r, y) of a circular arc; degrees, 0 = outwards, 90 = upwards."""
    out = []
    for i in range(steps + 1):
        angle = math.radians(start + (stop - start) * i / steps)
        out.append((max(0.0, round(centre[0] + radius * math.cos(angle), 9)), centre[1] + radius * math.sin(angle)))
    return out


def smooth_run(points, steps):
    """Catmull-Rom curve through (r, y) points."""
    out = []
    for i in range(len(points) - 1):
        p = [points[min(max(i + k, 0), len(points) - 1)] for k in (-1, 0, 1, 2)]
        for s in range(steps):
            t = s / steps
            out.append(tuple(
                0.5 * (2 * p[1][k] + (p[2][k] - p[0][k]) * t + (2 * p[0][k] - 5 * p[1][k] + 4 * p[2][k] - p[3][k]) * t * t
                       + (3 * p[1][k] - p[0][k] - 3 * p[2][k] + p[3][k]) * t ** 3) for k in (0, 1)))
    return [(max(r, 0.0), y) for r, y in out] + [points[-1]]


def sphere(radius, around, uv_repeat=(1.0, 1.0)):
    return exact_normals(lathe([arc((0, 0), radius, -90, 90, around // 2)], around, uv_repeat))


def exact_normals(ball):
    """A sphere about the origin with its true normals in place of the lathe's differences."""
    ball.normals = [unit(p) for p in ball.positions]
    return ball


def torus(big, small, around, across):
    """Ring about +Y."""
    return lathe([arc((big, 0), small, -180, 180, across)], around)


def icosphere(radius, splits):
    """20 * 4^splits flat triangles."""
    g = (1 + math.sqrt(5)) / 2
    points = [unit(p) for p in ((-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
                                (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1))]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
             (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(splits):
        middle, finer = {}, []

        def between(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle:
                points.append(unit(add(points[a], points[b])))
                middle[key] = len(points) - 1
            return middle[key]

        for a, b, c in faces:
            x, y, z = between(a, b), between(b, c), between(c, a)
            finer += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        faces = finer
    return Shape([scale(p, radius) for p in points], faces)


def extruded(profile, width):
    """Sheet along X of a smooth profile (z, y); its front is to the left of the run seen from +X."""
    out = Shape([], [], [])
    for i, (z, y) in enumerate(profile):
        before, after = profile[max(i - 1, 0)], profile[min(i + 1, len(profile) - 1)]
        n = unit((0.0, -(after[0] - before[0]), after[1] - before[1]))
        out.positions += [(-width / 2, y, z), (width / 2, y, z)]
        out.normals += [n, n]
    for i in range(len(profile) - 1):
        a = 2 * i
        out.triangles += [(a, a + 1, a + 3), (a, a + 3, a + 2)]
    return out


def tube(points, radius, sides):
    """Open tube of small radius along a curve that never runs vertically."""
    out = Shape([], [], [])
    for i, p in enumerate(points):
        along = unit(sub(points[min(i + 1, len(points) - 1)], points[max(i - 1, 0)]))
        side = unit(cross(along, (0.0, 1.0, 0.0)))
        over = cross(side, along)
        for j in range(sides):
            a = 2 * math.pi * j / sides
            n = add(scale(side, math.cos(a)), scale(over, math.sin(a)))
            out.positions.append(add(p, scale(n, radius)))
            out.normals.append(n)
    for i in range(len(points) - 1):
        for j in range(sides):
            a, b = i * sides + j, i * sides + (j + 1) % sides
            out.triangles += [(a, b + sides, b), (a, a + sides, b + sides)]
    return out


def torus_knot(turns, twists, big, small, thick, along, across, relief):
    """Tube around a (turns, twists) torus knot. `relief(u, v)` scales the tube's radius; u, v in [0, 1).
    Normals: cross product of central differences of the displaced surface."""
    h = 1e-4

    def centre(u):
        a, b = 2 * math.pi * turns * u, 2 * math.pi * twists * u
        r = big + small * math.cos(b)
        return (r * math.cos(a), small * math.sin(b), -r * math.sin(a)), (math.cos(b) * math.cos(a), math.sin(b), -math.cos(b) * math.sin(a))

    def frame(u):
        p, normal = centre(u)
        ahead = unit(sub(centre(u + h)[0], centre(u - h)[0]))
        normal = unit(sub(normal, scale(ahead, dot(normal, ahead))))
        return p, normal, cross(normal, ahead)

    def point(base, u, v):
        p, n, b = base
        a, r = 2 * math.pi * v, thick * relief(u, v)
        return add(p, add(scale(n, r * math.cos(a)), scale(b, r * math.sin(a))))

    out = Shape([], [], [], [])
    for i in range(along + 1):
        u = (i % along) / along
        here, before, after = frame(u), frame(u - h), frame(u + h)
        for j in range(across + 1):
            v = (j % across) / across
            du = sub(point(after, u + h, v), point(before, u - h, v))
            dv = sub(point(here, u, v + h), point(here, u, v - h))
            out.positions.append(point(here, u, v))
            out.normals.append(unit(cross(du, dv)))
            out.uvs.append((i / along, j / across))
    w = across + 1
    for i in range(along):
        for j in range(across):
            a = i * w + j
            out.triangles += [(a, a + w, a + w + 1), (a, a + w + 1, a + 1)]
    return out
