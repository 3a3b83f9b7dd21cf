"""The client's middle, against canned answers."""

import httpx2
import pytest

from fingersplit_client import ApiError, Client, FingersplitClientError, Job, JobFailed

FAILED = {
    "id": "a/b",
    "object_id": "x",
    "object_name": "mug",
    "hand": "barrett",
    "state": "failed",
    "stage": None,
    "progress": 0.0,
    "priority": 0,
    "attempts": 2,
    "batch_id": None,
    "grasps": None,
    "feasible": None,
    "verified": None,
    "holding_margin": None,
    "created_at": "2026-01-01T00:00:00Z",
    "started_at": None,
    "finished_at": "2026-01-01T00:00:01Z",
    "request": {"object_id": "x"},
    "error": {"code": "worker_died", "detail": "Its worker died."},
    "warnings": [],
    "result": None,
}


def answering(response: httpx2.Response) -> Client:
    return Client(transport=httpx2.MockTransport(lambda request: response))


def test_a_failed_job_says_why() -> None:
    with (
        answering(httpx2.Response(200, json=FAILED)) as client,
        pytest.raises(JobFailed, match="Its worker died") as caught,
    ):
        client.wait(client.get_job("a/b"))
    assert caught.value.job == Job.model_validate(FAILED)


def test_a_cancelled_job_has_no_result() -> None:
    with (
        answering(httpx2.Response(200, json=FAILED | {"state": "cancelled", "error": None})) as client,
        pytest.raises(JobFailed, match="cancelled"),
    ):
        client.wait(client.get_job("a/b"))


def test_an_answer_of_something_between_is_an_api_error() -> None:
    response = httpx2.Response(502, text="<html>")
    with answering(response) as client, pytest.raises(ApiError, match="502") as caught:
        client.get_job("a")
    assert caught.value.problem.status == 502


def test_a_document_of_another_version_is_refused() -> None:
    with (
        answering(httpx2.Response(200, json=FAILED | {"surprise": 1})) as client,
        pytest.raises(FingersplitClientError, match="version"),
    ):
        client.get_job("a")


def test_an_id_stays_one_part_of_the_path() -> None:
    asked = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        asked.append(request.url.raw_path)
        return httpx2.Response(200, json=FAILED)

    with Client(transport=httpx2.MockTransport(answer)) as client:
        client.get_job("../../a?b")
    assert asked == [b"/v1/jobs/..%2F..%2Fa%3Fb"]


def test_fields_stand_in_the_message() -> None:
    problem = {
        "type": "urn:x",
        "title": "No",
        "status": 422,
        "detail": "Some fields are not valid.",
        "errors": [{"field": "/starts", "detail": "Too small."}],
    }
    with (
        answering(httpx2.Response(422, json=problem)) as client,
        pytest.raises(ApiError, match=r"not valid\. /starts: Too small\. \(HTTP 422\)"),
    ):
        client.hands()
