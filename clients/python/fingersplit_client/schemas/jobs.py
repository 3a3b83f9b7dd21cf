"""Jobs: what to plan, and where that stands."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from fingersplit_client.schemas.base import ControllerName, Document, ProtocolName, SourceName
from fingersplit_client.schemas.plan import ParallelGrasp, PlanResult
from fingersplit_client.schemas.verification import Verification

__all__ = [
    "Batch",
    "BatchCreate",
    "BatchPage",
    "GraspCurve",
    "GraspVerification",
    "Job",
    "JobCreate",
    "JobError",
    "JobPage",
    "JobState",
    "JobSummary",
    "JobVerification",
    "PoseNoise",
    "RankBy",
    "VerificationState",
]

JobState = Literal["queued", "running", "succeeded", "failed", "cancelled"]
"""Where a job stands; the last three are final."""


VerificationState = Literal["pending", "done", "failed"]
"""Where the verification of a run's first grasp stands, which is done behind the answer."""


RankBy = Literal["p_hold", "holding_margin"]
"""What grasps are ranked by."""


class PoseNoise(Document):
    """How far the object is from where it is thought to be when a grasp is executed."""

    position: float = Field(default=0.005, ge=0, le=0.05, description="Root mean square displacement [m].")
    rotation: float = Field(default=0.0872664625997, ge=0, le=0.8, description="Root mean square turn [rad].")


class JobCreate(Document):
    """What to plan: an uploaded object, a hand, and how hard to look."""

    object_id: str = Field(
        description="Id of an uploaded object.", examples=["0f1e2d3c4b5a69788796a5b4c3d2e1f0"], max_length=64
    )
    hand: str = Field(default="barrett", description="Name of a hand, one of `GET /v1/hands`.", max_length=64)
    parallel_grasps: Annotated[list[ParallelGrasp], Field(min_length=1, max_length=1024)] | None = Field(
        default=None, description="Parallel grasps to start from, object frame [m]; null to have them found."
    )
    parallel_grasp_set: str | None = Field(
        default=None,
        description="Id of a stored set of parallel grasps of the object to start from, instead of giving them here.",
        max_length=64,
    )
    source: SourceName = Field(
        default="antipodal",
        max_length=64,
        description="Where parallel grasps come from when none are given: a name of `GET /v1/sources`.",
    )
    starts: int = Field(default=64, ge=1, le=4096, description="How many starts to run at most.")
    seed: int = Field(
        default=0,
        ge=0,
        lt=2**63,
        description="Seed of every random choice; the same seed gives the same result.",
    )
    top_k: int = Field(default=10, ge=1, le=100, description="How many grasps to return at most, best first.")
    planner: dict[str, bool | int | float | str] = Field(
        default={},
        description="Planner settings that differ from their defaults, by name, in SI units and radians. `friction` "
        "may stand among them: the Coulomb friction to plan for, instead of the object's.",
    )
    scene: dict[str, Any] | None = Field(
        default=None,
        description="The world around the object: object_pose, gravity, support_surfaces, obstacles (primitives, "
        "uploaded objects by object_id, or points), clearance, workspace. SI units, quaternions wxyz.",
        examples=[{"support_surfaces": [{"id": "table"}]}],
    )
    approach: dict[str, Any] | None = Field(
        default=None,
        description="The way in and out: directions (cones with axis, max_angle and frame), desired_distance, "
        "min_distance, required, retreat.",
        examples=[{"directions": [{"axis": [0, 0, -1], "max_angle": 0.6}]}],
    )
    contact_regions: dict[str, Any] | None = Field(
        default=None, description="Where fingers may touch the object: allowed and forbidden regions, object frame."
    )
    task: dict[str, Any] | None = Field(default=None, description="The loads to carry: wrenches and gravity.")
    end_effector: dict[str, Any] | None = Field(
        default=None, description="What the hand is mounted on: tool_frame, tool_from_palm, attached_bodies, reach."
    )
    rank_by: RankBy = Field(
        default="p_hold",
        description="Order of the grasps that carry the weight: p_hold, the probability that they hold when they are "
        "executed, or holding_margin.",
    )
    simulation_budget_ms: float = Field(
        default=0,
        ge=0,
        le=60_000,
        description="Time to simulate executions of the best grasps for their p_hold [ms]; 0 only estimates it.",
    )
    noise: PoseNoise = Field(
        default=PoseNoise(), description="What p_hold reckons with; friction and mass vary beside it."
    )
    refine: bool = Field(
        default=False,
        description="Improve the best grasps by small moves that raise the probability of holding.",
    )
    verified: int = Field(
        default=0, ge=0, le=100, description="Simulate ranked grasps, best first, until so many have held."
    )
    protocol: ProtocolName = Field(
        default="lift", max_length=64, description="What a verified grasp must survive: a name of `GET /v1/protocols`."
    )
    controller: ControllerName = Field(
        default="position_servo",
        max_length=64,
        description="How the hand is controlled while verifying, a name of `GET /v1/controllers`: position_servo and "
        "joint_torque execute the grip that is published with a grasp, virtual_frame plans one of its own for the "
        "loads of the protocol.",
    )
    simulated_friction: Annotated[float, Field(ge=0, le=5)] | None = Field(
        default=None,
        description="Friction between hand and object while verifying; null for the one that is planned for. The grip "
        "is always planned for that one, so a smaller value shows what happens on a more slippery object.",
    )
    verify_initial: bool = Field(
        default=False, description="Simulate also the start of each verified grasp, for comparison."
    )
    recording: bool = Field(default=True, description="Keep what pictures and recordings of the grasps need.")
    verify_first: bool = Field(
        default=True,
        description="Verify and record the first grasp behind the answer, unless the service's setting is against it.",
    )
    priority: int = Field(default=0, ge=-10, le=10, description="Jobs of higher priority run first.")
    deadline_s: float | None = Field(
        default=None,
        gt=0,
        le=86_400,
        description="Longest time a worker may spend on it [s]; null for the service's limit, which always holds.",
    )


