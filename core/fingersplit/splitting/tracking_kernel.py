"""The nonlinear projection that CPO and PPO share: drivers that follow fingertip displacements within their limits.

Where no driver moves two fingers each finger is solved for alone; else all fingers together, in one system.
"""

from fingersplit.compilation import kernel
from fingersplit.splitting.bounded_kernel import solve_bounded
from fingersplit.vectors_kernel import get

__all__ = ["STATIONARY", "TOGETHER", "add_row", "at_limit", "begin_steps", "end_steps", "track"]

TOGETHER = -1
"""In place of a finger: all drivers of the hand in one system."""

DAMPING = 1e-3
"""[m/rad]; two percent of a short finger's reach, so a straight finger does not run away."""

STATIONARY = 1e-9
"""A tangent step this much shorter than the gradient is rounding: there is no way to go."""

LIMIT_MARGIN = 1e-9
"""[rad]; closer than this a driver counts as standing at its limit."""

HOLDING = 1e3
"""[m/rad]; a joint of several drivers that meets its limit is held there with this weight."""
HOLDING_ROUNDS = 3


@kernel
def at_limit(hand, drivers, a, direction):
    """Whether driver ``a`` stands at the limit that a motion of this sign would push it through."""
    if direction > 0.0:
        return drivers[a] >= hand.driver_upper[a] - LIMIT_MARGIN
    return direction < 0.0 and drivers[a] <= hand.driver_lower[a] + LIMIT_MARGIN


@kernel
def track(hand, pose, displacements, solver, drivers):
    """Move the drivers so that all pads follow their displacements (F, 3) [m], as J^-1 in [Fan2018] does.

    Minimises |J d_theta - displacement|^2 + DAMPING^2 |d_theta|^2 with the driver limits as bounds. Writes the new
    drivers to ``drivers`` (A,) [rad], which must not be ``pose.drivers``.
    """
    drivers[:] = pose.drivers  # those of no finger stay
    if hand.fingers_coupled:
        count = begin_steps(hand, pose, TOGETHER, DAMPING, solver)
        for finger in range(hand.finger_count):
            _add_pad(hand, pose, finger, get(displacements, finger), solver)
        end_steps(hand, pose, TOGETHER, count, solver, drivers)
        return
    for finger in range(hand.finger_count):
        count = begin_steps(hand, pose, finger, DAMPING, solver)
        _add_pad(hand, pose, finger, get(displacements, finger), solver)
        end_steps(hand, pose, finger, count, solver, drivers)


@kernel
def begin_steps(hand, pose, finger, damping, solver):
    """Bounds and damping [m/rad] of a finger's drivers, or of all those of ``TOGETHER``; how many they are."""
    count = hand.driver_count if finger == TOGETHER else hand.driver_counts[finger]
    for i in range(count):
        a = i if finger == TOGETHER else hand.driver_indices[finger, i]
        solver.lowest[i] = hand.driver_lower[a] - pose.drivers[a]
        solver.highest[i] = hand.driver_upper[a] - pose.drivers[a]
        solver.right[i] = 0.0
        for k in range(count):
            solver.normal[i, k] = damping * damping if i == k else 0.0
    return count


@kernel
def end_steps(hand, pose, finger, count, solver, drivers):
    """Solve for the ``count`` steps, with joints of several drivers held within their limits, and take them."""
    solve_bounded(count, solver)
    if hand.mixed_count > 0:
        _hold_joints(hand, pose, finger, count, solver)
    for i in range(count):
        a = i if finger == TOGETHER else hand.driver_indices[finger, i]
        drivers[a] = min(max(pose.drivers[a] + solver.steps[i], hand.driver_lower[a]), hand.driver_upper[a])


@kernel
def add_row(count, value, weight, solver):
    """Add weight (row x - value)^2 for the row in ``solver.row``."""
    for i in range(count):
        scaled = weight * solver.row[i]
        if scaled != 0.0:
            solver.right[i] += scaled * value
            for k in range(count):
                solver.normal[i, k] += scaled * solver.row[k]


@kernel
def _add_pad(hand, pose, finger, target, solver):
    """Add |J x - target|^2 for a finger's pad."""
    J, together = pose.jacobians[finger], hand.fingers_coupled
    for i in range(hand.driver_counts[finger]):
        row = hand.driver_indices[finger, i] if together else i
        right = 0.0
        for k in range(3):
            right += J[k, i] * target[k]
        solver.right[row] += right
        for j in range(hand.driver_counts[finger]):
            column = hand.driver_indices[finger, j] if together else j
            solver.normal[row, column] += J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j]


@kernel
def _hold_joints(hand, pose, finger, count, solver):
    """Solve again with every joint of several drivers that would leave its range held at the limit it meets.

    What is left beyond a limit, which the weight of the holding leaves, is taken from the whole step.
    """
    for _ in range(HOLDING_ROUNDS):
        excess = False
        for m in range(hand.mixed_count):
            j = hand.mixed_joints[m]
            change = _joint_change(hand, finger, j, count, solver)
            limit = min(max(pose.joints[j] + change, hand.lower[j]), hand.upper[j])
            if abs(pose.joints[j] + change - limit) > LIMIT_MARGIN:
                excess = True
                add_row(count, limit - pose.joints[j], HOLDING * HOLDING, solver)
        if not excess:
            return
        solve_bounded(count, solver)
    share = 1.0
    for m in range(hand.mixed_count):
        j = hand.mixed_joints[m]
        change = _joint_change(hand, finger, j, count, solver)
        room = hand.upper[j] - pose.joints[j] if change > 0.0 else hand.lower[j] - pose.joints[j]
        if abs(change) > LIMIT_MARGIN and room / change < share:
            share = max(room / change, 0.0)
    for i in range(count):
        solver.steps[i] *= share


@kernel
def _joint_change(hand, finger, joint, count, solver):
    """How far the steps turn a joint [rad]; its row of S by these drivers goes to ``solver.row``."""
    change = 0.0
    for i in range(count):
        a = i if finger == TOGETHER else hand.driver_indices[finger, i]
        solver.row[i] = hand.coupling[joint, a]
        change += solver.row[i] * solver.steps[i]
    return change
