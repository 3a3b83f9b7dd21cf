"""Files that are broken, lying or no graspable object end in a sentence, quickly and in little memory."""

import os
import struct
from pathlib import Path

import numpy as np
import pytest

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake import read_mesh
from fingersplit.objects.source import ObjectSource
from mesh_bytes import PLY_HEADER, ball, glb

BAD = Path(os.environ.get("FINGERSPLIT_OBJECTS", Path(__file__).parents[4] / "shared" / "objects")) / "bad"
BOX_VERTICES = "".join(f"v {x} {y} {z}\n" for z in (0, 0.05) for x, y in ((0, 0), (0.05, 0), (0.05, 0.05), (0, 0.05)))
BOX_FACES = "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\n"
BOX_FACES += "f 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n"
BOX = (BOX_VERTICES + BOX_FACES).encode()
SIGNED_PLY = PLY_HEADER.format("binary_little_endian", 1, 1).replace("uchar", "char").encode()
ONE_FACE_PLY = PLY_HEADER.format("ascii", 1, 1).encode()


def with_vertices(*rows: str) -> bytes:
    return ("".join(f"v {row}\n" for row in rows) + BOX_FACES).encode()


def random_triangles() -> bytes:
    """Triangles at random, and 65 around one edge."""
    random = np.random.default_rng(0)
    corners = random.uniform(0, 0.1, (205, 3, 3))
    corners[:65, :2] = corners[0, :2]
    corners[60:65] = corners[:5]
    return stl(corners)


def stl(corners: np.ndarray, count: int | None = None) -> bytes:
    facets = b"".join(bytes(12) + triangle.astype("<f4").tobytes() + bytes(2) for triangle in corners)
    return bytes(80) + struct.pack("<I", len(corners) if count is None else count) + facets


def triangle_grid(size: int) -> bytes:
    """A flat square sheet as OBJ."""
    vertices = [f"v {x / 100} {y / 100} {(x + y) / 300}\n" for y in range(size) for x in range(size)]
    corners = [y * size + x + 1 for y in range(size - 1) for x in range(size - 1)]
    faces = [f"f {c} {c + 1} {c + size + 1} {c + size}\n" for c in corners]
    return "".join(vertices + faces).encode()


DRACO = "KHR_draco_mesh_compression"
DEEP_GLB = struct.pack("<4sIII4s", b"glTF", 2, 100_020, 100_000, b"JSON") + b"[" * 100_000
SIGNALLING_NAN_STL = stl(np.ones((3, 3, 3))).replace(b"\0\0\x80\x3f", b"\0\0\xa0\x7f", 1)
PUBLISHED = {
    "empty.obj": ("empty", b""),
    "huge_count.stl": ("truncated", stl(np.ones((3, 3, 3)), 2**32 - 1)),
    "huge_count.ply": (
        "truncated",
        PLY_HEADER.format("binary_little_endian", 2 * 10**9, 4 * 10**9).encode() + bytes(96),
    ),
    "truncated.stl": ("truncated", ball("stl")[:3000]),
    "not_a_mesh.stl": ("not_stl", b"This is a plain text file.\nsolid words, but no facets follow.\n"),
    "index_out_of_range.obj": ("index_out_of_range", BOX + b"f 1 2 999999999\nf 0 1 2\nf -9 1 2\n"),
    "nan_vertices.obj": (
        "non_finite",
        with_vertices("0 0 0", ".05 0 0", ".05 nan 0", "0 1 0", "0 0 1", "inf 0 1", "1 1 1", "0 1 -nan"),
    ),
    "zero_area.obj": ("no_area", with_vertices(*(f"{k / 1000} {k / 500} 0" for k in range(8)))),
    "single_point.obj": ("no_area", with_vertices(*["0.01 0.01 0.01"] * 8)),
    "nonmanifold_soup.stl": ("not_solid", random_triangles()),
}
"""File name in ``bad``, the refusal's code, and a file of our own with the same fault."""


@pytest.mark.parametrize("name", PUBLISHED)
def test_broken_files_are_refused(name):
    code, own = PUBLISHED[name]
    for data in [own, *(path.read_bytes() for path in BAD.glob(name))]:
        with pytest.raises(ObjectFileError) as refusal:
            read_mesh(data, Path(name).suffix)
        assert refusal.value.code == code
        assert str(refusal.value).endswith(".")


def test_every_published_broken_file_is_covered():
    assert {path.name for path in BAD.glob("*")} <= PUBLISHED.keys()


