"""Many parallel grasps in a few arrays: ranked, and without a Python object for each until one is looked at."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self, overload

import numpy as np
from numpy.typing import NDArray

from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp, check_parallel_grasps

__all__ = ["ParallelGrasps"]


@dataclass(frozen=True, eq=False)
class ParallelGrasps(Sequence[ParallelGrasp]):
    """A read-only sequence of parallel grasps, best first.

    Attributes:
        contacts: Contact points in the object frame, (n, 2, 3) [m].
        approaches: Unit directions of travel towards the object, (n, 3).

    Raises:
        ParallelGraspError: A row describes no parallel grasp, as in ``ParallelGrasp``; the message names the row.
    """

    contacts: NDArray[np.float64]
    approaches: NDArray[np.float64]

    def __post_init__(self) -> None:
        contacts, approaches = check_parallel_grasps(self.contacts, self.approaches)
        object.__setattr__(self, "contacts", contacts)
        object.__setattr__(self, "approaches", approaches)

    @classmethod
    def from_grasps(cls, grasps: Iterable[ParallelGrasp]) -> Self:
        """The same grasps in one set."""
        listed = list(grasps)
        return cls(
            np.array([grasp.contacts for grasp in listed]).reshape(-1, 2, 3),
            np.array([grasp.approach for grasp in listed]).reshape(-1, 3),
        )

    def __len__(self) -> int:
        return len(self.contacts)

    @overload
    def __getitem__(self, index: int) -> ParallelGrasp: ...
    @overload
    def __getitem__(self, index: slice) -> Self: ...
    def __getitem__(self, index: int | slice) -> ParallelGrasp | Self:
        kind: Any = type(self) if isinstance(index, slice) else ParallelGrasp
        # Rows are checked and read-only already; checking each again would cost more than sampling it did.
        grasp = object.__new__(kind)
        object.__setattr__(grasp, "contacts", self.contacts[index])
        name = "approaches" if isinstance(index, slice) else "approach"
        object.__setattr__(grasp, name, self.approaches[index])
        return grasp  # type: ignore[no-any-return]
