"""What one machine does with jobs, several machines do, too: every test runs against both."""

import asyncio
import os
import signal
from collections.abc import AsyncIterator

import anyio
import pytest
from conftest import PATIENCE, started, started_cluster, until
from fake_workers import DIES, DIES_ONCE, FINE, HANGS, HANGS_ONCE, RAISES, WAITS
from test_faults import alive
from test_waiting import events_of

pytestmark = pytest.mark.anyio


@pytest.fixture(scope="module", params=["embedded", "cluster"])
async def both(request, tmp_path_factory, anyio_backend) -> AsyncIterator:
    """A service with one worker: in one process, or a replica and an agent."""
    folder = tmp_path_factory.mktemp(request.param)
    if request.param == "embedded":
        async with started(folder) as api:
            yield api
    else:
        async with started_cluster(folder, request.getfixturevalue("postgresql")()) as (api,):
            yield api


async def test_a_job_ends_with_its_result(both):
    job = await both.ended(await both.queue(FINE))
    assert (job["state"], job["attempts"]) == ("succeeded", 1)
    assert job["result"]["grasps"][0]["rank"] == 1


async def test_who_waits_is_told_at_once(both):
    body = {"object_id": await both.object_id(), "hand": FINE}
    answer = await both.http.post("/v1/jobs", json=body, headers={"Prefer": f"wait={PATIENCE}"})
    assert (answer.status_code, answer.json()["state"]) == (200, "succeeded")
    both.hold()
    job_id = await both.queue(WAITS)
    waiting = asyncio.create_task(both.http.get(f"/v1/jobs/{job_id}", headers={"Prefer": f"wait={PATIENCE}"}))
    await both.begun(job_id)
    both.go()
    assert (await waiting).json()["state"] == "succeeded"


async def test_events_tell_how_far_a_job_is(both):
    both.hold()
    job_id = await both.queue(WAITS)
    following = asyncio.create_task(both.http.get(f"/v1/jobs/{job_id}/events"))
    await both.begun(job_id)
    with anyio.fail_after(PATIENCE):
        while (job := await both.job(job_id))["stage"] != "splitting":
            await anyio.sleep(0.01)
    assert (job["state"], job["progress"]) == ("running", 0.5)
    both.go()
    states = [name for _, name, _ in events_of((await following).text)]
    assert (states[0], states[-1]) == ("queued", "succeeded")
    assert "running" in states


async def test_a_cancelled_job_leaves_its_worker_free(both):
    running, queued = await both.queue(HANGS), await both.queue(FINE)
    worker = await both.begun(running)
    following = asyncio.create_task(both.http.get(f"/v1/jobs/{running}/events"))
    assert (await both.http.post(f"/v1/jobs/{running}/cancel")).json()["state"] == "cancelled"
    await until(lambda: not alive(worker))
    assert (await both.ended(queued))["state"] == "succeeded"
    assert events_of((await following).text)[-1][1] == "cancelled"
    assert (await both.job(running))["state"] == "cancelled"


async def test_a_deadline_ends_compiled_code(both):
    job = await both.ended(await both.queue(HANGS, deadline_s=0.3))
    assert (job["state"], job["error"]["code"]) == ("failed", "deadline_exceeded")


async def test_a_job_that_kills_its_worker_is_run_once_more(both):
    once, twice, after = [await both.queue(how) for how in (DIES_ONCE, DIES, FINE)]
    job = await both.ended(once)
    assert (job["state"], job["attempts"]) == ("succeeded", 2)
    assert (await both.ended(twice))["error"]["code"] == "worker_died"
    assert (await both.ended(after))["state"] == "succeeded"


async def test_a_job_whose_worker_is_killed_is_run_again(both):
    job_id = await both.queue(HANGS_ONCE)
    os.kill(await both.begun(job_id), signal.SIGKILL)
    job = await both.ended(job_id)
    assert (job["state"], job["attempts"]) == ("succeeded", 2)


async def test_a_fault_fails_the_job_and_stays_inside(both):
    job = await both.ended(await both.queue(RAISES))
    assert job["error"]["code"] == "internal"
    assert "secret" not in str(job)


async def test_the_highest_priority_is_first(both):
    both.hold()
    await both.begun(await both.queue(WAITS))
    low, high = await both.queue(FINE, priority=-1), await both.queue(FINE, priority=1)
    both.go()
    started_at = [(await both.ended(job_id))["started_at"] for job_id in (low, high)]
    assert started_at[1] < started_at[0]


async def test_one_key_is_one_job_however_often_it_is_sent(both):
    body, headers = {"object_id": await both.object_id(), "hand": FINE}, {"Idempotency-Key": "at-once"}
    answers = await asyncio.gather(*(both.http.post("/v1/jobs", json=body, headers=headers) for _ in range(8)))
    assert {answer.status_code for answer in answers} <= {200, 202}
    assert len({answer.json()["id"] for answer in answers}) == 1
    other = await both.http.post("/v1/jobs", json=body | {"starts": 3}, headers=headers)
    assert (other.status_code, other.json()["type"]) == (422, "urn:fingersplit:problem:idempotency-key-reused")


async def test_pictures_and_meshes_are_there_wherever_they_were_made(both):
    job_id = await both.queue(FINE)
    await both.ended(job_id)
    assert (await both.http.get(f"/v1/jobs/{job_id}/grasps/1/picture.png")).status_code == 200
    mesh = await both.http.get(f"/v1/objects/{await both.object_id()}/mesh")
    assert mesh.content.startswith(b"ply")
    assert (await both.http.delete(f"/v1/jobs/{job_id}")).status_code == 204
    assert (await both.http.get(f"/v1/jobs/{job_id}")).status_code == 404
