"""Requests on their way: what is repeated, what is an error, against a server that follows a script."""

import hashlib
import json
import math
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any

import anyio
import httpx2
import pytest

from client_calls import done
from fingersplit_client import (
    ApiError,
    AsyncClient,
    AuthenticationError,
    Client,
    ConflictError,
    FingersplitClientError,
    InvalidRequestError,
    JobCreate,
    JobFailed,
    NotFoundError,
    ObjectInfo,
    OverloadedError,
    ParallelGraspsGenerate,
    RequestTimeout,
    Retries,
    ServiceUnreachable,
    WaitTimeout,
)
from fingersplit_client._exchange import Deadline, Policy, exchange
from fingersplit_client._flow import Pause, Send
from fingersplit_client.retries import retry_after
from job_documents import job_document, problem_document, summary_document
from scripted_server import Step, answers, cuts, cuts_midway, says_nothing, scripted_server, streams
from waiting_service import OBJECT

pytestmark = pytest.mark.anyio
AT_ONCE = Retries(pause=0.0)
BUSY = answers(problem_document(503), 503, Retry_After="0")


@pytest.fixture(params=["blocking", "awaited"])
def ask(request: pytest.FixtureRequest) -> Any:
    """Does one operation of a client at an address: ``await ask(url, lambda client: client.hands.list())``."""

    async def ask(url: str, operation: Any, **settings: Any) -> Any:
        settings = {"retries": AT_ONCE} | settings
        if request.param == "blocking":
            with Client(url, **settings) as client:
                return await anyio.to_thread.run_sync(operation, client)
        async with AsyncClient(url, **settings) as client:
            return await operation(client)

    return ask


@pytest.mark.parametrize("failure", [BUSY, answers(b"<html>", 502), cuts, cuts_midway])
async def test_what_passes_is_tried_again(ask: Any, failure: Step) -> None:
    with scripted_server(failure, failure, answers([])) as server:
        assert await ask(server.url, lambda client: client.hands.list()) == []
        assert len(server.requests) == 3
        assert len({request.headers["X-Request-ID"] for request in server.requests}) == 1


@pytest.mark.parametrize("failure", [BUSY, cuts])
async def test_a_job_is_queued_once_however_often_it_is_asked_for(ask: Any, failure: Step) -> None:
    with scripted_server(failure, failure, answers(job_document(), 202)) as server:
        job = await ask(server.url, lambda client: client.jobs.create(JobCreate(object_id="x")))
        assert job.id == "a/b"
        assert len({request.headers["Idempotency-Key"] for request in server.requests}) == 1
        assert len(server.requests) == 3


async def test_what_may_have_been_done_is_not_done_twice(ask: Any) -> None:
    """Each generation of parallel grasps makes a new set."""
    with scripted_server(cuts, answers({})) as server:
        with pytest.raises(ServiceUnreachable, match="disconnected"):
            await ask(server.url, lambda client: client.parallel_grasps.generate("x", ParallelGraspsGenerate()))
        assert len(server.requests) == 1


async def test_trying_again_has_an_end(ask: Any) -> None:
    with scripted_server(BUSY) as server:
        with pytest.raises(OverloadedError, match=r"It is so\. \(HTTP 503\)") as caught:
            await ask(server.url, lambda client: client.hands.list(), retries=Retries(attempts=3, pause=0.0))
        assert (len(server.requests), caught.value.retry_after) == (3, 0.0)
        assert caught.value.request_id == server.requests[0].headers["X-Request-ID"]
    with pytest.raises(ServiceUnreachable, match="No answer from"):
        await ask(server.url, lambda client: client.hands.list())


async def test_a_pause_that_is_too_long_is_not_waited_for(ask: Any) -> None:
    with scripted_server(answers(problem_document(429), 429, Retry_After="3600")) as server:
        with pytest.raises(OverloadedError) as caught:
            await ask(server.url, lambda client: client.hands.list())
        assert (len(server.requests), caught.value.retry_after) == (1, 3600.0)


async def test_a_server_that_says_nothing_is_not_waited_for_forever(ask: Any) -> None:
    with scripted_server(says_nothing) as server:
        with pytest.raises(RequestTimeout, match=r"within 0\.05 s") as caught:
            await ask(server.url, lambda client: client.hands.list(), timeout=0.05)
        assert caught.value.request_id == server.requests[0].headers["X-Request-ID"]
        assert isinstance(caught.value, TimeoutError | ServiceUnreachable)
        with pytest.raises(WaitTimeout, match=r"no answer about a job within 0\.05 s") as late:
            await ask(server.url, lambda client: client.plan(b"OFF", file_type="off", timeout=0.05, cancel=False))
        assert late.value.job is None


