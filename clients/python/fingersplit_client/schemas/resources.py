"""Objects, hands, and how the service is."""

from datetime import datetime
from typing import Any, Literal

from pydantic import Field

from fingersplit_client.schemas.base import Document, SourceName, Unit, Vector3
from fingersplit_client.schemas.objects import CloudReport, IntakeReport, ObjectOptions, ObjectSource
from fingersplit_client.schemas.plan import ParallelGrasp

__all__ = [
    "HandDescriptionCreate",
    "HandDetail",
    "HandFinger",
    "HandInfo",
    "HandJoint",
    "Health",
    "ImportedGraspSet",
    "ObjectInfo",
    "ObjectLookup",
    "ObjectPage",
    "ParallelGraspSet",
    "ParallelGraspSetInfo",
    "ParallelGraspsCreate",
    "ParallelGraspsGenerate",
    "Readiness",
    "SessionCreate",
    "SessionInfo",
    "ViewedScene",
]


class ObjectInfo(Document):
    """An uploaded object, checked and in metres."""

    id: str = Field(description="Id of the object: a hash of its shape and options, so equal ones are one object.")
    name: str = Field(description="Name given at the first upload.")
    unit: Unit = Field(description="Length unit of the uploaded file; everything here is in metres.")
    extents: Vector3 = Field(description="Edge lengths of the axis-aligned bounding box, object frame [m].")
    volume: float = Field(description="Enclosed volume [m^3]; the report says how it was found.")
    center_of_mass: Vector3 = Field(description="Centre of the volume at even density, object frame [m].")
    options: ObjectOptions = Field(default=ObjectOptions(), description="What was said of the object beside its shape.")
    report: IntakeReport | CloudReport = Field(description="What was found in the file and what was repaired.")
    created_at: datetime = Field(description="When the object was first uploaded, UTC.")


class ObjectLookup(ObjectOptions, ObjectSource):
    """Asks for an object by the file that it would be uploaded with, so that known bytes are not sent again."""

    sha256: str = Field(description="SHA-256 of the file, hexadecimal.", pattern=r"^[0-9a-f]{64}$")


class ObjectPage(Document):
    """Some objects, newest first, and where the next page begins."""

    items: list[ObjectInfo] = Field(description="The objects of this page.")
    next_cursor: str | None = Field(description="Value of `cursor` for the next page; null on the last one.")


class ViewedScene(Document):
    """What a depth image became: an object to grasp, and a scene for jobs with it."""

    object: ObjectInfo = Field(description="The target; its frame is the camera's optical frame.")
    scene: dict[str, Any] = Field(
        description="Value for `scene` of a job: the object's pose, gravity, support surface and obstacle cloud."
    )
    target_points: int = Field(description="Measured points of the target.")
    obstacle_points: int = Field(description="Points of the obstacle cloud; each is a ball that covers its neighbours.")
    support_points: int = Field(description="Points in which the support surface was found; 0 if none was asked for.")
    warnings: list[str] = Field(description="What a caller may not expect.")


class ParallelGraspsGenerate(Document):
    """How parallel grasps of an object are to be found."""

    hand: str = Field(default="barrett", description="The hand whose opening they must fit.", max_length=64)
    count: int = Field(
        default=32,
        ge=1,
        le=1024,
        description="How many pairs of contacts to find at most; surface fitting finds up to two grasps for each.",
    )
    source: SourceName = Field(
        default="antipodal", max_length=64, description="How they are found: a name of `GET /v1/sources`."
    )
    seed: int = Field(default=0, ge=0, lt=2**63, description="Seed of every random choice.")
    friction: float | None = Field(
        default=None,
        ge=0.01,
        le=2.0,
        description="Friction coefficient of the contacts; by default the object's, or 0.6 where that is not known.",
    )
    name: str = Field(default="", description="Name for people.", max_length=200)


class ParallelGraspsCreate(Document):
    """Parallel grasps that were found elsewhere."""

    parallel_grasps: list[ParallelGrasp] = Field(
        min_length=1, max_length=1024, description="The grasps, object frame [m]."
    )
    name: str = Field(default="", description="Name for people.", max_length=200)


class ParallelGraspSetInfo(Document):
    """A stored set of parallel grasps of an object, without the grasps."""

    id: str = Field(description="Id to use as `parallel_grasp_set` of a job.")
    object_id: str = Field(description="Id of the object.")
    origin: Literal["generated", "imported"] = Field(description="Whether the service found them or was given them.")
    name: str = Field(description="Name for people.")
    count: int = Field(description="Number of grasps.")
    created_at: datetime = Field(description="When the set was stored, UTC.")


class ParallelGraspSet(ParallelGraspSetInfo):
    """A stored set of parallel grasps of an object."""

    parallel_grasps: list[ParallelGrasp] = Field(description="The grasps, object frame [m].")


class ImportedGraspSet(ParallelGraspSet):
    """A set of parallel grasps that was read from a file."""

    message: str = Field(description="What the file held, and what was kept of it.")


class HandJoint(Document):
    """One joint of a hand."""

    name: str = Field(description="Name of the joint, as in a grasp's joints.")
    lower: float = Field(description="Lower limit [rad].")
    upper: float = Field(description="Upper limit [rad].")


class HandFinger(Document):
    """One finger of a hand."""

    name: str = Field(description="Name of the finger, as in a grasp's contacts.")
    joints: list[str] = Field(description="Names of its joints, from the palm to the fingertip.")
    pad_radius: float = Field(description="Radius of its spherical pad [m].")


class HandInfo(Document):
    """A hand that can be planned for."""

    name: str = Field(description="Name to use in a job; of an uploaded hand its id, a hash of its files.")
    title: str = Field(description="Maker and model.")
    fingers: list[HandFinger] = Field(description="Its fingers.")
    joints: list[HandJoint] = Field(description="Its joints with their limits [rad].")
    sha256: str = Field(default="", description="Hash of the description and the model files, hexadecimal.")
    origin: Literal["shipped", "uploaded"] = Field(
        default="shipped", description="Whether it comes with the service or was uploaded with this key."
    )
    drafted: bool = Field(
        default=False, description="Whether its description was proposed by the program and not looked at by a person."
    )
    created_at: datetime | None = Field(default=None, description="When it was uploaded, UTC; null of a shipped one.")


class HandDetail(HandInfo):
    """A hand with its description and what was found by moving it."""

    description: str = Field(description="The description of the hand, TOML, as in its `hand.toml`.")
    report: dict[str, Any] = Field(
        description="What the check found: joints, drivers, couplings, shapes, grips, and `advice` on what to change."
    )
    trial: list[dict[str, Any]] | None = Field(
        description="Plans for a sphere, a box and a cylinder in three sizes, by grip; null until it was tried."
    )


class HandDescriptionCreate(Document):
    """A corrected description of a hand that is there."""

    description: str = Field(description="The whole description, TOML.", max_length=200_000)


class Health(Document):
    """The process is up."""

    status: Literal["ok"] = Field(default="ok", description="Always ok.")


class Readiness(Document):
    """Workers are warm: jobs start without delay."""

    status: Literal["ready"] = Field(default="ready", description="Always ready.")
    workers: int = Field(description="Number of warm worker processes.")


class SessionCreate(Document):
    """Opens a browser's session with an API key."""

    key: str = Field(description="The API key.", max_length=200)


class SessionInfo(Document):
    """Whom a session or key belongs to."""

    name: str = Field(description="Name of the key.")
    scopes: list[Literal["read", "plan", "admin"]] = Field(description="What it may do.")
