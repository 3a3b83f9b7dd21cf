"""Mesh files as bytes, to be damaged by tests."""

import io
import json
import struct
from collections.abc import Callable

import numpy as np
import trimesh
from pypcd4 import Encoding
from pypcd4.pypcd4 import PointCloud as PcdFile

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


def cloud_points(count: int = 400) -> np.ndarray:
    directions = np.random.default_rng(0).normal(size=(count, 3))
    points = 0.05 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return np.rint(points * 2**12) / 2**12  # with zeros at the end, so that they can be packed


def cloud(form: str, points: np.ndarray | None = None, **arrays: np.ndarray) -> bytes:
    """Points as ``ascii``, ``binary`` or ``binary_compressed`` PCD, as ``ply``, ``ply_ascii`` or ``npz``."""
    points = cloud_points() if points is None else points
    file = io.BytesIO()
    if form == "npz":
        np.savez_compressed(file, points=points, **arrays)
    elif form.startswith("ply"):
        encoding = "ascii" if form == "ply_ascii" else "binary"
        file.write(trimesh.PointCloud(points).export(file_type="ply", encoding=encoding))
    else:
        PcdFile.from_xyz_points(points.astype(np.float32)).save(file, encoding=Encoding(form))
    return file.getvalue()


def mutated(data: bytes, random: np.random.Generator) -> bytes:
    """One file changed as storage, transport or malice would."""
    kind = random.integers(6)
    changed, at = bytearray(data), int(random.integers(len(data)))
    if kind == 0:
        for place in random.integers(len(data), size=random.integers(1, 20)):
            changed[place] ^= 1 << int(random.integers(8))
    elif kind == 1:
        return data[:at]
    elif kind == 2:
        changed[at : at + 4] = random.bytes(4)
    elif kind == 3:
        del changed[at : at + int(random.integers(1, 50))]
    elif kind == 4:
        other = int(random.integers(len(data)))
        changed[at:at] = data[other : other + int(random.integers(1, 200))]
    else:
        digits = [place for place, byte in enumerate(data[:1500]) if 48 <= byte <= 57] or [at]
        place = digits[int(random.integers(len(digits)))]
        changed[place : place + 1] = random.choice([b"-1", b"99999999999", b"0", b"nan", b"1e39", b"3.5"])
    return bytes(changed)