@pytest.mark.parametrize(
    ("status", "cause"),
    [
        (401, AuthenticationError),
        (403, AuthenticationError),
        (404, NotFoundError),
        (409, ConflictError),
        (413, InvalidRequestError),
        (422, InvalidRequestError),
        (429, OverloadedError),
        (500, ApiError),
    ],
)
async def test_each_cause_has_its_error(ask: Any, status: int, cause: type[ApiError]) -> None:
    document = problem_document(status, "Unknown hand 'claw'.", valid=["barrett"] if status == 422 else [])
    refuses = answers(document, status, X_Request_ID="seen")
    with scripted_server(refuses) as server, pytest.raises(ApiError, match="Unknown hand 'claw'") as caught:
        await ask(server.url, lambda client: client.hands.list(), retries=Retries(attempts=1))
    assert type(caught.value) is cause
    assert (caught.value.problem.status, caught.value.request_id) == (status, "seen")
    assert caught.value.advice == ("Valid: barrett." if status == 422 else cause.default_advice)


async def test_an_answer_of_something_between_is_an_error_of_its_status(ask: Any) -> None:
    with scripted_server(answers(b"<html>", 502)) as server, pytest.raises(OverloadedError, match="502") as caught:
        await ask(server.url, lambda client: client.jobs.get("a"), retries=Retries(attempts=1))
    assert caught.value.problem.status == 502


async def test_a_document_of_another_version_is_refused(ask: Any) -> None:
    other = answers(job_document(surprise=1))
    with scripted_server(other) as server, pytest.raises(FingersplitClientError, match="version"):
        await ask(server.url, lambda client: client.jobs.get("a"))


async def test_an_id_stays_one_part_of_the_path(ask: Any) -> None:
    with scripted_server(answers(job_document())) as server:
        await ask(server.url, lambda client: client.jobs.get("../../a?b"))
        assert server.requests[0].path == "/v1/jobs/..%2F..%2Fa%3Fb"


async def test_fields_stand_in_the_message(ask: Any) -> None:
    problem = problem_document(422, "Some fields are not valid.", errors=[{"field": "/starts", "detail": "Too small."}])
    message = r"not valid\. /starts: Too small\. \(HTTP 422\)"
    with scripted_server(answers(problem, 422)) as server, pytest.raises(InvalidRequestError, match=message):
        await ask(server.url, lambda client: client.hands.list())


async def test_bytes_that_the_service_knows_are_not_sent(ask: Any) -> None:
    known = answers(json.loads(ObjectInfo.model_validate(OBJECT).model_dump_json()))
    with scripted_server(known) as server:
        info = await ask(server.url, lambda client: client.objects.upload(b"OFF 1", file_type="off", mass=0.3))
        (lookup,) = server.requests
    assert info.id == OBJECT["id"]
    assert lookup.path == "/v1/objects/lookup"
    assert json.loads(lookup.body) == {"sha256": hashlib.sha256(b"OFF 1").hexdigest(), "mass": 0.3}


@pytest.mark.parametrize("refusal", [answers(problem_document(404), 404), answers(problem_document(405), 405)])
async def test_bytes_that_the_service_does_not_know_are_sent_once(ask: Any, refusal: Step) -> None:
    created = answers(json.loads(ObjectInfo.model_validate(OBJECT).model_dump_json()), 201)
    queued = answers(job_document(), 202)
    ended = answers(job_document("cancelled"))
    with scripted_server(refusal, created, queued, ended, queued, ended) as server:

        async def twice(client: Any) -> None:
            for _ in range(2):
                with pytest.raises(JobFailed):
                    await done(client.plan(b"OFF 2", file_type="off", unit="mm", viewpoint=[0, 0.5, 1]))

        await ask(server.url, lambda client: anyio.run(twice, client) if isinstance(client, Client) else twice(client))
        asked = [request.path for request in server.requests]
    assert asked == ["/v1/objects/lookup", "/v1/objects", *["/v1/jobs", "/v1/jobs/a%2Fb"] * 2]
    form = server.requests[1].body
    assert b"OFF 2" in form
    assert b'name="unit"\r\n\r\nmm' in form
    assert b'name="viewpoint"\r\n\r\n0.0,0.5,1.0' in form


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"starts": -3}, r"starts: It must be 1 or more\. It is -3\."),
        ({"strats": 3}, "no option 'strats'; did you mean 'starts'"),
        ({"mass": -1.0}, r"mass: It must be .* or more\. It is -1\.0\."),
        ({"mass": 1.0, "density": 500.0}, "mass or density, not both"),
        ({"unit": "km"}, r'unit: It must be .*\. It is "km"\.'),
        ({"viewpoint": (0.0, 1.0)}, "viewpoint"),
        ({"noise": {"positon": 0.01}}, r"noise\.positon: There is no such field\. Did you mean 'position'\?"),
    ],
)
async def test_what_is_not_valid_is_not_sent(ask: Any, unused_url: str, options: Any, message: str) -> None:
    with pytest.raises(InvalidRequestError, match=message) as caught:
        await ask(unused_url, lambda client: client.plan("no such file", **options))
    assert caught.value.request_id is None
    assert "HTTP" not in str(caught.value)


