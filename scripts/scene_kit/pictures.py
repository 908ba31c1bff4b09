"""Procedural tiling textures as PNG bytes: bricks, planks, tiles, peel, stripes. No library but zlib."""
import math
import random
import struct
import zlib


def png(width, height, rows, channels=3):
    """PNG of rows of bytes (RGB, or grey for one channel), every row with filter 4 (Paeth)."""
    data, above = bytearray(), bytes(width * channels)

    def predicted(a, b, c):
        pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
        return a if pa <= pb and pa <= pc else b if pb <= pc else c

    for row in rows:
        left, upper_left = bytes(channels) + row[:-channels], bytes(channels) + above[:-channels]
        data.append(4)
        data.extend((x - predicted(a, b, c)) & 255 for x, a, b, c in zip(row, left, above, upper_left))
        above = row

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(data), 9)) + chunk(b"IEND", b"")


def byte(x):
    return min(255, max(0, int(x * 255 + 0.5)))


def srgb(x):
    """Byte of a linear value under the sRGB curve."""
    x = min(1.0, max(0.0, x))
    return byte(12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055)


SRGB = [srgb(i / 4095) for i in range(4096)]


def tone(color, factor):
    """sRGB bytes of a linear colour times a factor."""
    return tuple(SRGB[min(4095, max(0, int(c * factor * 4095)))] for c in color)


def noise(size, cells_x, cells_y, rng):
    """Smooth tiling noise in [-1, 1]: [size][size] rows."""
    grid = [[rng.random() * 2 - 1 for _ in range(cells_x)] for _ in range(cells_y)]

    def steps(cells):
        for i in range(size):
            f = i * cells / size
            k, t = int(f), f - int(f)
            yield k % cells, (k + 1) % cells, t * t * (3 - 2 * t)

    columns = list(steps(cells_x))
    out = []
    for k0, k1, t in steps(cells_y):
        line = [a + (b - a) * t for a, b in zip(grid[k0], grid[k1])]
        out.append([line[a] + (line[b] - line[a]) * s for a, b, s in columns])
    return out


def normal_rows(height, size, strength):
    """RGB rows of the tangent-space normals of a tiling height map, green up. `strength`: texels per unit of height."""
    for y in range(size):
        line, up, down = height[y], height[y - 1], height[(y + 1) % size]
        row = bytearray()
        for x in range(size):
            nx = (line[x - 1] - line[(x + 1) % size]) * 0.5 * strength
            ny = (down[x] - up[x]) * 0.5 * strength
            inverse = 127.0 / math.sqrt(nx * nx + ny * ny + 1)
            row += bytes((int(nx * inverse + 128), int(ny * inverse + 128), int(inverse + 128)))
        yield bytes(row)


def bricks(size=512, across=4, courses=12, seed=11):
    """(base colour sRGB, metallic-roughness, normal) of a running bond of bricks."""
    rng = random.Random(seed)
    fine, coarse, broad = noise(size, 128, 128, rng), noise(size, 32, 32, rng), noise(size, 5, 5, rng)
    tint = [[(rng.random(), rng.random(), rng.random(), rng.random()) for _ in range(across)] for _ in range(courses)]
    wide, tall, mortar = size / across, size / courses, size / 90
    base, rough, height = [], [], []
    for y in range(size):
        course, fy = divmod(y, tall)
        course = int(course)
        shift = 0.5 * wide if course % 2 else 0.0
        colors, roughs, heights = bytearray(), bytearray(), []
        for x in range(size):
            f, c, b = fine[y][x], coarse[y][x], broad[y][x]
            column, fx = divmod((x - shift) % size, wide)
            hue, value, rise, tilt = tint[course][int(column) % across]
            edge = min(fx, wide - fx, fy, tall - fy) - mortar + 0.9 * c
            inside = min(1.0, max(0.0, edge / 4.0))
            inside = inside * inside * (3 - 2 * inside)
            heights.append(inside * (0.75 + 0.25 * rise + (tilt - 0.5) * 0.25 * (fx / wide - 0.5)) + 0.035 * f * (1.2 - 0.4 * inside) + 0.09 * c)
            clay = (0.36 + 0.14 * hue, 0.12 + 0.085 * hue, 0.065 + 0.055 * hue)
            lime = (0.42, 0.39, 0.34)
            level = (0.72 + 0.5 * value if inside > 0.5 else 0.95) * (1 + 0.10 * b + 0.09 * c)
            mixed = [m + (k - m) * inside for m, k in zip(lime, clay)]
            # Steps of 1/24: coarse enough to compress, finer than the eye sees under the relief.
            colors += bytes(tone(mixed, round(level * 24) / 24))
            roughs += bytes((255, 4 * round((0.92 - 0.22 * inside * value - 0.06 * c) * 63), 0))
        base.append(bytes(colors))
        rough.append(bytes(roughs))
        height.append(heights)
    return png(size, size, base), png(size, size, rough), png(size, size, normal_rows(height, size, 5.0))


