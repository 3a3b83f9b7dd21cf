"""Uploaded files, read by workers: one that a worker cannot digest is the client's fault, not ours."""

from collections.abc import Callable
from typing import Any, TypeVar

from fingersplit_service.jobs.errors import InvalidFile
from fingersplit_service.jobs.worker_pool import DeadlineExceeded, WorkerDied, WorkerPool

__all__ = ["read_file"]

Returned = TypeVar("Returned")


async def read_file(
    pool: WorkerPool,
    owner: str,
    deadline_s: float,
    function: Callable[..., Returned],
    *arguments: Any,
    object_id: str | None = None,
) -> Returned:
    """What a worker makes of a file.

    Raises:
        InvalidFile: The worker died of it, or was killed after ``deadline_s``.
        Exception: Whatever the function raises.
    """
    try:
        return await pool.answer(owner, function, *arguments, deadline_s=deadline_s, object_id=object_id)
    except DeadlineExceeded as error:
        detail = f"Checking the file took longer than {deadline_s:g} s; simplify it."
        raise InvalidFile(detail, code="too_complex") from error
    except (MemoryError, WorkerDied) as error:
        detail = "Checking the file took more memory than a worker may have; simplify it."
        raise InvalidFile(detail, code="too_complex") from error
