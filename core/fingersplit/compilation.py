"""How kernels are compiled: one decorator, and a cache that never serves code compiled from other sources.

Numba keys a cached kernel by its own file alone, so a kernel that calls into a changed file would keep running the old
code. Ours are kept in a folder named by the hash of every file that holds a kernel.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import config

__all__ = ["kernel", "kernel_cache_folder"]

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).parent


def kernel(function: Function) -> Function:
    """Compile ``function`` with numba: cached on disk, without the GIL, divisions as NumPy does them."""
    previous, config.CACHE_DIR = config.CACHE_DIR, str(kernel_cache_folder())
    try:
        compiled: Function = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = previous
    return compiled


@cache
def kernel_cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources.

    Below ``NUMBA_CACHE_DIR`` when that is set, else below the user's cache folder, else the temporary folder.
    """
    digest = hashlib.sha256()
    for source in sorted(_PACKAGE.rglob("*.py")):
        text = source.read_bytes()
        if b"@kernel" in text:
            digest.update(source.relative_to(_PACKAGE).as_posix().encode() + b"\0" + text)
    name = f"kernels-{digest.hexdigest()[:16]}"
    if config.CACHE_DIR:
        return Path(config.CACHE_DIR) / name
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fingersplit"
    return (user_cache if _is_writable(user_cache) else Path(tempfile.gettempdir()) / "fingersplit") / name


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)
