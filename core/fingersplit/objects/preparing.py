"""From a shape to a prepared object, also through a cache that processes share."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fingersplit.cache import ContentCache
from fingersplit.compilation import kernel_cache_folder
from fingersplit.objects.cloud import OrientedPoints, Outline, PointCloud, close_cloud, hide_unseen, lies_beside
from fingersplit.objects.fairing import fair
from fingersplit.objects.grid import PointGrid
from fingersplit.objects.grid_kernel import build_grid, thin_evenly
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.mass import mass_properties
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.packing import frozen
from fingersplit.objects.patches import build_patches
from fingersplit.objects.signed_distance import DistanceGrid, build_distance_grid
from fingersplit.objects.source import ObjectSource
from fingersplit.objects.supervoxels import Supervoxels, cluster_supervoxels
from fingersplit.objects.surface import Surface, sample_surface
from fingersplit.objects.triangle_grid import bin_triangles

__all__ = ["COLLISION_POINTS", "prepare_cached", "prepare_object"]

COLLISION_POINTS = 2_000


def prepare_object(
    shape: Mesh | PointCloud,
    name: str = "object",
    options: ObjectOptions | None = None,
    source: ObjectSource | None = None,
    report: IntakeReport | CloudReport | None = None,
) -> ObjectModel:
    """Prepare a mesh or a point cloud for planning; the same shape and options always give the same model.

    Of a cloud, the surface through the points carries the contacts. What closes it where nothing was seen, and in a
    cloud from one view the space behind it, counts as object in collision tests and carries none. Where a cloud says
    what it stands on, the other side is assumed instead, and carries contacts like the seen one,
    but its samples are marked.

    Args:
        shape: From intake, parametric, or arrays in metres.
        name: What people call it.
        options: Mass, friction and fairing; None for the defaults.
        source: How its file became metres; None for an object that came as arrays.
        report: What intake found in its file and did; None for an object that came as arrays.

    Raises:
        ObjectFileError: The points of a cloud are too few, or enclose nothing.
    """
    options = options or ObjectOptions()
    outline = close_cloud(shape, options.fairing) if isinstance(shape, PointCloud) else _outline(shape, options)
    surface = sample_surface(outline.seen, outline.detail)
    whole = surface if outline.seen is outline.closed else sample_surface(outline.closed, outline.detail)
    supervoxels = cluster_supervoxels(surface, COLLISION_POINTS)
    distance = build_distance_grid(outline.closed, whole, None if surface is whole else surface)
    collision, distance = _obstacles(outline, whole, supervoxels, distance)
    assumed = _assumed(surface, outline.shown)
    return ObjectModel(
        name=name,
        shape_hash=shape.content_hash,
        options=options,
        source=source or ObjectSource(),
        report=report,
        mesh=outline.closed,
        surface=frozen(surface),
        supervoxels=supervoxels,
        collision=frozen(collision),
        distance=distance,
        triangles=bin_triangles(outline.closed),
        patches=build_patches(outline.seen, surface),
        mass_properties=frozen(mass_properties(outline.closed, options)),
        seen=1.0 - float(assumed.mean()) if outline.seen is outline.closed else outline.seen.area / outline.closed.area,
        assumed_samples=assumed,
        support=shape.support if isinstance(shape, PointCloud) else None,
    )


def prepare_cached(
    cache: ContentCache,
    key: str,
    load: Callable[[], Mesh | PointCloud],
    name: str = "object",
    options: ObjectOptions | None = None,
    source: ObjectSource | None = None,
    report: IntakeReport | CloudReport | None = None,
) -> ObjectModel:
    """Take a prepared object out of a cache, or prepare it and put it there.

    Args:
        cache: Where prepared objects are kept.
        key: The object's id, which stands for its shape and options; see `object_id`.
        load: Called for the mesh or cloud if it has to be prepared.
        name: What people call the object.
        options: Mass, friction and fairing; None for the defaults.
        source: How its file became metres.
        report: What intake found in its file and did.
    """
    options, source = options or ObjectOptions(), source or ObjectSource()
    # Objects that other sources prepared are other objects; the folder's name stands for these.
    sources = kernel_cache_folder("fingersplit.objects.preparing").name
    arrays = cache.fetch(f"object-{key}-{sources}", lambda: prepare_object(load(), name, options).to_arrays())
    return ObjectModel.from_arrays(arrays, name, options, source, report)


def _outline(mesh: Mesh, options: ObjectOptions) -> Outline:
    shape = fair(mesh, options.fairing) if options.fairing > 0 else mesh
    return Outline(shape, shape, None)


def _assumed(surface: Surface, shown: OrientedPoints | None) -> NDArray[np.bool_]:
    """Which samples of a surface (n,) no point shows."""
    assumed = np.zeros(len(surface.normals), bool)
    if shown is not None:
        assumed = ~lies_beside(surface.grid.points, surface.normals, shown)
    assumed.setflags(write=False)
    return assumed


def _obstacles(
    outline: Outline, whole: Surface, supervoxels: Supervoxels, distance: DistanceGrid
) -> tuple[PointGrid, DistanceGrid]:
    """Points for collision tests, and the signed distance that counts what was not seen as inside."""
    spacing = whole.spacing * (len(whole.normals) / COLLISION_POINTS) ** 0.5
    if outline.seen is outline.closed:
        return build_grid(supervoxels.centers, 2.0 * spacing)[0], distance
    obstacles = [supervoxels.centers, whole.grid.points]
    if outline.viewpoint is not None:
        distance, beginnings = hide_unseen(distance, outline.seen, outline.viewpoint)
        obstacles.append(beginnings)
    points = np.concatenate(obstacles)
    return build_grid(points[thin_evenly(points, spacing)], 2.0 * spacing)[0], distance
