"""Kernels of iterative surface fitting [Fan2018ISF]: palm fit, width fit, and both in turn.

Gripper frame: origin midway between the pads, columns of its rotation lateral, jaw (from pad 1 to pad 0) and approach.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.objects.grid_kernel import cell_range
from fingersplit.vectors_kernel import (
    add,
    cross,
    dot,
    get,
    multiply,
    norm,
    put,
    scale,
    set_rotation_about,
    solve_positive_definite,
    subtract,
)

__all__ = ["Fit", "fit_pads", "get_column", "new_fit", "pair_points", "palm_equations", "width_step"]

ITERATIONS = 15
MIN_GAIN = 0.005
"""Share by which an iteration has to lower the squared error for another one to follow."""
NORMAL_WEIGHT = 0.01
"""alpha [m]: a radian between pad and surface costs as much as this distance."""
APPROACH_WEIGHT = 0.003
"""Square root of beta [m]: likewise for a radian between the approach axis and the wanted one."""
OUTLIER = 4e-3
"""[m]; points farther than this from the surface count less and less."""
REACH = 8e-3
"""[m]; points farther than this from the surface do not count at all."""
DAMPING = 1e-3
"""Share of the squared step that is added, so that a gripper does not drift where the fit leaves it free."""
MAX_TURN, MAX_SHIFT = 0.3, 0.01
"""Largest step of the palm fit [rad], [m]."""


class Fit(NamedTuple):
    """A gripper being fitted, and room for its fit; the first half of all points belongs to pad 0.

    Attributes:
        rotation: ``object_from_gripper``, (3, 3).
        position: Midway between the pads, object frame, (3,) [m].
        width: Distance of the pads, (1,) [m].
        points: Pad points, object frame, (n, 3) [m].
        normals: Unit normals out of the pads there, (n, 3).
        targets: Nearest point of the object for each, (n, 3) [m].
        target_normals: Unit outward normals there, (n, 3).
        samples: Surface samples they were found at, (n,).
        weights: How much each counts, (n,).
        A: Normal equations of the palm fit, (6, 6).
        b: Their right side, then the step: turn [rad] and shift [m], (6, 1).
        turn: Rotations in between, (2, 3, 3).
    """

    rotation: NDArray[np.float64]
    position: NDArray[np.float64]
    width: NDArray[np.float64]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    targets: NDArray[np.float64]
    target_normals: NDArray[np.float64]
    samples: NDArray[np.int64]
    weights: NDArray[np.float64]
    A: NDArray[np.float64]
    b: NDArray[np.float64]
    turn: NDArray[np.float64]


def new_fit(points: int) -> Fit:
    """Room for a gripper of ``points`` pad points in all."""
    pad_points, pad_normals, targets, target_normals = np.zeros((4, points, 3))
    return Fit(
        np.eye(3),
        np.zeros(3),
        np.zeros(1),
        pad_points,
        pad_normals,
        targets,
        target_normals,
        np.zeros(points, np.int64),
        np.zeros(points),
        np.zeros((6, 6)),
        np.zeros((6, 1)),
        np.zeros((2, 3, 3)),
    )


@kernel
def fit_pads(surface, pad, opening, wanted, fit):
    """Alternate palm and width fits from the pose and width in ``fit`` until that hardly lowers the error.

    Args:
        surface: ``Surface`` of the object.
        pad: Points of a pad along the lateral and the approach axis, (m, 2) [m].
        opening: Least and largest width [m].
        wanted: Approach direction that the gripper should keep to.
        fit: ``Fit``; gets the fitted pose and width with their correspondences.

    Returns:
        Number of iterations.
    """
    pair_points(surface, pad, fit)
    previous = math.inf
    for iteration in range(ITERATIONS):
        error = palm_equations(fit, get_column(fit.rotation, 2), wanted)
        if error > (1.0 - MIN_GAIN) * previous:
            return iteration
        previous = error
        solve_positive_definite(fit.A, fit.b, 6)
        turn, shift = (fit.b[0, 0], fit.b[1, 0], fit.b[2, 0]), (fit.b[3, 0], fit.b[4, 0], fit.b[5, 0])
        _move(fit, _at_most(turn, MAX_TURN), _at_most(shift, MAX_SHIFT))
        _pose_pads(pad, fit)
        fit.width[0] = min(max(fit.width[0] + width_step(fit), opening[0]), opening[1])
        pair_points(surface, pad, fit)
    return ITERATIONS


@kernel
def get_column(R, k):
    """Column ``k`` of a (3, 3) array as a vector."""
    return R[0, k], R[1, k], R[2, k]


@kernel
def _at_most(v, length):
    return scale(min(1.0, length / max(norm(v), 1e-300)), v)


@kernel
def _move(fit, turn, shift):
    """Turn the gripper about its origin by Rodrigues' formula, then shift it."""
    angle = norm(turn)
    if angle > 0.0:
        set_rotation_about(scale(1.0 / angle, turn), angle, fit.turn[0])
        multiply(fit.turn[0], fit.rotation, fit.turn[1])
        fit.rotation[:] = fit.turn[1]
    for k in range(3):
        fit.position[k] += shift[k]


