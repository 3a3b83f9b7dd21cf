"""Files made to hurt: each ends in a refusal, and the service goes on."""

import struct
from pathlib import Path

import pytest

from fingersplit_client.schemas import Problem

pytestmark = pytest.mark.anyio

STL_HEADER = b"\0" * 80
PLY_HEADER = b"ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
PLY_REST = b"property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n"

HOSTILE = {
    "nothing.stl": b"",
    "zeros.stl": b"\0" * 100_000,
    "promises.stl": STL_HEADER + struct.pack("<I", 2**32 - 1) + b"\0" * 150,
    "promises.ply": (PLY_HEADER + PLY_REST) % (2_000_000_000, 4_000_000_000) + b"\0" * 96,
    "promises.off": b"OFF\n999999999 999999999 0\n0 0 0\n",
    "promises.glb": b"glTF" + struct.pack("<III", 2, 2**31, 2**31) + b"JSON{}",
    "far.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n",
    "infinite.obj": b"v inf 0 0\nv 1e999 0 0\nv 0 nan 0\nf 1 2 3\n",
    "flat.obj": b"v 0 0 0\nv .1 0 0\nv 0 .1 0\nf 1 2 3\n",
    "digits.obj": b"v " + b"9" * 200_000 + b" 0 0\nf 1 1 1\n",
    "text.ply": b"#!/bin/sh\nrm -rf /\n",
    "zip.glb": b"PK\x03\x04" + b"\0" * 1000,
    "line.off": b"OFF " * 100_000,
}


@pytest.mark.parametrize("filename", HOSTILE)
async def test_bytes_made_to_hurt_are_refused(api, cube, filename):
    await _refused(api, cube, filename, HOSTILE[filename])


async def test_every_bad_file_is_refused(api, cube, objects_folder: Path | None):
    files = [] if objects_folder is None else sorted((objects_folder / "bad").iterdir())
    for file in files:
        await _refused(api, cube, file.name, file.read_bytes())


async def _refused(api, cube, filename, data):
    assert (await api.upload(cube, "cube.off", unit="cm")).is_success  # the worker has loaded what reads files
    response = await api.upload(data, filename)

    problem = Problem.model_validate_json(response.content)
    assert (response.status_code, problem.type) == (422, "urn:fingersplit:problem:invalid-mesh"), filename
    assert problem.code
    assert len(problem.detail) < 300
    assert (await api.upload(cube, "cube.off", unit="cm")).is_success
