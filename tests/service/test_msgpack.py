"""MessagePack wherever JSON goes: in bodies, in answers, in problem documents."""

import io

import msgpack
import numpy as np
import pytest
from fake_workers import FINE

pytestmark = pytest.mark.anyio

PACKED = {"Content-Type": "application/msgpack", "Accept": "application/msgpack"}
CUBE = b"""OFF
8 12 0
0 0 0
.05 0 0
.05 .05 0
0 .05 0
0 0 .05
.05 0 .05
.05 .05 .05
0 .05 .05
3 0 2 1
3 0 3 2
3 4 5 6
3 4 6 7
3 0 1 5
3 0 5 4
3 1 2 6
3 1 6 5
3 2 3 7
3 2 7 6
3 3 0 4
3 3 4 7
"""


async def post(api, path, document, **headers):
    return await api.http.post(path, content=msgpack.packb(document), headers=PACKED | headers)


async def test_a_plan_in_one_packed_call_is_the_same_as_in_json(api):
    asked = {"hand": FINE, "starts": 4, "mesh": {"data": CUBE, "file_type": "off", "mass": 0.2}}
    answer = await post(api, "/v1/plan", asked)
    assert answer.status_code == 200, answer.content
    assert answer.headers["content-type"] == "application/msgpack"
    assert "Accept" in answer.headers["vary"]
    job = msgpack.unpackb(answer.content)
    assert job["state"] == "succeeded"
    assert job == (await api.http.get(answer.headers["location"])).json()
    again = await api.http.get(answer.headers["location"], headers={"Accept": "application/msgpack;q=1, */*;q=0.1"})
    assert msgpack.unpackb(again.content) == job


async def test_a_cloud_is_npz(api):
    rng = np.random.default_rng(1)
    faces = rng.uniform(0, 0.05, (6, 400, 3))
    normals = np.zeros_like(faces)
    for number in range(6):
        axis, side = divmod(number, 2)
        faces[number, :, axis] = 0.05 * side
        normals[number, :, axis] = 2 * side - 1
    file = io.BytesIO()
    np.savez(file, points=faces.reshape(-1, 3), normals=normals.reshape(-1, 3))
    asked = {"hand": FINE, "starts": 4, "mesh": {"data": file.getvalue(), "file_type": "npz"}}
    answer = await post(api, "/v1/plan", asked)
    assert answer.status_code == 200, answer.content


@pytest.mark.parametrize(
    ("content", "status", "told"),
    [
        (b"\xc1", 422, "no MessagePack"),
        (msgpack.packb({"starts": float("nan")}), 422, "no MessagePack"),
        (msgpack.packb({1: 2}), 422, "no MessagePack"),
        (b"\x91" * 3000, 422, "no MessagePack"),
        (msgpack.packb({"object_id": "x", "strats": 3}), 422, "Did you mean"),
    ],
)
async def test_faults_are_packed_problem_documents(api, content, status, told):
    answer = await api.http.post("/v1/jobs", content=content, headers=PACKED)
    assert answer.status_code == status, answer.content
    problem = msgpack.unpackb(answer.content)
    assert told in problem["detail"] + str(problem.get("errors"))


async def test_answers_that_are_not_json_stay_as_they_are(api):
    answer = await api.http.get("/metrics", headers={"Accept": "application/msgpack, text/plain"})
    assert answer.headers["content-type"].startswith("text/plain")
