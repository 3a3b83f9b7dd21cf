"""Waiting for jobs: by `Prefer: wait` and by events; nobody polls."""

import asyncio
import json

import anyio
import pytest
from conftest import PATIENCE
from fake_workers import DIES_ONCE, FINE, HANGS, RAISES, WAITS

from fingersplit_client.schemas import Job, JobSummary

pytestmark = pytest.mark.anyio


def events_of(text: str) -> list[tuple[int, str, JobSummary]]:
    """Id, name and document of each event of a stream."""
    found = []
    for block in text.split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.splitlines() if not line.startswith(":"))
        if fields:
            found.append((int(fields["id"]), fields["event"], JobSummary.model_validate(json.loads(fields["data"]))))
    return found


async def create(api, how, prefer=None, **headers):
    body = {"object_id": await api.object_id(), "hand": how}
    given = headers | ({"Prefer": prefer} if prefer else {})
    return await api.http.post("/v1/jobs", json=body, headers=given)


async def test_create_answers_with_the_result_when_the_job_ends(api):
    response = await create(api, FINE, "wait=120")
    assert response.status_code == 200
    assert response.headers["Preference-Applied"] == "wait=120"
    assert Job.model_validate_json(response.content).result.grasps


async def test_create_answers_at_the_deadline(api):
    response = await create(api, HANGS, "respond-async, wait=0.2")
    assert response.headers["Preference-Applied"] == "wait=0.2"
    job = Job.model_validate_json(response.content)
    assert (response.status_code, job.result) == (202, None)
    assert job.state in ("queued", "running")
    await api.http.post(f"/v1/jobs/{job.id}/cancel")


async def test_a_failure_ends_the_wait_too(api):
    response = await create(api, RAISES, "wait=120")
    assert (response.status_code, response.json()["state"]) == (200, "failed")


async def test_get_waits_as_well(api):
    api.hold()
    job_id = await api.queue(WAITS)
    waiting = asyncio.create_task(api.http.get(f"/v1/jobs/{job_id}", headers={"Prefer": "wait=120"}))
    await api.until_metric(1, "fingersplit_waiting_requests")
    api.go()
    response = await waiting
    assert (response.status_code, response.json()["state"]) == (200, "succeeded")


@pytest.mark.parametrize("prefer", ["wait=soon", "wait=nan", "wait=-5", "wait=inf", "return=minimal", ";,=,", "wait"])
async def test_a_preference_that_makes_no_sense_is_ignored(api, prefer):
    response = await create(api, FINE, prefer)
    assert response.status_code == 202
    assert "Preference-Applied" not in response.headers
    await api.ended(response.json()["id"])


async def test_many_wait_for_one_job(api):
    api.hold()
    job_id = await api.queue(WAITS)
    waiting = [
        asyncio.create_task(api.http.get(f"/v1/jobs/{job_id}", headers={"Prefer": "wait=120"})) for _ in range(20)
    ]
    await api.until_metric(20, "fingersplit_waiting_requests")
    api.go()
    with anyio.fail_after(PATIENCE):
        answers = await asyncio.gather(*waiting)
    assert {(answer.status_code, answer.json()["state"]) for answer in answers} == {(200, "succeeded")}


async def test_an_idempotency_key_makes_one_job(api):
    first = await create(api, FINE, "wait=120", **{"Idempotency-Key": "robot-7/pick-1"})
    again = await create(api, FINE, "wait=120", **{"Idempotency-Key": "robot-7/pick-1"})
    other = await create(api, RAISES, **{"Idempotency-Key": "robot-7/pick-1"})

    assert (first.status_code, again.status_code) == (200, 200)
    assert again.json() == first.json()
    assert again.headers["Idempotent-Replayed"] == "true"
    assert (other.status_code, other.json()["type"]) == (422, "urn:fingersplit:problem:idempotency-key-reused")
    assert (await create(api, FINE, **{"Idempotency-Key": "with space"})).status_code == 422


async def test_a_retry_while_the_job_runs_waits_for_it(api):
    api.hold()
    both = [
        asyncio.create_task(create(api, WAITS, "wait=120", **{"Idempotency-Key": "both-at-once"})) for _ in range(2)
    ]
    await api.until_metric(2, "fingersplit_waiting_requests")
    api.go()
    first, again = await asyncio.gather(*both)
    assert first.json()["id"] == again.json()["id"]
    assert {first.json()["state"], again.json()["state"]} == {"succeeded"}


async def test_events_tell_the_whole_story(api):
    api.hold()
    job_id = await api.queue(WAITS)
    following = asyncio.create_task(api.http.get(f"/v1/jobs/{job_id}/events"))
    await api.until_metric(1, "fingersplit_waiting_requests")
    api.go()
    with anyio.fail_after(PATIENCE):
        response = await following
    assert response.headers["Content-Type"].startswith("text/event-stream")
    history = events_of(response.text)
    numbers, names = [number for number, _, _ in history], [name for _, name, _ in history]
    assert numbers == sorted(set(numbers))
    assert (names[0], names[-1]) == ("queued", "succeeded")
    assert "running" in names
    assert any(job.stage == "splitting" and job.progress == 0.5 for _, _, job in history)
    assert history[-1][2].feasible == 1


async def test_events_go_on_where_they_broke_off(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    history = events_of((await api.http.get(f"/v1/jobs/{job_id}/events")).text)
    for place, (number, _, _) in enumerate(history):
        response = await api.http.get(f"/v1/jobs/{job_id}/events", headers={"Last-Event-ID": str(number)})
        assert [later for later, _, _ in events_of(response.text)] == [later for later, _, _ in history[place + 1 :]]
    response = await api.http.get(f"/v1/jobs/{job_id}/events", headers={"Last-Event-ID": "nonsense"})
    assert len(events_of(response.text)) == len(history)


async def test_replayed_events_carry_the_state_they_were_sent_with(api):
    """After the end nothing of the end stands in the events that were sent before it."""
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    history = events_of((await api.http.get(f"/v1/jobs/{job_id}/events")).text)
    assert [name for _, name, _ in history] == [job.state for _, _, job in history]
    queued, running, ended = history[0][2], history[1][2], history[-1][2]
    assert (queued.started_at, queued.attempts, queued.finished_at, queued.grasps) == (None, 0, None, None)
    assert (running.finished_at, running.grasps, running.feasible, running.error) == (None, None, None, None)
    assert running.started_at == ended.started_at
    assert (ended.finished_at is not None, ended.grasps) == (True, 1)


async def test_events_tell_of_a_second_attempt(api):
    job_id = await api.queue(DIES_ONCE)
    with anyio.fail_after(PATIENCE):
        history = events_of((await api.http.get(f"/v1/jobs/{job_id}/events")).text)
    assert history[-1][1] == "succeeded"
    assert history[-1][2].attempts == 2


async def test_a_stop_lets_everybody_go(start, tmp_path):
    async with start(tmp_path) as own:
        waiting = asyncio.create_task(create(own, HANGS, "wait=300"))
        await own.until_metric(1, "fingersplit_waiting_requests")
        own.app.state.runtime.notifier.close()
        with anyio.fail_after(PATIENCE):
            assert (await waiting).status_code == 202
            assert (await create(own, HANGS, "wait=300")).status_code == 202
