"""Objects of our own with known dimensions: closed meshes for examples, tests and benchmarks.

Every solid is watertight and wound outwards, has its axis along z and its middle at the origin (the mug: the
middle of its body), and is the same, bit for bit, each time it is made. Lengths are in metres.
"""

from collections.abc import Callable
from itertools import pairwise
from math import ceil, pi

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh

__all__ = [
    "PARAMETRIC_OBJECTS",
    "bottle",
    "box",
    "capsule",
    "cylinder",
    "ellipsoid",
    "l_bracket",
    "mug",
    "sphere",
    "wedge",
]

EDGE_LENGTH = 0.0032  # [m] aimed at along profiles and around circles; flat faces stay below twice this


def box(size: tuple[float, float, float] = (0.05, 0.07, 0.12)) -> Mesh:
    """A cuboid with edges `size` [m] along x, y and z."""
    solid = trimesh.creation.box(extents=size)
    return _refined(solid.vertices, solid.faces)


def cylinder(radius: float = 0.03, height: float = 0.11) -> Mesh:
    """A cylinder of `radius` and `height` [m]; its vertices lie on the circle."""
    return _revolved([(0, -height / 2), (radius, -height / 2), (radius, height / 2), (0, height / 2)])


def sphere(radius: float = 0.035) -> Mesh:
    """A sphere of `radius` [m]; its vertices lie on the sphere."""
    return ellipsoid((radius, radius, radius))


def ellipsoid(semi_axes: tuple[float, float, float] = (0.05, 0.035, 0.03)) -> Mesh:
    """An ellipsoid with `semi_axes` [m] along x, y and z, from a four times subdivided icosahedron."""
    unit_sphere = trimesh.creation.icosphere(subdivisions=4)
    return Mesh(unit_sphere.vertices * semi_axes, unit_sphere.faces)


def capsule(radius: float = 0.025, length: float = 0.06) -> Mesh:
    """A cylinder of `radius` and `length` [m] with a half sphere on either end."""
    cap = _arc((0, length / 2), radius, 0, pi / 2)
    return _revolved([*((r, -z) for r, z in cap[::-1]), *cap])


def bottle(radius: float = 0.033, height: float = 0.19, neck_radius: float = 0.013, neck_height: float = 0.035) -> Mesh:
    """A closed bottle: a round body, a smooth shoulder as tall as the body is wide in radius, and a neck.

    Args:
        radius: Of the body [m].
        height: From the bottom to the top of the neck [m].
        neck_radius: Of the neck [m].
        neck_height: Of the straight part of the neck [m].
    """
    turn = np.linspace(0, pi, 16)
    shoulder_radii = neck_radius + (radius - neck_radius) * (1 + np.cos(turn)) / 2
    shoulder_heights = height / 2 - neck_height - radius * (1 - turn / pi)
    return _revolved(
        [
            (0, -height / 2),
            (radius, -height / 2),
            *zip(shoulder_radii, shoulder_heights, strict=True),
            (neck_radius, height / 2),
            (0, height / 2),
        ]
    )


def wedge(length: float = 0.08, height: float = 0.05, width: float = 0.05) -> Mesh:
    """A right triangle with legs `length` along x and `height` along y, extruded by `width` along z [m]."""
    outline = np.array([(0, 0), (length, 0), (0, height)]) - (length / 2, height / 2)
    return _extruded(outline, [(0, 1, 2)], width)


def l_bracket(leg: float = 0.08, thickness: float = 0.015, width: float = 0.04) -> Mesh:
    """Two legs of equal length at a right angle in the xy-plane, extruded by `width` along z [m]."""
    corners = [(0, 0), (leg, 0), (leg, thickness), (thickness, thickness), (thickness, leg), (0, leg)]
    triangles = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    return _extruded(np.array(corners) - leg / 2, triangles, width)


