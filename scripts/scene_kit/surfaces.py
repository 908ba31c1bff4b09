"""The five scenes on which the sampling of materials is measured (scripts/peers/variance.py): one sweep of paper, the same
softboxes, other surfaces. Only what Blender's importer reads as this program does; no light but emissive panels, which
are far enough for every place to get about the same from each: how a renderer chooses among lamps shall not count."""
import math
import random

from .gltf_file import GltfFile
from .pictures import byte, cloth, noise, planks, png, tone
from .rooms import flat_panel
from .shapes import arc, block, extruded, lathe, panel, sphere
from .vector import add, cross, scale, sub, turn, unit

AROUND = 40
CENTRE = (0.0, 0.3, 0.0)


def studio(stem, sky=False, floor=None):
    """A sweep under a large softbox from the left, a small bright one from the right and, with `sky`, a wide weak one above."""
    g = GltfFile(stem)
    paper = floor(g) if floor else g.matte("paper", (0.46, 0.45, 0.44))
    profile = [(4.0, 0.0), (1.0, 0.0), (-0.6, 0.0)]
    profile += [(-0.6 - math.sin(math.radians(a)), 1 - math.cos(math.radians(a))) for a in range(10, 90, 10)] + [(-1.6, 1.0), (-1.6, 2.8)]
    sweep = extruded(profile, 7.0)
    sweep.uvs = [(x, y - z) for x, y, z in sweep.positions]
    put(g, "sweep", sweep, paper)
    softbox(g, "fill", (-4.6, 2.2, 2.6), 2.2, (22.0, 26.0, 32.0))
    softbox(g, "key", (2.6, 4.8, 2.2), 0.9, (68.0, 60.0, 50.0))
    if sky:
        softbox(g, "sky", (0.3, 8.5, 0.6), 9.0, (0.9, 1.0, 1.2))
    g.camera("camera", (0.0, 1.25, 3.3), (0.0, 0.33, 0.0), 26)
    return g


def softbox(g, name, middle, side, nits):
    """A square lamp that faces the things."""
    facing = unit(sub(CENTRE, middle))
    right = unit(cross((0.0, 1.0, 0.0), facing))
    up = cross(facing, right)
    corner = sub(middle, scale(add(right, up), side / 2))
    put(g, name, flat_panel(corner, scale(right, side), scale(up, side)), g.lamp(name, nits))


def put(g, name, shape, material, **where):
    return g.node(name, g.mesh(name, (g.geometry(shape), material)), **where)


def rows(g, ball, looks, size=0.29):
    """Balls in two rows, from left to right and from front to back."""
    half = (len(looks) + 1) // 2
    for i, material in enumerate(looks):
        row, column = divmod(i, half)
        x = (column - (half - 1) / 2) * 2.25 * size
        put(g, f"ball {i + 1}", ball, material, at=(x, size, 0.55 - row * 0.95), size=size)


def brushed():
    """Anisotropic metals: streaks of roughness 0.2 to 0.5 along and across, on a brushed plate."""
    g = studio("brushed")

    def look(name, color, roughness, strength, degrees=0.0):
        stretched = {"anisotropyStrength": strength, "anisotropyRotation": round(math.radians(degrees), 6)}
        return g.material(name, color, metallic=1.0, roughness=roughness, more={"KHR_materials_anisotropy": stretched})

    steel, copper, gold = (0.56, 0.57, 0.58), (0.955, 0.638, 0.538), (1.0, 0.766, 0.336)
    rows(g, sphere(1.0, AROUND, (2, 1)), [
        look("steel along", steel, 0.25, 0.8), look("copper along", copper, 0.4, 0.6), look("gold along", gold, 0.2, 0.5),
        look("steel across", steel, 0.25, 0.8, 90), look("copper slanting", copper, 0.5, 0.9, 45), look("gold round", gold, 0.3, 0.0),
    ])
    put(g, "plate", panel((-1.0, 0.004, 1.0), (2.0, 0, 0), (0, 0, -0.42)), look("plate", steel, 0.3, 0.7))
    disc = lathe([[(0, 0.02), (0.1, 0.02), (0.2, 0.02), (0.29, 0.02)][::-1]], 48)
    put(g, "disc", disc, look("disc", copper, 0.3, 0.8), at=(0, 0.7, -1.2), turn=turn((1, 0, 0), 70))
    return g


