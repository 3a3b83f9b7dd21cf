"""The two-contact grasp that finger splitting starts from."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import ParallelGraspError

__all__ = ["ParallelGrasp", "check_parallel_grasps"]

MIN_JAW = 1e-6
"""[m]; contacts nearer than this coincide."""
MIN_SINE = 0.05
"""Least sine of the angle between the approach and the line between the contacts."""


@dataclass(frozen=True, eq=False)
class ParallelGrasp:
    """Two jaw contacts and the direction from which the gripper comes.

    Attributes:
        contacts: Contact points in the object frame, (2, 3) [m].
        approach: Unit direction of travel towards the object, (3,).

    Raises:
        ParallelGraspError: Wrong shapes, numbers that are not finite, contacts that coincide, or an approach without
            length or along the jaws.
    """

    contacts: NDArray[np.float64]
    approach: NDArray[np.float64]

    def __post_init__(self) -> None:
        contacts, approach = _vectors("contacts", self.contacts, (2, 3)), _vectors("approach", self.approach, (3,))
        checked_contacts, approaches = check_parallel_grasps(contacts[None], approach[None])
        object.__setattr__(self, "contacts", checked_contacts[0])
        object.__setattr__(self, "approach", approaches[0])

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """From ``{"contacts": [[x, y, z], [x, y, z]], "approach": [x, y, z]}``.

        Raises:
            ParallelGraspError: A key is missing, or the values describe no grasp.
        """
        missing = {"contacts", "approach"} - set(document)
        if missing:
            raise ParallelGraspError(f"A parallel grasp needs 'contacts' and 'approach'; missing: {min(missing)!r}.")
        return cls(document["contacts"], document["approach"])

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data."""
        return {"contacts": self.contacts.tolist(), "approach": self.approach.tolist()}


def check_parallel_grasps(
    contacts: NDArray[np.float64], approaches: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Contacts (n, 2, 3) [m] and approaches (n, 3) as read-only copies, the approaches of unit length.

    Raises:
        ParallelGraspError: A row describes no parallel grasp; of several rows the message names the first bad one.
    """
    contacts, approaches = np.array(contacts, dtype=np.float64), np.array(approaches, dtype=np.float64)
    jaws = contacts[:, 0] - contacts[:, 1]  # (n, 3)
    with np.errstate(invalid="ignore", divide="ignore"):
        widths = np.linalg.norm(jaws, axis=1)
        lengths = np.linalg.norm(approaches, axis=1)
        units = approaches / lengths[:, None]
        sines = np.linalg.norm(np.cross(jaws, units), axis=1) / widths
    finite = np.isfinite(contacts).all(axis=(1, 2)) & np.isfinite(approaches).all(axis=1)
    _refuse(~finite, "The numbers of {} must be finite.")
    _refuse(widths < MIN_JAW, "The two contacts of {} coincide; give points on opposite sides.")
    _refuse(lengths < 1e-9, "The approach of {} has no length; give a direction of travel.")
    _refuse(
        ~(sines >= MIN_SINE),
        "The approach of {} runs along the line between its contacts; give a direction across that line.",
    )
    for array in (contacts, units):
        array.setflags(write=False)
    return contacts, units


def _refuse(flags: ArrayLike, sentence: str) -> None:
    bad = np.asarray(flags)
    if bad.any():
        raise ParallelGraspError(
            sentence.format("a parallel grasp" if len(bad) == 1 else f"parallel grasp {np.argmax(bad) + 1}")
        )


def _vectors(name: str, value: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape:
        wanted = "two points [[x, y, z], [x, y, z]]" if len(shape) == 2 else "a vector [x, y, z]"
        raise ParallelGraspError(f"The {name} of a parallel grasp must be {wanted} of numbers, got {value!r}.")
    if not np.isfinite(array).all():
        raise ParallelGraspError(f"The {name} of a parallel grasp must be finite, got {array.tolist()}.")
    return array
