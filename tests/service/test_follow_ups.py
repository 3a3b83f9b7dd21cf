"""The first grasp of every run is verified and recorded behind the answer: none is lost, and nobody waits for it."""

import os
import signal

import anyio
import pytest
from conftest import PATIENCE, until
from fake_workers import FINE, RAISES
from test_faults import children, serving, wait_until
from test_security import bearer, until_status
from test_waiting import events_of

from fingersplit_service.database.follow_ups import FollowUpStore
from fingersplit_service.database.keys import KeyStore

pytestmark = pytest.mark.anyio
BEHIND = {"verify_first": True, "workers": 1, "spare_workers": 1}


async def verified(api, job_id: str) -> dict:
    """The job once its first grasp is verified, or cannot be."""
    with anyio.fail_after(PATIENCE):
        while (job := await api.job(job_id))["verification"] == "pending":
            await anyio.sleep(0.01)
    return job


@pytest.fixture
def held(tmp_path):
    """While this file is there, no verification ends."""
    file = tmp_path / "hold_verification"
    file.touch()
    return file


async def test_the_answer_comes_before_the_verification(start, tmp_path, held):
    async with start(tmp_path, **BEHIND) as api:
        body = {"object_id": await api.object_id(), "hand": FINE}
        answer = (await api.http.post("/v1/jobs", json=body, headers={"Prefer": f"wait={PATIENCE}"})).json()
        assert (answer["state"], answer["verification"], answer["verified"]) == ("succeeded", "pending", 0)
        assert answer["result"]["grasps"][0]["verification"] is None
        await until((tmp_path / "verifying").exists)
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"  # beside it
        held.unlink()
        job = await verified(api, answer["id"])
        assert (job["verification"], job["verified"]) == ("done", 1)
        assert job["result"]["grasps"][0]["verification"]["passed"] is True
        recording = await api.http.get(f"/v1/jobs/{answer['id']}/recording.rrd")
        assert recording.content == b"recording with a lift"
        listed = (await api.http.get("/v1/jobs")).json()["items"]
        assert next(one for one in listed if one["id"] == answer["id"])["verification"] == "done"


async def test_an_event_says_when_it_is_there(start, tmp_path, held):
    async with start(tmp_path, **BEHIND) as api:
        job_id = await api.queue(FINE)
        await api.ended(job_id)
        short = events_of((await api.http.get(f"/v1/jobs/{job_id}/events")).text)
        assert (short[-1][1], short[-1][2].verification) == ("succeeded", "pending")
        histories = []

        async def follow() -> None:
            histories.append(events_of((await api.http.get(f"/v1/jobs/{job_id}/events?verification=true")).text))

        async with anyio.create_task_group() as group:
            group.start_soon(follow)
            await api.until_metric(1, "fingersplit_waiting_requests")
            held.unlink()
        assert [job.verification for _, name, job in histories[0] if name == "succeeded"] == ["pending", "done"]
        again = events_of((await api.http.get(f"/v1/jobs/{job_id}/events?verification=true")).text)
        assert again[-1][2].verification == "done"


@pytest.mark.parametrize(
    ("settings", "fields"), [({"verify_first": False}, {}), ({}, {"verify_first": False}), ({}, {"hand": RAISES})]
)
async def test_it_can_be_turned_off(start, tmp_path, settings, fields):
    async with start(tmp_path, **BEHIND | settings) as api:
        job = await api.ended(await api.queue(FINE, **fields))
        assert job["verification"] is None
        with api.tables() as database:
            assert await FollowUpStore(database).claim() is None


async def test_it_is_done_without_a_spare_worker_once_nothing_else_is_asked_for(start, tmp_path):
    async with start(tmp_path, **BEHIND | {"spare_workers": 0}) as api:
        jobs = [await api.queue(FINE) for _ in range(3)]
        for job_id in jobs:
            await api.ended(job_id)
            assert (await verified(api, job_id))["verification"] == "done"


