"""Example scenes with walls as their subject: the Cornell box, a brick wall, and a gallery with a torus knot."""
import math

from .gltf_file import GltfFile
from .pictures import bricks, glaze, planks
from .shapes import block, holed_panel, joined, lathe, panel, smooth_run, torus_knot
from .vector import turn

FLAT = ("normals", "uvs", "tangents")


def flat_panel(corner, right, up):
    return panel(corner, right, up).without(*FLAT)


def cornell():
    """The Cornell box: diffuse walls, two boxes, a lamp that fills a hole in the ceiling."""
    g = GltfFile("cornell")
    white = g.matte("white", (0.73, 0.73, 0.73))
    red = g.matte("red", (0.65, 0.05, 0.05))
    green = g.matte("green", (0.12, 0.45, 0.15))
    lamp = g.lamp("lamp", (34.0, 28.0, 19.5))

    def put(name, shape, material, **where):
        return g.node(name, g.mesh(name, (g.geometry(shape, "u8"), material)), **where)

    put("floor", flat_panel((-1, 0, 1), (2, 0, 0), (0, 0, -2)), white)
    put("ceiling", holed_panel((-1, 2, -1), (2, 0, 0), (0, 0, 2), (0.35, 0.65, 0.375, 0.625)), white)
    put("back wall", flat_panel((-1, 0, -1), (2, 0, 0), (0, 2, 0)), white)
    put("left wall", flat_panel((-1, 0, 1), (0, 0, -2), (0, 2, 0)), red)
    put("right wall", flat_panel((1, 0, -1), (0, 0, 2), (0, 2, 0)), green)
    put("lamp", flat_panel((-0.3, 2, -0.25), (0.6, 0, 0), (0, 0, 0.5)), lamp)
    # Both boxes are one mesh, told apart by their nodes.
    cube = g.mesh("box", (g.geometry(block((-0.5, 0, -0.5), (0.5, 1, 0.5)), "u8"), white))
    boxes = g.node("boxes")
    g.node("tall box", cube, at=(-0.34, 0, -0.3), turn=turn((0, 1, 0), 18), size=(0.58, 1.2, 0.58), parent=boxes)
    g.node("short box", cube, at=(0.36, 0, 0.32), turn=turn((0, 1, 0), -17), size=(0.58, 0.58, 0.58), parent=boxes)
    g.camera("front", (0, 1, 3.9), (0, 1, 0), 38, aspect=1.0)
    return g


def wall():
    """A normal-mapped brick wall in raking light from a window, a plank floor, a terracotta pot."""
    g = GltfFile("wall")
    base, rough, normal = bricks()
    brick = g.material("bricks", base=g.texture("bricks_color", base), metal_rough=g.texture("bricks_metal_rough", rough), normal=g.texture("bricks_normal", normal))
    floor = g.material("planks", roughness=0.42, base=g.texture("planks_color", planks()))
    plaster = g.matte("plaster", (0.66, 0.63, 0.58))
    sky = g.lamp("daylight", (21.0, 23.5, 27.0))
    bulb = g.lamp("warm ceiling light", (5.0, 3.8, 2.3))
    stone = g.material("limestone", (0.55, 0.52, 0.46), roughness=0.7)
    clay = g.material("terracotta", (0.52, 0.2, 0.1), roughness=0.65)

    def put(name, shape, material, layout="interleaved", index="u16"):
        return g.node(name, g.mesh(name, (g.geometry(shape, index, layout), material)))

    w, h, d = 2.4, 2.7, 4.6
    put("brick wall", panel((-w, 0, 0), (2 * w, 0, 0), (0, h, 0)), brick)
    # The pilaster's bricks run backwards: its tangents have w = -1.
    x0, x1, out = 1.0, 1.5, 0.16
    put("brick pilaster", joined(
        panel((x0, 0, out), (x1 - x0, 0, 0), (0, h, 0), mirrored=True, uv_at=(1.0, 0)),
        panel((x0, 0, 0), (0, 0, out), (0, h, 0), mirrored=True, uv_at=(1.0 + out, 0)),
        panel((x1, 0, out), (0, 0, -out), (0, h, 0), mirrored=True, uv_at=(1.0 - (x1 - x0), 0)),
    ), brick)
    put("floor", panel((-w, 0, d), (2 * w, 0, 0), (0, 0, -d), 0.8).without("tangents"), floor, "padded")
    left = holed_panel((-w, 0, d), (0, 0, -d), (0, h, 0), (1 - 1.25 / d, 1 - 0.3 / d, 0.65 / h, 2.25 / h))
    reveal = 0.14
    z0, z1, y0, y1 = 0.3, 1.25, 0.65, 2.25
    sides = [
        flat_panel((-w - reveal, y0, z1), (reveal, 0, 0), (0, 0, -(z1 - z0))), flat_panel((-w - reveal, y1, z0), (reveal, 0, 0), (0, 0, z1 - z0)),
        flat_panel((-w - reveal, y0, z0), (reveal, 0, 0), (0, y1 - y0, 0)), flat_panel((-w, y0, z1), (-reveal, 0, 0), (0, y1 - y0, 0)),
    ]
    put("window wall", joined(left, *sides), plaster, "planar", "u8")
    put("window", flat_panel((-w - reveal, y0, z1), (0, 0, -(z1 - z0)), (0, y1 - y0, 0)), sky, "planar", "u8")
    ceiling = holed_panel((-w, h, 0), (2 * w, 0, 0), (0, 0, d), (0.44, 0.56, 0.6, 0.7))
    put("ceiling", ceiling, plaster, "planar", "u8")
    put("ceiling light", flat_panel((-w + 0.44 * 2 * w, h, 0.6 * d), (0.12 * 2 * w, 0, 0), (0, 0, 0.1 * d)), bulb, "planar", "u8")
    put("right wall", flat_panel((w, 0, 0), (0, 0, d), (0, h, 0)), plaster, "planar", "u8")
    put("front wall", flat_panel((w, 0, d), (-2 * w, 0, 0), (0, h, 0)), plaster, "planar", "u8")
    put("bench", joined(block((-0.55, 0.4, 0.14), (0.75, 0.48, 0.56)), block((-0.42, 0, 0.2), (-0.3, 0.4, 0.5)), block((0.5, 0, 0.2), (0.62, 0.4, 0.5))), stone, "planar", "u8")
    pot = lathe([
        [(0, 0), (0.13, 0)],
        smooth_run([(0.13, 0), (0.2, 0.13), (0.225, 0.28), (0.17, 0.42), (0.125, 0.49), (0.155, 0.56)], 8),
        [(0.155, 0.56), (0.135, 0.56)],
        smooth_run([(0.135, 0.56), (0.108, 0.49), (0.15, 0.42), (0.2, 0.28), (0.17, 0.1), (0.0, 0.05)], 8),
    ], 64).without("uvs", "tangents")
    mesh = g.mesh("pot", (g.geometry(pot, "u16", "interleaved"), clay))
    g.node("pot on the floor", mesh, at=(-1.12, 0, 0.62))
    g.node("pot on the bench", mesh, at=(0.42, 0.48, 0.35), size=0.62)
    g.camera("camera", (0.62, 1.42, 3.95), (-0.22, 1.08, 0), 38)
    return g


