"""What the asking owner uses, and how much it may."""

from datetime import UTC, datetime

from fastapi import APIRouter

from fingersplit_client.schemas import Usage, UsedAmount
from fingersplit_service.dependencies import OwnersUse, Settings
from fingersplit_service.problems import problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

router = APIRouter(tags=["usage"])


@router.get("/v1/usage", summary="See what you use", responses=problem_answers())
async def get_usage(usage: OwnersUse, settings: Settings, principal: Reader) -> Usage:
    """What was made with the asking key, beside its limits; `until` is when the count begins anew."""
    used, limits = await usage.used(principal.owner), usage.limits
    return Usage(
        queued_jobs=UsedAmount(used=used.queued_jobs, limit=settings.max_queued_jobs),
        jobs_per_minute=UsedAmount(
            used=used.jobs_per_minute,
            limit=limits.jobs_per_minute,
            until=datetime.fromtimestamp(used.minute_ends, UTC),
        ),
        stored_bytes=UsedAmount(used=used.stored_bytes, limit=limits.stored_bytes),
        cpu_s_per_day=UsedAmount(
            used=used.cpu_s_per_day, limit=limits.cpu_s_per_day, until=datetime.fromtimestamp(used.day_ends, UTC)
        ),
    )
