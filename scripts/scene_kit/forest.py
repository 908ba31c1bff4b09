"""Example scene with instances as its subject: one spruce, 32,400 times."""
import math
import random
import struct

from .gltf_file import GltfFile, tidy
from .rooms import flat_panel
from .shapes import Shape, lathe
from .vector import turn

# Trees a patch, and patches along a side: every patch is the same accessor, turned and mirrored.
TREES, ACROSS, PATCH = 400, 9, 34.0


def skirt(bottom, top, inner, outer, spokes, rng):
    """A ring of drooping branches: a cone whose rim is jagged, and its underside."""
    rim = []
    for i in range(2 * spokes):
        angle = math.pi * i / spokes + 0.1 * rng.random()
        reach = outer * (0.82 + 0.3 * rng.random()) if i % 2 else inner + 0.35 * (outer - inner)
        rim.append((reach * math.cos(angle), bottom - 0.25 * reach * (i % 2), -reach * math.sin(angle)))
    hub = [(0.0, top, 0.0), (0.0, bottom + 0.25 * (top - bottom), 0.0)]
    n = len(rim)
    triangles = [t for i in range(n) for t in ((0, 2 + i, 2 + (i + 1) % n), (1, 2 + (i + 1) % n, 2 + i))]
    return Shape(hub + rim, triangles)


def spruce(layers=24, spokes=16):
    """A tree 6 m high about the y axis."""
    rng, out = random.Random(14), Shape([], [])
    for k in range(layers):
        low = 0.7 + 5.0 * (k / layers) ** 0.92
        reach = 1.35 * (1 - k / layers) ** 0.8 + 0.12
        part, base = skirt(low, low + 0.55, 0.1, reach, spokes, rng), len(out.positions)
        out.positions += part.positions
        out.triangles += [tuple(base + v for v in t) for t in part.triangles]
    return out


def instances(g, seed):
    """The accessors of one patch's places."""
    rng = random.Random(seed)
    cells = round(math.sqrt(TREES))
    places = [(((i % cells + rng.random()) / cells - 0.5) * PATCH, 0.0, ((i // cells + rng.random()) / cells - 0.5) * PATCH)
              for i in range(TREES)]
    turns = [turn((0, 1, 0), 360 * rng.random()) for _ in places]
    sizes = []
    for _ in places:
        s = 0.55 + 0.6 * rng.random()
        sizes.append((s, s * (0.85 + 0.4 * rng.random()), s))
    accessors = {}
    for name, rows, kind in (("TRANSLATION", places, "VEC3"), ("ROTATION", turns, "VEC4"), ("SCALE", sizes, "VEC3")):
        data = b"".join(struct.pack(f"<{len(row)}f", *tidy(row)) for row in rows)
        entry = {"bufferView": g._view(data), "componentType": 5126, "count": len(rows), "type": kind}
        accessors[name] = g._put("accessors", entry)
    return accessors


def forest():
    """A spruce wood seen from a hill: 32,400 places of one tree, some of them mirrored."""
    g = GltfFile("forest")
    needles = g.matte("needles", (0.06, 0.13, 0.05))
    bark = g.matte("bark", (0.12, 0.075, 0.05))
    moss = g.matte("moss", (0.10, 0.11, 0.05))
    trunk = lathe([[(0.13, 0.0), (0.02, 5.6)]], 6).without("uvs", "tangents", "normals")
    tree = g.mesh("spruce", (g.geometry(spruce(), "u16"), needles), (g.geometry(trunk, "u8"), bark))
    half = 0.5 * ACROSS * PATCH + 2
    g.node("ground", g.mesh("ground", (g.geometry(flat_panel((-half, 0, half), (2 * half, 0, 0), (0, 0, -2 * half)), "u8"), moss)))
    places, rng = instances(g, 41), random.Random(7)
    g.used.add("EXT_mesh_gpu_instancing")
    for k in range(ACROSS * ACROSS):
        at = ((k % ACROSS + 0.5) * PATCH - 0.5 * ACROSS * PATCH, 0, (k // ACROSS + 0.5) * PATCH - 0.5 * ACROSS * PATCH)
        mirrored = -1.0 if rng.random() < 0.5 else 1.0
        before = g.triangles
        g.node(f"patch {k + 1}", tree, at=at, turn=turn((0, 1, 0), 90 * int(4 * rng.random())), size=(mirrored, 1.0, 1.0),
               extensions={"EXT_mesh_gpu_instancing": {"attributes": places}})
        g.triangles += (TREES - 1) * (g.triangles - before)
    g.camera("hill", (-14, 13, half + 9), (4, 0.5, 30), 38)
    return g
