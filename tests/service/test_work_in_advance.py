"""What nobody waits for is done by spare workers, and nobody waits because of it."""

import json
import os
import signal
from pathlib import Path

import anyio
import pytest
from fake_tasks import FINE, HANGS

pytestmark = pytest.mark.anyio


async def exists(path: Path) -> dict:
    with anyio.fail_after(30):
        while not path.exists():
            await anyio.sleep(0.01)
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
