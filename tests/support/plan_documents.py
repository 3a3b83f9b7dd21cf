"""A result document with chosen grasps, made without a planner."""

from typing import TYPE_CHECKING, Any

from fingersplit_client.schemas import PlanResult as WireResult

if TYPE_CHECKING:
    from fingersplit_client import PlanResult


def filled(model: Any, **chosen: Any) -> Any:
    """Some valid value for every field of a wire type that is required, whatever the schema has become."""
    from pydantic_core import PydanticUndefined

    values = {}
    for name, field in model.model_fields.items():
        if name in chosen:
            values[name] = chosen[name]
        elif field.default is PydanticUndefined and field.default_factory is None:
            values[name] = _some(field.annotation)
    return values


def _some(annotation: Any) -> Any:
    from types import NoneType, UnionType
    from typing import Literal, Union, get_args, get_origin

    from pydantic import BaseModel

    origin, arguments = get_origin(annotation), get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return filled(annotation)
    if origin in (Union, UnionType):
        return None if NoneType in arguments else _some(arguments[0])
    if origin is Literal:
        return arguments[0]
    if origin is tuple:
        return tuple(_some(argument) for argument in arguments if argument is not ...)
    return {str: "x", int: 1, float: 0.5, bool: True, list: [], dict: {}}[origin or annotation]


def grasp(
    rank: int, *, feasible: bool = True, margin: float | None = 1.0, held: bool | None = None, **more: Any
) -> Any:
    """A grasp from above: the palm 0.2 m over the object, come from 0.3 m."""
    from fingersplit_client.schemas import Grasp as WireGrasp
    from fingersplit_client.schemas import Metrics, Verification

    palm = {"position": (0.0, 0.0, 0.2), "wxyz": (0.0, 1.0, 0.0, 0.0)}
    before = {"position": (0.0, 0.0, 0.3), "wxyz": (0.0, 1.0, 0.0, 0.0)}
    contact = {"finger": "finger1", "position": (0.03, 0.0, 0.0), "normal": (1.0, 0.0, 0.0), "force": (-2.0, 0.0, 0.5)}
    contact |= {"fingertip": (0.04, 0.0, 0.0), "residual": 0.0, "pad_angle": 0.1}
    chosen = {
        "rank": rank,
        "feasible": feasible,
        "violations": [] if feasible else ["A pad leans too far."],
        "palm": palm,
        "joints": {"spread": 0.1, "base": 1.0, "tip": 0.4},
        "squeeze_joints": {"spread": 0.1, "base": 1.2, "tip": 0.5},
        "pregrasp": {"palm": before, "joints": {"spread": 0.1, "base": 0.6, "tip": 0.2}},
        "contacts": [contact],
        "metrics": filled(Metrics, holding_margin=margin),
        "verification": None if held is None else filled(Verification, passed=held),
    }
    return filled(WireGrasp, **(chosen | more))


def plan_result(*grasps: Any) -> "PlanResult":
    """A result with these grasps."""
    from fingersplit_client import PlanResult  # of the HTTP client, which worker processes do not need

    document = filled(WireResult, hand="barrett", grasps=list(grasps), friction=0.6)
    document["object"]["name"] = "<can>"
    return PlanResult.model_validate(document)
