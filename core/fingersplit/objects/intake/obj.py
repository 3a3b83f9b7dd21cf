"""OBJ: vertices and polygons as lines of text."""

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.numerals import read_floats, read_integers
from fingersplit.objects.intake.polygons import Polygons
from fingersplit.objects.intake.refusals import (
    MAX_FACES_AS_TEXT,
    check_count,
    first_wrong,
    malformed,
    not_a_number,
)

__all__ = ["parse_obj"]

_COMMENT = re.compile(rb"#.*")
_OF_TEXTURES = re.compile(rb"/\S*")
"""Indices of textures and normals, behind those of vertices."""

_KEYWORDS = (b"v", b"f", b"fo")
"""Vertices and faces, which old versions of the format call 'fo', too."""


def parse_obj(data: bytes) -> tuple[NDArray[np.float64], Polygons]:
    """Vertices (n, 3) and polygons; relative indices, which count back from their line, become absolute."""
    check_count(data.count(b"\nf "), MAX_FACES_AS_TEXT)
    n_vertices = len(re.findall(rb"^[ \t]*v[ \t]", data, re.MULTILINE))
    check_count(n_vertices, MAX_FACES_AS_TEXT, "vertices")
    points, corners, sizes, lines = list[float](), list[int](), list[int](), list[int]()
    for number, words in _lines(data):
        if words[0] == b"v":
            points += _coordinates(words[1:], number)
        else:
            vertices = _OF_TEXTURES.sub(b"", b" ".join(words[1:])).split()
            polygon = _polygon(vertices, number, len(points) // 3, n_vertices)
            corners += polygon
            sizes.append(len(polygon))
            lines.append(number)
    if not points and not sizes:
        raise ObjectFileError("not_obj", "The file has neither 'v' nor 'f' lines, so it is no OBJ mesh.")
    polygons = Polygons(np.array(corners, np.int64), np.array(sizes, np.int64), np.array(lines, np.int64))
    return np.array(points).reshape(-1, 3), polygons


def _lines(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Number and words of every line with a vertex or a face; a line that ends in a backslash goes on in the next."""
    parts = list[bytes]()
    for number, line in enumerate(data.splitlines(), 1):
        parts.append(line.removesuffix(b"\\"))
        if line.endswith(b"\\"):
            continue
        words = _COMMENT.sub(b"", b" ".join(parts)).split()
        if words and words[0] in _KEYWORDS:
            yield number - len(parts) + 1, words
        parts = []


def _coordinates(words: list[bytes], line: int) -> list[float]:
    where = f"The vertex on line {line}"
    try:
        if len(words) > 2:
            return read_floats(words[:3])
    except ValueError:
        pass
    wrong = first_wrong(words[:3])
    if wrong is not None:
        raise not_a_number(wrong, where)
    raise malformed(f"{where} has {len(words)} {'coordinate' if len(words) == 1 else 'coordinates'} instead of 3.")


def _polygon(words: list[bytes], line: int, n_above: int, n_vertices: int) -> list[int]:
    """Indices counted from 0, out of OBJ's: from 1, or from -1 backwards through the vertices above the line."""
    if len(words) < 3:
        raise malformed(f"The face on line {line} has {len(words)} corners instead of 3 or more.")
    try:
        corners = read_integers(words)
    except ValueError:
        text = (first_wrong(words, read_integers) or b"").decode(errors="backslashreplace")[:30]
        raise malformed(f"The face on line {line} has {text!r} where whole numbers belong.") from None
    for corner in corners:
        if not (0 < corner <= n_vertices or -n_above <= corner < 0):
            raise ObjectFileError(
                "index_out_of_range",
                f"The face on line {line} names vertex {corner!s:.30}, but the file has {n_vertices:,} vertices, "
                f"{n_above:,} of them above that line; OBJ counts from 1, or from -1 backwards.",
            )
    return [corner - 1 if corner > 0 else n_above + corner for corner in corners]
