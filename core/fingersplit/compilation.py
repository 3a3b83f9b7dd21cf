"""How kernels are compiled: one decorator, and a cache that never serves code compiled from other sources.

Numba keys a cached kernel by its own file alone, so a kernel that calls into a changed file would keep running the old
code. Ours are kept in a folder named by the hash of their file and of every file of ours that it imports.
"""

import hashlib
import os
import re
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import config

__all__ = ["kernel", "kernel_cache_folder"]

Function = TypeVar("Function", bound=Callable[..., Any])

_ROOT = Path(__file__).parents[1]
_IMPORT = re.compile(rb"^from (fingersplit[\w.]*) import", re.MULTILINE)


def kernel(function: Function) -> Function:
    """Compile ``function`` with numba: cached on disk, without the GIL, divisions as NumPy does them."""
    previous, config.CACHE_DIR = config.CACHE_DIR, str(kernel_cache_folder(function.__module__))
    try:
        compiled: Function = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = previous
    return compiled


@cache
def kernel_cache_folder(module: str) -> Path:
    """Folder of the kernels of a module, as compiled from exactly these sources.

    Below ``NUMBA_CACHE_DIR`` when that is set, else below the user's cache folder, else the temporary folder.
    """
    digest = hashlib.sha256()
    for name in sorted(_with_imports(module)):
        digest.update(name.encode() + b"\0" + _source(name))
    name = f"kernels-{digest.hexdigest()[:16]}"
    if config.CACHE_DIR:
        return Path(config.CACHE_DIR) / name
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fingersplit"
    return (user_cache if _is_writable(user_cache) else Path(tempfile.gettempdir()) / "fingersplit") / name


def _with_imports(module: str) -> set[str]:
    """A module of ours and all that it imports, directly or not."""
    found, waiting = set[str](), [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [imported.decode() for imported in _IMPORT.findall(_source(name))]
    return found


@cache
def _source(module: str) -> bytes:
    path = _ROOT.joinpath(*module.split("."))
    file = path.with_suffix(".py")
    return (file if file.exists() else path / "__init__.py").read_bytes()


@cache
def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)
