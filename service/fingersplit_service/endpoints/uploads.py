"""Uploaded files: kept under a name of our own while a worker reads them, and never read anywhere else."""

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from starlette.datastructures import UploadFile

from fingersplit_service.endpoints.forms import file_name
from fingersplit_service.storage import Storage

__all__ = ["PRINTABLE", "staged", "staged_bytes", "stem", "suffix"]

PRINTABLE = r"^[^\x00-\x1f\x7f]*$"
"""Names for people in forms."""
_MAX_SUFFIX = 16  # characters


def suffix(file: UploadFile) -> str | None:
    """The suffix of a file's name in lower case; None where it is not a few letters and digits."""
    found = Path(file_name(file)).suffix.lower()
    return found if len(found) <= _MAX_SUFFIX and found[1:].isascii() and found[1:].isalnum() else None


def stem(file: UploadFile) -> str:
    """What a file is called, for people."""
    return "".join(letter for letter in Path(file_name(file) or "object").stem if letter.isprintable())[:200]


@asynccontextmanager
async def staged(storage: Storage, file: UploadFile) -> AsyncIterator[Path]:
    """An uploaded file on disk for a while, with its own suffix if that is one."""
    path = storage.staged(suffix(file) or "")
    try:
        await asyncio.to_thread(_save, file, path)
        yield path
    finally:
        path.unlink(missing_ok=True)


@asynccontextmanager
async def staged_bytes(storage: Storage, content: bytes, ending: str) -> AsyncIterator[Path]:
    """A file's content on disk for a while."""
    path = storage.staged(ending)
    try:
        await asyncio.to_thread(path.write_bytes, content)
        yield path
    finally:
        path.unlink(missing_ok=True)


def _save(file: UploadFile, path: Path) -> None:
    with path.open("wb") as target:
        shutil.copyfileobj(file.file, target, length=1 << 20)
