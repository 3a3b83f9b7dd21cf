"""What users' files did to intake, mass and clouds: each kind, in each format, from Python."""

import numpy as np
import pytest
import trimesh

import field_cases as case
from fingersplit.errors import ObjectFileError
from fingersplit.objects.cloud.planes import scene_share
from fingersplit.objects.intake import read_bytes, read_mesh
from fingersplit.objects.loading import load_object
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.source import ObjectSource

MM = ObjectSource("mm")
WRITERS = {"obj": case.as_obj, "off": case.as_off, "ply": case.as_ply}
CUBE = trimesh.creation.box((30, 30, 30))


def moved(mesh: trimesh.Trimesh, *offset: float) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices + offset, mesh.faces, process=False)


@pytest.mark.parametrize("file_type", WRITERS)
@pytest.mark.parametrize(("outline", "area", "volume"), [(case.NOTCHED, 144.0, 72.0), (case.DART, 51.83, 15.0)])
def test_polygons_that_are_not_convex_are_cut_right_from_every_corner(file_type, outline, area, volume):
    hashes = set()
    for start in range(len(outline)):
        data = WRITERS[file_type](case.prism(case.rotated(outline, start), 30))
        mesh, report = read_mesh(data, file_type, MM)
        assert mesh.area == pytest.approx(area * 1e-4, rel=1e-4)
        assert (report.watertight, report.volume_method, report.remarks) == (True, "surface", [])
        assert report.volume == pytest.approx(volume * 1e-6)
        triangles = np.sort(np.sort(mesh.vertices[mesh.faces].round(9), axis=1).reshape(-1, 9), axis=0)
        hashes.add(triangles.tobytes())
    assert len(hashes) == 1


def test_mixed_binary_ply_has_the_faces_of_the_text():
    prism = case.prism(case.NOTCHED, 30)
    read = [read_mesh(case.as_ply(prism, encoding=e), "ply", MM)[0] for e in ("binary_big_endian", "ascii")]
    np.testing.assert_allclose(read[0].vertices, read[1].vertices, atol=1e-9)
    np.testing.assert_array_equal(read[0].faces, read[1].faces)


@pytest.mark.parametrize("file_type", WRITERS)
@pytest.mark.parametrize(
    "outline", [[(0, 0), (40, 40), (40, 0), (0, 40)], [(0, 0), (20, 50), (40, 0), (-5, 30), (45, 30)]]
)
def test_polygons_that_cross_themselves_are_refused_by_number(file_type, outline):
    points, faces = case.prism(outline, 30)
    with pytest.raises(ObjectFileError, match=r"Face 2 of .* crosses itself") as refusal:
        read_mesh(WRITERS[file_type]((points, [faces[3], faces[1], *faces[4:]])), file_type, MM)
    assert refusal.value.code == "self_crossing"


@pytest.mark.parametrize("seed", range(25))
def test_any_star_shaped_polygon_is_covered_by_its_triangles(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 40))
    angles = (np.arange(n) + rng.uniform(0, 0.9, n)) * 2 * np.pi / n
    radii = rng.uniform(10, 60, n)
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    area = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    tilt = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    points, faces = case.prism(list(zip(x, y, strict=True)), 20)
    mesh, report = read_mesh(case.as_obj(((np.array(points) @ tilt.T).tolist(), faces)), "obj", MM)
    assert report.watertight
    assert report.volume == pytest.approx(20e-9 * area, rel=1e-6)
    perimeter = np.hypot(np.diff(x, append=x[0]), np.diff(y, append=y[0])).sum()
    assert mesh.area == pytest.approx((2 * area + 20 * perimeter) * 1e-6, rel=1e-6)


