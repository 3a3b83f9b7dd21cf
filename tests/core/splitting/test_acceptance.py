"""Line 7 of Algorithms 1 and 2: what stops a step, what does not."""

import numpy as np
import pytest

from fingersplit.splitting.acceptance_kernel import (
    CONTINUE,
    REACHED_COLLISION,
    REACHED_PAD_ANGLE,
    STOPPED_RISING,
    judge,
    judge_collision,
)
from fingersplit.splitting.settings import FIDELITIES
from fingersplit.splitting.state import new_times, new_work
from fingersplit.splitting.state_kernel import measure_collision
from fingersplit.transforms import pose_matrix


@pytest.fixture(params=FIDELITIES)
def fidelity(request) -> str:
    """Pads 0.6 rad, contacts 0.3 mm, penetration 1 mm; with and without potentials."""
    return request.param


@pytest.fixture
def grasp_state(barrett, posed_state):
    """Scores of a hand that is far from the object, its joints in mid-range."""

    def build(quality=0.0, residuals=(0, 0, 0), pad_angles=(0.2, 0.2, 0.2)) -> np.record:
        state = posed_state((barrett.lower + barrett.upper) / 2, pose_matrix(np.eye(3), (0, 0, 1.0)))
        state.quality = state.merit = quality
        state.residuals[:3], state.pad_angles[:3] = residuals, pad_angles
        return state

    return build


@pytest.fixture
def verdict(problem_of, fidelity):
    def build(before: np.record, after: np.record, least_increase: float = 0.0, **settings) -> int:
        work = new_work()
        problem = problem_of("sphere", fidelity, **settings)
        return judge(problem, before, after, least_increase, work, new_times().cpo)

    return build


@pytest.mark.parametrize(("rise", "expected"), [(1e-9, CONTINUE), (0.0, STOPPED_RISING), (-1e-3, STOPPED_RISING)])
def test_quality_must_rise(verdict, grasp_state, rise, expected):
    assert verdict(grasp_state(0.5), grasp_state(0.5 + rise)) == expected


def test_quality_must_rise_by_more_than_the_least_increase(verdict, grasp_state):
    assert verdict(grasp_state(0.5), grasp_state(0.51), least_increase=0.02) == STOPPED_RISING
    assert verdict(grasp_state(0.5), grasp_state(0.53), least_increase=0.02) == CONTINUE


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (2e-3, 1.5e-3, CONTINUE),  # pulled to the surface: quality may fall
        (2e-3, 1.999e-3, STOPPED_RISING),  # not shortened enough to count as a pull
        (2e-3, 2.5e-3, STOPPED_RISING),
        (0.31e-3, 0.1e-3, CONTINUE),
        (0.29e-3, 0.1e-3, STOPPED_RISING),  # already on the surface
    ],
)
def test_a_fingertip_pulled_to_the_surface_may_cost_quality(verdict, grasp_state, before, after, expected):
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
def test_pads_may_not_tilt_beyond_their_limit_or_further(verdict, grasp_state, before, after, expected):
    states = grasp_state(0.5, pad_angles=(0.1, 0.1, before)), grasp_state(0.6, pad_angles=(0.1, 0.1, after))
    assert verdict(*states) == expected


def test_every_finger_is_judged_by_its_own_tilt(verdict, grasp_state):
    before = grasp_state(0.5, pad_angles=(0.9, 0.5, 0.5))
    assert verdict(before, grasp_state(0.6, pad_angles=(0.7, 0.7, 0.5))) == REACHED_PAD_ANGLE


def test_with_potentials_it_is_the_merit_that_must_rise(problem_of, grasp_state):
    """The second pad tilts from just above the soft limit of 0.5 rad on: Q gains less than the potential costs."""
    before, after = grasp_state(0.5, pad_angles=(0.2, 0.51, 0.2)), grasp_state(0.5001, pad_angles=(0.2, 0.59, 0.2))
    weight, work = 0.1, new_work()
    assert judge(problem_of("sphere", "paper"), before, after, 0.0, work, new_times().cpo) == CONTINUE
    before.merit -= weight * 0.01**2
    assert judge(problem_of("sphere"), before, after, 0.0, work, new_times().cpo) == STOPPED_RISING
    assert after.merit == pytest.approx(0.5001 - weight * 0.09**2)
    back, still = grasp_state(0.5, pad_angles=(0.2, 0.2, 0.2)), grasp_state(0.5, pad_angles=(0.2, 0.51, 0.2))
    still.merit -= weight * 0.01**2
    assert judge(problem_of("sphere"), still, back, 0.0, work, new_times().cpo) == CONTINUE  # rises although Q does not


@pytest.fixture
def sunk_hand(posed_state) -> np.record:
    """A hand whose palm lies a little inside the parametric sphere."""
    return posed_state(np.full(8, 0.5), pose_matrix(np.eye(3), (0, 0, -0.11)))


def test_collision_stops_a_step_that_goes_deeper(
    barrett, mujoco_barrett, problem_of, fidelity, verdict, grasp_state, sunk_hand
):
    problem, before = problem_of("sphere", fidelity), grasp_state(-1.0)
    assert verdict(before, sunk_hand) == REACHED_COLLISION
    depth = sunk_hand.penetration
    mujoco_barrett.move(dict.fromkeys(barrett.joint_names, 0.5), position=(0, 0, -0.11))
    assert depth == pytest.approx(mujoco_barrett.depth(problem.collision.points), abs=1e-12)
    for deepest_before, expected in ((depth + 1e-6, CONTINUE), (depth, CONTINUE), (depth - 1e-6, REACHED_COLLISION)):
        before.penetration = deepest_before
        assert judge_collision(problem.settings, before, sunk_hand) == expected
        assert verdict(before, sunk_hand) == expected


def test_penetration_within_tolerance_is_no_collision(problem_of, fidelity, grasp_state, sunk_hand):
    before = grasp_state()
    for tolerance, expected in ((0.01, CONTINUE), (0.002, REACHED_COLLISION)):
        problem = problem_of("sphere", fidelity, penetration_tolerance=tolerance)
        work = new_work()
        measure_collision(problem, sunk_hand, work, new_times().cpo)
        assert judge_collision(problem.settings, before, sunk_hand) == expected
    assert 0.002 < sunk_hand.penetration < 0.01