@pytest.mark.parametrize(
    ("data", "file_type", "code", "words"),
    [
        (stl(np.ones((3, 3, 3)), 2**32 - 1), "stl", "truncated", "4,294,967,295 triangles, .* bytes for 3"),
        (stl(np.ones((3, 3, 3)), 2), "stl", "count_mismatch", "counts 2 triangles, but 50 bytes follow"),
        (stl(np.ones((0, 3, 3))), "stl", "no_faces", "no face"),
        (b"\0" * 60, "stl", "truncated", "84 bytes"),
        (ball("stl_ascii")[:-400], "stl", "truncated", "end and there are .* 'vertex' lines"),
        (SIGNALLING_NAN_STL, "stl", "non_finite", "1 of 9 vertices .* number 1 with"),
        (ball("stl_ascii").replace(b"endsolid", b""), "stl", "truncated", "endsolid"),
        (ball("stl_ascii").replace(b"vertex", b"vertex x", 1), "stl", "malformed", "Line 4 has .x., which is"),
        (b" \n", "obj", "empty", "empty"),
        (b"# nothing\n", "obj", "not_obj", "neither 'v' nor 'f'"),
        (BOX_VERTICES.encode(), "obj", "no_faces", "no face"),
        (BOX_FACES.encode(), "obj", "index_out_of_range", "line 1 names vertex 1, .* 0 vertices"),
        (BOX + b"f 1 2 9\n", "obj", "index_out_of_range", "line 21 names vertex 9, .* has 8 vertices"),
        (BOX + b"f 1 0 2\n", "obj", "index_out_of_range", "line 21 names vertex 0, .* counts from 1"),
        (b"v 0 0 0\nf -2 -1 -1\nv 1 0 0\n", "obj", "index_out_of_range", "vertex -2.* 1 of them"),
        (BOX + b"f 1 2\n", "obj", "malformed", "line 21 has 2 corners"),
        (BOX + b"f 1 2 x\n", "obj", "malformed", "line 21 has 'x' where whole numbers"),
        (BOX + b"f 1 2 " + b"9" * 60 + b"\n", "obj", "index_out_of_range", "vertex 9{30}, but"),
        (BOX + b"v 1 2\n", "obj", "malformed", "line 21 has 2 coordinates"),
        (BOX + b"v 1 2 x\n", "obj", "malformed", "vertex on line 21 has 'x'"),
        (BOX + b"v 1 2 1e999\n", "obj", "non_finite", "number 9 with"),
        (ball("ply")[:-5], "ply", "truncated", "80 face rows, but the file has 79 whole ones"),
        (ball("ply") + b"x", "ply", "count_mismatch", "1 byte follows"),
        (ball("ply", encoding="ascii")[:-40], "ply", "truncated", "face rows"),
        (ball("ply").replace(b"ply", b"plx", 1), "ply", "not_ply", "header"),
        (ball("ply").replace(b"float z", b"float w", 1), "ply", "malformed", "x, y and z"),
        (ball("ply").replace(b"uchar int", b"uchar bit", 1), "ply", "malformed", "'property list uchar bit"),
        (ball("ply").replace(b"vertex_indices", b"vertex_whatever", 1), "ply", "malformed", "vertex_indices"),
        (PLY_HEADER.format("ascii", 1, 10**17).encode() + b"1 2 3", "ply", "truncated", "but the file has 5 bytes"),
        (ONE_FACE_PLY + b"0 0 0", "ply", "truncated", "1 face rows, a line each, but the file has 1 lines"),
        (ONE_FACE_PLY + b"0 0 0\n3 0 0 7", "ply", "index_out_of_range", "vertex 7"),
        (ONE_FACE_PLY + b"0 0 0\n-3 0 0 0", "ply", "malformed", "list on line 11 says it has -3 items"),
        (ONE_FACE_PLY + b"0 0 0\ninf 0 0 0", "ply", "malformed", "says it has inf items"),
        (ONE_FACE_PLY + b"0 0 0\n9 0 0 0", "ply", "malformed", "4 words, not 10"),
        (ONE_FACE_PLY + b"0 0 zero\n3 0 0 0", "ply", "malformed", "Line 10 has 'zero', which is not a number"),
        (ball("ply").replace(b"uchar int", b"uchar float", 1), "ply", "malformed", "vertex_indices"),
        (SIGNED_PLY + bytes(12) + b"\xfd" + bytes(12), "ply", "malformed", "negative number of items"),
        (ball("ply").replace(b"float y", b"float x", 1), "ply", "malformed", "twice"),
        (ball("off")[:-60], "off", "truncated", "42 vertices and 80 faces"),
        (ball("off") + b"3 0 1 2\n", "off", "count_mismatch", "80 faces"),
        (b"OFF\n999999999999 4000000000 0\n0 0 0\n", "off", "truncated", "1 lines"),
        (b"OFF\n1 1 0\n0 0 0\n9 0 0 0\n", "off", "malformed", "face on line 4 says 9 corners, .* holds 3"),
        (b"OFF\n1 1 0\n0 0 0\n3 0 0 -1\n", "off", "index_out_of_range", "Face 1 of 1 .line 4. names vertex -1"),
        (b"ON\n1 1 0\n", "off", "not_off", "'OFF'"),
        (b"glTF", "glb", "not_glb", "header"),
        (ball("glb")[:-50], "glb", "truncated", "bytes, but the file has"),
        (ball("glb")[:4] + b"\1" + ball("glb")[5:], "glb", "not_glb", "version 1"),
        (glb(lambda d: d["nodes"][0].update(children=[0])), "glb", "malformed", "twice"),
        (glb(lambda d: d["accessors"][0].update(count=2**32)), "glb", "truncated", "4,294,967,296 values"),
        (glb(lambda d: d["accessors"][1].update(count=2**32)), "glb", "truncated", "4,294,967,296 values"),
        (glb(lambda d: d["accessors"][0].update(byteOffset=-12)), "glb", "malformed", "negative"),
        (glb(lambda d: d["accessors"][0].update(bufferView=-1)), "glb", "malformed", r"bufferViews\[-1\]"),
        (glb(lambda d: d["accessors"][0].pop("bufferView")), "glb", "malformed", "bufferView"),
        (glb(lambda d: d["buffers"][0].update(uri="a.bin")), "glb", "external_data", "single GLB"),
        (glb(lambda d: d.update(extensionsRequired=[DRACO])), "glb", "compressed", DRACO),
        (glb(lambda d: d["meshes"][0]["primitives"][0].update(mode=6)), "glb", "malformed", "triangle fans"),
        (glb(lambda d: d.pop("meshes")), "glb", "no_faces", "no mesh in it"),
        (glb(lambda d: d.update(scenes="none")), "glb", "malformed", "wants another kind"),
        (glb(lambda d: None, binary=b""), "glb", "truncated", "0 bytes"),
        (DEEP_GLB, "glb", "malformed", "nested too deeply"),
        (triangle_grid(5), "obj", "no_volume", "flat"),
        (BOX, "step", "unknown_format", "stl, obj, ply, off, glb"),
    ],
)  # fmt: skip
def test_refusals_say_what_is_wrong(data, file_type, code, words):
    with pytest.raises(ObjectFileError, match=words) as refusal:
        read_mesh(data, file_type)
    assert refusal.value.code == code
    assert len(str(refusal.value)) < 500


