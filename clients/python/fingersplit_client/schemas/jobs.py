"""Jobs: what to plan, and where that stands."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from fingersplit_client.schemas.base import Document
from fingersplit_client.schemas.plan import ParallelGrasp, PlanResult

__all__ = ["Job", "JobCreate", "JobError", "JobState", "JobSummary"]

JobState = Literal["queued", "running", "succeeded", "failed", "cancelled"]
"""Where a job stands; the last three are final."""


class JobCreate(Document):
    """What to plan: an uploaded object, a hand, and how hard to look."""

    object_id: str = Field(
        description="Id of an uploaded object.", examples=["0f1e2d3c4b5a69788796a5b4c3d2e1f0"], max_length=64
    )
    hand: str = Field(default="barrett", description="Name of a hand, one of `GET /v1/hands`.", max_length=64)
    parallel_grasps: Annotated[list[ParallelGrasp], Field(min_length=1, max_length=1024)] | None = Field(
        default=None, description="Parallel grasps to start from, object frame [m]; null to have them found."
    )
    starts: int = Field(default=64, ge=1, le=4096, description="How many starts to run at most.")
    seed: int = Field(
        default=0,
        ge=0,
        lt=2**63,
        description="Seed of every random choice; the same seed gives the same result.",
    )
    top_k: int = Field(default=10, ge=1, le=100, description="How many grasps to return at most, best first.")
    planner: dict[str, bool | int | float] = Field(
        default={},
        description="Planner settings that differ from their defaults, by name, in SI units and radians.",
    )


class JobError(Document):
    """Why a job failed."""

    code: Literal["refused", "worker_died", "deadline_exceeded", "out_of_memory", "internal"] = Field(
        description="Stable short name of the fault."
    )
    detail: str = Field(description="What went wrong, in a sentence.")


class JobSummary(Document):
    """Where a job stands, without its result."""

    id: str = Field(description="Id of the job.")
    state: JobState = Field(description="Where the job stands; succeeded, failed and cancelled are final.")
    stage: str | None = Field(description="What a running job is doing; null otherwise.")
    progress: float = Field(ge=0, le=1, description="Share of the stage that is done, 0 to 1.")
    created_at: datetime = Field(description="When the job was accepted, UTC.")
    started_at: datetime | None = Field(description="When a worker last took it up, UTC.")
    finished_at: datetime | None = Field(description="When it reached a final state, UTC.")
    request: JobCreate = Field(description="What was asked for, with defaults filled in.")
    error: JobError | None = Field(description="Why the job failed; null unless it did.")


class Job(JobSummary):
    """Where a job stands, and its result once it has succeeded.

    A job that finds no feasible grasp has succeeded: its grasps say what is wrong with them.
    """

    result: PlanResult | None = Field(description="The ranked grasps; null until the job has succeeded.")
