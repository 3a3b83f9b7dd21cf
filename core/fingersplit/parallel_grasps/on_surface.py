"""Whether given parallel grasps touch the object that they are for."""

from collections.abc import Sequence

import numpy as np

from fingersplit.errors import ParallelGraspError
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.surface_kernel import closest
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp

__all__ = ["MAX_CONTACT", "check_on_surface"]

MAX_CONTACT = 5e-3
"""Most that a given contact may lie off the surface [m]."""


def check_on_surface(model: ObjectModel, grasps: Sequence[ParallelGrasp]) -> None:
    """Refuse parallel grasps that do not touch the object.

    Raises:
        ParallelGraspError: A contact lies off the surface; the error says which grasp's.
    """
    for index, grasp in enumerate(grasps):
        for contact in grasp.contacts:
            _, point, _ = closest(model.surface, tuple(contact), -1)
            distance = float(np.linalg.norm(contact - point))
            if distance > MAX_CONTACT:
                raise ParallelGraspError(
                    f"Contact {contact.tolist()} of parallel grasp {index + 1} lies {1e3 * distance:.1f} mm from the "
                    f"surface; allowed: {1e3 * MAX_CONTACT:g} mm. Give points on it, in the object frame, in metres.",
                    index,
                )
