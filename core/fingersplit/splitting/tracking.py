"""The nonlinear projection that CPO and PPO share: joints that follow a fingertip displacement within their limits."""

from fingersplit.compilation import kernel
from fingersplit.vectors import add, dot, scale, solve_positive_definite

__all__ = ["STATIONARY", "at_limit", "track"]

DAMPING = 1e-3
"""[m/rad]; two percent of a short finger's reach, so a straight finger does not run away."""

ACTIVE_SET_ROUNDS = 12
"""More than the four joints of a finger ever need."""

LEAST_PULL_BACK = 1e-15
"""[m^2/rad]; rounding, not a pull."""

STATIONARY = 1e-9
"""A tangent step this much shorter than the gradient is rounding: there is no way to go."""

LIMIT_MARGIN = 1e-9
"""[rad]; closer than this a joint counts as standing at its limit."""


@kernel
def at_limit(hand, joints, j, direction):
    """Whether joint ``j`` stands at the limit that a motion of this sign would push it through."""
    if direction > 0.0:
        return joints[j] >= hand.upper[j] - LIMIT_MARGIN
    return direction < 0.0 and joints[j] <= hand.lower[j] + LIMIT_MARGIN


@kernel
def track(hand, pose, finger, displacement, work, joints):
    """Move one finger's joints so that its pad follows ``displacement`` (3,) [m], as J^-1 in [Fan2018] does.

    Minimises |J d_q - displacement|^2 + DAMPING^2 |d_q|^2 with the joint limits as bounds, by an active set: a joint
    that would cross its limit is held there, and one that is held but pulled back inside is let go. Writes the new
    angles to ``joints`` (N,) [rad], which must not be ``pose.joints``.
    """
    count = hand.joint_counts[finger]
    for i in range(count):
        work.frozen[i] = False
    for _ in range(ACTIVE_SET_ROUNDS):
        _solve_free_joints(hand, pose, finger, displacement, work, joints)
        if _hold_worst(hand, pose, finger, work, joints):
            continue
        if not _let_go(hand, pose, finger, displacement, work, joints):
            return


@kernel
def _solve_free_joints(hand, pose, finger, displacement, work, joints):
    """Steps of the joints that are not held, given the steps of those that are, into ``work.columns[:, 0]``."""
    count, J, frozen = hand.joint_counts[finger], pose.jacobians[finger], work.frozen
    for i in range(count):
        work.columns[i, 0], work.columns[i, 1] = 0.0, 0.0
        for j in range(count):
            work.matrix[i, j] = DAMPING * DAMPING if i == j else 0.0
        if frozen[i]:
            continue
        for k in range(3):
            work.columns[i, 0] += J[k, i] * displacement[k]
        for j in range(count):
            entry = J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j]
            if frozen[j]:
                index = hand.joint_indices[finger, j]
                work.columns[i, 0] -= entry * (joints[index] - pose.joints[index])
            else:
                work.matrix[i, j] += entry
    solve_positive_definite(work.matrix, work.columns, count)


@kernel
def _hold_worst(hand, pose, finger, work, joints):
    """Take the steps of the free joints up to their limits and hold the one that was cut most; whether any was."""
    worst, worst_excess = -1, 0.0
    for i in range(hand.joint_counts[finger]):
        if not work.frozen[i]:
            j = hand.joint_indices[finger, i]
            angle = pose.joints[j] + work.columns[i, 0]
            joints[j] = min(max(angle, hand.lower[j]), hand.upper[j])
            if abs(angle - joints[j]) > worst_excess:
                worst, worst_excess = i, abs(angle - joints[j])
    if worst >= 0:
        work.frozen[worst] = True
    return worst >= 0


@kernel
def _let_go(hand, pose, finger, displacement, work, joints):
    """Free the held joint that the objective pulls back inside most strongly; whether there was one."""
    count, J = hand.joint_counts[finger], pose.jacobians[finger]
    gap = scale(-1.0, displacement)
    for i in range(count):
        j = hand.joint_indices[finger, i]
        gap = add(gap, scale(joints[j] - pose.joints[j], (J[0, i], J[1, i], J[2, i])))
    strongest, strongest_pull = -1, LEAST_PULL_BACK
    for i in range(count):
        if work.frozen[i]:
            j = hand.joint_indices[finger, i]
            slope = dot((J[0, i], J[1, i], J[2, i]), gap) + DAMPING * DAMPING * (joints[j] - pose.joints[j])
            pull = slope if joints[j] >= hand.upper[j] else -slope
            if pull > strongest_pull:
                strongest, strongest_pull = i, pull
    if strongest >= 0:
        work.frozen[strongest] = False
    return strongest >= 0