@kernel
def _pose_pads(pad, fit):
    """Pad points and normals at the current pose and width."""
    lateral, jaw, approach = get_column(fit.rotation, 0), get_column(fit.rotation, 1), get_column(fit.rotation, 2)
    middle, count = (fit.position[0], fit.position[1], fit.position[2]), len(pad)
    for side in range(2):
        sign = 1.0 - 2.0 * side
        center = add(middle, scale(0.5 * sign * fit.width[0], jaw))
        for m in range(count):
            point = add(center, add(scale(pad[m, 0], lateral), scale(pad[m, 1], approach)))
            put(fit.points, side * count + m, point)
            put(fit.normals, side * count + m, scale(-sign, jaw))


@kernel
def pair_points(surface, pad, fit):
    """Pair every pad point with its nearest object point, as far as a sample is within ``REACH``.

    A point counts by how squarely the surface faces its pad, and less the farther it lies off, so that pads that reach
    beyond the object are not bent around its edges. The nearest sample stands for its tangent plane, which is all that
    the fits ask of it.
    """
    _pose_pads(pad, fit)
    for i in range(len(fit.points)):
        point = get(fit.points, i)
        sample, far = _nearest_within(surface.grid, point, fit.samples[i])
        fit.weights[i] = 0.0
        if sample >= 0:
            fit.samples[i] = sample
            put(fit.targets, i, get(surface.grid.points, sample))
            put(fit.target_normals, i, get(surface.normals, sample))
            facing = -dot(get(fit.normals, i), get(surface.normals, sample))
            fit.weights[i] = max(0.0, facing) / (1.0 + (far / OUTLIER) ** 2)


@kernel
def _nearest_within(grid, query, hint):
    """Sample nearest to ``query`` and its distance [m]; -1 when none is within ``REACH``."""
    reach = min(REACH, norm(subtract(get(grid.points, hint), query)) + 1e-12)
    low, high = cell_range(grid, query, reach)
    best, least = -1, reach * reach
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for i in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                offset = subtract(get(grid.points, i), query)
                squared = dot(offset, offset)
                if squared < least:
                    best, least = i, squared
    return best, math.sqrt(least)


@kernel
def palm_equations(fit, approach, wanted):
    """Normal equations of the palm fit for a small motion: turn about the gripper's origin, then shift.

    Rows of the surface error E_p, of alpha times the normal error E_n, of the approach error E_a, in the names of
    [Fan2018ISF]; E_p and E_n as weighted means over the points.

    Returns:
        E_p + alpha^2 E_n as it stands [m^2].
    """
    fit.A[:], fit.b[:] = 0.0, 0.0
    error = 0.0
    origin, total = (fit.position[0], fit.position[1], fit.position[2]), 1e-12
    for i in range(len(fit.points)):
        total += fit.weights[i]
    for i in range(len(fit.points)):
        weight = fit.weights[i] / total
        if weight > 0.0:
            p, n_p = get(fit.points, i), get(fit.normals, i)
            q, n_q = get(fit.targets, i), get(fit.target_normals, i)
            gap, tilt = dot(subtract(q, p), n_q), -(dot(n_p, n_q) + 1.0)
            _add_row(fit, weight, cross(subtract(p, origin), n_q), n_q, gap)
            facing = NORMAL_WEIGHT * NORMAL_WEIGHT * weight
            _add_row(fit, facing, cross(n_p, n_q), (0.0, 0.0, 0.0), tilt)
            error += weight * gap * gap + facing * tilt * tilt
    # |n_z' x n_app|^2 with n_z' = n_z + r x n_z: rows of [n_app] [n_z] r + n_z x n_app.
    misalignment, along = cross(approach, wanted), dot(approach, wanted)
    for k in range(3):
        unit = (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
        row = subtract(scale(dot(approach, unit), wanted), scale(along, unit))
        _add_row(fit, APPROACH_WEIGHT * APPROACH_WEIGHT, row, (0.0, 0.0, 0.0), -dot(misalignment, unit))
    for k in range(6):
        fit.A[k, k] += DAMPING * (NORMAL_WEIGHT * NORMAL_WEIGHT if k < 3 else 1.0)
    return error


@kernel
def _add_row(fit, weight, turn, shift, value):
    """Add weight (row^T row) to A and weight (row^T value) to b."""
    row = (turn[0], turn[1], turn[2], shift[0], shift[1], shift[2])
    for j in range(6):
        fit.b[j, 0] += weight * row[j] * value
        for k in range(6):
            fit.A[j, k] += weight * row[j] * row[k]


@kernel
def width_step(fit):
    """How much wider the pads should stand [m] for the current pose and correspondences: sum K H / sum K^2."""
    above, below = 0.0, 1e-12
    for i in range(len(fit.points)):
        n_q = get(fit.target_normals, i)
        K = 0.5 * dot(get(fit.normals, i), n_q)
        H = dot(subtract(get(fit.points, i), get(fit.targets, i)), n_q)
        above += fit.weights[i] * K * H
        below += fit.weights[i] * K * K
    return above / below
