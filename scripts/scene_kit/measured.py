"""Scenes to measure rays on, one of each kind that acceleration structures differ on. Each has a camera and a light."""
import math
from random import Random

from .dense import Dense, ball, cable, cube_sphere, height_field, knot, rotation, turned, vase
from .gltf_file import GltfFile
from .shapes import panel, smooth_run
from .vector import cross, sub, unit

FLAT = ("normals", "uvs", "tangents")
# The sides of a box whose corner k is bit by bit across, over and along.
BEAM = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


class Stage:
    """A .glb in the making, of dense meshes."""

    def __init__(self, stem):
        self.file = GltfFile(stem, binary=True)

    def put(self, name, mesh, color=(0.7, 0.7, 0.7)):
        f = self.file
        f.node(name, f.mesh(name, (f.dense(mesh), f.matte(name, color))))

    def room(self, low, high):
        """Twelve big triangles that look inwards."""
        walls = Dense().box(low, high)
        for i in range(0, len(walls.indices), 3):
            walls.indices[i + 1], walls.indices[i + 2] = walls.indices[i + 2], walls.indices[i + 1]
        self.put("room", walls, (0.75, 0.75, 0.72))

    def lamp(self, corner, width, depth, nits):
        """A rectangle that shines downwards."""
        f = self.file
        shape = panel(corner, (width, 0, 0), (0, 0, depth)).without(*FLAT)
        f.node("lamp", f.mesh("lamp", (f.geometry(shape), f.lamp("lamp", (nits, nits, nits)))))