def mug(
    radius: float = 0.040,
    height: float = 0.095,
    wall: float = 0.004,
    bottom: float = 0.006,
    handle_radius: float = 0.0055,
    handle_reach: float = 0.033,
    handle_height: float = 0.056,
) -> Mesh:
    """An open mug with a cavity and a handle towards +x, as one surface of genus 1.

    Args:
        radius: Of the outer wall [m].
        height: Of the body [m].
        wall: Thickness of the wall, with a round rim [m].
        bottom: Thickness of the bottom [m].
        handle_radius: Half the thickness of the handle [m].
        handle_reach: From the outer wall to the middle line of the handle [m].
        handle_height: Between the middles of the handle's two roots [m].
    """
    rim = _arc((radius - wall / 2, height / 2 - wall / 2), wall / 2, 0, pi)
    floor = -height / 2 + bottom
    body = _profile([(0, -height / 2), (radius, -height / 2), *rim, (radius - wall, floor), (0, floor)])
    vertices, rings, quads, fans = _revolved_grid(body)

    # The handle's tube is sewn to two square holes in the outer wall, which become its first and last ring.
    half = max(1, round(handle_radius / EDGE_LENGTH))
    outer = np.flatnonzero(np.isclose(body[1:-1, 0], radius))
    upper, lower = (outer[np.argmin(abs(body[1 + outer, 1] - z))] for z in (handle_height / 2, -handle_height / 2))
    kept = np.ones(quads.shape[:2], dtype=bool)
    for row in (upper, lower):
        kept[row - half : row + half, np.arange(-half, half)] = False
    top = _hole(vertices, rings, upper, half, inner_side=-1)
    end = _hole(vertices, rings, lower, half, inner_side=1)
    tube = _handle(vertices[top], vertices[end], radius, handle_reach, handle_radius)
    between = len(vertices) + np.arange(tube[..., 0].size).reshape(tube.shape[:2])
    handle = _bands(np.vstack([top, between, end]))
    faces = np.vstack([fans, quads[kept].reshape(-1, 3), handle.reshape(-1, 3)])
    used, corners = np.unique(faces, return_inverse=True)  # the middles of the holes are not
    return Mesh(np.vstack([vertices, tube.reshape(-1, 3)])[used], corners.reshape(-1, 3).astype(np.int32))


PARAMETRIC_OBJECTS: dict[str, Callable[[], Mesh]] = {
    make.__name__: make for make in (box, cylinder, sphere, ellipsoid, capsule, bottle, wedge, l_bracket, mug)
}
"""Every object above by its name, made with its default dimensions."""


def _hole(
    vertices: NDArray[np.float64], rings: NDArray[np.int64], row: int, half: int, inner_side: int
) -> NDArray[np.int64]:
    """Corners around the square hole at `row` and +x, counter-clockwise about the handle's path."""
    patch = rings[row - half : row + half + 1][:, np.arange(-half, half + 1)]
    border = np.concatenate([patch[0], patch[-1], patch[1:-1, 0], patch[1:-1, -1]])
    _, y, z = (vertices[border] - vertices[rings[row, 0]]).T
    return border[np.argsort(np.arctan2(y, inner_side * z))]


def _handle(
    top: NDArray[np.float64], end: NDArray[np.float64], radius: float, reach: float, thickness_radius: float
) -> NDArray[np.float64]:
    """Rings of a tube along half an ellipse from the hole `top` to the hole `end`, (n_rings, n_corners, 3)."""
    (_, _, z_top), (_, _, z_end) = top.mean(axis=0), end.mean(axis=0)
    middle, half_height = (z_top + z_end) / 2, (z_top - z_end) / 2
    turn = np.linspace(0, pi, ceil(pi * max(reach, half_height) / EDGE_LENGTH))[1:-1]
    still = np.zeros_like(turn)
    centers = np.stack([radius + reach * np.sin(turn), still, middle + half_height * np.cos(turn)], axis=-1)
    tangents = np.stack([reach * np.cos(turn), still, -half_height * np.sin(turn)], axis=-1)
    inner = np.cross((0, 1, 0), tangents / np.linalg.norm(tangents, axis=1, keepdims=True))
    around = np.arctan2(top[:, 1], z_top - top[:, 2])
    offsets = np.cos(around)[:, None] * inner[:, None] + np.sin(around)[:, None] * np.array((0, 1, 0))
    return np.asarray(centers[:, None] + thickness_radius * offsets)


