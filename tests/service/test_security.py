"""Keys and owners: nothing crosses; and what no request may do, whoever sends it."""

import re
import socket
import subprocess
import sys

import anyio
import pytest
from conftest import PATIENCE
from fake_workers import FINE
from test_faults import serving

from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.operations.exposure import Exposed, refuse_exposure
from fingersplit_service.settings import ServiceSettings

pytestmark = pytest.mark.anyio

EMPTY_ZIP = b"PK\x05\x06" + 18 * b"\0"
PUBLIC = {"/healthz", "/readyz", "/review/session"}


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


async def until_status(api, status: int, headers: dict[str, str], path: str = "/v1/jobs") -> None:
    """Wait until the service has looked at the keys again."""
    with anyio.fail_after(PATIENCE):
        while (await api.http.get(path, headers=headers)).status_code != status:
            await anyio.sleep(0.05)


@pytest.fixture(scope="module")
async def guarded(tmp_path_factory, anyio_backend):
    """A service with keys of two owners, one of whom has one of everything."""
    from conftest import started

    async with started(tmp_path_factory.mktemp("guarded")) as api:
        with api.tables() as database:
            keys = KeyStore(database)
            api.mine = await keys.create("mine", ["read", "plan"])
            api.theirs = await keys.create("theirs", ["read", "plan"])
            api.reading = await keys.create("reading", ["read"])
            api.admin = await keys.create("admin", ["admin"])
        await until_status(api, 200, bearer(api.admin), "/metrics")
        await until_status(api, 401, {})
        api.http.headers.update(bearer(api.mine))
        object_id = await api.object_id()
        grasps = await api.http.post(f"/v1/objects/{object_id}/parallel-grasps/generate", json={"count": 1})
        batch = await api.http.post("/v1/batches", json={"jobs": [{"object_id": object_id, "hand": FINE}]})
        api.ids = {
            "object_id": object_id,
            "set_id": grasps.json()["id"],
            "batch_id": batch.json()["id"],
            "job_id": batch.json()["job_ids"][0],
            "rank": "1",
            "format_name": "isaac_grasp",
        }
        hand = await api.http.post("/v1/hands", files={"file": ("hand.zip", EMPTY_ZIP)})
        api.ids["hand_id"] = hand.json()["name"]
        await api.ended(api.ids["job_id"])
        outcome = await api.http.post(f"/v1/jobs/{api.ids['job_id']}/grasps/1/outcome", json={"held": True})
        api.ids["outcome_id"] = outcome.json()["id"]
        asked = {"objects": [object_id], "per_object": 1, "job": {"hand": FINE}}
        dataset = await api.http.post("/v1/datasets", json=asked)
        api.ids |= {"dataset_id": dataset.json()["id"], "index": "0", "number": "0"}
        yield api


def operations(app) -> list[tuple[str, str]]:
    return [(method, path) for path, methods in app.openapi()["paths"].items() for method in methods]


BODIES = {
    "/v1/jobs/{job_id}/grasps/{rank}/outcome": {"held": True},
    "/v1/hands/{hand_id}/descriptions": {"description": "title = 'Mine'"},
    "/v1/jobs": {"object_id": "{object_id}"},
    "/v1/datasets": {"objects": ["{object_id}"]},
    "/v1/batches": {"jobs": [{"object_id": "{object_id}"}]},
    "/v1/objects/{object_id}/parallel-grasps": {
        "parallel_grasps": [{"contacts": [[0.03, 0, 0], [-0.03, 0, 0]], "approach": [0, 0, -1]}]
    },
}


def body_of(path: str, ids: dict[str, str]) -> dict | None:
    def fill(value):
        if isinstance(value, dict):
            return {name: fill(one) for name, one in value.items()}
        if isinstance(value, list):
            return [fill(one) for one in value]
        return value.format(**ids) if isinstance(value, str) else value

    return fill(BODIES.get(path, {}))


async def ask(api, method: str, path: str, headers: dict[str, str]):
    filled = path.format(**api.ids)
    if method == "post" and path == "/v1/objects":
        return await api.http.post(filled, files={"file": ("c.off", api.cube(5))}, data={"unit": "cm"}, headers=headers)
    if method == "post" and path == "/v1/hands":
        return await api.http.post(filled, files={"file": ("hand.zip", EMPTY_ZIP)}, headers=headers)
    if path == "/v1/scenes/from-depth":
        return await api.http.post(filled, files={"file": ("view.npz", EMPTY_ZIP)}, headers=headers)
    if path.endswith("/import"):
        return await api.http.post(filled, files={"file": ("grasps.json", b"[]")}, headers=headers)
    return await api.http.request(method, filled, json=body_of(path, api.ids), headers=headers)


