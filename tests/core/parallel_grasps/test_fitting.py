"""Equations of iterative surface fitting against finite differences of the errors they come from."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingersplit.parallel_grasps.fitting_kernel import (
    APPROACH_WEIGHT,
    DAMPING,
    NORMAL_WEIGHT,
    fit_pads,
    new_fit,
    palm_equations,
    width_step,
)
from fingersplit.parallel_grasps.sources.surface_fitting import PadGripper

POINTS = 10
WANTED = np.array([0.2, -0.3, -1.0]) / np.linalg.norm([0.2, -0.3, -1.0])


@pytest.fixture
def fit():
    """A gripper with random points, targets and weights; nothing about it is special."""
    rng = np.random.default_rng(4)
    fit = new_fit(POINTS)
    fit.rotation[:] = Rotation.random(random_state=rng).as_matrix()
    fit.position[:] = rng.uniform(-0.1, 0.1, 3)
    fit.points[:] = fit.position + rng.uniform(-0.03, 0.03, (POINTS, 3))
    fit.targets[:] = fit.points + rng.normal(scale=2e-3, size=(POINTS, 3))
    for normals in (fit.normals, fit.target_normals):
        normals[:] = rng.normal(size=(POINTS, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    fit.weights[:] = rng.uniform(0.1, 1.0, POINTS)
    return fit


def residuals(fit, motion):
    """Weighted E_p, E_n and E_a after turning the gripper about its origin by motion[:3] and shifting it."""
    turn = Rotation.from_rotvec(motion[:3]).as_matrix()
    points = fit.position + (fit.points - fit.position) @ turn.T + motion[3:]
    normals, approach = fit.normals @ turn.T, turn @ fit.rotation[:, 2]
    weights = np.sqrt(fit.weights / fit.weights.sum())
    surface = weights * np.einsum("ij,ij->i", points - fit.targets, fit.target_normals)
    facing = weights * NORMAL_WEIGHT * (np.einsum("ij,ij->i", normals, fit.target_normals) + 1)
    return np.concatenate([surface, facing, APPROACH_WEIGHT * np.cross(approach, WANTED)])


def test_palm_equations_are_the_gauss_newton_step_of_the_errors(fit):
    error = palm_equations(fit, tuple(fit.rotation[:, 2]), tuple(WANTED))
    step = 1e-6
    jacobian = np.column_stack([(residuals(fit, h) - residuals(fit, -h)) / (2 * step) for h in step * np.eye(6)])
    damping = DAMPING * np.diag([NORMAL_WEIGHT**2] * 3 + [1.0] * 3)
    np.testing.assert_allclose(fit.A, jacobian.T @ jacobian + damping, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(fit.b[:, 0], -jacobian.T @ residuals(fit, np.zeros(6)), rtol=1e-6, atol=1e-12)
    assert error == pytest.approx((residuals(fit, np.zeros(6))[:-3] ** 2).sum())


def test_width_step_minimises_the_surface_error(fit):
    jaw = fit.rotation[:, 1]
    sides = np.repeat([1.0, -1.0], POINTS // 2)
    fit.normals[:] = -sides[:, None] * jaw

    def error(widening):
        points = fit.points + 0.5 * widening * sides[:, None] * jaw
        return (fit.weights * np.einsum("ij,ij->i", points - fit.targets, fit.target_normals) ** 2).sum()

    best = width_step(fit)
    assert error(best) < min(error(best - 1e-6), error(best + 1e-6))


def test_pads_settle_on_a_box(prepared):
    """Started askew and too narrow across the 50 mm sides of a box, the pads end flat on them."""
    model, gripper = prepared("box"), PadGripper((0.0, 0.1))
    fit, pad = new_fit(2 * len(gripper.pad_points)), gripper.pad_points
    true_rotation = np.column_stack([[0, 1, 0], [1, 0, 0], [0, 0, -1]])  # jaw along x, approach downwards
    fit.rotation[:] = Rotation.from_rotvec([0.0, 0.15, 0.1]).as_matrix() @ true_rotation
    fit.position[:], fit.width[0] = model.mesh.bounds.mean(axis=0) + 0.002 * np.eye(3)[0], 0.046
    fit_pads(model.surface, pad, gripper.opening, (0.0, 0.0, -1.0), fit)
    assert fit.width[0] == pytest.approx(0.05, abs=1e-4)
    assert abs(fit.rotation[0, 1]) > math.cos(0.01)
    assert fit.position[0] == pytest.approx(model.mesh.bounds[:, 0].mean(), abs=1e-4)
    np.testing.assert_allclose(fit.rotation.T @ fit.rotation, np.eye(3), atol=1e-9)


def test_width_stays_within_the_jaws(prepared):
    model, gripper = prepared("box"), PadGripper((0.0, 0.04))
    fit = new_fit(2 * len(gripper.pad_points))
    fit.rotation[:] = np.column_stack([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    fit.position[:], fit.width[0] = model.mesh.bounds.mean(axis=0), 0.04
    fit_pads(model.surface, gripper.pad_points, gripper.opening, (0.0, 0.0, -1.0), fit)
    assert fit.width[0] <= 0.04
