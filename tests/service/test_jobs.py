import asyncio
import json
import sqlite3

import pytest
from fake_workers import FINE, HANGS, HOWS, NO_GRASP, PICTURE, RAISES, TOO_MUCH_MEMORY, WAITS

from fingersplit_client.schemas import Job, JobCreate, JobSummary, PlanResult, Problem

pytestmark = pytest.mark.anyio


async def test_a_job_ends_in_the_stored_result(api):
    job_id = await api.queue(FINE, starts=7, planner={"friction": 0.5})
    ended = Job.model_validate(await api.ended(job_id))

    assert ended.state == "succeeded"
    assert ended.progress == 1.0
    assert ended.created_at <= ended.started_at <= ended.finished_at
    assert ended.request == JobCreate(object_id=ended.request.object_id, starts=7, planner={"friction": 0.5})
    with sqlite3.connect(api.storage.database) as database:
        (stored,) = database.execute("SELECT document FROM results WHERE job_id = ?", (job_id,)).fetchone()
    database.close()
    assert (await api.job(job_id))["result"] == json.loads(stored)
    assert ended.result == PlanResult.model_validate_json(stored)


async def test_the_answer_to_a_new_job_says_where_it_is(api):
    body = {"object_id": await api.object_id()}
    response = await api.http.post("/v1/jobs", json=body)

    job = Job.model_validate_json(response.content)
    assert response.status_code == 202
    assert response.headers["Location"] == f"/v1/jobs/{job.id}"
    assert job.result is None
    assert job.request == JobCreate(**body)
    await api.ended(job.id)


async def test_a_running_job_tells_how_far_it_is(api):
    api.hold()
    job_id = await api.queue(WAITS)
    await api.begun(job_id)
    job = await api.job(job_id)
    assert (job["state"], job["stage"], job["progress"]) == ("running", "splitting", 0.5)
    picture = await api.http.get(f"/v1/jobs/{job_id}/grasps/1/picture.png")
    assert Problem.model_validate_json(picture.content).type == "urn:fingersplit:problem:not-finished"
    assert picture.status_code == 409

    api.go()
    assert (await api.ended(job_id))["state"] == "succeeded"


async def test_nothing_feasible_is_an_answer(api):
    job = Job.model_validate(await api.ended(await api.queue(NO_GRASP)))

    assert job.state == "succeeded"
    assert not job.result.grasps[0].feasible
    assert job.result.summary.message.startswith("0 of 64")


@pytest.mark.parametrize(("how", "code"), [(RAISES, "internal"), (TOO_MUCH_MEMORY, "out_of_memory")])
async def test_a_fault_fails_the_job_and_stays_inside(api, how, code):
    job = await api.ended(await api.queue(how))

    assert (job["state"], job["error"]["code"]) == ("failed", code)
    assert "secret" not in json.dumps(job)
    assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


async def test_the_list_is_newest_first(api):
    ids = [await api.queue(FINE) for _ in range(3)]
    response = await api.http.get("/v1/jobs", params={"limit": 2})
    listed = [JobSummary.model_validate(one) for one in response.json()["items"]]
    assert [job.id for job in listed] == [ids[2], ids[1]]
    for job_id in ids:
        await api.ended(job_id)


@pytest.mark.parametrize(
    ("changes", "field", "hint"),
    [
        ({"object_id": "nothing"}, "/object_id", "/v1/objects"),
        ({"hand": "claw"}, "/hand", "barrett"),
        ({"hand": "\ud800"}, "/hand", ""),
        ({"planner": {"speed": 2}}, "/planner", "friction"),
        ({"planner": {"friction": -1}}, "/planner", "0.01"),
        ({"planner": {"friction": float("nan")}}, "/planner/friction/float", "finite"),
        ({"starts": 0}, "/starts", "1"),
        ({"starts": 5000}, "/starts", "4096"),
        ({"seed": -1}, "/seed", "0"),
        ({"protocol": "throw"}, "/protocol", "six_direction"),
        ({"controller": "glue"}, "/controller", "virtual_frame"),
        ({"source": "dreams"}, "/source", "surface_fitting"),
        ({"planner": {"fidelity": "none"}}, "/planner", "paper"),
        ({"scene": {"clearance": -1}}, "/scene/clearance", "0.05"),
        (
            {"scene": {"obstacles": [{"id": "a", "primitive": {"type": "box", "dimensions": [1, 2]}}]}},
            "/scene/obstacles/0/primitive/dimensions",
            "a box has 3",
        ),
        ({"scene": {"obstacles": [{"id": "a", "object_id": "none"}]}}, "/scene/obstacles/0/object_id", "upload"),
        ({"approach": {"directions": []}}, "/approach/directions", "1 to 32"),
        ({"contact_regions": {"allowed": [{"type": "box"}]}}, "/contact_regions/allowed/0/dimensions", "missing"),
        ({"task": {"gravity": "up"}}, "/task/gravity", "any"),
        ({"end_effector": {"tool": 1}}, "/end_effector/tool", "known"),
        ({"top_k": 101}, "/top_k", "100"),
        ({"speed": 2}, "/speed", "no such field"),
        ({"parallel_grasps": []}, "/parallel_grasps", "not be empty"),
        (
            {"parallel_grasps": [{"contacts": [[0, 0, 0], [0, 0, 0]], "approach": [0, 0, 1]}]},
            "/parallel_grasps/0",
            "opposite sides",
        ),
        ({"parallel_grasps": [{"contacts": [[0, 0, 0]], "approach": [0, 0, 1]}]}, "/parallel_grasps/0/contacts/1", ""),
    ],
)
async def test_a_request_that_is_not_valid_says_why(api, changes, field, hint):
    body = {"object_id": await api.object_id()} | changes
    headers = {"Content-Type": "application/json"}
    response = await api.http.post("/v1/jobs", content=json.dumps(body), headers=headers)

    problem = Problem.model_validate_json(response.content)
    assert problem.status == response.status_code == 422
    assert field in [error.field for error in problem.errors]
    assert hint in " ".join(error.detail for error in problem.errors)


