"""From a point cloud to an object: contacts on the seen surface only, collision also with what was not seen."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import MeshError
from fingersplit.objects.cloud.normals import orient_points
from fingersplit.objects.cloud.point_cloud import PointCloud
from fingersplit.objects.cloud.reconstruction import part_of_mesh, reconstruct
from fingersplit.objects.cloud.unseen import estimate_viewpoint, hide_unseen
from fingersplit.objects.fairing import fair
from fingersplit.objects.grid import build_grid, thin_evenly
from fingersplit.objects.mass import mass_properties
from fingersplit.objects.model import COLLISION_POINTS, ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.packing import frozen
from fingersplit.objects.patches import build_patches
from fingersplit.objects.signed_distance import build_distance_grid
from fingersplit.objects.supervoxels import cluster_supervoxels
from fingersplit.objects.surface import sample_surface
from fingersplit.objects.triangle_grid import bin_triangles

__all__ = ["MIN_POINTS", "check_cloud", "prepare_cloud"]

MIN_POINTS = 200
"""With fewer there is no telling normals from noise."""
FAIRING = 8.0
"""Length of waves that fairing halves, in standard deviations of a cloud's noise."""
_NO_THICKNESS = 1e-4  # of the extent


def prepare_cloud(cloud: PointCloud, name: str = "object", options: ObjectOptions | None = None) -> ObjectModel:
    """Prepare a point cloud for planning; the same cloud and options always give the same model.

    The surface through the points carries the contacts. What closes it where nothing was seen, and in a cloud from one
    view the space behind it, counts as object in collision tests and carries none.

    Args:
        cloud: One view or several merged, with noise and outliers.
        name: What people call it.
        options: Mass, friction, and a fairing that counts where it is more than the cloud's noise asks for.

    Raises:
        MeshError: The points are too few, or enclose nothing.
    """
    options = options or ObjectOptions()
    check_cloud(cloud.points)
    oriented = orient_points(cloud)
    rough, is_seen = reconstruct(oriented)
    if not is_seen.any():
        raise MeshError("no_volume", "No surface runs through the points: they are scattered in space.")
    closed = fair(rough, max(options.fairing, FAIRING * oriented.noise))
    seen_part = part_of_mesh(closed, is_seen)
    surface = sample_surface(seen_part)
    supervoxels = cluster_supervoxels(surface, COLLISION_POINTS)
    whole = sample_surface(closed)
    distance = build_distance_grid(closed, whole, surface)
    viewpoint = cloud.viewpoint
    if viewpoint is None:
        viewpoint = estimate_viewpoint(oriented.points, oriented.normals, oriented.areas)
    obstacles = [supervoxels.centers, whole.grid.points]
    if viewpoint is not None:
        distance, beginnings = hide_unseen(distance, seen_part, viewpoint)
        obstacles.append(beginnings)
    spacing = whole.spacing * (len(whole.normals) / COLLISION_POINTS) ** 0.5
    points = np.concatenate(obstacles)
    return ObjectModel(
        name=name,
        content_hash=cloud.content_hash,
        options=options,
        mesh=closed,
        surface=frozen(surface),
        supervoxels=supervoxels,
        collision=frozen(build_grid(points[thin_evenly(points, spacing)], 2.0 * spacing)[0]),
        distance=distance,
        triangles=bin_triangles(closed),
        patches=build_patches(seen_part, surface),
        mass_properties=frozen(mass_properties(closed, options)),
        seen=seen_part.area / closed.area,
    )


def check_cloud(points: NDArray[np.float64]) -> None:
    """Refuse points (n, 3) that are too few or too flat to show a solid.

    Raises:
        MeshError: With what is wrong.
    """
    if len(points) < MIN_POINTS:
        raise MeshError(
            "too_few_points",
            f"The cloud has {len(points):,} points that are finite, different and no outliers; at least "
            f"{MIN_POINTS:,} are needed to know a surface.",
        )
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points, rowvar=False)), 0))
    if spread[0] <= _NO_THICKNESS * spread[2]:
        raise MeshError("no_volume", "The points lie in one plane or on one line: they show no solid to be held.")
