"""Point clouds from files: every form comes back as it was written, or is refused with a sentence."""

import io
import json
import re
import zipfile

import numpy as np
import pytest

from fingersplit.errors import ObjectFileError
from fingersplit.objects.cloud import PointCloud
from fingersplit.objects.intake import read_bytes, read_cloud, read_file
from fingersplit.objects.intake.report import report_from_document
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.source import ObjectSource
from mesh_bytes import ball, cloud, cloud_points, mutated

FORMS = {
    "ascii": "pcd",
    "binary": "pcd",
    "binary_compressed": "pcd",
    "ply": "ply",
    "ply_ascii": "ply",
    "npz": "npz",
}
PCD_HEADER = (
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z{0}\nSIZE 4 4 4{1}\nTYPE F F F{2}\nCOUNT 1 1 1{3}\n"
    "WIDTH {4}\nHEIGHT {5}\nVIEWPOINT {6}\nPOINTS {7}\nDATA {8}\n"
)


def pcd(points: np.ndarray, *, viewpoint: str = "0 0 0 1 0 0 0", data: str = "ascii") -> bytes:
    header = PCD_HEADER.format("", "", "", "", len(points), 1, viewpoint, len(points), data).encode()
    rows = "".join(f"{x:.7g} {y:.7g} {z:.7g}\n" for x, y, z in points).encode()
    return header + (rows if data == "ascii" else points.astype("<f4").tobytes())


def outward(points: np.ndarray) -> np.ndarray:
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def same_points(found: np.ndarray, expected: np.ndarray) -> bool:
    return np.allclose(found[np.lexsort(found.T)], expected[np.lexsort(expected.T)], atol=1e-6)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("unit", ["m", "mm"])
def test_each_form_comes_back_as_it_was_written(form, unit):
    points = cloud_points()
    read, report = read_bytes(cloud(form, points * (1000 if unit == "mm" else 1)), FORMS[form], ObjectSource(unit))
    assert isinstance(read, PointCloud)
    assert same_points(read.points, points)
    assert (report.file_type, report.unit, report.points_in_file, report.points) == (FORMS[form], unit, 400, 400)
    assert (report.non_finite_points, report.repeated_points, report.outliers) == (0, 0, 0)
    assert (report.normals, report.viewpoint) == (False, False)
    assert 1e-3 < report.spacing < 10e-3
    assert report_from_document(json.loads(json.dumps(report.to_document()))) == report


def test_ply_with_faces_is_a_mesh_and_without_them_a_cloud(tmp_path):
    path = tmp_path / "ball.ply"
    path.write_bytes(ball("ply"))
    assert isinstance(read_file(path)[0], Mesh)
    path.write_bytes(cloud("ply"))
    assert isinstance(read_file(path)[0], PointCloud)
    no_faces = cloud("ply_ascii").replace(
        b"end_header", b"element face 0\nproperty list uchar int vertex_indices\nend_header"
    )
    path.write_bytes(no_faces)
    assert isinstance(read_file(path)[0], PointCloud)


def test_what_is_no_point_of_the_object_is_dropped_and_counted():
    points = cloud_points()
    strays = np.array([[0.3, 0, 0], [0, 0.4, 0], [0.2, 0.2, -0.3]])
    broken = np.array([[np.nan, 0, 0], [0, np.inf, 0], [np.nan] * 3, [1e30, 0, 0]])
    read, report = read_cloud(cloud("npz", np.concatenate([broken, points, strays, points[:7]])), "npz")
    assert (report.non_finite_points, report.repeated_points, report.outliers) == (4, 7, 3)
    assert (report.points_in_file, report.points) == (414, 400)
    assert same_points(read.points, points)


def test_viewpoint_and_normals_are_taken_from_the_file_and_in_its_unit():
    points = cloud_points() * 1000
    image = np.stack([points, points]).reshape(20, 40, 3)  # as an image, each point twice
    read, report = read_cloud(
        cloud("npz", image, normals=image, viewpoint=np.array([0, 0, 600.0])), "npz", ObjectSource("mm")
    )
    np.testing.assert_allclose(read.viewpoint, [0, 0, 0.6])
    np.testing.assert_allclose(read.normals, outward(read.points), atol=1e-9)
    assert (report.normals, report.viewpoint, report.points, report.repeated_points) == (True, True, 400, 400)
    read, _ = read_cloud(pcd(points, viewpoint="10 20 -500 1 0 0 0"), "pcd", ObjectSource("mm"))
    np.testing.assert_allclose(read.viewpoint, [0.01, 0.02, -0.5])
    read, _ = read_cloud(pcd(points, viewpoint="10 20 -500 1 0 0 0"), "pcd", ObjectSource("mm", viewpoint=(1, 2, 3)))
    np.testing.assert_allclose(read.viewpoint, [0.001, 0.002, 0.003])
    assert read_cloud(pcd(points), "pcd", ObjectSource("mm"))[0].viewpoint is None


