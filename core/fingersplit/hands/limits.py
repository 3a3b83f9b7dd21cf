"""Sizes that the kernels are built for: every record and every scratch array derives its room from these."""

__all__ = [
    "MAX_CHAIN_JOINTS",
    "MAX_EQUATIONS",
    "MAX_FINGERS",
    "MAX_JOINTS",
    "MAX_PRESHAPES",
    "MAX_SHAPES",
    "MAX_SPHERES",
    "MAX_STANDOFFS",
]

MAX_FINGERS = 5
"""Fingers of a hand."""
MAX_CHAIN_JOINTS = 4
"""Joints of one finger."""
MAX_JOINTS = MAX_FINGERS * MAX_CHAIN_JOINTS
"""Joints of a hand."""
MAX_EQUATIONS = 3 * MAX_FINGERS
"""Unknowns of the largest system that a step solves: a force at every fingertip."""
MAX_SHAPES, MAX_SPHERES = 32, 96
"""Collision shapes of a hand, and spheres that cover them."""
MAX_PRESHAPES, MAX_STANDOFFS = 8, 16
"""Preshapes of a hand, and standoffs at which the Map looks at each."""

# A finger's joints are solved for in the room of the fingertips.
assert MAX_CHAIN_JOINTS <= MAX_EQUATIONS
