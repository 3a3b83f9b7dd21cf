"""Objects as workers keep and load them: the shape for ever, what is computed of it in a cache on disk."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.cache import ContentCache
    from fingersplit.objects.cloud import PointCloud
    from fingersplit.objects.convex_pieces import ConvexPieces
    from fingersplit.objects.intake import CloudReport, IntakeReport
    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.model import ObjectModel
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.source import ObjectSource
    from fingersplit.splitting.settings import PlannerSettings

__all__ = ["convex_pieces", "keep_object", "planner_settings", "prepared_object"]

_PREPARED_OBJECTS = 8  # kept ready by each worker


def keep_object(
    storage: Storage,
    shape: "Mesh | PointCloud",
    options: "ObjectOptions",
    source: "ObjectSource",
    report: "IntakeReport | CloudReport",
) -> "ObjectModel":
    """Keep a checked object and prepare it.

    Raises:
        ObjectFileError: No surface runs through the points of a cloud.
    """
    import numpy as np

    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.model import object_id as model_id
    from fingersplit.objects.preparing import prepare_cached

    object_id = model_id(shape.content_hash, options)
    model = prepare_cached(_cache(storage), object_id, lambda: shape, object_id, options, source, report)
    path = storage.shape(object_id)
    try:
        storage.claim(path)
    except FileNotFoundError:
        names = ("vertices", "faces") if isinstance(shape, Mesh) else ("points", "normals", "viewpoint", "support")
        arrays = {name: getattr(shape, name) for name in names if getattr(shape, name) is not None}
        with storage.atomic(path) as staged:
            for said, part in (("options", options), ("source", source), ("report", report)):
                arrays[said] = np.array(json.dumps(part.to_document()))
            np.savez(staged, allow_pickle=False, **arrays)
    return model


def prepared_object(storage: Storage, object_id: str, object_name: str) -> "ObjectModel":
    """An object ready to be planned for."""
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


def planner_settings(asked: Mapping[str, Any]) -> tuple["PlannerSettings", float | None]:
    """The planner's settings, and the friction that a request names among them."""
    from fingersplit.contacts.friction import without_friction
    from fingersplit.splitting.settings import PlannerSettings

    named, friction = without_friction(asked)
    return PlannerSettings.from_document(named), friction


@lru_cache(maxsize=_PREPARED_OBJECTS)
def _prepared(storage: Storage, object_id: str) -> "ObjectModel":
    import numpy as np

    from fingersplit.objects.intake.report import report_from_document
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.preparing import prepare_cached
    from fingersplit.objects.source import ObjectSource

    with np.load(storage.local(storage.shape(object_id)), allow_pickle=False) as stored:
        known = {name: json.loads(str(stored[name])) for name in ("options", "source", "report") if name in stored}
    options = ObjectOptions.from_document(known.get("options", {}))  # older files have none of them, or options only
    source = ObjectSource.from_document(known.get("source", {}))
    report = report_from_document(known["report"]) if "report" in known else None
    cache = _cache(storage)
    return prepare_cached(cache, object_id, lambda: _shape(storage, object_id), object_id, options, source, report)


def _shape(storage: Storage, object_id: str) -> "Mesh | PointCloud":
    import numpy as np

    from fingersplit.objects.cloud import PointCloud
    from fingersplit.objects.mesh import Mesh

    with np.load(storage.local(storage.shape(object_id)), allow_pickle=False) as stored:
        if "points" in stored:
            return PointCloud(*(stored.get(name) for name in ("points", "normals", "viewpoint", "support")))
        return Mesh(stored["vertices"], stored["faces"])


def _cache(storage: Storage) -> "ContentCache":
    from fingersplit.cache import ContentCache

    if storage.shared is not None:
        from fingersplit_service.jobs.shared_cache import SharedCache

        return SharedCache(storage.cache, storage.cache_bytes, storage.shared.with_short_timeouts)
    return ContentCache(storage.cache, storage.cache_bytes)