def test_normals_that_are_no_directions_are_not_used():
    normals = cloud_points()
    normals[3] = 0
    assert read_cloud(cloud("npz", normals=normals), "npz")[0].normals is None


def test_pcd_reads_padding_normals_counts_and_organised_clouds():
    rows = np.zeros(400, "<f4, <f4, <f4, <f4, <f4, <f4, V5, (2,)<u2, <f8")
    for name, column in zip(("f0", "f1", "f2", "f3", "f4", "f5"), np.hstack([cloud_points()] * 2).T, strict=True):
        rows[name] = column
    fields = " normal_x normal_y normal_z _ tags stamp", " 4 4 4 1 2 8", " F F F U U F", " 1 1 1 5 2 1"
    header = PCD_HEADER.format(*fields, 20, 20, "0 0 1 1 0 0 0", 400, "binary")
    read, report = read_cloud(header.encode() + rows.tobytes(), "pcd")
    assert same_points(read.points, cloud_points())
    assert (report.normals, report.viewpoint) == (True, True)
    np.testing.assert_allclose(read.normals, outward(read.points), atol=1e-5)


def test_ply_reads_normals_beside_colours():
    points = cloud_points()
    names = ["x", "y", "z", "red", "nx", "ny", "nz"]
    kinds = ["double"] * 3 + ["uchar"] + ["float"] * 3
    header = "ply\nformat binary_big_endian 1.0\ncomment by hand\nelement vertex 400\n"
    header += "".join(f"property {kind} {name}\n" for kind, name in zip(kinds, names, strict=True)) + "end_header\n"
    rows = np.zeros(
        400,
        np.dtype(
            [(name, {"d": ">f8", "u": "u1", "f": ">f4"}[kind[0]]) for name, kind in zip(names, kinds, strict=True)]
        ),
    )
    for axis in range(3):
        rows[names[axis]], rows[names[4 + axis]] = points[:, axis], points[:, axis]
    read, report = read_cloud(header.encode() + rows.tobytes(), "ply")
    assert same_points(read.points, points)
    assert report.normals
    np.testing.assert_allclose(read.normals, outward(read.points), atol=1e-5)


def npz_that_promises(shape: tuple[int, ...]) -> bytes:
    array = io.BytesIO()
    np.lib.format.write_array_header_1_0(array, {"descr": "<f8", "fortran_order": False, "shape": shape})
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("points.npy", array.getvalue() + bytes(240))
    return file.getvalue()


def npz_bomb() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("points.npy", "w") as entry:
        for _ in range(200):
            entry.write(bytes(1_000_000))
    return file.getvalue()


GOOD = pcd(cloud_points())
PACKED = cloud("binary_compressed")

PACKED_AT = PACKED.index(b"binary_compressed\n") + len(b"binary_compressed\n")


