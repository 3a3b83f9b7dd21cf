"""What hostile or broken clients did to a running service, and what must not come of it."""

import asyncio
import logging
import os
import socket
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import anyio
import httpx2
import pytest
from conftest import PATIENCE, until
from fake_workers import FINE, HANGS, WAITS
from test_faults import serving, wait_until
from test_security import bearer, until_status

from fingersplit_client.schemas import Problem
from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.hands import HandStore
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.operations.retention import Retention
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.telemetry.logs import configure_logs

ENVIRONMENT = {
    "FINGERSPLIT_MAX_CONNECTIONS": "20",
    "FINGERSPLIT_MAX_WAITING": "5",
    "FINGERSPLIT_WRITE_TIMEOUT_S": "1",
}


@pytest.fixture(scope="module")
def attacked(tmp_path_factory) -> Iterator[tuple[int, httpx2.Client, str]]:
    """A service with few connections: its port, a client, and the id of an object."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.MonkeyPatch.context() as environment, ExitStack() as stack:
        for name, value in ENVIRONMENT.items():
            environment.setenv(name, value)
        _, http = stack.enter_context(serving(tmp_path_factory.mktemp("attacked"), port))
        cube = b"OFF\n4 4 0\n0 0 0\n5 0 0\n0 5 0\n0 0 5\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
        object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
        yield port, http, object_id


@contextmanager
def connections(port: int, count: int) -> Iterator[list[socket.socket]]:
    with ExitStack() as stack:
        yield [stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE)) for _ in range(count)]


def read(connection: socket.socket) -> bytes:
    """Everything until the service closes the connection."""
    answer = b""
    try:
        while part := connection.recv(65536):
            answer += part
    except ConnectionResetError:
        pass
    return answer


def test_silent_connections_keep_nobody_out(attacked):
    port, http, _ = attacked
    with connections(port, 120) as silent:
        for path in ("/healthz", "/v1/hands"):
            with httpx2.Client(base_url=http.base_url, timeout=PATIENCE) as other:
                assert other.get(path).status_code == 200
        assert read(silent[0]) == b""  # the one that was silent longest made room


def test_an_owner_may_not_wait_without_end(attacked):
    port, http, object_id = attacked
    job_id = http.post("/v1/jobs", json={"object_id": object_id, "hand": HANGS}).json()["id"]
    request = f"GET /v1/jobs/{job_id}/events HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
    with connections(port, 5) as streams:
        for stream in streams:
            stream.sendall(request)
            assert stream.recv(100).startswith(b"HTTP/1.1 200")
        wait_until(lambda: "fingersplit_waiting_requests 5.0" in http.get("/metrics").text)
        refused = http.get(f"/v1/jobs/{job_id}", headers={"Prefer": "wait=60"})
        assert refused.status_code == 429
        assert Problem.model_validate_json(refused.content).type == "urn:fingersplit:problem:too-many-waiting"
        assert http.get(f"/v1/jobs/{job_id}").status_code == 200
    wait_until(lambda: "fingersplit_waiting_requests 0.0" in http.get("/metrics").text)
    assert http.post(f"/v1/jobs/{job_id}/cancel").json()["state"] == "cancelled"


def test_a_full_service_answers_probes_and_refuses_with_problems(attacked):
    port, http, _ = attacked
    start = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n{"
    with ExitStack() as stack:

        def is_full() -> bool:
            """With one more that says something; one that the service has not heard yet may have made room."""
            (connection,) = stack.enter_context(connections(port, 1))
            connection.sendall(start)
            return http.get("/v1/hands").status_code == 503

        wait_until(is_full)
        refused = http.get("/v1/hands")
        assert Problem.model_validate_json(refused.content).type == "urn:fingersplit:problem:overloaded"
        assert (http.get("/healthz").status_code, http.get("/readyz").status_code) == (200, 200)
        assert 'status="503"' in http.get("/metrics").text
    wait_until(lambda: http.get("/v1/hands").status_code == 200)


def test_headers_without_end_are_refused(attacked):
    port, http, _ = attacked
    with connections(port, 1) as (connection,):
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n")
        try:
            for number in range(200):
                connection.sendall(b"X-%d: %s\r\n" % (number, b"x" * 1000))
        except OSError:
            pass  # closed by the service
        assert read(connection).startswith(b"HTTP/1.1 431") or number < 199
    refused = http.get("/v1/hands", headers={"X-Large": "x" * 70_000})
    assert (refused.status_code, refused.json()["type"]) == (431, "urn:fingersplit:problem:headers-too-large")
    assert http.get("/v1/hands").status_code == 200


def test_an_answer_that_is_not_read_is_given_up(attacked):
    port, _, _ = attacked
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(PATIENCE)
        connection.connect(("127.0.0.1", port))
        connection.sendall(b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 60)
        gone = threading.Event()

        def send_until_closed() -> None:
            try:
                while True:
                    connection.sendall(b"\r\n" * 1000)
            except OSError:
                gone.set()

        thread = threading.Thread(target=send_until_closed, daemon=True)
        thread.start()
        assert gone.wait(PATIENCE)


def test_a_body_over_the_limit_is_not_read_to_its_end(attacked):
    port, http, _ = attacked
    head = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with connections(port, 1) as (connection,):
        connection.sendall(head + b"Transfer-Encoding: chunked\r\n\r\n")
        sent = 0
        try:
            for _ in range(100):
                connection.sendall(b"100000\r\n" + b" " * (1 << 20) + b"\r\n")
                sent += 1
        except OSError:
            pass  # closed by the service
        assert sent < 100
    assert http.get("/v1/hands").status_code == 200


def test_two_host_headers_are_refused(attacked):
    port, _, _ = attacked
    with connections(port, 1) as (connection,):
        connection.sendall(b"GET /v1/hands HTTP/1.1\r\nHost: localhost\r\nHost: evil\r\nConnection: close\r\n\r\n")
        assert read(connection).startswith(b"HTTP/1.1 400")


def test_a_strangers_upload_is_refused_before_its_body(tmp_path, unused_port):
    with serving(tmp_path, unused_port) as (_, http):
        program = "from fingersplit_service.cli import keys; keys()"

        command = [sys.executable, "-c", program, "create", "robot", "--data-dir", str(tmp_path)]
        subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE)
        wait_until(lambda: http.get("/v1/hands").status_code == 401)
        head = b"POST /v1/objects HTTP/1.1\r\nHost: localhost\r\nContent-Type: multipart/form-data; boundary=b\r\n"
        with connections(unused_port, 1) as (connection,):
            connection.sendall(head + b"Content-Length: 60000000\r\n\r\n")
            answer = read(connection)  # nothing of the body was sent
        assert answer.startswith(b"HTTP/1.1 401")
        assert b"connection: close" in answer.lower()


@pytest.mark.anyio
async def test_a_page_of_another_site_gets_nothing_without_keys(start, tmp_path):
    async with start(tmp_path, allow_unauthenticated=True, allowed_hosts=("cell.example",)) as api:
        for host, status in (
            ("rebound.example", 403),
            ("cell.example:8000", 200),
            ("192.0.2.7:8000", 200),
            ("localhost", 200),
        ):
            assert (await api.http.get("/v1/jobs", headers={"Host": host})).status_code == status, host
        cross = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}
        assert (await api.http.get("/v1/jobs", headers=cross)).status_code == 403
        link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
        assert (await api.http.get("/review", headers=link)).status_code == 200


@pytest.mark.anyio
async def test_a_revoked_key_ends_its_event_stream(start, tmp_path):
    async with start(tmp_path, keepalive_s=0.2) as api:
        with api.tables() as database:
            keys = KeyStore(database)
            mine = await keys.create("mine", ["read", "plan", "admin"])
            await until_status(api, 401, {})
            api.http.headers.update(bearer(mine))
            job_id = await api.queue(HANGS)
            following = asyncio.create_task(api.http.get(f"/v1/jobs/{job_id}/events"))
            await api.until_metric(1, "fingersplit_waiting_requests")
            await keys.revoke(mine.split("_")[1])
            with anyio.fail_after(PATIENCE):
                story = (await following).text
            assert "event: running" in story or "event: queued" in story
            assert not any(f"event: {state}" in story for state in ("succeeded", "failed", "cancelled"))


@pytest.mark.anyio
async def test_an_owner_who_floods_does_not_starve_another(start, tmp_path):
    async with start(tmp_path) as api:
        with api.tables() as database:
            keys = KeyStore(database)
            mine, yours = [await keys.create(name, ["read", "plan", "admin"]) for name in ("mine", "yours")]
        await until_status(api, 401, {})
        api.http.headers.update(bearer(mine))
        mesh = {"file": ("c.off", api.cube(5))}
        uploads = [
            await api.http.post("/v1/objects", files=mesh, data={"unit": "cm"}, headers=bearer(key))
            for key in (mine, yours)
        ]
        object_id = uploads[0].json()["id"]
        api.hold()
        first = await api.queue(WAITS, object_id=object_id)
        await api.begun(first)
        flood = [await api.queue(FINE, object_id=object_id, priority=10) for _ in range(20)]
        body = {"object_id": object_id, "hand": FINE, "priority": -10}
        ours = (await api.http.post("/v1/jobs", json=body, headers=bearer(yours))).json()["id"]

        async def generate() -> None:
            await api.http.post(f"/v1/objects/{object_id}/parallel-grasps/generate", json={"count": 1})

        async with anyio.create_task_group() as group:
            for _ in range(10):
                group.start_soon(generate)
            await api.until_metric(10, "fingersplit_waiting_answers")
            api.go()
        ended = (await api.http.get(f"/v1/jobs/{ours}", headers=bearer(yours) | {"Prefer": "wait=60"})).json()
        began = sorted([(await api.ended(job_id))["started_at"] for job_id in flood])
        assert ended["started_at"] < began[2]


@pytest.mark.anyio
async def test_a_deleted_database_is_not_ready_and_accepts_nothing(start, tmp_path):
    async with start(tmp_path) as api:
        object_id = await api.object_id()
        file = tmp_path / "fingersplit.sqlite3"
        file.rename(tmp_path / "gone")
        for response in (
            await api.http.get("/readyz"),
            await api.http.post("/v1/jobs", json={"object_id": object_id}),
        ):
            assert (response.status_code, response.headers["Retry-After"]) == (503, "1")
            assert Problem.model_validate_json(response.content).type == "urn:fingersplit:problem:storage-unavailable"
        assert (await api.http.get("/healthz")).status_code == 200
        (tmp_path / "gone").rename(file)
        assert (await api.http.get("/readyz")).status_code == 200
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


@pytest.mark.parametrize("content", [b"garbage" * 10_000, None])
def test_a_damaged_database_ends_the_start_in_a_sentence(tmp_path, content):

    file = tmp_path / "fingersplit.sqlite3"
    Database(database_url(None, file)).close()
    size = file.stat().st_size
    with file.open("r+b") as pages:
        pages.seek(0 if content else 100)
        pages.write(content or os.urandom(size - 100))
    command = [Path(sys.executable).with_name("fingersplit"), "serve", "--data-dir", str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ended.returncode != 0
    assert "The database cannot be opened" in ended.stderr
    assert "Traceback" not in ended.stderr.split("The database cannot be opened")[0]


@pytest.mark.anyio
async def test_a_delete_takes_nothing_from_an_upload_of_another(start, tmp_path, cube):
    """Whenever clean-up runs while one owner deletes a mesh and another uploads it, the other's job finds it."""
    async with start(tmp_path, keep_orphans_s=1000) as api:
        with api.tables() as database:
            objects, jobs = ObjectStore(database), JobStore(database)
            retention = Retention(
                jobs, objects, HandStore(database), api.storage, ServiceSettings(keep_orphans_s=0.001)
            )
            for _ in range(10):
                uploaded = await api.upload(cube, "c.off", unit="cm")
                async with anyio.create_task_group() as group:
                    group.start_soon(api.http.delete, uploaded.headers["Location"])
                    group.start_soon(api.upload, cube, "c.off")
                    group.start_soon(retention.sweep_orphans, 4e9)
                again = await api.upload(cube, "c.off", unit="cm")
                assert api.storage.shape(again.json()["id"]).exists()