@pytest.mark.parametrize(
    ("parts", "volume", "center"),
    [
        ([CUBE, moved(CUBE, 30, 0, 0)], 54, (15, 0, 0)),
        ([CUBE, moved(trimesh.Trimesh(CUBE.vertices[:, [1, 0, 2]], CUBE.faces[:, ::-1]), 30, 0, 0)], 54, (15, 0, 0)),
        ([CUBE, moved(CUBE, 30, 0, 30)], 54, (15, 0, 15)),
        ([CUBE, moved(CUBE, 30, 30, 30)], 54, (15, 15, 15)),
        ([trimesh.creation.box(bounds=b) for b in ([(0, 0, 0), (80, 20, 20)], [(0, 0, 20), (20, 20, 80)])], 56, None),
        ([CUBE, trimesh.Trimesh(moved(CUBE, 30, 0, 30).vertices, CUBE.faces[:, ::-1])], 54, (15, 0, 15)),
        ([CUBE, trimesh.Trimesh(moved(CUBE, 30, 0, 0).vertices[:, [0, 2, 1]], CUBE.faces)], 54, (15, 0, 0)),
    ],
    ids=["sides", "sides_crossed", "edge", "corner", "ell", "edge_one_inside_out", "sides_one_inside_out"],
)
def test_closed_surfaces_that_are_not_manifold_have_their_own_volume(parts, volume, center):
    mesh, report = read_mesh(case.as_obj(case.joined(*parts)), "obj", MM)
    assert report.volume_method == "surface"
    assert mesh.volume == pytest.approx(volume * 1e-6)
    if center is not None:
        np.testing.assert_allclose(mesh.center_of_mass, np.array(center) / 1000, atol=1e-9)


def test_a_hole_of_no_size_changes_nothing():
    whole, holed = (read_mesh(case.as_obj(case.pinholed_ell(hole)), "obj", MM) for hole in (False, True))
    assert (whole[1].volume_method, holed[1].volume_method) == ("surface", "capped_holes")
    assert holed[1].volume == pytest.approx(56e-6, rel=1e-6)
    np.testing.assert_allclose(holed[0].center_of_mass, whole[0].center_of_mass, atol=1e-6)
    assert "1 hole" in holed[1].remarks[0]


@pytest.mark.parametrize("share", [0.2, 0.45, 0.8])
def test_parts_that_overlap_count_once(share):
    radius, apart = 30.0, 60.0 * share
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    lens = np.pi * (2 * radius - apart) ** 2 * (apart**2 + 4 * apart * radius) / (12 * apart)
    mesh, report = read_mesh(case.as_obj(case.joined(ball, moved(ball, apart, 0, 0))), "obj", MM)
    assert report.volume_method == "union"
    assert mesh.volume == pytest.approx((2 * 4 / 3 * np.pi * radius**3 - lens) * 1e-9, rel=0.01)
    np.testing.assert_allclose(mesh.center_of_mass, [apart / 2000, 0, 0], atol=3e-4)
    assert any("overlap" in remark for remark in report.remarks)


def test_hull_is_taken_where_openings_are_a_large_part_and_said():
    bowl = trimesh.creation.icosphere(subdivisions=3, radius=40)
    bowl.update_faces(bowl.triangles_center[:, 2] < 0)
    mesh, report = read_mesh(case.as_obj(case.joined(bowl)), "obj", MM)
    assert report.volume_method == "convex_hull"
    assert mesh.volume == pytest.approx(2 / 3 * np.pi * 0.04**3, rel=0.03)
    assert "convex hull" in report.remarks[0]


def prepared_cloud(tmp_path, **arrays: np.ndarray) -> ObjectModel:
    np.savez(tmp_path / "cloud.npz", **arrays)
    return load_object(tmp_path / "cloud.npz")


def test_normals_that_point_inwards_are_turned(tmp_path):
    points, normals = case.brick_with_normals()
    outward = prepared_cloud(tmp_path, points=points, normals=normals)
    inward = prepared_cloud(tmp_path, points=points, normals=-normals)
    assert inward.mass_properties.volume == outward.mass_properties.volume == pytest.approx(72e-6, rel=0.05)
    assert (np.linalg.eigvalsh(inward.inertia) > 0).all()
    assert "turned over" in inward.report.remarks[0]
    assert outward.report.remarks == []


def test_points_alone_are_said_to_leave_a_choice(tmp_path):
    points, normals = case.brick_with_normals()
    alone = prepared_cloud(tmp_path, points=points)
    assert "Neither usable normals nor a viewpoint" in alone.report.remarks[-1]
    contradicting = prepared_cloud(tmp_path, points=points, normals=np.random.default_rng(1).normal(size=normals.shape))
    assert contradicting.report.remarks == alone.report.remarks