async def test_an_unknown_hand_names_the_known_ones(api):
    response = await api.http.post("/v1/jobs", json={"object_id": await api.object_id(), "hand": "claw"})
    assert response.json()["valid"] == list(HOWS)


@pytest.mark.parametrize("body", [b"{", b"", b"[" * 9_000, b'{"seed": ' + b"9" * 9_000 + b"}", b"\xff\xfe", b"null"])
async def test_a_body_that_is_no_json_is_refused(api, body):
    response = await api.http.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"})
    assert response.status_code in (400, 422)
    assert response.headers["Content-Type"] == "application/problem+json"


async def test_a_body_above_the_limit_is_refused(api):
    response = await api.http.post("/v1/jobs", json={"object_id": "x" * 20_000})
    assert (response.status_code, response.json()["limit"]) == (413, 10_000)


async def test_an_unknown_job_is_not_found(api):
    for path in ("/v1/jobs/nothing", "/v1/jobs/nothing/grasps/1/picture.png"):
        response = await api.http.get(path)
        assert response.status_code == 404
        assert Problem.model_validate_json(response.content).type == "urn:fingersplit:problem:not-found"


async def test_a_picture_is_drawn_once(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    path = api.storage.view(job_id, 1, "picture.png")
    assert not path.exists()

    response = await api.http.get(f"/v1/jobs/{job_id}/grasps/1/picture.png")
    assert (response.content, response.headers["Content-Type"]) == (PICTURE + b"\x01", "image/png")
    path.write_bytes(b"kept")
    assert (await api.http.get(f"/v1/jobs/{job_id}/grasps/1/picture.png")).content == b"kept"
    for rank in (0, 2, 10**30):
        assert (await api.http.get(f"/v1/jobs/{job_id}/grasps/{rank}/picture.png")).status_code == 404


async def test_hands_are_listed(api):
    hand = (await api.http.get("/v1/hands")).json()[0]
    assert hand["name"] == "barrett"
    assert hand["joints"][0]["upper"] == 2.4


async def test_an_upload_does_not_wait_for_the_queue(api, cube):
    """Somebody waits for the answer to an upload, so it gets the next free worker."""
    api.hold()
    first = await api.queue(WAITS)
    await api.begun(first)
    second = await api.queue(HANGS)  # with the only worker it would keep the upload from being answered
    upload = asyncio.create_task(api.upload(cube, "cube.off", unit="cm"))
    await api.until_metric(1, "fingersplit_waiting_answers")
    api.go()
    assert (await upload).is_success
    await api.http.post(f"/v1/jobs/{second}/cancel")


async def test_a_deadline_ends_compiled_code(start, tmp_path):
    async with start(tmp_path, plan_deadline_s=0.3) as api:
        job = await api.ended(await api.queue(HANGS))
        assert job["error"]["code"] == "deadline_exceeded"
        assert "0.3 s" in job["error"]["detail"]
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


async def test_a_job_plans_in_as_many_threads_as_workers_are_idle(start, tmp_path):
    async with start(tmp_path, workers=2) as api:
        api.hold()
        ids = []
        for _ in range(2):
            ids.append(await api.queue(WAITS))
            await api.begun(ids[-1])
        api.go()
        threads = [int((tmp_path / f"{job_id}.threads").read_text()) for job_id in ids]
    assert threads == [2, 1]
