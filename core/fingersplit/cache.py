"""Arrays kept on disk by a name that stands for their content: prepared once, memory-mapped by every process.

Entries are files of one folder. A reader holds a shared lock on the file that it has mapped, for as long as any of its
arrays lives, and eviction takes only files that it can lock alone. Builders of one key wait for each other.
"""

import ast
import fcntl
import json
import mmap
import os
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import CacheError

__all__ = ["ContentCache"]

_MAGIC = b"FSARR001"  # eight bytes, then two little-endian words: length and CRC-32 of the table, which is JSON
_HEADER = len(_MAGIC) + 8
_ALIGNMENT = 64  # bytes, of every array
_KEY = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,199}")
_ENTRY, _PARTIAL, _LOCK = ".arrays", ".partial", ".lock"

Arrays = dict[str, NDArray[Any]]


class ContentCache:
    """Named groups of arrays in a folder that processes and threads may share.

    What an entry holds is compared with its checksum whenever it is opened; a damaged, truncated or foreign file is
    built anew. A folder that cannot be written costs speed only.
    """

    def __init__(self, folder: Path, limit_bytes: int) -> None:
        """Use a folder, which is made if there is none.

        Args:
            folder: Where the entries are.
            limit_bytes: Most that all entries may take; beyond it the least recently used ones go, except those that
                somebody still reads.

        Raises:
            CacheError: ``limit_bytes`` is below 1, or the folder cannot be made.
        """
        if limit_bytes < 1:
            raise CacheError(f"limit_bytes is {limit_bytes}; it must be at least 1.")
        self.folder, self.limit_bytes = folder, limit_bytes
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CacheError(f"The cache folder {str(folder)!r} cannot be made: {error.strerror}.") from error

    def entry(self, key: str) -> Path:
        """The file of a key, which holds a checksum: it can be copied to and from other machines."""
        return self.folder / (key + _ENTRY)

    def fetch(self, key: str, build: Callable[[], Arrays]) -> Arrays:
        """The arrays of a key, built if they are not there.

        Args:
            key: Name of the content, such as a hash: letters, digits, ``.``, ``_`` and ``-``, 200 at most. What one key
                stands for never changes.
            build: Makes the arrays, by name; runs once even if several processes ask at the same time. It may fetch
                other keys, but not this one.

        Returns:
            Read-only arrays, memory-mapped where the folder could be written.

        Raises:
            CacheError: The key is not a valid name, or an array holds Python objects.
        """
        if not _KEY.fullmatch(key):
            raise CacheError(
                f"Cache key {key!r} must be 1 to 200 letters, digits, '.', '_' or '-', with no leading '.'."
            )
        found = self._open(key)
        if found is not None:
            return found
        with self._alone(key):
            found = self._open(key)
            if found is not None:  # somebody else was first
                return found
            arrays = {name: np.asarray(array, order="C") for name, array in build().items()}
            objects = [name for name, array in arrays.items() if array.dtype.hasobject]
            if objects:
                raise CacheError(f"Array {objects[0]!r} holds Python objects; only numbers and text can be kept.")
            try:
                stored = self._store(key, arrays)
            except OSError:  # no room, or no permission: what was built is good all the same
                for array in arrays.values():
                    array.setflags(write=False)
                return arrays
        self._evict()
        return stored

    def _open(self, key: str) -> Arrays | None:
        """Map the entry of a key; None where there is none that can be trusted."""
        path = self.entry(key)
        try:
            with path.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_SH)
                arrays = _map(file)
        except (OSError, ValueError):
            return None
        with suppress(OSError):
            os.utime(path)  # the time of last use, which eviction goes by
        return arrays

    def _store(self, key: str, arrays: Arrays) -> Arrays:
        """Write an entry, which appears whole or not at all, and map it."""
        partial = self.folder / (key + _PARTIAL)
        with partial.open("w+b") as file:
            fcntl.flock(file, fcntl.LOCK_SH)  # as a reader's, so that it is not evicted before it was ever read
            try:
                _write(file, arrays)
            except OSError:
                partial.unlink(missing_ok=True)
                raise
            partial.replace(self.entry(key))
            return _map(file)

    @contextmanager
    def _alone(self, key: str) -> Iterator[None]:
        """Keep other builders of a key out; the lock's file goes with the last of them."""
        path = self.folder / (key + _LOCK)
        while True:
            try:
                file = path.open("wb")
            except OSError:  # a folder that cannot be written has nothing to protect
                yield
                return
            with file:
                fcntl.flock(file, fcntl.LOCK_EX)
                if not _is_at(path, file):  # its last holder removed it while we waited
                    continue
                try:
                    yield
                finally:
                    path.unlink(missing_ok=True)
                return

    def _evict(self) -> None:
        """Remove the least recently used entries, and what crashed writers left, until the rest is within the limit."""
        entries = []
        for path in self.folder.iterdir():
            if path.suffix in (_ENTRY, _PARTIAL):
                with suppress(OSError):  # gone already
                    status = path.stat()
                    entries.append((status.st_mtime_ns, status.st_size, path))
        total = sum(size for _, size, _ in entries)
        for _, size, path in sorted(entries):
            if total <= self.limit_bytes:
                return
            with suppress(OSError), path.open("rb") as file:  # OSError also where somebody reads or writes it
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if _is_at(path, file):
                    path.unlink()
                total -= size


