"""What the planner knows beside hands: metrics, file formats, sources of parallel grasps, protocols, controllers."""

from pydantic import Field

from fingersplit_client.schemas.base import Document

__all__ = ["ControllerInfo", "FileFormatInfo", "MetricInfo", "ProtocolInfo", "SourceInfo"]


class MetricInfo(Document):
    """A metric that every grasp of a result has under its name in `metrics`."""

    name: str = Field(description="Key in `metrics`.")
    title: str = Field(description="Name for people.")
    unit: str = Field(description="Unit; empty for none.")
    meaning: str = Field(description="What it says, in a sentence.")
    higher_is_better: bool = Field(description="Whether a larger number is the better grasp.")
    source: str = Field(description="Where it is defined: keys of the project's references.")
    in_tables: bool = Field(description="Whether tables for people have a column for it.")


class FileFormatInfo(Document):
    """A file format of another tool, and what can be done with it."""

    name: str = Field(description="What requests call it.")
    title: str = Field(description="What it is, for people.")
    suffix: str = Field(description="Ending of its files.")
    media_type: str = Field(description="Media type of its files.")
    reads_parallel_grasps: bool = Field(description="Whether parallel grasps are read from it.")
    reads_hand_grasps: bool = Field(description="Whether grasps of multi-fingered hands are read from it.")
    writes: bool = Field(description="Whether results are written in it.")
    one_grasp: bool = Field(description="Whether a file holds one grasp.")


class SourceInfo(Document):
    """A way to find parallel grasps when a job brings none."""

    name: str = Field(description="What requests call it.")
    meaning: str = Field(description="How it finds them, in a sentence.")


class ProtocolInfo(Document):
    """A test that a verified grasp must survive in simulation."""

    name: str = Field(description="What requests call it.")
    meaning: str = Field(description="What is done to the held object, in a sentence.")
    numbers: dict[str, bool | float | None] = Field(description="Its numbers by name, in SI units and radians.")


class ControllerInfo(Document):
    """A way to control the hand in simulation."""

    name: str = Field(description="What requests call it.")
    meaning: str = Field(description="How it holds the object, in a sentence.")
    numbers: dict[str, float] = Field(description="Its numbers by name, in SI units and radians.")
