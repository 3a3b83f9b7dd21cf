"""The counts in a mesh file's header, compared with what the file holds, before a parser relies on them.

Each check takes a file's bytes and returns those that a parser may see: only what places triangles, with no names,
colours, textures, comments or references to other files.
"""

import re

from fingersplit.errors import ObjectFileError

__all__ = [
    "MAX_FACES",
    "MAX_FACES_AS_TEXT",
    "check_count",
    "check_obj",
    "check_off",
    "check_stl",
    "malformed",
    "mismatch",
    "truncated",
]

MAX_FACES = 2_000_000
"""Most triangles a file may hold; a finer mesh adds memory and time, not grasps."""
MAX_FACES_AS_TEXT = 1_000_000
"""Most of them as text, of which trimesh makes words before numbers: 6 s and 500 MB for as many."""

_STL_HEADER, _STL_FACET = 84, 50  # bytes; the header's last four are the number of triangles
_CONTROL_CHARACTERS = bytes(set(range(32)) - set(b"\t\n\v\f\r"))
_OFF_HEADER = re.compile(rb"\s*(?:ST)?C?N?OFF\s+(\d{1,18})\s+(\d{1,18})(?:[ \t]+\d+)?[ \t]*\r?\n")


def check_stl(data: bytes) -> bytes:
    """Check an STL file; a binary one is known by its length, since its header too may start with ``solid``."""
    announced = int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
    if len(data) == _STL_HEADER + announced * _STL_FACET:
        check_count(announced, MAX_FACES)
        return data
    if len(data[:1024].translate(None, _CONTROL_CHARACTERS)) == len(data[:1024]):
        return _check_ascii_stl(data.lower())
    if len(data) < _STL_HEADER:
        raise truncated(f"a binary STL header of {_STL_HEADER} bytes", f"{len(data)} bytes in all")
    present = (len(data) - _STL_HEADER) // _STL_FACET
    if present < announced:
        raise truncated(f"{announced:,} triangles", f"{present:,}")
    raise mismatch(f"The STL header says {announced:,} triangles, but the file has bytes for {present:,}.")


def _check_ascii_stl(text: bytes) -> bytes:
    facets = len(re.findall(rb"^[ \t]*facet\b", text, re.MULTILINE))
    if not text.lstrip().startswith(b"solid") or not facets:
        raise ObjectFileError(
            "not_stl",
            "The file is plain text without an STL surface; an ASCII STL starts with 'solid' and lists "
            "'facet' blocks of three 'vertex' lines.",
        )
    check_count(facets, MAX_FACES_AS_TEXT)
    points = re.findall(rb"^[ \t]*vertex[ \t]+(\S+[ \t]+\S+[ \t]+\S+)", text, re.MULTILINE)
    finished = len(re.findall(rb"^[ \t]*endfacet\b", text, re.MULTILINE))
    if finished < facets or len(points) != 3 * facets or b"endsolid" not in text:
        raise truncated(
            f"{facets:,} facets of three vertices and a closing 'endsolid'",
            f"{finished:,} finished facets and {len(points):,} vertices",
        )
    return b"solid\nvertex " + b"\nvertex ".join(points) + b"\nendsolid"


def check_obj(data: bytes) -> bytes:
    """Check an OBJ file line by line; relative indices, which trimesh counts from the file's end, become absolute."""
    check_count(data.count(b"\nf "), MAX_FACES_AS_TEXT)
    lines = re.sub(rb"#[^\r\n]*|/\S*", b"", re.sub(rb"\\\r?\n", b" ", data)).splitlines()
    n_vertices = sum(line.lstrip().startswith((b"v ", b"v\t")) for line in lines)
    check_count(n_vertices, MAX_FACES_AS_TEXT, "vertices")
    points, polygons = list[bytes](), list[str]()
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words[:1] == [b"v"]:
            if len(words) < 4:
                raise malformed(f"The vertex on line {number} has {len(words) - 1} coordinates instead of 3.")
            points.append(b" ".join(words[:4]))
        elif words[:1] == [b"f"]:
            corners = _obj_corners(words[1:], number, len(points), n_vertices)
            polygons.append("f " + " ".join(map(str, corners)))
    if not points and not polygons:
        raise ObjectFileError("not_obj", "The file has neither 'v' nor 'f' lines, so it is no OBJ mesh.")
    return b"\n".join(points) + b"\n" + "\n".join(polygons).encode()


def _obj_corners(words: list[bytes], line: int, n_above: int, n_vertices: int) -> list[int]:
    """Indices counted from 1, out of OBJ's: from 1, or from -1 backwards through the vertices above the line."""
    if len(words) < 3:
        raise malformed(f"The face on line {line} has {len(words)} corners instead of 3 or more.")
    try:
        corners = [int(word) for word in words]
    except ValueError as error:
        raise malformed(f"The face on line {line} holds something other than whole numbers: {error!s:.99}.") from error
    for corner in corners:
        if not (0 < corner <= n_vertices or -n_above <= corner < 0):
            raise ObjectFileError(
                "index_out_of_range",
                f"The face on line {line} names vertex {corner!s:.30}, but the file has {n_vertices:,} vertices, "
                f"{n_above:,} of them above that line; OBJ counts from 1, or from -1 backwards.",
            )
    return [corner if corner > 0 else n_above + 1 + corner for corner in corners]


def check_off(data: bytes) -> bytes:
    """Check an OFF file's counts against its lines, and each face's against its words."""
    text = re.sub(rb"#[^\r\n]*", b"", data)
    header = _OFF_HEADER.match(text)
    if header is None:
        raise ObjectFileError(
            "not_off", "The file does not start with 'OFF' and the numbers of vertices and faces on a line."
        )
    n_vertices, n_faces = int(header[1]), int(header[2])
    lines = [line for line in text[header.end() :].splitlines() if line.strip()]
    announced = f"{n_vertices:,} vertices and {n_faces:,} faces, a line each"
    if len(lines) < n_vertices + n_faces:
        raise truncated(announced, f"{len(lines):,} lines")
    if len(lines) > n_vertices + n_faces:
        raise mismatch(f"The header says {announced}, but {len(lines):,} lines follow.")
    check_count(n_vertices, MAX_FACES_AS_TEXT, "vertices")
    check_count(n_faces, MAX_FACES_AS_TEXT)
    for face, words in enumerate(map(bytes.split, lines[n_vertices:])):
        if int(words[0]) > len(words) - 1:
            raise malformed(f"Face {face} says {int(words[0])} corners, but its line holds {len(words) - 1}.")
    return b"OFF\n%d %d 0\n" % (n_vertices, n_faces) + b"\n".join(lines)


def malformed(what: str) -> ObjectFileError:
    """The error for a file that breaks its format's rules."""
    return ObjectFileError("malformed", f"{what} Export the mesh again.")


def mismatch(what: str) -> ObjectFileError:
    """The error for a file that goes on behind all that it announces."""
    return ObjectFileError("count_mismatch", f"{what} The two must agree. Export the mesh again.")


def truncated(announced: str, present: str) -> ObjectFileError:
    """The error for a file that ends before all that it announces."""
    return ObjectFileError(
        "truncated",
        f"The header announces {announced}, but the file has {present}: it is cut off or its header is wrong. "
        "Copy or export it again.",
    )


def check_count(count: int, most: int, what: str = "faces") -> None:
    """Refuse more faces, or other things, than there may be, before any memory is spent on them."""
    if count > most:
        raise ObjectFileError(
            "too_many_faces",
            f"The mesh has {count:,} {what}, more than the limit of {most:,}; simplify it first.",
        )
