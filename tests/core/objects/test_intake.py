"""What intake repairs, keeps and reports, from files written here."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake import IntakeReport, read_file, read_mesh
from fingersplit.objects.intake.report import report_from_document
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import bottle, l_bracket, mug
from fingersplit.objects.source import UNITS, ObjectSource

OBJECTS = Path(os.environ.get("FINGERSPLIT_OBJECTS", Path(__file__).parents[4] / "shared" / "objects"))
BOX_EXTENTS = (0.04, 0.06, 0.1)


def box() -> trimesh.Trimesh:
    return trimesh.creation.box(BOX_EXTENTS)


def ball(radius: float = 0.05) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2, radius=radius)


def written(mesh: trimesh.Trimesh, file_type: str, **options: object) -> bytes:
    data = mesh.export(file_type=file_type, **options)
    return data.encode() if isinstance(data, str) else data


def obj_text(vertices, faces) -> bytes:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    return "\n".join(lines).encode() + b"\n"


def read(vertices, faces) -> tuple[Mesh, IntakeReport]:
    return read_mesh(obj_text(vertices, faces), "obj")


def points_outwards(mesh: Mesh) -> bool:
    triangles = mesh.vertices[mesh.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    middle = (mesh.bounds[0] + mesh.bounds[1]) / 2
    return bool((np.einsum("ij,ij->i", triangles.mean(axis=1) - middle, normals) > 0).all())


@pytest.mark.parametrize(("unit", "size"), [("m", 0.1), ("cm", 10.0), ("mm", 100.0), ("in", 0.1 / 0.0254)])
def test_unit_scales_to_metres(unit, size):
    mesh, report = read_mesh(written(trimesh.creation.box([size] * 3), "stl"), "stl", ObjectSource(unit))
    assert mesh.extents == pytest.approx([0.1] * 3)
    assert report.volume == pytest.approx(1e-3)
    assert report.unit == unit
    assert unit in UNITS


def test_inside_out_box_is_turned_back():
    mesh, report = read(box().vertices, box().faces[:, ::-1])
    assert points_outwards(mesh)
    assert (report.flipped_faces, report.volume) == (12, pytest.approx(box().volume))


def test_faces_wound_against_their_neighbours_are_turned():
    faces = np.array(ball().faces)
    wrong = np.random.default_rng(3).choice(len(faces), 100, replace=False)
    faces[wrong] = faces[wrong, ::-1]
    mesh, report = read(ball().vertices, faces)
    assert points_outwards(mesh)
    assert (report.flipped_faces, report.watertight, report.volume) == (
        100,
        True,
        pytest.approx(ball().volume),
    )


def test_each_part_is_turned_by_itself():
    other = box().vertices + np.array([0.5, 0, 0])
    vertices = np.concatenate([ball().vertices, other])
    faces = np.concatenate([ball().faces, box().faces[:, ::-1] + len(ball().vertices)])
    _, report = read(vertices, faces)
    assert (report.components, report.flipped_faces) == (2, 12)
    assert report.volume == pytest.approx(ball().volume + box().volume)


@pytest.mark.parametrize("inside_out", [False, True])
@pytest.mark.parametrize("wound_against", [False, True])
def test_outer_shell_of_nested_parts_is_kept(inside_out, wound_against):
    outer, inner, innermost = ball(0.05), ball(0.03), box()
    innermost.apply_scale(0.3)
    inner_faces = inner.faces[:, ::-1] if wound_against else inner.faces
    vertices = np.concatenate([inner.vertices, outer.vertices, innermost.vertices])
    faces = np.concatenate([inner_faces, outer.faces + len(inner.vertices)])
    faces = np.concatenate([faces, innermost.faces + len(inner.vertices) + len(outer.vertices)])
    mesh, report = read(vertices, faces[:, ::-1] if inside_out else faces)
    assert (report.components, report.inner_parts, report.watertight) == (1, 2, True)
    assert report.volume == pytest.approx(outer.volume)
    assert (report.vertices, report.unused_vertices) == (len(outer.vertices), 0)
    assert points_outwards(mesh)


def test_parts_that_only_reach_into_others_are_kept():
    stick = trimesh.creation.box((0.2, 0.01, 0.01))
    vertices = np.concatenate([ball().vertices, stick.vertices])
    _, report = read(vertices, np.concatenate([ball().faces, stick.faces + len(ball().vertices)]))
    assert (report.components, report.inner_parts) == (2, 0)


def test_parts_in_an_open_shell_are_kept():
    lidless = np.concatenate([ball().faces[4:], ball(0.03).faces + len(ball().vertices)])
    _, report = read(np.concatenate([ball().vertices, ball(0.03).vertices]), lidless)
    assert (report.components, report.inner_parts) == (2, 0)


def test_holes_are_listed_by_the_length_of_their_rims():
    cube = trimesh.creation.box([0.1] * 3).subdivide().subdivide()
    up = cube.face_normals @ [0, 0, 1]
    middle = np.abs(cube.triangles_center[:, :2]).max(axis=1) < 0.025
    _, report = read(cube.vertices, cube.faces[~((up > 0.9) & middle) & (up > -0.9)])
    assert (report.holes, report.boundary_edges) == (2, 24)
    assert report.hole_perimeters == pytest.approx((0.4, 0.2))


def test_a_hundred_parts_are_kept_apart_from_what_is_inside_them():
    places = np.stack(np.meshgrid(*[np.arange(5) * 0.12] * 2, np.arange(4) * 0.12, indexing="ij"), -1).reshape(-1, 3)
    parts = [shape.vertices + place for place in places for shape in (ball(0.05), ball(0.02))]
    faces = [ball().faces + number * len(ball().vertices) for number in range(len(parts))]
    _, report = read(np.concatenate(parts), np.concatenate(faces))
    assert report.inner_parts + report.components == 200
    assert 64 <= report.inner_parts <= 100
    assert report.watertight


def test_part_in_the_bounding_box_but_outside_the_solid_is_no_cavity():
    frame = trimesh.creation.annulus(r_min=0.08, r_max=0.1, height=0.05)
    vertices = np.concatenate([frame.vertices, ball(0.02).vertices])
    faces = np.concatenate([frame.faces, ball(0.02).faces[:, ::-1] + len(frame.vertices)])
    _, report = read(vertices, faces)
    assert report.volume == pytest.approx(frame.volume + ball(0.02).volume)


def test_repeated_and_degenerate_faces_and_unused_vertices_are_dropped():
    vertices = np.concatenate([[[9.0, 9, 9]], box().vertices, box().vertices[:1]])  # a stray one, and a twin
    extra = [box().faces[3], box().faces[5][[1, 2, 0]], [0, 0, 1], [0, 8, 4]]  # twice the same, then no area
    faces = np.concatenate([box().faces, extra]) + 1
    mesh, report = read(vertices, faces)
    assert (report.vertices_in_file, report.faces_in_file) == (10, 16)
    assert (report.duplicate_faces, report.degenerate_faces) == (2, 2)
    assert (report.merged_vertices, report.unused_vertices) == (1, 1)
    assert (report.vertices, report.faces, report.watertight) == (8, 12, True)
    assert mesh.extents == pytest.approx(BOX_EXTENTS)


def test_fin_left_by_merged_vertices_is_dropped():
    tip = len(box().vertices)
    vertices = np.concatenate([box().vertices, [[0.03, 0.04, 0.06]]])
    a, b, _ = box().faces[0]
    fin = [[a, b, tip], [b, a, tip]]
    mesh, report = read(vertices, np.concatenate([box().faces, fin]))
    assert (len(mesh.faces), report.duplicate_faces, report.watertight) == (12, 2, True)


def test_two_sided_file_keeps_one_side():
    both = np.stack([box().faces[:, ::-1], box().faces], axis=1).reshape(-1, 3)
    mesh, report = read(box().vertices, both)
    assert points_outwards(mesh)
    assert (report.faces, report.duplicate_faces, report.watertight) == (12, 12, True)


def test_face_on_a_line_stays_where_it_closes_the_surface():
    a, b, c = box().faces[0]
    vertices = np.concatenate([box().vertices, [(box().vertices[a] + box().vertices[b]) / 2]])
    split = np.concatenate([box().faces[1:], [[a, 8, c], [8, b, c], [a, b, 8]]])
    _, closed = read(vertices, split)
    assert (closed.faces, closed.degenerate_faces, closed.watertight) == (14, 0, True)
    _, loose = read(vertices, np.concatenate([box().faces, [[a, b, 8]]]))
    assert (loose.faces, loose.degenerate_faces, loose.watertight) == (12, 1, True)


def test_holes_and_shared_edges_are_counted():
    _, holed = read(box().vertices, box().faces[2:])
    assert (holed.boundary_edges, holed.watertight, holed.volume_method) == (4, False, "capped_holes")
    assert holed.volume == pytest.approx(box().volume, rel=0.1)  # the rim is not flat
    touching = np.array([[0, 0, 0], [1, 1, 0]])[:, None] * BOX_EXTENTS + box().vertices
    vertices, faces = touching.reshape(-1, 3), np.concatenate([box().faces, box().faces + 8])
    _, joined = read(vertices, faces)
    assert (joined.nonmanifold_edges, joined.boundary_edges, joined.merged_vertices) == (1, 0, 2)


def test_one_sided_surface_is_kept_and_said_not_to_be_watertight():
    twist = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    middle = np.stack([np.cos(twist), np.sin(twist), 0 * twist], axis=1)
    across = np.stack([np.cos(twist / 2) * np.cos(twist), np.cos(twist / 2) * np.sin(twist), np.sin(twist / 2)], 1)
    vertices = np.concatenate([middle + 0.3 * across, middle - 0.3 * across]) * 0.1
    k = np.arange(39)
    faces = np.concatenate([np.stack([k, k + 1, k + 40], 1), np.stack([k + 1, k + 41, k + 40], 1)])
    faces = np.concatenate([faces, [[39, 40, 79], [40, 0, 79]]])
    _, report = read(vertices, faces)
    assert (report.faces, report.watertight, report.nonmanifold_edges) == (80, False, 0)


def test_report_becomes_plain_json():
    _, report = read_mesh(written(box(), "stl"), "STL")
    document = json.loads(json.dumps(report.to_document()))
    assert report_from_document(document) == report
    assert (document["file_type"], document["merged_vertices"], document["vertices"]) == ("stl", 28, 8)


def test_read_file_takes_the_format_from_the_suffix(tmp_path):
    path = tmp_path / "Ball.PLY"
    path.write_bytes(written(ball(100.0), "ply"))
    mesh, report = read_file(path, ObjectSource("mm"))
    assert report.file_type == "ply"
    assert mesh.content_hash == read_mesh(path.read_bytes(), ".ply", ObjectSource("mm"))[0].content_hash
    with pytest.raises(ObjectFileError, match=r"Cannot read .*gone\.stl") as refusal:
        read_file(tmp_path / "gone.stl")
    assert refusal.value.code == "unreadable"


def test_watertight_is_said_of_closed_and_consistent_surfaces_only():
    faces = mug().faces
    assert mug().watertight
    for broken in faces[1:], np.concatenate([faces[:1, ::-1], faces[1:]]), np.concatenate([faces, faces]):
        assert not Mesh(mug().vertices, broken).watertight
    assert mug().volume == pytest.approx(mug().trimesh.volume)
    assert mug().center_of_mass == pytest.approx(mug().trimesh.center_mass, abs=1e-9)


def published_objects() -> dict[str, dict]:
    manifest = OBJECTS / "manifest.json"
    return {each["name"]: each for each in json.loads(manifest.read_text())["objects"]} if manifest.exists() else {}


@pytest.mark.parametrize("name", [*published_objects(), "our_mug", "our_bracket", "our_bottle"])
def test_good_objects_are_accepted_with_all_that_they_have(name, tmp_path):
    if name.startswith("our_"):
        own = {"our_mug": mug, "our_bracket": l_bracket, "our_bottle": bottle}[name]()
        path = tmp_path / "own.ply"
        path.write_bytes(written(own.trimesh, "ply"))
        known = {
            "vertices": len(own.vertices),
            "faces": len(own.faces),
            "watertight": True,
            "boundary_edges": 0,
        }
        known |= {"extents_m": own.extents, "signed_volume_cm3": own.volume * 1e6}
    else:
        known = published_objects()[name]
        path = OBJECTS / known["file"]
    mesh, report = read_file(path)
    assert (report.vertices_in_file, report.faces_in_file) == (known["vertices"], known["faces"])
    assert (report.watertight, report.boundary_edges) == (known["watertight"], known["boundary_edges"])
    assert (report.components, report.nonmanifold_edges, report.flipped_faces) == (1, 0, 0)
    assert mesh.extents == pytest.approx(known["extents_m"], abs=1e-5)
    if report.watertight:
        assert report.volume == pytest.approx(known["signed_volume_cm3"] * 1e-6, rel=1e-4)
