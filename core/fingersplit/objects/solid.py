"""What a surface encloses: the points that its winding number, with every hole closed, is at least one at.

The boundary of a surface, the edges that its faces run along more often one way than the other, consists of closed
loops, whatever the surface is like: pinched, doubled, or with many faces at an edge. A cap on each loop makes the
winding number a whole number everywhere. Mass properties, signed distances and convex pieces all go by it, so that they
agree on what is inside; parts that overlap count once.
"""

from collections import defaultdict
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.objects.moments_kernel import surface_moments
from fingersplit.objects.solid_kernel import count_crossings, find_crossings

__all__ = [
    "LARGE_OPENING",
    "Moments",
    "Solid",
    "VolumeMethod",
    "close_surface",
    "moments_of",
    "solid_of",
    "unmatched_sides",
]

LARGE_OPENING = 0.3
"""Share of the closed surface that caps may be; beyond, what a surface encloses is anybody's guess, and the hull it is.
A half ball that lacks its flat side has 0.33, a cube that lacks a face 0.17."""
MIN_FACING = 0.5
"""Mean cosine between a hole's direction and the normals around it from which on these say how the cap bulges."""
STIFFNESS = 0.06
"""How much the top of a cap is held to the middle of its loop, beside the planes around it."""
LINES, LINES_OF_UNION = 128, 384
"""Lines along each side of the lattice that enclosed space is looked at by, and measured where parts overlap."""
MULTIPLY = 2e-3
"""Share of the enclosed volume that must be enclosed twice, or be inside out, before parts count as overlapping."""
MIN_SHARE_OF_HULL = 1e-3
"""Less of the hull's volume than this is no solid but a folded sheet, where the surface is open."""


class Moments(NamedTuple):
    """Moments of a surface and of what it encloses.

    Attributes:
        area: Of the surface [m^2].
        volume: Enclosed; negative for a surface turned inside out [m^3].
        center: Centre of the volume, (3,) [m].
        second_moment: Mean of x x^T over the volume, x measured from its centre, (3, 3) [m^2].
    """

    area: float
    volume: float
    center: NDArray[np.float64]
    second_moment: NDArray[np.float64]


VolumeMethod = Literal["surface", "capped_holes", "union", "convex_hull"]
"""How what a surface encloses was measured, see ``Solid``."""


@dataclass(frozen=True, eq=False)
class Solid:
    """What a surface encloses.

    Attributes:
        vertices: Those of the surface and the middles of caps, (n, 3) [m].
        faces: Those of the surface and of the caps, (m, 3): closed, each edge as often one way as the other.
        open_share: Share of the caps in the area of both [1].
        method: How volume, centre and second moment were found: ``"surface"`` (exact, of a closed surface),
            ``"capped_holes"`` (exact, of the capped one), ``"union"`` (parts that overlap counted once), or
            ``"convex_hull"`` (openings are too large a part of the surface).
        moments: Volume, centre and second moment; the area is that of the surface without caps.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    open_share: float
    method: VolumeMethod
    moments: Moments


def solid_of(vertices: NDArray[np.float64], faces: NDArray[np.int32], is_closed: bool = False) -> Solid:
    """What triangles enclose.

    Args:
        vertices: (n, 3) [m].
        faces: Vertex indices, counter-clockwise seen from outside, (m, 3).
        is_closed: Whether it is known that faces run along each edge as often one way as the other.
    """
    corners, closed = (vertices, faces) if is_closed else close_surface(vertices, faces)
    found = moments_of(corners, closed)
    area, open_share = found.area, 0.0
    method: VolumeMethod = "surface"
    if len(closed) > len(faces):
        area = surface_moments(vertices, faces, (0.0, 0.0, 0.0))[0]
        open_share, method = 1.0 - area / found.area, "capped_holes"
    once, multiply = _measured(corners, closed, LINES)
    is_open = len(closed) > len(faces)
    if once.volume > 0 and multiply > MULTIPLY * once.volume:
        method, found = "union", _measured(corners, closed, LINES_OF_UNION)[0]
    if is_open and (open_share > LARGE_OPENING or _is_sheet(vertices, found.volume, open_share)):
        method, found = "convex_hull", _hull(vertices) or found
    return Solid(corners, closed, open_share, method, found._replace(area=area))


def moments_of(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Moments:
    """Moments of a surface, exact if it is closed."""
    origin = (vertices.min(axis=0) + vertices.max(axis=0)) / 2  # in the middle, for the sake of rounding
    area, volume, first, second = surface_moments(vertices, faces, tuple(origin.tolist()))
    with np.errstate(divide="ignore", invalid="ignore"):  # a flat surface has no centre
        offset = first / volume
        return Moments(area, volume, origin + offset, second / volume - np.outer(offset, offset))


def unmatched_sides(faces: NDArray[np.int32], count: int) -> int:
    """How many sides of faces (m, 3), indices below ``count``, no side that runs the other way matches."""
    return len(_boundary(faces, count))


def close_surface(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (n, 3) [m] and faces (m, 3) with a cap on every loop of the boundary, a fan about its top."""
    rim = _boundary(faces, len(vertices))
    if not len(rim):
        return vertices, faces
    normals = _normals_at(rim, vertices, faces)
    tops, caps = list[NDArray[np.float64]](), list[NDArray[np.int64]]()
    for loop in _loops(rim):
        if len(loop) == 3:
            caps.append(np.array([loop[::-1]]))
        elif len(loop) > 3:
            apex = len(vertices) + len(tops)
            sides = zip(loop, [*loop[1:], loop[0]], strict=True)
            tops.append(_top(vertices[loop], np.array([normals[side] for side in sides])))
            caps.append(np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), apex)]))
    return np.vstack([vertices, *tops]), np.vstack([faces, *caps]).astype(np.int32)


