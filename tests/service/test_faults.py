"""Workers and whole services die; what was accepted is finished all the same."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import anyio
import httpx2
import pytest
from conftest import PATIENCE, until
from fake_workers import DIES, DIES_ONCE, FINE, HANGS, HANGS_ONCE, WAITS, warm

from fingersplit_service.jobs.worker_pool import WorkerPool

SERVER = Path(__file__).with_name("serve_fakes.py")


def children(pid: int) -> list[int]:
    """Worker processes of a service."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            command = (folder / "cmdline").read_text()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if parent == pid and "spawn_main" in command:
            found.append(int(folder.name))
    return found


def alive(pid: int) -> bool:
    """Whether a process runs; one that ended and waits to be reaped does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_until(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    """Look again and again; fail when it does not come true in time."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not come true in time"
        time.sleep(0.02)


@contextmanager
def serving(data_dir: Path, port: int) -> Iterator[tuple[subprocess.Popen, httpx2.Client]]:
    """A service in a process of its own, ready; killed at the end."""
    process = subprocess.Popen([sys.executable, str(SERVER), str(data_dir), str(port)])
    with ExitStack() as stack:
        stack.callback(process.wait)
        stack.callback(process.kill)
        http = stack.enter_context(httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=PATIENCE))

        def ready() -> bool:
            assert process.poll() is None
            try:
                return http.get("/readyz").status_code == 200
            except httpx2.TransportError:
                return False

        wait_until(ready)
        yield process, http


@pytest.mark.anyio
async def test_a_job_whose_worker_is_killed_is_run_again(api):
    job_id = await api.queue(HANGS_ONCE)
    worker = await api.begun(job_id)
    os.kill(worker, signal.SIGKILL)

    assert (await api.ended(job_id))["state"] == "succeeded"
    assert await api.begun(job_id) != worker


@pytest.mark.anyio
async def test_a_job_that_kills_its_worker_once_succeeds_and_twice_fails(api):
    once, twice, after = await api.queue(DIES_ONCE), await api.queue(DIES), await api.queue(FINE)

    assert (await api.ended(once))["state"] == "succeeded"
    failed = await api.ended(twice)
    assert (failed["state"], failed["error"]["code"]) == ("failed", "worker_died")
    assert "2 times" in failed["error"]["detail"]
    assert (await api.ended(after))["state"] == "succeeded"


@pytest.mark.anyio
async def test_an_idle_worker_that_dies_is_replaced(api):
    job_id = await api.queue(FINE)
    await api.ended(job_id)
    worker = await api.begun(job_id)
    restarts = await api.metric("fingersplit_worker_restarts", "died")
    os.kill(worker, signal.SIGKILL)
    await api.until_metric(restarts + 1, "fingersplit_worker_restarts", "died")
    assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"
    assert (await api.http.get("/readyz")).json()["workers"] == 1
    assert not alive(worker)


@pytest.mark.anyio
async def test_a_worker_that_was_replaced_meanwhile_is_not_given_to_two():
    pool = WorkerPool(1, memory_bytes=2**32, recycle_bytes=2**30, warm=warm, warm_deadline_s=PATIENCE)
    pool.start()
    try:
        await until(lambda: pool.ready)
        async with pool.worker("me") as lease:
            lease.worker.kill()
            await until(lambda: pool.restarts["killed"] == 1)
            await until(lambda: pool.ready)
        async with pool.worker("me") as lease, anyio.create_task_group() as group:

            async def second() -> None:
                async with pool.worker("you") as other:
                    assert other.worker is lease.worker
                    assert pool.busy_workers == 1

            group.start_soon(second)
            await until(lambda: pool.waiting_answers == 1)
            assert await lease.worker.run(os.getpid, deadline_s=PATIENCE) in children(os.getpid())
            assert pool.waiting_answers == 1
            group.cancel_scope.cancel()
    finally:
        await pool.stop()


@pytest.mark.anyio
async def test_a_stopped_worker_is_replaced_and_its_job_runs_again(start, tmp_path):
    async with start(tmp_path, worker_silence_s=0.5) as api:
        job_id = await api.queue(HANGS_ONCE)
        worker = await api.begun(job_id)
        os.kill(worker, signal.SIGSTOP)
        job = await api.ended(job_id)
        assert (job["state"], job["attempts"]) == ("succeeded", 2)
        assert await api.metric("fingersplit_worker_restarts", "stopped") == 1


