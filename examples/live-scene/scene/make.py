#!/usr/bin/env python3
"""Makes chess.glb, the scene of this example: a game of chess in a garden at dusk, in metres.

    python3 examples/live-scene/scene/make.py

Needs nothing but Python's standard library, and writes the same bytes every time. Near, in focus and far are pieces on the
board; behind them stand a hedge and strings of small bright bulbs, which a lens out of focus makes into discs.
"""

import json
import math
import random
import struct
from pathlib import Path

SQUARE = 0.055
random.seed(7)


# Meshes: (vertices, triangles), a vertex being (position, normal).

def normalized(v):
    length = math.sqrt(sum(c * c for c in v)) or 1.0
    return tuple(c / length for c in v)


def joined(*meshes):
    vertices, triangles = [], []
    for v, t in meshes:
        triangles += [tuple(i + len(vertices) for i in triangle) for triangle in t]
        vertices += v
    return vertices, triangles


def moved(mesh, by):
    return [(tuple(a + b for a, b in zip(p, by)), n) for p, n in mesh[0]], mesh[1]


def turned(mesh, angle):
    """About the vertical axis."""
    c, s = math.cos(angle), math.sin(angle)
    turn = lambda v: (c * v[0] + s * v[2], v[1], c * v[2] - s * v[0])
    return [(turn(p), turn(n)) for p, n in mesh[0]], mesh[1]


def box(x, y, z):
    """From -x to x, 0 to y, -z to z."""
    vertices, triangles = [], []
    for axis in range(3):
        for sign in (-1, 1):
            n = tuple(sign if i == axis else 0 for i in range(3))
            u, w = (axis + 1) % 3, (axis + 2) % 3
            at = len(vertices)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = [0.0, 0.0, 0.0]
                p[axis], p[u], p[w] = sign, a * sign, b
                vertices.append(((p[0] * x, (p[1] + 1) / 2 * y, p[2] * z), n))
            triangles += [(at, at + 1, at + 2), (at, at + 2, at + 3)]
    return vertices, triangles


def lathe(profile, segments=20):
    """A profile of (radius, height), from below to above, turned about the vertical axis; bends above 46 degrees are edges."""
    directions = [normalized((b[0] - a[0], b[1] - a[1])) for a, b in zip(profile, profile[1:])]
    rings = []
    for i, point in enumerate(profile):
        before, after = directions[max(i - 1, 0)], directions[min(i, len(directions) - 1)]
        edge = before[0] * after[0] + before[1] * after[1] < math.cos(math.radians(46))
        mean = normalized((before[0] + after[0], before[1] + after[1]))
        rings.append([(point, d) for d in ((before, after) if edge else (mean,))])
    vertices, triangles = [], []
    row = []
    for ring in rings:
        first, last = None, None
        for (radius, height), (dr, dy) in ring:
            last = len(vertices)
            first = last if first is None else first
            for s in range(segments + 1):
                a = math.tau * s / segments
                c, si = math.cos(a), math.sin(a)
                vertices.append(((radius * c, height, radius * si), normalized((dy * c, -dr, dy * si))))
        row.append((first, last))
    for (_, low), (high, _) in zip(row, row[1:]):
        for s in range(segments):
            a, b, c, d = low + s, low + s + 1, high + s, high + s + 1
            triangles += [(a, c, b), (b, c, d)]
    flat = lambda t: len({vertices[i][0] for i in t}) < 3
    return vertices, [t for t in triangles if not flat(t)]


def arc(radius, x, y, start, end, steps):
    """Points on a circle about (x, y), between angles in degrees; 0 points outwards, 90 up."""
    angles = [math.radians(start + (end - start) * i / steps) for i in range(steps + 1)]
    return [(max(x + radius * math.cos(a), 0.0), y + radius * math.sin(a)) for a in angles]


def sphere(radius, steps, segments):
    return lathe(arc(radius, 0, 0, -90, 90, steps), segments)


def base(width):
    return (
        [(0, 0), (width, 0), (width, 0.004)] + arc(0.0025, width - 0.002, 0.0065, -60, 90, 2)
        + [(width * 0.78, 0.0105), (width * 0.74, 0.014)]
    )


def stem(width, top, height):
    """Concave, from a base's top to (top, height)."""
    low, n = (width * 0.74, 0.014), 5
    points = []
    for i in range(1, n + 1):
        t = i / n
        ease = 1 - (1 - t) ** 2.6
        points.append((low[0] + (top - low[0]) * ease, low[1] + (height - low[1]) * t))
    return points


def collar(radius, height):
    return [(radius * 0.7, height)] + arc(0.0016, radius, height + 0.0016, -90, 90, 2) + [(radius * 0.7, height + 0.0032)]


