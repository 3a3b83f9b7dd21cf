"""Uploaded files: kept under a name of our own while a worker reads them, and never read anywhere else."""

import asyncio
import shutil
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

from fastapi import UploadFile

from fingersplit_service.jobs.engine import DeadlineExceeded, WorkerDied
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime

__all__ = ["PRINTABLE", "read_by_worker", "staged", "stem", "suffix"]

PRINTABLE = r"^[^\x00-\x1f\x7f]*$"
"""Names for people in forms."""

Returned = TypeVar("Returned")


def suffix(file: UploadFile) -> str | None:
    """The suffix of a file's name in lower case; None where it is not of letters and digits."""
    found = Path(file.filename or "").suffix.lower()
    return found if found[1:].isascii() and found[1:].isalnum() else None


def stem(file: UploadFile) -> str:
    """What a file is called, for people."""
    return "".join(letter for letter in Path(file.filename or "object").stem if letter.isprintable())[:200]


@asynccontextmanager
async def staged(runtime: Runtime, file: UploadFile) -> AsyncIterator[Path]:
    """An uploaded file on disk for a while, with its own suffix if that is one."""
    path = runtime.storage.staged(suffix(file) or "")
    try:
        await asyncio.to_thread(_save, file, path)
        yield path
    finally:
        path.unlink(missing_ok=True)


async def read_by_worker(
    runtime: Runtime,
    kind: ProblemKind,
    function: Callable[..., Returned],
    *arguments: Any,
    object_id: str | None = None,
) -> Returned:
    """What a worker makes of a file; one that it cannot digest is the sender's fault, not ours.

    Args:
        runtime: The service.
        kind: The problem of a file that takes too much time or memory.
        function: What the worker runs, with the data directory first.
        arguments: What else it is given.
        object_id: The object that it needs, if it needs one.
    """
    deadline = runtime.settings.inspection_deadline_s
    try:
        return await runtime.engine.answer(
            function, runtime.storage, *arguments, deadline_s=deadline, object_id=object_id
        )
    except DeadlineExceeded as error:
        detail = f"Checking the file took longer than {deadline:g} s; simplify it."
        raise ProblemError(kind, detail, field="/file", code="too_complex") from error
    except (MemoryError, WorkerDied) as error:
        detail = "Checking the file took more memory than a worker may have; simplify it."
        raise ProblemError(kind, detail, field="/file", code="too_complex") from error


def _save(file: UploadFile, path: Path) -> None:
    with path.open("wb") as target:
        shutil.copyfileobj(file.file, target, length=1 << 20)
