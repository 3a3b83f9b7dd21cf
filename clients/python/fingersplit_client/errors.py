"""What can go wrong when talking to the service: one exception for each cause, all below `FingersplitClientError`."""

from typing import ClassVar

from fingersplit_client.schemas import InvalidField, JobSummary, Problem

__all__ = [
    "ApiError",
    "AuthenticationError",
    "ConflictError",
    "FingersplitClientError",
    "InvalidRequestError",
    "JobFailed",
    "NotFoundError",
    "OverloadedError",
    "RequestTimeout",
    "ServiceUnreachable",
    "WaitTimeout",
    "invalid",
]


class FingersplitClientError(Exception):
    """Root of every error raised by the client on purpose.

    Attributes:
        advice: What to do about it, in a sentence; empty where the message says it.
        request_id: Id of the request in the service's log; None where no request was sent.
    """

    advice: str = ""
    request_id: str | None = None


class ServiceUnreachable(FingersplitClientError):  # noqa: N818 -- names what happened
    """No answer came: nothing listens at the address, or the connection broke."""

    advice = "Check the address, and that the service runs: `fingersplit serve`."

    def __init__(self, message: str, request_id: str | None = None) -> None:
        super().__init__(f"{message}. {self.advice}")
        self.request_id = request_id


class RequestTimeout(ServiceUnreachable, TimeoutError):  # noqa: N818 -- names what happened
    """The service took longer for an answer than the client's ``timeout``."""

    advice = "The service is slow or stuck; Client(timeout=...) waits longer."


class ApiError(FingersplitClientError):
    """The service refused a request; its subclasses name the cause.

    Attributes:
        problem: The problem document: `type`, `title`, `status`, `detail` and, where they apply, `code`,
            `errors`, `valid` and `limit`.
        retry_after: After how long the service wants to be asked again [s]; None where it does not say.
    """

    default_advice: ClassVar[str] = "The service's log says more under the request's id."

    def __init__(self, problem: Problem, request_id: str | None = None, retry_after: float | None = None) -> None:
        fields = "; ".join(
            f"{error.field}: {error.detail}" for error in problem.errors if error.detail != problem.detail
        )
        status = "" if request_id is None else f" (HTTP {problem.status})"  # nothing was sent where there is no id
        super().__init__(f"{problem.detail} {fields}".rstrip() + status)
        self.problem, self.request_id, self.retry_after = problem, request_id, retry_after
        self.advice = self.default_advice
        if problem.valid:
            self.advice = f"Valid: {', '.join(map(str, problem.valid))}."


class AuthenticationError(ApiError):
    """The key is missing or not valid (401), or it may not do this (403)."""

    default_advice = "Give Client(api_key=...) a key of this service that has the scope: `fingersplit keys create`."


class NotFoundError(ApiError):
    """There is no such object, job, grasp or address (404)."""

    default_advice = "It was deleted, belongs to another key, or its id is wrong; list what is there."


class ConflictError(ApiError):
    """It cannot be done as things stand (409): the job has not ended, or something else still needs it."""

    default_advice = "Wait for the job, or cancel what needs it."


class InvalidRequestError(ApiError):
    """The request is not valid (400, 405, 413, 415, 422), or would not be: what is checked here is not sent at all."""

    default_advice = "Change the fields that are named."


class OverloadedError(ApiError):
    """The service cannot take the request now (408, 429, 502, 503, 504), and could not in any attempt."""

    default_advice = "Try again later, with fewer requests at once, or with more Retries."


class JobFailed(FingersplitClientError):  # noqa: N818 -- names what happened
    """A job ended without a result.

    Attributes:
        job: The job; its `error` says why.
    """

    _ADVICE: ClassVar[dict[str, str]] = {
        "refused": "Change what was asked for.",
        "deadline_exceeded": "Ask for fewer starts or less verification, or give a longer deadline_s.",
        "out_of_memory": "Simplify the mesh, or ask for fewer starts.",
        "worker_died": "Simplify the mesh; the service's log says more.",
        "internal": "The service's log says more under the job's id.",
    }

    def __init__(self, job: JobSummary) -> None:
        reason = job.error.detail if job.error else f"It was {job.state}."
        super().__init__(f"Job {job.id} has no result. {reason}")
        self.job = job
        self.advice = self._ADVICE.get(job.error.code, "") if job.error else "Somebody cancelled it; queue it again."


class WaitTimeout(FingersplitClientError, TimeoutError):  # noqa: N818 -- names what happened
    """The time for a job was over before its result was there.

    Attributes:
        job: The job as last seen; None when the time was over before there was one.
    """

    def __init__(self, job: JobSummary | None, timeout: float, request_id: str | None = None) -> None:
        if job is None:
            text, advice = f"The service gave no answer about a job within {timeout:g} s", "Give a longer timeout."
        elif job.state == "cancelled":
            text, advice = f"Job {job.id} had not ended after {timeout:g} s and was cancelled", "Give a longer timeout."
        else:
            text = f"Job {job.id} is still {job.state} after {timeout:g} s"
            advice = f"It goes on; client.jobs.wait({job.id!r}) waits for it."
        super().__init__(f"{text}. {advice}")
        self.job, self.advice, self.request_id = job, advice, request_id


def invalid(detail: str, *fields: InvalidField) -> InvalidRequestError:
    """The error of a request that is not valid and was not sent."""
    problem = Problem(
        type="urn:fingersplit:problem:invalid-request",
        title="The request is not valid",
        status=422,
        detail=detail,
        errors=list(fields),
    )
    return InvalidRequestError(problem)
