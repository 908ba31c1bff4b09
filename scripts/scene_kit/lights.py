"""Example scenes with light sources as their subject: 200 lamps in a room, and punctual lights alone."""
import math
import random

from .gltf_file import GltfFile
from .rooms import FLAT, flat_panel
from .shapes import block, extruded, icosphere, lathe, sphere, torus, tube
from .vector import turn


def lights():
    """A hall with 128 small glowing balls on strings and 72 point lights just above its floor."""
    g = GltfFile("lights")
    rng = random.Random(200)
    paint = g.matte("paint", (0.30, 0.32, 0.42))
    floor = g.material("floor", (0.46, 0.45, 0.44), roughness=0.4)
    dark = g.matte("cable", (0.04, 0.04, 0.04))
    colors = {"warm": (1.0, 0.62, 0.26), "amber": (1.0, 0.42, 0.08), "rose": (1.0, 0.22, 0.3), "white": (1.0, 0.92, 0.8), "aqua": (0.2, 0.8, 0.9), "blue": (0.22, 0.4, 1.0)}

    def put(name, shape, material, index="u8", layout="planar", **where):
        return g.node(name, g.mesh(name, (g.geometry(shape, index, layout), material)), **where)

    w, h, back, front = 3.4, 3.0, -4.5, 3.5
    depth = front - back
    put("floor", flat_panel((-w, 0, front), (2 * w, 0, 0), (0, 0, -depth)), floor)
    put("ceiling", flat_panel((-w, h, back), (2 * w, 0, 0), (0, 0, depth)), paint)
    put("back wall", flat_panel((-w, 0, back), (2 * w, 0, 0), (0, h, 0)), paint)
    put("front wall", flat_panel((w, 0, front), (-2 * w, 0, 0), (0, h, 0)), paint)
    put("left wall", flat_panel((-w, 0, front), (0, 0, -depth), (0, h, 0)), paint)
    put("right wall", flat_panel((w, 0, back), (0, 0, depth), (0, h, 0)), paint)

    small, fine = g.geometry(icosphere(1.0, 0), "u8"), g.geometry(icosphere(1.0, 1), "u8")
    bulbs = []
    for name, color in colors.items():
        for level, nits in (("dim", 16.0), ("bright", 40.0)):
            glow = g.lamp(f"{name} {level}", tuple(nits * c for c in color))
            bulbs.append(g.mesh(f"bulb {name} {level}", (fine if level == "bright" else small, glow)))

    def hang(x):
        return 2.78 - 0.62 * (1 - (x / w) ** 2)

    cable = g.mesh("cable", (g.geometry(tube([(x / 16 * w, hang(x / 16 * w), 0.0) for x in range(-16, 17)], 0.008, 5), "u8", "interleaved"), dark))
    for s in range(8):
        string = g.node(f"string {s + 1}", at=(0, 0.12 * (s % 2), back + 0.55 + s * 0.82))
        g.node(f"cable {s + 1}", cable, parent=string)
        for b in range(16):
            x = (b + 0.5) / 16 * 2 * w - w
            r = 0.032 + 0.03 * rng.random()
            mesh = bulbs[int(rng.random() * len(bulbs))]
            g.node(f"bulb {s + 1}.{b + 1}", mesh, at=(x, hang(x) - r - 0.012, 0), turn=turn((0, 1, 0), 360 * rng.random()), size=r, parent=string)

    for i in range(12):
        for j in range(6):
            hue = (i / 12 + 0.07 * j) % 1.0
            color = tuple(0.12 + 0.88 * (0.5 + 0.5 * math.cos(2 * math.pi * (hue - k / 3))) ** 1.5 for k in range(3))
            x, z = -2.95 + j * 1.18, back + 0.4 + i * 0.6
            g.light(f"point {i + 1}.{j + 1}", "point", 0.04 + 0.11 * rng.random(), color, at=(x + 0.2 * (i % 2), 0.1 + 0.1 * rng.random(), z))

    porcelain = g.material("porcelain", (0.75, 0.74, 0.72), roughness=0.12)
    gold = g.material("gold", (1.0, 0.77, 0.34), metallic=1.0, roughness=0.2)
    ball = sphere(1.0, 48).without("uvs", "tangents")
    ball_geometry = g.geometry(ball, "u16", "interleaved")
    g.node("porcelain ball", g.mesh("porcelain ball", (ball_geometry, porcelain)), at=(-1.15, 0.55, -1.1), size=0.55)
    g.node("gold ball", g.mesh("gold ball", (ball_geometry, gold)), at=(1.5, 0.42, -0.25), size=0.42)
    put("ring", torus(0.55, 0.16, 64, 24).without("uvs", "tangents"), porcelain, "u16", "padded", at=(0.5, 0.68, -2.65), turn=turn((1, 0.3, 0), 74))
    column = g.mesh("column", (g.geometry(block((-0.5, 0, -0.5), (0.5, 1, 0.5)), "u8"), paint))
    for name, x, z, tall in (("column left", -2.5, -3.2, 1.9), ("column right", 2.5, -3.0, 1.5), ("block", -2.4, 0.4, 0.5)):
        # One matrix per column: scale, then a turn about Y, then a place.
        a, s = 0.35, 0.5
        g.node(name, column, matrix=[s * math.cos(a), 0, -s * math.sin(a), 0, 0, tall, 0, 0, s * math.sin(a), 0, s * math.cos(a), 0, x, 0, z, 1])
    g.camera("camera", (0.0, 1.55, 3.2), (0.0, 1.12, -1.5), 50)
    return g


