"""What workers make of a finished job for people and other tools: pictures, recordings, curves, exports."""

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.replaying import replay_grasp
from fingersplit_service.jobs.stored_objects import prepared_object
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.recording.recorded_run import RecordedRun
    from fingersplit.recording.scene import GraspView

__all__ = [
    "ExportedFile",
    "RenderTask",
    "ViewName",
    "best_rank",
    "convert_result",
    "render_in_advance",
    "render_view",
]

ViewName = Literal["picture.png", "thumbnail.webp", "animation.webp", "recording.rrd", "curve.json"]
"""What can be made of a grasp for people to look at."""


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


def render_view(storage: Storage, task: RenderTask) -> None:
    """Make what somebody wants to look at; the job's folder must be there.

    Raises:
        ResultError: The grasp could not be reproduced.
        FileNotFoundError: The job was deleted meanwhile.
    """
    from fingersplit.hands.hand import load_hand
    from fingersplit.recording.moving_picture import draw_moving_picture, draw_thumbnail
    from fingersplit.recording.picture import QualityCurve, draw_grasp

    model, hand = prepared_object(storage, task.request.object_id, task.object_name), load_hand(task.request.hand)
    simulate = task.name == "recording.rrd"
    run = replay_grasp(storage, model, hand, task.request, task.result, task.rank, simulate=simulate)
    last = len(run.trace) - 1
    with storage.atomic(storage.view(task.job_id, task.rank, task.name), durable=False, make_folder=False) as staged:
        match task.name:
            case "picture.png":
                phases, quality, residual = _curve(run)
                states = _state(run, 0), _state(run, last)
                title = f"{model.name}, {hand.name} hand, {run.title}"
                curve = QualityCurve(quality=quality, phases=phases, residual=residual)
                draw_grasp(staged, mesh=model.mesh, hand=hand, states=states, curve=curve, title=title)
            case "thumbnail.webp":
                draw_thumbnail(staged, model.mesh, hand, _state(run, last))
            case "animation.webp":
                draw_moving_picture(staged, model.mesh, hand, [_state(run, row) for row in range(last + 1)])
            case "curve.json":
                phases, quality, residual = _curve(run)
                document = {"phases": phases, "quality": quality.tolist(), "residual": residual.tolist()}
                staged.write_text(json.dumps(document))
            case "recording.rrd":
                from fingersplit.recording.run_recording import write_recording  # loads rerun: only who records

                write_recording(staged, model, hand, run, json.loads(task.result).get("friction"))


def render_in_advance(render: Callable[[Storage, RenderTask], None], storage: Storage, task: RenderTask) -> None:
    """Make a view that somebody is going to want, unless it is there or job or object were deleted meanwhile."""
    view = storage.view(task.job_id, task.rank, task.name)
    if view.parent.exists() and storage.shape(task.request.object_id).exists() and not view.exists():
        with suppress(FileNotFoundError):
            render(storage, task)


def _curve(run: "RecordedRun") -> tuple[list[str], Any, Any]:
    """Phase, quality and largest residual [m] of every accepted state."""
    from fingersplit.splitting.trace import PHASE_NAMES, QUALITY

    trace = run.trace
    return [PHASE_NAMES[phase] for phase in trace.phases], trace.scores[:, QUALITY], trace.residuals.max(axis=1)


def _state(run: "RecordedRun", row: int) -> "GraspView":
    from fingersplit.recording.scene import GraspView

    trace = run.trace
    return GraspView(trace.object_from_palm(row), trace.joints[row], trace.contacts[row], trace.normals[row])