async def test_a_worker_that_dies_of_it_costs_nothing_but_time(start, tmp_path):
    (tmp_path / "deaths").write_text("2")
    async with start(tmp_path, **BEHIND) as api:
        jobs = [await api.queue(FINE) for _ in range(3)]
        for job_id in jobs:
            job = await api.ended(job_id)
            assert (job["state"], job["attempts"]) == ("succeeded", 1)
            assert (await verified(api, job_id))["verification"] == "done"


async def test_one_that_kills_its_worker_again_and_again_is_given_up(start, tmp_path):
    (tmp_path / "deaths").write_text("5")
    async with start(tmp_path, **BEHIND) as api:
        job_id = await api.queue(FINE)
        await api.ended(job_id)
        assert (await verified(api, job_id))["verification"] == "failed"
        assert (await api.job(job_id))["state"] == "succeeded"
        again = await api.queue(FINE)
        await api.ended(again)
        assert (await verified(api, again))["verification"] == "done"


async def test_what_a_stop_leaves_is_done_by_the_next_process(start, tmp_path, held):
    async with start(tmp_path, **BEHIND) as api:
        jobs = [await api.queue(FINE) for _ in range(3)]
        for job_id in jobs:
            await api.ended(job_id)
        await until((tmp_path / "verifying").exists)
    held.unlink()
    async with start(tmp_path, **BEHIND) as api:
        for job_id in jobs:
            assert (await verified(api, job_id))["verification"] == "done"


async def test_a_job_deleted_meanwhile_leaves_nothing(start, tmp_path, held):
    async with start(tmp_path, **BEHIND) as api:
        job_id = await api.queue(FINE)
        await api.ended(job_id)
        await until((tmp_path / "verifying").exists)
        assert (await api.http.delete(f"/v1/jobs/{job_id}")).status_code == 204
        held.unlink()
        other = await api.queue(FINE)
        await api.ended(other)
        assert (await verified(api, other))["verification"] == "done"
        assert not api.storage.job_folder(job_id).exists()


async def test_owners_take_turns(start, tmp_path, held):
    async with start(tmp_path, **BEHIND) as api:
        with api.tables() as database:
            keys = KeyStore(database)
            mine, yours = [await keys.create(name, ["read", "plan"]) for name in ("mine", "yours")]
        await until_status(api, 401, {})
        order = {}
        for key, count in ((mine, 4), (yours, 1)):
            mesh = {"file": ("c.off", api.cube(5))}
            uploaded = await api.http.post("/v1/objects", files=mesh, data={"unit": "cm"}, headers=bearer(key))
            for _ in range(count):
                body = {"object_id": uploaded.json()["id"], "hand": FINE}
                headers = bearer(key) | {"Prefer": f"wait={PATIENCE}"}
                order[(await api.http.post("/v1/jobs", json=body, headers=headers)).json()["id"]] = key
        held.unlink()
        begun = tmp_path / "verifying"
        await until(lambda: begun.exists() and len(begun.read_text().split()) == 5)
        owners = [order[job_id] for job_id in (tmp_path / "verifying").read_text().split()]
        assert yours in owners[:3]


def test_a_killed_service_loses_none(tmp_path, unused_port, cube):
    (tmp_path / "hold_verification").touch()
    with serving(tmp_path, unused_port) as (process, http):
        object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
        headers = {"Prefer": f"wait={PATIENCE}"}
        jobs = [http.post("/v1/jobs", json={"object_id": object_id}, headers=headers).json()["id"] for _ in range(5)]
        wait_until((tmp_path / "verifying").exists)
        for worker in children(process.pid):
            os.kill(worker, signal.SIGKILL)
        process.kill()
        process.wait()
    (tmp_path / "hold_verification").unlink()
    with serving(tmp_path, unused_port) as (_, http):
        states = lambda: [http.get(f"/v1/jobs/{job_id}").json()["verification"] for job_id in jobs]  # noqa: E731
        wait_until(lambda: states() == ["done"] * 5)
        document = http.get(f"/v1/jobs/{jobs[0]}").json()
        assert document["result"]["grasps"][0]["verification"]["passed"] is True
