"""Example scenes with materials as their subject: spheres of metal, and a still life."""
from .gltf_file import GltfFile
from .pictures import cloth, lantern, peel, planks, tiles
from .rooms import flat_panel
from .shapes import arc, block, box, joined, lathe, panel, smooth_run, sphere
from .vector import turn


def metals():
    """Four steps of six spheres: gold, copper, iron, blue plastic; roughness 0.05 to 1 from left to right."""
    g = GltfFile("metals")
    step = g.matte("step", (0.42, 0.42, 0.43))
    stone = g.material("stone tiles", roughness=0.3, base=g.texture("tiles_color", tiles()))
    wall = g.matte("wall", (0.34, 0.34, 0.36))
    # Base colours of metals: linear F0 of gold, copper and iron; the last row is a dielectric.
    rows = (("gold", (1.0, 0.766, 0.336), 1.0), ("copper", (0.955, 0.638, 0.538), 1.0), ("iron", (0.56, 0.57, 0.58), 1.0), ("plastic", (0.04, 0.14, 0.46), 0.0))
    sweep = (0.05, 0.15, 0.3, 0.5, 0.75, 1.0)

    def put(name, shape, material, index="u8"):
        return g.node(name, g.mesh(name, (g.geometry(shape, index), material)))

    ball = g.geometry(sphere(0.2, 72).without("uvs", "tangents"), "u32", "interleaved")
    stage = g.node("stage", at=(0, 0, 0))
    for r, (name, color, metallic) in enumerate(rows):
        rise, z = 0.26 * (3 - r), 0.46 * (r - 1.5)
        if rise:
            g.node(f"step {name}", g.mesh(f"step {name}", (g.geometry(block((-1.55, 0, z - 0.23), (1.55, rise, z + 0.23)), "u8"), step)), parent=stage)
        for c, roughness in enumerate(sweep):
            look = g.material(f"{name} {roughness}", color, metallic=metallic, roughness=roughness)
            g.node(f"{name} {roughness}", g.mesh(f"{name} {roughness}", (ball, look)), at=(0.5 * (c - 2.5), rise + 0.2, z), parent=stage)
    w, h, back, front = 3.2, 3.4, -2.2, 4.6
    depth = front - back
    put("floor", panel((-w, 0, front), (2 * w, 0, 0), (0, 0, -depth), 0.9).without("tangents"), stone)
    put("back wall", flat_panel((-w, 0, back), (2 * w, 0, 0), (0, h, 0)), wall)
    put("front wall", flat_panel((w, 0, front), (-2 * w, 0, 0), (0, h, 0)), wall)
    put("left wall", flat_panel((-w, 0, front), (0, 0, -depth), (0, h, 0)), wall)
    put("right wall", flat_panel((w, 0, back), (0, 0, depth), (0, h, 0)), wall)
    put("ceiling", flat_panel((-w, h, back), (2 * w, 0, 0), (0, 0, depth)), wall)
    # Softboxes hang 5 cm in front of walls and ceiling.
    put("softbox above", flat_panel((-1.3, h - 0.05, -0.6), (2.6, 0, 0), (0, 0, 1.5)), g.lamp("softbox above", (9.5, 9.2, 8.5)))
    put("softbox left", flat_panel((-w + 0.05, 0.3, 2.2), (0, 0, -2.2), (0, 2.5, 0)), g.lamp("softbox left", (8.0, 6.8, 5.2)))
    put("softbox right", flat_panel((w - 0.05, 0.6, 0.2), (0, 0, 0.9), (0, 2.2, 0)), g.lamp("softbox right", (5.0, 6.4, 8.5)))
    put("softbox behind camera", flat_panel((1.5, 1.9, front - 0.05), (-3.0, 0, 0), (0, 1.1, 0)), g.lamp("softbox behind camera", (3.0, 3.0, 3.0)))
    g.camera("camera", (0.0, 2.05, 4.1), (0.0, 0.56, 0), 29)
    return g