async def test_a_job_that_failed_says_why(ask: Any) -> None:
    failed = job_document("failed", error={"code": "worker_died", "detail": "Its worker died."})
    with scripted_server(answers(failed)) as server, pytest.raises(JobFailed, match="Its worker died") as caught:
        await ask(server.url, lambda client: client.jobs.wait("a/b"))
    assert (caught.value.job.state, caught.value.advice[:8]) == ("failed", "Simplify")
    with scripted_server(answers(job_document("cancelled"))) as server, pytest.raises(JobFailed, match="cancelled"):
        await ask(server.url, lambda client: client.jobs.wait("a/b"))


async def test_a_wait_uses_one_connection(ask: Any) -> None:
    going, ended = job_document("running"), job_document("failed")
    with scripted_server(*[answers(going, 202)] * 5, answers(ended)) as server:
        with pytest.raises(JobFailed):
            await ask(server.url, lambda client: client.jobs.wait("a/b"))
        assert (len(server.requests), server.connections) == (6, 1)
        assert all(request.headers["Prefer"].startswith("wait=") for request in server.requests)


async def test_a_timeout_is_told_as_it_was_given(ask: Any) -> None:
    with scripted_server(answers(job_document("running"), 202)) as server:
        with pytest.raises(WaitTimeout, match=r"a/b is still running after 0\.3 s") as caught:
            await ask(server.url, lambda client: client.jobs.wait("a/b", timeout=0.3))
        assert isinstance(caught.value, TimeoutError)
        assert caught.value.job is not None
        assert not [request for request in server.requests if request.path.endswith("/cancel")]


def event(number: int, state: str, progress: float = 0.0) -> bytes:
    document = json.dumps(summary_document(state, progress=progress))
    return f"id: {number}\nevent: {state}\ndata: {document}\n\n".encode()


async def test_events_that_break_off_are_taken_up_where_they_were(ask: Any) -> None:
    first = streams(event(1, "queued"), event(2, "running", 0.5), cut=True)
    rest = streams(b": still here\n\n", event(3, "running", 0.7), event(4, "failed"))
    seen: list[tuple[str, float]] = []
    steps = [answers(job_document()), first, BUSY, rest, answers(job_document("failed"))]
    with scripted_server(*steps) as server:
        with pytest.raises(JobFailed):
            await ask(
                server.url,
                lambda client: client.jobs.wait("a/b", on_progress=lambda job: seen.append((job.state, job.progress))),
            )
        assert [request.headers.get("Last-Event-ID") for request in server.requests] == [None, None, "2", "2", None]
    assert seen == [("queued", 0.0), ("running", 0.5), ("running", 0.7), ("failed", 0.0)]


def test_pauses_grow_at_random_up_to_a_bound() -> None:
    retries = Retries(pause=0.5, longest_pause=3.0)
    for attempt, bound in enumerate((0.5, 1.0, 2.0, 3.0, 3.0)):
        pauses = [retries.backoff(attempt) for _ in range(200)]
        assert 0.5 * bound < max(pauses) <= bound
        assert min(pauses) < 0.5 * bound


def test_pauses_are_never_shorter_than_the_service_asks_for() -> None:
    flow = exchange(Policy("http://x", 60.0, Retries(attempts=2, pause=0.5)), "GET", "/v1/hands")
    assert isinstance(next(flow), Send)
    pause = flow.send(httpx2.Response(429, headers={"Retry-After": "7"}))
    assert isinstance(pause, Pause)
    assert 7.0 <= pause.seconds <= 7.5


def test_no_pause_is_longer_than_the_deadline() -> None:
    policy = Policy("http://x", 60.0, Retries())
    flow = exchange(policy, "GET", "/v1/hands", deadline=Deadline(5.0))
    command = next(flow)
    assert isinstance(command, Send)
    assert command.timeout < 10.0
    with pytest.raises(OverloadedError):
        flow.send(httpx2.Response(429, headers={"Retry-After": "7"}, request=httpx2.Request("GET", "http://x")))


def test_retry_after_is_seconds_or_a_date() -> None:
    def asked(value: str) -> float | None:
        return retry_after(httpx2.Response(503, headers={"Retry-After": value}))

    assert (asked("12"), asked(""), asked("soon")) == (12.0, None, None)
    assert asked(format_datetime(datetime(2020, 1, 1, tzinfo=UTC), usegmt=True)) == 0.0
    later = asked(format_datetime(datetime.now(UTC) + timedelta(hours=1), usegmt=True))
    assert later is not None
    assert math.isclose(later, 3600.0, abs_tol=120.0)