@pytest.mark.parametrize("kind", ["random", "half", "cancelling", "zero", "alike"])
def test_normals_that_mean_nothing_never_make_a_negative_mass(tmp_path, kind):
    points, normals = case.brick_with_normals()
    rng = np.random.default_rng(1)
    if kind == "cancelling":  # two at each place, one against the other
        points, normals = np.vstack([points, points + 1e-7]), np.vstack([normals, -normals])
    else:
        made = {
            "random": rng.normal(size=points.shape),
            "half": normals * rng.choice([-1, 1], (len(points), 1)),
            "zero": np.zeros_like(points),
            "alike": np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        }
        normals = made[kind]
    model = prepared_cloud(tmp_path, points=points, normals=normals)
    assert model.mass > 0
    assert model.mass_properties.volume > 0
    assert (np.linalg.eigvalsh(model.inertia) > 0).all()


def test_scene_is_told_from_an_object_and_stays_as_large_as_it_was(tmp_path):
    points, viewpoint = case.box_on_table()
    model = prepared_cloud(tmp_path, points=points, viewpoint=viewpoint)
    assert "of the points lie in a plane" in model.report.remarks[0]
    assert "Cut the object out" in model.report.remarks[0]
    assert model.mesh.extents[:2] == pytest.approx([0.6, 0.6], abs=0.04)
    assert model.mesh.extents[2] < 0.08  # 30 mm were seen
    assert model.collision.points[:, 2].max() < 0.56
    points, normals = case.brick_with_normals()
    front = normals @ [0.1, 0.2, -1.0] > 0
    assert prepared_cloud(tmp_path, points=points[front]).report.plane_share == 0


def test_several_things_on_a_table_are_a_scene_and_a_tray_is_none():
    rng = np.random.default_rng(1)
    table = np.c_[rng.uniform(-0.3, 0.3, (8_000, 2)), np.zeros(8_000)]
    points, normals = case.brick_with_normals(700)
    brick = points[normals[:, 2] > -0.5] + [0, 0, 0.02]
    bricks = [np.add(brick, [x, y, 0]) for x in (-0.22, 0, 0.22) for y in (-0.22, 0, 0.22)]
    assert scene_share(np.vstack([table, *bricks])) > 0.5
    floor = table * 0.5
    rim = np.c_[rng.uniform(-0.15, 0.15, 3_000), rng.choice([-0.15, 0.15], 3_000), rng.uniform(0.0, 0.03, 3_000)]
    assert scene_share(np.vstack([floor, rim, rim[:, [1, 0, 2]]])) == 0


@pytest.mark.parametrize("count", [210, 300, 420])
def test_few_points_are_enough_for_an_object(tmp_path, count):
    points, normals = case.brick_with_normals(count)
    model = prepared_cloud(tmp_path, points=points, normals=normals)
    assert model.mass_properties.volume == pytest.approx(72e-6, rel=0.2)


PLATE = trimesh.creation.box(bounds=[(0, 0, 0), (40, 30, 20)])
MARK = b"\xef\xbb\xbf"


@pytest.mark.parametrize("file_type", ["obj", "off", "ply", "stl_ascii"])
def test_byte_order_mark_is_skipped(file_type):
    mesh = case.joined(PLATE)
    data = PLATE.export(file_type="stl_ascii").encode() if file_type == "stl_ascii" else WRITERS[file_type](mesh)
    _, report = read_mesh(MARK + data, file_type.removesuffix("_ascii"), MM)
    assert report.volume == pytest.approx(24e-6)
    assert (report.vertices_in_file, report.vertices) == (36 if file_type == "stl_ascii" else 8, 8)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_strips_are_read_as_the_triangles_they_stand_for(encoding):
    mesh, report = read_bytes(case.as_ply(case.strip_ball(30), "tristrips", encoding), "ply", MM)
    assert report.watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=0.02)
    with pytest.raises(ObjectFileError, match="'polygons' lists vertices") as refusal:
        read_bytes(case.as_ply(case.joined(PLATE), "polygons", encoding), "ply", MM)
    assert refusal.value.code == "unknown_faces"


@pytest.mark.parametrize("file_type", ["obj", "off", "ply", "stl_ascii"])
def test_lines_may_end_in_carriage_returns_alone(file_type):
    data = (
        PLATE.export(file_type="stl_ascii").encode()
        if file_type == "stl_ascii"
        else WRITERS[file_type](case.joined(PLATE))
    )
    for end in (b"\r", b"\r\n"):
        _, report = read_mesh(data.replace(b"\n", end), file_type.removesuffix("_ascii"), MM)
        assert (report.volume, report.vertices) == (pytest.approx(24e-6), 8)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
