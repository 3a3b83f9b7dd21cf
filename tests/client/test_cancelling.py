"""Jobs that nobody waits for any more are cancelled: after Ctrl-C, when the task is cancelled, at the timeout."""

import asyncio
import signal
import subprocess
import sys
import threading
from typing import Any

import anyio
import pytest

from client_calls import done
from fingersplit_client import AsyncClient, Client, JobCreate, PlanResult, WaitTimeout
from job_documents import job_document
from scripted_server import answers, says_nothing, scripted_server
from waiting_service import WaitingService

pytestmark = pytest.mark.anyio


@pytest.fixture(params=[Client, AsyncClient])
def kind(request: pytest.FixtureRequest) -> Any:
    return request.param


async def test_a_job_is_cancelled_at_the_timeout(kind: Any) -> None:
    service = WaitingService()
    with scripted_server(service) as server:
        client = kind(server.url)
        with pytest.raises(WaitTimeout, match=r"job0 had not ended after 0\.2 s and was cancelled") as caught:
            await done(client.plan(b"OFF", file_type="off", timeout=0.2))
        await done(client.close())
    assert service.states == {"job0": "cancelled"}
    assert caught.value.job is not None
    assert caught.value.job.state == "cancelled"


async def test_a_job_goes_on_where_that_is_wanted(kind: Any) -> None:
    service = WaitingService()
    with scripted_server(service) as server:
        client = kind(server.url)
        with pytest.raises(WaitTimeout, match=r"job0 is still queued after 0\.2 s"):
            await done(client.plan(b"OFF", file_type="off", timeout=0.2, cancel=False))
        with pytest.raises(WaitTimeout, match="still queued"):
            await done(client.jobs.wait("job0", timeout=0.05))
        assert service.states == {"job0": "queued"}
        with pytest.raises(WaitTimeout, match="was cancelled"):
            await done(client.jobs.wait("job0", timeout=0.05, cancel=True))
        await done(client.close())
    assert service.states == {"job0": "cancelled"}


async def test_a_job_that_ends_while_it_is_cancelled_is_a_result(kind: Any) -> None:
    service = WaitingService()
    cancelled = service.set

    with scripted_server(service) as server:
        client = kind(server.url)
        service.set = lambda job_id, _state: cancelled(job_id, "succeeded")  # type: ignore[method-assign]
        result = await done(client.plan(b"OFF", file_type="off", timeout=0.2))
        await done(client.close())
    assert isinstance(result, PlanResult)
    assert result.job_id == "job0"


async def test_a_job_is_cancelled_with_the_task_that_waits_for_it() -> None:
    service = WaitingService()
    with scripted_server(service) as server:
        async with AsyncClient(server.url) as client:
            task = asyncio.create_task(client.jobs.wait("job0", cancel=True))
            await client.jobs.create(JobCreate(object_id="x"))
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

            plan = asyncio.create_task(client.plan(b"OFF", file_type="off", on_progress=None))
            await anyio.to_thread.run_sync(_arrivals, server, "/v1/jobs", 2)
            plan.cancel()
            with pytest.raises(asyncio.CancelledError):
                await plan
            assert service.states["job1"] == "cancelled"

            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.2):
                    await client.plan(b"OFF", file_type="off")
            assert service.states["job2"] == "cancelled"


async def test_a_job_whose_answer_never_came_is_found_by_its_key_and_cancelled() -> None:
    steps = [answers({}, 405), answers({}, 404), says_nothing, answers(job_document(), 202)]
    steps.append(answers(job_document("cancelled")))
    with scripted_server(*steps[2:]) as server:
        async with AsyncClient(server.url) as client:
            uploaded = _uploaded()
            task = asyncio.create_task(client.plan(uploaded))
            await anyio.to_thread.run_sync(server.arrived.acquire)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
        lost, again, cancel = server.requests
    assert lost.headers["Idempotency-Key"] == again.headers["Idempotency-Key"]
    assert (again.method, cancel.path) == ("POST", "/v1/jobs/a%2Fb/cancel")


CALL = """
import signal
import sys
from fingersplit_client import Client
signal.signal(signal.SIGINT, signal.default_int_handler)  # the tests may run in the background, where it is ignored
with Client(sys.argv[1]) as client:
    print("begins", flush=True)
    {call}
"""


@pytest.mark.parametrize(
    "call",
    [
        "client.plan(b'OFF', file_type='off')",
        "list(client.plan_many([sys.argv[2]] * 3, at_once=2, seed=1))",
    ],
)
def test_ctrl_c_cancels_what_is_under_way(call: str, tmp_path: Any) -> None:
    mesh = tmp_path / "a.off"
    mesh.write_bytes(b"OFF")
    service = WaitingService()
    with scripted_server(service) as server:
        command = [sys.executable, "-c", CALL.format(call=call), server.url, str(mesh)]
        with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL) as process:
            jobs = 2 if "many" in call else 1
            _arrivals(server, "/v1/jobs", jobs)
            if jobs == 2:
                for _ in range(jobs):
                    assert service.waited_for.acquire(timeout=120)
            process.send_signal(signal.SIGINT)
            try:
                _, told = process.communicate(timeout=120)
            finally:
                process.kill()
    assert b"KeyboardInterrupt" in told
    assert service.states == {f"job{number}": "cancelled" for number in range(jobs)}


def _arrivals(server: Any, path: str, count: int) -> None:
    """Wait until so many requests for a path have come."""
    while sum(request.path == path for request in server.requests) < count:
        assert server.arrived.acquire(timeout=120), "the request did not come"


def _uploaded() -> Any:
    from fingersplit_client import ObjectInfo
    from waiting_service import OBJECT

    return ObjectInfo.model_validate(OBJECT)


def test_threads_end_with_their_jobs() -> None:
    assert not [thread for thread in threading.enumerate() if "_drive" in thread.name]
