"""Uploaded files: kept under a name of our own while a worker reads them, and never read anywhere else."""

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import UploadFile

from fingersplit_service.storage import Storage

__all__ = ["PRINTABLE", "staged", "stem", "suffix"]

PRINTABLE = r"^[^\x00-\x1f\x7f]*$"
"""Names for people in forms."""
_MAX_SUFFIX = 16  # characters


def suffix(file: UploadFile) -> str | None:
    """The suffix of a file's name in lower case; None where it is not a few letters and digits."""
    found = Path(file.filename or "").suffix.lower()
    return found if len(found) <= _MAX_SUFFIX and found[1:].isascii() and found[1:].isalnum() else None


def stem(file: UploadFile) -> str:
    """What a file is called, for people."""
    return "".join(letter for letter in Path(file.filename or "object").stem if letter.isprintable())[:200]


@asynccontextmanager
async def staged(storage: Storage, file: UploadFile) -> AsyncIterator[Path]:
    """An uploaded file on disk for a while, with its own suffix if that is one."""
    path = storage.staged(suffix(file) or "")
    try:
        await asyncio.to_thread(_save, file, path)
        yield path
    finally:
        path.unlink(missing_ok=True)


def _save(file: UploadFile, path: Path) -> None:
    with path.open("wb") as target:
        shutil.copyfileobj(file.file, target, length=1 << 20)