def _normals_at(
    rim: NDArray[np.int64], vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> dict[tuple[int, int], NDArray[np.float64]]:
    """Unit normal (3,) of a face at each directed edge of the rim (n, 2)."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).astype(np.int64).reshape(-1, 2)
    at_rim = np.flatnonzero(np.isin(sides @ (len(vertices), 1), rim @ (len(vertices), 1)))
    a, b, c = (vertices[corner] for corner in faces[at_rim // 3].T)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return dict(zip(map(tuple, sides[at_rim].tolist()), normals, strict=True))


def _top(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Top (3,) of the cap on a loop.

    Where the surface around a hole faces the way the hole does, the planes of its faces go on over the hole, and the
    top is nearest to all of them: the missing corner of a box, the crown of a missing piece of a ball. Where the
    surface stands up around the hole, as at the rim of a cup, the cap is flat.

    Args:
        corners: Of the loop, (n, 3) [m].
        normals: Unit normals of the faces at its sides, (n, 3).
    """
    middle = corners.mean(axis=0)
    sides = np.roll(corners, -1, axis=0) - corners
    facing = -np.cross(corners - middle, sides).sum(axis=0)
    facing /= max(float(np.linalg.norm(facing)), 1e-300)
    weights = np.linalg.norm(sides, axis=1)
    weights /= max(float(weights.sum()), 1e-300)
    if weights @ (normals @ facing) < MIN_FACING:
        return np.asarray(middle)
    heights = np.einsum("ij,ij->i", normals, corners - middle)
    weighted = normals * weights[:, None]
    offset = np.linalg.solve(weighted.T @ normals + STIFFNESS * np.eye(3), weighted.T @ heights)
    radius = float(np.linalg.norm(corners - middle, axis=1).mean())
    return np.asarray(middle + offset * min(1.0, radius / max(float(np.linalg.norm(offset)), 1e-300)))


def _boundary(faces: NDArray[np.int32], count: int) -> NDArray[np.int64]:
    """Directed edges (n, 2) that faces run along more often than against, each as often as the difference."""
    start = faces.astype(np.int64).ravel()
    end = np.roll(faces, -1, axis=1).astype(np.int64).ravel()
    keys = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    keys, forward = keys[order], np.where(start < end, 1, -1)[order]
    first = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    surplus = np.add.reduceat(forward, first)
    rims = np.flatnonzero(surplus)
    low, high = np.divmod(keys[first[rims]], count)
    edges = np.where((surplus[rims] > 0)[:, None], np.column_stack([low, high]), np.column_stack([high, low]))
    edges = np.repeat(edges, np.abs(surplus[rims]), axis=0)
    return np.asarray(edges[edges[:, 0] != edges[:, 1]])


def _loops(edges: NDArray[np.int64]) -> list[list[int]]:
    """Simple loops that directed edges (n, 2) consist of, where as many edges leave each vertex as come to it."""
    following = defaultdict[int, list[int]](list)
    for start, end in edges.tolist():
        following[start].append(end)
    loops = list[list[int]]()
    for first in list(following):
        path, place, vertex = [first], {first: 0}, first
        while following[vertex]:
            vertex = following[vertex].pop()
            if vertex in place:
                loops.append(path[place[vertex] :])
                for passed in path[place[vertex] + 1 :]:
                    del place[passed]
                del path[place[vertex] + 1 :]
            else:
                place[vertex] = len(path)
                path.append(vertex)
    return loops


def _measured(vertices: NDArray[np.float64], faces: NDArray[np.int32], side: int) -> tuple[Moments, float]:
    """Moments of the space with a winding number of one or more, and the volume where it is neither zero nor one.

    Along ``side`` times as many lines of a lattice, exact on each line [Nooruddin2003]. The lines run along the
    shortest side of the surface.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axis = int(np.argmin(high - low))
    u, v = (axis + 1) % 3, (axis + 2) % 3
    steps = np.maximum((high - low)[[u, v]], 1e-12) / side
    offset = low[[u, v]] + (0.5 + np.array([0.0137, 0.0071])) * steps  # beside the edges of lattice-like meshes
    lattice = axis, tuple(offset.tolist()), tuple(steps.tolist()), (side, side)
    most = count_crossings(vertices, faces, *lattice)
    lines, heights, signs = np.empty(most, np.int64), np.empty(most), np.empty(most, np.int8)
    count = find_crossings(vertices, faces, *lattice, lines, heights, signs)
    order = np.lexsort((heights[:count], lines[:count]))
    lines, heights, winding = lines[order], heights[order], np.cumsum(signs[order], dtype=np.int64)
    last = np.concatenate([lines[1:] != lines[:-1], np.ones(min(count, 1), bool)])
    # A line through an edge may meet both faces there, or none; then its count does not end at zero: it is left out.
    uneven = np.flatnonzero(last)[np.diff(winding[last], prepend=0) != 0]
    kept = ~np.isin(lines, lines[uneven])
    winding = winding - np.repeat(np.concatenate([[0], winding[last][:-1]]), np.diff(np.flatnonzero(last), prepend=-1))
    inside = np.flatnonzero(kept[:-1] & ~last[:-1] & (winding[:-1] != 0))
    bottom, top, times = heights[inside], heights[inside + 1], winding[inside]
    cell = float(steps.prod())
    once = times > 0
    places = np.column_stack([lines[inside] // side, lines[inside] % side]) * steps + offset
    moments = _column_moments(axis, places[once], bottom[once], top[once], steps, cell)
    return moments, float((top - bottom)[(times < 0) | (times > 1)].sum()) * cell


def _column_moments(
    axis: int,
    places: NDArray[np.float64],
    bottom: NDArray[np.float64],
    top: NDArray[np.float64],
    steps: NDArray[np.float64],
    cell: float,
) -> Moments:
    """Moments of columns along an axis: their places (n, 2) along the other two, bottoms and tops (n,) [m]."""
    lengths = top - bottom
    volume = cell * float(lengths.sum())
    if volume <= 0:
        return Moments(0.0, 0.0, np.full(3, np.nan), np.full((3, 3), np.nan))
    centers = np.empty((len(lengths), 3))
    centers[:, axis] = (bottom + top) / 2
    centers[:, [(axis + 1) % 3, (axis + 2) % 3]] = places
    weights = cell * lengths / volume
    center = weights @ centers
    spread = np.zeros(3)
    spread[axis] = weights @ lengths**2 / 12
    spread[[(axis + 1) % 3, (axis + 2) % 3]] = steps**2 / 12
    offsets = centers - center
    return Moments(0.0, volume, center, (offsets * weights[:, None]).T @ offsets + np.diag(spread))


def _is_sheet(vertices: NDArray[np.float64], volume: float, open_share: float) -> bool:
    """Whether an open surface encloses next to nothing of its hull."""
    if volume > 0 and open_share < 0.05:
        return False
    hull = _hull(vertices)
    return hull is not None and volume < MIN_SHARE_OF_HULL * hull.volume


def _hull(vertices: NDArray[np.float64]) -> Moments | None:
    """Moments of the convex hull; None for points in a plane."""
    try:
        hull = ConvexHull(vertices)
    except QhullError:
        return None
    middle = vertices[hull.vertices].mean(axis=0)
    faces = hull.simplices.astype(np.int32)
    a, b, c = (vertices[corner] for corner in faces.T)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - middle) < 0
    return moments_of(vertices, np.where(inward[:, None], faces[:, ::-1], faces))
