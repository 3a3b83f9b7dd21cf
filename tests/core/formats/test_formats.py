"""Every import format, from small files made here: the box is met where its faces are."""

import json

import h5py
import numpy as np
import pytest
import trimesh
import yaml
from scipy.spatial.transform import Rotation

from fingersplit.errors import FormatError
from fingersplit.formats import formats_that, import_parallel_grasps
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.preparing import prepare_object

FACES = [[[0.025, 0, 0], [-0.025, 0, 0]], [[0, 0.035, 0], [0, -0.035, 0]]]
"""Where jaws through the middle of the 50 x 70 x 120 mm box along x and along y touch it."""
PANDA_DEPTH = 0.103


def panda_pose(closing, approach=(0, 0, -1), x_closes=True):
    """Pose of a Panda about the box whose pads stand in its middle."""
    closing, z = np.array(closing, dtype=float), np.array(approach, dtype=float)
    columns = [closing, np.cross(z, closing), z] if x_closes else [np.cross(closing, z), closing, z]
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack(columns)
    pose[:3, 3] = -PANDA_DEPTH * z
    return pose


ALONG_X, ALONG_Y = panda_pose((1, 0, 0)), panda_pose((0, 1, 0))


def write_acronym(path, transforms, held):
    with h5py.File(path, "w") as file:
        file["grasps/transforms"] = transforms
        file["grasps/qualities/flex/object_in_gripper"] = held
        file["object/scale"] = 0.5
        file["gripper/type"] = "panda"


def write_dexnet(path, configurations, objects=("box",), kind="ParallelJawPtGrasp3D"):
    with h5py.File(path, "w") as file:
        for name in objects:
            for i, configuration in enumerate(configurations):
                grasp = file.create_group(f"datasets/set/objects/{name}/grasps/gripper/grasp_{i}")
                grasp.attrs.update({"id": i, "type": kind, "configuration": configuration, "frame": "object"})
                grasp.create_group("metrics").attrs["ferrari_canny"] = float(i)


def write_json(path, document):
    path.write_text(json.dumps(document))


def isaac_document(frame="panda_hand"):
    def entry(pose, confidence):
        x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
        return {
            "confidence": confidence,
            "position": pose[:3, 3].tolist(),
            "orientation": {"w": w, "xyz": [x, y, z]},
            "cspace_position": {"panda_finger_joint1": 0.02},
        }

    poses = [panda_pose(axis, x_closes=False) for axis in ((1, 0, 0), (0, 1, 0))]
    grasps = {f"grasp_{i}": entry(pose, 0.5 - 0.1 * i) for i, pose in enumerate(poses)}
    links = {"object_frame_link": "/World/box", "gripper_frame_link": f"/World/{frame}"}
    return {"format": "isaac_grasp", "format_version": 1.0, **links, "grasps": grasps}


def graspnet_row(score, width, closing, approach, object_id=3):
    closing, approach = np.array(closing, dtype=float), np.array(approach, dtype=float)
    rotation = np.column_stack([approach, closing, np.cross(approach, closing)])
    return [score, width, 0.02, 0.02, *rotation.ravel(), *(-0.01 * approach), object_id]


FILES = {
    "fingersplit": ("own.json", lambda p: write_json(p, [{"contacts": c, "approach": [0, 0, -1]} for c in FACES])),
    "acronym": ("acronym.h5", lambda p: write_acronym(p, [ALONG_X, ALONG_Y], [1, 1])),
    "graspgen": (
        "graspgen.json",
        lambda p: write_json(
            p,
            {
                "object": {"file": "box.obj", "scale": 1.0},
                "grasps": {"transforms": [ALONG_X.tolist(), ALONG_Y.tolist()], "object_in_gripper": [True, True]},
            },
        ),
    ),
    "dexnet": (
        "dexnet.hdf5",
        lambda p: write_dexnet(
            p, [[0, 0, 0, 0, 1, 0, 0.08, np.pi, 0.01, 0.0], [0, 0, 0, 1, 0, 0, 0.06, np.pi / 2, 0.01, 0.0]]
        ),
    ),
    "dexnet_service": (
        "service.json",
        lambda p: write_json(
            p,
            [
                {"center": [0, 0, 0], "axis": [0, 2, 0], "open_width": 0.08, "metric_score": 0.1},
                {"center": [0, 0, 0], "axis": [1, 0, 0], "open_width": 0.06, "metric_score": 0.9},
            ],
        ),
    ),
    "isaac_grasp": ("isaac.yaml", lambda p: p.write_text(yaml.safe_dump(isaac_document()))),
    "graspnet": (
        "graspnet.npy",
        lambda p: np.save(
            p,
            np.array([graspnet_row(0.1, 0.08, (0, 1, 0), (0, 0, -1)), graspnet_row(0.9, 0.06, (1, 0, 0), (0, 0, -1))]),
        ),
    ),
}


