"""Data sets over HTTP are filled round by round by jobs; nothing is lost or planned twice; each is its owner's."""

import pytest
from conftest import Api, cube_file, until
from fake_workers import FINE, NO_GRASP, RAISES, WAITS

pytestmark = pytest.mark.anyio

PATH = "/v1/datasets"


async def begun(api: Api, objects: list[str], hand: str = FINE, **asked: object) -> dict:
    body = {"objects": objects, "job": {"hand": hand, "starts": 4, "seed": 7}, "per_object": 2} | asked
    response = await api.http.post(PATH, json=body)
    assert response.status_code == 202, response.text
    assert response.headers["location"] == f"{PATH}/{response.json()['id']}"
    return response.json()


async def filled(api: Api, dataset_id: str) -> dict:
    """The data set once it is complete."""

    async def ended() -> bool:
        return (await api.http.get(f"{PATH}/{dataset_id}")).json()["state"] != "running"

    await until(ended)
    return (await api.http.get(f"{PATH}/{dataset_id}")).json()


async def rounds(api: Api, dataset_id: str) -> list[dict]:
    """The jobs of its rounds."""
    return (await api.http.get("/v1/jobs", params={"batch_id": dataset_id})).json()["items"]


async def begin_rounds(api: Api, dataset_id: str, count: int) -> None:
    """Wait until so many rounds have been begun."""

    async def begun_enough() -> bool:
        return len(await rounds(api, dataset_id)) >= count

    await until(begun_enough)


async def cubes(api: Api, count: int) -> list[str]:
    return [(await api.upload(cube_file(5 + k), f"cube{k}.off", unit="cm")).json()["id"] for k in range(count)]


async def test_rounds_are_planned_until_every_object_has_enough(api):
    objects = await cubes(api, 3)
    found = await filled(api, (await begun(api, objects, split=[1, 1, 1]))["id"])
    assert (found["state"], found["done"], found["failed"], found["selected"]) == ("complete", 3, 0, 6)
    assert sorted(one["split"] for one in found["items"]) == ["test", "train", "validation"]
    for item in found["items"]:
        assert [shard["round"] for shard in item["shards"]] == [0, 1]  # the fakes find one grasp a round
        jobs = [await api.job(shard["job_id"]) for shard in item["shards"]]
        assert [job["request"]["seed"] for job in jobs] == [7, 8]
        assert {job["batch_id"] for job in jobs} == {found["id"]}
        assert item["shards"][0]["path"] == f"{item['split']}/{item['index']:05d}-{item['name']}.0000.h5"


async def test_objects_are_given_up_with_their_cause(api):
    (one,) = await cubes(api, 1)
    barren = await filled(api, (await begun(api, [one], NO_GRASP))["id"])
    assert barren["items"][0]["error"]["code"] == "too_few_grasps"
    assert len(barren["items"][0]["shards"]) == 3
    failed = await filled(api, (await begun(api, [one], RAISES))["id"])
    assert (failed["failed"], failed["items"][0]["error"]["code"]) == (1, "internal")
    unheld = await filled(api, (await begun(api, [one], verified=True, max_rounds=2))["id"])
    assert (unheld["selected"], unheld["feasible"], len(unheld["items"][0]["shards"])) == (0, 2, 2)


async def test_a_data_set_goes_on_after_a_restart(start, tmp_path):
    async with start(tmp_path) as api:
        api.hold()
        asked = await begun(api, await cubes(api, 2), WAITS)
        await begin_rounds(api, asked["id"], 1)
    async with start(tmp_path) as api:
        api.go()
        found = await filled(api, asked["id"])
        assert (found["done"], found["selected"]) == (2, 4)
        jobs = await rounds(api, asked["id"])
        assert len(jobs) == 4


async def test_cancelling_ends_its_jobs_and_deleting_removes_them(api):
    api.hold()
    asked = await begun(api, await cubes(api, 2), WAITS)
    await begin_rounds(api, asked["id"], 2)
    cancelled = (await api.http.post(f"{PATH}/{asked['id']}/cancel")).json()
    assert cancelled["state"] == "cancelled"
    jobs = await rounds(api, asked["id"])
    assert {job["state"] for job in jobs} == {"cancelled"}
    assert (await api.http.delete(f"{PATH}/{asked['id']}")).status_code == 204
    assert (await api.http.get(f"{PATH}/{asked['id']}")).status_code == 404
    assert (await api.http.get(f"/v1/jobs/{jobs[0]['id']}")).status_code == 404


async def test_shards_and_manifest_are_downloaded(api):
    found = await filled(api, (await begun(api, await cubes(api, 1)))["id"])
    shard = await api.http.get(f"{PATH}/{found['id']}/shards/0/1")
    assert (shard.status_code, shard.headers["content-type"]) == (200, "application/x-hdf5")
    assert shard.content == b"shard 0 1"
    assert (await api.http.get(f"{PATH}/{found['id']}/shards/0/2")).status_code == 404
    manifest = (await api.http.get(f"{PATH}/{found['id']}/manifest")).json()
    assert (manifest["schema"], manifest["order"]["unit"], manifest["order"]["seed"]) == (
        "fingersplit-dataset",
        "cm",
        7,
    )
    assert manifest["objects"][0]["split"] == found["items"][0]["split"]
    await api.http.delete(f"/v1/jobs/{found['items'][0]['shards'][1]['job_id']}")
    gone = await api.http.get(f"{PATH}/{found['id']}/shards/0/1")
    assert (gone.status_code, gone.json()["type"].rpartition(":")[2]) == (409, "gone")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"objects": ["nothing"]}, "/objects/0"),
        ({"job": {"hand": "claw"}}, "/job/hand"),
        ({"job": {"startz": 3}}, "/job/startz"),
        ({"job": {"object_id": "abc"}}, "/job/object_id"),
        ({"split": [0, 0, 0]}, "/split"),
        ({"job": {"parallel_grasp_set": "abc"}}, "/job/parallel_grasps"),
    ],
)
async def test_what_cannot_be_filled_is_refused_at_once(api, change, field):
    response = await api.http.post(PATH, json={"objects": await cubes(api, 1)} | change)
    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == field


async def test_lists_have_data_sets_and_batches_apart(api):
    (one,) = await cubes(api, 1)
    asked = [await filled(api, (await begun(api, [one], per_object=1, name=f"set {k}"))["id"]) for k in range(2)]
    page = (await api.http.get(PATH, params={"limit": 1})).json()
    assert [item["name"] for item in page["items"]] == ["set 1"]
    rest = (await api.http.get(PATH, params={"limit": 1, "cursor": page["next_cursor"]})).json()
    assert [item["id"] for item in rest["items"]] == [asked[0]["id"]]
    jobs = {"jobs": [{"object_id": one, "hand": FINE, "seed": k} for k in range(2)]}
    batches = [(await api.http.post("/v1/batches", json=jobs)).json()["id"] for _ in range(2)]
    listed = (await api.http.get("/v1/batches")).json()["items"]
    assert [batch["id"] for batch in listed][:2] == batches[::-1]
    assert not {batch["id"] for batch in listed} & {one["id"] for one in asked}
    assert all(sum(batch["states"].values()) == 2 for batch in listed[:2])