@pytest.mark.parametrize(
    ("data", "file_type", "code", "words"),
    [
        (b"", "pcd", "empty", "0 bytes.*PCD"),
        (b"not a cloud", "pcd", "not_pcd", "no PCD header"),
        (GOOD.replace(b"POINTS 400", b"POINTS 4000000000"), "pcd", "too_many_faces", "4,000,000,000 points"),
        (GOOD.replace(b"POINTS 400", b"POINTS 401"), "pcd", "truncated", "401 points, a line each, but .* 400"),
        (GOOD.replace(b"POINTS 400", b"POINTS 399"), "pcd", "count_mismatch", "399 points, but 400 lines"),
        (GOOD.replace(b"POINTS 400", b"POINTS many"), "pcd", "malformed", "POINTS as a whole number, not 'many'"),
        (GOOD.replace(b"FIELDS x y z", b"FIELDS x y y"), "pcd", "malformed", "x, y and z"),
        (GOOD.replace(b"SIZE 4 4 4", b"SIZE 4 4"), "pcd", "malformed", "each of its 3 fields"),
        (GOOD.replace(b"TYPE F F F", b"TYPE F F Q"), "pcd", "malformed", "TYPE Q, SIZE 4"),
        (GOOD.replace(b"TYPE F F F", b"TYPE F F I"), "pcd", "malformed", "coordinate z"),
        (GOOD.replace(b"COUNT 1 1 1", b"COUNT 1 1 99999"), "pcd", "malformed", "COUNT 99999"),
        (GOOD.replace(b"VIEWPOINT 0", b"VIEWPOINT nan"), "pcd", "malformed", "seven numbers"),
        (GOOD[:-4] + b"x\n", "pcd", "malformed", "Point 399 .* not a number"),
        (pcd(cloud_points(), data="binary")[:-1], "pcd", "truncated", "4,800 bytes, but the file has 4,799"),
        (PACKED[:-1], "pcd", "truncated", "400 points"),
        (PACKED[: PACKED_AT + 4] + b"\xff" * 4 + PACKED[PACKED_AT + 8 :], "pcd", "count_mismatch", "4,294,967,295"),
        (PACKED[: PACKED_AT + 8] + bytes(len(PACKED) - PACKED_AT - 8), "pcd", "malformed", "do not unpack"),
        (cloud("ply")[:-1], "ply", "truncated", "vertex"),
        (cloud("npz")[:-30], "npz", "malformed", "no whole zip archive"),
        (npz_that_promises((10**12, 3)), "npz", "truncated", "24,000,000,000,000 bytes, but the file has 240"),
        (npz_that_promises((10, 4)), "npz", "truncated", "320 bytes"),
        (npz_that_promises((30,)), "npz", "malformed", "last axis"),
        (npz_bomb(), "npz", "too_many_faces", "numbers"),
        (cloud("npz", np.array([["a"] * 3] * 300)), "npz", "malformed", "holds str"),
        (cloud("npz", normals=np.zeros((3, 3))), "npz", "malformed", r"'normals' has the shape \(3, 3\)"),
        (cloud("npz", viewpoint=np.zeros(4)), "npz", "malformed", "'viewpoint' has the shape"),
        (cloud("npz", viewpoint=np.array([0, 0, np.nan])), "npz", "non_finite", "viewpoint"),
        (cloud("npz", np.zeros((0, 3))), "npz", "no_points", "no point"),
        (cloud("npz", np.zeros((500, 3))), "npz", "no_area", "one point"),
        (cloud("npz", np.full((500, 3), np.nan)), "npz", "too_few_points", "0 points that are finite"),
        (cloud("npz", cloud_points(150)), "npz", "too_few_points", "at least 200"),
        (cloud("npz", cloud_points() * [1, 1, 0]), "npz", "no_volume", "one plane"),
        (cloud("npz", cloud_points() * 1000), "npz", "too_large", "may be 'mm'"),
        (cloud("npz", cloud_points() / 1000), "npz", "too_small", "no known unit|may be"),
        (cloud("npz"), "xyz", "unknown_format", "stl, obj, ply, off, glb, pcd, npz"),
        (cloud("npz"), "", "unknown_format", "has no suffix, .* stl, obj"),
    ],
)  # fmt: skip
def test_refusals_say_what_is_wrong(data, file_type, code, words):
    with pytest.raises(ObjectFileError, match=words) as refusal:
        read_bytes(data, file_type)
    assert refusal.value.code == code
    assert len(str(refusal.value)) < 500


def test_viewpoint_of_a_mesh_is_refused():
    with pytest.raises(ObjectFileError, match="belongs to a point cloud") as refusal:
        read_bytes(ball("stl"), "stl", ObjectSource(viewpoint=(0, 0, 1)))
    assert refusal.value.code == "needless_viewpoint"


def _pcd_with(field: str, size: str, kind: str, row: str) -> bytes:
    header = PCD_HEADER.format(f" {field}", f" {size}", f" {kind}", " 1", 3, 1, "0 0 0 1 0 0 0", 3, "ascii")
    return "\n".join([header + "0 0 0 7", "0 0 0.1 7", row]).encode()


def _damaged_npz(place: int) -> bytes:
    data = bytearray(cloud("npz"))
    data[place] ^= 0xFF
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "file_type", "sentence"),
    [
        (
            _pcd_with("label", "4", "U", "0 0.1 0.o 7"),
            "pcd",
            "Point 2 of the PCD file has '0.o', which is not a number",
        ),
        (_pcd_with("label", "4", "U", "0 0.1 0 7.5"), "pcd", "Point 2 of the PCD file has '7.5', which is not a whole"),
        (_pcd_with("label", "1", "U", "0 0.1 0 7000"), "pcd", "a number that does not fit the TYPE and SIZE"),
        (_damaged_npz(200), "npz", "The NPZ array 'points' is damaged: its bytes in the zip archive do not unpack"),
    ],
)
def test_damage_is_named_with_its_place(data, file_type, sentence):
    with pytest.raises(ObjectFileError, match=re.escape(sentence)) as refusal:
        read_bytes(data, file_type)
    assert refusal.value.__cause__ is None or str(refusal.value.__cause__) not in str(refusal.value)


@pytest.mark.parametrize("form", FORMS)
def test_mutated_clouds_end_in_a_cloud_or_a_refusal(form):
    random, data, outcomes = np.random.default_rng(7), cloud(form), {"cloud": 0}
    vague = 0
    for _ in range(150):
        try:
            read, report = read_bytes(mutated(data, random), FORMS[form])
        except ObjectFileError as refusal:
            outcomes[refusal.code] = outcomes.get(refusal.code, 0) + 1
            vague += "does not follow" in str(refusal)  # which says neither what is wrong nor where
        else:
            outcomes["cloud"] += 1
            assert np.isfinite(read.points).all()
            assert len(read.points) == report.points
    assert vague == 0
    assert outcomes["cloud"] > 0 or form in ("npz", "binary_compressed")
    assert len(outcomes) > 1
