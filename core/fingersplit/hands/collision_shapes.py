"""Collision shapes for the planner: the model's own primitives, and primitives fitted to all else, a few a link."""

import heapq
from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import combinations

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.errors import HandError
from fingersplit.hands.convex_meshes import convex_pieces
from fingersplit.hands.fingers import Pad
from fingersplit.hands.fitting import Fit, fit_primitive, hull_points, primitive_points, primitive_volume
from fingersplit.hands.limits import MAX_SHAPES
from fingersplit.hands.model import Link, Shape, Solid
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CYLINDER, SPHERE
from fingersplit.hands.tip_shapes import convex_fit, stand_out
from fingersplit.transforms import pose_matrix, transform_points

__all__ = ["convex_solids", "planning_shapes", "solid_points", "with_hulls"]

Array = NDArray[np.float64]

PRIMITIVES = {SPHERE, CAPSULE, CYLINDER, BOX}
ELLIPSOID, MESH = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID), int(mujoco.mjtGeom.mjGEOM_MESH)

NEAR_PAD = 8e-3
"""[m]; what stays farther behind every plane that touches a pad does not count as near it."""
SHAPES_A_LINK, SHAPES_OF_PALM = 2, 4
FULL, GAIN = 0.8, 0.92
"""A hull that fills less than this share of its primitive is cut in two, where that saves so much of the volume."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """What one shape stands for: points (n, 3) of the link's frame that it must contain."""

    name: str
    link: int
    points: Array
    fit: Fit
    exact: bool
    sources: tuple[str, ...]