def test_escape_sequences_of_a_path_do_not_reach_a_terminal(capsys):
    before = logging.getLogger().handlers[:]
    try:
        configure_logs("text", "info")
        logging.getLogger("x").info("GET /\x1b[2J\x1b]0;owned\x07\x85\u2028x")
    finally:
        logging.getLogger().handlers[:] = before
    line = capsys.readouterr().err
    assert line.isprintable() or line.rstrip("\n").isprintable()
    assert "\\x1b[2J" in line


@pytest.mark.anyio
async def test_reads_do_not_wait_for_a_lock_of_another_process(start, tmp_path):
    async with start(tmp_path) as api:
        job_id = await api.queue(FINE)
        await api.ended(job_id)
        holder = sqlite3.connect(api.storage.database, isolation_level=None)
        holder.execute("BEGIN IMMEDIATE")
        try:  # it is held until the answers are there
            assert (await api.http.get("/v1/jobs")).status_code == 200
            assert (await api.job(job_id))["state"] == "succeeded"
            assert (await api.http.post("/v1/jobs", json={"object_id": await api.object_id()})).status_code == 503
        finally:
            holder.execute("ROLLBACK")
            holder.close()


@pytest.mark.anyio
async def test_work_is_dropped_whose_client_has_gone(start, tmp_path):
    async with start(tmp_path) as api:
        object_id = await api.object_id()
        api.hold()
        await api.begun(await api.queue(WAITS))
        path = f"/v1/objects/{object_id}/parallel-grasps/generate"
        async with anyio.create_task_group() as group:
            for _ in range(3):
                group.start_soon(lambda: api.http.post(path, json={"count": 1}))
            await api.until_metric(3, "fingersplit_waiting_answers")
            group.cancel_scope.cancel()

        async def nobody_waits() -> bool:
            return await api.metric("fingersplit_waiting_answers") == 0

        await until(nobody_waits)
        api.go()


@pytest.mark.anyio
async def test_a_request_is_logged_with_its_key(start, tmp_path, caplog):
    async with start(tmp_path) as api:
        with api.tables() as database:
            key = await KeyStore(database).create("mine", ["read", "plan"])
        await until_status(api, 401, {})
        with caplog.at_level(logging.INFO, "fingersplit_service.security.middleware"):
            await api.http.get("/v1/jobs", headers=bearer(key))
        assert f"key={key.split('_')[1]}" in caplog.text


@pytest.mark.anyio
async def test_clean_up_goes_on_after_an_error(start, tmp_path, monkeypatch):
    async with start(tmp_path) as api:
        with api.tables() as database:
            jobs = JobStore(database)
            settings = ServiceSettings(keep_orphans_s=0.01)
            retention, rounds = (
                Retention(jobs, ObjectStore(database), HandStore(database), api.storage, settings),
                [],
            )

            async def fails_once(_now: float) -> None:
                rounds.append(1)
                if len(rounds) == 1:
                    raise RuntimeError("damaged")

            monkeypatch.setattr(retention, "sweep", fails_once)
            running = asyncio.create_task(retention.run())
            await until(lambda: len(rounds) > 2)
            running.cancel()
