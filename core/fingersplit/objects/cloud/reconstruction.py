"""The closed surface through oriented points: the level set of their winding number, drawn onto the points.

The winding number is 1 inside and 0 outside of a closed surface; its gradient is that of a layer of dipoles along the
normals [Barill2018], so it solves a Poisson equation [Kazhdan2006], here on a regular grid by Fourier transforms. Where
points are missing it closes the surface by itself.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from trimesh.graph import connected_component_labels

from fingersplit.errors import ObjectFileError
from fingersplit.extras import extra
from fingersplit.objects.cloud.normals import OrientedPoints
from fingersplit.objects.mesh import Mesh

__all__ = ["Reconstruction", "lies_beside", "part_of_mesh", "reconstruct"]

MIN_CELLS, CELLS = 24, 64
"""Along the longest extent of the points; fewer where these are sparse, ``CELLS_PER_SPACING`` to a spacing."""
CELLS_PER_SPACING = 4.0
MARGIN = 0.3
"""Of the longest extent, around the points: Fourier transforms repeat the object at the grid's end."""
OVERHANG = 2.0
"""[cells]; how far the surface may reach beyond the points."""
SMOOTHING = 1.2
"""Of the points' layer, in cells or in standard deviations of their noise, whichever is more."""
DRAWING_REACH = 2.0
"""Distance of points that a vertex is drawn onto, in their spacings or in cells, whichever is more."""
SEEN_REACH = 1.7
"""Distance of the point that makes a vertex seen, in spacings, beside the noise; by chance 1 in 9,000 has none."""
RIM = 2.0
"""[spacings]; width, beside the noise, of the border of what was seen that is not trusted: one stray point, or none,
holds it in place."""
MIN_PART = 0.05
"""Share of all points that a separate part must have to be kept."""


class Reconstruction(NamedTuple):
    """A closed surface.

    Attributes:
        mesh: The triangles.
        seen: Faces that run through points, a rim apart from where these end, (n_faces,) bool; the others were closed
            over.
    """

    mesh: Mesh
    seen: NDArray[np.bool_]


def reconstruct(
    oriented: OrientedPoints, viewpoint: NDArray[np.float64] | None = None, *, shallow: bool = False
) -> Reconstruction:
    """The closed surface through oriented points, within their bounds but for what a camera could not see behind them.

    Args:
        oriented: The points.
        viewpoint: Where the camera stood, (3,) [m]; None for a cloud from several sides.
        shallow: Whether nothing reaches farther from the camera than what it saw, as in a scene on a table.

    Raises:
        ObjectFileError: The points enclose nothing.
    """
    low, high = oriented.points.min(axis=0), oriented.points.max(axis=0)
    extent = float((high - low).max())
    cells = np.clip(CELLS_PER_SPACING * extent / oriented.spacing, MIN_CELLS, CELLS)
    cell, margin = extent / float(cells), MARGIN * extent
    origin = low - margin
    shape = [fft.next_fast_len(int(size) + 1, real=True) for size in (high - low + 2 * margin) / cell]
    winding = _winding_number(oriented, origin, cell, shape)
    at_points = map_coordinates(winding, ((oriented.points - origin) / cell).T, order=1)
    level = float(np.average(at_points, weights=oriented.areas))
    winding[_beyond_points(oriented.points, viewpoint, shallow, origin, cell, shape)] = winding.min()
    if not winding.min() < level < winding.max():
        raise ObjectFileError(
            "no_volume", "The points enclose no volume: they may lie in one plane or point every way."
        )
    with extra("clouds"):
        from skimage.measure import marching_cubes
    vertices, faces, _, _ = marching_cubes(winding, level, gradient_direction="ascent")
    mesh = _main_parts(Mesh(vertices * cell + origin, faces), oriented)
    drawn, seen = _drawn_onto_points(mesh, oriented, DRAWING_REACH * max(oriented.spacing, cell))
    trusted = seen & ~_on_rim(drawn, seen, RIM * oriented.spacing + oriented.noise)
    return Reconstruction(drawn, np.asarray(trusted[mesh.faces].all(axis=1)))


def _beyond_points(
    points: NDArray[np.float64],
    viewpoint: NDArray[np.float64] | None,
    shallow: bool,
    origin: NDArray[np.float64],
    cell: float,
    shape: list[int],
) -> NDArray[np.bool_]:
    """Grid points where no object can be: on the border, and beside all points as the camera saw them."""
    beyond = np.ones(shape, dtype=bool)
    beyond[1:-1, 1:-1, 1:-1] = False
    axes = np.eye(3)
    if viewpoint is not None:
        view = points.mean(axis=0) - viewpoint
        view /= np.linalg.norm(view)
        side = np.cross(view, axes[np.argmin(np.abs(view))])
        side /= np.linalg.norm(side)
        axes = np.stack([side, np.cross(view, side), *([view] if shallow else [])])
    steps = [start + cell * np.arange(size) for start, size in zip(origin, shape, strict=True)]
    for axis in axes:
        along = points @ axis
        places = (
            axis[0] * steps[0][:, None, None] + axis[1] * steps[1][None, :, None] + axis[2] * steps[2][None, None, :]
        )
        beyond |= (places < along.min() - OVERHANG * cell) | (places > along.max() + OVERHANG * cell)
    return beyond


