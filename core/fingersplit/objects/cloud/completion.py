"""The side that one view of an object on a support did not see, assumed from symmetry.

What the camera saw to be free is free, all the rest above the support may be object. A plane square to the support is
found about which the seen points can be mirrored without coming into free space [Bohg2011]; taken as object is the
largest body that is symmetric about it and nowhere in free space, and what was seen, with some thickness, even where
its counterpart is free.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, grey_closing, map_coordinates

from fingersplit.errors import ObjectFileError
from fingersplit.extras import extra
from fingersplit.objects.cloud.normals import OrientedPoints
from fingersplit.objects.mesh import Mesh

__all__ = ["complete"]

MARGIN = 12
"""[pixels]; about the object's image."""
DIRECTIONS, OFFSETS, TRIED = 24, 25, 250
"""Mirror planes looked at, and points that judge them."""
REFINEMENTS, FINER = 3, 3.0
"""How often planes about the best one are looked at, and how much closer each time."""
MAX_CONTRADICTION = 0.015
"""[m]; a point that lies deeper in free space contradicts no more."""
VOLUME_WEIGHT = 0.0007
"""[m]; of the share of the hidden space that a plane leaves to the object, beside the mean depth in free space."""
BORDER = 0.005
"""[m]; depth in hidden space from which a point counts fully as left to the object."""
MIN_SLOPE = 0.05
"""Of a ray towards the support, below which it is taken not to meet it."""
THICKNESS = 0.008
"""[m]; of what was seen, where its counterpart is free."""
MIN_CELLS, CELLS, CELLS_PER_SPACING = 20, 44, 1.6
"""Along the longest extent; fewer where the points are sparse."""
SMOOTHING = 0.7, 1.5
"""Of the distances to free space, in cells or in standard deviations of the points' noise, whichever is more."""


