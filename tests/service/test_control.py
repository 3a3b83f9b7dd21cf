"""Cancelling, deleting, deadlines, priorities, batches, and lists of jobs."""

import pytest
from conftest import until
from fake_workers import FINE, HANGS, NO_GRASP, RAISES, WAITS
from test_faults import alive

from fingersplit_client.schemas import Batch, Grasp, JobPage, JobVerification

pytestmark = pytest.mark.anyio


async def test_cancelling_frees_the_core_of_compiled_code(api):
    job_id = await api.queue(HANGS)
    worker = await api.begun(job_id)
    response = await api.http.post(f"/v1/jobs/{job_id}/cancel")
    await until(lambda: not alive(worker))

    assert (response.status_code, response.json()["state"]) == (200, "cancelled")
    assert (await api.job(job_id))["error"] is None
    assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"
    assert (await api.job(job_id))["state"] == "cancelled"


async def test_a_cancelled_job_in_the_queue_never_runs(api):
    api.hold()
    running, waiting = await api.queue(WAITS), await api.queue(FINE)
    assert (await api.http.post(f"/v1/jobs/{waiting}/cancel")).json()["state"] == "cancelled"
    api.go()
    await api.ended(running)
    assert (await api.job(waiting))["attempts"] == 0


async def test_an_ended_job_stays_when_it_is_cancelled(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    response = await api.http.post(f"/v1/jobs/{job_id}/cancel")
    assert (response.status_code, response.json()["state"]) == (200, "succeeded")


@pytest.mark.parametrize("how", [FINE, HANGS])
async def test_a_deleted_job_is_gone_with_its_files(api, how):
    job_id = await api.queue(how)
    await api.ended(job_id, ("succeeded",) if how == FINE else ("running",))
    folder = api.storage.job_folder(job_id)
    assert (await api.http.delete(f"/v1/jobs/{job_id}")).status_code == 204
    assert (await api.http.get(f"/v1/jobs/{job_id}")).status_code == 404
    assert (await api.http.delete(f"/v1/jobs/{job_id}")).status_code == 404
    assert not folder.exists()
    assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


async def test_a_job_has_a_deadline_of_its_own(api):
    job = await api.ended(await api.queue(HANGS, deadline_s=0.3))
    assert (job["state"], job["error"]["code"]) == ("failed", "deadline_exceeded")
    assert "0.3 s" in job["error"]["detail"]


async def test_priority_goes_first(api):
    api.hold()
    first = await api.queue(WAITS)
    await api.ended(first, ("running",))
    low, high = await api.queue(FINE, priority=-1), await api.queue(FINE, priority=3)
    api.go()
    low, high = await api.ended(low), await api.ended(high)
    assert high["started_at"] < low["started_at"]


async def test_a_full_queue_says_when_to_come_back(start, tmp_path):
    async with start(tmp_path, max_queued_jobs=2) as api:
        running = await api.queue(HANGS)
        await api.ended(running, ("running",))
        for _ in range(2):
            await api.queue(FINE)
        response = await api.http.post("/v1/jobs", json={"object_id": await api.object_id()})
        assert (response.status_code, response.json()["limit"]) == (429, 2)
        assert "at most 2" in response.json()["detail"]
        assert int(response.headers["Retry-After"]) > 0
        batch = {"jobs": [{"object_id": await api.object_id()}] * 2}
        assert (await api.http.post("/v1/batches", json=batch)).status_code == 429


async def test_a_batch_is_accepted_whole(api):
    object_id = await api.object_id()
    body = {"jobs": [{"object_id": object_id, "hand": how} for how in (FINE, RAISES, NO_GRASP)]}
    response = await api.http.post("/v1/batches", json=body)
    batch = Batch.model_validate_json(response.content)
    assert (response.status_code, batch.states) == (202, {"queued": 3})
    for job_id in batch.job_ids:
        await api.ended(job_id)
    ended = Batch.model_validate((await api.http.get(response.headers["Location"])).json())
    assert (ended.job_ids, ended.states) == (batch.job_ids, {"succeeded": 2, "failed": 1})
    listed = JobPage.model_validate((await api.http.get(f"/v1/jobs?batch_id={batch.id}")).json())
    assert [job.id for job in listed.items] == batch.job_ids[::-1]


async def test_a_batch_with_one_fault_is_refused_whole(api):
    jobs = [{"object_id": await api.object_id()}, {"object_id": "nothing"}]
    before = (await api.http.get("/v1/jobs")).json()["items"]
    response = await api.http.post("/v1/batches", json={"jobs": jobs})
    assert (response.status_code, response.json()["errors"][0]["field"]) == (422, "/jobs/1/object_id")
    response = await api.http.post("/v1/batches", json={"jobs": [jobs[0], jobs[0] | {"hand": "claw"}]})
    assert response.json()["errors"][0]["field"] == "/jobs/1/hand"
    assert (await api.http.get("/v1/jobs")).json()["items"] == before
    assert (await api.http.get("/v1/batches/nothing")).status_code == 404


async def test_lists_filter_and_go_on(api):
    ids = [await api.queue(how) for how in (FINE, RAISES, FINE, FINE)]
    for job_id in ids:
        await api.ended(job_id)
    failed = JobPage.model_validate((await api.http.get("/v1/jobs?state=failed&limit=1")).json())
    assert [job.id for job in failed.items] == [ids[1]]
    seen, cursor = [], None
    while True:
        query = {"limit": 2, "object_id": await api.object_id()} | ({"cursor": cursor} if cursor else {})
        page = JobPage.model_validate((await api.http.get("/v1/jobs", params=query)).json())
        seen += [job.id for job in page.items]
        cursor = page.next_cursor
        if cursor is None:
            break
    assert seen[:4] == ids[::-1]
    assert len(seen) == len(set(seen))
    assert (await api.http.get("/v1/jobs?cursor=x")).status_code == 422
    assert (await api.http.get("/v1/jobs?hand=claw")).json() == {"items": [], "next_cursor": None}


async def test_lists_carry_what_a_table_of_runs_shows(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    job = JobPage.model_validate((await api.http.get("/v1/jobs?limit=1")).json()).items[0]
    assert (job.id, job.object_name, job.hand, job.state) == (job_id, "cube", "barrett", "succeeded")
    assert (job.holding_margin, job.feasible, job.verified, job.grasps) == (0.5, 1, 0, 1)


async def test_grasps_are_a_resource(api):
    job_id = await api.queue(FINE)
    result = (await api.ended(job_id))["result"]
    assert (await api.http.get(f"/v1/jobs/{job_id}/grasps")).json() == result["grasps"]
    grasp = Grasp.model_validate((await api.http.get(f"/v1/jobs/{job_id}/grasps/1")).json())
    assert grasp == Grasp.model_validate(result["grasps"][0])
    assert (await api.http.get(f"/v1/jobs/{job_id}/grasps/2")).status_code == 404
    verification = JobVerification.model_validate((await api.http.get(f"/v1/jobs/{job_id}/verification")).json())
    assert (verification.asked, verification.verified, verification.grasps) == (0, 0, [])


async def test_parallel_grasps_are_found_brought_and_planned_from(api):
    path = f"/v1/objects/{await api.object_id()}/parallel-grasps"
    found = await api.http.post(f"{path}/generate", json={"count": 3, "seed": 2, "name": "mine"})
    brought = await api.http.post(path, json={"parallel_grasps": found.json()["parallel_grasps"][:1]})
    assert (found.status_code, brought.status_code) == (201, 201)
    assert (found.json()["count"], found.json()["origin"], brought.json()["origin"]) == (3, "generated", "imported")
    listed = (await api.http.get(path)).json()
    assert [one["id"] for one in listed[:2]] == [brought.json()["id"], found.json()["id"]]
    assert (await api.http.get(found.headers["Location"])).json() == found.json()

    job = await api.ended(await api.queue(FINE, parallel_grasp_set=brought.json()["id"]))
    assert job["request"]["parallel_grasps"] == brought.json()["parallel_grasps"]
    assert (await api.http.delete(brought.headers["Location"])).status_code == 204
    assert (await api.http.get(brought.headers["Location"])).status_code == 404
    body = {"object_id": await api.object_id(), "parallel_grasp_set": brought.json()["id"]}
    refused = await api.http.post("/v1/jobs", json=body)
    assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "/parallel_grasp_set")


@pytest.mark.parametrize("file_type", ["ply", "stl", "obj", "glb", "off"])
async def test_the_mesh_comes_back_in_metres(api, file_type):
    object_id = await api.object_id()
    response = await api.http.get(f"/v1/objects/{object_id}/mesh", params={"format": file_type})
    assert response.status_code == 200
    again = await api.upload(response.content, f"again.{file_type}", unit="m")
    assert again.json()["extents"] == pytest.approx([0.05, 0.05, 0.05])
    assert (await api.http.get(f"/v1/objects/{object_id}/mesh?format=exe")).status_code == 422


async def test_a_deleted_object_is_gone(api):
    uploaded = await api.upload(api.cube(9), "nine.off", unit="cm")
    path = uploaded.headers["Location"]
    storage = api.storage
    job_id = await api.queue(HANGS, object_id=uploaded.json()["id"])
    refused = await api.http.delete(path)
    assert (refused.status_code, refused.json()["type"]) == (409, "urn:fingersplit:problem:in-use")
    await api.http.post(f"/v1/jobs/{job_id}/cancel")
    assert (await api.http.get(f"{path}/report")).json() == uploaded.json()["report"]
    assert (await api.http.delete(path)).status_code == 204
    assert (await api.http.get(path)).status_code == 404
    assert storage.shape(uploaded.json()["id"]).exists()  # until clean-up: another may be uploading the same
