"""STL: triangles with three points each, binary or as text."""

import re

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.numerals import read_floats
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

__all__ = ["parse_stl"]

_HEADER = 84  # bytes; the last four are the number of triangles
_FACET = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("attribute", "<u2")])
_CONTROL_CHARACTERS = bytes(set(range(32)) - set(b"\t\n\v\f\r"))
_VERTEX = re.compile(rb"^[ \t]*vertex[ \t]+([^\r\n]*)", re.MULTILINE)


def parse_stl(data: bytes) -> tuple[NDArray[np.float64], Polygons]:
    """Vertices (n, 3) and triangles; a binary file is known by its length, since it may start with ``solid``."""
    announced = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    present, end = (len(data) - _HEADER) // _FACET.itemsize, _HEADER + announced * _FACET.itemsize
    is_text = len(data[:1024].translate(None, _CONTROL_CHARACTERS)) == len(data[:1024])
    if len(data) == end or (announced and len(data) > end and not (is_text or data[end:].strip(BLANKS))):
        check_count(announced, MAX_FACES)
        points = np.frombuffer(data, _FACET, announced, _HEADER)["points"].reshape(-1, 3).astype(np.float64)
    elif is_text:
        points = _parse_text(data.lower())
    elif len(data) < _HEADER:
        raise truncated(f"a binary STL header of {_HEADER} bytes", f"{len(data)} bytes in all")
    elif present < announced:
        raise truncated(f"{announced:,} triangles", f"bytes for {present:,}")
    else:
        left = len(data) - end
        follow = "byte follows" if left == 1 else "bytes follow"
        raise mismatch(f"The STL header counts {announced:,} triangles, but {left:,} {follow} the last of them.")
    return points, Polygons.of_triangles(np.arange(len(points)).reshape(-1, 3))


def _parse_text(text: bytes) -> NDArray[np.float64]:
    facets = len(re.findall(rb"^[ \t]*facet\b", text, re.MULTILINE))
    if not text.lstrip().startswith(b"solid") or not facets:
        raise ObjectFileError(
            "not_stl",
            "The file is plain text without an STL surface; an ASCII STL starts with 'solid' and lists "
            "'facet' blocks of three 'vertex' lines.",
        )
    check_count(facets, MAX_FACES_AS_TEXT)
    matches = list(_VERTEX.finditer(text))
    finished = len(re.findall(rb"^[ \t]*endfacet\b", text, re.MULTILINE))
    if finished < facets or len(matches) != 3 * facets:
        raise ObjectFileError(
            "truncated",
            f"{facets:,} facets begin, but {finished:,} end and there are {len(matches):,} 'vertex' lines, not three "
            "to a facet: the file is cut off or damaged. Copy or export it again.",
        )
    if b"endsolid" not in text:
        raise ObjectFileError(
            "truncated", f"'endsolid' is missing after {facets:,} whole facets: the file may be cut off. Copy it again."
        )
    points = np.empty((len(matches), 3))
    for number, match in enumerate(matches):
        words = match[1].split()
        try:
            points[number] = read_floats(words)
        except ValueError as error:
            raise _explained(text, match, words) from error
    return points


def _explained(text: bytes, match: re.Match[bytes], words: list[bytes]) -> ObjectFileError:
    """Why a vertex line does not hold three numbers."""
    line = text.count(b"\n", 0, match.start()) + 1
    where = f"Line {line}"
    wrong = first_wrong(words)
    if wrong is not None:
        return not_a_number(wrong, where)
    return malformed(f"{where} has {len(words)} coordinates instead of 3.")
