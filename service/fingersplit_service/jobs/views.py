"""What workers make of a finished job for people and other tools: pictures, recordings, exports."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from fingersplit_service.jobs.stored_objects import prepared_object
from fingersplit_service.storage import Storage

__all__ = [
    "DrawTask",
    "ExportedFile",
    "ViewName",
    "ViewOrder",
    "best_rank",
    "convert_result",
    "draw_in_advance",
    "draw_view",
]

ViewName = Literal["picture.png", "thumbnail.webp", "animation.webp", "recording.rrd"]
"""What can be made of a grasp for people to look at."""


@dataclass(frozen=True)
class ViewOrder:
    """A view of one grasp for a worker to make; the friction is what the job says, None for the default."""

    name: ViewName
    job_id: str
    rank: int
    object_id: str
    object_name: str
    friction: float | None


@dataclass(frozen=True)
class ExportedFile:
    """A result as a file of another tool, with its ending and media type."""

    content: bytes
    suffix: str
    media_type: str


DrawTask = Callable[[Storage, ViewOrder], None]


def best_rank(grasps: Sequence[dict[str, Any]]) -> int | None:
    """Rank of the grasp that stands for a run: the first that held in simulation, else the first, None without any."""
    held = [grasp for grasp in grasps if grasp["verification"] and grasp["verification"]["passed"]]
    ranks = [int(grasp["rank"]) for grasp in held or grasps]
    return ranks[0] if ranks else None


def convert_result(result: str, format_name: str, rank: int | None) -> ExportedFile:
    """Write a result document, JSON, in another tool's format; of one rank or of all feasible grasps.

    Raises:
        ExchangeError: The result has no grasp to write.
    """
    from fingersplit.formats import EXPORT_FORMATS, export

    chosen = EXPORT_FORMATS[format_name]
    return ExportedFile(export(json.loads(result), format_name, rank=rank), chosen.suffix, chosen.media_type)


def draw_view(storage: Storage, order: ViewOrder) -> None:
    """Make what somebody wants to look at out of the traces that a job kept."""
    from fingersplit.contacts.friction import planned_friction
    from fingersplit.recording import stored

    model = prepared_object(storage, order.object_id, order.object_name)
    mesh, traces = model.mesh, storage.traces(order.job_id)
    with storage.atomic(storage.view(order.job_id, order.rank, order.name), durable=False) as staged:
        if order.name == "picture.png":
            stored.draw_stored(traces, mesh, order.rank, staged)
        elif order.name == "thumbnail.webp":
            stored.thumbnail_stored(traces, mesh, order.rank, staged)
        elif order.name == "animation.webp":
            stored.animate_stored(traces, mesh, order.rank, staged)
        else:
            friction = planned_friction(order.friction, model.options.friction)
            stored.record_stored(traces, model, order.rank, staged, friction)


def draw_in_advance(draw: DrawTask, storage: Storage, order: ViewOrder) -> None:
    """Make a view that somebody is going to want, unless it is there or the run or its object was deleted meanwhile."""
    traces, shape, view = storage.traces(order.job_id), storage.shape(order.object_id), storage.view
    if traces.exists() and shape.exists() and not view(order.job_id, order.rank, order.name).exists():
        draw(storage, order)
        if not traces.exists():
            storage.remove_job(order.job_id)
