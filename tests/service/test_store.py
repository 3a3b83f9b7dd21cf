import asyncio
import runpy
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.operations import Operations

from fingersplit_client.schemas import IntakeReport, JobError, ObjectInfo
from fingersplit_service.database import migrations
from fingersplit_service.database.cluster_queue import ClusterQueue
from fingersplit_service.database.connection import Database, DatabaseInUse, database_url
from fingersplit_service.database.jobs import IdempotencyConflict, JobFilter, JobStore, QueueFull, UnknownObject
from fingersplit_service.database.keys import KeyStore, matches, split_key
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.queue import JobQueue
from fingersplit_service.database.result_row import JobResultRow
from fingersplit_service.database.rows import NewJob
from fingersplit_service.database.schema import HEAD, SchemaTooNew, schema_version
from fingersplit_service.database.tables import metadata

pytestmark = pytest.mark.anyio
VERSIONS = Path(migrations.__file__).parent / "versions"

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


FOUND = JobResultRow(result="[1]", grasps=1, feasible=1, verified=0, holding_margin=0.5)


@dataclass
class Stores:
    """Everything that is kept, and a job that needs nothing said about it."""

    database: Database
    objects: ObjectStore
    jobs: JobStore
    queue: JobQueue

    async def job(self, owner: str = "me", *, number: int = 0, priority: int = 0, **options: object) -> str:
        new = NewJob(f"{owner}-{number}-{time.monotonic_ns()}", "cube", "barrett", priority, None, "{}", f"{number}")
        rows, _ = await self.jobs.add(owner, [new], **{"longest_queue": 1000} | options)
        return rows[0].id

    async def abandon(self) -> int:
        """Have whoever runs jobs die, and another take over; how many jobs wait again."""
        if not isinstance(self.queue, ClusterQueue):
            return await self.queue.requeue_orphans()
        await self.queue.leave()
        await self.queue.register()
        return len((await self.queue.rescue(60)).queued)

    async def state(self, job_id: str, owner: str = "me") -> str:
        row, _ = await self.jobs.get(owner, job_id)
        return row.state


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request, tmp_path) -> sa.URL:
    if request.param == "sqlite":
        return database_url(None, tmp_path / "jobs.sqlite3")
    return database_url(request.getfixturevalue("postgresql")(), tmp_path)


@pytest.fixture(params=["sqlite", "postgresql", "cluster"])
async def store(request, tmp_path) -> AsyncIterator[Stores]:
    """One service with a file, one with PostgreSQL, and an agent of several machines."""
    if request.param == "sqlite":
        database = Database(database_url(None, tmp_path / "jobs.sqlite3"))
    else:
        database = Database(database_url(request.getfixturevalue("postgresql")(), tmp_path))
    queue = ClusterQueue(database, "this", 1) if request.param == "cluster" else JobQueue(database)
    await queue.begin()
    stores = Stores(database, ObjectStore(database), JobStore(database), queue)
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
    assert (await store.objects.remove("me", "cube")).found
    assert await store.objects.without_rows(["cube", "other"]) == ["other"]  # you have it, too
    assert (await store.objects.remove("you", "cube")).found
    assert await store.objects.without_rows(["cube", "other"]) == ["cube", "other"]
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
    job = await store.queue.claim()
    assert await store.queue.succeed(job, FOUND)

    assert not await store.queue.fail(job, JobError(code="internal", detail="late"))
    assert not await store.queue.requeue(job)
    assert not await store.queue.count_worker_death(job)
    assert await store.abandon() == 0
    await store.jobs.cancel("me", job_id)
    assert not await store.queue.succeed(job, FOUND)
    ended, result = await store.jobs.get("me", job_id)
    assert (ended.state, ended.error, ended.holding_margin, result) == ("succeeded", None, 0.5, "[1]")


async def test_a_cancelled_job_takes_no_result(store):
    job_id = await store.job()
    job = await store.queue.claim()
    assert (await store.jobs.cancel("me", job_id)).state == "cancelled"
    assert not await store.queue.succeed(job, FOUND)
    assert await store.queue.claim() is None


async def test_the_second_worker_death_fails_a_job(store):
    job_id = await store.job()
    assert await store.queue.count_worker_death(await store.queue.claim()) == "queued"
    job = await store.queue.claim()
    assert job.id == job_id
    assert await store.queue.count_worker_death(job) == "failed"
    ended, _ = await store.jobs.get("me", job_id)
    assert ended.error.code == "worker_died"
    assert await store.queue.claim() is None


async def test_a_job_under_which_the_service_dies_again_and_again_fails(store):
    job_id = await store.job()
    while True:
        assert (await store.queue.claim()).id == job_id
        if not await store.abandon():
            break
    ended, _ = await store.jobs.get("me", job_id)
    assert (ended.state, ended.error.code) == ("failed", "worker_died")
    assert 5 <= ended.attempts <= 10


