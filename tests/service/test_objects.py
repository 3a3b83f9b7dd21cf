import numpy as np
import pytest

from fingersplit.contacts.friction import planned_friction
from fingersplit.objects.intake import read_bytes
from fingersplit.objects.options import ObjectOptions as CoreOptions
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.source import ObjectSource
from fingersplit_client.schemas import CloudReport, ObjectInfo, ObjectOptions, Problem
from fingersplit_service.jobs.stored_objects import keep_object, planner_settings, prepared_object
from fingersplit_service.storage import Storage
from mesh_bytes import cloud, cloud_points

pytestmark = pytest.mark.anyio


async def test_an_uploaded_mesh_is_an_object_in_metres(api):
    response = await api.upload(api.cube(7), "my cube.OFF", unit="cm", name="die")

    info = ObjectInfo.model_validate_json(response.content)
    assert info.name == "die"
    assert info.extents == pytest.approx((0.07, 0.07, 0.07))
    assert info.volume == pytest.approx(0.07**3)
    assert info.center_of_mass == pytest.approx((0.035, 0.035, 0.035))
    assert info.report.watertight
    assert response.headers["Location"] == f"/v1/objects/{info.id}"
    assert (await api.http.get(response.headers["Location"])).json() == response.json()
    assert info in [ObjectInfo.model_validate(one) for one in (await api.http.get("/v1/objects")).json()["items"]]


async def test_the_same_mesh_is_one_object(api, cube):
    first = await api.upload(cube, "a.off", unit="mm")
    again = await api.upload(cube, "b.off", unit="mm")

    assert (first.status_code, again.status_code) == (201, 200)
    assert again.json() == first.json()
    assert again.headers["Location"] == first.headers["Location"]


async def test_the_name_of_the_file_is_the_default(api, cube):
    response = await api.upload(cube, "path/to/dice.off", unit="in")
    assert response.json()["name"] == "dice"


@pytest.mark.parametrize(
    ("filename", "status", "kind", "code"),
    [
        ("cube.xyz", 415, "unknown-format", "unknown_format"),
        ("cube", 415, "unknown-format", None),
        ("cube.../../x", 415, "unknown-format", None),
        ("cube.stl", 422, "invalid-mesh", "other_format"),
    ],
)
async def test_a_file_that_is_no_mesh_is_refused(api, cube, filename, status, kind, code):
    response = await api.upload(cube, filename)

    problem = Problem.model_validate_json(response.content)
    assert response.status_code == problem.status == status
    assert problem.type == f"urn:fingersplit:problem:{kind}"
    assert problem.errors[0].field == "/file"
    assert code is None or problem.code == code


@pytest.mark.parametrize(("fields", "field"), [({"unit": "furlong"}, "/unit"), ({"name": "n" * 201}, "/name")])
async def test_a_field_that_is_not_valid_is_named(api, cube, fields, field):
    response = await api.upload(cube, "cube.off", **fields)

    assert response.status_code == 422
    assert [error["field"] for error in response.json()["errors"]] == [field]


@pytest.mark.parametrize(
    ("fields", "field", "hint"),
    [
        ({"mass": "-1"}, "/mass", "0"),
        ({"mass": "much"}, "/mass", "number"),
        ({"friction": "9"}, "/friction", "5"),
        ({"fairing": "1"}, "/fairing", "0.05"),
        ({"density": "nan"}, "/density", "25000"),
        ({"density": "500", "mass": "1"}, "/mass", "give one of them"),
        ({"viewpoint": "0,0"}, "/viewpoint", "three numbers"),
        ({"viewpoint": "0,0,inf"}, "/viewpoint", "three numbers"),
        ({"viewpoint": "0,0,1"}, "/viewpoint", "holds a mesh"),
        ({"support": "0,0,1"}, "/support", "a normal and an offset"),
        ({"support": "0,0,1,nan"}, "/support", "a normal and an offset"),
        ({"support": "0,0,1,0"}, "/support", "holds a mesh"),
    ],
)
async def test_an_option_that_cannot_be_is_named(api, cube, fields, field, hint):
    response = await api.upload(cube, "cube.off", **{"unit": "cm"} | fields)

    problem = Problem.model_validate_json(response.content)
    assert response.status_code == problem.status == 422
    (error,) = problem.errors
    assert error.field == field
    assert hint in error.detail


async def test_an_object_with_options_is_another_object(api):
    mesh = api.cube(8)
    plain, heavy, again, listed = [
        await api.upload(mesh, "cube.off", unit="cm", **fields)
        for fields in ({}, {"mass": "0.4", "friction": "0.9"}, {"friction": "0.90", "mass": "0.4"}, {"fairing": "0"})
    ]

    assert [one.status_code for one in (plain, heavy, again, listed)] == [201, 201, 200, 200]
    assert heavy.json()["id"] == again.json()["id"] != plain.json()["id"] == listed.json()["id"]
    assert ObjectInfo.model_validate_json(heavy.content).options == ObjectOptions(mass=0.4, friction=0.9)
    assert plain.json()["options"] == ObjectOptions().model_dump()


