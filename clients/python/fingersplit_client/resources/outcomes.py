"""Outcomes: what became of planned grasps on robots."""

from typing import Generic, Literal

from fingersplit_client._exchange import dump, given, parse, quoted
from fingersplit_client._flow import Emit, Flow, Stream
from fingersplit_client.modes import Mode, operation, stream
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import GraspOutcome, OutcomeCreate, OutcomePage, OutcomeSummary, PoseError

__all__ = ["Outcomes"]


class Outcomes(Resource[Mode], Generic[Mode]):
    """What became of planned grasps on robots, beside the probability of holding that was predicted."""

    @operation
    def report(
        self, job_id: str, rank: int, *, held: bool, pose_error: PoseError | None = None, note: str = ""
    ) -> Flow[GraspOutcome]:
        """Report an attempt, also one that went well.

        Args:
            job_id: Job that planned the grasp.
            rank: Rank of the grasp.
            held: Whether the object stayed in the hand for as long as it was to be held.
            pose_error: Measured error of the object's pose before the grasp.
            note: What people should know of it.
        """
        body = dump(OutcomeCreate(held=held, pose_error=pose_error, note=note))
        response = yield from self._exchange("POST", f"/v1/jobs/{quoted(job_id)}/grasps/{rank}/outcome", json=body)
        return parse(GraspOutcome, response)

    @operation
    def list(
        self,
        *,
        limit: int = 100,
        cursor: str | None = None,
        job_id: str | None = None,
        object_id: str | None = None,
        hand: str | None = None,
    ) -> Flow[OutcomePage]:
        """A page of the outcomes, newest first; ``next_cursor`` of one page is ``cursor`` of the next.

        Args:
            limit: How many to return at most.
            cursor: Where to go on.
            job_id: Only outcomes of this job.
            object_id: Only outcomes with this object.
            hand: Only outcomes with this hand.
        """
        params = given(limit=limit, cursor=cursor, job_id=job_id, object_id=object_id, hand=hand)
        return parse(OutcomePage, (yield from self._exchange("GET", "/v1/outcomes", params=params)))

    @stream
    def all(
        self, *, job_id: str | None = None, object_id: str | None = None, hand: str | None = None
    ) -> Stream[GraspOutcome]:
        """Every outcome, newest first, page after page; filters as in `list`."""
        cursor = None
        while True:
            page = yield from Outcomes.list.flow(
                self, limit=1000, cursor=cursor, job_id=job_id, object_id=object_id, hand=hand
            )
            for item in page.items:
                yield Emit(item)
            cursor = page.next_cursor
            if cursor is None:
                return

    @operation
    def summary(
        self, *, job_id: str | None = None, object_id: str | None = None, hand: str | None = None
    ) -> Flow[OutcomeSummary]:
        """Outcomes by predicted probability of holding; filters as in `list`."""
        params = given(job_id=job_id, object_id=object_id, hand=hand)
        return parse(OutcomeSummary, (yield from self._exchange("GET", "/v1/outcomes/summary", params=params)))

    @operation
    def export(
        self,
        file_format: Literal["csv", "jsonl"] = "jsonl",
        *,
        job_id: str | None = None,
        object_id: str | None = None,
        hand: str | None = None,
    ) -> Flow[bytes]:
        """All outcomes as a table, or as a document a line with the planned grasp; filters as in `list`."""
        params = given(file_format=file_format, job_id=job_id, object_id=object_id, hand=hand)
        response = yield from self._exchange("GET", "/v1/outcomes/export", params=params)
        return bytes(response.content)

    @operation
    def delete(self, outcome_id: str) -> Flow[None]:
        """Forget an outcome, such as one that was reported by mistake."""
        yield from self._exchange("DELETE", f"/v1/outcomes/{quoted(outcome_id)}")
