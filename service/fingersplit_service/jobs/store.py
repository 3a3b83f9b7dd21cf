"""Objects and jobs on disk: the truth about what was accepted and what became of it.

Each change of a job's state is one ``UPDATE ... WHERE state = ... RETURNING``: no two hands move one job.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import sqlalchemy as sa

from fingersplit_client.schemas import JobError, JobState, ObjectInfo
from fingersplit_service.jobs.tables import Database, in_database_thread, jobs, objects

__all__ = ["JobRow", "Store"]

_MAX_WORKER_DEATHS = 2
_MAX_ATTEMPTS = 10  # a job under which the whole service dies each time must not be taken up for ever


@dataclass(frozen=True)
class JobRow:
    """A job as the table has it; documents stay JSON text. Times are seconds since 1970, UTC."""

    id: str
    object_id: str
    object_name: str
    state: JobState
    request: str
    grasps: int | None
    error: JobError | None
    created_at: float
    started_at: float | None
    finished_at: float | None


class Store(Database):
    """The two tables; what a method has returned is committed."""

    @in_database_thread
    def add_object(self, info: ObjectInfo) -> bool:
        """Keep an object; False when it was there already."""
        row = {
            "id": info.id,
            "name": info.name,
            "document": info.model_dump_json(),
            "created_at": info.created_at.timestamp(),
        }
        insert = sa.insert(objects).prefix_with("OR IGNORE").values(row)
        with self._engine.begin() as connection:
            return connection.execute(insert).rowcount == 1

    @in_database_thread
    def object_document(self, object_id: str) -> str | None:
        """An object's document, JSON; None when there is no such object."""
        query = sa.select(objects.c.document).where(objects.c.id == object_id)
        with self._engine.begin() as connection:
            return connection.execute(query).scalar()

    @in_database_thread
    def object_documents(self, limit: int) -> Sequence[str]:
        """The newest objects' documents, JSON."""
        query = sa.select(objects.c.document).order_by(objects.c.created_at.desc()).limit(limit)
        with self._engine.begin() as connection:
            return connection.execute(query).scalars().all()

    @in_database_thread
    def add_job(self, object_id: str, request: str) -> JobRow | None:
        """Queue a job; None when there is no such object."""
        job_id = uuid4().hex
        known = sa.select(objects.c.id).where(objects.c.id == object_id)
        row = {
            "id": job_id,
            "object_id": object_id,
            "state": "queued",
            "request": request,
            "attempts": 0,
            "worker_deaths": 0,
            "created_at": time.time(),
        }
        with self._engine.begin() as connection:
            if connection.execute(known).scalar() is None:
                return None
            connection.execute(sa.insert(jobs).values(row))
            return _one_job(connection, job_id)

    @in_database_thread
    def job(self, job_id: str) -> JobRow | None:
        """One job."""
        with self._engine.begin() as connection:
            return _one_job(connection, job_id)

    @in_database_thread
    def result(self, job_id: str) -> str | None:
        """A job's result document, JSON, once it has succeeded."""
        query = sa.select(jobs.c.result).where(jobs.c.id == job_id)
        with self._engine.begin() as connection:
            return connection.execute(query).scalar()

    @in_database_thread
    def newest_jobs(self, limit: int) -> list[JobRow]:
        """The newest jobs, newest first."""
        with self._engine.begin() as connection:
            rows = connection.execute(_SELECT_JOB.order_by(jobs.c.number.desc()).limit(limit))
            return [_job_row(row) for row in rows.mappings()]

    @in_database_thread
    def claim(self) -> JobRow | None:
        """Take the oldest queued job for a worker, counting the attempt before it begins."""
        oldest = sa.select(jobs.c.number).where(jobs.c.state == "queued").order_by(jobs.c.number).limit(1)
        changes = {"state": "running", "attempts": jobs.c.attempts + 1, "started_at": time.time()}
        with self._engine.begin() as connection:
            job_id = _move(connection, jobs.c.number == oldest.scalar_subquery(), "queued", changes)
            return _one_job(connection, job_id) if job_id else None

    @in_database_thread
    def succeed(self, job_id: str, result: str, grasps: int) -> None:
        """Keep a running job's result."""
        changes = {"state": "succeeded", "result": result, "grasps": grasps, "finished_at": time.time()}
        with self._engine.begin() as connection:
            _move(connection, jobs.c.id == job_id, "running", changes)

    @in_database_thread
    def fail(self, job_id: str, error: JobError) -> None:
        """End a running job with the reason."""
        with self._engine.begin() as connection:
            _move(connection, jobs.c.id == job_id, "running", _failure(error.code, error.detail))

    @in_database_thread
    def give_back(self, job_id: str) -> None:
        """Queue a running job again that was stopped for no fault of its own."""
        with self._engine.begin() as connection:
            _move(connection, jobs.c.id == job_id, "running", {"state": "queued"})

    @in_database_thread
    def count_worker_death(self, job_id: str) -> bool:
        """Queue a running job again whose worker died, or fail it if that was not the first time.

        Returns:
            Whether it was queued again.
        """
        deaths = jobs.c.worker_deaths + 1
        last = jobs.c.worker_deaths + 1 >= _MAX_WORKER_DEATHS
        failed = _failure("worker_died", f"Its worker process died {_MAX_WORKER_DEATHS} times while running it.")
        with self._engine.begin() as connection:
            _move(connection, (jobs.c.id == job_id) & last, "running", failed | {"worker_deaths": deaths})
            retry = {"state": "queued", "worker_deaths": deaths}
            return _move(connection, jobs.c.id == job_id, "running", retry) is not None

    @in_database_thread
    def take_up(self) -> None:
        """Queue what a dead process left running, at the start of a new one."""
        failed = _failure("worker_died", f"The service ended {_MAX_ATTEMPTS} times while running it.")
        with self._engine.begin() as connection:
            running = jobs.c.state == "running"
            connection.execute(sa.update(jobs).where(running, jobs.c.attempts >= _MAX_ATTEMPTS).values(failed))
            connection.execute(sa.update(jobs).where(running).values(state="queued"))


_SELECT_JOB = sa.select(
    jobs.c.id,
    jobs.c.object_id,
    objects.c.name.label("object_name"),
    jobs.c.state,
    jobs.c.request,
    jobs.c.grasps,
    jobs.c.error_code,
    jobs.c.error_detail,
    jobs.c.created_at,
    jobs.c.started_at,
    jobs.c.finished_at,
).join(objects)


def _one_job(connection: sa.Connection, job_id: str) -> JobRow | None:
    row = connection.execute(_SELECT_JOB.where(jobs.c.id == job_id)).mappings().one_or_none()
    return None if row is None else _job_row(row)


def _job_row(row: sa.RowMapping) -> JobRow:
    columns: dict[str, Any] = dict(row)
    code, detail = columns.pop("error_code"), columns.pop("error_detail")
    return JobRow(error=None if code is None else JobError(code=code, detail=detail), **columns)


def _move(
    connection: sa.Connection, which: sa.ColumnElement[bool], state: JobState, changes: dict[str, Any]
) -> str | None:
    """Change one job that is in ``state``; its id, or None when no such job was in that state."""
    update = sa.update(jobs).where(which, jobs.c.state == state).values(changes).returning(jobs.c.id)
    return connection.execute(update).scalar()


def _failure(code: str, detail: str) -> dict[str, Any]:
    return {"state": "failed", "error_code": code, "error_detail": detail, "finished_at": time.time()}