def punctual():
    """A photographer's sweep lit by a point light, two spots (a soft and a hard cone) and a faint directional light."""
    g = GltfFile("punctual")
    paper = g.matte("paper", (0.6, 0.58, 0.55))
    red = g.material("red lacquer", (0.6, 0.06, 0.04), roughness=0.25)
    cream = g.material("cream clay", (0.72, 0.62, 0.46), roughness=0.8)
    teal = g.material("teal satin", (0.05, 0.34, 0.36), roughness=0.45)
    brass = g.material("brushed brass", (0.89, 0.71, 0.36), metallic=1.0, roughness=0.45)

    def put(name, shape, material, index="u16", layout="interleaved", **where):
        return g.node(name, g.mesh(name, (g.geometry(shape.without("uvs", "tangents"), index, layout), material)), **where)

    # Floor, a quarter circle of 1 m, wall.
    profile = [(5.0, 0.0), (2.0, 0.0), (-0.6, 0.0)]
    profile += [(-0.6 - math.sin(math.radians(a)), 1 - math.cos(math.radians(a))) for a in range(5, 90, 5)] + [(-1.6, 1.0), (-1.6, 2.6), (-1.6, 4.5)]
    put("sweep", extruded(profile, 12.0), paper, "u8", "padded")
    put("ball", sphere(0.42, 64), red, at=(-0.95, 0.42, 0.1))
    cone = lathe([[(0, 0), (0.4, 0)], [(0.4, 0), (0.3, 0.26), (0.2, 0.52), (0.1, 0.78), (0.02, 0.988), (0.012, 1.0), (0, 1.004)]], 64)
    put("cone", cone, cream, at=(0.12, 0, -0.35))
    put("box", block((-0.26, 0, -0.26), (0.26, 0.52, 0.26)), teal, "u8", at=(0.98, 0, 0.1), turn=turn((0, 1, 0), 28))
    put("ring", torus(0.27, 0.085, 72, 28), brass, "u16", at=(0.98, 0.605, 0.1))
    put("small ball", sphere(0.14, 48), cream, layout="padded", at=(-0.22, 0.14, 0.72))
    g.light("soft warm spot", "spot", 85.0, (1.0, 0.8, 0.55), at=(-2.4, 3.4, 2.4), target=(-0.5, 0.3, 0.0), spot=(6, 17))
    g.light("hard blue spot", "spot", 52.0, (0.35, 0.55, 1.0), at=(2.6, 2.9, 1.9), target=(0.75, 0.35, -0.1), spot=(12.0, 12.5))
    g.light("point lamp", "point", 2.4, (1.0, 0.72, 0.42), at=(0.35, 0.75, 0.95))
    g.light("moon", "directional", 0.75, (0.75, 0.85, 1.0), at=(0.0, 4.0, 3.0), target=(0.9, 0.0, -0.4))
    g.camera("camera", (0.25, 1.35, 4.1), (0.0, 0.5, 0), 32)
    return g
