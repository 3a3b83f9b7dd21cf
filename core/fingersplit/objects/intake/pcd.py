"""PCD: the header's counts against the bytes that follow, in the ASCII, binary and compressed forms."""

import re
from typing import Any

import numpy as np

from fingersplit.errors import ObjectFileError
from fingersplit.numerals import read_floats
from fingersplit.objects.intake.refusals import MAX_FACES, check_count, malformed, mismatch, not_a_number, truncated

__all__ = ["check_pcd"]

_MAX_HEADER = 65_536  # bytes
_DATA = re.compile(rb"^DATA[ \t]+(ascii|binary|binary_compressed)[ \t]*\r?\n", re.MULTILINE)
_TYPES = {"F4", "F8", "I1", "I2", "I4", "I8", "U1", "U2", "U4", "U8"}
_KINDS = {"F": "f", "I": "i", "U": "u"}
_NUMBER = re.compile(rb"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf(inity)?)", re.IGNORECASE)
_WHOLE = re.compile(rb"[+-]?\d{1,20}")


def check_pcd(data: bytes) -> bytes:
    """Check a PCD file; the header is written anew, with what a parser needs and nothing else."""
    end = _DATA.search(data, 0, _MAX_HEADER)
    if end is None:
        raise ObjectFileError("not_pcd", "The file has no PCD header: lines from 'VERSION' or 'FIELDS' to 'DATA'.")
    header = _read_header(data[: end.start()].decode("latin1"))
    count = _number(header, "POINTS") if "POINTS" in header else _number(header, "WIDTH") * _number(header, "HEIGHT")
    dtype = _row_type(header)
    check_count(count, MAX_FACES, "points")
    form, body = end[1].decode(), data[end.end() :]
    if form == "ascii":
        body = _check_rows(body, count, [kind for name in dtype.names or () for kind in _kinds(dtype[name])])
    elif form == "binary":
        _check_length(count * dtype.itemsize, len(body), count)
    else:
        packed, unpacked = (int.from_bytes(body[at : at + 4], "little") for at in (0, 4))
        _check_length(8 + packed, len(body), count)
        if unpacked != count * dtype.itemsize:
            raise mismatch(
                f"The PCD header counts {count:,} points of {dtype.itemsize} bytes, but {unpacked:,} bytes are packed."
            )
    lines = ["VERSION 0.7", *(f"{name} {' '.join(header[name])}" for name in ("FIELDS", "SIZE", "TYPE", "COUNT"))]
    lines += [f"WIDTH {count}", "HEIGHT 1", f"VIEWPOINT {_viewpoint(header)}", f"POINTS {count}", f"DATA {form}\n"]
    return "\n".join(lines).encode() + body


def _read_header(text: str) -> dict[str, list[str]]:
    lines = (line.split() for line in text.splitlines() if line.strip() and not line.startswith("#"))
    header = {words[0]: words[1:] for words in lines}
    fields = header.get("FIELDS", header.get("COLUMNS", []))
    # A name may stand for padding or not be one; what is no position or normal is called by its place.
    known = {"x", "y", "z", "normal_x", "normal_y", "normal_z"}
    header["FIELDS"] = [name if name in known else f"other{place}" for place, name in enumerate(fields)]
    header.setdefault("COUNT", ["1"] * len(fields))
    if not {"x", "y", "z"} <= set(fields) or len(set(header["FIELDS"])) < len(fields):
        raise malformed(f"The PCD fields must have x, y and z, each once; they are {' '.join(fields)[:80]!r}.")
    if any(len(header.get(name, [])) != len(fields) for name in ("SIZE", "TYPE", "COUNT")):
        raise malformed(f"The PCD header must say SIZE, TYPE and COUNT for each of its {len(fields)} fields.")
    return header


def _row_type(header: dict[str, list[str]]) -> np.dtype[Any]:
    columns: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for name, size, kind, count in zip(*(header[key] for key in ("FIELDS", "SIZE", "TYPE", "COUNT")), strict=True):
        if kind + size not in _TYPES or not re.fullmatch("[1-9][0-9]{0,3}", count):
            raise malformed(f"The PCD field of TYPE {kind[:9]}, SIZE {size[:9]} and COUNT {count[:9]} is not known.")
        if name in "xyz" and (kind != "F" or count != "1"):
            raise malformed(f"The PCD coordinate {name} must be one floating-point number.")
        code = f"<{_KINDS[kind]}{size}"
        columns.append((name, code) if count == "1" else (name, code, (int(count),)))
    return np.dtype(columns)


def _number(header: dict[str, list[str]], name: str) -> int:
    words = header.get(name, [])
    if len(words) != 1 or not re.fullmatch("[0-9]{1,18}", words[0]):
        raise malformed(f"The PCD header must say {name} as a whole number, not {' '.join(words)[:80]!r}.")
    return int(words[0])


def _viewpoint(header: dict[str, list[str]]) -> str:
    words = header.get("VIEWPOINT", [])
    try:
        values = read_floats([word.encode() for word in words])
    except ValueError:
        values = []
    if words and (len(values) != 7 or not np.isfinite(values).all()):
        raise malformed("The PCD VIEWPOINT must be seven numbers: a position and a quaternion.")
    return " ".join(words) or "0 0 0 1 0 0 0"


def _kinds(column: np.dtype[Any]) -> str:
    """Kind of number, such as ``f``, of every word of a column."""
    return column.base.kind * int(np.prod(column.shape, dtype=np.int64))


def _check_rows(body: bytes, count: int, kinds: list[str]) -> bytes:
    """The rows of the ASCII form, words one blank apart."""
    rows = [line.split() for line in body.splitlines() if line.strip()]
    if len(rows) < count:
        raise truncated(f"{count:,} points, a line each", f"{len(rows):,} lines")
    if len(rows) > count:
        raise mismatch(f"The PCD header counts {count:,} points, but {len(rows):,} lines follow.")
    for number, row in enumerate(rows):
        if len(row) != len(kinds):
            raise malformed(f"Point {number} of the PCD file has {len(row)} words, not {len(kinds)}.")
        for word, kind in zip(row, kinds, strict=True):
            if not (_NUMBER if kind == "f" else _WHOLE).fullmatch(word):
                raise not_a_number(word, f"Point {number} of the PCD file", whole=kind != "f")
    return b"\n".join(map(b" ".join, rows)) + b"\n"


def _check_length(needed: int, present: int, count: int) -> None:
    if present < needed:
        raise truncated(f"{count:,} points in {needed:,} bytes", f"{present:,} bytes for them")