class _Space(NamedTuple):
    """What one view says of space: an image of how far it saw.

    Attributes:
        rotation: Rows are the image's axes and the view, (3, 3).
        viewpoint: Where the camera stood, (3,) [m].
        low: First pixel, (2,), in distances per depth.
        pixel: Width of a pixel, in the same.
        depths: Depth of the nearest point, beside the object that of the nearest pixel, (w, h) [m].
        beside: Distance to the object's outline, negative within, (w, h), in distances per depth.
        up: Unit normal of the support, (3,).
        offset: Of the support [m].
    """

    rotation: NDArray[np.float64]
    viewpoint: NDArray[np.float64]
    low: NDArray[np.float64]
    pixel: float
    depths: NDArray[np.float64]
    beside: NDArray[np.float64]
    up: NDArray[np.float64]
    offset: float

    @classmethod
    def of(cls, oriented: OrientedPoints, viewpoint: NDArray[np.float64], support: NDArray[np.float64]) -> "_Space":
        points = oriented.points
        axis = points.mean(axis=0) - viewpoint
        axis /= np.linalg.norm(axis)
        side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        side /= np.linalg.norm(side)
        rotation = np.stack([side, np.cross(axis, side), axis])
        seen = (points - viewpoint) @ rotation.T
        flat = seen[:, :2] / seen[:, 2:]
        pixel = oriented.spacing / float(seen[:, 2].mean())
        low = flat.min(axis=0) - MARGIN * pixel
        size = np.ceil((flat.max(axis=0) - low) / pixel).astype(np.int64) + MARGIN + 1
        image = np.full(size, np.inf)
        np.minimum.at(image, tuple(np.rint((flat - low) / pixel).astype(np.int64).T), seen[:, 2])
        image = -grey_closing(-image, size=(3, 3))
        empty = np.isinf(image)
        outside, nearest = distance_transform_edt(empty, return_indices=True)
        beside = np.where(empty, outside - 0.5, 0.5 - distance_transform_edt(~empty)) * pixel
        return cls(rotation, viewpoint, low, pixel, image[tuple(nearest)], beside, support[:3], float(support[3]))

    def free(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How deep points (n, 3) [m] lie in space that is known to be free, (n,) [m]; negative where object may be."""
        seen = (points - self.viewpoint) @ self.rotation.T
        places = ((seen[:, :2] / seen[:, 2:] - self.low) / self.pixel).T
        depth = map_coordinates(self.depths, places, order=1, mode="nearest")
        beside = map_coordinates(self.beside, places, order=1, mode="nearest") * seen[:, 2]
        below = self.offset - points @ self.up
        return np.asarray(np.maximum(np.maximum(depth - seen[:, 2], beside), below))


def complete(oriented: OrientedPoints, viewpoint: NDArray[np.float64], support: NDArray[np.float64]) -> Mesh:
    """The closed surface of the object that a view shows, its other side assumed.

    Args:
        oriented: The seen points.
        viewpoint: Where the camera stood, (3,) [m].
        support: Unit normal on the object's side and offset [m] of the plane that it stands on, (4,).

    Raises:
        ObjectFileError: No body is left above the support.
    """
    space = _Space.of(oriented, viewpoint, support)
    normal, place = _mirror_plane(oriented, space)
    axes = np.stack([normal, np.cross(space.up, normal), space.up])  # (3, 3), rows
    seen = oriented.points @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    half = float(max(high[0] - place, place - low[0]))
    low[0], high[0], low[2] = place - half, place + half, space.offset
    extent = float((high - low).max())
    cell = extent / float(np.clip(CELLS_PER_SPACING * extent / oriented.spacing, MIN_CELLS, CELLS))
    count = np.ceil(half / cell) + 2
    steps = [place + cell * np.arange(-count, count + 1)]  # reversed, it is its own mirror image
    steps += [np.arange(low[k] - 2.5 * cell, high[k] + 3 * cell, cell) for k in (1, 2)]
    places = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    free = space.free(places.reshape(-1, 3) @ axes).reshape(places.shape[:3])
    origin = places[0, 0, 0]
    without = np.ones(free.shape, bool)
    without[tuple(np.rint((seen - origin) / cell).astype(np.int64).T)] = False
    beyond = cell * distance_transform_edt(without) - THICKNESS
    values = np.clip(np.maximum(free, np.minimum(free[::-1], beyond)), -3 * cell, 3 * cell)
    values = gaussian_filter(values, max(SMOOTHING[0], SMOOTHING[1] * oriented.noise / cell))
    outside = np.ones(values.shape, bool)
    outside[1:-1, 1:-1, 1:-1] = False
    values[outside] = np.maximum(values[outside], 0.1 * cell)
    if not values.min() < 0.0:
        raise ObjectFileError("no_volume", "The points enclose no volume above the support: is that the right plane?")
    with extra("clouds"):
        from skimage.measure import marching_cubes
    vertices, faces, _, _ = marching_cubes(values, 0.0, gradient_direction="descent")
    return Mesh((vertices * cell + origin) @ axes, faces)


def _mirror_plane(oriented: OrientedPoints, space: _Space) -> tuple[NDArray[np.float64], float]:
    """Unit normal (3,) and offset [m] of the plane square to the support that contradicts least and leaves least."""
    rng = np.random.default_rng(0)
    points = oriented.points
    shown = points[rng.choice(len(points), min(len(points), TRIED), replace=False)]
    hidden, lengths = _hidden_points(shown, space, float(np.ptp(points, axis=0).max()), rng)
    shares = lengths / lengths.sum()
    level = np.cross(space.up, np.eye(3)[np.argmin(np.abs(space.up))])
    level /= np.linalg.norm(level)
    basis = np.stack([level, np.cross(space.up, level)])

    def directions(angles: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.column_stack([np.cos(angles), np.sin(angles)]) @ basis)

    def best_of(angles: NDArray[np.float64], places: NDArray[np.float64]) -> tuple[float, float]:
        normals = directions(angles)
        free = space.free(_mirrored(shown, normals, places)).reshape(len(angles), -1)
        left = -space.free(_mirrored(hidden, normals, places)).reshape(len(angles), -1)
        costs = np.clip(free, 0.0, MAX_CONTRADICTION).mean(axis=1)
        costs += VOLUME_WEIGHT * np.clip(left / BORDER, 0.0, 1.0) @ shares
        best = int(np.argmin(costs))
        return float(angles[best]), float(places[best])

    angles = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    along = directions(angles) @ points.T
    low, wide = along.min(axis=1)[:, None], np.ptp(along, axis=1)[:, None]
    places = low + wide * np.linspace(0.1, 0.9, OFFSETS)
    angle, place = best_of(np.repeat(angles, OFFSETS), places.ravel())
    turn, move = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5))
    step_angle, step_place = np.pi / DIRECTIONS, 0.8 * float(wide.mean()) / OFFSETS
    for _ in range(REFINEMENTS):
        angle, place = best_of(angle + step_angle * turn.ravel(), place + step_place * move.ravel())
        step_angle, step_place = step_angle / FINER, step_place / FINER
    return directions(np.array([angle]))[0], place


def _hidden_points(
    shown: NDArray[np.float64], space: _Space, farthest: float, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A point (n, 3) [m] somewhere behind each seen one, down to the support, and the length of what is behind (n,)."""
    rays = shown - space.viewpoint
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    slopes, heights = -(rays @ space.up), np.maximum(shown @ space.up - space.offset, 0.0)
    lengths = np.where(slopes > MIN_SLOPE, heights / np.maximum(slopes, MIN_SLOPE), farthest)
    lengths = np.clip(lengths, 1e-6, farthest)
    return shown + (lengths * rng.uniform(size=len(shown)))[:, None] * rays, lengths


def _mirrored(
    points: NDArray[np.float64], normals: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Points (n, 3) [m] mirrored about each of the planes normals (k, 3), places (k,) [m]: (k * n, 3)."""
    away = places[:, None] - normals @ points.T  # (k, n)
    return np.asarray((points[None] + 2 * away[..., None] * normals[:, None]).reshape(-1, 3))
