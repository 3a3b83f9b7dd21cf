"""Server-sent events, from lines."""

import json
from dataclasses import dataclass

from fingersplit_client.schemas import JobSummary

__all__ = ["EventReader", "JobEvent"]


@dataclass(frozen=True)
class JobEvent:
    """A change of a job.

    Attributes:
        id: Its place in the stream; give it as ``last_event_id`` to go on after it.
        job: The job as it was then.
    """

    id: str
    job: JobSummary


class EventReader:
    """Makes events from the lines of a stream of server-sent events."""

    def __init__(self) -> None:
        self._fields: dict[str, str] = {}

    def read(self, line: str) -> JobEvent | None:
        """Take one line; the event that it ends, if it ends one."""
        if line:
            name, _, value = line.partition(":")
            self._fields[name] = value.removeprefix(" ")
            return None
        fields, self._fields = self._fields, {}
        if "data" not in fields:
            return None
        return JobEvent(fields.get("id", ""), JobSummary.model_validate(json.loads(fields["data"])))
