"""PLY: elements with named properties, binary or as text; vertices, polygons and strips are read."""

import itertools
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.numerals import read_floats
from fingersplit.objects.intake.ply_kernel import find_values
from fingersplit.objects.intake.polygons import Polygons
from fingersplit.objects.intake.refusals import (
    BLANKS,
    MAX_FACES,
    MAX_FACES_AS_TEXT,
    check_count,
    first_wrong,
    malformed,
    mismatch,
    not_a_number,
    truncated,
)

__all__ = ["has_faces", "parse_ply", "ply_vertices"]

_HEADER = re.compile(rb"ply[ \t]*\r?\n(.*?)\bend_header[ \t]*\r?\n", re.DOTALL)
_MAX_HEADER = 65_536  # bytes
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_WHOLE = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
}
_TYPES = _WHOLE | {"float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
_INDICES = ("vertex_indices", "vertex_index")
_NUMBERS = ("x", "y", "z", "nx", "ny", "nz")


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

    @property
    def indices(self) -> _Property | None:
        """The property that lists vertices."""
        lists = (each for each in self.properties if each.length_type is not None and each.type.kind in "iu")
        return next((each for each in lists if each.name in _INDICES), None)


@dataclass
class _Content:
    numbers: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    corners: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    sizes: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    lines: dict[str, NDArray[np.int64]] = field(default_factory=dict)


def has_faces(data: bytes) -> bool:
    """Whether a PLY file announces faces or strips; otherwise it is a point cloud.

    Raises:
        ObjectFileError: Another element than these lists vertices, so there are faces in a form that is not read.
    """
    if _HEADER.match(data[:_MAX_HEADER]) is None:
        return True  # as a mesh it is refused with the reason
    elements, _, _ = _read_header(data)
    for element in elements:
        if element.count and element.indices is not None and element.name not in ("face", "tristrips"):
            raise ObjectFileError(
                "unknown_faces",
                f"The PLY element {element.name!r} lists vertices: the file has faces in a form that is not read; "
                "export it with an element 'face'.",
            )
    return any(element.count for element in elements if element.name in ("face", "tristrips"))


def parse_ply(data: bytes) -> tuple[NDArray[np.float64], Polygons]:
    """Vertices (n, 3) and polygons; strips become the triangles they stand for."""
    content = _read(data)
    vertices = np.column_stack([content.numbers[name] for name in "xyz"])
    corners, sizes = (
        content.corners.get("face", np.empty(0, np.int64)),
        content.sizes.get("face", np.empty(0, np.int64)),
    )
    if "tristrips" not in content.corners:
        return vertices, Polygons(corners, sizes, content.lines.get("face"))
    strips = _triangles_of_strips(content.corners["tristrips"], content.sizes["tristrips"])
    check_count(len(strips), MAX_FACES)
    corners = np.concatenate([corners, strips.ravel()])
    return vertices, Polygons(corners, np.concatenate([sizes, np.full(len(strips), 3)]))


def ply_vertices(data: bytes) -> dict[str, NDArray[np.float64]]:
    """The vertices' columns x, y, z and, where the file has them, nx, ny, nz, each (n,)."""
    return _read(data).numbers


def _triangles_of_strips(corners: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles (n, 3) of strips, every second turned over; -1 within a strip begins another one."""
    begins = np.zeros(len(corners), bool)
    begins[np.cumsum(sizes)[:-1][np.cumsum(sizes)[:-1] < len(corners)]] = True
    breaks = corners < 0
    begins[1:] |= breaks[:-1]
    place = np.arange(len(corners))
    since = place - np.maximum.accumulate(np.where(begins, place, 0))
    last = np.flatnonzero((since >= 2) & ~breaks)
    triangles = np.column_stack([corners[last - 2], corners[last - 1], corners[last]])
    odd = since[last] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    return np.asarray(triangles[(triangles >= 0).all(axis=1)])


def _read(data: bytes) -> _Content:
    elements, encoding, body = _read_header(data)
    _check_names(elements)
    n_rows = sum(element.count for element in elements)
    if n_rows > len(body):
        raise truncated(_counts(elements[:3]), f"{len(body):,} bytes for them")
    check_count(sum(element.count for element in elements if element.name == "face"), MAX_FACES)
    if encoding != "ascii":
        return _read_binary(elements, body)
    check_count(n_rows, MAX_FACES_AS_TEXT, "rows")
    return _read_text(elements, body, data.count(b"\n", 0, len(data) - len(body)) + 1)


def _counts(elements: list[_Element]) -> str:
    return " and ".join(f"{element.count:,} {element.name} rows" for element in elements)


def _read_header(data: bytes) -> tuple[list[_Element], str, bytes]:
    """The elements that the header announces, the encoding, and what follows the header."""
    header = _HEADER.match(data[:_MAX_HEADER])
    if header is None:
        raise ObjectFileError("not_ply", "The file has no PLY header: lines from 'ply' to 'end_header'.")
    elements, encoding = list[_Element](), ""
    for line in header[1].decode("latin1").splitlines():
        order = _BYTE_ORDERS.get(encoding, "")
        match line.split():
            case ["format", name, "1.0"] if name in _BYTE_ORDERS and not order:
                encoding = name
            case ["element", name, count] if order and re.fullmatch("[0-9]{1,18}", count):
                elements.append(_Element(name, int(count), []))
            case ["property", item, name] if elements and item in _TYPES:
                elements[-1].properties.append(_Property(name, np.dtype(order + _TYPES[item]), None))
            case ["property", "list", length, item, name] if elements and length in _WHOLE and item in _TYPES:
                types = np.dtype(order + _TYPES[item]), np.dtype(order + _WHOLE[length])
                elements[-1].properties.append(_Property(name, *types))
            case [] | ["comment" | "obj_info", *_]:
                continue
            case _:
                raise malformed(f"The PLY header line {line[:80]!r} cannot be understood.")
    return elements, encoding, data[header.end() :]


def _check_names(elements: list[_Element]) -> None:
    names = {each.name: [item.name for item in each.properties] for each in elements}
    if len(names) < len(elements) or any(not each or len(set(each)) < len(each) for each in names.values()):
        raise malformed("The PLY header names an element or property twice, or an element without properties.")
    vertex = next((each for each in elements if each.name == "vertex"), None)
    numbers = [] if vertex is None else [item.name for item in vertex.properties if item.length_type is None]
    faces = [each for each in elements if each.name in ("face", "tristrips")]
    if not {"x", "y", "z"} <= set(numbers) or any(each.indices is None for each in faces):
        raise malformed("The PLY vertices need x, y and z, and the faces one list of numbers named 'vertex_indices'.")


def _read_binary(elements: list[_Element], body: bytes) -> _Content:
    content, at, octets = _Content(), 0, np.frombuffer(body, np.uint8)
    for element in elements:
        places, sizes, at = _places(element, octets, at)
        for k, item in enumerate(element.properties):
            if element.name == "vertex" and item.name in _NUMBERS and item.length_type is None:
                content.numbers[item.name] = _gathered(octets, places[:, k], item.type).astype(np.float64)
            elif item is element.indices and element.name in ("face", "tristrips"):
                starts = np.repeat(places[:, k], sizes[:, k])
                within = np.arange(len(starts)) - np.repeat(np.cumsum(sizes[:, k]) - sizes[:, k], sizes[:, k])
                values = _gathered(octets, starts + within * item.type.itemsize, item.type)
                content.corners[element.name], content.sizes[element.name] = values.astype(np.int64), sizes[:, k]
    if body[at:].strip(BLANKS):
        left = len(body) - at
        follow = "byte follows" if left == 1 else "bytes follow"
        raise mismatch(f"The PLY header counts {_counts(elements)}, but {left:,} {follow} the last of them.")
    return content


def _places(element: _Element, octets: NDArray[np.uint8], at: int) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Place of every property of every row (count, properties), its length, and the byte behind the last row."""
    widths = np.array([item.type.itemsize for item in element.properties], np.int64)
    lengths = np.array([item.length_type.itemsize if item.length_type else 0 for item in element.properties], np.int64)
    if not lengths.any():
        width = int(widths.sum())
        if at + element.count * width > len(octets):
            raise truncated(f"{element.count:,} {element.name} rows", f"{(len(octets) - at) // width:,} whole ones")
        rows = at + width * np.arange(element.count)[:, None]
        places = rows + np.concatenate([[0], np.cumsum(widths)[:-1]])
        return places, np.ones_like(places), at + element.count * width
    signed = np.array([item.length_type is not None and item.length_type.kind == "i" for item in element.properties])
    big = any(item.length_type is not None and item.length_type.str[0] == ">" for item in element.properties)
    places = np.zeros((element.count, len(widths)), np.int64)
    sizes = np.ones_like(places)
    end, done = find_values(octets, at, widths, lengths, signed, big, places, sizes)
    if done < element.count and end < 0:
        raise malformed(f"A list of the PLY element {element.name!r} says it has a negative number of items.")
    if done < element.count:
        raise truncated(f"{element.count:,} {element.name} rows", f"{done:,} whole ones")
    return places, sizes, int(end)


def _gathered(octets: NDArray[np.uint8], places: NDArray[np.int64], kind: np.dtype[Any]) -> NDArray[Any]:
    """Values of a type that begin at places (n,)."""
    return np.asarray(octets[places[:, None] + np.arange(kind.itemsize)].reshape(-1).view(kind))


def _read_text(elements: list[_Element], body: bytes, begin: int) -> _Content:
    """The rows as text, a line each, of which the first has the number ``begin``."""
    rows = [(begin + k, line.split()) for k, line in enumerate(body.splitlines()) if line.strip()]
    n_rows = sum(element.count for element in elements)
    if len(rows) < n_rows:
        raise truncated(f"{_counts(elements)}, a line each", f"{len(rows):,} lines")
    if len(rows) > n_rows:
        raise mismatch(f"The PLY header counts {n_rows:,} rows, but {len(rows):,} lines follow.")
    content, left = _Content(), iter(rows)
    for element in elements:
        columns: dict[str, list[float]] = {item.name: [] for item in element.properties if item.name in _NUMBERS}
        corners, sizes, lines = list[int](), list[int](), list[int]()
        for line, words in itertools.islice(left, element.count):
            for item, values in _row(element, words, line):
                if item.length_type is None and item.name in columns:
                    columns[item.name].append(values[0])
                elif item is element.indices:
                    corners += _indices(values, line)
                    sizes.append(len(values))
                    lines.append(line)
        if element.name == "vertex":
            content.numbers = {name: np.array(values) for name, values in columns.items()}
        elif element.name in ("face", "tristrips"):
            content.corners[element.name] = np.array(corners, np.int64)
            content.sizes[element.name] = np.array(sizes, np.int64)
            content.lines[element.name] = np.array(lines, np.int64)
    return content


def _indices(values: list[float], line: int) -> list[int]:
    """The numbers of a face's vertices."""
    wrong = next((value for value in values if not (value.is_integer() and abs(value) < 2**53)), None)
    if wrong is not None:
        raise malformed(f"The face on line {line} has the vertex {wrong:g}; vertices have whole numbers, from 0 on.")
    return list(map(int, values))


def _row(element: _Element, words: list[bytes], line: int) -> list[tuple[_Property, list[float]]]:
    """The values of each property on a line."""
    try:
        numbers = read_floats(words)
    except ValueError:
        raise not_a_number(first_wrong(words) or b"", f"Line {line}") from None
    values, at = list[tuple[_Property, list[float]]](), 0
    for item in element.properties:
        length = 1
        if item.length_type is not None and at < len(numbers):
            if not (0 <= numbers[at] < 1e9 and numbers[at].is_integer()):
                raise malformed(f"A list on line {line} says it has {numbers[at]:g} items.")
            length, at = int(numbers[at]), at + 1
        values.append((item, numbers[at : at + length]))
        at += length
    if at != len(words):
        raise malformed(f"Line {line}, of the PLY element {element.name!r}, has {len(words)} words, not {at}.")
    return values
