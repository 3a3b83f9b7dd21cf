"""What a worker does for a job: it plans, verifies, and, once the answer is on its way, records."""

import json
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic_core import to_json

from fingersplit_service.findings import Finding
from fingersplit_service.jobs.stored_objects import convex_pieces, planner_settings, prepared_object
from fingersplit_service.jobs.views import best_rank
from fingersplit_service.jobs.worker import report_progress
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.planning.plan import Plan

__all__ = ["JobOrder", "JobOutcome", "plan_job", "record_job", "strict_json", "verify_plan"]

_SHARE_OF_DEADLINE = 0.8  # after which nothing more is verified, so that the worker is not killed with its results
_unrecorded: dict[str, tuple["Plan", str]] = {}  # the plan of the last job and its document, until it is recorded


@dataclass(frozen=True)
class JobOrder:
    """A job for a worker: its object, the ``JobCreate`` document, and when the worker will be killed [s]."""

    job_id: str
    object_id: str
    object_name: str
    request: str
    deadline_s: float


@dataclass(frozen=True)
class JobOutcome:
    """A finished job.

    Attributes:
        finding: What to keep.
        stage_ms: Time by stage [ms], for the metrics.
        simulated: Whether each simulation held, for the metrics.
        pictured: Rank of the grasp whose picture stands for the run; None when there can be none.
        unrecorded: Whether the worker waits to be told to record the job.
    """

    finding: Finding
    stage_ms: dict[str, float] = field(default_factory=dict)
    simulated: tuple[bool, ...] = ()
    pictured: int | None = None
    unrecorded: bool = False


def plan_job(storage: Storage, order: JobOrder) -> JobOutcome:
    """Plan what a job asks for and verify what it wants verified; `record_job` keeps what its pictures need."""
    from fingersplit.hands.hand import load_hand
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
    from fingersplit.planning.planning import plan

    asked = json.loads(order.request)
    time_to_verify = time.monotonic() + _SHARE_OF_DEADLINE * order.deadline_s
    report_progress("preparing", 0.0)
    model = prepared_object(storage, order.object_id, order.object_name)
    settings, friction = planner_settings(asked["planner"])
    grasps = asked["parallel_grasps"]
    planned = plan(
        model,
        load_hand(asked["hand"]),
        None if grasps is None else [ParallelGrasp.from_document(grasp) for grasp in grasps],
        source=asked.get("source", "antipodal"),  # which jobs that an older version queued do not name
        starts=asked["starts"],
        seed=asked["seed"],
        top_k=asked["top_k"],
        settings=settings,
        friction=friction,
        progress=report_progress,
    )
    if asked["verified"]:
        planned = verify_plan(storage, order.object_id, planned, asked, time_to_verify)
    _unrecorded.clear()  # of a job that was cancelled before its recording
    document = planned.to_document()
    result = strict_json(document)
    if asked["recording"]:
        _unrecorded[order.job_id] = planned, result
    ranked = document["grasps"]
    simulated = tuple(grasp["verification"]["passed"] for grasp in ranked if grasp["verification"])
    finding = Finding(
        result=result,
        grasps=len(ranked),
        feasible=document["summary"]["feasible"],
        verified=sum(simulated),
        holding_margin=ranked[0]["metrics"]["holding_margin"] if ranked else None,
    )
    pictured = best_rank(ranked) if asked["recording"] else None
    return JobOutcome(finding, document["timings_ms"], simulated, pictured, asked["recording"])


def strict_json(document: dict[str, Any]) -> str:
    """A document as compact JSON; a number that JSON does not have raises ``ValueError``."""
    text = to_json(document)  # six times as fast as the standard library, but not strict
    if b"NaN" in text or b"Infinity" in text:
        return json.dumps(document, allow_nan=False, separators=(",", ":"))
    return text.decode()


def verify_plan(storage: Storage, object_id: str, planned: "Plan", asked: dict[str, Any], until: float) -> "Plan":
    """Simulate ranked grasps until as many have held as the job asks for, or the monotonic clock says ``until``."""
    from fingersplit.planning.proving import prove

    report_progress("convex_pieces", 0.0)
    pieces = convex_pieces(storage, object_id)
    report_progress("verifying", 0.0)
    return prove(
        planned,
        pieces,
        verified=asked["verified"],
        protocol=asked["protocol"],
        controller=asked["controller"],
        friction=asked.get("simulated_friction"),  # which jobs that an older version queued do not name
        deadline=max(0.0, until - time.monotonic()),
        initial=asked["verify_initial"],
    )


def record_job(storage: Storage, job_id: str) -> list[str]:
    """Write what pictures of a job's grasps need; what went wrong, in sentences, where that cannot be.

    It takes a good part of the time of a plan, so nobody waits for it: the worker that planned is told to do it when
    the answer is on its way.
    """
    from fingersplit.recording.traces_file import save_traces

    planned, result = _unrecorded.pop(job_id)
    try:
        with storage.atomic(storage.traces(job_id), durable=False) as staged:
            save_traces(planned, result, staged)
    except OSError as error:
        return [f"What pictures and recordings need could not be written: {error.strerror}."]
    return []
