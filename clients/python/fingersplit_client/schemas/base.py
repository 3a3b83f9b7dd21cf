"""What every wire type shares: strictness and the vectors."""

from typing import Literal

from pydantic import BaseModel, ConfigDict

__all__ = [
    "ControllerName",
    "Document",
    "GraspFormat",
    "ProtocolName",
    "Quaternion",
    "SourceName",
    "Unit",
    "Vector3",
]

Vector3 = tuple[float, float, float]
"""Three numbers along x, y, z."""
Quaternion = tuple[float, float, float, float]
"""A unit quaternion, w first."""
Unit = Literal["m", "mm", "cm", "in"]
"""Length units the file of an object may be written in."""
SourceName = str
"""Where parallel grasps come from when none are given: a name of `GET /v1/sources`."""
ProtocolName = str
"""What grasps are tried with in simulation: a name of `GET /v1/protocols`."""
ControllerName = str
"""How the hand is controlled in simulation: a name of `GET /v1/controllers`."""
GraspFormat = str
"""Format of a file that parallel grasps are read from: a name of `GET /v1/formats`."""


class Document(BaseModel):
    """Nothing unknown passes and every number is finite, so the two ends cannot drift apart unseen."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
