"""What nobody waits for is done by spare workers, and nobody waits because of it."""

import json
import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import PATIENCE, until
from fake_workers import FINE, HANGS, render, warm_and_report_niceness

from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.rendering import RenderTask, best_rank, render_in_advance
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.storage import Storage

pytestmark = pytest.mark.anyio
RESULT = json.dumps({"grasps": [{"rank": 1}]})


async def appears(path: Path) -> None:
    await until(path.exists)


async def exists(path: Path) -> dict:
    await appears(path)
    return json.loads(path.read_text())


async def gone(pid: int) -> None:
    await until(lambda: not Path(f"/proc/{pid}").exists())


async def upload(api, edge: float) -> str:
    return (await api.upload(api.cube(edge), "cube.off", unit="cm")).json()["id"]


@pytest.fixture
def hold(tmp_path) -> Path:
    """While this file is there, work in advance does not end."""
    path = tmp_path / "hold"
    path.touch()
    return path


async def test_it_runs_beside_jobs_and_answers_at_the_lowest_priority(start, tmp_path, hold):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        first = await upload(api, 5)
        at_work = await exists(tmp_path / f"{first}.decomposing")
        assert at_work["priority"] == 19
        assert await api.metric("fingersplit_workers", "busy") == 0
        second = await upload(api, 6)
        for _ in range(3):
            job = await api.ended(await api.queue(FINE, object_id=second))
            assert job["state"] == "succeeded"
        assert (await api.http.get(f"/v1/objects/{second}/mesh")).status_code == 200
        assert not (tmp_path / f"{second}.decomposing").exists()  # the other worker is for those who wait

        hold.unlink()
        await exists(tmp_path / f"{second}.decomposing")
        assert os.getpriority(os.PRIO_PROCESS, at_work["pid"]) == os.nice(0)  # as a worker it is as fast as any


async def test_without_a_spare_worker_it_is_not_done(start, tmp_path):
    async with start(tmp_path, workers=1, spare_workers=0) as api:
        first = await upload(api, 5)
        assert (await api.ended(await api.queue(FINE, object_id=first)))["state"] == "succeeded"
        assert not (tmp_path / f"{first}.decomposing").exists()


async def test_its_worker_may_die(start, tmp_path, hold):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        first = await upload(api, 5)
        second = await upload(api, 6)
        os.kill((await exists(tmp_path / f"{first}.decomposing"))["pid"], signal.SIGKILL)
        await exists(tmp_path / f"{second}.decomposing")  # by the process that replaces it
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


async def test_a_job_takes_the_next_process_when_its_own_dies(start, tmp_path, hold):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        at_work = await exists(tmp_path / f"{await upload(api, 5)}.decomposing")
        hanging = await api.queue(HANGS)
        await api.ended(hanging, states=("running",))
        await api.http.post(f"/v1/jobs/{hanging}/cancel")
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"
        assert Path(f"/proc/{at_work['pid']}").exists()


async def test_a_service_that_stops_does_not_wait_for_it(start, tmp_path, hold):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        at_work = await exists(tmp_path / f"{await upload(api, 5)}.decomposing")
    await gone(at_work["pid"])
    assert hold.exists()


async def test_a_worker_that_starts_while_another_is_there_stays_behind_it():
    limits = {"memory_bytes": 2**32, "recycle_bytes": 2**30, "warm_deadline_s": PATIENCE}
    pool, told = WorkerPool(1, spares=1, warm=warm_and_report_niceness, **limits), []
    pool.start()
    try:
        for _ in range(2):
            await until(lambda: pool.warm_up is not None)
            told.append(pool.warm_up.hands[0]["niceness"])
            pool.warm_up = None
    finally:
        await pool.stop()
    assert told == [os.nice(0), max(10, os.nice(0))]


async def test_the_newest_is_done_first(start, tmp_path, hold):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        await exists(tmp_path / f"{await upload(api, 5)}.decomposing")
        older, newer = [await upload(api, edge) for edge in (6, 7)]
        hold.unlink()
        await appears(tmp_path / f"{older}.decomposing")
        order = (tmp_path / "decomposed").read_text().split()
        assert order[1:] == [newer, older]


async def test_a_run_has_its_small_picture_before_anybody_asks(start, tmp_path):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        without, job_id = await api.queue(FINE, recording=False), await api.queue(FINE)
        await api.ended(job_id)
        await appears(api.storage.view(job_id, 1, "thumbnail.webp"))
        assert api.storage.view(job_id, 1, "thumbnail.webp").read_bytes() == b"thumbnail.webp"
        assert not api.storage.job_folder(without).exists()
        assert not api.storage.view(job_id, 1, "recording.rrd").exists()


@pytest.mark.parametrize("deleted", ["nothing", "run", "object", "run while it is drawn"])
def test_nothing_is_drawn_of_what_was_deleted(tmp_path, deleted):
    storage = Storage(tmp_path)
    task = RenderTask("thumbnail.webp", "job", 1, "an object", JobCreate(object_id="object"), RESULT)
    storage.shape("object").parent.mkdir(parents=True)
    if deleted != "object":
        storage.shape("object").touch()
    if deleted != "run":
        storage.job_folder("job").mkdir(parents=True)
    storage.staging.mkdir()

    def render_slowly(storage: Storage, task: RenderTask) -> None:
        if deleted == "run while it is drawn":
            storage.remove_job(task.job_id)
        render(storage, task)

    render_in_advance(render_slowly, storage, task)
    assert storage.view("job", 1, "thumbnail.webp").exists() == (deleted == "nothing")
    assert storage.job_folder("job").exists() == (deleted in ("nothing", "object"))
    assert list(storage.staging.iterdir()) == []


def test_what_stands_for_a_run_is_the_first_grasp_that_held():
    def ranked(*held: bool | None) -> list[SimpleNamespace]:
        reports = [None if one is None else SimpleNamespace(passed=one) for one in held]
        return [SimpleNamespace(rank=rank, verification=report) for rank, report in enumerate(reports, 1)]

    assert best_rank([]) is None
    assert best_rank(ranked(None, None, None)) == 1
    assert best_rank(ranked(False, True, None)) == 2
    assert best_rank(ranked(False)) == 1
