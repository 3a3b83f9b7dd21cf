"""Area, volume and their moments of a triangle surface, in one pass over its faces."""

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, cross, dot, get, norm, subtract

__all__ = ["surface_moments"]


@kernel
def surface_moments(vertices, faces, origin):
    """Sums over the faces (m, 3) and the tetrahedra between them and ``origin``.

    A tetrahedron with one corner at the origin and the others at a, b, c has the volume det / 6, the first moment
    det / 24 s and the second moment det / 120 (a a^T + b b^T + c c^T + s s^T), where det = a . (b x c), s = a + b + c.

    Returns:
        Area [m^2], volume [m^3], and the volume's first moment (3,) [m^4] and second moment (3, 3) [m^5] about the
        origin; the volume is negative for a surface turned inside out.
    """
    area, volume, first, second = 0.0, 0.0, np.zeros(3), np.zeros((3, 3))
    for face in range(len(faces)):
        a = subtract(get(vertices, faces[face, 0]), origin)
        b = subtract(get(vertices, faces[face, 1]), origin)
        c = subtract(get(vertices, faces[face, 2]), origin)
        s = add(add(a, b), c)
        det = dot(a, cross(b, c))
        area += norm(cross(subtract(b, a), subtract(c, a))) / 2
        volume += det / 6
        for i in range(3):
            first[i] += det / 24 * s[i]
            for j in range(3):
                second[i, j] += det / 120 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j])
    return area, volume, first, second