def test_unknown_unit_is_refused_with_the_known_ones():
    with pytest.raises(ObjectFileError, match="'furlong'; known units: m, mm, cm, in") as refusal:
        read_mesh(BOX, "obj", ObjectSource("furlong"))
    assert refusal.value.code == "unknown_unit"


@pytest.mark.parametrize(
    ("size", "unit", "code", "words"),
    [
        (50.0, "m", "too_large", r"50 m .* may be 'mm' \(0.05 m\) or 'cm' \(0.5 m\) or 'in' \(1.27 m\)"),
        (0.05, "mm", "too_small", r"5e-05 m .* may be 'm' \(0.05 m\)"),
        (2.1, "m", "too_large", "may be 'mm'"),
        (1.9, "mm", "too_small", "may be 'm'"),
        (1e9, "m", "too_large", "no known unit"),
        (1.7e308, "m", "too_large", "no known unit"),
    ],
)
def test_size_beyond_any_hand_is_refused_with_a_plausible_unit(size, unit, code, words):
    with pytest.raises(ObjectFileError, match=words) as refusal:
        read_mesh(BOX.replace(b"0.05", str(size).encode()), "obj", ObjectSource(unit))
    assert refusal.value.code == code


@pytest.mark.parametrize(("size", "unit"), [(2.0, "m"), (2.1, "mm")])
def test_size_at_the_limits_is_accepted(size, unit):
    mesh, _ = read_mesh(BOX.replace(b"0.05", str(size).encode()), "obj", ObjectSource(unit))
    assert 0.002 <= mesh.extents.max() <= 2.0
