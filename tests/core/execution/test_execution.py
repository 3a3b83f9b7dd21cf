"""What is done before and after a grasp, with links as MuJoCo places them and the object's exact triangles."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from fingersplit.contacts.grip_plan import plan_grip
from fingersplit.execution.execution import GraspExecution, plan_execution
from fingersplit.execution.execution_kernel import MAX_TILT, MIN_OPENING, OPENING_STEP, OPENING_STEPS
from fingersplit.planning.run import Run
from fingersplit.scene import Approach
from fingersplit.splitting.termination import Termination
from fingersplit.transforms import wxyz_from_rotation

OBJECTS = pytest.mark.parametrize("name", ["bottle", "box", "cylinder", "l_bracket", "mug", "sphere"])


@pytest.fixture(scope="module")
def feasible_runs(runs_of) -> Callable[[str], Sequence[Run]]:
    return lambda name: [run for run in runs_of(name) if run.feasible]


@pytest.fixture(scope="module")
def depth_at(barrett, mujoco_barrett, prepared, exact_mesh) -> Callable[..., float]:
    """How deep the triangles of an object reach into the hand [m]."""

    def measure(name: str, joints: np.ndarray, rotation: np.ndarray, position: np.ndarray) -> float:
        mujoco_barrett.move(dict(zip(barrett.joint_names, joints, strict=True)), wxyz_from_rotation(rotation), position)
        return mujoco_barrett.depth_of_triangles(exact_mesh(prepared(name).mesh).triangles)

    return measure


def executed(run: Run) -> GraspExecution:
    """How a run's grasp is executed, with the grip for 0.3 kg about the middle of the contacts."""
    center = run.final.contacts.mean(axis=0)
    grip = plan_grip(run.final, run.hand, friction=0.6, mass=0.3, center_of_mass=center)
    return plan_execution(run.problem, run.hand, run.last, grip)


def way_back(run: Run, execution: GraspExecution, steps: int) -> np.ndarray:
    """Palm positions from the grasp to where the approach begins, against the direction of travel (steps, 3) [m]."""
    back = np.linspace(0, execution.approach_distance, steps)[:, None] * execution.approach_direction
    return run.final.object_from_palm[:3, 3] - back


def palm_axis(run: Run) -> np.ndarray:
    return run.final.object_from_palm[:3, :3] @ run.hand.gripper.palm_from_gripper[:, 2]


@OBJECTS
def test_approach_begins_straight_behind_the_grasp(feasible_runs, name):
    along_axis = []
    for run in feasible_runs(name):
        execution = executed(run)
        np.testing.assert_array_equal(execution.pregrasp_pose[:3, :3], run.final.object_from_palm[:3, :3])
        np.testing.assert_allclose(execution.pregrasp_pose[:3, 3], way_back(run, execution, 2)[1], atol=1e-12)
        assert Approach().min_distance <= execution.approach_distance <= Approach().desired_distance
        cosine = execution.approach_direction @ palm_axis(run)
        assert cosine >= np.cos(MAX_TILT)
        along_axis.append(cosine > 1 - 1e-12)
    assert np.mean(along_axis) > 0.8  # other directions are for want of this one


@OBJECTS
def test_whole_approach_is_free_of_collision(feasible_runs, depth_at, name):
    """Every 2.5 mm, deeper nowhere than a grasp's links may be."""
    deepest = []
    for run in feasible_runs(name):
        execution = executed(run)
        rotation, places = run.final.object_from_palm[:3, :3], way_back(run, execution, 41)
        deepest.append(max(depth_at(name, execution.pregrasp_joints, rotation, place) for place in places))
    assert deepest
    assert max(deepest) < run.problem.settings.penetration_tolerance
    assert np.median(deepest) < 0.1e-3


def test_no_way_is_kept_back_that_is_free(runs_of, depth_at):
    """Where no way in is found, the hand does not get far along its palm's axis without touching the object."""
    blocked = 0
    for name in ("bottle", "l_bracket", "mug"):
        for run in runs_of(name):
            if run.termination == Termination.NO_FREE_APPROACH:
                blocked += 1
                joints, pose = run.outcome.way.joints[:8], run.final.object_from_palm
                places = pose[:3, 3] - np.linspace(0, Approach().min_distance, 31)[:, None] * palm_axis(run)
                assert max(depth_at(name, joints, pose[:3, :3], place) for place in places) > 0.1e-3
    assert blocked > 0


@OBJECTS
def test_fingers_open_along_the_normals_within_their_limits(barrett, prepared, exact_mesh, feasible_runs, name):
    gaps = []
    for run in feasible_runs(name):
        joints = executed(run).pregrasp_joints
        assert (joints >= barrett.lower).all()
        assert (joints <= barrett.upper).all()
        pose = run.final.object_from_palm
        opened, closed = barrett.pose(joints, pose).pads[:3], barrett.pose(run.final.joints, pose).pads[:3]
        moved = ((opened - closed) * run.final.normals).sum(axis=1)
        assert (moved <= 1.02 * OPENING_STEP * OPENING_STEPS).all()  # steps are exact to the first order
        gaps.append(moved)
    gaps = np.array(gaps)
    assert (gaps > 0).all()
    assert np.median(gaps) > MIN_OPENING * OPENING_STEP * 0.9


@OBJECTS
def test_squeeze_drives_every_pad_into_the_object(barrett, feasible_runs, name):
    for run in feasible_runs(name):
        grip, pose = executed(run).grip, run.final.object_from_palm
        assert (grip.targets >= barrett.lower).all()
        assert (grip.targets <= barrett.upper).all()
        squeezed, closed = barrett.pose(grip.targets, pose).pads[:3], barrett.pose(run.final.joints, pose).pads[:3]
        assert (-((squeezed - closed) * run.final.normals).sum(axis=1) > 0).all()


@OBJECTS
def test_nothing_swings_before_or_after_the_grasp(feasible_runs, name):
    """A pad next to the axis of its spread joint moves little however far that joint turns."""
    for run in feasible_runs(name):
        execution = executed(run)
        assert np.abs(execution.grip.targets - run.final.joints).max() < 0.2
        assert np.abs(execution.pregrasp_joints - run.final.joints).max() < 0.5


def test_planning_it_leaves_the_run_as_it_was(feasible_runs):
    run = feasible_runs("mug")[0]
    before = run.last.tobytes()
    first, again = executed(run), executed(run)
    assert run.last.tobytes() == before
    np.testing.assert_array_equal(first.pregrasp_joints, again.pregrasp_joints)
    np.testing.assert_array_equal(first.grip.targets, again.grip.targets)
