"""What an owner uses, and what is refused beyond its limits."""

import io
import zipfile

import anyio
import pytest
from conftest import PATIENCE
from fake_workers import FINE, HANGS
from test_security import bearer, until_status

from fingersplit_client.schemas import Problem, Usage
from fingersplit_service.database.keys import KeyStore

pytestmark = pytest.mark.anyio
REACHED = "urn:fingersplit:problem:limit-reached"


async def usage(api, **headers: str) -> Usage:
    return Usage.model_validate_json((await api.http.get("/v1/usage", headers=headers)).content)


async def until_used(api, seconds: float) -> Usage:
    with anyio.fail_after(PATIENCE):
        while (found := await usage(api)).cpu_s_per_day.used < seconds:
            await anyio.sleep(0.05)
    return found


async def test_use_is_counted_and_told(start, tmp_path):
    async with start(tmp_path) as api:
        before = await usage(api)
        assert before.stored_bytes.used == 0
        assert (before.jobs_per_minute.limit, before.queued_jobs.limit) == (None, 10_000)
        await api.ended(await api.queue(FINE))
        hanging = await api.queue(HANGS, deadline_s=2.0)
        await api.ended(hanging)
        after = await until_used(api, 0.1)  # of a job that was killed, too
        assert after.jobs_per_minute.used == 2 or after.jobs_per_minute.until > before.jobs_per_minute.until
        assert after.stored_bytes.used > before.stored_bytes.used
        stored = after.stored_bytes.used
        for job in (await api.http.get("/v1/jobs")).json()["items"]:
            await api.http.delete(f"/v1/jobs/{job['id']}")
        assert 0 < (await usage(api)).stored_bytes.used < stored


async def test_jobs_of_a_minute_are_limited(start, tmp_path):
    async with start(tmp_path, max_jobs_per_minute=3) as api:
        body = {"object_id": await api.object_id(), "hand": FINE}
        answers = [await api.http.post("/v1/jobs", json=body) for _ in range(8)]  # at most two minutes' worth
        refused = [answer for answer in answers if answer.status_code == 429]
        assert len(refused) >= 2
        problem = Problem.model_validate_json(refused[0].content)
        assert (problem.type, problem.limit) == (REACHED, 3)
        assert 1 <= int(refused[0].headers["Retry-After"]) <= 60
        assert "more from 20" in problem.detail
        batch = await api.http.post("/v1/batches", json={"jobs": [body] * 4})
        assert batch.status_code == 429


async def test_cpu_time_of_a_day_is_limited_for_each_owner_alone(start, tmp_path):
    async with start(tmp_path, max_cpu_s_per_day=0.5) as api:
        with api.tables() as database:
            keys = KeyStore(database)
            mine, yours = [await keys.create(name, ["read", "plan", "admin"]) for name in ("mine", "yours")]
        await until_status(api, 401, {})
        api.http.headers.update(bearer(mine))
        body = {"object_id": await api.object_id(), "hand": HANGS, "deadline_s": 1.5}
        with anyio.fail_after(PATIENCE):  # how much of a core a job gets in that time is not known
            while (refused := await api.http.post("/v1/jobs", json=body)).status_code == 202:
                await api.ended(refused.json()["id"])
        assert (refused.status_code, refused.json()["type"]) == (429, REACHED)
        assert 1 <= int(refused.headers["Retry-After"]) <= 86_400
        upload = await api.upload(api.cube(7), "seven.off", unit="cm")
        assert upload.status_code == 429
        other = await api.http.post(
            "/v1/objects", files={"file": ("c.off", api.cube(5))}, data={"unit": "cm"}, headers=bearer(yours)
        )
        assert other.status_code == 201


async def test_stored_bytes_are_limited_until_some_are_deleted(start, tmp_path):
    async with start(tmp_path, max_stored_bytes=1000) as api:
        object_id = await api.object_id()
        assert (await usage(api)).stored_bytes.used >= 1000
        refused = await api.http.post("/v1/jobs", json={"object_id": object_id, "hand": FINE})
        assert (refused.status_code, refused.json()["type"]) == (429, REACHED)
        assert "Retry-After" not in refused.headers
        assert "delete" in refused.json()["detail"]
        assert (await api.http.delete(f"/v1/objects/{object_id}")).status_code == 204
        assert (await api.upload(api.cube(5), "c.off", unit="cm")).status_code == 201


async def test_uploaded_hands_count_as_stored_bytes(start, tmp_path):
    async with start(tmp_path, max_stored_bytes=10) as api:
        content = io.BytesIO()
        zipfile.ZipFile(content, "w").close()
        files = {"file": ("hand.zip", content.getvalue())}
        hand = (await api.http.post("/v1/hands", files=files)).json()["name"]
        assert (await usage(api)).stored_bytes.used == len(content.getvalue())
        refused = await api.http.post("/v1/hands", files=files)
        assert (refused.status_code, refused.json()["type"]) == (429, REACHED)
        assert (await api.http.delete(f"/v1/hands/{hand}")).status_code == 204
        assert (await usage(api)).stored_bytes.used == 0
