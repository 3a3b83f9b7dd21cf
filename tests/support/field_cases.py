"""Files as users of grasp planners have them, reduced to the smallest that shows the problem."""

import json
import math
import struct

import numpy as np
import trimesh

__all__ = [
    "BRICK",
    "DART",
    "NOTCHED",
    "as_glb",
    "as_obj",
    "as_off",
    "as_ply",
    "as_stl",
    "box_on_table",
    "brick_with_normals",
    "joined",
    "pinholed_ell",
    "prism",
    "rotated",
    "strip_ball",
]

Polygons = tuple[list[tuple[float, ...]], list[list[int]]]

NOTCHED = [(0, 0), (60, 0), (60, 60), (45, 60), (45, 20), (15, 20), (15, 60), (0, 60)]
"""A square with a notch from above [mm]: 2,400 mm^2 in area."""
DART = [(0, 0), (40, 20), (0, 40), (15, 20)]
"""An arrow head [mm]: 500 mm^2."""
BRICK = np.array([0.06, 0.04, 0.03])
"""Edges of the box that clouds are of [m]."""


def prism(outline: list[tuple[float, float]], height: float) -> Polygons:
    """One polygon below, one above, and quads around."""
    n = len(outline)
    points = [(x, y, z) for z in (0.0, height) for x, y in outline]
    around = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return points, [[*range(n)][::-1], [n + k for k in range(n)], *around]


def rotated(outline: list[tuple[float, float]], start: int) -> list[tuple[float, float]]:
    return outline[start:] + outline[:start]


def joined(*meshes: trimesh.Trimesh) -> Polygons:
    """Meshes side by side, with vertices of their own."""
    points, faces = list[tuple[float, ...]](), list[list[int]]()
    for mesh in meshes:
        faces += (mesh.faces + len(points)).tolist()
        points += map(tuple, mesh.vertices.tolist())
    return points, faces


def pinholed_ell(hole: bool) -> Polygons:
    """An L of 80 x 80 x 20 mm, 56 cm^3, one of whose triangles has a hole of a 400th of its area."""
    outline = [(0, 0), (80, 0), (80, 20), (20, 20), (20, 80), (0, 80)]
    points, faces = prism(outline, 20)
    a, b, c = faces[2][:3]
    corners = np.array([points[k] for k in (a, b, c)])
    near = corners.mean(axis=0) + 0.05 * (corners - corners.mean(axis=0))
    d, e, f = range(len(points), len(points) + 3)
    quads = [[a, b, e, d], [b, c, f, e], [c, a, d, f]]
    rest = [faces[2][2], faces[2][3], faces[2][0]]
    whole = [*faces[:2], *faces[3:], rest, *quads]
    return points + [tuple(p) for p in near.tolist()], whole if hole else [*whole, [d, e, f]]


def as_obj(mesh: Polygons) -> bytes:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh[0]]
    return "\n".join([*lines, *("f " + " ".join(str(k + 1) for k in face) for face in mesh[1]), ""]).encode()


def as_off(mesh: Polygons) -> bytes:
    head = ["OFF", f"{len(mesh[0])} {len(mesh[1])} 0"]
    rows = [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh[0]]
    return "\n".join([*head, *rows, *(" ".join(map(str, [len(face), *face])) for face in mesh[1]), ""]).encode()


def as_ply(mesh: Polygons, element: str = "face", encoding: str = "ascii") -> bytes:
    head = f"ply\nformat {encoding} 1.0\nelement vertex {len(mesh[0])}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element {element} {len(mesh[1])}\nproperty list int int vertex_indices\nend_header\n"
    if encoding == "ascii":
        rows = [" ".join(f"{x:.9g}" for x in point) for point in mesh[0]]
        rows += [" ".join(map(str, [len(face), *face])) for face in mesh[1]]
        return (head + "\n".join(rows) + "\n").encode()
    order = ">" if "big" in encoding else "<"
    body = np.array(mesh[0], order + "f4").tobytes()
    return head.encode() + body + b"".join(np.array([len(f), *f], order + "i4").tobytes() for f in mesh[1])


def as_stl(mesh: trimesh.Trimesh, tail: bytes = b"") -> bytes:
    """Binary STL with bytes behind its last triangle."""
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *corners.ravel().tolist(), 0) for corners in mesh.triangles)
    return b"binary".ljust(80, b"\0") + struct.pack("<I", len(mesh.faces)) + facets + tail


def strip_ball(radius: float) -> Polygons:
    """A ball as one triangle strip, whose bands are parted by -1."""
    n = 24
    points, strip = list[tuple[float, ...]](), list[int]()
    for i in range(n + 1):
        tilt = math.pi * i / n
        ring = [(math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn)) for turn in _turns(n)]
        points += [(radius * x, radius * y, radius * math.cos(tilt)) for x, y in ring]
    for i in range(n):
        strip += [place for j in range(n + 1) for place in (i * n + j % n, (i + 1) * n + j % n)] + [-1]
    return points, [strip]


def _turns(n: int) -> list[float]:
    return [2 * math.pi * j / n for j in range(n)]


def as_glb(document: dict, binary: bytes = b"") -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def brick_with_normals(count: int = 2_000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points all over a brick about the origin and their outward normals, (n, 3) each."""
    rng = np.random.default_rng(seed)
    side = rng.integers(0, 6, count)
    normals = np.eye(3)[side % 3] * np.where(side < 3, -1.0, 1.0)[:, None]
    points = (rng.random((count, 3)) - 0.5) * BRICK
    rows = np.arange(count)
    points[rows, side % 3] = normals[rows, side % 3] * BRICK[side % 3] / 2
    return points, normals


def box_on_table() -> tuple[np.ndarray, np.ndarray]:
    """What a camera at the origin sees of a brick on a table of 0.6 x 0.6 m below it, and where the camera stands."""
    points, normals = brick_with_normals()
    points = points + np.array([0.08, 0.06, 0.5])
    seen = points[(normals * points).sum(axis=1) < 0]
    x, y = np.meshgrid(np.arange(-0.3, 0.3, 0.004), np.arange(-0.3, 0.3, 0.004))
    table = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.515)], axis=1)
    return np.vstack([seen, table]), np.zeros(3)
