"""Both clients against a real service with the real planner, over a real socket and within this process."""

import json
from pathlib import Path
from typing import Any, get_args

import pytest

from client_calls import done, items
from fingersplit.result import read_result
from fingersplit.splitting.termination import Termination as CoreTermination
from fingersplit_client import (
    Client,
    InvalidRequestError,
    JobCreate,
    JobFailed,
    NotFoundError,
    ParallelGrasp,
    ParallelGraspsGenerate,
    PlanResult,
)
from fingersplit_client.options import ObjectKeywords
from fingersplit_client.schemas import Termination

pytestmark = pytest.mark.anyio


async def test_the_whole_way(client: Any, can: bytes, tmp_path: Path) -> None:
    path = tmp_path / "can.off"
    path.write_bytes(can)
    seen: list[Any] = []
    result = await done(
        client.plan(path, starts=16, seed=3, top_k=4, mass=0.3, verify_first=False, on_progress=seen.append)
    )

    assert (result.hand, result.object.name, result.seed, result.starts) == ("barrett", "can", 3, 16)
    assert (result.object.mass, len(result.grasps)) == (0.3, 4)
    assert result.best.feasible
    assert result.best.violations == []
    assert [grasp.rank for grasp in result.grasps] == [1, 2, 3, 4]
    assert (seen[0].state, seen[-1].state, seen[-1].id) == ("queued", "succeeded", result.job_id)
    assert (await done(client.jobs.get(result.job_id))).result == result
    assert (await done(result.picture())).startswith(b"\x89PNG")
    assert json.loads(await done(result.best.export("moveit")))["grasps"][0]["id"] == f"grasp_{result.best.rank}"
    placed = result.best.in_frame(((0.5, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0)), "base_link")
    pose = json.loads(await done(placed.export()))["grasps"][0]["grasp_pose"]
    assert pose["header"]["frame_id"] == "base_link"
    assert list(pose["pose"]["position"].values()) == pytest.approx(placed.matrix[:3, 3])
    with pytest.raises(InvalidRequestError, match="object frame"):
        await done(placed.export("isaac_grasp"))


async def test_one_mesh_however_it_is_given_is_one_object(client: Any, can: bytes, tmp_path: Path) -> None:
    path = tmp_path / "can.off"
    path.write_bytes(can)
    rows = [line.split() for line in can.decode().splitlines()[2:]]
    vertices = [[float(x) for x in row] for row in rows if row[0] != "3" or len(row) == 3]
    faces = [[int(i) for i in row[1:]] for row in rows if len(row) == 4]
    with path.open("rb") as opened:
        given = [path, str(path), opened, (vertices, faces)]
        results = [await done(client.plan(mesh, starts=2, seed=5)) for mesh in given]
    results.append(await done(client.plan(can, file_type="off", starts=2, seed=5)))
    uploaded = await done(client.objects.upload(path))
    results.append(await done(client.plan(uploaded, starts=2, seed=5)))
    assert {result.object.id for result in results} == {uploaded.id}
    assert len({json.dumps(grasp.joints) for result in results for grasp in result.grasps[:1]}) == 1
    with pytest.raises(InvalidRequestError, match="when it is uploaded"):
        await done(client.plan(uploaded, mass=0.3))


async def test_an_object_that_was_deleted_meanwhile_is_uploaded_again(client: Any, can: bytes) -> None:
    first = await done(client.plan(can, file_type="off", starts=2, mass=0.123))
    await done(client.jobs.delete(first.job_id))
    await done(client.objects.delete(first.object.id))
    again = await done(client.plan(can, file_type="off", starts=2, mass=0.123))
    assert again.object == first.object


async def test_given_parallel_grasps_are_where_it_starts(client: Any, can: bytes) -> None:
    grasp = ParallelGrasp(contacts=((0.03, 0, 0.0), (-0.03, 0, 0.0)), approach=(0, 0, -1))
    result = await done(client.plan(can, file_type="off", parallel_grasps=[grasp]))
    assert result.grasps
    assert all(one.initial.parallel_grasp == grasp for one in result.grasps)


async def test_hands_have_what_grasps_name(client: Any, can: bytes) -> None:
    hand = await done(client.hands.get("barrett"))
    best = (await done(client.plan(can, file_type="off", starts=4))).best
    names = [joint.name for joint in hand.joints]
    assert list(best.joints) == names
    assert best.joint_vector(names) == list(best.joints.values())
    assert [contact.finger for contact in best.contacts] == [finger.name for finger in hand.fingers]
    with pytest.raises(InvalidRequestError, match="did you mean 'barrett'"):
        await done(client.hands.get("barett"))


async def test_a_refusal_carries_the_problem(client: Any) -> None:
    with pytest.raises(InvalidRequestError, match="Unknown hand 'claw'") as caught:
        await done(client.jobs.create(JobCreate(object_id="x", hand="claw")))
    assert "barrett" in caught.value.problem.valid
    assert "barrett" in caught.value.advice
    with pytest.raises(InvalidRequestError) as caught:
        await done(client.objects.upload(b"nonsense", file_type="stl"))
    assert (caught.value.problem.status, bool(caught.value.problem.code)) == (422, True)
    with pytest.raises(NotFoundError, match="There is no job"):
        await items(client.jobs.events("nothing"))


