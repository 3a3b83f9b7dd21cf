"""The quality that finger splitting climbs, Q = w1 Q_o + w2 Q_h of [Fan2018], with its gradients.

Departures: w2 is positive, since Q_h is already minus a sum of squares (see REFERENCES.md, Fan2018, sign of w2); with
other than three fingers Q_o is the mean over all contact triples, which is the paper's for three; Q_h counts drivers,
so that joints which follow one another count once.
"""

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, cross, get, norm, put, scale, subtract

__all__ = ["manipulability", "manipulability_gradient", "object_quality", "object_quality_gradient"]


@kernel
def object_quality(contacts, count):
    """Q_o: twice the area of the contact triangle [m^2], mean over the triples of the first ``count`` contacts [m]."""
    total, triples = 0.0, 0
    for i in range(count):
        for j in range(i + 1, count):
            for k in range(j + 1, count):
                a, b, c = get(contacts, i), get(contacts, j), get(contacts, k)
                total += norm(cross(subtract(b, a), subtract(c, a)))
                triples += 1
    return total / triples


@kernel
def object_quality_gradient(contacts, count, gradient):
    """Gradient of Q_o by the first ``count`` contacts into ``gradient`` [m]; zero where a triangle has no area."""
    gradient[:] = 0.0
    share = 6.0 / (count * (count - 1) * (count - 2))
    for i in range(count):
        for j in range(i + 1, count):
            for k in range(j + 1, count):
                a, b, c = get(contacts, i), get(contacts, j), get(contacts, k)
                normal = cross(subtract(b, a), subtract(c, a))
                length = norm(normal)
                if length > 0.0:
                    normal = scale(share / length, normal)
                    put(gradient, i, add(get(gradient, i), cross(normal, subtract(c, b))))
                    put(gradient, j, add(get(gradient, j), cross(normal, subtract(a, c))))
                    put(gradient, k, add(get(gradient, k), cross(normal, subtract(b, a))))


@kernel
def manipulability(hand, drivers):
    """Q_h: minus half the squared distances of the drivers (A,) [rad] from mid-range, each over its range."""
    total = 0.0
    for a in range(hand.driver_count):
        width = hand.driver_upper[a] - hand.driver_lower[a]
        total -= 0.5 * ((drivers[a] - 0.5 * (hand.driver_upper[a] + hand.driver_lower[a])) / width) ** 2
    return total


@kernel
def manipulability_gradient(hand, drivers, gradient):
    """Gradient of Q_h by the drivers into ``gradient`` (A,) [1/rad]."""
    for a in range(hand.driver_count):
        width = hand.driver_upper[a] - hand.driver_lower[a]
        gradient[a] = -(drivers[a] - 0.5 * (hand.driver_upper[a] + hand.driver_lower[a])) / (width * width)