def _revolved(corners: list[tuple[float, float]]) -> Mesh:
    """The solid that the (radius, z) line `corners`, from axis to axis, sweeps around z."""
    vertices, _, quads, fans = _revolved_grid(_profile(corners))
    return Mesh(vertices, np.vstack([fans, quads.reshape(-1, 3)]))


def _revolved_grid(
    profile: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Vertices, vertex indices by ring and column, band faces (row, column, 2, 3) and the two closing fans."""
    columns = 8 * ceil(2 * pi * profile[:, 0].max() / EDGE_LENGTH / 8)
    angles = 2 * pi * np.arange(columns) / columns
    radii, heights = profile[1:-1, :1], profile[1:-1, 1:]
    grid = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.broadcast_to(heights, (len(radii), columns))])
    poles = [(0, 0, profile[0, 1]), (0, 0, profile[-1, 1])]
    vertices = np.vstack([grid.reshape(3, -1).T, poles])
    rings = np.arange(radii.size * columns).reshape(-1, columns)
    first, last = (np.full(columns, rings.size + k) for k in (0, 1))
    fans = [(first, np.roll(rings[0], -1), rings[0]), (last, rings[-1], np.roll(rings[-1], -1))]
    return vertices, rings, _bands(rings), np.vstack([np.stack(fan, axis=1) for fan in fans])


def _bands(rings: NDArray[np.int64]) -> NDArray[np.int64]:
    """Two triangles for each quad between neighbouring closed rings, (n_rings - 1, n_columns, 2, 3)."""
    here, above = rings[:-1], rings[1:]
    here_next, above_next = np.roll(here, -1, axis=1), np.roll(above, -1, axis=1)
    lower = np.stack([here, here_next, above_next], axis=-1)
    upper = np.stack([here, above_next, above], axis=-1)
    return np.stack([lower, upper], axis=2)


def _profile(corners: list[tuple[float, float]]) -> NDArray[np.float64]:
    """The line through `corners` with more points on its long pieces, (n, 2)."""
    line = np.array(corners, dtype=np.float64)
    pieces = [
        np.linspace(start, stop, ceil(float(np.linalg.norm(stop - start)) / EDGE_LENGTH), endpoint=False)
        for start, stop in pairwise(line)
    ]
    return np.vstack([*pieces, line[-1:]])


def _arc(center: tuple[float, float], radius: float, start: float, stop: float) -> list[tuple[float, float]]:
    """Points of a circular arc between two angles [rad], both ends exact."""
    angles = np.linspace(start, stop, max(5, ceil((stop - start) * radius / EDGE_LENGTH) + 1))
    points = np.array(center) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points[np.isclose(points, 0.0, atol=1e-12)] = 0.0
    return [(float(r), float(z)) for r, z in points]


def _extruded(outline: NDArray[np.float64], triangles: list[tuple[int, int, int]], width: float) -> Mesh:
    """The counter-clockwise `outline`, filled by `triangles`, drawn out along z."""
    count = len(outline)
    low, high = (np.column_stack([outline, np.full(count, z)]) for z in (-width / 2, width / 2))
    cap, sides = np.array(triangles), _bands(np.arange(2 * count).reshape(2, count)).reshape(-1, 3)
    return _refined(np.vstack([low, high]), np.vstack([cap[:, ::-1], cap + count, sides]))


def _refined(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Mesh:
    """The same solid with every edge bisected until it is short."""
    return Mesh(*trimesh.remesh.subdivide_to_size(vertices, faces, max_edge=2 * EDGE_LENGTH))
