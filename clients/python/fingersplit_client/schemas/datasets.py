"""Data sets: many grasps of many objects, planned round by round by the service's workers."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from fingersplit_client.schemas.base import Document
from fingersplit_client.schemas.jobs import JobCreate

__all__ = [
    "Dataset",
    "DatasetCreate",
    "DatasetError",
    "DatasetObject",
    "DatasetPage",
    "DatasetRound",
    "DatasetShard",
    "DatasetState",
    "DatasetSummary",
]

DatasetState = Literal["running", "complete", "cancelled"]
"""Where a data set stands; the last two are final."""
Share = Annotated[float, Field(ge=0)]


class DatasetRound(JobCreate):
    """What every round of a data set plans: a job without its object, whose seed is that of the first round."""

    object_id: str = Field(default="", max_length=0, description="Left out: the data set names its objects.")


class DatasetCreate(Document):
    """What a data set is to hold."""

    name: str = Field(default="data set", min_length=1, max_length=200, description="Name for people.")
    objects: list[Annotated[str, Field(max_length=64)]] = Field(
        min_length=1, max_length=10_000, description="Ids of uploaded objects, each once."
    )
    per_object: int = Field(default=100, ge=1, le=100_000, description="Grasps wanted of each object.")
    verified: bool = Field(
        default=False,
        description="Count only grasps that held in simulation, by the protocol of `job`; others are kept as failures.",
    )
    max_rounds: int = Field(default=50, ge=1, le=10_000, description="Rounds after which an object is given up.")
    split: tuple[Share, Share, Share] = Field(
        default=(0.8, 0.1, 0.1), description="Shares of train, validation and test; an object is in one of them."
    )
    licence: str = Field(default="unspecified", max_length=200, description="Licence of the data set.")
    job: DatasetRound = Field(
        default=DatasetRound(),
        description="What each round plans: hand, starts, planner settings, scene, protocol and the like. `verified`, "
        "`top_k` and `recording` follow from the data set.",
    )


class DatasetError(Document):
    """Why an object has too few grasps."""

    code: str = Field(description="Stable short name of the cause: too_few_grasps, or that of the job that failed.")
    detail: str = Field(description="What went wrong, in a sentence.")


class DatasetShard(Document):
    """One round of one object that is there to be downloaded."""

    round: int = Field(description="Number of the round, from 0.")
    path: str = Field(description="Where its file belongs in the folder of the data set.")
    job_id: str = Field(description="The job that planned it.")
    grasps: int = Field(description="Distinct grasps in it, good or not.")
    selected: int = Field(description="Grasps of it that count.")


class DatasetObject(Document):
    """How far one object of a data set is."""

    index: int = Field(description="Place in the order, from 0.")
    object_id: str = Field(description="Id of the object.")
    name: str = Field(description="Its name when the data set was asked for.")
    split: Literal["train", "validation", "test"] = Field(description="The split that it is in.")
    selected: int = Field(description="Grasps of it that count so far.")
    done: bool = Field(description="Whether it has as many as wanted, or was given up.")
    error: DatasetError | None = Field(description="Why it was given up; null unless it was.")
    shards: list[DatasetShard] = Field(description="Its rounds that have ended, in order.")


class DatasetSummary(Document):
    """How far a data set is, as lists have it."""

    id: str = Field(description="Id of the data set; `GET /v1/jobs?batch_id=` lists the jobs of its rounds.")
    name: str = Field(description="Name for people.")
    state: DatasetState = Field(description="Where it stands; complete also with objects that were given up.")
    hand: str = Field(description="Name of the hand.")
    objects: int = Field(description="Objects in all.")
    done: int = Field(description="Objects that are complete or were given up.")
    failed: int = Field(description="Those of them that were given up.")
    wanted: int = Field(description="Grasps wanted in all.")
    selected: int = Field(description="Grasps that count so far.")
    feasible: int = Field(description="Feasible grasps of all rounds.")
    held: int = Field(description="Grasps of all rounds that held in simulation.")
    created_at: datetime = Field(description="When it was asked for, UTC.")
    finished_at: datetime | None = Field(description="When it reached a final state, UTC.")


class Dataset(DatasetSummary):
    """How far a data set is, what was asked for, and every object with its shards."""

    request: DatasetCreate = Field(description="What was asked for, with defaults filled in.")
    items: list[DatasetObject] = Field(description="Its objects, in their order.")


class DatasetPage(Document):
    """Some data sets, newest first, and where the next page begins."""

    items: list[DatasetSummary] = Field(description="The data sets of this page.")
    next_cursor: str | None = Field(description="Value of `cursor` for the next page; null on the last one.")
