"""The drivers of a hand in its ``HAND`` record: joints q = S theta + q0."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.limits import MAX_CHAIN_DRIVERS, MAX_DRIVERS

__all__ = ["driver_jacobians", "drivers_of", "joints_of", "set_drivers"]


def set_drivers(
    hand: np.record,
    coupling: NDArray[np.float64],
    offset: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> None:
    """Write the drivers of a hand whose chains and joints are set.

    A joint that stands still has a row of zeros and its angle as offset.

    Args:
        hand: ``HAND`` record, changed.
        coupling: S, (N, A).
        offset: q0, (N,) [rad].
        lower: Lower driver limits, (A,) [rad], such that every joint that follows one driver alone keeps its own.
        upper: Upper driver limits, likewise.

    Raises:
        HandError: More drivers than the kernels have room for, a driver without a range, or one that moves nothing.
    """
    joints, drivers = coupling.shape
    if not 1 <= drivers <= MAX_DRIVERS:
        raise HandError(f"The hand has {drivers} drivers; 1 to {MAX_DRIVERS} are planned for.")
    for driver in range(drivers):
        if not coupling[:, driver].any():
            raise HandError(f"Driver {driver} moves no joint; leave it out.")
        if not (np.isfinite([lower[driver], upper[driver]]).all() and lower[driver] < upper[driver]):
            raise HandError(
                f"Driver {driver} goes from {lower[driver]:g} to {upper[driver]:g} rad; give a finite range."
            )
    hand.driver_count = drivers
    hand.coupling[:joints, :drivers], hand.coupling_offset[:joints] = coupling, offset
    hand.driver_lower[:drivers], hand.driver_upper[:drivers] = lower, upper
    hand.uncoupled = joints == drivers and bool((coupling == np.eye(joints)).all()) and not offset.any()
    mixed = np.flatnonzero(np.count_nonzero(coupling, axis=1) > 1)
    hand.mixed_count, hand.mixed_joints[: len(mixed)] = len(mixed), mixed
    used = np.zeros(drivers, np.int64)
    for chain in range(hand.chain_count):
        moving = _drivers_of_chain(hand, coupling, chain)
        if len(moving) > MAX_CHAIN_DRIVERS:
            raise HandError(f"{len(moving)} drivers move one finger; at most {MAX_CHAIN_DRIVERS} are planned for.")
        hand.driver_counts[chain], hand.driver_indices[chain, : len(moving)] = len(moving), moving
        if chain < hand.finger_count:
            used[moving] += 1
    hand.fingers_coupled = bool((used > 1).any())


def joints_of(hand: np.record, drivers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints q = S theta + q0 (..., N) of drivers (..., A) [rad], of a ``HAND`` record."""
    joints, count = hand.joint_count, hand.driver_count
    if hand.uncoupled:
        return drivers.copy()
    return np.asarray(drivers @ hand.coupling[:joints, :count].T + hand.coupling_offset[:joints])


def drivers_of(hand: np.record, joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Drivers (..., A) [rad] that put the joints (..., N) [rad] where they are, or as near as they can."""
    count = hand.joint_count
    if hand.uncoupled:
        return joints.copy()
    inverse = np.linalg.pinv(hand.coupling[:count, : hand.driver_count])
    return np.asarray((joints - hand.coupling_offset[:count]) @ inverse.T)


def driver_jacobians(hand: np.record, jacobians: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pads' motion by all drivers, (..., F, 3, A) [m/rad], from ``jacobians`` of poses, (..., F, 3, MAX_CHAIN_DRIVERS).

    The torques at the drivers that balance forces f on the pads are the sum over fingers of J_theta,f^T f.
    """
    fingers, counts, indices = hand["finger_count"], hand["driver_counts"], hand["driver_indices"]
    dense = np.zeros((*jacobians.shape[:-3], fingers, 3, hand["driver_count"]))
    for finger in range(fingers):
        count = counts[finger]
        dense[..., finger, :, indices[finger, :count]] = np.moveaxis(jacobians[..., finger, :, :count], -1, 0)
    return dense


def _drivers_of_chain(hand: np.record, coupling: NDArray[np.float64], chain: int) -> list[int]:
    """Drivers that move a chain, in the order of the first joint that each of them moves."""
    joints = hand.joint_indices[chain, : hand.joint_counts[chain]]
    found: dict[int, None] = {}
    for joint in joints.tolist():
        found.update(dict.fromkeys(np.flatnonzero(coupling[joint]).tolist()))
    return list(found)
