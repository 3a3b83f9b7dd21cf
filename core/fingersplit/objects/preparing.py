"""Prepared objects by the content they were prepared from, through a cache that processes share."""

from collections.abc import Callable

from fingersplit.compilation import kernel_cache_folder
from fingersplit.objects.cache import ContentCache
from fingersplit.objects.cloud import PointCloud, prepare_cloud
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel, prepare_object
from fingersplit.objects.options import ObjectOptions

__all__ = ["prepare", "prepare_cached"]


def prepare(shape: Mesh | PointCloud, name: str = "object", options: ObjectOptions | None = None) -> ObjectModel:
    """Prepare a mesh or a point cloud for planning."""
    if isinstance(shape, PointCloud):
        return prepare_cloud(shape, name, options)
    return prepare_object(shape, name, options)


def prepare_cached(
    cache: ContentCache,
    content_hash: str,
    load: Callable[[], Mesh | PointCloud],
    name: str = "object",
    options: ObjectOptions | None = None,
) -> ObjectModel:
    """Take a prepared object out of a cache, or prepare it and put it there.

    Args:
        cache: Where prepared objects are kept.
        content_hash: Hash of the mesh or cloud.
        load: Called for the mesh or cloud if it has to be prepared.
        name: What people call the object.
        options: Mass, friction and fairing; None for the defaults.
    """
    options = options or ObjectOptions()
    # Objects that other sources prepared are other objects; the folder's name stands for these.
    sources = kernel_cache_folder("fingersplit.objects.preparing").name
    key = f"object-{content_hash}-{options.content_hash}-{sources}"
    arrays = cache.fetch(key, lambda: prepare(load(), name, options).to_arrays())
    return ObjectModel.from_arrays(arrays, name, options)
