"""The Map: where the palm goes, that pads reach the surface, and what cannot be reached."""

import math

import numpy as np
import pytest

from fingersplit.objects.model import prepare_object
from fingersplit.objects.parametric import box
from fingersplit.parallel_grasps import ParallelGrasp
from fingersplit.splitting.mapping import OUT_OF_REACH, map_grasp
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.starts import build_problem, map_starts
from fingersplit.splitting.state import new_state, new_work

NAMES = ("box", "cylinder", "sphere", "mug")


@pytest.mark.parametrize("name", NAMES)
def test_palm_takes_the_place_of_the_gripper(barrett, starts_of, name):
    low, high = barrett.gripper.standoff
    for start in starts_of(name):
        pose, contacts = start.state.pose, start.parallel_grasp.contacts
        lateral, jaw, approach = (pose.palm_rotation @ barrett.gripper.palm_from_gripper).T
        between = (contacts[0] - contacts[1]) / np.linalg.norm(contacts[0] - contacts[1])
        assert abs(jaw @ between) == pytest.approx(1)  # either finger assignment
        straight = start.parallel_grasp.approach - (start.parallel_grasp.approach @ between) * between
        np.testing.assert_allclose(approach, straight / np.linalg.norm(straight), atol=1e-9)
        np.testing.assert_allclose(pose.palm_rotation @ pose.palm_rotation.T, np.eye(3), atol=1e-12)
        to_middle = contacts.mean(axis=0) - pose.palm_position
        assert abs(to_middle @ lateral) < 1e-9
        assert abs(to_middle @ jaw) < 1e-9
        assert low - 1e-9 <= to_middle @ approach <= high + 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_starts_reach_the_surface_within_limits_best_first(barrett, starts_of, name):
    starts = starts_of(name)
    assert len(starts) == 16
    for start in starts:
        assert math.isfinite(start.cost)
        assert (start.state.residuals <= OUT_OF_REACH).all()
        assert (start.state.pose.joints >= barrett.lower).all()
        assert (start.state.pose.joints <= barrett.upper).all()
    reached = [start.state.residuals.max() for start in starts]
    assert np.median(reached) < 1e-3


def test_each_jaw_gets_its_group_of_fingers(barrett, problem_of):
    grasp = ParallelGrasp([[0.035, 0, 0], [-0.035, 0, 0]], [0, 0, -1])
    starts = map_starts(problem_of("sphere"), barrett, [grasp], 2)
    thumb_sides = sorted(float(np.sign(start.state.contacts[2, 0])) for start in starts)
    assert thumb_sides == [-1, 1]
    for start in starts:
        sides = np.sign(start.state.contacts[:, 0])
        assert sides[0] == sides[1] == -sides[2]


def test_starts_spread_over_the_pairs(barrett, problem_of):
    turn = np.linspace(0, np.pi, 4, endpoint=False)
    pairs = [0.035 * np.array([[np.cos(a), np.sin(a), 0], [-np.cos(a), -np.sin(a), 0]]) for a in turn]
    grasps = [ParallelGrasp(pair, [0, 0, z]) for pair in pairs for z in (1, -1)]
    starts = map_starts(problem_of("sphere"), barrett, grasps, 4)
    assert len({start.parallel_grasp.contacts.tobytes() for start in starts}) == 4


def test_pair_too_wide_for_the_hand_gives_no_start(barrett):
    cube = prepare_object(box((0.5, 0.5, 0.5)))
    problem = build_problem(cube, barrett, PlannerSettings())
    assert map_starts(problem, barrett, [ParallelGrasp([[0.25, 0, 0], [-0.25, 0, 0]], [0, 0, -1])], 4) == []


def cost_of(problem, barrett, first, second, approach) -> float:
    state, candidate, aim = (new_state(barrett.arrays) for _ in range(3))
    rays = tuple(np.array(v, dtype=float) for v in (first, second, approach))
    standoffs, work = np.linspace(*barrett.gripper.standoff, 9), new_work(barrett.arrays)
    return map_grasp(problem, barrett.gripper, *map(tuple, rays), standoffs, state, candidate, aim, work)


def test_approach_along_the_jaw_has_no_cost(barrett, problem_of):
    problem = problem_of("sphere")
    assert cost_of(problem, barrett, (0.035, 0, 0), (-0.035, 0, 0), (1, 0, 0)) == math.inf
    assert cost_of(problem, barrett, (0.035, 0, 0), (-0.035, 0, 0), (0, 1, 0)) < 100


def test_cost_prefers_a_clear_approach(barrett, problem_of):
    # A tall box, held across its short side near the top: from above there is room, from below the box is in the way.
    problem = problem_of("box")
    contacts = (0.025, 0, 0.045), (-0.025, 0, 0.045)
    assert cost_of(problem, barrett, *contacts, (0, 0, -1)) < cost_of(problem, barrett, *contacts, (0, 0, 1))