PAWN = lathe(base(0.0155) + stem(0.0155, 0.0055, 0.030) + collar(0.0095, 0.030) + arc(0.0088, 0, 0.0405, -58, 90, 7))
BISHOP = lathe(
    base(0.0175) + stem(0.0175, 0.006, 0.046) + collar(0.0105, 0.046) + [(0.006, 0.0495)]
    + [(0.0093 * math.sin(math.pi * t) ** 0.8 + 0.0004, 0.050 + 0.0195 * t) for t in (0.22, 0.36, 0.5, 0.64, 0.78, 0.9)]
    + arc(0.0026, 0, 0.0712, -60, 90, 4)
)
ROOK = joined(
    lathe(base(0.0175) + stem(0.0175, 0.0095, 0.036) + collar(0.0125, 0.036)
          + [(0.0095, 0.0395), (0.0128, 0.044), (0.0128, 0.049), (0.0092, 0.049), (0.0092, 0.046), (0, 0.046)]),
    *(turned(moved(box(0.0018, 0.005, 0.0042), (0.011, 0.0485, 0)), math.tau * i / 6) for i in range(6)),
)
QUEEN = joined(
    lathe(base(0.0195) + stem(0.0195, 0.0065, 0.060) + collar(0.0118, 0.058)
          + [(0.0062, 0.067), (0.0115, 0.0805), (0.0098, 0.0812)] + arc(0.0105, 0, 0.0775, 22, 70, 3)
          + arc(0.0032, 0, 0.0895, -55, 90, 4)),
    *(turned(moved(sphere(0.0019, 3, 5), (0.0105, 0.0812, 0)), math.tau * i / 8) for i in range(8)),
)
KING = joined(
    lathe(base(0.0205) + stem(0.0205, 0.007, 0.066) + collar(0.0124, 0.064)
          + [(0.0066, 0.073), (0.0112, 0.0885)] + arc(0.0118, 0, 0.0862, 12, 78, 3) + [(0, 0.098)]),
    moved(box(0.0016, 0.0125, 0.0016), (0, 0.097, 0)),
    moved(box(0.0048, 0.0032, 0.0016), (0, 0.1022, 0)),
)
BULB = sphere(1.0, 6, 10)
LEAVES = sphere(1.0, 6, 10)


# glTF.

class Gltf:
    def __init__(self):
        self.bytes = bytearray()
        self.views, self.accessors, self.meshes, self.materials, self.nodes = [], [], [], [], []
        self.shapes, self.names, self.kept = {}, {}, []

    def accessor(self, data, target, **rest):
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data), "target": target})
        self.bytes += data + b"\0" * (-len(data) % 4)
        self.accessors.append({"bufferView": len(self.views) - 1, **rest})
        return len(self.accessors) - 1

    def shape(self, mesh):
        """Vertices and indices; once for all materials that they have."""
        if id(mesh) not in self.shapes:
            self.kept.append(mesh)  # so that no other gets its id
            vertices, triangles = mesh
            positions = [p for p, _ in vertices]
            floats = lambda rows: b"".join(struct.pack("<3f", *row) for row in rows)
            bounds = {f.__name__: [round(f(c), 6) for c in zip(*positions)] for f in (min, max)}
            indices = [i for triangle in triangles for i in triangle]
            self.shapes[id(mesh)] = (
                self.accessor(floats(positions), 34962, componentType=5126, count=len(vertices), type="VEC3", **bounds),
                self.accessor(floats(n for _, n in vertices), 34962, componentType=5126, count=len(vertices), type="VEC3"),
                self.accessor(struct.pack(f"<{len(indices)}H", *indices), 34963, componentType=5123, count=len(indices), type="SCALAR"),
            )
        return self.shapes[id(mesh)]

    def material(self, name, color, roughness, emission=None):
        material = {"name": name, "pbrMetallicRoughness": {
            "baseColorFactor": [*color, 1], "metallicFactor": 0, "roughnessFactor": roughness}}
        if emission:
            material["emissiveFactor"] = [1, *(round(c / color[0], 3) for c in color[1:])]
            material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": emission}}
        self.materials.append(material)
        self.names[name] = len(self.materials) - 1

    def node(self, name, mesh, material, at=(0, 0, 0), scale=None):
        key = (id(mesh), material)
        if key not in self.names:
            positions, normals, indices = self.shape(mesh)
            primitive = {"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices,
                         "material": self.names[material]}
            self.meshes.append({"primitives": [primitive]})
            self.names[key] = len(self.meshes) - 1
        node = {"name": name, "mesh": self.names[key], "translation": [round(c, 4) for c in at]}
        if scale:
            node["scale"] = [round(c, 4) for c in scale]
        self.nodes.append(node)

    def write(self, path):
        tree = {
            "asset": {"version": "2.0", "generator": "pullfocus examples/live-scene/scene/make.py"},
            "extensionsUsed": ["KHR_materials_emissive_strength"],
            "scene": 0, "scenes": [{"nodes": list(range(len(self.nodes)))}],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials, "accessors": self.accessors,
            "bufferViews": self.views, "buffers": [{"byteLength": len(self.bytes)}],
        }
        text = json.dumps(tree, separators=(",", ":")).encode()
        chunks = b""
        for kind, data, pad in ((b"JSON", text, b" "), (b"BIN\0", bytes(self.bytes), b"\0")):
            data += pad * (-len(data) % 4)
            chunks += struct.pack("<I", len(data)) + kind + data
        path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
        print(f"{path}: {len(self.nodes)} nodes, {12 + len(chunks)} bytes")


