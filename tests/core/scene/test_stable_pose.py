"""Objects rest where MuJoCo's would."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from fingersplit.hands.hand import load_hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.scene import Constraints, Scene, SupportSurface
from fingersplit.scene.preparing import prepare_scene
from fingersplit.scene.stable_pose import stable_poses
from fingersplit.transforms import transform_points


@pytest.fixture(scope="module", params=sorted(PARAMETRIC_OBJECTS)[:6])
def model(request):
    return prepare_object(PARAMETRIC_OBJECTS[request.param](), request.param)


def test_stable_poses_stand_on_the_plane_over_their_support(model):
    poses, shares = stable_poses(model)
    assert (np.diff(shares) <= 0).all()
    assert 0.5 < shares.sum() <= 1.0 + 1e-6
    for pose in poses[:3]:
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)
        vertices = transform_points(pose, model.mesh.vertices)
        assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_allclose(transform_points(pose, model.center_of_mass)[:2], 0.0, atol=1e-9)
        feet = vertices[vertices[:, 2] < 1e-3, :2]
        if len(feet) > 3 and np.ptp(feet, axis=0).min() > 1e-3:  # round objects stand on a point
            assert Delaunay(feet[ConvexHull(feet).vertices]).find_simplex([0.0, 0.0]) >= 0


def test_a_brick_lies_on_its_largest_face():
    mesh = PARAMETRIC_OBJECTS["box"]()
    model = prepare_object(Mesh(mesh.vertices / mesh.extents * [0.02, 0.08, 0.05], mesh.faces))
    pose = stable_poses(model)[0][0]
    assert abs(pose[2, 0]) == pytest.approx(1.0)  # its thin axis is upright


def test_the_likeliest_pose_is_taken_on_a_slanted_support(model):
    surface = SupportSurface(normal=(0.3, 0.1, 1.0), offset=0.2)
    scene = prepare_scene(Constraints(Scene(support_surfaces=(surface,))), model, load_hand("barrett"))
    assert scene.stable_pose_share == stable_poses(model)[1][0]
    heights = transform_points(scene.world_from_object, model.mesh.vertices) @ surface.normal
    assert heights.min() == pytest.approx(0.2, abs=1e-9)
    assert scene.constraints.scene.object_pose is not None
