"""Kernels that start the surface fitting all over an object, judge what comes of it and learn where it pays."""

import math
from typing import NamedTuple

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.surface_kernel import touch
from fingersplit.objects.triangle_grid_kernel import cast, face_normal
from fingersplit.parallel_grasps.crossing_pairs_kernel import CROSSINGS, across
from fingersplit.parallel_grasps.fitting_kernel import fit_pads, get_column
from fingersplit.vectors_kernel import add, cross, dot, get, norm, put, scale, subtract

__all__ = ["GripperBody", "body_points", "guided_fits"]

TURNS = 8
"""Directions about the jaw axis from which a start may come."""
MIN_FACING = 0.5
"""Cosine between a start's jaw axis and the far side's normal, below which fitting would have to turn too far."""
TOUCHING = 1e-3
"""[m]; a pad point this far above the surface rests on it."""
MAX_MISALIGNMENT = 3e-3
"""[m]; a pad point farther from its nearest object point reaches beyond the object."""
MIN_CONTACT_SCORE = 0.25
"""Share of a pad that has to rest squarely on the surface."""


class GripperBody(NamedTuple):
    """What of a gripper may not meet the object, in its frame [m].

    Attributes:
        finger: Half a finger's lateral width.
        thickness: From a pad's face through the finger.
        pad_height: How far a pad stands out of its finger; what lies beside the pad at that height is free.
        tip: From the pads' centre to the fingertips, along the approach.
        reach: From the pads' centre back to the palm.
        palm_lateral: Half the palm's lateral width.
        palm_jaw: Half the palm's width along the jaw axis.
        palm_depth: From the palm's face back through the palm.
    """

    finger: float
    thickness: float
    pad_height: float
    tip: float
    reach: float
    palm_lateral: float
    palm_jaw: float
    palm_depth: float


@kernel
def guided_fits(
    triangles, surface, coarse, regions, pad, body, opening, least_cosine, draws, fit, contacts, approaches
):
    """Fit the gripper from one start a draw; regions that keep failing are started in less and less.

    A region is chosen with odds of (1 + successes) / (2 + trials), the mean of what its record lets expect; a trial
    whose grasp is refused is counted as a regret.

    Args:
        triangles: ``TriangleGrid``.
        surface: ``Surface``.
        coarse: Few surface points that show whether an approach is free, (n, 3) [m].
        regions: First entry of each region in the list of its samples, and that list.
        pad: Points of a pad along the lateral and the approach axis, (m, 2) [m].
        body: ``GripperBody``.
        opening: Least and largest width [m].
        least_cosine: Cosine of the friction cone's half angle.
        draws: For each start four numbers in [0, 1): region, sample, far side, first approach, (n, 4).
        fit: Room for a fit.
        contacts: Gets the contacts of each accepted grasp, (n, 2, 3) [m].
        approaches: Gets its approach, (n, 3).

    Returns:
        How squarely the pads rest (n,), the worse pad's share, 0 where the start came to nothing; trials and regrets of
        the regions.
    """
    starts, members = regions
    trials, regrets = np.zeros(len(starts) - 1), np.zeros(len(starts) - 1)
    contact_scores, distances, faces = np.zeros(len(draws)), np.empty(CROSSINGS), np.empty(CROSSINGS, np.int64)
    for n in range(len(draws)):
        region = _choose_region(trials, regrets, draws[n, 0])
        place = starts[region] + int(draws[n, 1] * (starts[region + 1] - starts[region]))
        trials[region] += 1.0
        wanted = _start(triangles, surface, coarse, members[place], body, opening, draws[n], fit, distances, faces)
        if norm(wanted) > 0.0:
            fit_pads(surface, pad, opening, wanted, fit)
            contact_scores[n] = _judge(surface, body, opening, least_cosine, fit, contacts[n])
            put(approaches, n, get_column(fit.rotation, 2))
        if contact_scores[n] == 0.0:
            regrets[region] += 1.0
    return contact_scores, trials, regrets


@kernel
def _choose_region(trials, regrets, draw):
    total = 0.0
    for k in range(trials.size):
        total += (1.0 + trials[k] - regrets[k]) / (2.0 + trials[k])
    left = draw * total
    for k in range(trials.size):
        left -= (1.0 + trials[k] - regrets[k]) / (2.0 + trials[k])
        if left <= 0.0:
            return k
    return trials.size - 1