async def test_a_point_cloud_is_an_object(api):
    ball = cloud_points(6000)
    response = await api.upload(cloud("npz", ball[ball[:, 2] > 0.005]), "scan.npz", viewpoint="0, 0, 0.6")

    info = ObjectInfo.model_validate_json(response.content)
    assert isinstance(info.report, CloudReport)
    assert info.report.viewpoint
    assert info.extents[:2] == pytest.approx((0.1, 0.1), abs=0.02)
    mesh = await api.http.get(f"/v1/objects/{info.id}/mesh")
    assert mesh.content.startswith(b"ply")


async def test_a_cloud_that_stands_on_something_is_completed(api):
    seen = cloud_points(6000)
    scan = cloud("npz", seen[seen[:, 2] > 0.005])
    heights = {}
    for support in ("0,0,1,-0.05", None):
        fields = {} if support is None else {"support": support}
        info = ObjectInfo.model_validate_json((await api.upload(scan, "s.npz", viewpoint="0,0,0.6", **fields)).content)
        assert info.report.support == (support is not None)
        heights[support] = info.extents[2]
    assert heights["0,0,1,-0.05"] == pytest.approx(0.1, abs=0.02)
    refused = await api.upload(scan, "s.npz", viewpoint="0,0,0.6", support="0,0,1,0.06")
    assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "/support")


async def test_numbers_of_the_file_are_multiplied_by_a_scale(api):
    data = PARAMETRIC_OBJECTS["box"]().trimesh.export(file_type="ply")
    response = await api.upload(data, "box.ply", unit="cm", scale="50")
    info = ObjectInfo.model_validate_json(response.content)
    assert info.extents == pytest.approx((0.025, 0.035, 0.06))
    assert (info.report.unit, info.report.scale) == ("cm", 50)
    refused = await api.upload(data, "box.ply", scale="0")
    assert refused.status_code == 422
    assert "/scale" in refused.text


def test_meshes_that_an_older_version_kept_are_objects(tmp_path):
    storage, mesh = Storage(tmp_path), PARAMETRIC_OBJECTS["cylinder"]()
    path = storage.shape(mesh.content_hash)
    path.parent.mkdir()
    np.savez(path, vertices=mesh.vertices, faces=mesh.faces)

    model = prepared_object(storage, mesh.content_hash, "old")
    assert (model.name, model.options.mass) == ("old", None)
    np.testing.assert_array_equal(model.mesh.vertices, mesh.vertices)


def test_friction_of_the_object_is_what_the_planner_takes_unless_told(tmp_path):
    storage = Storage(tmp_path)
    storage.staging.mkdir()
    source = ObjectSource("mm", 2.0)
    shape, report = read_bytes(PARAMETRIC_OBJECTS["cylinder"]().trimesh.export(file_type="ply"), "ply")
    for friction, expected in ((None, 0.6), (0.9, 0.9)):
        kept = keep_object(storage, shape, CoreOptions(friction=friction), source, report)
        model = prepared_object(storage, kept.id, "can")
        assert (model.id, model.source, model.report) == (kept.id, source, report)
        settings, requested = planner_settings({"fidelity": "paper"})
        assert settings.fidelity == "paper"
        assert planned_friction(requested, model.options.friction) == expected
        assert planned_friction(planner_settings({"friction": 0.3})[1], model.options.friction) == 0.3


async def test_a_file_is_needed(api):
    response = await api.http.post("/v1/objects", files={"unit": (None, "m")})
    assert response.json()["errors"][0]["field"] == "/file"


async def test_no_unfinished_file_is_left(api, cube):
    await api.upload(cube, "cube.off", unit="m")
    await api.upload(b"OFF", "cube.off", unit="m")
    assert list(api.storage.staging.iterdir()) == []


async def test_a_file_above_the_limit_is_refused(api):
    response = await api.upload(b"0" * 1_100_000, "large.stl")

    problem = Problem.model_validate_json(response.content)
    assert problem.status == response.status_code == 413
    assert problem.limit == 1_000_000 + 64 * 1024
    assert str(problem.limit) in problem.detail


async def test_the_limit_holds_without_an_announced_length(api):
    sent = 0

    async def endless():
        nonlocal sent
        yield b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.stl"\r\n\r\n'
        while sent < 100_000_000:
            sent += 100_000
            yield b"0" * 100_000

    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    response = await api.http.post("/v1/objects", content=endless(), headers=headers)

    assert response.status_code == 413
    assert sent < 2_000_000


async def test_multipart_that_cannot_be_read_is_a_bad_request(api):
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    response = await api.http.post("/v1/objects", content=b"nothing of the kind", headers=headers)
    assert response.status_code in (400, 422)
    assert response.headers["Content-Type"] == "application/problem+json"


async def test_an_unknown_object_is_not_found(api):
    response = await api.http.get("/v1/objects/nothing")
    assert Problem.model_validate_json(response.content).type == "urn:fingersplit:problem:not-found"
    assert response.status_code == 404


async def test_the_list_has_a_limit(api, cube):
    await api.upload(cube, "cube.off", unit="m")
    await api.upload(cube, "cube.off", unit="cm")
    assert len((await api.http.get("/v1/objects", params={"limit": 1})).json()["items"]) == 1
    assert (await api.http.get("/v1/objects", params={"limit": 0})).status_code == 422
