"""What can go wrong when talking to the service; every error is a `FingersplitClientError`."""

from fingersplit_client.schemas import Job, Problem

__all__ = ["ApiError", "FingersplitClientError", "JobFailed", "ServiceUnreachable", "WaitTimeout"]


class FingersplitClientError(Exception):
    """Root of every error raised by the client on purpose."""


class ServiceUnreachable(FingersplitClientError):  # noqa: N818 -- names what happened
    """No answer came: nothing listens at the address, or the connection broke."""


class ApiError(FingersplitClientError):
    """The service refused a request.

    Attributes:
        problem: The problem document: `type`, `title`, `status`, `detail` and, where they apply, `code`,
            `errors`, `valid` and `limit`.
    """

    def __init__(self, problem: Problem) -> None:
        fields = "; ".join(f"{error.field}: {error.detail}" for error in problem.errors)
        super().__init__(f"{problem.detail} {fields}".rstrip() + f" (HTTP {problem.status})")
        self.problem = problem


class JobFailed(FingersplitClientError):  # noqa: N818 -- names what happened
    """A job ended without a result.

    Attributes:
        job: The job; its `error` says why.
    """

    def __init__(self, job: Job) -> None:
        reason = job.error.detail if job.error else f"It was {job.state}."
        super().__init__(f"Job {job.id} has no result. {reason}")
        self.job = job


class WaitTimeout(FingersplitClientError):  # noqa: N818 -- names what happened
    """A job was still going on when the time to wait for it was over; it goes on.

    Attributes:
        job: The job as last seen.
    """

    def __init__(self, job: Job, timeout: float) -> None:
        super().__init__(f"Job {job.id} is still {job.state} after {timeout:g} s.")
        self.job = job
