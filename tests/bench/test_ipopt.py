"""The baseline: its kinematics and quality against the hand's own, its surface on a sphere, its answers measured."""

import casadi
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.splitting.objective_kernel import manipulability as own_manipulability
from fingersplit.splitting.objective_kernel import object_quality as own_object_quality
from fingersplit_bench.calls import plan_once, settings_of
from fingersplit_bench.ipopt.implicit_surface import fit_surface, signed_distance
from fingersplit_bench.ipopt.judgement import judge_grasp
from fingersplit_bench.ipopt.kinematics import manipulability, object_quality, pads_in_palm
from fingersplit_bench.ipopt.problem import build_problem

RADIUS = 0.035
NODES = 40_000
seeds = st.integers(0, 2**32 - 1)


def evaluate(expression: casadi.MX, symbol: casadi.MX, value: np.ndarray) -> np.ndarray:
    return np.asarray(casadi.Function("f", [symbol], [expression])(value))


@pytest.fixture(scope="module")
def ball(prepared):
    return prepared("sphere")


@pytest.fixture(scope="module")
def ball_problem(ball, barrett):
    return build_problem(fit_surface(ball, NODES), barrett, settings_of("paper"))


@given(seed=seeds)
def test_kinematics_are_the_hands_own(barrett, seed):
    joints = np.random.default_rng(seed).uniform(barrett.lower, barrett.upper)
    q = casadi.MX.sym("q", len(joints))
    pads = evaluate(casadi.horzcat(*pads_in_palm(barrett, q)), q, joints).T
    np.testing.assert_allclose(pads, barrett.pose(joints).pads[:3], atol=1e-12)


@given(seed=seeds)
def test_quality_is_the_planners_own(barrett, seed):
    rng = np.random.default_rng(seed)
    joints, contacts = rng.uniform(barrett.lower, barrett.upper), rng.uniform(-0.05, 0.05, (3, 3))
    q, c = casadi.MX.sym("q", len(joints)), casadi.MX.sym("c", 3, 3)
    assert evaluate(manipulability(barrett, q), q, joints) == pytest.approx(own_manipulability(barrett.arrays, joints))
    assert evaluate(object_quality(c), c, contacts.T) == pytest.approx(own_object_quality(contacts, 3), abs=1e-6)


def test_signed_distance_of_a_sphere(ball):
    points = np.random.default_rng(0).uniform(-0.06, 0.06, (500, 3))
    truth = np.linalg.norm(points, axis=1) - RADIUS
    error = np.abs(signed_distance(ball, points) - truth)
    assert error[np.abs(truth) < 5e-3].max() < 1e-4
    assert error.max() < 1e-3


def test_implicit_surface_is_the_sphere_with_unit_slope(ball, ball_problem):
    surface = ball_problem.surface
    directions = np.random.default_rng(1).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.abs(np.asarray(surface.distance(RADIUS * directions.T))).max() < 1e-4
    x = casadi.MX.sym("x", 3)
    slope = casadi.Function("slope", [x], [casadi.gradient(surface.distance(x), x)])
    slopes = np.asarray(slope(RADIUS * directions.T)).T
    assert np.einsum("ij,ij->i", slopes, directions).min() > 0.98
    np.testing.assert_allclose(np.linalg.norm(slopes, axis=1), 1, atol=0.03)
    assert (surface.lower < ball.mesh.bounds[0]).all()
    assert (surface.upper > ball.mesh.bounds[1]).all()


@pytest.mark.parametrize("name", ["box", "l_bracket", "mug"])
def test_distance_and_sign_hold_at_edges_and_thin_walls_to_the_rim_of_the_box(prepared, name):
    model = prepared(name)
    surface = fit_surface(model, NODES)
    points = np.random.default_rng(2).uniform(surface.lower, surface.upper, (400, 3))
    truth = -trimesh.proximity.signed_distance(model.mesh.trimesh, points)
    assert np.abs(signed_distance(model, points) - truth).max() < 1.5e-3
    assert np.abs(np.asarray(surface.distance(points.T)).ravel() - truth).max() < 1.5e-3


def test_judgement_of_our_own_grasps_is_the_planners(ball, barrett):
    for run in plan_once(ball, barrett, fidelity="paper", starts=6).runs:
        judged = judge_grasp(ball, barrett, settings_of("paper"), run.final.object_from_palm, run.final.joints)
        assert judged.quality == pytest.approx(run.scores[0], abs=1e-9)
        assert judged.penetration == pytest.approx(run.scores[3], abs=1e-5)  # both search to 5 um
        assert judged.residual == pytest.approx(run.final.residuals.max(), abs=1e-7)
        assert judged.pad_angle == pytest.approx(run.final.pad_angles.max(), abs=1e-3)
        assert judged.feasible == run.feasible


def test_solutions_keep_problem_one(ball, ball_problem, barrett):
    runs = plan_once(ball, barrett, fidelity="paper", starts=4).runs
    solutions = [(run, ball_problem.solve(run.initial)) for run in runs]
    solved = [(run, solution) for run, solution in solutions if solution.converged]
    assert solved
    for run, solution in solved:
        assert solution.seconds > 0
        assert solution.iterations > 0
        assert (solution.joints >= barrett.lower).all()
        assert (solution.joints <= barrett.upper).all()
        judged = judge_grasp(ball, barrett, settings_of("paper"), solution.object_from_palm, solution.joints)
        assert judged.residual < 1e-4
        assert judged.quality > run.trace.scores[0, 0]
