"""Mesh files as bytes, to be damaged by tests."""

import json
import struct
from collections.abc import Callable

import trimesh

PLY_HEADER = "ply\nformat {0} 1.0\nelement vertex {1}\nproperty float x\nproperty float y\nproperty float z\n"
PLY_HEADER += "element face {2}\nproperty list uchar int vertex_indices\nend_header\n"


def ball(file_type: str, **options: object) -> bytes:
    data = trimesh.creation.icosphere(subdivisions=1, radius=0.05).export(file_type=file_type, **options)
    return data.encode() if isinstance(data, str) else data


def glb(change: Callable[[dict], object], binary: bytes | None = None) -> bytes:
    """The ball as GLB with its document changed."""
    data = ball("glb")
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    change(document)
    text = json.dumps(document).encode()
    chunks = data[20 + length :] if binary is None else struct.pack("<I4s", len(binary), b"BIN\0") + binary
    body = struct.pack("<I4s", len(text), b"JSON") + text + chunks
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
