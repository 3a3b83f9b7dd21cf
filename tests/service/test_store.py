import asyncio
import sqlite3
from datetime import UTC, datetime

import pytest

from fingersplit_client.schemas import IntakeReport, JobError, ObjectInfo
from fingersplit_service.jobs.store import Store
from fingersplit_service.storage import Storage

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


@pytest.fixture
async def store(tmp_path):
    opened = Store(tmp_path / "jobs.sqlite3")
    await opened.add_object(OBJECT)
    yield opened
    opened.close()


async def test_jobs_are_claimed_once_and_in_order(store):
    queued = [(await store.add_job("cube", "{}")).id for _ in range(20)]
    claimed = await asyncio.gather(*(store.claim() for _ in range(30)))
    assert [job.id for job in claimed if job] == queued
    assert [job for job in claimed if job is None] == [None] * 10


async def test_an_object_must_be_known(store):
    assert await store.add_job("sphere", "{}") is None
    assert await store.object_document("sphere") is None


async def test_an_object_is_kept_once(store):
    assert not await store.add_object(OBJECT.model_copy(update={"name": "other"}))
    assert ObjectInfo.model_validate_json(await store.object_document("cube")) == OBJECT


async def test_an_ended_job_stays_as_it_ended(store):
    job = await store.add_job("cube", "{}")
    await store.claim()
    await store.succeed(job.id, "[1]", 1)

    await store.fail(job.id, JobError(code="internal", detail="late"))
    await store.give_back(job.id)
    assert not await store.count_worker_death(job.id)
    await store.take_up()
    ended = await store.job(job.id)
    assert (ended.state, ended.error, await store.result(job.id)) == ("succeeded", None, "[1]")


async def test_the_second_worker_death_fails_a_job(store):
    job = await store.add_job("cube", "{}")
    await store.claim()
    assert await store.count_worker_death(job.id)
    assert (await store.claim()).id == job.id
    assert not await store.count_worker_death(job.id)
    assert (await store.job(job.id)).error.code == "worker_died"
    assert await store.claim() is None


async def test_dying_services_cost_a_job_nothing_until_it_looks_guilty(store):
    job = await store.add_job("cube", "{}")
    for _ in range(9):
        assert (await store.claim()).id == job.id
        await store.take_up()
    await store.claim()
    await store.take_up()
    ended = await store.job(job.id)
    assert (ended.state, ended.error.code) == ("failed", "worker_died")


async def test_the_database_survives_power_loss_and_readers(store, tmp_path):
    with sqlite3.connect(tmp_path / "jobs.sqlite3") as reader:
        assert reader.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert reader.execute("SELECT count(*) FROM objects").fetchone() == (1,)
        await store.add_job("cube", "{}")
    reader.close()


async def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    storage = Storage(tmp_path)
    path = storage.picture("job", 1)
    with storage.lock():
        with pytest.raises(TypeError), storage.atomic(path) as staged:
            staged.write_bytes("no bytes")
        assert not path.exists()
        assert list(storage.staging.iterdir()) == []
        with storage.atomic(path) as staged:
            staged.write_bytes(b"whole")
        assert path.read_bytes() == b"whole"
        storage.staged(".left").touch()
    with storage.lock():
        assert list(storage.staging.iterdir()) == []
