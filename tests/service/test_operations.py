"""What the service tells whoever operates it, and what it deletes."""

import asyncio
import json
import logging
import os
import resource
import sqlite3
import subprocess
import sys
import time

import anyio
import pytest
from conftest import PATIENCE, until
from fake_workers import FINE, HANGS, RAISES, WAITS
from prometheus_client.parser import text_string_to_metric_families
from test_faults import serving

from fingersplit_service.database.hands import HandStore
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.operations.doctor import examine
from fingersplit_service.operations.retention import Retention
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.telemetry.logs import configure_logs, log_context

pytestmark = pytest.mark.anyio


async def metrics(api) -> dict[tuple[str, str], float]:
    """Values by name and labels."""
    families = text_string_to_metric_families((await api.http.get("/metrics")).text)
    return {
        (sample.name, ",".join(sample.labels.values())): sample.value
        for family in families
        for sample in family.samples
    }


async def test_metrics_count_what_happens(start, tmp_path):
    async with start(tmp_path) as api:
        await api.ended(await api.queue(FINE))
        await api.ended(await api.queue(RAISES))
        hanging = await api.queue(HANGS)
        waiting = await api.queue(FINE)
        await api.ended(hanging, ("running",))
        found = await metrics(api)
        assert found["fingersplit_jobs", "queued"] == 1
        assert found["fingersplit_jobs", "running"] == 1
        assert found["fingersplit_jobs_ended_total", "succeeded"] == 1
        assert found["fingersplit_jobs_ended_total", "failed"] == 1
        assert found["fingersplit_stage_seconds_count", "splitting"] == 1
        assert found["fingersplit_verifications_total", "held"] == 1
        assert found["fingersplit_workers", "busy"] == 1
        assert found["fingersplit_requests_total", "POST,/v1/jobs,202"] == 4
        await api.http.post(f"/v1/jobs/{hanging}/cancel")
        await api.ended(waiting)
        found = await metrics(api)
        assert found["fingersplit_jobs_ended_total", "cancelled"] == 1
        assert found["fingersplit_worker_restarts", "killed"] == 1


async def test_a_spare_worker_takes_over_at_once(start, tmp_path):
    async with start(tmp_path, spare_workers=1) as api:
        await api.until_metric(1, "fingersplit_workers", "spare")
        hanging, next_job = await api.queue(HANGS), await api.queue(FINE)
        await api.ended(hanging, ("running",))
        assert (await api.job(next_job))["state"] == "queued"  # a spare worker does not work beside the others
        await api.http.post(f"/v1/jobs/{hanging}/cancel")
        await api.ended(next_job)
        assert (await api.http.get("/readyz")).status_code == 200


async def test_a_worker_that_grows_is_replaced(start, tmp_path):
    async with start(tmp_path, worker_recycle_bytes=1) as api:
        for job_id in [await api.queue(FINE) for _ in range(3)]:
            assert (await api.ended(job_id))["state"] == "succeeded"
        await api.until_metric(2, "fingersplit_worker_restarts", "grown")


async def test_a_locked_database_loses_no_result(start, tmp_path):
    async with start(tmp_path) as api:
        job_id = await api.queue(WAITS)
        await api.ended(job_id, ("running",))
        stranger = sqlite3.connect(tmp_path / "fingersplit.sqlite3", isolation_level=None)
        stranger.execute("BEGIN IMMEDIATE")
        (tmp_path / "go").touch()
        for _ in range(2):  # the second comes after the first attempt to keep the result
            with anyio.fail_after(PATIENCE):
                response = await api.http.post("/v1/jobs", json={"object_id": await api.object_id()})
        assert (response.status_code, response.json()["type"]) == (503, "urn:fingersplit:problem:storage-unavailable")
        assert response.headers["Retry-After"]
        assert (await api.job(job_id))["state"] == "running"  # reading goes on
        stranger.execute("ROLLBACK")
        stranger.close()
        job = await api.ended(job_id)
        assert (job["state"], job["attempts"]) == ("succeeded", 1)
        assert "kept later" in job["warnings"][0]


def test_a_full_disk_refuses_new_jobs_and_keeps_old_ones(tmp_path, unused_port, cube):
    with serving(tmp_path, unused_port) as (process, http):
        object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
        body = {"object_id": object_id, "planner": {"friction": 0.5}}
        done = http.post("/v1/jobs", json=body, headers={"Prefer": f"wait={PATIENCE}"}).json()
        database = tmp_path / "fingersplit.sqlite3"
        most = max(file.stat().st_size for file in (database, database.with_name(f"{database.name}-wal")))
        limits = resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (most + 30_000, resource.RLIM_INFINITY))
        answers = [http.post("/v1/jobs", json=body) for _ in range(60)]
        assert 503 in {answer.status_code for answer in answers}
        assert {answer.status_code for answer in answers} <= {202, 503}
        assert http.get(f"/v1/jobs/{done['id']}").json()["state"] == "succeeded"
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, limits)
        for answer in answers:
            if answer.status_code == 202:
                job = http.get(answer.headers["Location"], headers={"Prefer": f"wait={PATIENCE}"}).json()
                assert job["state"] == "succeeded"