async def test_strangers_get_nowhere(guarded):
    for method, path in operations(guarded.app):
        if path in PUBLIC:
            continue
        for headers in (
            {"Authorization": ""},
            bearer("fsk_x_y"),
            bearer(guarded.mine[:-1]),
            bearer(guarded.mine.split("_")[1]),
            {"Authorization": guarded.mine},
            {"Authorization": "", "Cookie": "fingersplit_session=x"},
        ):
            response = await ask(guarded, method, path, headers)
            assert response.status_code == 401, (method, path)
            assert response.headers["WWW-Authenticate"] == "Bearer"


async def test_nothing_crosses_from_one_key_to_another(guarded):
    """Every endpoint that names a thing of mine, asked with their key, does not find it."""
    before = (await guarded.http.get(f"/v1/jobs/{guarded.ids['job_id']}")).json()
    named = [one for one in operations(guarded.app) if "{" in one[1]]
    assert len(named) > 12
    for method, path in named:
        response = await ask(guarded, method, path, bearer(guarded.theirs))
        assert response.status_code == 404, (method, path, response.text)
    for path in ("/v1/jobs", "/v1/objects", "/v1/outcomes", "/v1/batches", "/v1/datasets"):
        assert (await guarded.http.get(path, headers=bearer(guarded.theirs))).json()["items"] == []
    hands = (await guarded.http.get("/v1/hands", headers=bearer(guarded.theirs))).json()
    assert guarded.ids["hand_id"] not in {hand["name"] for hand in hands}
    for path in ("/v1/jobs", "/v1/batches", "/v1/datasets"):
        response = await ask(guarded, "post", path, bearer(guarded.theirs))
        assert response.status_code == 422
        assert "There is no object" in response.json()["detail"]
    assert (await guarded.http.get(f"/v1/jobs/{guarded.ids['job_id']}")).json() == before


async def test_the_same_mesh_of_another_tells_nothing(guarded):
    response = await guarded.upload(guarded.cube(5), "theirs.off", unit="cm")
    assert response.status_code == 200  # I have it
    files = {"file": ("theirs.off", guarded.cube(5))}
    theirs = await guarded.http.post("/v1/objects", files=files, data={"unit": "cm"}, headers=bearer(guarded.theirs))
    assert (theirs.status_code, theirs.json()["name"]) == (201, "theirs")
    deleted = await guarded.http.delete(theirs.headers["Location"], headers=bearer(guarded.theirs))
    assert deleted.status_code == 204
    assert (await guarded.http.get(f"/v1/objects/{guarded.ids['object_id']}/mesh")).status_code == 200


async def test_scopes_hold(guarded):
    for method, path in operations(guarded.app):
        if path in PUBLIC:
            continue
        reading = await ask(guarded, method, path, bearer(guarded.reading))
        admin = await ask(guarded, method, path, bearer(guarded.admin))
        reads = method == "get" or path == "/v1/objects/lookup"
        assert (reading.status_code == 403) == (not reads or path == "/metrics"), (method, path)
        assert (admin.status_code == 403) == (path != "/metrics"), (method, path)


async def test_a_revoked_key_ends_with_its_session(guarded):
    with guarded.tables() as database:
        key = await KeyStore(database).create("short", ["read"])
    await until_status(guarded, 200, bearer(key))
    refused = await guarded.http.post("/review/session", json={"key": key + "x"}, headers={"Authorization": ""})
    opened = await guarded.http.post("/review/session", json={"key": key}, headers={"Authorization": ""})
    cookie = opened.headers["Set-Cookie"]
    guarded.http.cookies.clear()
    assert (refused.status_code, opened.status_code) == (401, 200)
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
    assert key not in cookie

    session = {"Authorization": "", "Cookie": cookie.split(";")[0]}
    assert (await guarded.http.get("/v1/jobs", headers=session)).json()["items"] == []
    assert (await guarded.http.get("/review/session", headers=session)).json() == {"name": "short", "scopes": ["read"]}
    with guarded.tables() as database:
        await KeyStore(database).revoke(key.split("_")[1])
    await until_status(guarded, 401, bearer(key))
    assert (await guarded.http.get("/v1/jobs", headers=session)).status_code == 401
    assert (await guarded.http.get("/v1/jobs", headers=bearer(key))).status_code == 401


async def test_a_closed_session_is_over(guarded):
    opened = await guarded.http.post("/review/session", json={"key": guarded.mine}, headers={"Authorization": ""})
    guarded.http.cookies.clear()
    session = {"Authorization": "", "Cookie": opened.headers["Set-Cookie"].split(";")[0]}
    assert (await guarded.http.delete("/review/session", headers=session)).status_code == 204
    guarded.http.cookies.clear()
    assert (await guarded.http.get("/v1/jobs", headers=session)).status_code == 401