def test_every_format_is_tried_here():
    assert set(FILES) == set(formats_that("read_parallel"))


@pytest.mark.parametrize("name", FILES)
def test_jaws_close_on_the_faces(prepared, tmp_path, name):
    file, write = FILES[name]
    write(tmp_path / file)
    imported = import_parallel_grasps(tmp_path / file, prepared("box"))
    assert imported.format == name
    sides = 4 if name == "dexnet_service" else 1
    np.testing.assert_allclose(imported.grasps.contacts[::sides], FACES, atol=1e-9)
    across = imported.grasps.contacts[:, 0] - imported.grasps.contacts[:, 1]
    np.testing.assert_allclose(np.einsum("ij,ij->i", across, imported.grasps.approaches), 0, atol=1e-9)
    assert imported.listed == imported.promising == len(imported.grasps) == 2 * sides
    assert f"found for {2 * sides} of {2 * sides}" in imported.message
    again = import_parallel_grasps(tmp_path / file, prepared("box"), name)
    np.testing.assert_array_equal(again.grasps.contacts, imported.grasps.contacts)


@pytest.mark.parametrize("name", ["acronym", "graspgen", "isaac_grasp", "graspnet"])
def test_grippers_come_from_where_their_frame_says(prepared, tmp_path, name):
    file, write = FILES[name]
    write(tmp_path / file)
    approaches = import_parallel_grasps(tmp_path / file, prepared("box")).grasps.approaches
    np.testing.assert_allclose(approaches, [[0, 0, -1], [0, 0, -1]], atol=1e-12)


def test_dexnet_approach_angle_turns_about_the_jaws(prepared, tmp_path):
    """Axis along y: the approach at angle 0 is the frame's x = (1, 0, 0), a quarter turn on it is x cross y = z."""
    rows = [[0, 0, 0, 0, 1, 0, 0.08, angle, 0.01] for angle in (np.pi, np.pi / 2, 0.0)]  # nine floats, as old files
    write_dexnet(tmp_path / "old.h5", rows)
    approaches = import_parallel_grasps(tmp_path / "old.h5", prepared("box")).grasps.approaches
    np.testing.assert_allclose(approaches, [[1, 0, 0], [0, 0, 1], [-1, 0, 0]], atol=1e-12)


def test_failed_grasps_are_left_out_and_counted(prepared, tmp_path):
    aside = ALONG_X.copy()
    aside[2, 3] += 0.5
    write_acronym(tmp_path / "a.h5", [ALONG_X, ALONG_Y, aside, ALONG_Y], [0, 1, 1, 1])
    imported = import_parallel_grasps(tmp_path / "a.h5", prepared("box"))
    assert (imported.listed, imported.promising, len(imported.grasps)) == (4, 3, 2)
    assert imported.message == (
        "ACRONYM HDF5 with 4 grasps, 1 of which failed by its own account; contacts were found for 2 of 3."
    )


def test_object_of_a_database_is_chosen_by_name(prepared, tmp_path):
    row = [0, 0, 0, 1, 0, 0, 0.06, 0.0, 0.01, 0.0]
    write_dexnet(tmp_path / "two.h5", [row], objects=("box", "bottle"))
    assert len(import_parallel_grasps(tmp_path / "two.h5", prepared("box")).grasps) == 1
    with pytest.raises(FormatError, match=r"grasps of 2 objects \(bottle, box\); name the mesh file after"):
        import_parallel_grasps(tmp_path / "two.h5", prepared("sphere"))


def test_acronym_sample_imports(objects_folder):
    """The sample beside the project, where it is; the other tests make files of the same layout."""
    folder = objects_folder and objects_folder.parent / "grasps"
    files = sorted(folder.glob("acronym_*.h5")) if folder and folder.is_dir() else []
    for path in files:
        with h5py.File(path) as file:
            scale, held = float(file["object/scale"][()]), int(file["grasps/qualities/flex/object_in_gripper"][:].sum())
        solid = trimesh.load(path.with_name(path.stem.rsplit("_", 1)[0] + ".obj"), process=False, force="mesh")
        model = prepare_object(Mesh(scale * solid.vertices, solid.faces), "mug")
        imported = import_parallel_grasps(path, model)
        assert (imported.listed, imported.promising) == (2000, held)
        assert len(imported.grasps) > 0.95 * held
        widths = np.linalg.norm(imported.grasps.contacts[:, 0] - imported.grasps.contacts[:, 1], axis=1)
        assert widths.max() <= 0.082
        assert np.abs(model.mesh.trimesh.nearest.signed_distance(imported.grasps.contacts[:50, 0])).max() < 1e-6
        unscaled = prepare_object(Mesh(0.3 * scale * solid.vertices + 1.0, solid.faces), "mug")
        with pytest.raises(FormatError, match=r"closes on the object.* object scale: give the mesh a scale of 0.00026"):
            import_parallel_grasps(path, unscaled)
