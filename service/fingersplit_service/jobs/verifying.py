"""What a worker does behind an answer: it verifies and records the grasp that stands for a run."""

import json
from dataclasses import dataclass, replace
from functools import partial

from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.constraints import load_obstacle
from fingersplit_service.jobs.hand_work import stored_hand
from fingersplit_service.jobs.outcome import strict_json
from fingersplit_service.jobs.rendering import RenderTask, ViewName, best_rank, render_views
from fingersplit_service.jobs.stored_objects import convex_pieces, prepared_object
from fingersplit_service.storage import Storage

__all__ = ["VerifiedResult", "VerifyTask", "verify_first"]


_VIEWS: tuple[ViewName, ...] = ("recording.rrd", "scene.json.gz", "motion.json.gz")
"""Made with a verification; the first one anew, since it shows the simulation."""


@dataclass(frozen=True)
class VerifyTask:
    """A run for a worker to verify and record, as it is stored.

    Attributes:
        job_id: The job.
        object_name: Name of the object for people.
        request: What the job asked for.
        result: Its result document, JSON.
    """

    job_id: str
    object_name: str
    request: JobCreate
    result: str


@dataclass(frozen=True)
class VerifiedResult:
    """A result with its verification: the document, JSON, and how many of its grasps held in simulation."""

    result: str
    verified: int


def verify_first(storage: Storage, task: VerifyTask) -> VerifiedResult:
    """Simulate the first grasp of a stored result unless that was done, and record the grasp that stands for the run.

    Raises:
        ResultError: The result is of another version, or the grasp could not be reproduced.
        FileNotFoundError: The job or its object was deleted meanwhile.
    """
    from fingersplit.result import PlanResult
    from fingersplit.verification import verify_ranked

    request, result = task.request, PlanResult.from_dict(json.loads(task.result))
    if result.grasps[0].verification is None:
        model = prepared_object(storage, request.object_id, task.object_name)
        first = verify_ranked(
            replace(result, grasps=result.grasps[:1]),
            model,
            result.active_grip(stored_hand(storage, result.hand)),
            convex_pieces(storage, request.object_id),
            verified=1,
            protocol=request.protocol,
            controller=request.controller,
            friction=request.simulated_friction,
            initial=request.verify_initial,
            obstacle=partial(load_obstacle, storage),
        )
        result = replace(first, grasps=(*first.grasps, *result.grasps[1:]))
    text, rank = strict_json(result.to_dict()), best_rank(result.grasps)
    if request.recording and rank is not None:
        there = {name for name in _VIEWS[1:] if storage.exists(storage.view(task.job_id, rank, name))}
        view = RenderTask(_VIEWS[0], task.job_id, rank, task.object_name, request, text)
        render_views(storage, view, [name for name in _VIEWS if name not in there])
    return VerifiedResult(text, result.held)
