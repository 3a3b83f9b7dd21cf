"""What an object can be given as: a path, an open file, bytes, or arrays; all become the bytes of a file."""

import hashlib
import os
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO, Protocol, TypeAlias

from fingersplit_client.errors import invalid

__all__ = ["HasMesh", "MeshFile", "MeshSource", "read_file", "read_mesh"]


class HasMesh(Protocol):
    """A mesh of a library such as trimesh."""

    @property
    def vertices(self) -> Any:
        """Vertices, shape (n, 3)."""

    @property
    def faces(self) -> Any:
        """Indices of the triangles' corners, shape (m, 3)."""


MeshSource: TypeAlias = os.PathLike[str] | str | bytes | BinaryIO | HasMesh | tuple[Any, Any]
"""A file's path, an open binary file, a file's bytes, or vertices (n, 3) and triangles (m, 3), as a pair or as
attributes ``vertices`` and ``faces``."""


@dataclass(frozen=True)
class MeshFile:
    """A file to upload.

    Attributes:
        stem: Its name without suffix.
        suffix: Suffix that says the format, with its dot.
        content: Its bytes.
    """

    stem: str
    suffix: str
    content: bytes

    @property
    def filename(self) -> str:
        """Name with suffix."""
        return self.stem + self.suffix

    @property
    def sha256(self) -> str:
        """SHA-256 of the content, hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()


def read_mesh(source: MeshSource, file_type: str | None) -> MeshFile:
    """The file of a mesh or point cloud.

    Args:
        source: See `MeshSource`.
        file_type: Format, such as ``"stl"``; by default the file's suffix.

    Raises:
        InvalidRequestError: The format of bytes is not known, or arrays are no mesh.
        OSError: The file cannot be read.
    """
    if isinstance(source, tuple):
        return MeshFile("object", ".ply", _ply(*source))
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        return MeshFile("object", ".ply", _ply(source.vertices, source.faces))
    file = read_file(source, "object")
    suffix = f".{file_type.lstrip('.')}" if file_type else file.suffix
    if not suffix:
        raise invalid(f"{file.stem!r} does not say what it is: give file_type, such as 'stl' or 'ply'.")
    return MeshFile(file.stem, suffix, file.content)


def read_file(source: "os.PathLike[str] | str | bytes | BinaryIO", name: str) -> MeshFile:
    """Name, suffix and content of a file; of bytes the given name."""
    if isinstance(source, bytes | bytearray | memoryview):
        return MeshFile(name, "", bytes(source))
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        return MeshFile(path.stem, path.suffix, path.read_bytes())
    if hasattr(source, "read"):
        content = source.read()
        if not isinstance(content, bytes):
            raise invalid("The file is open as text; open it with mode 'rb'.")
        path = Path(str(getattr(source, "name", name)))
        return MeshFile(path.stem, path.suffix, content)
    raise invalid(f"{type(source).__name__} is no mesh: give a path, an open file, bytes, or vertices and faces.")


def _ply(vertices: Any, faces: Any) -> bytes:
    """A binary PLY file of vertices (n, 3) and triangles (m, 3)."""
    points = [tuple(map(float, row)) for row in _rows(vertices, "vertices")]
    corners = [tuple(map(int, row)) for row in _rows(faces, "faces")]
    outside = next((row for row in corners if not all(0 <= corner < len(points) for corner in row)), None)
    if outside is not None:
        raise invalid(f"Face {outside} names vertices that are not there; there are {len(points)}, counted from 0.")
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(corners)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    coordinates = struct.pack(f"<{3 * len(points)}d", *chain.from_iterable(points))
    triangle = struct.Struct("<B3i")
    return header.encode() + coordinates + b"".join(triangle.pack(3, *row) for row in corners)


def _rows(values: Any, name: str) -> Iterable[Sequence[float]]:
    """Rows of three numbers."""
    rows = values.tolist() if hasattr(values, "tolist") else list(values)
    wrong = next((row for row in rows if not hasattr(row, "__len__") or len(row) != 3), None)
    if wrong is not None or not rows:
        shown = f"a row of them is {wrong!r}" if rows else "there are none"
        raise invalid(f"The {name} must be rows of three numbers; {shown}.")
    return rows