@pytest.mark.parametrize("file_type", ["obj", "off", "ply", "stl_ascii"])
def test_text_in_wide_characters_is_named(file_type, encoding):
    data = (
        PLATE.export(file_type="stl_ascii").encode()
        if file_type == "stl_ascii"
        else WRITERS[file_type](case.joined(PLATE))
    )
    with pytest.raises(ObjectFileError, match=encoding[:6].upper()) as refusal:
        read_bytes(data.decode().encode(encoding), file_type.removesuffix("_ascii"), MM)
    assert refusal.value.code == "wrong_encoding"


OTHERS = {
    "glb": (PLATE.export(file_type="glb"), "suffix .glb"),
    "ply": (case.as_ply(case.joined(PLATE)), "suffix .ply"),
    "off": (case.as_off(case.joined(PLATE)), "suffix .off"),
    "obj": (case.as_obj(case.joined(PLATE)), "suffix .obj"),
    "stl": (PLATE.export(file_type="stl_ascii").encode(), "suffix .stl"),
    "json": (b'{"asset": {"version": "2.0"}}', "export the mesh"),
    "step": (b"ISO-10303-21;\nHEADER;\n", "is STEP"),
    "png": (b"\x89PNG\r\n\x1a\n" + bytes(200), "PNG"),
    "xml": (b'<?xml version="1.0"?><Error/>', "XML"),
}


@pytest.mark.parametrize(
    ("content", "suffix"),
    [(c, s) for c in OTHERS for s in ("stl", "obj", "ply", "off", "glb", "pcd") if c != s],
)
def test_a_file_of_another_format_is_called_that(content, suffix):
    data, words = OTHERS[content]
    with pytest.raises(ObjectFileError, match=words) as refusal:
        read_bytes(data, suffix, MM)
    assert refusal.value.code == "other_format"


TEXT = case.as_obj(case.joined(PLATE))
STL_TEXT = PLATE.export(file_type="stl_ascii").encode()


@pytest.mark.parametrize(
    ("data", "file_type", "code", "words"),
    [
        (TEXT.replace(b"40", b"40,5", 1), "obj", "malformed", "line 1 has '40,5', a number with a comma|has '40,5'"),
        (TEXT.decode().encode("utf-16"), "obj", "wrong_encoding", "text in UTF-16; save it as UTF-8"),
        (case.as_stl(PLATE, b"x"), "stl", "count_mismatch", "12 triangles, but 1 byte follows the last"),
        (STL_TEXT.replace(b"endsolid", b"end"), "stl", "truncated", "'endsolid' is missing"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n", "stl", "pointer", "Git LFS"),
        (b"/annex/objects/SHA256E-s1--00.obj\n", "obj", "pointer", "git-annex"),
        (b"\x1f\x8b\x08" + bytes(50), "obj", "packed", "gzip"),
        (b"v 0,0,0\n" + TEXT, "obj", "malformed", "line 1 has '0,0,0'; numbers are separated by blanks"),
        (b"OFF BINARY\n" + bytes(300), "off", "binary_off", "save it as text"),
        (b"<?xml version='1.0'?><Error/>", "npz", "other_format", "XML"),
        (b"{\\rtf1}", "obj", "other_format", "RTF"),
        (b"<!DOCTYPE html><html></html>", "stl", "web_page", "web page"),
        (case.as_glb({"asset": {}, "scenes": [{"nodes": [0]}], "nodes": [{}]}), "glb", "no_faces", "no mesh in it"),
    ],
)  # fmt: skip
def test_messages_say_what_is_wrong_and_name_no_library(data, file_type, code, words):
    with pytest.raises(ObjectFileError, match=words) as refusal:
        read_bytes(data, file_type, MM)
    assert refusal.value.code == code
    assert not any(word in str(refusal.value) for word in ("Error", "Exception", "numpy", "trimesh", "<class", "b'"))


def scene_without_scenes(**more: object) -> bytes:
    positions = np.asarray(PLATE.vertices / 1000, "<f4").tobytes()
    indices = np.asarray(PLATE.faces, "<u2").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"children": [1]}, {"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions)},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(positions) + len(indices)}],
    }
    return case.as_glb(document | more, positions + indices)