async def test_an_attempt_that_was_given_up_cannot_write_its_result(store):
    job_id = await store.job()
    first = await store.queue.claim()
    assert await store.queue.requeue(first)
    second = await store.queue.claim()
    assert (second.id, second.attempts) == (job_id, 2)
    assert not await store.queue.succeed(first, FOUND)
    assert not await store.queue.fail(first, JobError(code="internal", detail="late"))
    assert await store.queue.succeed(second, FOUND)


async def test_an_owner_of_high_priorities_starves_nobody(store):
    for number in range(4):
        await store.job("me", number=number, priority=10)
    await store.job("you", priority=-10)
    assert [(await store.queue.claim()).owner for _ in range(3)] in (["me", "you", "me"], ["you", "me", "me"])


async def test_the_queue_is_bounded_for_each_owner_alone(store):
    for number in range(3):
        await store.job("me", number=number, longest_queue=3)
    with pytest.raises(QueueFull):
        await store.job("me", longest_queue=3)
    await store.job("you", longest_queue=3)


async def test_a_batch_is_found_again_by_its_key(store):
    def batch(*hashes: str) -> list[NewJob]:
        return [NewJob(f"{time.monotonic_ns()}-{one}", "cube", "barrett", 0, None, "{}", one) for one in hashes]

    options = {"longest_queue": 10, "idempotency_key": "k"}
    first, fresh = await store.jobs.add("me", batch("a", "b"), batch_id="one", **options)
    again, new = await store.jobs.add("me", batch("a", "b"), batch_id="two", **options)
    assert (fresh, new) == (True, False)
    assert [row.id for row in again] == [row.id for row in first]
    with pytest.raises(IdempotencyConflict):
        await store.jobs.add("me", batch("c"), batch_id="three", **options)


async def test_two_requests_with_one_key_at_once_are_one_job(store):
    ids = await asyncio.gather(*(store.job(idempotency_key="at once") for _ in range(8)))
    assert len(set(ids)) == 1


async def test_an_older_database_is_upgraded_with_its_jobs(url):
    engine = sa.create_engine(url)
    old, now = VERSIONS / "0001_first_tables.py", time.time()
    with engine.begin() as connection:
        context = MigrationContext.configure(connection)
        with Operations.context(context):
            runpy.run_path(str(old))["upgrade"]()
        connection.exec_driver_sql("CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL)")
        connection.exec_driver_sql("INSERT INTO alembic_version VALUES ('0001')")
        left = {"id": "left", "owner": "me", "object_id": "cube", "object_name": "cube", "hand": "barrett"}
        left |= {"priority": 0, "attempts": 1, "worker_deaths": 0, "created_at": now, "started_at": now}
        left |= {"warnings": "[]", "request_hash": "h", "request": "{}", "state": "running"}
        names, values = ", ".join(left), ", ".join(f":{name}" for name in left)
        statement = f"INSERT INTO jobs ({names}, runner, lease_until) VALUES ({values}, 'old', {now + 30})"
        connection.execute(sa.text(statement), left)
    engine.dispose()

    database = Database(url)
    try:
        assert schema_version(database.engine) == HEAD
        queue = JobQueue(database)
        assert await queue.requeue_orphans() == 1
        assert (await queue.claim()).id == "left"
    finally:
        database.close()


async def test_a_database_of_a_newer_version_is_refused(url):
    Database(url).close()
    engine = sa.create_engine(url)
    with engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    engine.dispose()
    with pytest.raises(SchemaTooNew, match="9999"):
        Database(url)


async def test_processes_that_start_together_upgrade_once(url):
    databases = await asyncio.gather(*(asyncio.to_thread(Database, url) for _ in range(4)))
    for database in databases:
        assert schema_version(database.engine) == HEAD
        database.close()


async def test_a_postgresql_database_serves_one_service(postgresql, tmp_path):
    url = database_url(postgresql(), tmp_path)
    first, second = Database(url), Database(url)
    try:
        first.lock()
        for shared in (False, True):
            with pytest.raises(DatabaseInUse, match="STORAGE_URL"):
                second.lock(shared=shared)
    finally:
        first.close()
        second.close()


async def test_several_machines_keep_out_a_service_that_works_alone(postgresql, tmp_path):
    url = database_url(postgresql(), tmp_path)
    machines, alone = [Database(url) for _ in range(2)], Database(url)
    try:
        for machine in machines:
            machine.lock(shared=True)
        with pytest.raises(DatabaseInUse):
            alone.lock()
    finally:
        for database in (*machines, alone):
            database.close()


async def test_deleting_a_job_deletes_its_result(store):
    job_id = await store.job()
    await store.queue.succeed(await store.queue.claim(), FOUND)
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
    await store.queue.succeed(await store.queue.claim(), FOUND)
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
