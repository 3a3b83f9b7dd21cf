"""Each file format is read as its own rules say, from files written here."""

import json
from collections.abc import Sequence

import numpy as np
import pytest
import trimesh

from fingersplit.objects.intake import read_mesh

TETRAHEDRON = (
    [[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
)


def box() -> trimesh.Trimesh:
    return trimesh.creation.box((0.04, 0.06, 0.1))


def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2, radius=0.05)


def written(mesh: trimesh.Trimesh | trimesh.Scene, file_type: str, **options: object) -> bytes:
    data = mesh.export(file_type=file_type, **options)
    return data.encode() if isinstance(data, str) else data


@pytest.mark.parametrize("shape", [box, ball])
@pytest.mark.parametrize(
    ("file_type", "options"),
    [
        ("stl", {}),
        ("stl", {"ascii": True}),
        ("obj", {}),
        ("ply", {}),
        ("ply", {"encoding": "ascii"}),
        ("off", {}),
        ("glb", {}),
    ],
)
def test_each_format_comes_back_as_it_was_written(shape, file_type, options):
    original = shape()
    export = "stl_ascii" if options.pop("ascii", False) else file_type
    mesh, report = read_mesh(written(original, export, **options), file_type)
    assert (len(mesh.vertices), len(mesh.faces)) == (len(original.vertices), len(original.faces))
    assert np.sort(mesh.vertices, axis=0) == pytest.approx(np.sort(original.vertices, axis=0), abs=1e-8)
    assert report.volume == pytest.approx(original.volume, rel=1e-6)
    assert report.area == pytest.approx(original.area, rel=1e-6)
    assert report.volume == pytest.approx(mesh.volume, rel=1e-9)
    assert (report.watertight, report.components, report.flipped_faces) == (True, 1, 0)
    assert mesh.faces.dtype == np.int32


def test_clean_mesh_keeps_its_order_of_vertices_and_faces():
    mesh, _ = read_mesh(written(ball(), "ply"), "ply")
    assert np.array_equal(mesh.faces, ball().faces)
    assert mesh.vertices == pytest.approx(ball().vertices, abs=1e-8)


def test_binary_ply_reads_big_endian_mixed_polygons_and_steps_over_the_rest():
    header = (
        "ply\nformat binary_big_endian 1.0\ncomment made by hand\n"
        "element material 2\nproperty list uchar short tags\n"
        "element vertex 5\nproperty uchar red\nproperty double z\nproperty double y\nproperty double x\n"
        "element face 5\nproperty uchar flags\n"
        "property list ushort int vertex_index\nproperty list uchar float uv\n"
        "element edge 1\nproperty int vertex1\nend_header\n"
    )
    corners = [(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0), (0.05, 0.05, 0.1)]
    faces = [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    body = bytes([1, 0, 7, 0]) + b"".join(b"\xff" + np.array(c[::-1], ">f8").tobytes() for c in corners)
    for face in faces:
        body += b"\x01" + np.array(len(face), ">u2").tobytes() + np.array(face, ">i4").tobytes()
        body += b"\x02" + np.zeros(2, ">f4").tobytes()
    mesh, report = read_mesh(header.encode() + body + bytes(4), "ply")
    assert (len(mesh.vertices), len(mesh.faces), report.watertight) == (5, 6, True)
    assert report.volume == pytest.approx(0.1**3 / 3)
    below = mesh.vertices[mesh.faces][mesh.trimesh.face_normals[:, 2] < -0.99]
    assert below[..., :2].reshape(-1, 2).tolist() == [[0, 0], [0, 0.1], [0.1, 0.1], [0, 0], [0.1, 0.1], [0.1, 0]]


def test_ply_positions_stay_whatever_else_stands_beside_them():
    vertices, faces = TETRAHEDRON
    header = (
        "ply\nformat ascii 1.0\ncomment TextureFile other.png\n\nelement vertex 4\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element face 4\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
        "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    )
    rows = [f"{x} {y} {z} 0 0 1 {x} {y} 255 0 0" for x, y, z in vertices]
    rows += [f"3 {a} {b} {c} 6 0 0 .1 .1 .{k} 1" for k, (a, b, c) in enumerate(faces)]
    mesh, report = read_mesh((header + "\n\n".join([*rows, "0 1"])).encode(), "ply")
    assert mesh.vertices == pytest.approx(np.array(vertices), abs=1e-8)
    assert mesh.faces.tolist() == faces
    assert (report.vertices_in_file, report.merged_vertices) == (4, 0)


def test_obj_reads_relative_indices_textures_comments_and_line_ends():
    text = (
        "mtllib other.mtl\n# four corners\nv 0 0 0 1.0\r\nv 0.05 0 0 # second\n\tv 0 0.05 0\nv 0 0 0.05\n"
        "usemtl steel\nf 1/1/1 3/2/2 2/3/3\nf -4//1 -3//2 -1//3\nf 1/4 \\\n4/5 3/6 # back\nf 2 3 4\n"
    )
    mesh, report = read_mesh(text.encode(), "obj")
    assert np.array_equal(mesh.faces, TETRAHEDRON[1])
    assert report.volume == pytest.approx(0.05**3 / 6)


def test_off_reads_colours_comments_and_polygons():
    text = (
        "COFF\n# pyramid\n5 5 0\n0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 0 0 0\n0 1 0 0 0 0\n.5 .5 1 9 9 9\n\n"
        "4 0 3 2 1 255 0 0\n3 0 1 4\n3 1 2 4\n3 2 3 4  # last but one\n3 3 0 4 1 1 1\n"
    )
    _, report = read_mesh(text.encode(), "off")
    assert (report.faces, report.watertight, report.volume) == (6, True, pytest.approx(1 / 3))


def test_glb_scene_is_joined_with_its_transforms():
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1], point=[0.2, 0, 0])
    mirror = np.diag([-1.0, 1, 1, 1]) + np.array([[0, 0, 0, -0.3], [0] * 4, [0] * 4, [0] * 4])
    scene = trimesh.Scene()
    scene.add_geometry(box(), geom_name="box", node_name="first")
    scene.add_geometry(box(), geom_name="turned", node_name="second", transform=turn @ np.diag([2, 1, 1, 1]))
    scene.add_geometry(ball(), geom_name="mirrored", node_name="third", transform=mirror)
    mesh, report = read_mesh(written(scene, "glb"), "glb")
    assert (report.components, report.watertight, report.flipped_faces) == (3, True, 0)
    assert report.volume == pytest.approx(3 * box().volume + ball().volume, rel=1e-6)
    assert mesh.bounds == pytest.approx(scene.bounds, abs=1e-7)


def test_glb_nodes_without_triangles_pass_their_transform_on():
    parents = [{"camera": 0}, {"mesh": 1}]
    for parent in parents:
        nodes = [{"mesh": 0}, {**parent, "translation": [0.3, 0, 0], "children": [2]}, {"mesh": 0}]
        points = {"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}
        camera = {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}
        data = small_glb({}, nodes=nodes, scenes=[{"nodes": [0, 1]}], cameras=[camera], more_meshes=[points])
        mesh, report = read_mesh(data, "glb")
        assert (report.components, report.watertight) == (2, True)
        assert mesh.bounds[1] == pytest.approx([0.35, 0.05, 0.05])


@pytest.mark.parametrize(("mode", "corners"), [(5, [0, 1, 2, 3, 0, 1]), (4, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])])
def test_glb_strips_and_lists_give_the_same_solid(mode, corners):
    _, report = read_mesh(small_glb({"mesh": 0}, mode=mode, corners=corners), "glb")
    assert (report.watertight, report.faces, report.volume) == (True, 4, pytest.approx(0.05**3 / 6))


def small_glb(
    node: dict, mode: int = 4, corners: list[int] | None = None, more_meshes: Sequence[dict] = (), **changes: object
) -> bytes:
    """A GLB of one tetrahedron; ``changes`` replace top-level entries of its document."""
    indices = np.array(np.ravel(TETRAHEDRON[1]) if corners is None else corners, "<u2").tobytes()
    points = np.array(TETRAHEDRON[0], "<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}, *more_meshes],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": len(indices) // 2, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(points + indices)}],
        **changes,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary = points + indices + bytes(-len(points + indices) % 4)
    chunks = [
        len(text).to_bytes(4, "little"),
        b"JSON",
        text,
        len(binary).to_bytes(4, "little"),
        b"BIN\0",
        binary,
    ]
    length = 12 + sum(map(len, chunks))
    return b"glTF" + (2).to_bytes(4, "little") + length.to_bytes(4, "little") + b"".join(chunks)