def test_glb_without_scenes_is_read_and_unknown_required_extensions_are_not():
    assert read_mesh(scene_without_scenes(), "glb")[1].volume == pytest.approx(24e-6)
    harmless = scene_without_scenes(extensionsRequired=["KHR_materials_unlit", "KHR_texture_transform"])
    assert read_mesh(harmless, "glb")[1].volume == pytest.approx(24e-6)
    with pytest.raises(ObjectFileError, match="requires the extension VENDOR_instances") as refusal:
        read_mesh(scene_without_scenes(extensionsRequired=["VENDOR_instances"]), "glb")
    assert refusal.value.code == "unknown_extension"


def test_what_intake_did_stands_in_every_document(tmp_path):
    inner = trimesh.creation.icosphere(subdivisions=2, radius=5)
    for number, (parts, words) in enumerate(
        [
            ([CUBE, inner], "1 part inside another"),
            ([CUBE, moved(CUBE, 70, 0, 0)], "2 parts that share no vertex"),
            ([trimesh.Trimesh(CUBE.vertices, CUBE.faces[:, ::-1])], "12 triangles of 12 turned over"),
        ]
    ):
        path = tmp_path / f"{number}.obj"
        path.write_bytes(case.as_obj(case.joined(*parts)))
        report = load_object(path, unit="mm").to_document()["report"]
        assert any(words in remark for remark in report["remarks"])
        assert report["volume_method"] == "surface"


def test_parts_that_touch_in_a_vertex_are_turned_each_by_itself():
    above = trimesh.creation.cone(20, 30, sections=24)
    below = trimesh.creation.cone(20, 30, sections=24)
    below.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [1, 0, 0], [0, 0, 30]))
    below.invert()
    mesh, report = read_mesh(case.as_obj(case.joined(above, below)), "obj", MM)
    assert report.components == 1
    assert mesh.volume == pytest.approx(2e-9 * above.volume, rel=1e-6)


def test_union_of_boxes_is_exact_to_half_a_percent():
    lying, standing = (trimesh.creation.box((60, 20, 20)), trimesh.creation.box((20, 60, 30)))
    mesh, report = read_mesh(case.as_obj(case.joined(lying, standing)), "obj", MM)
    assert report.volume_method == "union"
    assert mesh.volume == pytest.approx(52e-6, rel=0.005)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("width", [0.002, 0.05])
def test_cracks_are_closed(axis, width):
    outline = np.array([(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)], float)
    ell = trimesh.creation.extrude_triangulation(outline, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 30)
    ell = ell.subdivide().subdivide()
    beyond = ell.triangles_center[:, axis] > 12
    vertices = np.vstack([ell.vertices, ell.vertices + np.array([width, 0, width / 2])])
    faces = np.where(beyond[:, None], ell.faces + len(ell.vertices), ell.faces)
    mesh, report = read_mesh(case.as_obj((vertices.tolist(), faces.tolist())), "obj", MM)
    assert report.watertight
    assert report.components == 1
    assert mesh.volume == pytest.approx(60e-6, rel=0.003)


@pytest.mark.parametrize("shape", ["brick", "plate", "cup"])
@pytest.mark.parametrize("kind", ["half", "alike"])
def test_normals_that_cannot_be_those_of_the_points_are_left_out(tmp_path, shape, kind):
    made = {
        "brick": trimesh.creation.box((0.06, 0.04, 0.03)),
        "plate": trimesh.creation.box((0.1, 0.06, 0.006)),
        "cup": trimesh.creation.annulus(0.026, 0.031, 0.08, sections=48),
    }[shape]
    points, sides = trimesh.sample.sample_surface(made, 2_500, seed=1)
    normals = made.face_normals[sides]
    wrong = normals * np.where(points[:, :1] > 0, -1, 1) if kind == "half" else np.tile([0.0, 0, 1], (len(points), 1))
    model = prepared_cloud(tmp_path, points=points, normals=wrong)
    assert not model.report.normals
    assert model.mass_properties.volume == pytest.approx(made.volume, rel=0.2)
    assert prepared_cloud(tmp_path, points=points, normals=normals).report.normals


def test_normals_from_all_sides_are_turned_though_a_camera_is_named(tmp_path):
    points, normals = case.brick_with_normals()
    model = prepared_cloud(tmp_path, points=points, normals=-normals, viewpoint=np.array([0, 0, 0.6]))
    assert model.report.normals_turned
    assert model.mass_properties.volume == pytest.approx(72e-6, rel=0.1)


