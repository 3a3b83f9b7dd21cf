"""Closing jaws on the mesh: where two pads that travel towards each other first touch it."""

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.triangle_grid_kernel import cast, face_normal
from fingersplit.vectors_kernel import add, cross, dot, get, put, scale, subtract

__all__ = ["close_jaws"]

ROWS = 5
"""Rays along either side of a pad."""
PATCH = 1e-3
"""[m]; of what is touched within this depth, the point nearest to the pad's middle is the contact."""


@kernel
def close_jaws(triangles, centers, axes, approaches, openings, pads, contacts):
    """Close each gripper until both pads touch.

    Args:
        triangles: ``TriangleGrid``.
        centers: Midway between the open pads, (n, 3) [m].
        axes: Unit direction from pad 1 to pad 0, (n, 3).
        approaches: Unit direction of travel towards the object, (n, 3).
        openings: Distance of the open pads, (n,) [m].
        pads: Lateral width of the pads and their length along the approach, (n, 2) [m]; zero for single points.
        contacts: Gets where pad 0 and pad 1 touch, (n, 2, 3) [m].

    Returns:
        Whether both pads touch, (n,): not where a jaw meets nothing, starts inside the object, or would have to pass
        the other.
    """
    touched = np.zeros(len(centers), np.bool_)
    distances, faces = np.empty(1), np.empty(1, np.int64)
    for i in range(len(centers)):
        axis = get(axes, i)
        if _close(triangles, centers, axes, approaches, openings, pads, i, 0, distances, faces, contacts[i]) and _close(
            triangles, centers, axes, approaches, openings, pads, i, 1, distances, faces, contacts[i]
        ):
            between = dot(subtract(get(contacts[i], 0), get(contacts[i], 1)), axis)
            touched[i] = between > PATCH
    return touched


@kernel
def _close(triangles, centers, axes, approaches, openings, pads, i, side, distances, faces, contacts):
    """Sweep one pad inwards; whether it touches, and where into ``contacts[side]``."""
    axis, approach = get(axes, i), get(approaches, i)
    outwards = scale(1.0 - 2.0 * side, axis)
    inwards = scale(-1.0, outwards)
    lateral = cross(axis, approach)
    open_middle = add(get(centers, i), scale(0.5 * openings[i], outwards))
    first, best = openings[i], np.inf
    rows = ROWS if pads[i, 0] > 0.0 or pads[i, 1] > 0.0 else 1
    for sweep in range(2):  # how far the pad comes, then which of what it touches is nearest to its middle
        for a in range(rows):
            for b in range(rows):
                u, v = pads[i, 0] * ((a + 0.5) / rows - 0.5), pads[i, 1] * ((b + 0.5) / rows - 0.5)
                origin = add(open_middle, add(scale(u, lateral), scale(v, approach)))
                if cast(triangles, origin, inwards, openings[i], distances, faces) == 0:
                    continue
                if dot(face_normal(triangles, faces[0]), inwards) > 0.0:
                    return False
                if sweep == 0:
                    first = min(first, distances[0])
                elif distances[0] <= first + PATCH and u * u + v * v < best:
                    best = u * u + v * v
                    put(contacts, side, add(origin, scale(distances[0], inwards)))
    return best < np.inf