@pytest.mark.anyio
async def test_the_other_worker_goes_on(start, tmp_path):
    async with start(tmp_path, workers=2) as api:
        hanging, dying = await api.queue(HANGS), await api.queue(DIES)
        assert (await api.ended(dying))["state"] == "failed"
        assert (await api.job(hanging))["state"] == "running"
        assert (await api.ended(await api.queue(FINE)))["state"] == "succeeded"


@pytest.mark.anyio
async def test_a_stopped_service_leaves_its_running_jobs_queued(start, tmp_path):
    others = children(os.getpid())
    async with start(tmp_path) as api:
        running, queued = await api.queue(WAITS), await api.queue(FINE)
        await api.ended(running, ("running",))
    assert children(os.getpid()) == others

    (tmp_path / "go").touch()
    async with start(tmp_path) as api:
        for job_id in (running, queued):
            assert (await api.ended(job_id))["state"] == "succeeded"


def test_a_killed_service_takes_its_workers_with_it_and_finishes_its_jobs_later(tmp_path, unused_port, cube):
    with serving(tmp_path, unused_port) as (process, http):
        object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
        hows = [HANGS_ONCE, HANGS_ONCE, FINE]
        jobs = [http.post("/v1/jobs", json={"object_id": object_id, "hand": how}).json()["id"] for how in hows]
        wait_until(lambda: len(list(tmp_path.glob("*.begun"))) == 2)
        workers = children(process.pid)
        assert len(workers) >= 2  # and perhaps a spare one
        process.kill()
        process.wait()
        wait_until(lambda: not any(alive(worker) for worker in workers))

    with serving(tmp_path, unused_port) as (_, http):
        states = lambda: [http.get(f"/v1/jobs/{job}").json()["state"] for job in jobs]  # noqa: E731
        wait_until(lambda: states() == ["succeeded"] * 3)


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_service_told_to_stop_leaves_nothing_running(tmp_path, unused_port, cube, stop):
    with serving(tmp_path, unused_port) as (process, http):
        object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
        http.post("/v1/jobs", json={"object_id": object_id, "hand": HANGS})
        wait_until(lambda: len(list(tmp_path.glob("*.begun"))) == 1)
        workers = children(process.pid)
        process.send_signal(stop)
        assert process.wait(PATIENCE) == 0
        assert not any(alive(worker) for worker in workers)


@pytest.mark.anyio
async def test_one_data_directory_serves_one_service(start, tmp_path):
    async with start(tmp_path):
        with pytest.raises(Exception, match="Another service works on"):
            async with start(tmp_path):
                pass


@pytest.mark.campaign
def test_three_hundred_jobs_survive_random_kills(tmp_path, unused_port, cube):
    """Of workers all the time, of the whole service ten times."""
    chance, accepted = random.Random(1), dict[str, int]()
    for life in range(10):
        with serving(tmp_path, unused_port) as (process, http):
            object_id = http.post("/v1/objects", files={"file": ("c.off", cube)}, data={"unit": "cm"}).json()["id"]
            for number in range(30 * life, 30 * life + 30):
                body = {"object_id": object_id, "hand": FINE, "starts": number + 1}
                headers = {"Idempotency-Key": f"job-{number}"}
                job_id = http.post("/v1/jobs", json=body, headers=headers).json()["id"]
                assert accepted.setdefault(job_id, number) == number
                if chance.random() < 0.1:
                    time.sleep(chance.uniform(0, 0.3))
                    with suppress(ProcessLookupError):
                        os.kill(chance.choice(children(process.pid)), signal.SIGKILL)
            time.sleep(chance.uniform(0, 1))
            process.kill()
            process.wait()
    assert len(accepted) == 300
    with serving(tmp_path, unused_port) as (_, http):
        for job_id, number in accepted.items():
            job = http.get(f"/v1/jobs/{job_id}", headers={"Prefer": "wait=120"}).json()
            if job["state"] == "failed":  # two of our kills met this one
                assert (job["error"]["code"], job["attempts"] >= 2) == ("worker_died", True)
            else:
                assert (job["state"], job["result"]["starts"]) == ("succeeded", number + 1)
        assert len(http.get("/v1/jobs", params={"limit": 1000}).json()["items"]) == 300
