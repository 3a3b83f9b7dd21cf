"""Torsional friction of a soft pad: what its patch of contact carries about the normal.

A spherical pad of radius R and effective modulus E* that presses with N touches over a patch of radius
a = (3 N R / (4 E*))^(1/3), with Hertz's pressure [Johnson1985, eq. 4.22]. Sliding all over it, it resists a moment
of (3 pi / 16) mu a N about the normal [Howe1996], so its torsional friction coefficient is (3 pi / 16) mu a, a length.
"""

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["PAD_MODULUS", "torsional_friction"]

PAD_MODULUS = 1.5e6
"""Effective modulus E / (1 - nu^2) of a rubber pad of about 40 Shore A [Pa]."""
_HERTZ = 3.0 * math.pi / 16.0
MIN_FORCE = 0.5
"""[N]; a pad that presses with less keeps the patch of this force."""


def torsional_friction(
    friction: NDArray[np.float64], forces: NDArray[np.float64], radii: NDArray[np.float64], modulus: float = PAD_MODULUS
) -> NDArray[np.float64]:
    """Torsional friction coefficient of each pad, (F,) [m]: largest moment over normal force.

    Args:
        friction: Sliding friction coefficients, (F,).
        forces: Normal forces, (F,) [N].
        radii: Radii of the pads, (F,) [m]; no patch is larger.
        modulus: Effective modulus of the pads [Pa].
    """
    patches = np.minimum((0.75 * np.maximum(forces, MIN_FORCE) * radii / modulus) ** (1.0 / 3.0), radii)
    return np.asarray(_HERTZ * friction * patches)
