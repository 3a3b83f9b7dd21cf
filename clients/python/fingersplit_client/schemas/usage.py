"""What a key uses of the service, and how much it may."""

from datetime import datetime

from pydantic import Field

from fingersplit_client.schemas.base import Document

__all__ = ["Usage", "UsedAmount"]


class UsedAmount(Document):
    """What is used of one thing."""

    used: float = Field(description="How much is used now.")
    limit: float | None = Field(default=None, description="How much may be used; null for any amount.")
    until: datetime | None = Field(default=None, description="When the count begins anew; null where it does not.")


class Usage(Document):
    """What was made with the asking key."""

    queued_jobs: UsedAmount = Field(description="Jobs that wait.")
    jobs_per_minute: UsedAmount = Field(description="Jobs accepted in this minute of the clock.")
    stored_bytes: UsedAmount = Field(description="Objects, uploaded hands and results together [bytes].")
    cpu_s_per_day: UsedAmount = Field(description="CPU time of workers in this day, UTC [s].")
