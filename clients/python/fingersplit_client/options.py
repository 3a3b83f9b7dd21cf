"""Everything that an object and a job can be told, by keyword; `schemas` has the defaults and meanings."""

import difflib
from collections.abc import Iterable, Mapping
from typing import Any, TypedDict, TypeVar

from pydantic import BaseModel, ValidationError

from fingersplit_client.errors import InvalidRequestError, invalid
from fingersplit_client.schemas import (
    ControllerName,
    InvalidField,
    JobCreate,
    ObjectLookup,
    ParallelGrasp,
    PoseNoise,
    ProtocolName,
    RankBy,
    SourceName,
    Unit,
)
from fingersplit_client.schemas.field_faults import fault_in_words, fields_at, unknown_field

__all__ = ["JobKeywords", "ObjectKeywords", "PlanKeywords", "job_request", "object_lookup", "validated"]

Model = TypeVar("Model", bound=BaseModel)


class ObjectKeywords(TypedDict, total=False):
    """What can be said of an object beside its shape: `ObjectSource`, `ObjectOptions`, and how its file is called."""

    name: str | None
    file_type: str | None
    unit: Unit
    scale: float
    viewpoint: tuple[float, float, float] | None
    support: tuple[float, float, float, float] | None
    density: float | None
    mass: float | None
    friction: float | None
    fairing: float


class JobKeywords(TypedDict, total=False):
    """What a job can ask for: the fields of `JobCreate` but the object."""

    hand: str
    parallel_grasps: list[ParallelGrasp] | None
    parallel_grasp_set: str | None
    source: SourceName
    starts: int
    seed: int
    top_k: int
    planner: dict[str, bool | int | float | str]
    scene: dict[str, Any] | None
    approach: dict[str, Any] | None
    contact_regions: dict[str, Any] | None
    task: dict[str, Any] | None
    end_effector: dict[str, Any] | None
    rank_by: RankBy
    simulation_budget_ms: float
    noise: PoseNoise
    refine: bool
    verified: int
    protocol: ProtocolName
    controller: ControllerName
    simulated_friction: float | None
    verify_initial: bool
    recording: bool
    verify_first: bool
    priority: int
    deadline_s: float | None


class PlanKeywords(ObjectKeywords, JobKeywords, total=False):
    """What the one-call plan can ask for."""


def object_lookup(options: Mapping[str, Any]) -> ObjectLookup:
    """What these keywords say of an object, still without the hash of its file; those for jobs are left out.

    Raises:
        InvalidRequestError: A value is out of its range.
    """
    mine = {name: value for name, value in options.items() if name in ObjectLookup.model_fields}
    for name in ("viewpoint", "support"):
        if isinstance(mine.get(name), Iterable):
            mine[name] = tuple(map(float, mine[name]))
    found = validated(ObjectLookup, {"sha256": "0" * 64} | mine)
    if found.mass is not None and found.density is not None:
        raise invalid("Give mass or density, not both.", InvalidField(field="mass", detail="Density is given, too."))
    return found


def job_request(object_id: str, options: Mapping[str, Any]) -> JobCreate:
    """What these keywords ask of a job; those for objects are left out.

    Raises:
        InvalidRequestError: A keyword is not known, or a value out of its range.
    """
    mine = {name: value for name, value in options.items() if name not in ObjectKeywords.__annotations__}
    for name in mine.keys() - JobKeywords.__annotations__.keys():
        known = sorted(PlanKeywords.__annotations__)
        close = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}."
        raise invalid(f"There is no option {name!r}; {hint}")
    return validated(JobCreate, {"object_id": object_id} | mine)


def validated(model: type[Model], values: Mapping[str, Any]) -> Model:
    """A document of these values.

    Raises:
        InvalidRequestError: A value is not valid; the message names the field, what is wrong and what was given.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise _refused(model, error) from error


def _refused(model: type[BaseModel], error: ValidationError) -> InvalidRequestError:
    fields = []
    for one in error.errors()[:5]:
        place = one["loc"]
        if one["type"] == "extra_forbidden":
            detail = unknown_field(str(place[-1]), fields_at(model, place[:-1]))
        else:
            detail = fault_in_words(one, "names with values")
        fields.append(InvalidField(field=".".join(map(str, place)), detail=detail))
    return invalid("Some options are not valid.", *fields)