def _is_at(path: Path, file: IO[bytes]) -> bool:
    """Whether the path still leads to the open file."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False


def _write(file: IO[bytes], arrays: Arrays) -> None:
    table, offset, written = dict[str, Any](), 0, dict[int, str]()
    for name, array in arrays.items():
        if id(array) in written:  # one array under several names is kept once
            table[name] = table[written[id(array)]]
            continue
        written[id(array)] = name
        offset = _aligned(offset)
        descriptor = repr(np.lib.format.dtype_to_descr(array.dtype))  # records too, as in an .npy file
        table[name] = {"dtype": descriptor, "shape": array.shape, "offset": offset, "crc": zlib.crc32(_bytes(array))}
        offset += array.nbytes
    text = json.dumps({"arrays": table, "length": offset}).encode()
    file.write(_MAGIC + len(text).to_bytes(4, "little") + zlib.crc32(text).to_bytes(4, "little") + text)
    start = _aligned(_HEADER + len(text))
    for name in written.values():
        file.seek(start + table[name]["offset"])
        file.write(_bytes(arrays[name]))
    file.truncate(start + offset)
    file.flush()


def _map(file: IO[bytes]) -> Arrays:
    """The arrays of a file, compared with their checksums; ValueError where they differ.

    The mapping holds a duplicate of the file's descriptor and with it the lock, until the last array is gone.
    """
    mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    length, checksum = int.from_bytes(mapped[8:12], "little"), int.from_bytes(mapped[12:16], "little")
    text = mapped[_HEADER : _HEADER + length]
    if mapped[:8] != _MAGIC or len(text) != length or zlib.crc32(text) != checksum:
        raise ValueError("not a cache entry")
    header, start, arrays = json.loads(text), _aligned(_HEADER + length), dict[str, NDArray[Any]]()
    read = dict[tuple[int, str, tuple[int, ...]], NDArray[Any]]()
    if len(mapped) != start + header["length"]:
        raise ValueError("cut off")
    for name, entry in header["arrays"].items():
        dtype, shape = np.lib.format.descr_to_dtype(ast.literal_eval(entry["dtype"])), tuple(entry["shape"])
        place = entry["offset"], entry["dtype"], shape
        if place in read:
            arrays[name] = read[place]
            continue
        count = int(np.prod(shape, dtype=np.int64))
        array = np.frombuffer(mapped, dtype, count, start + entry["offset"]) if count else np.empty(0, dtype)
        array.setflags(write=False)
        if zlib.crc32(_bytes(array)) != entry["crc"]:
            raise ValueError("damaged")
        arrays[name] = read[place] = array.reshape(shape)
    return arrays


def _bytes(array: NDArray[Any]) -> memoryview:
    return array.reshape(-1).view(np.uint8).data if array.size else memoryview(b"")


def _aligned(offset: int) -> int:
    return -(-offset // _ALIGNMENT) * _ALIGNMENT
