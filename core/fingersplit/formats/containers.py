"""Kinds of files, before anyone asks which format they are: JSON, YAML, HDF5 and .npy, opened and written."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fingersplit.errors import FormatError
from fingersplit.extras import extra
from fingersplit.formats.pickled_npy import dump_npy, load_npy

__all__ = ["opened", "serialised"]

MAX_TEXT = 200_000_000
"""Bytes; a JSON, YAML or .npy file beyond is refused."""
UNKNOWN = "unknown"


@contextmanager
def opened(path: Path) -> Iterator[tuple[str, Any]]:
    """Kind of a file, a key of ``CONTAINERS`` or ``unknown``, and its content.

    JSON and YAML are parsed, .npy is an array or what was pickled in it, HDF5 is an open file.

    Raises:
        FormatError: The file cannot be read as what it seems to be.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(8)
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error.strerror}.") from error
    if head.startswith(b"\x89HDF"):
        with _hdf5(path) as file:
            yield "hdf5", file
        return
    if path.stat().st_size > MAX_TEXT:
        raise FormatError(f"{path} has {path.stat().st_size} bytes; allowed: {MAX_TEXT}.")
    yield _parsed(path, path.read_bytes())


def serialised(container: str, content: Any) -> bytes:
    """The content of a file as its bytes."""
    if container == "npy":
        return dump_npy(content)
    if container == "yaml":
        with extra("formats"):
            import yaml
        return str(yaml.safe_dump(content, sort_keys=False)).encode()
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


@contextmanager
def _hdf5(path: Path) -> Iterator[Any]:
    with extra("formats"):
        import h5py
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise FormatError(f"{path} is a damaged HDF5 file.") from error
    with file:
        yield file


def _parsed(path: Path, data: bytes) -> tuple[str, Any]:
    """By the first bytes and the ending; what opens like neither JSON nor YAML is unknown."""
    if data.startswith(b"\x93NUMPY"):
        return "npy", load_npy(data)
    text = data.removeprefix(b"\xef\xbb\xbf")
    suffix, start = path.suffix.lower(), text.lstrip()[:1]
    if suffix not in {".yaml", ".yml"} and (suffix == ".json" or start in (b"{", b"[")):
        return "json", _json(path, text)
    if suffix in {".yaml", ".yml"} or start == b"#" or b"\nformat:" in b"\n" + text[:100_000]:
        return "yaml", _yaml(path, text)
    try:
        return "json", json.loads(text)
    except (ValueError, RecursionError):
        return UNKNOWN, None


def _json(path: Path, text: bytes) -> Any:
    try:
        return json.loads(text)
    except UnicodeDecodeError as error:
        raise FormatError(f"{path} is not JSON: it is not text in UTF-8.") from error
    except json.JSONDecodeError as error:
        raise FormatError(f"{path} is not JSON: {_broken(error.lineno, error.colno)}") from error
    except RecursionError as error:
        raise FormatError(f"{path} is not JSON that can be read: it is nested too deeply.") from error


def _yaml(path: Path, text: bytes) -> Any:
    with extra("formats"):
        import yaml
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast where libyaml is there
    try:
        return yaml.load(text, loader)
    except RecursionError as error:
        raise FormatError(f"{path} is not YAML that can be read: it is nested too deeply.") from error
    except (yaml.YAMLError, ValueError) as error:
        if isinstance(error, yaml.constructor.ConstructorError):
            tag = f"{path} is not plain YAML: line {error.problem_mark.line + 1} asks for a type of a program."
            raise FormatError(tag) from error
        mark = getattr(error, "problem_mark", None)
        where = "it is not plain data in UTF-8." if mark is None else _broken(mark.line + 1, mark.column + 1)
        raise FormatError(f"{path} is not YAML: {where}") from error


def _broken(line: int, column: int) -> str:
    """Where a text stops being what it should be."""
    return f"it breaks off, or breaks the rules, in line {line} at column {column}."