def profile(points, rows):
    """About `rows` (radius, height) rows of a smooth curve, crowded where its points are."""
    return smooth_run(points, max(1, rows // (len(points) - 1)))


GOBLET = ((0.3, 0.0), (0.28, 0.03), (0.05, 0.1), (0.04, 0.45), (0.2, 0.55), (0.36, 0.8), (0.33, 1.0))
URN = ((0.2, 0.0), (0.24, 0.05), (0.5, 0.4), (0.55, 0.7), (0.3, 1.0), (0.22, 1.08), (0.3, 1.2))
BOTTLE = ((0.26, 0.0), (0.27, 0.02), (0.27, 0.6), (0.22, 0.75), (0.08, 0.85), (0.07, 1.1), (0.09, 1.12))


def organism(x, y, z):
    """A lumpy creature: its parts are stretched and squeezed, so its triangles are of all sizes."""
    r = 1 + 0.3 * math.sin(3 * x + 1) * math.sin(2.5 * y) + 0.18 * math.sin(5 * z + 2 * y) * math.sin(4 * x)
    ear = 1.6 * max(0.0, 0.35 - math.hypot(x - 0.35, z - 0.1)) if y > 0 else 0.0
    tail = 1.3 * max(0.0, 0.3 - math.hypot(y + 0.2, x)) if z < 0 else 0.0
    fine = 0.012 * math.sin(31 * x) * math.sin(37 * y) * math.sin(29 * z)
    r += 0.9 * ear + 2.0 * tail + fine
    return (r * (x + 0.15 * y * y), r * y, r * (1.25 * z - 0.1 * y))


def leaves(random, count, radius):
    """A bush of two-triangle leaves."""
    bush = Dense()
    leaf = ((-0.5, 0, 0), (0, 0.08, 0.3), (0.5, 0, 0), (0, 0.08, -0.3))
    for _ in range(count):
        rows, size = rotation(random), radius * (0.02 + 0.05 * random.random())
        while True:
            at = [2 * random.random() - 1 for _ in range(3)]
            if 0.2 < sum(c * c for c in at) < 1:
                break
        bush.add([sum(m * c for m, c in zip(row, p)) * size + a * radius for p in leaf for row, a in zip(rows, at)], (0, 1, 2, 0, 2, 3))
    return bush


def flock():
    """A closed room of about a million triangles: objects finely and coarsely meshed, slivers, cables, slats, a bush."""
    random, stage = Random(1), Stage("flock")
    stage.room((-5, 0, -5), (5, 5, 5))
    stage.lamp((-0.8, 4.9, -0.8), 1.6, 1.6, 40.0)
    objects = [
        (knot(2, 3, 0.22, 500, 48, 0.1), 0.7), (knot(3, 5, 0.12, 900, 40), 0.6), (knot(2, 5, 0.1, 240, 16), 0.8),
        (knot(3, 4, 0.16, 1250, 64, 0.15), 0.75), (ball(256, 128, 0.12, 7), 0.8), (ball(400, 200, 0.2, 5, 2.0), 0.7),
        (ball(300, 150, 0.05, 23), 0.55), (cube_sphere(92, organism), 0.6), (cube_sphere(40, organism), 0.35),
        (vase(profile(URN, 300), 36), 1.0), (vase(profile(GOBLET, 300), 32), 1.0), (vase(profile(BOTTLE, 300), 24), 0.9),
        (vase(profile(URN, 60), 256), 0.9), (vase(profile(BOTTLE, 60), 256), 0.8), (vase(profile(URN, 120), 120, 17, 0.08), 1.1),
    ]
    objects += [(ball(64, 32, 0.1), 0.4)] * 4 + [(ball(24, 12), 0.45)] * 6 + [(vase(profile(GOBLET, 12), 10), 0.8)] * 6
    cells = [(x, y, z) for y in (0.95, 2.5, 4.0) for x in range(-2, 3) for z in range(-2, 3)]
    random.shuffle(cells)
    things = Dense()
    for (mesh, size), cell in zip(objects, cells):
        at = (1.7 * cell[0] + 0.5 * (random.random() - 0.5), cell[1] + 0.3 * (random.random() - 0.5), 1.7 * cell[2] + 0.5 * (random.random() - 0.5))
        things.placed(mesh, at, size, rotation(random))
    pebble = ball(16, 8, 0.15, 3)
    for _ in range(120):
        at = (9 * random.random() - 4.5, 0.06, 9 * random.random() - 4.5)
        things.placed(pebble, at, 0.05 + 0.08 * random.random(), rotation(random))
    stage.put("objects", things, (0.6, 0.5, 0.4))
    stage.put("bush", Dense().placed(leaves(random, 30000, 0.9), (3.6, 0.9, -3.6)), (0.2, 0.5, 0.15))
    long = Dense()
    for _ in range(30):
        ends = [(9 * random.random() - 4.5, 2.2 + 2.5 * random.random(), s) for s in (-4.9, 4.9)]
        long.placed(cable(*ends, 0.2 + random.random(), 0.003 + 0.007 * random.random(), 80, 5))
    for i in range(80):
        long.box((-2.5, 0.5 + 0.05 * i, -4.93), (2.5, 0.503 + 0.05 * i, -4.88))
    stage.put("cables and slats", long, (0.3, 0.3, 0.35))
    stage.file.camera("main", (4.3, 2.9, 4.4), (-0.6, 1.9, -0.8), 55)
    return stage.file


def terrain():
    """2,097,152 triangles of open land under a low sun."""
    stage = Stage("terrain")
    land = height_field(Random(7), 10, 0.5, 400.0, 160.0)
    stage.put("land", land, (0.4, 0.36, 0.28))
    middle = land.positions[len(land.positions) // 6 * 3 + 1]
    top = max(land.positions[1::3])
    stage.file.light("sun", "directional", 60000.0, at=(0, 500, 0), target=(430, 330, 200))
    stage.file.camera("main", (-185, top + 25, -170), (40, middle - 20, 60), 50)
    return stage.file


def organic():
    """A single mesh of 69,312 triangles in the open."""
    stage = Stage("organic")
    stage.put("organism", cube_sphere(76, organism), (0.6, 0.45, 0.4))
    stage.file.light("bulb", "point", 400.0, at=(2.5, 3.5, 2.0))
    stage.file.camera("main", (2.6, 1.4, 3.6), (0.15, 0.1, 0.0), 40)
    return stage.file


def interior():
    """A furnished room: walls, tables and shelves of few triangles, crockery and a figure of very small ones."""
    random, stage = Random(3), Stage("interior")
    stage.room((-3, 0, -4), (3, 2.7, 4))
    stage.lamp((-0.5, 2.65, -0.5), 1.0, 1.0, 60.0)
    wood, stuff = Dense(), Dense()

    def table(x, z, width, depth, height):
        wood.box((x - width / 2, height - 0.04, z - depth / 2), (x + width / 2, height, z + depth / 2))
        for sx in (-1, 1):
            for sz in (-1, 1):
                at = (x + sx * (width / 2 - 0.06), z + sz * (depth / 2 - 0.06))
                wood.box((at[0] - 0.03, 0, at[1] - 0.03), (at[0] + 0.03, height - 0.04, at[1] + 0.03))

    def chair(x, z, degrees):
        own = Dense().box((-0.22, 0.42, -0.22), (0.22, 0.46, 0.22))
        for sx in (-0.2, 0.2):
            for sz in (-0.2, 0.2):
                own.box((sx - 0.02, 0, sz - 0.02), (sx + 0.02, 0.42 if sz > 0 else 0.95, sz + 0.02))
        for k in range(7):
            own.box((-0.18 + 0.06 * k - 0.008, 0.5, -0.21), (-0.18 + 0.06 * k + 0.008, 0.92, -0.19))
        wood.placed(own, (x, 0, z), 1.0, turned(degrees))

    def shelf(z0, z1):
        wood.box((-2.99, 0, z0), (-2.6, 0.03, z0 + 0.02)).box((-2.99, 0, z0 - 0.02), (-2.6, 2.2, z0)).box((-2.99, 0, z1), (-2.6, 2.2, z1 + 0.02))
        for k in range(6):
            y = 0.1 + 0.38 * k
            wood.box((-2.99, y, z0), (-2.6, y + 0.02, z1))
            z = z0 + 0.02
            while z < z1 - 0.06:
                thick, tall = 0.012 + 0.035 * random.random(), 0.18 + 0.14 * random.random()
                stuff.box((-2.95, y + 0.021, z), (-2.72 + 0.06 * random.random(), y + 0.021 + tall, z + thick))
                z += thick + 0.001 + 0.004 * random.random()

    table(0.4, 0.3, 1.8, 0.9, 0.75)
    table(1.9, -3.2, 1.6, 0.7, 0.9)
    for x, z, degrees in ((0.0, 1.0, 180), (0.8, 1.05, 172), (0.0, -0.4, 5), (0.8, -0.45, -8), (-1.2, 0.3, 80)):
        chair(x, z, degrees)
    shelf(-3.8, -1.4)
    shelf(-1.2, 1.2)
    for k in range(60):
        wood.box((-2.9 + 0.1 * k, 0.001, -3.99), (-2.81 + 0.1 * k, 0.9, -3.97))
    stage.put("furniture", wood, (0.45, 0.3, 0.18))
    cup, plate = vase(profile(GOBLET, 60), 72), vase(((0.02, 0.0), (0.6, 0.02), (0.8, 0.05), (1.0, 0.14), (0.99, 0.15), (0.78, 0.06), (0.02, 0.012)), 120)
    for x, z in ((-0.3, 0.6), (0.3, 0.6), (0.9, 0.6), (-0.3, 0.0), (0.3, 0.0), (0.9, 0.0)):
        stuff.placed(plate, (x, 0.751, z), 0.12)
        stuff.placed(cup, (x + 0.16, 0.751, z + 0.08), 0.12, turned(40 * x))
    stuff.placed(cube_sphere(60, organism), (0.35, 0.86, 0.3), 0.08)
    stuff.placed(cube_sphere(90, organism), (2.3, 1.05, -3.2), 0.12, turned(200))
    stuff.placed(knot(2, 3, 0.2, 300, 32), (1.5, 1.06, -3.25), 0.11)
    stuff.placed(vase(profile(URN, 120), 90, 11, 0.06), (-2.4, 0.0, 2.2), 0.6)
    for k in range(160):
        stuff.placed(ball(10, 6), (1.2 + 0.5 * random.random(), 0.91, -3.4 + 0.4 * random.random()), 0.006)
    stage.put("things", stuff, (0.55, 0.55, 0.6))
    stage.put("plant", Dense().placed(leaves(random, 8000, 0.45), (-2.4, 1.15, 2.2)), (0.2, 0.45, 0.15))
    stage.file.camera("main", (2.6, 1.6, 3.7), (-0.5, 0.8, -0.8), 58)
    return stage.file


def drone():
    """A flying machine of about 33,000 triangles in a small closed box of twelve."""
    stage, parts = Stage("drone"), Dense()
    stage.room((-1.6, -1.1, -1.6), (1.6, 1.3, 1.6))
    stage.lamp((-0.2, 1.25, -0.2), 0.4, 0.4, 30.0)
    body = ball(96, 48, 0.04, 9)
    body.positions = type(body.positions)("d", (c * s for i in range(0, len(body.positions), 3) for c, s in zip(body.positions[i:i + 3], (0.34, 0.14, 0.42))))
    parts.placed(body)
    for k in range(4):
        a = math.radians(45 + 90 * k)
        x, z = 0.75 * math.cos(a), 0.75 * math.sin(a)
        parts.placed(cable((0.25 * math.cos(a), 0.02, 0.25 * math.sin(a)), (x, 0.08, z), -0.03, 0.035, 30, 10))
        parts.placed(vase(profile(BOTTLE, 36), 32), (x, 0.0, z), 0.16)
        ring = [(0.3 + 0.02 * math.cos(2 * math.pi * i / 12), 0.02 * math.sin(2 * math.pi * i / 12)) for i in range(13)]
        parts.placed(vase(ring, 90), (x, 0.17, z))
        for blade in range(3):
            # Thin and long, of few triangles.
            own = Dense().box((0.02, -0.003, -0.018), (0.27, 0.003, 0.018))
            parts.placed(own, (x, 0.2, z), 1.0, turned(120 * blade + 31 * k))
        parts.placed(cable((0.5 * x, 0.0, 0.5 * z), (0.62 * x, -0.42, 0.62 * z), 0.0, 0.012, 12, 8))
    for k in range(24):
        a = math.radians(15 * k)
        parts.placed(ball(8, 5), (0.3 * math.cos(a), 0.08, 0.36 * math.sin(a)), 0.012)
    parts.placed(ball(32, 20), (0.0, -0.16, 0.22), 0.09)
    stage.put("machine", parts, (0.35, 0.37, 0.4))
    stage.file.camera("main", (1.35, 0.75, 1.4), (0, -0.02, 0), 48)
    return stage.file


def rafters():
    """A timber hall that stands askew: beams, braces, stairs and wires, long, thin and diagonal, and a jug of small triangles."""
    random, stage = Random(11), Stage("rafters")
    askew, beams, wires = turned(33), Dense(), Dense()

    def beam(into, start, stop, width, depth):
        """Twelve triangles from `start` to `stop`, whatever the length."""
        along = unit(sub(stop, start))
        side = unit(cross(along, (0.13, 0.11, 1.0)))
        over = cross(side, along)
        corners = []
        for k in range(8):
            s, o, end = width * ((k & 1) - 0.5), depth * ((k >> 1 & 1) - 0.5), stop if k & 4 else start
            corners += [e + side[i] * s + over[i] * o for i, e in enumerate(end)]
        into.add(corners, [i for a, b, c, d in BEAM for i in (a, b, c, a, c, d)])

    for k in range(61):
        z = -12 + 0.4 * k
        for x in (-1, 1):
            beam(beams, (x * 6.2, 2.6, z), (0, 7.2, z), 0.08, 0.18)
            beam(beams, (x * 3.0, 2.9, z), (x * 1.2, 6.2, z), 0.05, 0.1)
            beam(beams, (x * 3.0, 2.9, z), (x * 4.4, 3.9, z), 0.05, 0.1)
            beam(beams, (x * 5.9, 0, z), (x * 5.9, 2.7, z), 0.12, 0.12)
            if k:
                beam(beams, (x * 5.95, 0, z - 0.4), (x * 5.95, 2.6, z), 0.03, 0.1)
        beam(beams, (-6, 2.8, z), (6, 2.8, z), 0.07, 0.16)
    for k in range(44):
        s = k / 43
        for x in (-1, 1):
            beam(beams, (x * 6.2 * (1 - s), 2.72 + 4.6 * s, -12), (x * 6.2 * (1 - s), 2.72 + 4.6 * s, 12), 0.04, 0.05)
    for flight in range(6):
        z = -9 + 3.4 * flight
        for x in (-2.6, -1.4):
            beam(beams, (x, 0, z), (x, 2.8, z + 2.9), 0.05, 0.24)
            beam(beams, (x, 0.95, z), (x, 3.75, z + 2.9), 0.04, 0.06)
        for k in range(16):
            y, at = 0.175 * (k + 0.5), z + 0.181 * (k + 0.5)
            beam(beams, (-2.6, y, at), (-1.4, y, at), 0.26, 0.03)
            for x in (-2.6, -1.4):
                beam(beams, (x, y, at), (x, y + 0.95, at), 0.015, 0.015)
    for k in range(2500):
        start = (12 * random.random() - 6, 2.8 + 0.4 * random.random(), 24 * random.random() - 12)
        stop = [c + 7 * (random.random() - 0.5) * f for c, f in zip(start, (1, 0.5, 1))]
        beam(wires, start, stop, 0.004 + 0.008 * random.random(), 0.006)
    for k in range(400):
        at, lean = (10 * random.random() - 5, 0, 22 * random.random() - 11), (random.random() - 0.5, 2.4, random.random() - 0.5)
        beam(beams, at, [a + b for a, b in zip(at, lean)], 0.06, 0.03)
    hall = Dense().placed(beams, turn=askew)
    stage.put("timber", hall, (0.45, 0.3, 0.18))
    stage.put("wires", Dense().placed(wires, turn=askew), (0.3, 0.3, 0.33))
    floor = Dense().box((-7, -0.2, -13), (7, 0, 13))
    stage.put("floor", Dense().placed(floor, turn=askew), (0.5, 0.48, 0.45))
    stage.put("jug", Dense().placed(vase(profile(URN, 200), 160, 9, 0.05), (1.0, 0.0, 0.5)), (0.5, 0.35, 0.3))
    stage.file.light("sun", "directional", 8.0, at=(0, 500, 0), target=(210, 0, 130))
    stage.file.camera("main", (6.58, 1.7, 8.84), (-2.93, 2.9, -2.86), 62)
    return stage.file