async def test_every_resource_has_its_operations(client: Any, can: bytes) -> None:
    uploaded = await done(client.objects.upload(can, file_type="off", name="can"))
    assert await done(client.objects.get(uploaded.id)) == uploaded
    assert uploaded in await items(client.objects.all())
    again = await done(client.objects.upload(await done(client.objects.mesh(uploaded.id, "stl")), file_type="stl"))
    assert again.extents == pytest.approx(uploaded.extents, abs=1e-6)

    found = await done(client.parallel_grasps.generate(uploaded.id, ParallelGraspsGenerate(count=4, seed=1)))
    kept = await done(client.parallel_grasps.create(uploaded.id, found.parallel_grasps[:2], name="two"))
    listed = await done(client.parallel_grasps.list(uploaded.id))
    assert [one.id for one in listed][:2] == [kept.id, found.id]
    assert await done(client.parallel_grasps.get(uploaded.id, kept.id)) == kept
    document = json.dumps([grasp.model_dump() for grasp in kept.parallel_grasps]).encode()
    read = await done(client.parallel_grasps.import_file(uploaded.id, document, file_format="fingersplit", name="read"))
    assert (read.name, read.parallel_grasps) == ("read", kept.parallel_grasps)
    result = await done(client.plan(uploaded, parallel_grasp_set=kept.id))
    known = [sorted(grasp.contacts) for grasp in kept.parallel_grasps]
    assert all(sorted(grasp.initial.parallel_grasp.contacts) in known for grasp in result.grasps)
    await done(client.parallel_grasps.delete(uploaded.id, kept.id))

    requests = [JobCreate(object_id=uploaded.id, starts=2, seed=seed, verify_first=False) for seed in range(2)]
    batch = await done(client.batches.create(requests))
    jobs = [await done(client.jobs.wait(job_id)) for job_id in batch.job_ids]
    assert (await done(client.batches.get(batch.id))).states == {"succeeded": 2}
    ended = await items(client.jobs.all(batch_id=batch.id, state=["succeeded"]))
    assert [job.id for job in ended] == batch.job_ids[::-1]
    assert await done(client.jobs.grasps(jobs[0].id)) == jobs[0].result.grasps
    assert (await done(client.jobs.verification(jobs[0].id))).grasps == []
    assert await done(client.jobs.export(jobs[0].id, "moveit"))
    await done(client.jobs.delete(jobs[0].id))
    with pytest.raises(NotFoundError, match="There is no job"):
        await done(client.jobs.get(jobs[0].id))
    await done(client.objects.delete(again.id))


async def test_a_job_can_be_followed_and_cancelled(client: Any, can: bytes) -> None:
    uploaded = await done(client.objects.upload(can, file_type="off"))
    job = await done(client.jobs.create(JobCreate(object_id=uploaded.id, starts=2, verify_first=False)))
    seen = await items(client.jobs.events(job.id))
    assert seen[-1].job.state == "succeeded"
    assert [int(event.id) for event in seen] == sorted({int(event.id) for event in seen})
    assert await items(client.jobs.events(job.id, last_event_id=seen[-1].id)) == []
    long = await done(client.jobs.create(JobCreate(object_id=uploaded.id, starts=4096)))
    assert (await done(client.jobs.cancel(long.id))).state == "cancelled"
    with pytest.raises(JobFailed, match="cancelled"):
        await done(client.jobs.wait(long.id))


async def test_all_pages_are_read(client: Any, can: bytes) -> None:
    uploaded = await done(client.objects.upload(can, file_type="off", mass=0.777))
    requests = [JobCreate(object_id=uploaded.id, starts=1, seed=seed) for seed in range(5)]
    batch = await done(client.batches.create(requests))
    page = await done(client.jobs.list(batch_id=batch.id, limit=2))
    assert ([job.id for job in page.items], page.next_cursor is None) == (batch.job_ids[:2:-1], False)
    assert [job.id for job in await items(client.jobs.all(batch_id=batch.id))] == batch.job_ids[::-1]


async def test_nobody_is_ready_where_nobody_listens(client: Any, unused_url: str) -> None:
    assert await done(client.ready())
    with Client(unused_url) as lost:
        assert not lost.ready()


def test_a_form_of_the_service_takes_what_an_object_can_be_told(app: Any) -> None:
    document = app.app.openapi()
    body = document["paths"]["/v1/objects"]["post"]["requestBody"]["content"]["multipart/form-data"]["schema"]
    form = document["components"]["schemas"][body["$ref"].rpartition("/")[2]]
    assert set(form["properties"]) == ObjectKeywords.__annotations__.keys() - {"file_type"} | {"file"}


def test_what_is_saved_is_what_the_command_line_reads(result: PlanResult, tmp_path: Path) -> None:
    path = tmp_path / "can.json"
    result.save(path)
    assert PlanResult.load(path) == result
    assert read_result(path).to_dict() == json.loads(result.model_dump_json())


def test_every_termination_has_a_place_on_the_wire(result: PlanResult) -> None:
    assert set(get_args(Termination)) == {end.label for end in CoreTermination}