async def test_answers_carry_security_headers(api):
    for path in ("/docs", "/v1/jobs", "/nowhere"):
        headers = (await api.http.get(path)).headers
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["X-Frame-Options"] == "DENY"
        assert re.fullmatch(r"[0-9a-f]{32}", headers["X-Request-ID"])
    assert "default-src 'self'" in (await api.http.get("/docs")).headers["Content-Security-Policy"]
    response = await api.http.get("/healthz", headers={"X-Request-ID": "robot-7.a"})
    assert response.headers["X-Request-ID"] == "robot-7.a"
    assert (await api.http.get("/healthz", headers={"X-Request-ID": "a b"})).headers["X-Request-ID"] != "a b"


@pytest.mark.parametrize("host", ["attacker.example", "attacker.example:8000", "localhost.attacker.example", "[", ""])
async def test_a_name_that_is_not_ours_is_refused(api, host):
    response = await api.http.get("/v1/jobs", headers={"Host": host})
    assert response.status_code == 403


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "[::1]:8000", "localhost"])
async def test_loopback_may_be_called_by_its_names(api, host):
    assert (await api.http.get("/v1/jobs", headers={"Host": host})).status_code == 200


async def test_another_page_may_not_change_anything(api, cube):
    for origin in ("https://attacker.example", "null", "http://localhost:9999"):
        response = await api.http.post("/v1/objects", files={"file": ("c.off", cube)}, headers={"Origin": origin})
        assert response.status_code == 403
    response = await api.http.post("/v1/jobs", json={}, headers={"Origin": "http://localhost"})
    assert response.status_code == 422


async def test_others_are_let_in_with_keys_only(tmp_path):
    database = Database(database_url(None, tmp_path / "keys.sqlite3"))
    keys = KeyStore(database)
    exposed = ServiceSettings(host="0.0.0.0", data_dir=tmp_path)
    with pytest.raises(Exposed, match="fingersplit keys create"):
        await refuse_exposure(exposed, keys)
    await refuse_exposure(ServiceSettings(host="::1", data_dir=tmp_path), keys)
    await refuse_exposure(ServiceSettings(host="0.0.0.0", allow_unauthenticated=True, data_dir=tmp_path), keys)
    key = await keys.create("robot", ["read"])
    await refuse_exposure(exposed, keys)
    await keys.revoke(key.split("_")[1])
    with pytest.raises(Exposed):
        await refuse_exposure(exposed, keys)
    database.close()


def keys_command(data_dir, *arguments: str) -> subprocess.CompletedProcess[str]:
    program = "from fingersplit_service.cli import keys; keys()"
    command = [sys.executable, "-c", program, *arguments, "--data-dir", str(data_dir)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


async def test_the_keys_command(tmp_path):
    key = keys_command(tmp_path, "create", "robot", "--scopes", "read,admin").stdout.strip()
    listed = keys_command(tmp_path, "list").stdout
    key_id = key.split("_")[1]
    assert key_id in listed
    assert "active" in listed
    assert "read,admin" in listed
    assert key.split("_", 2)[2] not in listed
    assert keys_command(tmp_path, "revoke", key_id).returncode == 0
    assert "revoked" in keys_command(tmp_path, "list").stdout
    assert keys_command(tmp_path, "revoke", key_id).returncode == 2
    assert keys_command(tmp_path, "create", "x", "--scopes", "root").returncode == 2


def test_slow_and_broken_clients(tmp_path, unused_port, monkeypatch):
    monkeypatch.setenv("FINGERSPLIT_HEADER_TIMEOUT_S", "0.5")
    monkeypatch.setenv("FINGERSPLIT_BODY_TIMEOUT_S", "0.5")

    def talk(*parts: bytes) -> bytes:
        with socket.create_connection(("127.0.0.1", unused_port), timeout=10) as connection:
            for part in parts:
                connection.sendall(part)
            answer = b""
            try:
                while chunk := connection.recv(65536):
                    answer += chunk
            except ConnectionResetError:
                pass
        return answer

    start = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with serving(tmp_path, unused_port) as (_, http):
        assert talk() == b""
        assert talk(b"GET /v1/jobs HTTP/1.1\r\nHost: loc") == b""
        assert b" 408 " in talk(start + b"Connection: close\r\nContent-Length: 100\r\n\r\n", b"{")
        assert b" 413 " in talk(start + b"Connection: close\r\nContent-Length: 9999999999999999999\r\n\r\n", b"{")
        assert b" 400 " in talk(b"NONSENSE\r\n\r\n")
        assert b" 4" in talk(b"GET /v1/jobs?x=\xff\x00 HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert http.get("/healthz").status_code == 200