@kernel
def _start(triangles, surface, coarse, sample, body, opening, draw, fit, distances, faces):
    """Put the gripper across the object from a sample; its approach, or zero where no start is possible."""
    nowhere = (0.0, 0.0, 0.0)
    first, outward = get(surface.grid.points, sample), get(surface.normals, sample)
    inward = scale(-1.0, outward)
    crossings = cast(triangles, first, inward, opening[1], distances, faces)
    fitting = 0
    for k in range(crossings):
        facing = dot(face_normal(triangles, faces[k]), inward)
        if distances[k] > max(opening[0], 2.0 * TOUCHING) and facing > MIN_FACING:
            distances[fitting] = distances[k]
            fitting += 1
    if fitting == 0:
        return nowhere
    fit.width[0] = distances[int(draw[2] * fitting)]
    middle = add(first, scale(0.5 * fit.width[0], inward))
    fit.position[0], fit.position[1], fit.position[2] = middle
    fit.samples[:] = sample
    side = across(outward)
    best, fewest = nowhere, len(coarse)
    for turn in range(TURNS):
        angle = 2.0 * math.pi * (turn + draw[3]) / TURNS
        approach = add(scale(math.cos(angle), side), scale(math.sin(angle), cross(outward, side)))
        _set_axes(fit.rotation, outward, approach)
        inside = body_points(coarse, body, fit, fewest)
        if inside < fewest:
            best, fewest = approach, inside
    if norm(best) > 0.0:
        _set_axes(fit.rotation, outward, best)
    return best


@kernel
def _set_axes(rotation, jaw, approach):
    lateral = cross(jaw, approach)
    for k in range(3):
        rotation[k, 0], rotation[k, 1], rotation[k, 2] = lateral[k], jaw[k], approach[k]


@kernel
def body_points(points, body, fit, most):
    """Number of points (n, 3) inside the gripper's body; counting ends at ``most``."""
    lateral, jaw, approach = get_column(fit.rotation, 0), get_column(fit.rotation, 1), get_column(fit.rotation, 2)
    middle, half = (fit.position[0], fit.position[1], fit.position[2]), 0.5 * fit.width[0]
    inside = 0
    for i in range(len(points)):
        offset = subtract(get(points, i), middle)
        x, y, z = abs(dot(offset, lateral)), abs(dot(offset, jaw)), dot(offset, approach)
        in_finger = (
            x < body.finger and half + body.pad_height < y < half + body.thickness and -body.reach < z < body.tip
        )
        in_palm = (
            x < body.palm_lateral
            and y < max(body.palm_jaw, half + body.thickness)
            and -body.reach - body.palm_depth < z < -body.reach
        )
        if in_finger or in_palm:
            inside += 1
            if inside >= most:
                break
    return inside


@kernel
def _judge(surface, body, opening, least_cosine, fit, contacts):
    """Share of the worse pad that rests squarely; 0 for a grasp that would slip, hang in the air or collide."""
    count, worst = len(fit.points) // 2, 1.0
    jaw = get_column(fit.rotation, 1)
    middle = (fit.position[0], fit.position[1], fit.position[2])
    for side in range(2):
        score, sign = 0.0, 1.0 - 2.0 * side
        for m in range(side * count, (side + 1) * count):
            target, normal = get(fit.targets, m), get(fit.target_normals, m)
            gap = subtract(target, get(fit.points, m))
            if abs(dot(gap, normal)) < TOUCHING and norm(gap) < MAX_MISALIGNMENT:
                score += max(0.0, -dot(get(fit.normals, m), normal)) / count
        worst = min(worst, score)
        center = add(middle, scale(0.5 * sign * fit.width[0], jaw))
        distance, contact = touch(surface, center, fit.samples[side * count])
        if distance > MAX_MISALIGNMENT:
            return 0.0
        put(contacts, side, contact)
    if worst < MIN_CONTACT_SCORE or not _within_cones(contacts, least_cosine, opening, fit):
        return 0.0
    return 0.0 if body_points(surface.grid.points, body, fit, 1) > 0 else worst


@kernel
def _within_cones(contacts, least_cosine, opening, fit):
    """Whether the contacts see each other inside their friction cones, within the jaws and across the approach."""
    first, second = get(contacts, 0), get(contacts, 1)
    across_jaws = subtract(first, second)
    width = norm(across_jaws)
    if not opening[0] <= width <= opening[1] or width < 2.0 * TOUCHING:
        return False
    across_jaws = scale(1.0 / width, across_jaws)
    count = len(fit.points) // 2
    for side in range(2):
        center = side * count + count // 2
        sign = 1.0 - 2.0 * side
        if sign * dot(across_jaws, get(fit.target_normals, center)) < least_cosine:
            return False
    return norm(cross(across_jaws, get_column(fit.rotation, 2))) > 0.5
