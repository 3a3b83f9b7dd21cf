"""Both clients against a real service with the real planner, over a real socket."""

import asyncio
import json
from pathlib import Path
from typing import get_args

import anyio
import httpx2
import pytest

from fingersplit.splitting.termination import Termination as CoreTermination
from fingersplit_client import (
    ApiError,
    AsyncClient,
    Client,
    FingersplitClientError,
    JobCreate,
    JobFailed,
    ParallelGrasp,
    ParallelGraspsGenerate,
    ServiceUnreachable,
    WaitTimeout,
)
from fingersplit_client.schemas import Termination


def test_the_whole_way(service: str, can: bytes, tmp_path: Path) -> None:
    path = tmp_path / "can.off"
    path.write_bytes(can)
    seen = []
    with Client(service) as client:
        result = client.plan(path, starts=16, seed=3, top_k=4, on_progress=seen.append)

    assert (result.hand, result.object.name, result.seed, result.starts) == ("barrett", "can", 3, 16)
    assert result.summary.feasible > 0
    best = result.grasps[0]
    assert [grasp.rank for grasp in result.grasps] == list(range(1, len(result.grasps) + 1))
    assert best.feasible
    assert best.violations == []
    assert len(best.contacts) == 3
    assert all(contact.residual <= 0.5e-3 for contact in best.contacts)
    assert seen[-1].state == "succeeded"


def test_the_same_seed_gives_the_same_grasps(service: str, can: bytes) -> None:
    with Client(service) as client:
        first, second = (client.plan(can, file_type="off", starts=8, seed=5) for _ in range(2))
    untimed = [[grasp.model_dump(exclude={"timings_ms"}) for grasp in result.grasps] for result in (first, second)]
    assert untimed[0] == untimed[1]


def test_given_parallel_grasps_are_where_it_starts(service: str, can: bytes) -> None:
    grasp = ParallelGrasp(contacts=((0.03, 0, 0.0), (-0.03, 0, 0.0)), approach=(0, 0, -1))
    with Client(service) as client:
        result = client.plan(can, file_type="off", parallel_grasps=[grasp])
    assert result.grasps
    assert all(one.initial.parallel_grasp == grasp for one in result.grasps)


def test_pictures_are_png(service: str, can: bytes) -> None:
    with Client(service) as client:
        uploaded = client.upload_object(can, file_type="off", name="can")
        job = client.wait(client.create_job(JobCreate(object_id=uploaded.id, starts=4, seed=1)))
        assert client.picture(job.id).startswith(b"\x89PNG\r\n\x1a\n")


def test_hands_have_what_grasps_name(service: str, can: bytes) -> None:
    with Client(service) as client:
        (hand,) = client.hands()
        best = client.plan(can, file_type="off", starts=4).grasps[0]
    assert list(best.joints) == [joint.name for joint in hand.joints]
    assert [contact.finger for contact in best.contacts] == [finger.name for finger in hand.fingers]


def test_a_refusal_carries_the_problem(service: str) -> None:
    with Client(service) as client:
        with pytest.raises(ApiError, match="Unknown hand 'claw'") as caught:
            client.create_job(JobCreate(object_id="x", hand="claw"))
        assert caught.value.problem.valid == ["barrett"]
        with pytest.raises(ApiError) as caught:
            client.upload_object(b"nonsense", file_type="stl")
    assert caught.value.problem.status == 422
    assert caught.value.problem.code


def test_waiting_has_an_end(service: str, can: bytes) -> None:
    with Client(service) as client:
        uploaded = client.upload_object(can, file_type="off")
        job = client.create_job(JobCreate(object_id=uploaded.id, starts=256))
        with pytest.raises(WaitTimeout, match=r"after 0\.001 s") as caught:
            client.wait(job, timeout=0.001)
        assert caught.value.job.id == job.id
        client.wait(job)


def test_ready_is_what_the_service_says(service: str) -> None:
    with Client(service) as client:
        assert client.ready()
    starting = httpx2.MockTransport(lambda request: httpx2.Response(503 if request.url.path == "/readyz" else 200))
    with Client(transport=starting) as client:
        assert not client.ready()


def test_bytes_need_a_type() -> None:
    with Client() as client, pytest.raises(FingersplitClientError, match="file_type"):
        client.upload_object(b"OFF")


