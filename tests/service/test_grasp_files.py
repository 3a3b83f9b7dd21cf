"""Parallel grasps come in files, too: read by workers, under their limits."""

import io
import json

import httpx2
import numpy as np
import pytest
from fake_workers import FINE, FUNCTIONS, accept

from fingersplit_client.schemas import ImportedGraspSet
from fingersplit_service.jobs.grasp_work import check_touching

pytestmark = pytest.mark.anyio

# Of the cube that ``object_id`` is, from 0 to 50 mm along each axis.
ACROSS = {"contacts": [[0.0, 0.025, 0.025], [0.05, 0.025, 0.025]], "approach": [0, 0, -1]}


def graspnet(count: int) -> bytes:
    """Grippers around the middle of the cube that close along x, as graspnetAPI writes them, best last."""
    rows = np.zeros((count, 17))
    rows[:, 0] = np.linspace(0.1, 1, count)
    rows[:, 1:4] = 0.08, 0.01, 0.02  # width, height, depth
    rows[:, 4:13] = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]]).ravel()  # approach -z, closing x
    rows[:, 13:16] = 0.025, 0.025, 0.035
    file = io.BytesIO()
    np.save(file, rows)
    return file.getvalue()


async def send(api, data: bytes, filename: str, **fields: str) -> httpx2.Response:
    path = f"/v1/objects/{await api.object_id()}/parallel-grasps/import"
    return await api.http.post(path, files={"file": (filename, data)}, data=fields)


@pytest.mark.parametrize("fields", [{}, {"format": "graspnet"}])
async def test_grippers_in_a_file_close_on_the_object(api, fields):
    response = await send(api, graspnet(3), "seen.npy", **fields)
    assert response.status_code == 201, response.text
    kept = ImportedGraspSet.model_validate_json(response.content)
    assert (kept.count, kept.origin, kept.name) == (3, "imported", "seen")
    assert "graspnetAPI .npy with 3 grasps" in kept.message
    assert sorted(contact[0] for contact in kept.parallel_grasps[0].contacts) == pytest.approx([0, 0.05], abs=1e-6)
    stored = (await api.http.get(response.headers["Location"])).json()
    assert stored | {"message": kept.message} == response.json()


async def test_a_scale_and_a_gripper_can_be_said(api):
    kept = await send(
        api, json.dumps([{**ACROSS, "contacts": [[0, 25, 25], [50, 25, 25]]}]).encode(), "mm.json", scale="0.001"
    )
    assert kept.status_code == 201, kept.text
    assert kept.json()["parallel_grasps"][0]["contacts"] == ACROSS["contacts"]
    refused = await send(api, graspnet(1), "seen.npy", gripper="claw")
    assert (refused.status_code, refused.json()["detail"]) == (422, "Unknown gripper 'claw'; known: panda.")
    for scale in ("0", "-1", "inf", "nan", "much"):
        assert (await send(api, graspnet(1), "seen.npy", scale=scale)).status_code == 422


async def test_our_own_json_is_a_file_too_and_jobs_start_from_it(api):
    response = await send(api, json.dumps([ACROSS]).encode(), "mine.json", name="two sides")
    assert (response.status_code, response.json()["name"]) == (201, "two sides")
    job = await api.ended(await api.queue(FINE, parallel_grasp_set=response.json()["id"]))
    assert job["request"]["parallel_grasps"] == response.json()["parallel_grasps"]


async def test_of_many_grasps_the_best_are_kept(api):
    kept = (await send(api, graspnet(1500), "many.npy")).json()
    assert kept["count"] == len(kept["parallel_grasps"]) == 1024
    assert kept["message"].endswith("The best 1024 were kept.")


@pytest.mark.parametrize(
    ("data", "fields"),
    [
        (b"", {}),
        (b"{}", {}),
        (b"[" * 100_000, {}),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), {}),
        (b"\x93NUMPY\x01\x00", {}),
        (b"format: isaac_grasp\ngrasps: !!python/object/apply:os.system [true]\n", {}),
        (b"{}", {"format": "acronym"}),
        (b"[]", {"format": "elsewhere"}),
        (json.dumps([ACROSS]).encode(), {"name": "a\nb"}),
    ],
)
async def test_what_holds_no_grasps_is_refused(api, data, fields):
    response = await send(api, data, "grasps.dat", **fields)
    assert (response.status_code, response.json()["type"]) == (422, "urn:fingersplit:problem:invalid-request")
    assert response.json()["errors"][0]["field"]
    assert str(api.data_dir) not in response.text
    assert list(api.storage.staging.iterdir()) == []


async def test_files_of_grasps_are_limited_as_uploads_are(api):
    assert (await send(api, bytes(200_000), "zeros.npy")).status_code == 422  # beyond the limit of other requests
    assert (await send(api, bytes(2_000_000), "zeros.npy")).status_code == 413
    path = "/v1/objects/nothing/parallel-grasps/import"
    assert (await api.http.post(path, files={"file": ("a.npy", graspnet(1))})).status_code == 404


@pytest.fixture
def checking():
    """Workers that look whether given grasps touch the object, as the real ones do."""
    object.__setattr__(FUNCTIONS, "check_touching", check_touching)
    yield
    object.__setattr__(FUNCTIONS, "check_touching", accept)


async def test_grasps_off_the_surface_are_refused_when_they_arrive(api, checking):
    object_id = await api.object_id()
    off = {**ACROSS, "contacts": [[0.0, 0.025, 0.025], [0.07, 0.025, 0.025]]}
    job = {"object_id": object_id, "parallel_grasps": [ACROSS, off], "hand": FINE}
    batch = {"jobs": [{"object_id": object_id, "hand": FINE}, job]}
    for path, body, field in (
        ("/v1/jobs", job, "/parallel_grasps/1"),
        ("/v1/plan", job, "/parallel_grasps/1"),
        ("/v1/batches", batch, "/jobs/1/parallel_grasps/1"),
        (f"/v1/objects/{object_id}/parallel-grasps", {"parallel_grasps": [off]}, "/parallel_grasps/0"),
    ):
        answer = await api.http.post(path, json=body)
        assert answer.status_code == 422, answer.text
        (fault,) = answer.json()["errors"]
        assert fault["field"] == field
        assert "lies 20.0 mm from the surface; allowed: 5 mm" in fault["detail"]
    accepted = await api.http.post("/v1/jobs", json=job | {"parallel_grasps": [ACROSS]})
    assert accepted.status_code == 202
    unknown = await api.http.post("/v1/jobs", json=job | {"object_id": "none"})
    assert unknown.json()["errors"][0]["field"] == "/object_id"
