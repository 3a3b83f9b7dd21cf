"""Where archives of hands are unpacked: a folder that goes with its process, however that ends."""

import fcntl
import os
import shutil
import tempfile
import time
from functools import cache
from pathlib import Path

__all__ = ["scratch_folder"]

_PREFIX, _LOCK = "fingersplit-hands-", "lock"
_SETTLED = 60.0  # after which a folder that nobody holds was left by a process that was killed [s]


def scratch_folder() -> Path:
    """The folder of this process, made at the first call; it is deleted when the process ends.

    A process that is killed leaves its folder, which the next one that needs a folder deletes: the kernel lets go of
    the lock in it.
    """
    return _held()[0]


@cache
def _held() -> tuple[Path, "tempfile.TemporaryDirectory[str]"]:
    _remove_abandoned()
    folder = tempfile.TemporaryDirectory(prefix=_PREFIX)
    lock = os.open(Path(folder.name) / _LOCK, os.O_CREAT | os.O_WRONLY)  # open, and held, until the process ends
    fcntl.flock(lock, fcntl.LOCK_EX)
    return Path(folder.name), folder


def _remove_abandoned() -> None:
    for lock in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*/{_LOCK}"):
        try:
            if time.time() - lock.stat().st_mtime < _SETTLED:
                continue
            with lock.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(lock.parent, ignore_errors=True)
        except OSError:  # in use, another user's, or deleted meanwhile
            continue
