"""Depth images over HTTP, with the real worker functions."""

import io

import numpy as np
import pytest

from fingersplit.objects.parametric import box
from fingersplit_bench.depth_views import Camera, look_at, render_view
from fingersplit_client.schemas import ViewedScene

pytestmark = pytest.mark.anyio
CAMERA = Camera(160, 120, 150.0)


@pytest.fixture(scope="module")
def archive():
    pose = np.eye(4)
    pose[2, 3] = 0.06
    camera_pose = look_at(np.array([0.4, -0.1, 0.4]), np.array([0.0, 0.0, 0.05]))
    view = render_view(box((0.06, 0.05, 0.12)), pose, camera_pose, CAMERA)
    file = io.BytesIO()
    np.savez(
        file,
        depth=np.nan_to_num(view.points[..., 2]),
        mask=view.mask,
        intrinsics=CAMERA.intrinsics,
        world_from_camera=camera_pose,
    )
    return file.getvalue()


async def test_an_image_becomes_an_object_and_a_scene(api, archive):
    files = {"file": ("view.npz", archive, "application/octet-stream")}
    response = await api.http.post("/v1/scenes/from-depth", files=files, data={"support": "true", "mass": "0.3"})

    assert response.status_code == 201, response.text
    viewed = ViewedScene.model_validate_json(response.content)
    assert viewed.object.options.mass == 0.3
    assert viewed.scene["support_surfaces"][0]["normal"][2] == pytest.approx(1.0, abs=1e-3)
    assert viewed.support_points > 1000
    assert (await api.http.get(f"/v1/objects/{viewed.object.id}")).status_code == 200
    assert viewed.object.report.support
    queued = await api.http.post("/v1/jobs", json={"object_id": viewed.object.id, "scene": viewed.scene})
    assert queued.status_code in (200, 201, 202), queued.text

    refused = await api.http.post("/v1/scenes/from-depth", files=files, data={"support": "true", "complete": "false"})
    plain = ViewedScene.model_validate_json(refused.content)
    assert not plain.object.report.support
    assert plain.object.id != viewed.object.id


@pytest.mark.parametrize(
    ("data", "field"),
    [
        ({"intrinsics": "1,2"}, "/intrinsics"),
        ({"camera_pose": "1,2,3,nan,0,0,0"}, "/camera_pose"),
        ({"frame": "moon"}, "/frame"),
        ({"suport": "true"}, "/suport"),
    ],
)
async def test_bad_fields_are_named(api, archive, data, field):
    files = {"file": ("view.npz", archive, "application/octet-stream")}
    response = await api.http.post("/v1/scenes/from-depth", files=files, data=data)

    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == field


async def test_a_file_that_is_no_view_is_refused(api):
    files = {"file": ("view.npz", b"nothing", "application/octet-stream")}
    response = await api.http.post("/v1/scenes/from-depth", files=files)

    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == "/file"
