"""What requests for jobs have in common: headers, and grasps that must touch their object."""

import math
from contextlib import suppress
from typing import Annotated

from fastapi import Header

from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.errors import NotFound
from fingersplit_service.jobs.parallel_grasp_service import ParallelGraspService
from fingersplit_service.security.access import Principal

__all__ = ["IdempotencyKey", "Prefer", "preference_applied", "refuse_untouching", "wait_seconds"]

IdempotencyKey = Annotated[
    str | None,
    Header(
        description="Repeating a request with the same key returns the first one's jobs.",
        min_length=1,
        max_length=255,
        pattern=r"^[\x21-\x7e]+$",
    ),
]
Prefer = Annotated[
    str | None,
    Header(description="`wait=<seconds>`: answer when the job ends (200), or then (202).", max_length=200),
]


def wait_seconds(prefer: str | None, most: float) -> float:
    """How long the answer may wait for the job, ``most`` at most [s]; what is not understood is ignored (RFC 7240)."""
    for part in (prefer or "").split(","):
        name, _, value = part.partition("=")
        if name.strip().lower() == "wait":
            try:
                seconds = float(value.strip().strip('"'))
            except ValueError:
                return 0.0
            return min(max(seconds, 0.0), most) if math.isfinite(seconds) else 0.0
    return 0.0


def preference_applied(seconds: float) -> dict[str, str]:
    """The header that says how long the answer was willing to wait."""
    return {"Preference-Applied": f"wait={seconds:g}"} if seconds else {}


async def refuse_untouching(
    grasps: ParallelGraspService, principal: Principal, request: JobCreate, prefix: str = ""
) -> None:
    """Refuse a job whose parallel grasps do not touch its object; that there is no such object is told elsewhere.

    Raises:
        InvalidField: A grasp lies off the surface; the field says which.
    """
    if request.parallel_grasps:
        with suppress(NotFound):
            await grasps.check_touching(principal.owner, request.object_id, request.parallel_grasps, prefix)
