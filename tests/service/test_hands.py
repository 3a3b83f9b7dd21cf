"""Hands over HTTP: uploaded, drafted, corrected, drawn, planned for and deleted; hostile archives refused."""

import io
import json
import time
import zipfile
from dataclasses import replace

import fake_workers
import httpx2
import pytest
from conftest import started

from fingersplit.errors import UnknownHandError
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit_client import AsyncClient, NotFoundError
from fingersplit_service.database.hands import HandStore
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.jobs.hand_work import add_hand, correct_hand, stored_hand, view_hand
from fingersplit_service.jobs.outcome import strict_json
from fingersplit_service.jobs.rendering import convert_result
from fingersplit_service.operations.retention import Retention
from fingersplit_service.settings import ServiceSettings
from own_hand import description, hand_mjcf, to_toml, write_hand

pytestmark = pytest.mark.anyio

REAL = replace(fake_workers.FUNCTIONS, add_hand=add_hand, correct_hand=correct_hand, view_hand=view_hand)
TEXT = to_toml(description())


def archive(**files: str | bytes) -> bytes:
    """A zip; two underscores of a name stand for its dot."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as target:
        for name, data in files.items():
            target.writestr(name.replace("__", "."), data)
    return content.getvalue()


@pytest.fixture(scope="module")
async def hands(tmp_path_factory, anyio_backend):
    """A service that compiles hands for real, and a hand in it."""
    async with started(tmp_path_factory.mktemp("hands"), REAL) as api:
        yield api


async def upload(api, data: bytes, **fields: str):
    return await api.http.post("/v1/hands", files={"file": ("four.zip", data)}, data=fields)


async def uploaded(api) -> dict:
    response = await upload(api, archive(hand__xml=hand_mjcf(), hand__toml=TEXT))
    assert response.status_code in (200, 201), response.text
    return response.json()


async def test_an_uploaded_hand_is_checked_and_listed(hands):
    hand = await uploaded(hands)
    assert (hand["title"], hand["origin"], hand["drafted"]) == ("Four fingers", "uploaded", False)
    assert [finger["name"] for finger in hand["fingers"]] == ["thumb", "first", "second", "third"]
    assert hand["description"] == TEXT
    assert hand["report"]["grips"][0]["kinematics_error"] < 1e-9
    assert hand["name"] in [one["name"] for one in (await hands.http.get("/v1/hands")).json()]
    again = await upload(hands, archive(hand__xml=hand_mjcf(), hand__toml=TEXT))
    assert (again.status_code, again.json()["name"]) == (200, hand["name"])
    assert (await hands.http.get(again.headers["Location"])).json() == hand


async def test_a_job_names_it(hands):
    hand = await uploaded(hands)
    job = await hands.http.post("/v1/jobs", json={"object_id": await hands.object_id(), "hand": hand["name"]})
    assert job.status_code == 202, job.text
    assert (await hands.ended(job.json()["id"]))["hand"] == hand["name"]
    refused = await hands.http.post("/v1/jobs", json={"object_id": await hands.object_id(), "hand": 32 * "0"})
    assert refused.status_code == 422
    assert "Unknown hand" in refused.json()["detail"]


async def test_it_can_be_looked_at(hands):
    hand = await uploaded(hands)
    picture = await hands.http.get(f"/v1/hands/{hand['name']}/picture.png")
    assert picture.content.startswith(b"\x89PNG")
    scene = (await hands.http.get(f"/v1/hands/{hand['name']}/scene")).json()
    assert len(scene["hand"]["joints"]) == 11
    assert {mesh["link"] for mesh in scene["hand"]["meshes"]} <= set(range(len(scene["hand"]["links"])))
    assert len(scene["drivers"]) == 11


async def test_a_corrected_description_is_another_hand(hands):
    hand = await uploaded(hands)
    path = f"/v1/hands/{hand['name']}/descriptions"
    wrong = await hands.http.post(path, json={"description": TEXT.replace('palm = "palm"', 'palm = "plam"')})
    assert wrong.status_code == 422
    assert "no body 'plam'" in wrong.json()["detail"]
    right = await hands.http.post(path, json={"description": TEXT.replace("Four fingers", "Mine, corrected")})
    assert right.status_code == 201, right.text
    assert right.json()["title"] == "Mine, corrected"
    assert right.json()["name"] != hand["name"]
    assert (await hands.http.get(f"/v1/hands/{hand['name']}")).json()["title"] == "Four fingers"
    shipped = await hands.http.post("/v1/hands/barrett/descriptions", json={"description": TEXT})
    assert shipped.status_code == 422


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({"../evil__xml": "<mujoco/>"}, "no path inside"),
        ({"hand__xml": "<mujoco><extension><plugin plugin='x'/></extension></mujoco>"}, "may not"),
        ({"hand__xml": "<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco/>"}, "entities"),
        ({"hand__xml": "<mujoco><include file='/etc/passwd'/></mujoco>"}, "no path inside"),
        ({"readme__md": "nothing"}, "model files are: none"),
        ({"hand__xml": hand_mjcf(), "hand__toml": "title = 3"}, "hand.toml"),
        ({"hand__sh": "rm"}, "no model, mesh"),
        ({"hand__stl": bytes(30_000_000), "hand__xml": "<mujoco/>"}, "unpacks to"),
    ],
)
async def test_hostile_and_useless_archives_are_refused_with_a_reason(hands, files, reason):
    response = await upload(hands, archive(**files))
    problem = response.json()
    assert (response.status_code, problem["code"]) == (422, "unusable_hand"), problem
    assert reason in problem["detail"]
    assert str(hands.data_dir) not in problem["detail"]


async def test_what_is_no_zip_is_refused(hands):
    response = await upload(hands, b"solid nothing")
    assert (response.status_code, response.json()["errors"][0]["field"]) == (422, "/file")


async def test_a_deleted_hand_is_gone_and_its_files_are_swept(hands):
    other = archive(hand__xml=hand_mjcf(), hand__toml=TEXT.replace("Four fingers", "Going"))
    hand = (await upload(hands, other)).json()["name"]
    assert (await hands.http.delete("/v1/hands/barrett")).status_code == 422
    assert (await hands.http.delete(f"/v1/hands/{hand}")).status_code == 204
    assert (await hands.http.get(f"/v1/hands/{hand}")).status_code == 404
    assert hands.storage.hand(hand).exists()
    with hands.tables() as database:
        stores = JobStore(database), ObjectStore(database), HandStore(database)
        retention = Retention(*stores, hands.storage, ServiceSettings(data_dir=hands.data_dir, keep_orphans_s=1))
        await retention.sweep_orphans(time.time() + 10)
    assert not hands.storage.hand(hand).exists()


async def test_a_result_for_an_uploaded_hand_is_exported_with_its_links(hands):
    hand = (await uploaded(hands))["name"]
    found = plan(prepare_object(box()), stored_hand(hands.storage, hand), starts=4, seed=1, top_k=1)
    text = strict_json(found.to_dict())
    exported = convert_result(hands.storage, text, "isaac_grasp", 1).content.decode()
    assert "thumb" in exported
    assert hand in exported
    with pytest.raises(UnknownHandError):
        convert_result(replace(hands.storage, root=hands.storage.root / "elsewhere"), text, "isaac_grasp", 1)


async def test_a_hand_in_use_stays(start, tmp_path):
    async with start(tmp_path) as api:
        hand = (await upload(api, archive(a__xml="<mujoco/>"))).json()["name"]
        api.hold()
        first = await api.queue(fake_workers.WAITS)
        await api.begun(first)
        second = await api.queue(hand)
        refused = await api.http.delete(f"/v1/hands/{hand}")
        assert (refused.status_code, refused.json()["type"]) == (409, "urn:fingersplit:problem:in-use")
        await api.http.post(f"/v1/jobs/{second}/cancel")
        assert (await api.http.delete(f"/v1/hands/{hand}")).status_code == 204
        api.go()


async def test_the_client_packs_a_folder_and_uploads_it(hands, tmp_path):
    folder = write_hand(tmp_path / "four", hand_mjcf(), description() | {"title": "From a folder"})
    transport = httpx2.ASGITransport(hands.app)
    async with AsyncClient("http://localhost", transport=transport) as client:
        kept = await client.hands.upload(folder)
        assert (kept.title, kept.origin) == ("From a folder", "uploaded")
        assert (await client.hands.get(kept.name)).joints == kept.joints
        corrected = await client.hands.correct(kept.name, kept.description.replace("From a folder", "Better"))
        assert (await client.hands.details(corrected.name)).title == "Better"
        await client.hands.delete(kept.name)
        with pytest.raises(NotFoundError):
            await client.hands.details(kept.name)


async def test_scenes_are_json_that_comes_compressed(api):
    job = await api.queue(fake_workers.FINE)
    await api.ended(job)
    for view in ("grasps/1/scene", "starts"):
        response = await api.http.get(f"/v1/jobs/{job}/{view}")
        assert response.headers["Content-Encoding"] == "gzip"
        assert json.loads(response.content) == {}
    assert (await api.http.get(f"/v1/jobs/{job}/grasps/1/motion")).status_code == 404  # it was not simulated
