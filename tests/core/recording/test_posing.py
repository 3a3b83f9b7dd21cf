"""Where bodies stand in a recording, which points they meet, and what their meshes look like."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from fingersplit.hands.shapes_kernel import shape_distance
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.posing import hand_links, points_in_collision, pose_links, turn_z_to
from fingersplit.recording.raycast import Layer
from fingersplit.recording.shading import shade_object
from fingersplit.transforms import pose_matrix


def test_links_are_posed_as_the_hand_poses_their_shapes(barrett):
    rng, count = np.random.default_rng(4), 40
    joints = rng.uniform(barrett.lower, barrett.upper, (count, len(barrett.joint_names)))
    palms, places = Rotation.random(count, rng=rng).as_matrix(), rng.normal(size=(count, 3))
    poses = pose_links(barrett, joints, palms, places)
    np.testing.assert_allclose(np.linalg.norm(poses.xyzw, axis=-1), 1, atol=1e-12)
    for row in range(count):
        expected = barrett.shape_poses(joints[row], pose_matrix(palms[row], places[row]))
        for b, link in enumerate(hand_links(barrett)):
            turn = Rotation.from_quat(poses.xyzw[b, row])
            for shape in link.shapes:
                rotation = turn.as_matrix() @ barrett.arrays.shape_rotations[shape]
                center = turn.as_matrix() @ barrett.arrays.shape_positions[shape] + poses.positions[b, row]
                np.testing.assert_allclose(pose_matrix(rotation, center), expected[shape], atol=1e-12)


def test_found_points_are_all_the_collision_points_inside_a_shape(barrett):
    model, rng = prepare_object(cylinder(), "cylinder"), np.random.default_rng(6)
    final = plan(model, barrett, starts=8, top_k=1, seed=3).grasps[0].for_hand(barrett)
    states = [final.joints + rng.normal(scale=0.2, size=len(barrett.joint_names)) for _ in "1234"]
    palm = final.object_from_palm
    places = palm[:3, 3] + rng.normal(scale=0.02, size=(len(states), 3))
    turns = np.tile(palm[:3, :3], (len(states), 1, 1))
    found = points_in_collision(barrett, model, np.array(states), turns, places)
    assert sum(len(points) > 3 for points in found) >= 2
    kinds, sizes = barrett.arrays.shape_kinds, barrett.arrays.shape_sizes
    for points, joints, place in zip(found, states, places, strict=True):
        inside = np.zeros(len(model.collision.points), dtype=bool)
        for shape, pose in enumerate(barrett.shape_poses(joints, pose_matrix(palm[:3, :3], place))):
            local = (model.collision.points - pose[:3, 3]) @ pose[:3, :3]
            inside |= [shape_distance(kinds[shape], sizes[shape], *point) < 0 for point in local]
        np.testing.assert_array_equal(points, model.collision.points[inside])


def test_shading_turns_no_normal_far_and_loses_no_face():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.035)
    rough = 1 + 0.003 * np.random.default_rng(1).normal(size=(len(ball.vertices), 1))
    mesh = Mesh(ball.vertices * rough, ball.faces)
    shaded = shade_object(mesh)
    assert len(shaded.faces) == len(mesh.faces)
    assert shaded.vertices[shaded.faces].astype(float).sum() == pytest.approx(mesh.vertices[mesh.faces].sum(), abs=1e-3)
    exact = Layer(mesh.vertices, mesh.faces, (0.0, 0.0, 0.0, 1.0)).corner_normals
    corners = {}
    for corner, normal in zip(
        mesh.vertices[mesh.faces].astype(np.float32).reshape(-1, 3), exact.reshape(-1, 3), strict=True
    ):
        corners.setdefault(corner.tobytes(), []).append(normal)
    for vertex, normal in zip(shaded.vertices, shaded.normals, strict=True):
        assert min(np.linalg.norm(normal - one) for one in corners[vertex.tobytes()]) < np.sqrt(3) / 512


def test_turning_z_reaches_every_direction():
    directions = np.vstack([np.eye(3), -np.eye(3), np.random.default_rng(2).normal(size=(20, 3))])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(Rotation.from_quat(turn_z_to(directions)).apply((0, 0, 1)), directions, atol=1e-12)
