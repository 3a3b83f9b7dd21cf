"""How near the links of a hand come to each other: the pairs of shapes that ``HAND`` lists, by GJK [Gilbert1988]."""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import place_on_link, place_shape
from fingersplit.scene.convex_kernel import shape_to_shape
from fingersplit.vectors_kernel import dot, get, put, subtract

__all__ = ["SELF_RANGE", "measure_self_clearance"]

SELF_RANGE = 5e-3
"""[m]; links farther apart have no clearance to speak of."""


@kernel
def measure_self_clearance(hand, state, work):
    """Least distance of any listed pair into ``state.self_clearance`` [m]: negative inside, infinite when far.

    Args:
        hand: ``HAND`` record.
        state: ``STATE`` record whose pose is up to date.
        work: ``SELF_WORK`` record.
    """
    nearest = SELF_RANGE
    for shape in range(hand.shape_count):
        put(work.centers, shape, place_on_link(hand, state, shape, get(hand.shape_positions, shape)))
    for pair in range(hand.pair_count):
        a, b = hand.pairs[pair, 0], hand.pairs[pair, 1]
        apart = subtract(get(work.centers, a), get(work.centers, b))
        reach = hand.shape_radii[a] + hand.shape_radii[b] + nearest
        if dot(apart, apart) < reach * reach:
            first = place_shape(hand, state, a, work.rotations[0])
            second = place_shape(hand, state, b, work.rotations[1])
            one = hand.shape_kinds[a], hand.shape_sizes[a], work.rotations[0], first
            other = hand.shape_kinds[b], hand.shape_sizes[b], work.rotations[1], second
            distance, _, _ = shape_to_shape(*one, *other, nearest, work.rows)
            nearest = min(nearest, distance)
    state.self_clearance = nearest if nearest < SELF_RANGE else math.inf
