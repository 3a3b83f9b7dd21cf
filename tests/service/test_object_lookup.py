import hashlib

import pytest

from fingersplit_client.schemas import Problem

pytestmark = pytest.mark.anyio


async def looked_up(api, data: bytes, **options: object):
    return await api.http.post("/v1/objects/lookup", json={"sha256": hashlib.sha256(data).hexdigest()} | options)


async def test_a_file_is_known_by_its_bytes_and_options(api):
    data = api.cube(5.5)
    assert (await looked_up(api, data, unit="cm", mass=0.3)).status_code == 404
    uploaded = (await api.upload(data, "cube.off", unit="cm", mass="0.3", scale="2.0")).json()
    found = await looked_up(api, data, unit="cm", mass=0.3, scale=2)
    assert (found.status_code, found.json()) == (200, uploaded)
    for options in ({"unit": "cm", "mass": 0.3}, {"unit": "cm", "mass": 0.4, "scale": 2}, {"mass": 0.3, "scale": 2}):
        assert (await looked_up(api, data, **options)).status_code == 404
    assert (await looked_up(api, data + b" ", unit="cm", mass=0.3, scale=2)).status_code == 404


async def test_the_same_object_may_have_come_as_several_files(api):
    one, other = api.cube(5.25), api.cube(5.25) + b"\n"
    first = (await api.upload(one, "cube.off", unit="cm")).json()
    assert (await api.upload(other, "cube.off", unit="cm")).json()["id"] == first["id"]
    assert {(await looked_up(api, data, unit="cm")).json()["id"] for data in (one, other)} == {first["id"]}


async def test_what_was_deleted_is_not_known(api):
    data = api.cube(5.125)
    uploaded = (await api.upload(data, "cube.off", unit="cm")).json()
    assert (await api.http.delete(f"/v1/objects/{uploaded['id']}")).status_code == 204
    assert (await looked_up(api, data, unit="cm")).status_code == 404
    again = (await api.upload(data, "cube.off", unit="cm")).json()
    assert (await looked_up(api, data, unit="cm")).json() == again


async def test_a_lookup_that_is_not_valid_names_the_field(api):
    response = await api.http.post("/v1/objects/lookup", json={"sha256": "x", "units": "cm"})
    problem = Problem.model_validate_json(response.content)
    assert {error.field for error in problem.errors} == {"/sha256", "/units"}
