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
    x, y, z = np.moveaxis((contacts - center) / length, -1, 0)
    zero = np.zeros_like(x)
    torques = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    torques = np.moveaxis(torques, -3, -2).reshape(*x.shape[:-1], 3, -1)  # (..., 3, 3 F)
    forces = np.broadcast_to(np.tile(np.eye(3), x.shape[-1]), torques.shape)
    return np.concatenate([forces, torques], axis=-2)