def knot():
    """A glazed torus knot of 73,000 triangles on a plinth, under a ceiling light and a tall window of light."""
    g = GltfFile("knot")
    glazed = g.material("glazed ceramic", roughness=0.24, base=g.texture("glaze_color", glaze()))
    wall_paint = g.matte("wall paint", (0.52, 0.55, 0.58))
    back_paint = g.matte("back wall paint", (0.40, 0.27, 0.19))
    concrete = g.material("concrete", (0.40, 0.38, 0.36), roughness=0.55)
    plinth = g.matte("plinth", (0.72, 0.7, 0.67))
    lamp = g.lamp("ceiling lamp", (10.5, 9.8, 8.6))
    window = g.lamp("window", (5.2, 6.0, 7.0))

    def put(name, shape, material):
        return g.node(name, g.mesh(name, (g.geometry(shape, "u8"), material)))

    w, h, back, front = 3.0, 3.3, -2.2, 3.6
    depth = front - back
    put("floor", flat_panel((-w, 0, front), (2 * w, 0, 0), (0, 0, -depth)), concrete)
    put("ceiling", holed_panel((-w, h, back), (2 * w, 0, 0), (0, 0, depth), (0.3, 0.7, 0.35, 0.6)), wall_paint)
    put("ceiling lamp", flat_panel((-w + 0.3 * 2 * w, h, back + 0.35 * depth), (0.4 * 2 * w, 0, 0), (0, 0, 0.25 * depth)), lamp)
    put("back wall", flat_panel((-w, 0, back), (2 * w, 0, 0), (0, h, 0)), back_paint)
    put("front wall", flat_panel((w, 0, front), (-2 * w, 0, 0), (0, h, 0)), wall_paint)
    put("left wall", holed_panel((-w, 0, front), (0, 0, -depth), (0, h, 0), (0.3, 0.55, 0.2, 0.85)), wall_paint)
    put("window", flat_panel((-w, 0.2 * h, front - 0.3 * depth), (0, 0, -0.25 * depth), (0, 0.65 * h, 0)), window)
    put("right wall", flat_panel((w, 0, back), (0, 0, depth), (0, h, 0)), wall_paint)
    put("plinth", block((-0.36, 0, -0.36), (0.36, 0.5, 0.36)), plinth)

    def relief(u, v):
        # Ribs that wind once around the tube per eighth of the knot, with a slow swell.
        ribs = math.cos(2 * math.pi * (6 * v + 24 * u))
        return 1 + 0.10 * ribs + 0.05 * math.cos(2 * math.pi * (2 * v - 48 * u)) * ribs + 0.12 * math.cos(2 * math.pi * 3 * u)

    shape = torus_knot(2, 3, 0.5, 0.215, 0.125, 480, 76, relief)
    shape.uvs = [(8 * u, 2 * v) for u, v in shape.uvs]
    base = g.node("sculpture", at=(0, 0.5, 0))
    # Upright, its axis towards the camera; its lowest point sits on the plinth.
    lift = max(p[2] for p in shape.positions)
    g.node("torus knot", g.mesh("torus knot", (g.geometry(shape, "u16"), glazed)), at=(0, 0.95 * lift, 0), turn=turn((1, 0, 0), 90), size=0.95, parent=base)
    g.camera("camera", (0.8, 1.55, 3.3), (0.0, 1.18, 0), 37)
    return g
