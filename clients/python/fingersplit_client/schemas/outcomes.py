"""Outcomes: what became of planned grasps on a robot."""

from datetime import datetime

from pydantic import Field

from fingersplit_client.schemas.base import Document, Quaternion, Vector3

__all__ = ["GraspOutcome", "OutcomeBin", "OutcomeCreate", "OutcomePage", "OutcomeSummary", "PoseError"]


class PoseError(Document):
    """Where the object really was, against where it was planned to be: ``planned_from_measured``, object frame."""

    position: Vector3 = Field(description="Displacement of the object frame's origin [m].")
    wxyz: Quaternion = Field(
        default=(1.0, 0.0, 0.0, 0.0), description="Turn of the object, a quaternion; it is normalized."
    )


class OutcomeCreate(Document):
    """What a robot found out about a planned grasp."""

    held: bool = Field(description="Whether the object stayed in the hand for as long as it was to be held.")
    pose_error: PoseError | None = Field(
        default=None, description="Measured error of the object's pose before the grasp; null where it is not known."
    )
    note: str = Field(default="", max_length=2000, description="What people should know of it.")


class GraspOutcome(OutcomeCreate):
    """An outcome as it was reported, beside what was predicted."""

    id: str = Field(description="Id of the outcome.")
    job_id: str = Field(description="Id of the job that planned the grasp; the job may have been deleted since.")
    rank: int = Field(description="Rank of the grasp in that job.")
    object_id: str = Field(description="Id of the object.")
    object_name: str = Field(description="Name of the object when the job was accepted.")
    hand: str = Field(description="Name of the hand.")
    p_hold: float | None = Field(
        description="Probability of holding that the job predicted; null where it predicted none."
    )
    p_hold_tier: str | None = Field(description="How it was predicted: estimated or simulated; null without one.")
    created_at: datetime = Field(description="When the outcome was reported, UTC.")


class OutcomePage(Document):
    """Some outcomes, newest first, and where the next page begins."""

    items: list[GraspOutcome] = Field(description="The outcomes of this page.")
    next_cursor: str | None = Field(description="Value of `cursor` for the next page; null on the last one.")


class OutcomeBin(Document):
    """Outcomes of grasps whose predicted probabilities are alike."""

    low: float = Field(description="Least predicted probability of the bin.")
    high: float = Field(description="Largest one.")
    outcomes: int = Field(description="How many outcomes it has.")
    predicted: float | None = Field(description="Mean predicted probability; null without outcomes.")
    held: float | None = Field(description="Share of them that held; null without outcomes.")


class OutcomeSummary(Document):
    """How what was predicted compares with what happened."""

    outcomes: int = Field(description="How many outcomes there are.")
    held: int = Field(description="How many of them held.")
    predicted: int = Field(description="How many have a predicted probability; the rest is about these.")
    brier_score: float | None = Field(
        description="Mean squared difference of predicted probability and outcome, 0 is best; null without any."
    )
    calibration_error: float | None = Field(
        description="Mean difference of predicted probability and share that held over the bins, weighted by their "
        "outcomes; null without any."
    )
    bins: list[OutcomeBin] = Field(description="Ten bins of predicted probability, from 0 to 1.")
