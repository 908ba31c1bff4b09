"""The scene of the student's path tracer from which this project grew, made anew: every feature of its report in one room."""
import math

from .gltf_file import GltfFile
from .pictures import bricks, glaze, tiles
from .rooms import flat_panel
from .shapes import block, holed_panel, lathe, panel, sphere, torus_knot
from .vector import turn

# Cubic Bezier segments that share end points, (radius, height) in metres: up the outside from the middle of the foot,
# over the lip, and down the inside to the middle of its floor. The glass is to the left on the way up.
BOTTLE = (
    (0, 0), (0.10, 0), (0.20, 0), (0.26, 0.015),
    (0.30, 0.025), (0.31, 0.08), (0.31, 0.18),
    (0.31, 0.45), (0.31, 0.48), (0.25, 0.60),
    (0.17, 0.74), (0.10, 0.72), (0.10, 0.95),
    (0.10, 1.00), (0.122, 1.00), (0.122, 1.03),
    (0.122, 1.055), (0.075, 1.055), (0.075, 1.03),
    (0.075, 0.95), (0.075, 0.85), (0.075, 0.80),
    (0.075, 0.70), (0.15, 0.70), (0.22, 0.585),
    (0.275, 0.48), (0.28, 0.45), (0.28, 0.18),
    (0.28, 0.08), (0.26, 0.055), (0.20, 0.055),
    (0.10, 0.055), (0.05, 0.09), (0, 0.09),
)


def polyline(points, steps):
    """The curve as (r, y) points, `steps` a segment."""
    out = []
    for i in range(0, len(points) - 1, 3):
        p = points[i:i + 4]
        for s in range(steps):
            t = s / steps
            w = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t ** 3)
            out.append(tuple(sum(a * q[k] for a, q in zip(w, p)) for k in (0, 1)))
    return out + [points[-1]]


def seed():
    """A room with a tiled floor and a brick wall, a torus knot, a glass bottle, a mirror ball, and a ball in flight."""
    g = GltfFile("seed")
    base, rough, normal = bricks(size=256)
    brick = g.material("bricks", base=g.texture("bricks_color", base), metal_rough=g.texture("bricks_metal_rough", rough), normal=g.texture("bricks_normal", normal))
    floor = g.material("tiles", roughness=0.35, base=g.texture("tiles_color", tiles()))
    red = g.matte("red paint", (0.55, 0.09, 0.07))
    blue = g.matte("blue paint", (0.10, 0.17, 0.45))
    white = g.matte("ceiling paint", (0.72, 0.71, 0.69))
    stone = g.matte("plinth", (0.62, 0.6, 0.57))
    lamp = g.lamp("ceiling lamp", (16.0, 15.0, 13.5))
    mirror = g.material("mirror", (0.96, 0.96, 0.96), metallic=1.0, roughness=0.0)
    rubber = g.material("ball", (0.83, 0.33, 0.04), roughness=0.3)
    # The Disney BRDF of 2012, as the report had it; other viewers see metal and roughness.
    principled = g.material("glossy principled", roughness=0.3, metallic=0.15, base=g.texture("glaze_color", glaze()))
    g.doc["materials"][principled]["extras"] = {"prt_disney": 1, "prt_specular": 0.6, "prt_clearcoat": 0.8, "prt_clearcoat_gloss": 0.9, "prt_sheen": 0.2}
    glass = g.material("glass", roughness=0.0, more={
        "KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": 1.5},
        "KHR_materials_volume": {"thicknessFactor": 0.03, "attenuationColor": [0.72, 0.92, 0.80], "attenuationDistance": 0.35}})

    def put(name, shape, material, index="u16", **where):
        return g.node(name, g.mesh(name, (g.geometry(shape, index), material)), **where)

    w, h, back, front = 2.3, 2.7, -1.6, 4.2
    depth = front - back
    put("floor", panel((-w, 0, front), (2 * w, 0, 0), (0, 0, -depth), 0.9).without("tangents"), floor)
    put("back wall", panel((-w, 0, back), (2 * w, 0, 0), (0, h, 0)), brick)
    put("left wall", flat_panel((-w, 0, front), (0, 0, -depth), (0, h, 0)), red)
    put("right wall", flat_panel((w, 0, back), (0, 0, depth), (0, h, 0)), blue)
    put("front wall", flat_panel((w, 0, front), (-2 * w, 0, 0), (0, h, 0)), white)
    u0, u1, v0, v1 = 0.32, 0.68, 0.2, 0.42
    put("ceiling", holed_panel((-w, h, back), (2 * w, 0, 0), (0, 0, depth), (u0, u1, v0, v1)), white)
    put("ceiling lamp", flat_panel((-w + u0 * 2 * w, h, back + v0 * depth), ((u1 - u0) * 2 * w, 0, 0), (0, 0, (v1 - v0) * depth)), lamp)

    put("plinth", block((-0.4, 0, -0.4), (0.4, 0.42, 0.4)), stone, at=(-0.95, 0, -0.65))
    knot = torus_knot(2, 3, 0.5, 0.215, 0.125, 480, 76, lambda u, v: 1 + 0.08 * math.cos(2 * math.pi * (6 * v + 24 * u)))
    knot.uvs = [(8 * u, 2 * v) for u, v in knot.uvs]
    lift = max(p[2] for p in knot.positions)
    put("torus knot", knot, principled, at=(-0.95, 0.42 + 0.8 * lift, -0.65), turn=turn((1, 0, 0), 90), size=0.8)

    # Exact in this renderer; the mesh is what other viewers show.
    fallback = lathe([polyline(BOTTLE, 8)], 64).without("uvs", "tangents")
    bottle = g.mesh("bottle", (g.geometry(fallback), glass))
    points = [[round(r, 6), round(y, 6)] for r, y in BOTTLE]
    g.used.add("PRT_shape")
    g.node("bottle", bottle, at=(0.35, 0, 0.35), extensions={"PRT_shape": {"type": "revolution", "curve": "bezier", "points": points, "material": glass}})
    ball = sphere(1.0, 48).without("uvs", "tangents")
    g.node("mirror ball", g.mesh("mirror ball", (g.geometry(ball), mirror)), at=(-0.35, 0.3, 0.75), size=0.3,
           extensions={"PRT_shape": {"type": "sphere", "radius": 1.0, "material": mirror}})
    flying = g.node("flying ball", g.mesh("flying ball", (g.geometry(ball), rubber)), at=(1.3, 0.26, -0.15), size=0.26)
    # It bounces once a second: 4.9 m/s at the floor, 1.225 m up, and back.
    up, low = 4.9, 0.26
    times = (0.0, 0.5, 1.0)
    places = [(1.3, low + lift, -0.15) for lift in (0.0, 1.225, 0.0)]
    speeds = (((0, -up, 0), (0, up, 0)), ((0, 0, 0), (0, 0, 0)), ((0, -up, 0), (0, up, 0)))
    g.animation("bounce", flying, "translation", times, places, speeds)
    camera = g.camera("camera", (0.15, 1.35, 3.95), (0.05, 0.78, 0), 41)
    # The plane of the bottle is sharp; the shutter is open for a whole frame.
    g.doc["nodes"][camera]["extras"] = {"prt_f_stop": 1.4, "prt_focus_distance": 3.6, "prt_shutter": 1.0}
    return g
