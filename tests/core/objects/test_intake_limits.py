"""No file, however it lies or is damaged, costs more than a little time and memory."""

import struct
import subprocess
import sys
import time

import numpy as np
import pytest

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake import read_mesh
from fingersplit.objects.intake.refusals import MAX_FACES, MAX_FACES_AS_TEXT
from mesh_bytes import PLY_HEADER, ball, glb, mutated


def stl(promised: int, facets: bytes) -> bytes:
    return bytes(80) + struct.pack("<I", promised) + facets


def test_too_many_faces_are_refused_before_they_are_read():
    count, lines = MAX_FACES + 1, MAX_FACES_AS_TEXT + 1
    for data, file_type in [
        (stl(count, bytes(50 * count)), "stl"),
        (PLY_HEADER.format("binary_little_endian", 1, count).encode() + bytes(12 + count), "ply"),
        (PLY_HEADER.format("ascii", 1, lines).encode() + b"0 0 0" + b"\n3 0 0 0" * lines, "ply"),
        (b"v 0 0 0\n" + b"\nf 1 1 1" * lines, "obj"),
        (b"v 0 0 0\n" * lines, "obj"),
        (b"OFF\n1 %d 0\n0 0 0" % lines + b"\n3 0 0 0" * lines, "off"),
        (b"solid" + b"\nfacet\n" * lines, "stl"),
    ]:
        begin = time.process_time()
        with pytest.raises(ObjectFileError, match=r"000,00[12] .*, more than the limit of [12],000,000") as refusal:
            read_mesh(data, file_type)
        assert refusal.value.code == "too_many_faces"
        assert time.process_time() - begin < 20.0


def repeat_pieces(document: dict) -> None:
    document["meshes"][0]["primitives"] *= 1000
    document["nodes"] = [{"mesh": 0}] * 20
    document["scenes"] = [{"nodes": list(range(20))}]


def overlap(document: dict) -> None:
    (primitive,) = document["meshes"][0]["primitives"]
    points = document["accessors"][primitive["attributes"]["POSITION"]]
    numbers = range(len(document["accessors"]), len(document["accessors"]) + 50)
    document["accessors"] += [points] * 50
    document["meshes"][0]["primitives"] = [{"attributes": {"POSITION": number}} for number in numbers]


def repeat_nodes(document: dict) -> None:
    document["nodes"] = [{}] * 20_000
    document["scenes"] = [{"nodes": list(range(20_000))}]


def nest_nodes(document: dict) -> None:
    document["nodes"] = [{"mesh": 0, "children": [number]} for number in range(1, 5_000)] + [{"mesh": 0}]
    document["scenes"] = [{"nodes": [0]}]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (repeat_pieces, "more than 10,000 pieces"),
        (overlap, "overlap: they take"),
        (repeat_nodes, "more than 10,000 nodes"),
        (nest_nodes, "more than 100 levels"),
    ],
)
def test_scenes_that_unfold_without_end_are_refused(change, words):
    begin = time.process_time()
    with pytest.raises(ObjectFileError, match=words) as refusal:
        read_mesh(glb(change), "glb")
    assert refusal.value.code == "malformed"
    assert time.process_time() - begin < 20.0


@pytest.mark.parametrize(
    ("data", "file_type"),
    [
        (b"solid\n" + b"\n" * 300_000 + b"facet\n" + b" " * 300_000, "stl"),
        (b"ply" + b"\n" * 300_000, "ply"),
        (b"ply\n" + b"end_header " * 30_000, "ply"),
        (b"OFF" + b" \n" * 150_000, "off"),
        (b"v 0 0 0\n" + b"\\\n" * 150_000, "obj"),
    ],
)
def test_long_runs_of_space_cost_no_time(data, file_type):
    begin = time.process_time()
    with pytest.raises(ObjectFileError):
        read_mesh(data, file_type)
    assert time.process_time() - begin < 10.0


LIMITED_READ = """
import pathlib, resource, sys
from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake import read_mesh

present = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (present + 100_000_000,) * 2)
for name in sys.argv[1:]:
    try:
        read_mesh(pathlib.Path(name).read_bytes(), pathlib.Path(name).suffix)
    except ObjectFileError as error:
        print(error.code)
"""


def test_promised_counts_cost_no_memory(tmp_path):
    files = {
        "a.stl": stl(2**32 - 1, bytes(150)),
        "b.ply": PLY_HEADER.format("binary_little_endian", 2 * 10**9, 4 * 10**9).encode() + bytes(96),
        "c.ply": PLY_HEADER.format("ascii", 10**9, 10**9).encode() + b"0 0 0",
        "d.off": b"OFF\n1000000000 1000000000 0\n0 0 0\n",
        "e.glb": glb(lambda document: document["accessors"][0].update(count=2**40)),
        "f.ply": PLY_HEADER.format("ascii", 1, 1).encode() + b"0 0 0 4e9 0 0 0",
    }
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    command = [sys.executable, "-c", LIMITED_READ, *(str(tmp_path / name) for name in files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.split() == ["truncated"] * len(files)


@pytest.mark.parametrize("word", ["nan", "inf", "1.5", "1e300"])
def test_a_face_with_no_number_of_a_vertex_is_named(word):
    data = ball("ply", encoding="ascii").decode().splitlines()
    face = next(number for number, line in enumerate(data) if line.startswith("3 "))
    data[face] = f"3 0 {word} 2"
    with pytest.raises(ObjectFileError, match=f"line {face + 1} has the vertex .*whole numbers, from 0 on"):
        read_mesh("\n".join(data).encode(), "ply")


@pytest.mark.parametrize(
    ("file_type", "options"),
    [
        ("stl", {}),
        ("stl_ascii", {}),
        ("obj", {}),
        ("ply", {}),
        ("ply", {"encoding": "ascii"}),
        ("off", {}),
        ("glb", {}),
    ],
)
def test_mutated_files_end_in_a_mesh_or_a_refusal(file_type, options):
    random = np.random.default_rng(20)
    data, outcomes = ball(file_type, **options), {"mesh": 0}
    vague = 0
    for _ in range(300):
        begin = time.process_time()
        try:
            mesh, report = read_mesh(mutated(data, random), file_type.removesuffix("_ascii"))
        except ObjectFileError as refusal:
            outcomes[refusal.code] = outcomes.get(refusal.code, 0) + 1
            vague += "does not follow" in str(refusal)  # which says neither what is wrong nor where
        else:
            outcomes["mesh"] += 1
            assert np.isfinite(mesh.vertices).all()
            assert mesh.faces.min() >= 0
            assert mesh.faces.max() < len(mesh.vertices)
            assert report.volume is None or report.volume > 0
        assert time.process_time() - begin < 10.0
    assert vague == 0
    assert outcomes["mesh"] > 0
    assert len(outcomes) > 3