def stilllife():
    """A table with a bowl of oranges, a bottle, a pewter cup, a book and a paper lantern; one .glb with its pictures inside."""
    g = GltfFile("stilllife", binary=True)
    wood = g.material("table top", roughness=0.38, base=g.texture("wood_color", planks(256, 5, 17, (0.12, 0.05, 0.02), (0.36, 0.18, 0.075))))
    check = g.matte("cloth", (1.0, 1.0, 1.0), base=g.texture("cloth_color", cloth()))
    orange = g.material("orange peel", (0.86, 0.29, 0.02), roughness=0.42, normal=g.texture("peel_normal", peel()))
    paper = g.material("paper lantern", (0.5, 0.45, 0.35), specular=0.0, emission=(6.0, 6.0, 6.0), emissive=g.texture("lantern_glow", lantern()))
    glaze = g.material("blue glaze", (0.08, 0.16, 0.32), roughness=0.16)
    bottle_glass = g.material("dark bottle", (0.015, 0.05, 0.03), roughness=0.06)
    cork = g.matte("cork", (0.45, 0.29, 0.16))
    pewter = g.material("pewter", (0.62, 0.61, 0.58), metallic=1.0, roughness=0.22)
    apple_skin = g.material("apple", (0.42, 0.035, 0.03), roughness=0.28)
    linen = g.material("book cover", (0.11, 0.2, 0.16), roughness=0.75)
    pages = g.matte("pages", (0.72, 0.67, 0.55))
    wall = g.matte("wall", (0.44, 0.40, 0.36))
    window = g.lamp("window", (15.0, 16.0, 17.5))

    def put(name, shape, material, index="u16", layout="planar", **where):
        return g.node(name, g.mesh(name, (g.geometry(shape, index, layout), material)), **where)

    w, h, back, front = 1.6, 2.6, -0.75, 2.2
    depth = front - back
    put("back wall", flat_panel((-w, 0, back), (2 * w, 0, 0), (0, h, 0)), wall, "u8")
    put("front wall", flat_panel((w, 0, front), (-2 * w, 0, 0), (0, h, 0)), wall, "u8")
    put("left wall", flat_panel((-w, 0, front), (0, 0, -depth), (0, h, 0)), wall, "u8")
    put("right wall", flat_panel((w, 0, back), (0, 0, depth), (0, h, 0)), wall, "u8")
    put("ceiling", flat_panel((-w, h, back), (2 * w, 0, 0), (0, 0, depth)), wall, "u8")
    put("floor", flat_panel((-w, 0, front), (2 * w, 0, 0), (0, 0, -depth)), wall, "u8")
    put("window", flat_panel((-w + 0.03, 0.95, 1.25), (0, 0, -1.15), (0, 1.2, 0)), window, "u8")

    table = g.node("table", at=(0, 0.75, 0))
    put("table top", box((-0.95, -0.04, -0.5), (0.95, 0, 0.55), 1.1).without("tangents"), wood, "u8", "interleaved", parent=table)
    put("cloth", panel((-0.2, 0.002, 0.24), (0.4, 0, 0), (0, 0, -0.4), 5.0).without("tangents"), check, "u8", "interleaved", parent=table, at=(-0.12, 0, 0.08), turn=turn((0, 1, 0), 14))

    bowl = lathe([
        [(0, 0), (0.06, 0)], [(0.06, 0), (0.058, 0.012)],
        smooth_run([(0.058, 0.012), (0.11, 0.04), (0.15, 0.09), (0.158, 0.115)], 8), arc((0.154, 0.115), 0.004, 0, 180, 6),
        smooth_run([(0.15, 0.115), (0.142, 0.09), (0.1, 0.046), (0.05, 0.022), (0.0, 0.018)], 8),
    ], 72).without("uvs", "tangents")
    put("bowl", bowl, glaze, layout="interleaved", parent=table, at=(-0.14, 0.003, 0.05))
    fruit = g.mesh("orange", (g.geometry(sphere(1.0, 48, (6, 3)), "u16", "interleaved"), orange))
    for name, at, r, lean in (("orange 1", (-0.205, 0.1, 0.075), 0.056, 20), ("orange 2", (-0.082, 0.098, 0.075), 0.054, -35), ("orange 3", (-0.145, 0.1, -0.025), 0.055, 70), ("orange 4", (0.16, 0.055, 0.26), 0.055, 110)):
        g.node(name, fruit, at=at, turn=turn((1, 0.2, 0.6), lean), size=r, parent=table)
    apple = lathe([smooth_run([(0, 0.016), (0.014, 0.006), (0.032, 0.002), (0.05, 0.02), (0.058, 0.052), (0.05, 0.086), (0.03, 0.099), (0.012, 0.09), (0, 0.078)], 8)], 64).without("uvs", "tangents")
    put("apple", apple, apple_skin, layout="padded", parent=table, at=(0.055, 0.0, 0.17))
    bottle = lathe([
        [(0, 0), (0.047, 0)],
        arc((0.047, 0.006), 0.006, -90, 0, 6) + smooth_run([(0.053, 0.14), (0.053, 0.17), (0.05, 0.2), (0.03, 0.235), (0.018, 0.265), (0.0165, 0.295), (0.0165, 0.33)], 6),
        [(0.0165, 0.33), (0.02, 0.331)], [(0.02, 0.331), (0.02, 0.345)], [(0.02, 0.345), (0.012, 0.345)],
    ], 64).without("uvs", "tangents")
    put("bottle", bottle, bottle_glass, parent=table, at=(-0.37, 0, -0.14))
    put("cork", lathe([[(0.0118, 0.335), (0.0125, 0.362)], [(0.0125, 0.362), (0, 0.362)]], 32).without("uvs", "tangents"), cork, "u8", parent=table, at=(-0.37, 0, -0.14))
    cup = lathe([
        [(0, 0), (0.04, 0)], smooth_run([(0.04, 0), (0.036, 0.012), (0.03, 0.02), (0.038, 0.04), (0.046, 0.1), (0.05, 0.13)], 6), arc((0.0485, 0.13), 0.0015, 0, 180, 4),
        smooth_run([(0.047, 0.13), (0.043, 0.1), (0.034, 0.045), (0, 0.04)], 6),
    ], 64).without("uvs", "tangents")
    put("cup", cup, pewter, layout="interleaved", parent=table, at=(0.34, 0, 0.13))
    book = g.mesh("book",
                  (g.geometry(joined(block((-0.11, 0, -0.08), (0.11, 0.005, 0.08)), block((-0.11, 0.031, -0.08), (0.11, 0.036, 0.08)), block((-0.11, 0.005, -0.08), (-0.105, 0.031, 0.08))), "u8"), linen),
                  (g.geometry(block((-0.105, 0.0051, -0.076), (0.104, 0.0309, 0.076)), "u8"), pages))
    g.node("book", book, at=(0.33, 0, -0.12), turn=turn((0, 1, 0), 24), parent=table)
    lamp = lathe([[(0.05, 0.012), (0.062, 0.03), (0.084, 0.07), (0.094, 0.115), (0.094, 0.125), (0.084, 0.17), (0.062, 0.21), (0.05, 0.228)]], 64, (4, 1)).without("tangents")
    stand = g.node("lantern", at=(0.31, 0.036, -0.13), parent=table)
    put("lantern shade", lamp, paper, layout="interleaved", parent=stand)
    rims = joined(lathe([[(0, 0), (0.052, 0)], [(0.052, 0), (0.052, 0.014)], [(0.052, 0.014), (0, 0.014)]], 48), lathe([[(0, 0.226), (0.052, 0.226)], [(0.052, 0.226), (0.052, 0.236)], [(0.052, 0.236), (0, 0.236)]], 48)).without("uvs", "tangents")
    put("lantern rims", rims, cork, parent=stand)
    g.camera("camera", (0.06, 1.17, 1.25), (-0.02, 0.865, 0.0), 30)
    return g