gltf = Gltf()
gltf.material("ivory", (0.80, 0.66, 0.45), 0.28)
gltf.material("ebony", (0.035, 0.022, 0.018), 0.25)
gltf.material("light square", (0.62, 0.45, 0.26), 0.35)
gltf.material("dark square", (0.16, 0.070, 0.032), 0.35)
gltf.material("frame", (0.075, 0.030, 0.016), 0.4)
gltf.material("oak", (0.26, 0.17, 0.095), 0.6)
gltf.material("old oak", (0.20, 0.13, 0.075), 0.65)
gltf.material("grass", (0.035, 0.065, 0.018), 1.0)
gltf.material("leaves", (0.030, 0.070, 0.022), 0.9)
gltf.material("young leaves", (0.055, 0.095, 0.028), 0.9)
gltf.material("warm bulb", (1.0, 0.62, 0.28), 1.0, 90)
gltf.material("amber bulb", (1.0, 0.36, 0.08), 1.0, 70)
gltf.material("rose bulb", (1.0, 0.16, 0.20), 1.0, 60)
gltf.material("mint bulb", (0.30, 1.0, 0.62), 1.0, 15)

# The board's top is at height 0.
top = [(-1, 1), (1, 1), (1, -1), (-1, -1)]
square = [((x * SQUARE / 2, 0, z * SQUARE / 2), (0, 1, 0)) for x, z in top], [(0, 1, 2), (0, 2, 3)]
tiles = [[], []]
for column in range(8):
    for row in range(8):
        tiles[(column + row) % 2].append(moved(square, ((column - 3.5) * SQUARE, 0, (3.5 - row) * SQUARE)))
for name, squares in zip(("dark square", "light square"), tiles):
    mesh = joined(*squares)
    gltf.node(f"{name}s", mesh, name)
gltf.node("board", box(4.45 * SQUARE, 0.016, 4.45 * SQUARE), "frame", (0, -0.0175, 0))
plank = box(0.0735, 0.03, 0.9)
for i in range(9):
    gltf.node(f"plank {i}", plank, ("oak", "old oak")[i * 5 % 3 % 2], ((i - 4) * 0.15, -0.0477, 0))
gltf.node("lawn", lathe([(9, -0.78), (0, -0.78)], 32), "grass")

WHITE = {"king": "e4", "queen": "d1", "bishop": "c4 g5", "rook": "a1 f1", "pawn": "a2 b2 c3 d4 f2 g2 h3"}
BLACK = {"king": "g8", "queen": "d7", "bishop": "b6 f5", "rook": "a8 e8", "pawn": "a7 b7 c6 d5 f7 g6 h7"}
MESHES = {"king": KING, "queen": QUEEN, "bishop": BISHOP, "rook": ROOK, "pawn": PAWN}
for side, material, pieces in (("white", "ivory", WHITE), ("black", "ebony", BLACK)):
    for piece, places in pieces.items():
        for place in places.split():
            x, z = "abcdefgh".index(place[0]) - 3.5, 4.5 - int(place[1])
            gltf.node(f"{side} {piece} {place}", MESHES[piece], material, (x * SQUARE, 0, z * SQUARE))

# A hedge all round, and bulbs in it.
for i in range(48):
    angle = math.tau * i / 48
    for height, size in ((-0.35, 0.5), (0.2, 0.42), (0.62, 0.3)):
        r, a = random.uniform(3.2, 3.6), angle + random.uniform(-0.05, 0.05)
        scale = [size * random.uniform(0.8, 1.15) for _ in range(3)]
        green = random.choice(("leaves", "leaves", "young leaves"))
        gltf.node("hedge", LEAVES, green, (r * math.cos(a), height + random.uniform(-0.1, 0.1), r * math.sin(a)), scale)
for i in range(112):
    angle, kind = math.tau * (i + random.random()) / 112, random.choice(("warm", "warm", "amber", "rose", "mint"))
    at = (2.75 * math.cos(angle), random.uniform(-0.1, 0.75), 2.75 * math.sin(angle))
    gltf.node("light", BULB, f"{kind} bulb", at, [0.006] * 3)
# Strings of larger bulbs, which hang between eight points above it.
for i in range(8):
    for j in range(9):
        t = (j + 0.5) / 9
        a, b = (math.tau * k / 8 for k in (i, i + 1))
        x, z = (2.5 * ((1 - t) * f(a) + t * f(b)) for f in (math.cos, math.sin))
        gltf.node("light", BULB, "warm bulb", (x, 0.98 - 1.4 * t * (1 - t), z), [0.012] * 3)

gltf.write(Path(__file__).parent / "chess.glb")