def _seen(meshes, counts, camera):
    """Points of boxes that face a camera and that no box hides, of each as many as its count before that."""
    whole, seen = trimesh.util.concatenate(meshes), []
    for mesh, count in zip(meshes, counts, strict=True):
        points, sides = trimesh.sample.sample_surface(mesh, count, seed=1)
        towards = camera - points
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        points, towards = (
            each[np.einsum("ij,ij->i", mesh.face_normals[sides], towards) > 0.05] for each in (points, towards)
        )
        seen.append(points[~whole.ray.intersects_any(points + 1e-4 * towards, towards)])
    return np.vstack(seen)


@pytest.mark.parametrize("camera", [(0.1, -0.8, 0.7), (-0.5, -0.6, 0.5)])
@pytest.mark.parametrize(("counts", "wall"), [((8_000, 2_500), False), ((2_000, 3_000, 2_000), True)])
def test_sparse_tables_and_floors_with_a_wall_are_scenes(camera, counts, wall):
    brick = trimesh.creation.box(bounds=[(-0.04, -0.03, 0), (0.04, 0.03, 0.1)])
    table = trimesh.creation.box(bounds=[(-0.3, -0.3, -0.02), (0.3, 0.3, 0)])
    back = [trimesh.creation.box(bounds=[(-0.3, 0.3, 0), (0.3, 0.32, 0.4)])] * wall
    points = _seen([brick, table, *back], counts, np.array(camera))
    assert scene_share(points, np.array(camera)) > 0.2


def _bin(width: float, depth: float, height: float, wall: float) -> list[trimesh.Trimesh]:
    """An open box: floor, then walls."""
    x, y = width / 2, depth / 2
    low_high = [
        ((-x, -y, -wall), (x, y, 0)),
        ((-x, y, 0), (x, y + wall, height)),
        ((-x, -y - wall, 0), (x, -y, height)),
    ]
    low_high += [((x, -y, 0), (x + wall, y, height)), ((-x - wall, -y, 0), (-x, y, height))]
    return [trimesh.creation.box(bounds=corners) for corners in low_high]


@pytest.mark.parametrize("camera", [(0.05, -0.3, 0.7), (-0.4, -0.3, 0.6)])
@pytest.mark.parametrize("size", [(0.4, 0.3, 0.1), (0.3, 0.24, 0.08)])
def test_things_in_bins_are_scenes_and_open_boxes_are_none(camera, size):
    bricks = [trimesh.creation.box(bounds=[(-0.04, -0.03, 0), (0.04, 0.03, 0.06)])]
    bricks += [trimesh.creation.box(bounds=[(0.06, 0.02, 0), (0.09, 0.07, 0.04)])]
    whole = bricks + _bin(*size, 0.01)
    points = _seen(whole, [int(30_000 * each.area) for each in whole], np.array(camera))
    assert scene_share(points, np.array(camera)) > 0.2
    assert scene_share(points) > 0.2
    box = _bin(*(0.4 * np.array(size)), 0.004)
    points = _seen(box, [int(100_000 * each.area) for each in box], np.array(camera))
    assert scene_share(points, np.array(camera)) == 0


@pytest.mark.parametrize("size", [(0.24, 0.17, 0.03), (0.1, 0.06, 0.004), (0.06, 0.19, 0.3), (0.3, 0.3, 0.3)])
@pytest.mark.parametrize("camera", [(0.2, -0.7, 0.7), (0.6, 0.3, 0.75)])
def test_single_boxes_books_and_plates_are_no_scenes(size, camera):
    points = _seen([trimesh.creation.box(size)], [6_000], np.array(camera))
    assert scene_share(points, np.array(camera)) == 0
    assert scene_share(points) == 0
    assert scene_share(trimesh.sample.sample_surface(trimesh.creation.box(size), 3_000, seed=1)[0]) == 0


@pytest.mark.parametrize("end", [b"\x1a", b"\0\0", b"\r\n\r\n"])
@pytest.mark.parametrize("file_type", WRITERS)
def test_marks_of_old_systems_around_a_text_mean_nothing(file_type, end):
    text = WRITERS[file_type](case.joined(PLATE))
    mesh, _ = read_bytes(MARK + b"\n" + text + end, file_type, MM)
    assert mesh.volume == pytest.approx(24e-6, rel=1e-6)


def test_old_faces_of_obj_are_faces():
    mesh, _ = read_mesh(TEXT.replace(b"f ", b"fo "), "obj", MM)
    assert mesh.volume == pytest.approx(24e-6, rel=1e-6)