def convex_solids(solids: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """The same solids with every mesh as convex pieces, since physics engines collide meshes as their hulls.

    Raises:
        HandError: A geom that is neither primitive nor mesh.
    """
    found: list[Solid] = []
    known: dict[bytes, list[tuple[Array, NDArray[np.int64]]]] = {}
    for solid in solids:
        if solid.kind in PRIMITIVES or solid.kind == ELLIPSOID:
            found.append(solid)
        elif solid.kind == MESH and solid.vertices is not None and solid.faces is not None:
            key = solid.vertices.tobytes()
            if key not in known:
                known[key] = convex_pieces(solid.vertices, solid.faces)
            for number, (vertices, faces) in enumerate(known[key]):
                name = solid.name if len(known[key]) == 1 else f"{solid.name}_part{number}"
                found.append(replace(solid, name=name, vertices=vertices, faces=faces))
        else:
            kind = mujoco.mjtGeom(solid.kind).name.removeprefix("mjGEOM_").lower()
            raise HandError(
                f"Geom {solid.name!r} is a {kind}; links are spheres, capsules, cylinders, boxes, ellipsoids or meshes."
            )
    return tuple(found)


def planning_shapes(
    solids: tuple[Solid, ...], links: tuple[Link, ...], budget: int | None, pads: tuple[Pad, ...] = ()
) -> tuple[Shape, ...]:
    """Shapes that together contain convex solids: primitives as they are, fitted ones for ellipsoids and meshes.

    Links near ``pads`` keep the shape of their hulls, since pads touch.

    Where there are more than ``budget`` (else as many as the kernels have room for), the two on one link whose common
    box adds least volume are merged, again and again. Where there are fewer than two a link and four more for the palm,
    the emptiest fitted one is cut in two.
    """
    pieces = [_piece_of(solid) for solid in solids]
    tips, pieces = _tips(pieces, pads)
    most = MAX_SHAPES if budget is None else min(MAX_SHAPES, max(budget, len({piece.link for piece in pieces})))
    most = max(most - len(tips), len({piece.link for piece in pieces}))
    pieces = tips + _split(_merge(pieces, most), min(most, SHAPES_A_LINK * len(links) + SHAPES_OF_PALM))
    pieces.sort(key=lambda piece: piece.link)
    return tuple(map(_shape_of, pieces))


def with_hulls(shapes: tuple[Shape, ...], solids: tuple[Solid, ...], which: Collection[int]) -> tuple[Shape, ...]:
    """The same shapes, but those asked for as the hulls of what they stand for, parts of one solid as one again."""
    asked = {shapes[k].sources: shapes[k] for k in sorted(which)}
    found = [shape for shape in shapes if shape.sources not in asked]
    for sources, shape in asked.items():
        points = hull_points(np.vstack([_points_of(solid) for solid in solids if solid.name in sources]))
        found.append(_shape_of(_Piece(shape.name, shape.link, points, _hull_fit(points), False, sources)))
    return tuple(sorted(found, key=lambda shape: shape.link))


def _hull_fit(points: Array) -> Fit:
    """The hull of points (n, 3), in the frame of the primitive about them: depths are measured along its axes, too."""
    turn = fit_primitive(points).pose[:3, :3]
    fit = convex_fit(points @ turn, ())
    return replace(fit, pose=pose_matrix(turn, turn @ fit.pose[:3, 3]))


def _shape_of(piece: _Piece) -> Shape:
    return Shape(
        name=piece.name,
        link=piece.link,
        kind=piece.fit.kind,
        size=piece.fit.size,
        pose=piece.fit.pose,
        overhang=0.0 if piece.exact else piece.fit.overhang(piece.points),
        sources=piece.sources,
    )


def solid_points(solid: Solid) -> Array:
    """Points (n, 3) in a solid's own frame whose convex hull it is, as near as is of use [m]."""
    if solid.vertices is not None:
        return solid.vertices
    if solid.kind == ELLIPSOID:
        return np.asarray(primitive_points(SPHERE, np.ones(3)) * solid.size)
    return primitive_points(solid.kind, solid.size)


def _tips(pieces: list[_Piece], pads: tuple[Pad, ...]) -> tuple[list[_Piece], list[_Piece]]:
    """One piece a link for what lies near its pads and is no primitive, and all other pieces."""
    tips: list[_Piece] = []
    for link in sorted({pad.link for pad in pads}):
        own = tuple(pad for pad in pads if pad.link == link)
        near = [p for p in pieces if p.link == link and not p.exact and stand_out(p.points, own) > -NEAR_PAD]
        if near:
            points = hull_points(np.vstack([piece.points for piece in near]))
            sources = tuple(source for piece in near for source in piece.sources)
            tips.append(_Piece(near[0].name, link, points, convex_fit(points, own), False, sources))
            pieces = [piece for piece in pieces if piece not in near]
    return tips, pieces


def _piece_of(solid: Solid) -> _Piece:
    points = _points_of(solid)
    if solid.kind in PRIMITIVES:
        fit = Fit(solid.kind, solid.size, solid.pose, primitive_volume(solid.kind, solid.size))
        return _Piece(solid.name, solid.link, points, fit, True, (solid.name,))
    return _Piece(solid.name, solid.link, points, fit_primitive(points), False, (solid.name,))


def _points_of(solid: Solid) -> Array:
    """Points (n, 3) of the link's frame [m] that a shape for a solid must contain."""
    if solid.kind in PRIMITIVES:
        return transform_points(solid.pose, primitive_points(solid.kind, solid.size))
    if solid.kind == ELLIPSOID:
        sphere = primitive_points(SPHERE, np.ones(3))
        return transform_points(solid.pose, 1.005 * sphere * solid.size)  # outside of the facets between the points
    assert solid.vertices is not None
    return hull_points(transform_points(solid.pose, solid.vertices))


def _split(pieces: list[_Piece], limit: int) -> list[_Piece]:
    """Cut the piece whose primitive is emptiest, again and again, until there are ``limit`` or all are full enough."""
    done: list[_Piece] = []
    queue = [(-_excess(piece), k, piece) for k, piece in enumerate(pieces)]
    heapq.heapify(queue)
    while queue and len(done) + len(queue) < limit:
        _, _, piece = heapq.heappop(queue)
        halves = [] if piece.exact else _halves(piece.points)
        if not halves:
            done.append(piece)
            continue
        for points in halves:
            half = replace(piece, points=points, fit=fit_primitive(points))
            heapq.heappush(queue, (-_excess(half), len(done) + len(queue) + len(pieces) * limit, half))
    whole = done + [piece for _, _, piece in queue]
    return sorted(whole, key=lambda piece: piece.link)


def _excess(piece: _Piece) -> float:
    """Volume of a primitive beyond what it stands for [m^3]."""
    hull = None if piece.exact else _hull(piece.points)
    return 0.0 if hull is None else piece.fit.volume - float(hull.volume)


def _halves(points: Array) -> list[Array]:
    """The points of a hull cut in two, so that two primitives are smallest; none if that is no gain."""
    hull, fit = _hull(points), fit_primitive(points)
    if hull is None or hull.volume > FULL * fit.volume:
        return []
    center = points.mean(axis=0)
    best: list[Array] = []
    smallest = GAIN * fit.volume
    for axis in np.linalg.svd(points - center, full_matrices=False)[2][:2]:
        heights = (points - center) @ axis
        for share in (0.3, 0.5, 0.7):
            parts = _cut(points, heights - (heights.min() + share * np.ptp(heights)))
            volume = sum(fit_primitive(part).volume for part in parts)
            if volume < smallest:
                best, smallest = parts, volume
    return best


def _cut(points: Array, heights: Array) -> list[Array]:
    """Corners of a hull's two parts, above and below where heights (n,) are zero, those of the cut in both."""
    edges = np.unique(np.sort(ConvexHull(points).simplices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    a, b = edges[heights[edges[:, 0]] * heights[edges[:, 1]] < 0].T
    share = (heights[a] / (heights[a] - heights[b]))[:, None]
    crossings = points[a] + share * (points[b] - points[a])
    return [np.vstack([points[side], crossings]) for side in (heights >= 0, heights < 0)]


def _merge(pieces: list[_Piece], limit: int) -> list[_Piece]:
    """Merge pairs on one link, those whose common box is emptiest last, until there are no more than ``limit``."""
    alive = dict(enumerate(pieces))
    queue: list[tuple[float, int, int]] = []

    def offer(i: int, j: int) -> None:
        added = _box_volume(alive[i], alive[j]) - alive[i].fit.volume - alive[j].fit.volume
        heapq.heappush(queue, (added, i, j))

    if len(alive) > limit:
        for i, j in combinations(alive, 2):
            if alive[i].link == alive[j].link:
                offer(i, j)
    while len(alive) > limit:
        _, i, j = heapq.heappop(queue)
        if i not in alive or j not in alive:
            continue
        new = max(alive) + 1
        alive[new] = _merged(alive.pop(i), alive.pop(j))
        for other in list(alive):
            if other != new and alive[other].link == alive[new].link:
                offer(other, new)
    return sorted(alive.values(), key=lambda piece: piece.link)


def _box_volume(a: _Piece, b: _Piece) -> float:
    """Volume of the box about two pieces along the axes of the first one's primitive [m^3]."""
    points = np.vstack([a.points, b.points]) @ a.fit.pose[:3, :3]
    return float(np.prod(np.ptp(points, axis=0)))


def _merged(a: _Piece, b: _Piece) -> _Piece:
    points = hull_points(np.vstack([a.points, b.points]))
    return _Piece(a.name, a.link, points, fit_primitive(points), False, (*a.sources, *b.sources))


def _hull(points: Array) -> ConvexHull | None:
    try:
        return ConvexHull(points)
    except (QhullError, ValueError):
        return None
