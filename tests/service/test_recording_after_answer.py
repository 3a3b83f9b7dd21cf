"""What pictures need is written after the answer; nobody finds it half done, and nothing is left of a deleted job."""

import anyio
import pytest
from fake_tasks import DIES_RECORDING, FINE, PICTURE, RECORDED_LATE

pytestmark = pytest.mark.anyio


@pytest.fixture
def go(api):
    file = api.app.state.runtime.storage.root / "go"
    file.unlink(missing_ok=True)
    yield file
    file.touch()


async def answered(api, how: int) -> str:
    body = {"object_id": await api.object_id(), "seed": how}
    response = await api.http.post("/v1/jobs", json=body, headers={"Prefer": "wait=20"})
    assert (response.status_code, response.json()["state"]) == (200, "succeeded")
    return response.json()["id"]


async def test_the_answer_does_not_wait_for_the_recording_and_pictures_do(api, go):
    job_id = await answered(api, RECORDED_LATE)
    assert not api.app.state.runtime.storage.traces(job_id).exists()
    seen = []

    async def look() -> None:
        seen.append((await api.http.get(f"/v1/jobs/{job_id}/grasps/1/picture.png")).content)

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(look)
        await anyio.sleep(0.2)
        assert not seen
        go.touch()
    assert seen == [PICTURE + bytes([1])]


async def test_a_worker_that_dies_while_it_records_costs_no_result(api):
    job_id = await answered(api, DIES_RECORDING)
    await api.app.state.runtime.dispatcher.released(job_id)
    job = await api.job(job_id)
    assert (job["state"], job["attempts"]) == ("succeeded", 1)
    assert "there will be none" in job["warnings"][0]
    assert (await api.http.get(f"/v1/jobs/{job_id}/recording.rrd")).status_code == 409
    assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


async def test_a_job_deleted_while_it_is_recorded_leaves_nothing(api, go):
    job_id = await answered(api, RECORDED_LATE)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(api.http.delete, f"/v1/jobs/{job_id}")
        await anyio.sleep(0.2)
        go.touch()
    assert (await api.http.get(f"/v1/jobs/{job_id}")).status_code == 404
    assert not api.app.state.runtime.storage.job_folder(job_id).exists()


async def test_a_job_without_recording_is_over_with_its_answer(api):
    job_id = await api.queue(FINE, recording=False)
    assert (await api.ended(job_id))["warnings"] == []
    assert (await api.http.get(f"/v1/jobs/{job_id}/recording.rrd")).status_code == 409
