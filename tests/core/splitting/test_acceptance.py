"""Line 7 of Algorithms 1 and 2: what stops a step, what does not."""

import numpy as np
import pytest

from fingersplit.hands.kernel import move_fingers
from fingersplit.splitting.acceptance import (
    CONTINUE,
    REACHED_COLLISION,
    REACHED_PAD_ANGLE,
    STOPPED_RISING,
    judge,
    judge_collision,
)
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.state import PENETRATION, QUALITY, GraspState, new_state

SETTINGS = PlannerSettings()  # pads 0.6 rad, contacts 0.5 mm, penetration 1 mm


@pytest.fixture
def grasp_state(barrett):
    def build(quality=0.0, residuals=(0, 0, 0), pad_angles=(0.2, 0.2, 0.2)) -> GraspState:
        state = new_state(barrett.arrays)
        state.scores[QUALITY] = quality
        state.residuals[:], state.pad_angles[:] = residuals, pad_angles
        return state

    return build


def verdict(before: GraspState, after: GraspState, least_increase: float = 0.0) -> int:
    return judge(SETTINGS.for_kernels(), before, after, least_increase)


@pytest.mark.parametrize(("rise", "expected"), [(1e-9, CONTINUE), (0.0, STOPPED_RISING), (-1e-3, STOPPED_RISING)])
def test_quality_must_rise(grasp_state, rise, expected):
    assert verdict(grasp_state(0.5), grasp_state(0.5 + rise)) == expected


def test_quality_must_rise_by_more_than_the_least_increase(grasp_state):
    assert verdict(grasp_state(0.5), grasp_state(0.51), least_increase=0.02) == STOPPED_RISING
    assert verdict(grasp_state(0.5), grasp_state(0.53), least_increase=0.02) == CONTINUE


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (2e-3, 1.5e-3, CONTINUE),  # pulled to the surface: quality may fall
        (2e-3, 1.999e-3, STOPPED_RISING),  # not shortened enough to count as a pull
        (2e-3, 2.5e-3, STOPPED_RISING),
        (0.4e-3, 0.1e-3, STOPPED_RISING),  # already on the surface
    ],
)
def test_a_fingertip_pulled_to_the_surface_may_cost_quality(grasp_state, before, after, expected):
    states = grasp_state(0.5, residuals=(0, before, 0)), grasp_state(0.4, residuals=(after, 0, 0))
    assert verdict(*states) == expected


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (0.5, 0.61, REACHED_PAD_ANGLE),  # breaks a bound that held
        (0.5, 0.59, CONTINUE),
        (0.9, 0.8, CONTINUE),  # improves a violated bound
        (0.9, 0.9, CONTINUE),
        (0.9, 0.95, REACHED_PAD_ANGLE),  # makes it worse
    ],
)
def test_pads_may_not_tilt_beyond_their_limit_or_further(grasp_state, before, after, expected):
    states = grasp_state(0.5, pad_angles=(0.1, 0.1, before)), grasp_state(0.6, pad_angles=(0.1, 0.1, after))
    assert verdict(*states) == expected


def test_every_finger_is_judged_by_its_own_tilt(grasp_state):
    before = grasp_state(0.5, pad_angles=(0.9, 0.5, 0.5))
    assert verdict(before, grasp_state(0.6, pad_angles=(0.7, 0.7, 0.5))) == REACHED_PAD_ANGLE


@pytest.fixture
def sunk_hand(barrett) -> GraspState:
    """A hand whose palm lies a little inside the parametric sphere."""
    state = new_state(barrett.arrays)
    state.pose.joints[:] = 0.5
    state.pose.palm_position[:] = 0, 0, -0.11
    move_fingers(barrett.arrays, state.pose, np.empty((2, 3, 3)))
    return state


def test_collision_stops_a_step_that_goes_deeper(barrett, mujoco_barrett, problem_of, sunk_hand):
    problem, before = problem_of("sphere"), new_state(barrett.arrays)
    assert judge_collision(problem, before, sunk_hand) == REACHED_COLLISION
    depth = sunk_hand.scores[PENETRATION]
    mujoco_barrett.move(dict.fromkeys(barrett.joint_names, 0.5), position=(0, 0, -0.11))
    assert depth == pytest.approx(mujoco_barrett.depth(problem.collision.points), abs=1e-12)
    for deepest_before, expected in ((depth + 1e-6, CONTINUE), (depth, CONTINUE), (depth - 1e-6, REACHED_COLLISION)):
        before.scores[PENETRATION] = deepest_before
        assert judge_collision(problem, before, sunk_hand) == expected


def test_penetration_within_tolerance_is_no_collision(barrett, problem_of, sunk_hand):
    before = new_state(barrett.arrays)
    for tolerance, expected in ((0.01, CONTINUE), (0.002, REACHED_COLLISION)):
        problem = problem_of("sphere", penetration_tolerance=tolerance)
        assert judge_collision(problem, before, sunk_hand) == expected
    assert 0.002 < sunk_hand.scores[PENETRATION] < 0.01