async def test_old_things_are_deleted(start, tmp_path):
    async with start(tmp_path) as api:
        job_id, object_id = await api.queue(FINE), await api.object_id()
        await api.ended(job_id)
        await api.http.get(f"/v1/jobs/{job_id}/recording.rrd")
        kept = {"keep_jobs_s": 200, "keep_recordings_s": 100, "keep_objects_s": 300, "keep_orphans_s": 10}
        settings = ServiceSettings(data_dir=tmp_path, **kept)
        view, mesh = api.storage.view(job_id, 1, "recording.rrd"), api.storage.shape(object_id)
        with api.tables() as database:
            retention = Retention(JobStore(database), ObjectStore(database), HandStore(database), api.storage, settings)
            await retention.sweep(time.time())
            assert view.exists()
            await retention.sweep(time.time() + 150)
            assert not view.exists()
            assert (await api.job(job_id))["state"] == "succeeded"
            await retention.sweep(time.time() + 250)
            assert (await api.http.get(f"/v1/jobs/{job_id}")).status_code == 404
            await retention.sweep_orphans(time.time() + 250)
            assert mesh.exists()
            await retention.sweep(time.time() + 350)
            assert (await api.http.get(f"/v1/objects/{object_id}")).status_code == 404
            await retention.sweep_orphans(time.time() + 5)
            assert mesh.exists()  # somebody may be uploading it
            await retention.sweep_orphans(time.time() + 15)
            assert not mesh.exists()


async def test_an_upload_renews_the_file_of_an_object_that_nobody_has(start, tmp_path, cube):
    async with start(tmp_path, keep_orphans_s=1000) as api:
        object_id = (await api.upload(cube, "cube.off", unit="cm")).json()["id"]
        mesh = api.storage.shape(object_id)
        await api.http.delete(f"/v1/objects/{object_id}")
        os.utime(mesh, (1e9, 1e9))
        with api.tables() as database:
            retention = Retention(
                JobStore(database), ObjectStore(database), HandStore(database), api.storage, ServiceSettings()
            )
            assert (await api.upload(cube, "cube.off", unit="cm")).status_code == 201
            await ObjectStore(database).remove("local", object_id)  # as if its row were not written yet
            await retention.sweep_orphans(time.time())
            assert mesh.exists()


async def test_files_of_jobs_that_are_not_there_go(start, tmp_path):
    async with start(tmp_path, keep_orphans_s=1000) as api:
        job_id = await api.queue(FINE)
        await api.ended(job_id)
        await api.http.get(f"/v1/jobs/{job_id}/recording.rrd")
        left = api.storage.view("deleted-meanwhile", 1, "picture.png")
        left.parent.mkdir(parents=True)
        left.touch()
        with api.tables() as database:
            settings = ServiceSettings(data_dir=tmp_path, keep_orphans_s=10)
            retention = Retention(JobStore(database), ObjectStore(database), HandStore(database), api.storage, settings)
            await retention.sweep_orphans(time.time() + 100)
        assert not left.parent.exists()
        assert api.storage.view(job_id, 1, "recording.rrd").exists()


async def test_log_lines_say_what_they_are_about(capsys):
    before = logging.getLogger().handlers[:]
    try:
        configure_logs("json", "info")
        with log_context(request_id="r1"), log_context(job_id="j1"):
            logging.getLogger("x").info("GET /\nforged %s", "line")
        configure_logs("text", "info")
        with log_context(job_id="j2"):
            logging.getLogger("x").warning("two\nlines")
    finally:
        logging.getLogger().handlers[:] = before
    first, second = capsys.readouterr().err.splitlines()
    line = json.loads(first)
    assert (line["request_id"], line["job_id"], line["level"]) == ("r1", "j1", "info")
    assert "two\\nlines job_id=j2" in second


async def test_traces_go_to_the_collector(tmp_path):
    """In a process of its own, because a process has one tracer."""
    program = """
import http.server, threading, sys
from fingersplit_service.telemetry.tracing import span, tracing
got = []
class Collector(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        got.append(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(200); self.end_headers()
    def log_message(self, *arguments): pass
server = http.server.HTTPServer(("127.0.0.1", 0), Collector)
threading.Thread(target=server.serve_forever, daemon=True).start()
with tracing(f"http://127.0.0.1:{server.server_port}/v1/traces"):
    with span("job", job_id="j-17"):
        pass
assert b"j-17" in b"".join(got), got
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr


def test_the_doctor_finds_what_is_wrong(tmp_path, unused_port):
    healthy = examine(ServiceSettings(data_dir=tmp_path, port=unused_port, workers=1))
    assert [check for check in healthy if not check.fine] == []
    (tmp_path / "file").touch()
    sick = examine(ServiceSettings(data_dir=tmp_path / "file" / "below", host="0.0.0.0", workers=10_000))
    wrong = {check.what for check in sick if not check.fine}
    assert {"cores", "data directory"} <= wrong


async def test_running_jobs_end_when_the_stop_leaves_them_time(start, tmp_path):
    async with start(tmp_path, stop_grace_s=PATIENCE) as api:
        running = await api.queue(WAITS)
        await api.begun(running)
        queued = await api.queue(WAITS)

        async def let_go() -> None:
            await until(lambda: api.app.state.runtime.notifier.closed)
            api.go()

        letting_go = asyncio.create_task(let_go())
    await letting_go
    with api.tables() as database:
        found = [await JobStore(database).get("local", job_id) for job_id in (running, queued)]
    assert [row.state for row, _ in found] == ["succeeded", "queued"]
