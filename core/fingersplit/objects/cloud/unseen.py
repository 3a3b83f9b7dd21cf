"""What a view could not see: the space behind the seen surface, which may or may not be object.

Plans keep out of it as if it were object. How deep it reaches is not known; taken is the lesser width of the object as
seen, or the depth of what was seen if that is more.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, distance_transform_edt, grey_closing

from fingersplit.objects.cloud.checks import ONE_SIDED
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.signed_distance import DistanceGrid

__all__ = ["estimate_viewpoint", "hide_unseen"]

DISTANCE = 10.0
"""[m]; of a viewpoint of which only the direction is known."""


def estimate_viewpoint(
    points: NDArray[np.float64], normals: NDArray[np.float64], areas: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Where a cloud was seen from, (3,) [m], from the mean of its normals; None if it was seen from several sides."""
    mean = np.average(normals, axis=0, weights=areas)
    length = np.linalg.norm(mean)
    return np.asarray(points.mean(axis=0) + DISTANCE * mean / length) if length > ONE_SIDED else None


def hide_unseen(
    distance: DistanceGrid, seen: Mesh, viewpoint: NDArray[np.float64]
) -> tuple[DistanceGrid, NDArray[np.float64]]:
    """Make the space behind a seen surface part of the object.

    Args:
        distance: Signed distance to the closed surface.
        seen: The seen part of the surface, facing the viewpoint.
        viewpoint: Where the camera stood, (3,) [m].

    Returns:
        The signed distance to the object and to what may be object, and the points where that begins, (n, 3) [m].
    """
    grid = np.stack(np.meshgrid(*map(np.arange, distance.values.shape), indexing="ij"), axis=-1)
    places = np.array(distance.origin) + distance.cell * grid.reshape(-1, 3)
    hidden = _is_hidden(places, seen, viewpoint, distance.cell).reshape(distance.values.shape)
    depth = distance_transform_edt(hidden, sampling=distance.cell) - distance.cell / 2
    outside = distance_transform_edt(~hidden, sampling=distance.cell) - distance.cell / 2
    values = np.minimum(distance.values, np.where(hidden, -depth, outside)).astype(np.float32)
    border = hidden & ~binary_erosion(hidden) & (distance.values > distance.cell)
    values.setflags(write=False)
    return distance._replace(values=values), places.reshape(*hidden.shape, 3)[border]


def _is_hidden(
    places: NDArray[np.float64], seen: Mesh, viewpoint: NDArray[np.float64], cell: float
) -> NDArray[np.bool_]:
    """Whether each place lies behind the seen surface, and no deeper than the object may reach."""
    axis = seen.vertices.mean(axis=0) - viewpoint
    axis /= np.linalg.norm(axis)
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    camera = np.stack([side, np.cross(axis, side), axis])
    surface, points = (seen.vertices - viewpoint) @ camera.T, (places - viewpoint) @ camera.T
    surface[:, :2] /= surface[:, 2:]
    near, far = surface[:, 2].min(), surface[:, 2].max()
    pixel = 1.5 * cell / surface[:, 2].mean()
    low, high = surface[:, :2].min(axis=0), surface[:, :2].max(axis=0)
    size = np.ceil((high - low) / pixel).astype(np.int64) + 1
    image = np.full(size, np.inf)
    np.minimum.at(image, tuple(np.rint((surface[:, :2] - low) / pixel).astype(np.int64).T), surface[:, 2])
    # Pixels between vertices are closed over; what lies nowhere behind the surface stays at infinity.
    image = -grey_closing(np.pad(-image, 2, constant_values=-np.inf), size=(3, 3))[2:-2, 2:-2]
    deepest = max(far, near + float((high - low).min() * surface[:, 2].mean()))
    hidden = (points[:, 2] > near) & (points[:, 2] < deepest)
    pixels = np.rint((points[hidden, :2] / points[hidden, 2:] - low) / pixel).astype(np.int64)
    on_image = ((pixels >= 0) & (pixels < size)).all(axis=1)
    depths = np.full(len(pixels), np.inf)
    depths[on_image] = image[tuple(pixels[on_image].T)]
    hidden[hidden] = points[hidden, 2] > depths + cell
    return np.asarray(hidden)
