"""From a point cloud to the outline of an object."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.objects.cloud.completion import complete
from fingersplit.objects.cloud.normals import OrientedPoints, orient_points
from fingersplit.objects.cloud.outline import Outline
from fingersplit.objects.cloud.planes import scene_share
from fingersplit.objects.cloud.point_cloud import PointCloud
from fingersplit.objects.cloud.reconstruction import part_of_mesh, reconstruct
from fingersplit.objects.cloud.unseen import estimate_viewpoint
from fingersplit.objects.fairing import fair
from fingersplit.objects.solid import moments_of

__all__ = ["MIN_POINTS", "check_cloud", "close_cloud"]

MIN_POINTS = 200
"""With fewer there is no telling normals from noise."""
FAIRING = 8.0
"""Length of waves that fairing halves, in standard deviations of a cloud's noise."""
MAX_FAIRING = 0.25
"""Most of that length, in longest extents: what few points show as noise is the object's own curvature."""
DETAIL = 0.75
"""Least distance of surface samples, in spacings of a cloud."""
_NO_THICKNESS = 1e-4  # of the extent


def close_cloud(cloud: PointCloud, fairing: float = 0.0) -> Outline:
    """The closed surface through a cloud, and the part of it that was seen.

    With a known support, a cloud from one view is completed by what is assumed, and all of that carries contacts.

    Args:
        cloud: One view or several merged, with noise and outliers.
        fairing: Counts where it is more than the cloud's noise asks for [m].

    Raises:
        ObjectFileError: The points are too few, or enclose nothing.
    """
    check_cloud(cloud.points)
    oriented = orient_points(cloud)
    viewpoint = cloud.viewpoint
    if viewpoint is None:
        viewpoint = estimate_viewpoint(oriented.points, oriented.normals, oriented.areas)
    if viewpoint is not None and cloud.support is not None:
        return _completed(oriented, viewpoint, cloud.support, fairing)
    scene = viewpoint is not None and scene_share(oriented.points, viewpoint) > 0
    rough, is_seen = reconstruct(oriented, viewpoint, shallow=scene)
    if not is_seen.any():
        raise ObjectFileError("no_volume", "No surface runs through the points: they are scattered in space.")
    if moments_of(rough.vertices, rough.faces).volume <= 0:
        raise ObjectFileError(
            "inside_out",
            "The points enclose no volume: their normals point inwards, or every way. Normals must point out of the "
            "object; without them, say where the camera stood (viewpoint).",
        )
    noise = min(FAIRING * oriented.noise, MAX_FAIRING * float(rough.extents.max()))
    closed = fair(rough, max(fairing, noise))
    hidden_from = None if scene else viewpoint  # a table hides nothing that a hand would have to keep clear of
    return Outline(closed, part_of_mesh(closed, is_seen), hidden_from, DETAIL * oriented.spacing)


def _completed(
    oriented: OrientedPoints, viewpoint: NDArray[np.float64], support: NDArray[np.float64], fairing: float
) -> Outline:
    closed = complete(oriented, viewpoint, support)
    if fairing > 0:
        closed = fair(closed, fairing)
    return Outline(closed, closed, None, DETAIL * oriented.spacing, oriented)


def check_cloud(points: NDArray[np.float64]) -> None:
    """Refuse points (n, 3) that are too few or too flat to show a solid.

    Raises:
        ObjectFileError: With what is wrong.
    """
    if len(points) < MIN_POINTS:
        raise ObjectFileError(
            "too_few_points",
            f"The cloud has {len(points):,} points that are finite, different and no outliers; at least "
            f"{MIN_POINTS:,} are needed to know a surface.",
        )
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points, rowvar=False)), 0))
    if spread[0] <= _NO_THICKNESS * spread[2]:
        raise ObjectFileError("no_volume", "The points lie in one plane or on one line: they show no solid to be held.")
