"""Batches: many jobs in one request."""

from collections.abc import Sequence
from typing import Generic

from fingersplit_client._exchange import dump, given, parse, quoted
from fingersplit_client._flow import Flow
from fingersplit_client.modes import Mode, operation
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import Batch, BatchCreate, BatchPage, JobCreate

__all__ = ["Batches"]


class Batches(Resource[Mode], Generic[Mode]):
    """Many jobs in one request."""

    @operation
    def create(self, requests: Sequence[JobCreate]) -> Flow[Batch]:
        """Queue many jobs; all are accepted, or none is."""
        response = yield from self._exchange("POST", "/v1/batches", json=dump(BatchCreate(jobs=list(requests))))
        return parse(Batch, response)

    @operation
    def list(self, *, limit: int = 100, cursor: str | None = None) -> Flow[BatchPage]:
        """A page of the batches, newest first; ``next_cursor`` of one page is ``cursor`` of the next."""
        params = given(limit=limit, cursor=cursor)
        return parse(BatchPage, (yield from self._exchange("GET", "/v1/batches", params=params)))

    @operation
    def get(self, batch_id: str) -> Flow[Batch]:
        """How the jobs of a batch stand together."""
        response = yield from self._exchange("GET", f"/v1/batches/{quoted(batch_id)}")
        return parse(Batch, response)