def _winding_number(
    oriented: OrientedPoints, origin: NDArray[np.float64], cell: float, shape: list[int]
) -> NDArray[np.float64]:
    """Winding number at the grid points, but for a constant: the solution w of laplace(w) = -div(normals)."""
    steps = [2 * np.pi * fft.fftfreq(size, cell) for size in shape[:2]]
    steps.append(2 * np.pi * fft.rfftfreq(shape[2], cell))
    waves = np.meshgrid(*steps, indexing="ij", sparse=True)
    squared = waves[0] ** 2 + waves[1] ** 2 + waves[2] ** 2
    squared[0, 0, 0] = 1.0
    width = SMOOTHING * max(cell, oriented.noise)
    flow = np.zeros(squared.shape, dtype=np.complex128)
    for axis in range(3):
        layer = _spread(oriented.points, oriented.areas * oriented.normals[:, axis], origin, cell, shape)
        flow += waves[axis] * fft.rfftn(layer)
    flow *= 1j * np.exp(-0.5 * width**2 * squared) / squared
    return np.asarray(fft.irfftn(flow, s=shape) / cell**3)


def _spread(
    points: NDArray[np.float64], values: NDArray[np.float64], origin: NDArray[np.float64], cell: float, shape: list[int]
) -> NDArray[np.float64]:
    """Values (n,) at points shared out to the corners of their cells, in trilinear parts."""
    places = (points - origin) / cell
    first = places.astype(np.int64)
    part = places - first
    total = np.zeros(int(np.prod(shape)))
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, part, 1 - part).prod(axis=1)
        number = np.ravel_multi_index(tuple((first + corner).T), shape)
        total += np.bincount(number, weight * values, minlength=total.size)
    return total.reshape(shape)


def _main_parts(mesh: Mesh, oriented: OrientedPoints) -> Mesh:
    """Only the parts of a surface that a fair share of the points lies next to."""
    part = connected_component_labels(np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]]), len(mesh.vertices))
    beside = part[cKDTree(mesh.vertices).query(oriented.points)[1]]
    counts = np.bincount(beside, minlength=int(part.max()) + 1)
    return part_of_mesh(mesh, (counts >= MIN_PART * counts.sum())[part[mesh.faces[:, 0]]])


def part_of_mesh(mesh: Mesh, faces: NDArray[np.bool_]) -> Mesh:
    """Some faces (n_faces,) of a mesh, with their vertices."""
    used, numbers = np.unique(mesh.faces[faces], return_inverse=True)
    return Mesh(mesh.vertices[used], numbers.reshape(-1, 3).astype(np.int32))


def lies_beside(
    places: NDArray[np.float64], normals: NDArray[np.float64], oriented: OrientedPoints
) -> NDArray[np.bool_]:
    """Whether surface places (n, 3) [m] with outward normals (n, 3) have a point beside them that faces their way."""
    gaps, nearest = cKDTree(oriented.points).query(places)
    facing = np.einsum("ij,ij->i", oriented.normals[nearest], normals) > 0
    return np.asarray(facing & (gaps < SEEN_REACH * oriented.spacing + oriented.noise))


def _drawn_onto_points(mesh: Mesh, oriented: OrientedPoints, reach: float) -> tuple[Mesh, NDArray[np.bool_]]:
    """Move vertices along their normals onto the mean of the points about them, and tell which are seen."""
    vertices, normals = mesh.vertices.copy(), np.asarray(mesh.trimesh.vertex_normals)
    distances, nearby = cKDTree(oriented.points).query(vertices, 24)
    facing = np.einsum("ijk,ik->ij", oriented.normals[nearby], normals)
    weights = np.exp(-2 * (distances / reach) ** 2) * np.clip(facing, 0.0, 1.0) * oriented.areas[nearby]
    # On a curved surface points lie below the vertex's plane, and the vertex as much below theirs.
    between = 0.5 * (normals[:, None] + oriented.normals[nearby])
    heights = np.einsum("ijk,ijk->ij", oriented.points[nearby] - vertices[:, None], between)
    total = weights.sum(axis=1)
    near = (distances[:, 0] < reach) & (facing[:, 0] > 0.3) & (total > 0)
    shift = np.where(near, (weights * heights).sum(axis=1) / np.where(total > 0, total, 1.0), 0.0)
    drawn = vertices + shift[:, None] * normals
    gaps, _ = cKDTree(oriented.points).query(drawn)
    return Mesh(drawn, mesh.faces), near & (gaps < SEEN_REACH * oriented.spacing + oriented.noise)


def _on_rim(mesh: Mesh, seen: NDArray[np.bool_], width: float) -> NDArray[np.bool_]:
    """Vertices that an unseen one is within ``width`` of, on the same side of the object."""
    if seen.all():
        return np.zeros_like(seen)
    normals = np.asarray(mesh.trimesh.vertex_normals)
    distances, nearby = cKDTree(mesh.vertices[~seen]).query(mesh.vertices, 8, distance_upper_bound=width)
    beside = np.isfinite(distances)
    facing = np.einsum("ijk,ik->ij", normals[~seen][np.where(beside, nearby, 0)], normals) > 0
    return np.asarray((beside & facing).any(axis=1))
