"""What workers make of a finished job for people and other tools: pictures, recordings, curves, exports."""

import gzip
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.constraints import load_obstacle
from fingersplit_service.jobs.hand_work import stored_hand
from fingersplit_service.jobs.stored_objects import convex_pieces, prepared_object
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.hands.hand import Hand
    from fingersplit.objects.model import ObjectModel
    from fingersplit.recording.replay import ReplayedGrasp

__all__ = [
    "ExportedFile",
    "RenderTask",
    "ViewName",
    "best_rank",
    "convert_result",
    "render_in_advance",
    "render_view",
    "render_views",
]

ViewName = Literal[
    "picture.png", "thumbnail.webp", "animation.webp", "recording.rrd", "curve.json", "scene.json.gz", "motion.json.gz"
]
"""What can be made of a grasp for people to look at."""

_SIMULATED = ("recording.rrd", "motion.json.gz")


@dataclass(frozen=True)
class RenderTask:
    """A view of one grasp for a worker to make, from the job as it is stored.

    Attributes:
        name: The view.
        job_id: The job.
        rank: Rank of the grasp, from 1.
        object_name: Name of the object for people.
        request: What the job asked for.
        result: Its result document, JSON.
    """

    name: ViewName
    job_id: str
    rank: int
    object_name: str
    request: JobCreate
    result: str


@dataclass(frozen=True)
class ExportedFile:
    """A result as a file of another tool, with its ending and media type."""

    content: bytes
    suffix: str
    media_type: str


class _Verdict(Protocol):
    @property
    def passed(self) -> bool: ...


class _Ranked(Protocol):
    """A grasp of a result, as core or the wire types have it."""

    @property
    def rank(self) -> int: ...
    @property
    def verification(self) -> _Verdict | None: ...


def best_rank(grasps: Sequence[_Ranked]) -> int | None:
    """Rank of the grasp that stands for a run: the first that held in simulation, else the first, None without any."""
    held = [grasp for grasp in grasps if grasp.verification is not None and grasp.verification.passed]
    return next((grasp.rank for grasp in held or grasps), None)


def convert_result(storage: Storage, result: str, format_name: str, rank: int | None) -> ExportedFile:
    """Write a result document, JSON, in another tool's format; of one rank or of all grasps that can be executed.

    Raises:
        FormatError: Unknown format, or the result has no grasp to write.
        ResultError: The result is of another version, or has no such rank, or its hand was altered.
        UnknownHandError: Its hand was deleted.
    """
    from fingersplit.formats import export_file
    from fingersplit.result import PlanResult

    planned = PlanResult.from_dict(json.loads(result))
    file = export_file(planned, format_name, rank=rank, hand=stored_hand(storage, planned.hand))
    return ExportedFile(file.content, file.suffix, file.media_type)


def render_view(storage: Storage, task: RenderTask) -> None:
    """Make what somebody wants to look at, from the stored result alone; the job's folder must be there.

    Raises:
        ResultError: The result is of another version, or the grasp could not be reproduced.
        FileNotFoundError: The job was deleted meanwhile.
    """
    render_views(storage, task, (task.name,))


def render_views(storage: Storage, task: RenderTask, names: Sequence[ViewName]) -> None:
    """Make several views of one grasp, which is reproduced once for all of them; else as `render_view`."""
    from fingersplit.recording.replay import replay
    from fingersplit.result import PlanResult

    if not names:
        return
    object_id, result = task.request.object_id, PlanResult.from_dict(json.loads(task.result))
    model = prepared_object(storage, object_id, task.object_name)
    hand = result.active_grip(stored_hand(storage, result.hand))
    simulated = any(name in _SIMULATED for name in names)
    pieces = (lambda: convex_pieces(storage, object_id)) if simulated else None
    replayed = replay(result, task.rank, model, hand, pieces, partial(load_obstacle, storage))
    for name in names:
        with storage.atomic(storage.view(task.job_id, task.rank, name), durable=False, make_folder=False) as staged:
            _render(name, staged, replayed, model, hand)


def _render(name: ViewName, staged: Path, replayed: "ReplayedGrasp", model: "ObjectModel", hand: "Hand") -> None:
    from fingersplit.recording.pictures import draw_animation, draw_picture, draw_thumbnail, surrounding_layers

    match name:
        case "picture.png":
            draw_picture(staged, replayed, model, hand)
        case "thumbnail.webp":
            around = surrounding_layers(replayed, model)
            draw_thumbnail(staged, replayed.grasp.for_hand(hand), model, hand, around)
        case "animation.webp":
            draw_animation(staged, replayed, model, hand)
        case "curve.json":
            staged.write_text(_curve(replayed))
        case "scene.json.gz":
            from fingersplit.recording.web_scene import grasp_scene

            staged.write_bytes(_compressed(grasp_scene(replayed, model, hand)))
        case "motion.json.gz":
            from fingersplit.recording.web_scene import motion_scene

            staged.write_bytes(_compressed(motion_scene(replayed.frames)))
        case "recording.rrd":
            from fingersplit.recording.run_recording import write_recording  # loads rerun: only who records

            write_recording(staged, replayed, model, hand)


def render_in_advance(render: Callable[[Storage, RenderTask], None], storage: Storage, task: RenderTask) -> None:
    """Make a view that somebody is going to want, unless it is there or job or object were deleted meanwhile."""
    view = storage.view(task.job_id, task.rank, task.name)
    if view.parent.exists() and storage.exists(storage.shape(task.request.object_id)) and not storage.exists(view):
        with suppress(FileNotFoundError):
            render(storage, task)


def _compressed(document: dict[str, Any]) -> bytes:
    return gzip.compress(json.dumps(document, separators=(",", ":")).encode(), 6, mtime=0)


def _curve(replayed: "ReplayedGrasp") -> str:
    """Phase, quality and largest residual [m] of every accepted state, JSON."""
    curve = replayed.curve
    document = {"phases": curve.phases, "quality": curve.quality.tolist(), "residual": curve.residual.tolist()}
    return json.dumps(document)
