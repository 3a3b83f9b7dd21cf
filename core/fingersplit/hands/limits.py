"""Sizes that the kernels are built for: every record and every scratch array derives its room from these."""

__all__ = [
    "MAX_CHAIN_DRIVERS",
    "MAX_CHAIN_JOINTS",
    "MAX_DRIVERS",
    "MAX_FINGERS",
    "MAX_JOINTS",
    "MAX_PAIRS",
    "MAX_PLANES",
    "MAX_PRESHAPES",
    "MAX_SHAPES",
    "MAX_SPHERES",
    "MAX_STANDOFFS",
    "MAX_UNKNOWNS",
    "PAD_ANGLE_LIMIT",
    "SHAPE_NUMBERS",
]

MAX_FINGERS = 5
"""Fingers of a hand, each a chain of joints."""
MAX_CHAIN_JOINTS = 6
"""Joints of one finger."""
MAX_JOINTS = 24
"""Joints of a hand."""
MAX_DRIVERS = MAX_JOINTS
"""Drivers of a hand: what motors turn; one a joint where nothing is coupled."""
MAX_CHAIN_DRIVERS = 8
"""Drivers that move one finger."""
MAX_UNKNOWNS = MAX_DRIVERS + 6
"""Unknowns of the largest system that a step solves: all drivers and a twist of the palm."""
MAX_SHAPES, MAX_SPHERES = 48, 256
"""Collision shapes of a hand, and spheres that cover them."""
MAX_PLANES = 64
"""Planes of a convex solid."""
SHAPE_NUMBERS = 2 + 4 * MAX_PLANES + 3 * (2 * MAX_PLANES - 4)
"""Numbers of a shape: planes and, by Euler's formula, corners of a convex solid; primitives have three."""
MAX_PAIRS = MAX_SHAPES * (MAX_SHAPES - 1) // 2
"""Pairs of shapes that are tested against each other."""
MAX_PRESHAPES, MAX_STANDOFFS = 8, 16
"""Preshapes of a hand, and standoffs at which the Map looks at each."""

PAD_ANGLE_LIMIT = 0.6
"""[rad]; most between a usual pad's normal and the inward surface normal, see REFERENCES.md, Fan2018, gamma."""

assert 3 * MAX_FINGERS <= MAX_UNKNOWNS, "a force at every fingertip is solved for in the same room"
assert MAX_CHAIN_JOINTS <= MAX_CHAIN_DRIVERS <= MAX_DRIVERS, "a finger of uncoupled joints has a driver for each"
