"""The nonlinear projection that CPO and PPO share: joints that follow a fingertip displacement within their limits."""

from fingersplit.compilation import kernel
from fingersplit.vectors import solve_positive_definite

__all__ = ["at_limit", "track"]

DAMPING = 1e-3
"""[m/rad]; two percent of a short finger's reach, so a straight finger does not run away."""

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

    Minimises |J d_q - displacement|^2 + DAMPING^2 |d_q|^2 with the joint limits as bounds: a joint that would cross its
    limit stops there, and the others take over. Writes the new angles to ``joints`` (N,) [rad].
    """
    count, J = hand.joint_counts[finger], pose.jacobians[finger]
    frozen = work.frozen
    for j in range(count):
        frozen[j] = False
    for _ in range(count):
        for i in range(count):
            free_i = 0.0 if frozen[i] else 1.0
            for j in range(count):
                entry = J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j]
                work.matrix[i, j] = entry * free_i if not frozen[j] else 0.0
            work.matrix[i, i] += DAMPING * DAMPING
            work.columns[i, 0] = free_i * (
                J[0, i] * displacement[0] + J[1, i] * displacement[1] + J[2, i] * displacement[2]
            )
            work.columns[i, 1] = 0.0
        for i in range(count):
            if frozen[i]:
                fixed = joints[hand.joint_indices[finger, i]] - pose.joints[hand.joint_indices[finger, i]]
                for j in range(count):
                    if not frozen[j]:
                        entry = J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j]
                        work.columns[j, 0] -= entry * fixed
        solve_positive_definite(work.matrix, work.columns, count)
        worst, worst_excess = -1, 0.0
        for i in range(count):
            if not frozen[i]:
                j = hand.joint_indices[finger, i]
                angle = pose.joints[j] + work.columns[i, 0]
                joints[j] = min(max(angle, hand.lower[j]), hand.upper[j])
                if abs(angle - joints[j]) > worst_excess:
                    worst, worst_excess = i, abs(angle - joints[j])
        if worst < 0:
            return
        frozen[worst] = True
