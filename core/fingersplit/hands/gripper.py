"""The parallel gripper that a set of active fingers imitates."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.description import GripDescription
from fingersplit.hands.limits import MAX_PRESHAPES
from fingersplit.hands.model import HandModel

__all__ = ["Gripper", "driver_angles", "read_gripper"]

MAX_TILT = 0.05
"""Largest cosine of jaw and approach axis that is rounding, not a mistake."""


class Gripper(NamedTuple):
    """The parallel gripper that a hand imitates when it takes over a two-contact grasp; kernels read it as it is.

    Attributes:
        groups: For each finger the jaw it belongs to (0 or 1), (F,) int64.
        palm_from_gripper: Rotation with columns lateral, jaw (from jaw 1 to jaw 0) and approach axis, (3, 3).
        center: Jaw centre along the lateral and the jaw axis, (2,) [m].
        standoff: Lowest and highest jaw centre along the approach axis [m].
        opening: Least and largest distance of the two jaw contacts [m].
        preshapes: Joint angles from which the mapping starts, (n_preshapes, N) [rad].
    """

    groups: NDArray[np.int64]
    palm_from_gripper: NDArray[np.float64]
    center: NDArray[np.float64]
    standoff: tuple[float, float]
    opening: tuple[float, float]
    preshapes: NDArray[np.float64]


def read_gripper(model: HandModel, grip: GripDescription, active: list[int]) -> Gripper:
    """The gripper of one grip of a description.

    Args:
        model: The hand.
        grip: The grip.
        active: Drivers of its fingers; all others are parked.

    Raises:
        HandError: Axes that are not across each other, too many preshapes, or one outside the drivers' limits.
    """
    jaw, approach = np.array(grip.jaw_axis), np.array(grip.approach_axis)
    jaw, approach = jaw / np.linalg.norm(jaw), approach / np.linalg.norm(approach)
    if abs(jaw @ approach) > MAX_TILT:
        raise HandError("jaw_axis and approach_axis of a grip must be across each other.")
    approach = approach - (jaw @ approach) * jaw
    approach /= np.linalg.norm(approach)
    if len(grip.preshapes) > MAX_PRESHAPES:
        raise HandError(f"A grip has {len(grip.preshapes)} preshapes; at most {MAX_PRESHAPES} are planned with.")
    resting = driver_angles(model, grip.parked, "parked")
    preshapes = []
    for number, preshape in enumerate(grip.preshapes):
        angles = resting.copy()
        angles[active] = driver_angles(model, preshape, f"preshape {number}")[active]
        preshapes.append(model.joints_from_drivers(angles))
    return Gripper(
        groups=np.array([jaw_of for jaw_of, fingers in enumerate(grip.jaws) for _ in fingers]),
        palm_from_gripper=np.column_stack([np.cross(jaw, approach), jaw, approach]),
        center=np.array(grip.center),
        standoff=grip.standoff,
        opening=grip.opening,
        preshapes=np.array(preshapes),
    )


def driver_angles(model: HandModel, named: dict[str, float], what: str) -> NDArray[np.float64]:
    """Driver angles (A,) [rad]: those named, and for the others zero or the limit nearest to it.

    Raises:
        HandError: A name that is no driver, or an angle outside its limits.
    """
    coupling = model.coupling
    angles: NDArray[np.float64] = np.clip(0.0, coupling.lower, coupling.upper)
    for name, angle in named.items():
        if name not in coupling.drivers:
            raise HandError(f"{what} names {name!r}; the hand's drivers are {', '.join(coupling.drivers)}.")
        a = coupling.drivers.index(name)
        if not coupling.lower[a] - 1e-6 <= angle <= coupling.upper[a] + 1e-6:
            raise HandError(
                f"{what} puts {name} at {angle:g} rad; it goes from {coupling.lower[a]:.4g} to {coupling.upper[a]:.4g}."
            )
        angles[a] = min(max(angle, coupling.lower[a]), coupling.upper[a])
    return angles