def test_every_resource_has_its_method(service: str, can: bytes) -> None:
    with Client(service) as client:
        uploaded = client.upload_object(can, file_type="off", name="can")
        assert client.get_object(uploaded.id) == uploaded
        assert uploaded in client.list_objects(limit=1000).items
        again = client.upload_object(client.mesh(uploaded.id, "stl"), file_type="stl")
        assert again.extents == pytest.approx(uploaded.extents, abs=1e-6)

        found = client.generate_parallel_grasps(uploaded.id, ParallelGraspsGenerate(count=4, seed=1))
        kept = client.import_parallel_grasps(uploaded.id, found.parallel_grasps[:2], name="two")
        assert [one.id for one in client.list_parallel_grasps(uploaded.id)][:2] == [kept.id, found.id]
        assert client.parallel_grasps(uploaded.id, kept.id) == kept
        document = json.dumps([grasp.model_dump() for grasp in kept.parallel_grasps]).encode()
        read = client.import_grasp_file(uploaded.id, document, file_format="fingersplit", name="read")
        assert (read.name, read.parallel_grasps) == ("read", kept.parallel_grasps)
        result = client.plan(can, file_type="off", parallel_grasp_set=kept.id)
        known = [sorted(grasp.contacts) for grasp in kept.parallel_grasps]
        assert all(sorted(grasp.initial.parallel_grasp.contacts) in known for grasp in result.grasps)
        client.delete_parallel_grasps(uploaded.id, kept.id)

        batch = client.create_batch([JobCreate(object_id=uploaded.id, starts=2, seed=seed) for seed in range(2)])
        jobs = [client.get_job(job_id, wait=25) for job_id in batch.job_ids]
        assert client.get_batch(batch.id).states == {"succeeded": 2}
        assert [job.id for job in client.list_jobs(batch_id=batch.id, state=["succeeded"]).items] == batch.job_ids[::-1]
        assert jobs[0].result is not None
        assert client.grasps(jobs[0].id) == jobs[0].result.grasps
        assert client.verification(jobs[0].id).grasps == []
        client.delete_job(jobs[0].id)
        with pytest.raises(ApiError, match="There is no job"):
            client.get_job(jobs[0].id)
        client.delete_object(again.id)


def test_a_job_can_be_followed_and_cancelled(service: str, can: bytes) -> None:
    with Client(service) as client:
        uploaded = client.upload_object(can, file_type="off")
        job = client.create_job(JobCreate(object_id=uploaded.id, starts=2), idempotency_key="follow-me")
        story = list(client.events(job.id))
        assert story[-1].job.state == "succeeded"
        assert list(client.events(job.id, last_event_id=story[-1].id)) == []
        long = client.create_job(JobCreate(object_id=uploaded.id, starts=4096))
        assert client.cancel_job(long.id).state == "cancelled"
        with pytest.raises(JobFailed, match="cancelled"):
            client.wait(client.get_job(long.id))
        with pytest.raises(ApiError, match="There is no job"):
            list(client.events("nothing"))


@pytest.mark.anyio
async def test_a_job_can_be_followed_asynchronously(service: str, can: bytes) -> None:
    async with AsyncClient(service) as client:
        uploaded = await client.upload_object(can, file_type="off")
        job = await client.create_job(JobCreate(object_id=uploaded.id, starts=2))
        with anyio.fail_after(60):
            story = [event async for event in client.events(job.id)]
        assert story[-1].job.state == "succeeded"
        assert [int(event.id) for event in story] == sorted({int(event.id) for event in story})


@pytest.mark.anyio
async def test_the_whole_way_asynchronously(service: str, can: bytes) -> None:
    async with AsyncClient(service) as client:
        with anyio.fail_after(60):
            results = await asyncio.gather(
                *(client.plan(can, file_type="off", starts=4, seed=seed) for seed in range(3))
            )
        (hand,) = await client.hands()
        uploaded = await client.upload_object(can, file_type="off")
        job = await client.wait(await client.create_job(JobCreate(object_id=uploaded.id, starts=4)))
        assert (await client.picture(job.id)).startswith(b"\x89PNG")
        assert (await client.get_job(job.id)).result == job.result
    assert [result.seed for result in results] == [0, 1, 2]
    assert {result.hand for result in results} == {hand.name}


@pytest.mark.anyio
async def test_nobody_at_the_address(unused_url: str) -> None:
    with Client(unused_url) as client, pytest.raises(ServiceUnreachable, match=unused_url):
        client.hands()
    async with AsyncClient(unused_url) as client:
        with pytest.raises(ServiceUnreachable, match=unused_url):
            await client.hands()


def test_every_termination_has_a_place_on_the_wire() -> None:
    assert set(get_args(Termination)) == {end.label for end in CoreTermination}
