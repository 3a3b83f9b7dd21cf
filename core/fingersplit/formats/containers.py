"""What a file is before anyone asks which grasps it holds: JSON, YAML, HDF5 or .npy."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from fingersplit.errors import ParallelGraspError

__all__ = ["opened"]

MAX_TEXT = 200_000_000
"""Bytes; a JSON, YAML or .npy file beyond is refused."""


@contextmanager
def opened(path: Path) -> Iterator[tuple[str, Any]]:
    """Kind of a file and its content: ``json`` parsed, ``yaml`` and ``npy`` as bytes, ``hdf5`` as an open file.

    Raises:
        ParallelGraspError: The file cannot be read as what it seems to be.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(8)
    except OSError as error:
        raise ParallelGraspError(f"{path} cannot be read: {error.strerror}.") from error
    if head.startswith(b"\x89HDF"):
        try:
            file = h5py.File(path, "r")
        except OSError as error:
            raise ParallelGraspError(f"{path} is a damaged HDF5 file: {error}.") from error
        with file:
            yield "hdf5", file
        return
    if path.stat().st_size > MAX_TEXT:
        raise ParallelGraspError(f"{path} has {path.stat().st_size} bytes; allowed: {MAX_TEXT}.")
    data = path.read_bytes()
    if head.startswith(b"\x93NUMPY"):
        yield "npy", data
    elif path.suffix.lower() in {".yaml", ".yml"} or data.lstrip().startswith(b"format:"):
        yield "yaml", data
    else:
        yield "json", _parsed(path, data)


def _parsed(path: Path, data: bytes) -> Any:
    try:
        return json.loads(data)
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ParallelGraspError(f"{path} is not JSON: {error}.") from error
