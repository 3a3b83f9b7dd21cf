"""What nobody waits for is done by spare workers, and nobody waits because of it."""

import json
import os
import signal
from pathlib import Path

import anyio
import pytest
from fake_tasks import FINE, HANGS, UNRECORDED, draw, warm_and_tell

from fingersplit_service.jobs.engine import Engine
from fingersplit_service.jobs.views import ViewOrder, best_rank, draw_in_advance
from fingersplit_service.storage import Storage

pytestmark = pytest.mark.anyio


async def appears(path: Path) -> None:
    with anyio.fail_after(30):
        while not path.exists():
            await anyio.sleep(0.01)


async def exists(path: Path) -> dict:
    await appears(path)
    return json.loads(path.read_text())


async def gone(pid: int) -> None:
    with anyio.fail_after(30):
        while Path(f"/proc/{pid}").exists():
            await anyio.sleep(0.01)


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
        assert api.app.state.runtime.engine.busy_workers == 0
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
    with anyio.fail_after(5):
        await gone(at_work["pid"])
    assert hold.exists()


async def test_a_worker_that_starts_while_another_is_there_stays_behind_it():
    limits = {"memory_bytes": 2**32, "recycle_bytes": 2**30, "warm_deadline_s": 60}
    engine, told = Engine(1, spares=1, warm=warm_and_tell, **limits), []
    engine.start()
    try:
        with anyio.fail_after(30):
            for _ in range(2):
                while engine.warmth is None:
                    await anyio.sleep(0.005)
                told.append(engine.warmth.hands[0]["niceness"])
                engine.warmth = None
    finally:
        await engine.stop()
    assert told == [os.nice(0), max(10, os.nice(0))]


async def test_the_newest_is_done_first(start, tmp_path, hold):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        await exists(tmp_path / f"{await upload(api, 5)}.decomposing")
        older, newer = [tmp_path / f"{await upload(api, edge)}.decomposing" for edge in (6, 7)]
        hold.unlink()
        await appears(older)
        assert newer.stat().st_mtime_ns <= older.stat().st_mtime_ns


async def test_a_run_has_its_small_picture_before_anybody_asks(start, tmp_path):
    async with start(tmp_path, workers=1, spare_workers=1) as api:
        storage = api.app.state.runtime.storage
        unrecorded, job_id = await api.queue(UNRECORDED), await api.queue(FINE)
        await api.ended(job_id)
        await appears(storage.view(job_id, 1, "thumbnail.webp"))
        assert storage.view(job_id, 1, "thumbnail.webp").read_bytes() == b"thumbnail.webp"
        assert not storage.view(unrecorded, 1, "thumbnail.webp").exists()
        assert not storage.view(job_id, 1, "recording.rrd").exists()


@pytest.mark.parametrize("deleted", ["nothing", "run", "object", "run while it is drawn"])
def test_nothing_is_drawn_of_what_was_deleted(tmp_path, deleted):
    storage = Storage(tmp_path)
    order = ViewOrder("thumbnail.webp", "job", 1, "object", "an object", None)
    for needed, owner in ((storage.traces("job"), "run"), (storage.shape("object"), "object")):
        needed.parent.mkdir(parents=True, exist_ok=True)
        if owner != deleted:
            needed.touch()
    storage.staging.mkdir()

    def draw_slowly(storage: Storage, order: ViewOrder) -> None:
        if deleted == "run while it is drawn":
            storage.remove_job(order.job_id)
        draw(storage, order)

    draw_in_advance(draw_slowly, storage, order)
    assert storage.view("job", 1, "thumbnail.webp").exists() == (deleted == "nothing")
    assert storage.job_folder("job").exists() == (deleted in ("nothing", "object", "run"))


def test_what_stands_for_a_run_is_the_first_grasp_that_held():
    grasps = [{"rank": rank, "verification": None} for rank in (1, 2, 3)]
    assert best_rank([]) is None
    assert best_rank(grasps) == 1
    tried = [grasps[0] | {"verification": {"passed": False}}, grasps[1] | {"verification": {"passed": True}}, grasps[2]]
    assert best_rank(tried) == 2
    assert best_rank(tried[:1]) == 1
