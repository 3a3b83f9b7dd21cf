"""PLY: the header's counts against the rows that follow, in the binary and in the ASCII form."""

import itertools
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake.header_checks import (
    MAX_FACES,
    MAX_FACES_AS_TEXT,
    check_count,
    malformed,
    mismatch,
    truncated,
)

__all__ = ["check_ply", "vertex_table"]

_HEADER = re.compile(rb"ply[ \t]*\r?\n(.*?)\bend_header[ \t]*\r?\n", re.DOTALL)
_MAX_HEADER = 65_536  # bytes
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_WHOLE = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
}
_TYPES = _WHOLE | {"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
_ELEMENTS = {"vertex", "face"}
_PROPERTIES = {"x", "y", "z", "vertex_index", "vertex_indices"}


@dataclass(frozen=True)
class _Property:
    name: str
    type: np.dtype[Any]
    length_type: np.dtype[Any] | None  # of a list


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


def check_ply(data: bytes) -> bytes:
    """Check a PLY file; what is no position or corner gets a name that no parser makes colours or lines of."""
    header = _HEADER.match(data[:_MAX_HEADER])
    if header is None:
        raise ObjectFileError("not_ply", "The file has no PLY header: lines from 'ply' to 'end_header'.")
    kept, elements = _read_header(header[1].decode("latin1"))
    _check_names(elements)
    body = data[header.end() :]
    n_rows = sum(element.count for element in elements)
    if n_rows > len(body):
        announced = " and ".join(f"{element.count:,} {element.name} rows" for element in elements[:3])
        raise truncated(announced, f"{len(body):,} bytes for them")
    check_count(sum(element.count for element in elements if element.name == "face"), MAX_FACES)
    if "ascii" not in kept[1] and not _rows_alike(elements, body):
        # Where polygons differ in their numbers of corners, trimesh reads the ASCII form only.
        if n_rows > MAX_FACES_AS_TEXT // 2:  # read twice
            raise mismatch(f"The PLY header counts {n_rows:,} rows, but rows like the first ones do not fill the file.")
        kept[1], body = "format ascii 1.0", _as_text(elements, body)
    if "ascii" in kept[1]:
        check_count(n_rows, MAX_FACES_AS_TEXT, "rows")
        body = _check_text(elements, body)
    return "\n".join([*kept, "end_header\n"]).encode() + body


def vertex_table(data: bytes) -> NDArray[Any]:
    """The vertices of a PLY file that `check_ply` let through, as records with all of their properties."""
    header = _HEADER.match(data[:_MAX_HEADER])
    assert header is not None
    text = header[1].decode("latin1")
    kept, elements = _read_header(text)
    if elements[0].name != "vertex" or any(item.length_type for item in elements[0].properties):
        raise malformed("The PLY file has something else before its vertices, or lists among them.")
    lines = (line.split() for line in text.splitlines())
    names = [words[-1] for words in lines if words[:1] == ["property"]][: len(elements[0].properties)]
    columns = np.dtype([(name, item.type) for name, item in zip(names, elements[0].properties, strict=True)])
    body, count = data[header.end() :], elements[0].count
    if "ascii" not in kept[1]:
        return np.frombuffer(body, columns, count)
    rows = [line for line in body.splitlines() if line.strip()][:count]
    return np.loadtxt(rows, [(name, np.float64) for name in names], ndmin=1, comments=None)


def _read_header(header: str) -> tuple[list[str], list[_Element]]:
    """The header's lines as they go on, the format second, and the elements that they announce."""
    kept, elements, order = ["ply"], list[_Element](), ""
    for line in header.splitlines():
        words, other = line.split(), f"other{len(kept)}"
        match words:
            case ["format", encoding, "1.0"] if encoding in _BYTE_ORDERS and not order:
                order = _BYTE_ORDERS[encoding]
            case ["element", name, count] if order and re.fullmatch("[0-9]{1,18}", count):
                words[1] = name if name in _ELEMENTS else other
                elements.append(_Element(words[1], int(count), []))
            case ["property", item, name] if elements and item in _TYPES:
                words[2] = name if name in _PROPERTIES else other
                elements[-1].properties.append(_Property(words[2], np.dtype(order + _TYPES[item]), None))
            case ["property", "list", length, item, name] if elements and length in _WHOLE and item in _TYPES:
                words[4] = name if name in _PROPERTIES else other
                types = np.dtype(order + _TYPES[item]), np.dtype(order + _WHOLE[length])
                elements[-1].properties.append(_Property(words[4], *types))
            case [] | ["comment" | "obj_info", *_]:
                continue
            case _:
                raise malformed(f"The PLY header line {line[:80]!r} cannot be understood.")
        kept.append(" ".join(words))
    return kept, elements


def _check_names(elements: list[_Element]) -> None:
    names = {each.name: [item.name for item in each.properties] for each in elements}
    if len(names) < len(elements) or any(not each or len(set(each)) < len(each) for each in names.values()):
        raise malformed("The PLY header names an element or property twice, or an element without properties.")
    face = [item for each in elements if each.name == "face" for item in each.properties]
    lists = [item for item in face if item.name in _PROPERTIES and item.length_type and item.type.kind in "iu"]
    if not {"x", "y", "z"} <= set(names.get("vertex", ())) or (face and len(lists) != 1):
        raise malformed("The PLY vertices need x, y and z, and the faces one list of numbers named 'vertex_indices'.")


def _rows_alike(elements: list[_Element], body: bytes) -> bool:
    """Whether the body is filled if all rows of each element are as long as the first, as trimesh takes them to be."""
    end = 0
    for element in elements:
        if element.count and end < len(body):
            end += element.count * (_read_row(element, 0, body, end)[1] - end)
    return end == len(body)


def _as_text(elements: list[_Element], body: bytes) -> bytes:
    lines, end = list[str](), 0
    for element in elements:
        for number in range(element.count):
            words, end = _read_row(element, number, body, end)
            lines.append(" ".join(map(repr, words)))
    if end < len(body):
        raise mismatch(f"The rows that the PLY header counts end {len(body) - end:,} bytes before the file does.")
    return "\n".join(lines).encode()


def _read_row(element: _Element, number: int, body: bytes, at: int) -> tuple[list[float], int]:
    """The numbers of a binary row that starts at a byte, lists after their lengths, and the byte behind it."""
    words = list[float]()
    try:
        for item in element.properties:
            n_items = 1
            if item.length_type is not None:
                n_items = int(np.frombuffer(body, item.length_type, 1, at)[0])
                words.append(n_items)
                at += item.length_type.itemsize
            if n_items < 0:
                raise malformed(f"A list of the PLY element {element.name!r} says it has {n_items} items.")
            if n_items:
                words += np.frombuffer(body, item.type, n_items, at).tolist()
            at += n_items * item.type.itemsize
    except ValueError as error:  # numpy was asked for more than there is
        raise truncated(f"{element.count:,} {element.name} rows", f"{number:,} whole ones") from error
    return words, at


def _check_text(elements: list[_Element], body: bytes) -> bytes:
    """Refuse a body that does not hold a line for each row, with as many words as the row's lists say."""
    lines = [line for line in body.splitlines() if line.strip()]
    n_rows = sum(element.count for element in elements)
    if len(lines) < n_rows:
        counts = " and ".join(f"{element.count:,} {element.name} rows" for element in elements)
        raise truncated(f"{counts}, a line each", f"{len(lines):,} lines")
    if len(lines) > n_rows:
        raise mismatch(f"The PLY header counts {n_rows:,} rows, but {len(lines):,} lines follow.")
    rows = iter(lines)
    for element in elements:
        for number, line in enumerate(itertools.islice(rows, element.count)):
            words, at = line.split(), 0
            for item in element.properties:
                is_list = item.length_type is not None and at < len(words)
                at += 1 + (int(words[at]) if is_list else 0)
            if at != len(words):
                raise malformed(f"Row {number} of the PLY element {element.name!r} has {len(words)} words, not {at}.")
    return b"\n".join(lines)
