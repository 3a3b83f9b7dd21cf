"""The grasp matrix: from contact forces to the wrench on the object [Murray1994]."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["grasp_matrix"]


def grasp_matrix(
    contacts: NDArray[np.float64], center: NDArray[np.float64], length: float = 1.0
) -> NDArray[np.float64]:
    """Map from stacked contact forces to force and torque on the object, (..., 6, 3 F).

    Args:
        contacts: Contact points of one grasp or of many, (..., F, 3) [m].
        center: Point that torques are taken about, (3,) [m].
        length: What torques are divided by [m]; with the object's size all six rows are forces.
    """
    offsets = (contacts - center) / length
    G = np.zeros((*offsets.shape[:-2], 6, offsets.shape[-2], 3))
    for axis, (after, last) in enumerate(((1, 2), (2, 0), (0, 1))):  # e_after x e_last = e_axis
        G[..., axis, :, axis] = 1.0
        G[..., 3 + axis, :, last] = offsets[..., after]
        G[..., 3 + axis, :, after] = -offsets[..., last]
    return G.reshape(*G.shape[:-2], -1)