def flakes(size=64, seed=21):
    """Metallic-roughness of flakes in lacquer: roughness 0.15 to 0.55 in small cells, all metal."""
    rng = random.Random(seed)
    cells = [[0.15 + 0.4 * rng.random() for _ in range(size // 4)] for _ in range(size // 4)]
    return png(size, size, [b"".join(bytes((255, byte(cells[y // 4][x // 4]), 255)) for x in range(size)) for y in range(size)])


def lacquer():
    """Coats: over rough colours, over flakes of metal, over wood, smooth and rough."""
    g = studio("lacquer")

    def look(name, color, roughness, metallic=0.0, coat=1.0, coat_roughness=0.03, **more):
        over = {"KHR_materials_clearcoat": {"clearcoatFactor": coat, "clearcoatRoughnessFactor": coat_roughness}}
        return g.material(name, color, metallic=metallic, roughness=roughness, more=over, **more)

    flake = g.texture("flakes_metal_rough", flakes())
    rows(g, sphere(1.0, AROUND, (4, 2)).without("tangents"), [
        look("red", (0.5, 0.02, 0.015), 0.6), look("flakes", (0.62, 0.30, 0.06), 1.0, 1.0, metal_rough=flake), look("wood", (1.0, 1.0, 1.0), 0.5, base=g.texture("wood_color", planks(128, 4))),
        look("satin blue", (0.03, 0.08, 0.4), 0.6, coat_roughness=0.25), look("thin coat on iron", (0.56, 0.57, 0.58), 0.5, 1.0, coat=0.5), look("white", (0.8, 0.8, 0.78), 0.9, coat_roughness=0.1),
    ])
    put(g, "shelf", block((-1.1, 0, 0.88), (1.1, 0.03, 1.05)), look("black", (0.01, 0.01, 0.012), 0.4))
    return g


def cloth_scene():
    """Sheen: velvet, felt and woven cloth, with textures, on a woven floor."""
    def woven(g):
        return g.material("weave", roughness=0.9, base=g.texture("weave_color", cloth()), more=fuzz((0.25, 0.25, 0.3), 0.5))

    def fuzz(color, roughness):
        return {"KHR_materials_sheen": {"sheenColorFactor": list(color), "sheenRoughnessFactor": roughness}}

    g = studio("cloth", floor=woven)
    weave = g.doc["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"]

    def look(name, color, sheen, fuzziness, roughness=1.0, **more):
        return g.material(name, color, roughness=roughness, more=fuzz(sheen, fuzziness), **more)

    felt = [b"".join(bytes(tone((0.5, 0.42, 0.3), round(32 * (1 + 0.25 * v)) / 32)) for v in row) for row in noise(64, 32, 32, random.Random(4))]
    rows(g, sphere(1.0, AROUND, (4, 2)).without("tangents"), [
        look("velvet", (0.09, 0.01, 0.05), (0.8, 0.35, 0.5), 0.3), look("felt", (1, 1, 1), (0.4, 0.4, 0.4), 0.6, base=g.texture("felt_color", png(64, 64, felt))), look("woven", (1, 1, 1), (0.5, 0.5, 0.5), 0.4, 0.8, base=weave),
        look("satin", (0.05, 0.2, 0.3), (0.5, 0.7, 0.8), 0.2, 0.4), look("dust", (0.35, 0.3, 0.25), (0.9, 0.85, 0.8), 0.9), look("moss", (0.06, 0.12, 0.03), (0.3, 0.5, 0.2), 0.5),
    ])
    return g


def frosted():
    """Rough glass: upright panes, clear and coloured balls, with matte things behind."""
    g = studio("frosted", sky=True)

    def look(name, roughness, ior=1.5, tint=(1, 1, 1), distance=0.5):
        inside = {"thicknessFactor": 1.0}
        if min(tint) < 1:
            inside.update(attenuationColor=list(tint), attenuationDistance=distance)
        return g.material(name, roughness=roughness, more={"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": ior}, "KHR_materials_volume": inside})

    rows(g, sphere(1.0, AROUND).without("uvs", "tangents"), [look("ball 0.15", 0.15), look("amber", 0.25, 1.45, (0.9, 0.55, 0.15)), look("green", 0.4, 1.6, (0.3, 0.8, 0.4)), look("ball 0.6", 0.6)], 0.27)
    for i, roughness in enumerate((0.15, 0.3, 0.5)):
        x = 0.9 * (i - 1)
        put(g, f"pane {roughness}", block((x - 0.34, 0.005, -0.83), (x + 0.34, 0.95, -0.78)), look(f"pane {roughness}", roughness))
    for i, color in enumerate(((0.6, 0.08, 0.06), (0.7, 0.55, 0.1), (0.08, 0.2, 0.55))):
        put(g, f"post {i + 1}", block((-0.09, 0, -0.09), (0.09, 1.1, 0.09)), g.matte(f"post {i + 1}", color), at=(0.9 * (i - 1) + 0.1, 0, -1.05))
    return g


def gloss():
    """Glossy dielectrics and metals of roughness 0.05 to 0.6 under softboxes and a sky, on tiles of uneven gloss."""
    def tiled(g):
        rng = random.Random(6)
        cells = [[(0.08 + 0.4 * rng.random()) for _ in range(4)] for _ in range(4)]
        uneven = png(64, 64, [b"".join(bytes((255, byte(cells[y // 16][x // 16]), 0)) for x in range(64)) for y in range(64)])
        return g.material("tiles", (0.32, 0.31, 0.30), roughness=1.0, metal_rough=g.texture("tiles_metal_rough", uneven))

    g = studio("gloss", sky=True, floor=tiled)
    blue, gold = (0.04, 0.14, 0.46), (1.0, 0.766, 0.336)
    steps = (0.05, 0.2, 0.4, 0.6)
    looks = [g.material(f"plastic {r}", blue, roughness=r) for r in steps] + [g.material(f"gold {r}", gold, metallic=1.0, roughness=r) for r in steps]
    rows(g, sphere(1.0, AROUND).without("uvs", "tangents"), looks, 0.25)
    put(g, "rail", lathe([arc((0, 0), 1.0, -90, 90, 12)], 24).without("uvs", "tangents"), g.material("half metal", (0.7, 0.7, 0.72), metallic=0.5, roughness=0.3), at=(0, 0.1, 1.0), size=(0.9, 0.1, 0.1))
    return g