def planks(size=256, boards=4, seed=5, dark=(0.20, 0.10, 0.045), light=(0.46, 0.27, 0.13)):
    """Base colour of boards that run along u, with long grain."""
    rng = random.Random(seed)
    grain, fibre, rings = noise(size, 3, 48, rng), noise(size, 6, 128, rng), noise(size, 2, 12, rng)
    boards_data = [(rng.random(), int(rng.random() * size), int(rng.random() * size)) for _ in range(boards)]
    rows = []
    for y in range(size):
        board, fy = divmod(y * boards / size, 1)
        value, slide, joint = boards_data[int(board)]
        row = bytearray()
        for x in range(size):
            k = (x + slide) % size
            g = 0.5 + 0.28 * grain[y][k] + 0.10 * fibre[y][k] + 0.12 * math.sin(9 * rings[y][k] + 4 * grain[y][k])
            g = min(1.0, max(0.0, g * 0.75 + 0.3 * value))
            gap = min(fy, 1 - fy) * size / boards < 1.0 or abs(x - joint) < 1
            row += bytes(tone([a + (b - a) * g for a, b in zip(dark, light)], 0.25 if gap else 1.0))
        rows.append(bytes(row))
    return png(size, size, rows)


def tiles(size=256, count=2, seed=8, one=(0.62, 0.58, 0.50), two=(0.13, 0.15, 0.17)):
    """Base colour of a chequer of veined stone tiles."""
    rng = random.Random(seed)
    a, b = noise(size, 4, 4, rng), noise(size, 16, 16, rng)
    step = size // count
    rows = []
    for y in range(size):
        row = bytearray()
        for x in range(size):
            joint = min(x % step, step - 1 - x % step, y % step, step - 1 - y % step) < 1
            vein = 1 - 0.35 * math.exp(-60 * (a[y][x] + 0.35 * b[y][x]) ** 2)
            color = one if (x // step + y // step) % 2 else two
            row += bytes(tone((0.2, 0.19, 0.18) if joint else color, 1 if joint else round(32 * vein * (1 + 0.05 * b[y][x])) / 32))
        rows.append(bytes(row))
    return png(size, size, rows)


def peel(size=128, seed=3):
    """Normal map of an orange's skin."""
    rng = random.Random(seed)
    a, b = noise(size, 32, 32, rng), noise(size, 64, 64, rng)
    height = [[-max(0.0, p) ** 2 * 0.9 + 0.15 * q for p, q in zip(x, y)] for x, y in zip(a, b)]
    return png(size, size, normal_rows(height, size, 1.3))


def glaze(size=256):
    """Base colour of a glazed band pattern: diagonal stripes of three colours that tile."""
    colors = ((0.04, 0.26, 0.30), (0.04, 0.26, 0.30), (0.72, 0.66, 0.52), (0.62, 0.16, 0.06), (0.72, 0.66, 0.52), (0.04, 0.26, 0.30))
    count = len(colors)

    def shade(t):
        f = t * count
        k, s = int(f), min(1.0, max(0.0, (f % 1 - 0.5) * size / count / 3 + 0.5))
        a, b = colors[k % count], colors[(k + 1) % count]
        return bytes(tone([p + (q - p) * s for p, q in zip(a, b)], 1.0))

    line = [shade(i / size) for i in range(size)]
    return png(size, size, [b"".join(line[(x + y) % size] for x in range(size)) for y in range(size)])


def cloth(size=128, seed=9):
    """Base colour of a woven check."""
    rng = random.Random(seed)
    wear = noise(size, 32, 32, rng)
    rows = []
    for y in range(size):
        row = bytearray()
        for x in range(size):
            red = ((x * 4 // size) % 2 + (y * 4 // size) % 2) / 2
            thread = 1 - 0.10 * ((x + y) % 2) + 0.05 * wear[y][x]
            row += bytes(tone((0.70 - 0.20 * red, 0.68 - 0.60 * red, 0.62 - 0.55 * red), round(40 * thread) / 40))
        rows.append(bytes(row))
    return png(size, size, rows)


def lantern(width=128, seed=2):
    """Emission of a paper lantern: bright between its ribs, warmer and dimmer towards both ends."""
    rng = random.Random(seed)
    fibre = noise(width, 24, 24, rng)
    rows = []
    for y in range(width):
        fall = math.sin(math.pi * (y + 0.5) / width) ** 0.7
        rib = 0.35 if y % 16 < 2 else 1.0
        rows.append(b"".join(bytes(tone((1.0, 0.55 + 0.35 * fall, 0.15 + 0.5 * fall), (0.3 + 0.65 * fall) * rib * (1 + 0.12 * fibre[y][x]))) for x in range(width)))
    return png(width, width, rows)
