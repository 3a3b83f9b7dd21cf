"""The scene and its simulation: kinematics as planned, instability noticed, torques limited."""

import numpy as np
import pytest

from fingersplit.contacts.grip import Grip
from fingersplit.verification.closing import with_opening
from fingersplit.verification.controllers import PositionServo, VirtualFrame
from fingersplit.verification.published import Execution
from fingersplit.verification.scene import Scene
from fingersplit.verification.simulation import keep_clear, run_closing


@pytest.fixture
def placed(planned, barrett):
    plan, pieces = planned("box")
    grasp = plan.grasps[0].run.final
    scene = Scene.build(barrett, pieces, "fingertips")
    scene.set_object(plan.model.mass, plan.model.center_of_mass, plan.model.inertia)
    scene.set_friction(np.full(3, 0.6), np.full(3, 0.005))
    scene.place(grasp)
    return scene, grasp


def controls_of(scene: Scene, pull: float, steps: int) -> np.ndarray:
    """A virtual frame that pulls fingertips together with so many newtons."""
    controller = VirtualFrame()
    controller.prepare(scene)
    grip = Grip(np.full(3, pull), np.zeros((3, 3)), 0.0, False, np.zeros(8))
    return controller.close(scene, grip, np.linspace(0.0, 1.0, steps))


def test_hand_stands_where_the_grasp_has_it(placed):
    scene, grasp = placed
    np.testing.assert_allclose(scene.data.site_xpos[scene.grip_sites], grasp.fingertips, atol=1e-9)
    np.testing.assert_allclose(scene.data.xpos[scene.palm_body], grasp.object_from_palm[:3, 3], atol=1e-12)


def test_grip_site_jacobians_are_those_of_finite_differences(placed):
    scene, grasp = placed
    jacobians, step = scene.finger_jacobians(), 1e-6
    for joint in range(len(grasp.joints)):
        ends = []
        for sign in (1, -1):
            scene.set_joints(grasp.joints + sign * step * np.eye(len(grasp.joints))[joint])
            ends.append(scene.data.site_xpos[scene.grip_sites].copy())
        np.testing.assert_allclose((ends[0] - ends[1]) / (2 * step), jacobians[:, :, joint], atol=1e-7)


def test_diverged_simulation_is_noticed(placed):
    scene, _ = placed
    scene.data.qvel[-6:] = 1e12
    assert not run_closing(scene, controls_of(scene, 5.0, 50)).stable


def test_joint_torques_stay_inside_their_limits(placed):
    scene, _ = placed
    rollout = run_closing(scene, controls_of(scene, 1e4, 100))
    excess = np.abs(rollout.torques) - scene.hand.torque_limits
    assert excess.max() <= 1e-9
    assert excess.max() > -1e-6  # the pull is far beyond what the joints have


def test_free_fingers_close_as_if_contacts_were_looked_for_all_the_time(planned, barrett):
    plan, pieces = planned("box")
    ranked = plan.grasps[0]
    grasp, steps, tracks = ranked.run.final, (60, 30), []
    for opened in (0, steps[0]):
        scene = Scene.build(barrett, pieces)
        scene.set_object(plan.model.mass, plan.model.center_of_mass, plan.model.inertia)
        scene.set_friction(np.full(3, 0.6), np.full(3, 0.005))
        scene.place(grasp)
        scene.model.opt.timestep = 0.003
        execution = with_opening(Execution(None, ranked.execution.grip), scene, grasp)
        controls = PositionServo().close(scene, execution.grip, execution.opened, grasp.joints, steps)
        scene.set_joints(execution.opened)
        keep_clear(scene, grasp.normals)
        tracks.append(run_closing(scene, controls, opened))
    always, freely = tracks
    first = int(always.touching.any(axis=1).argmax())
    assert first > 10, "fingers that touch from the beginning leave nothing to skip"
    np.testing.assert_allclose(freely.joints[:first], always.joints[:first], atol=1e-9)
    np.testing.assert_array_equal(freely.times, always.times)
    assert abs(int(freely.touching.any(axis=1).argmax()) - first) <= 1
    np.testing.assert_allclose(freely.object_positions[-1], always.object_positions[-1], atol=2e-4)


def test_fingers_that_touch_from_the_beginning_push(placed):
    scene, grasp = placed
    deep = grasp.joints + scene.coupling @ np.full(scene.coupling.shape[1], 0.05)
    scene.set_joints(deep)
    assert scene.data.ncon
    track = run_closing(scene, controls_of(scene, 5.0, 30), opened=30)
    assert np.linalg.norm(track.object_positions[-1] - track.start[:3]) > 1e-5


def test_copy_leaves_the_original_alone(placed):
    scene, grasp = placed
    before = scene.model.body_pos[scene.palm_body].copy()
    moved = grasp.object_from_palm.copy()
    moved[:3, 3] += 0.1
    scene.copy().model.body_pos[scene.palm_body] = moved[:3, 3]
    np.testing.assert_array_equal(scene.model.body_pos[scene.palm_body], before)
