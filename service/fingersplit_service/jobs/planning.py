"""What a worker does for a job: it plans and verifies; nothing of it stays in the process."""

import gzip
import json
import time
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from fingersplit_client.schemas import JobCreate
from fingersplit_service.database.result_row import JobResultRow
from fingersplit_service.jobs.constraints import load_constraints, load_obstacle
from fingersplit_service.jobs.hand_work import stored_hand
from fingersplit_service.jobs.outcome import JobOutcome, strict_json
from fingersplit_service.jobs.rendering import best_rank
from fingersplit_service.jobs.stored_objects import convex_pieces, planner_settings, prepared_object
from fingersplit_service.jobs.worker import report_progress
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.hands.hand import Hand
    from fingersplit.objects.model import ObjectModel
    from fingersplit.result.plan import PlanResult

__all__ = ["STARTS", "PlanTask", "draw_starts", "plan_job"]

STARTS = "starts.json.gz"
"""View of a job's starts, kept under rank 0."""

_SHARE_OF_DEADLINE = 0.8  # after which nothing more is verified, so that the worker is not killed with its results


@dataclass(frozen=True)
class PlanTask:
    """A job for a worker.

    Attributes:
        job_id: The job.
        object_name: Name of the object for people.
        request: What was asked for.
        deadline_s: When the worker will be killed [s].
        threads: Threads that may plan; what comes out does not depend on it.
    """

    job_id: str
    object_name: str
    request: JobCreate
    deadline_s: float
    threads: int = 1


def plan_job(storage: Storage, task: PlanTask) -> JobOutcome:
    """Plan what a job asks for, and verify what it wants verified."""
    from fingersplit.planning.planning import plan

    request = task.request
    verify_until = time.monotonic() + _SHARE_OF_DEADLINE * task.deadline_s
    report_progress("preparing", 0.0)
    model = prepared_object(storage, request.object_id, task.object_name)
    hand = stored_hand(storage, request.hand)
    planned = plan(model, hand, **_asked(storage, request), threads=task.threads, progress=report_progress)
    if request.verified:
        planned = _verify(storage, planned, model, hand, request, verify_until)
    return _outcome(planned)


def draw_starts(storage: Storage, task: PlanTask) -> None:
    """Search again and write where each start of a job ended and why, for the pages to draw.

    Raises:
        FileNotFoundError: The job or its object was deleted meanwhile.
        UnknownHandError: Its hand was.
    """
    from fingersplit.planning.search import find_grasps
    from fingersplit.recording.web_scene import starts_scene

    request = task.request
    model = prepared_object(storage, request.object_id, task.object_name)
    asked = _asked(storage, request)
    asked |= {"ranking": replace(asked["ranking"], simulation_budget=0.0), "refine": False}  # the runs alone count
    found = find_grasps(model, stored_hand(storage, request.hand), **asked)
    document = json.dumps(starts_scene(found), separators=(",", ":")).encode()
    path = storage.view(task.job_id, 0, STARTS)
    with storage.atomic(path, durable=False, make_folder=False) as staged:
        staged.write_bytes(gzip.compress(document, 6, mtime=0))


def _asked(storage: Storage, request: JobCreate) -> dict[str, Any]:
    """What a job asks of the search, as its keywords."""
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
    from fingersplit.robustness.noise import NoiseModel
    from fingersplit.robustness.ranking_order import RankingOrder

    settings, friction = planner_settings(request.planner)
    given = request.parallel_grasps
    return {
        "parallel_grasps": None
        if given is None
        else [ParallelGrasp.from_document(grasp.model_dump()) for grasp in given],
        "source": request.source,
        "starts": request.starts,
        "seed": request.seed,
        "top_k": request.top_k,
        "settings": settings,
        "friction": friction,
        "constraints": load_constraints(storage, request),
        "ranking": RankingOrder(
            request.rank_by,
            NoiseModel(request.noise.position, request.noise.rotation),
            request.simulation_budget_ms / 1e3,
            partial(convex_pieces, storage, request.object_id),
        ),
        "refine": request.refine,
    }


def _verify(
    storage: Storage, planned: "PlanResult", model: "ObjectModel", hand: "Hand", request: JobCreate, until: float
) -> "PlanResult":
    """Simulate ranked grasps until as many have held as the job asks for, or the monotonic clock says ``until``."""
    from fingersplit.verification import verify_ranked

    report_progress("convex_pieces", 0.0)
    pieces = convex_pieces(storage, request.object_id)
    report_progress("verifying", 0.0)
    return verify_ranked(
        planned,
        model,
        hand,
        pieces,
        verified=request.verified,
        protocol=request.protocol,
        controller=request.controller,
        friction=request.simulated_friction,
        deadline=max(0.0, until - time.monotonic()),
        initial=request.verify_initial,
        obstacle=partial(load_obstacle, storage),
    )


def _outcome(planned: "PlanResult") -> JobOutcome:
    ranked = planned.grasps
    row = JobResultRow(
        result=strict_json(planned.to_dict()),
        grasps=len(ranked),
        feasible=planned.feasible,
        verified=planned.held,
        holding_margin=ranked[0].metrics["holding_margin"] if ranked else None,
    )
    simulated = tuple(grasp.verification.passed for grasp in ranked if grasp.verification is not None)
    return JobOutcome(row, asdict(planned.timings_ms), simulated, best_rank(ranked))
