"""The two-contact grasp that finger splitting starts from."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import ParallelGraspError

__all__ = ["ParallelGrasp"]


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
        jaw = contacts[0] - contacts[1]
        if np.linalg.norm(jaw) < 1e-6:
            raise ParallelGraspError("The two contacts of a parallel grasp coincide; give points on opposite sides.")
        if np.linalg.norm(approach) < 1e-9:
            raise ParallelGraspError("The approach of a parallel grasp has no length; give a direction of travel.")
        approach = approach / np.linalg.norm(approach)
        if np.linalg.norm(np.cross(jaw / np.linalg.norm(jaw), approach)) < 0.05:
            raise ParallelGraspError(
                "The approach of a parallel grasp runs along the line between its contacts; "
                "give a direction across that line."
            )
        for array in (contacts, approach):
            array.setflags(write=False)
        object.__setattr__(self, "contacts", contacts)
        object.__setattr__(self, "approach", approach)

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