class JobError(Document):
    """Why a job failed."""

    code: Literal["refused", "worker_died", "deadline_exceeded", "out_of_memory", "internal"] = Field(
        description="Stable short name of the fault."
    )
    detail: str = Field(description="What went wrong, in a sentence.")


class JobSummary(Document):
    """Where a job stands, as lists have it."""

    id: str = Field(description="Id of the job.")
    object_id: str = Field(description="Id of the object that it plans for.")
    object_name: str = Field(description="Name of the object when the job was accepted.")
    hand: str = Field(description="Name of the hand.")
    state: JobState = Field(description="Where the job stands; succeeded, failed and cancelled are final.")
    stage: str | None = Field(description="What a running job is doing; null otherwise.")
    progress: float = Field(ge=0, le=1, description="Share of the stage that is done, 0 to 1.")
    priority: int = Field(description="Jobs of higher priority run first.")
    attempts: int = Field(description="How often it was handed to a worker.")
    batch_id: str | None = Field(description="Id of the batch it came in; null when it came alone.")
    grasps: int | None = Field(description="Number of grasps in the result; null until the job has succeeded.")
    feasible: int | None = Field(description="Number of feasible grasps found; null until the job has succeeded.")
    verified: int | None = Field(description="Number of grasps that held in simulation; null until it has succeeded.")
    holding_margin: float | None = Field(
        description="Holding margin of the grasp of rank 1 [N]; null where there is none."
    )
    verification: VerificationState | None = Field(
        default=None,
        description="Where the verification of the first grasp behind the answer stands; null where there is none.",
    )
    created_at: datetime = Field(description="When the job was accepted, UTC.")
    started_at: datetime | None = Field(description="When a worker last took it up, UTC.")
    finished_at: datetime | None = Field(description="When it reached a final state, UTC.")
    error: JobError | None = Field(description="Why the job failed; null unless it did.")
    warnings: list[str] = Field(
        description="What went wrong beside the result, such as a recording that was not written."
    )


class Job(JobSummary):
    """Where a job stands, what was asked for, and its result once it has succeeded.

    A job that finds no feasible grasp has succeeded: its grasps say what is wrong with them.
    """

    request: JobCreate = Field(description="What was asked for, with defaults filled in.")
    result: PlanResult | None = Field(description="The ranked grasps; null until the job has succeeded.")


class JobPage(Document):
    """Some jobs, newest first, and where the next page begins."""

    items: list[JobSummary] = Field(description="The jobs of this page.")
    next_cursor: str | None = Field(description="Value of `cursor` for the next page; null on the last one.")


class BatchCreate(Document):
    """Many jobs at once: all are accepted, or none is."""

    jobs: list[JobCreate] = Field(min_length=1, max_length=1000, description="The jobs.")


class Batch(Document):
    """Jobs that came in one request, and how they stand together."""

    id: str = Field(description="Id of the batch; `GET /v1/jobs?batch_id=` lists its jobs.")
    states: dict[JobState, int] = Field(description="How many of its jobs are in each state.")
    job_ids: list[str] = Field(description="Ids of its jobs, in the order of the request.")


class BatchPage(Document):
    """Some batches, newest first, and where the next page begins; ids of jobs are left out."""

    items: list[Batch] = Field(description="The batches of this page, with empty `job_ids`.")
    next_cursor: str | None = Field(description="Value of `cursor` for the next page; null on the last one.")


class GraspVerification(Document):
    """What the simulation of one grasp showed."""

    rank: int = Field(description="Rank of the grasp.")
    verification: Verification = Field(description="Report of its verification.")
    initial: Verification | None = Field(description="The same for its start; null where that was not asked for.")


class GraspCurve(Document):
    """How one grasp came about: a value for every accepted state of the search, the mapped start first."""

    phases: list[str] = Field(description="What led to the state: map, cpo, ppo or settle.")
    quality: list[float] = Field(description="The planner's objective Q, no unit.")
    residual: list[float] = Field(description="Largest distance of a pad from its contact [m].")


class JobVerification(Document):
    """What the simulations of a job's grasps showed."""

    asked: int = Field(description="How many verified grasps the job asked for.")
    verified: int = Field(description="How many held.")
    grasps: list[GraspVerification] = Field(description="Every grasp that was simulated, by rank.")
