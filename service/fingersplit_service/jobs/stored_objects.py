"""Objects as workers keep and load them: the shape for ever, what is computed of it in a cache on disk."""

import hashlib
import json
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.objects.cache import ContentCache
    from fingersplit.objects.cloud import PointCloud
    from fingersplit.objects.convex_pieces import ConvexPieces
    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.model import ObjectModel
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.splitting.settings import PlannerSettings

__all__ = ["convex_pieces", "keep_object", "planner_settings", "prepared_object"]

_PREPARED_OBJECTS = 8  # kept ready by each worker


def keep_object(storage: Storage, shape: "Mesh | PointCloud", options: "ObjectOptions") -> tuple[str, "ObjectModel"]:
    """Keep a checked object and prepare it.

    Returns:
        Its id, which stands for shape and options, and the prepared object.

    Raises:
        MeshError: No surface runs through the points of a cloud.
    """
    import numpy as np

    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.preparing import prepare_cached

    object_id = _object_id(shape.content_hash, options)
    model = prepare_cached(_cache(storage), object_id, lambda: shape, object_id, options)
    path = storage.shape(object_id)
    if not path.exists():
        names = ("vertices", "faces") if isinstance(shape, Mesh) else ("points", "normals", "viewpoint")
        arrays = {name: getattr(shape, name) for name in names if getattr(shape, name) is not None}
        with storage.atomic(path) as staged:
            np.savez(staged, options=np.array(json.dumps(options.to_document())), **arrays)
    return object_id, model


def prepared_object(storage: Storage, object_id: str, object_name: str) -> "ObjectModel":
    """An object ready to be planned for; ``content_hash`` is its id here."""
    return replace(_prepared(storage, object_id), name=object_name)


def convex_pieces(storage: Storage, object_id: str) -> "ConvexPieces":
    """An object for simulations; computed once, whoever asks first."""
    from fingersplit.compilation import kernel_cache_folder
    from fingersplit.objects.convex_pieces import ConvexPieces, decompose

    sources = kernel_cache_folder("fingersplit.objects.convex_pieces").name
    arrays = _cache(storage).fetch(
        f"pieces-{object_id}-{sources}", lambda: decompose(_prepared(storage, object_id).mesh).to_arrays()
    )
    return ConvexPieces.from_arrays(arrays)


def planner_settings(asked: dict[str, Any]) -> tuple["PlannerSettings", float | None]:
    """The planner's settings, and the friction that a request names among them."""
    from fingersplit.contacts.friction import without_friction
    from fingersplit.splitting.settings import PlannerSettings

    named, friction = without_friction(asked)
    return PlannerSettings.from_document(named), friction


@lru_cache(maxsize=_PREPARED_OBJECTS)
def _prepared(storage: Storage, object_id: str) -> "ObjectModel":
    import numpy as np

    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.preparing import prepare_cached

    with np.load(storage.shape(object_id), allow_pickle=False) as stored:
        known = json.loads(str(stored["options"])) if "options" in stored else {}  # older files are meshes without
    options = ObjectOptions.from_document(known)
    model = prepare_cached(_cache(storage), object_id, lambda: _shape(storage, object_id), object_id, options)
    return replace(model, content_hash=object_id)


def _shape(storage: Storage, object_id: str) -> "Mesh | PointCloud":
    import numpy as np

    from fingersplit.objects.cloud import PointCloud
    from fingersplit.objects.mesh import Mesh

    with np.load(storage.shape(object_id), allow_pickle=False) as stored:
        if "points" in stored:
            return PointCloud(stored["points"], stored.get("normals"), stored.get("viewpoint"))
        return Mesh(stored["vertices"], stored["faces"])


def _object_id(content_hash: str, options: "ObjectOptions") -> str:
    """An id for a shape with options; that of a shape alone is its hash."""
    from fingersplit.objects.options import ObjectOptions

    if options == ObjectOptions():
        return content_hash
    return hashlib.sha256(f"{content_hash} {options.content_hash}".encode()).hexdigest()[:32]


def _cache(storage: Storage) -> "ContentCache":
    from fingersplit.objects.cache import ContentCache

    return ContentCache(storage.cache, storage.cache_bytes)
