"""Generalised winding numbers by their definition: the sum of solid angles [Barill2018]."""

import math

import numba

__all__ = ["winding_numbers"]


@numba.njit(nogil=True)
def winding_numbers(vertices, faces, points, numbers):
    """Winding number of a triangle soup about each point, into ``numbers`` (n,).

    Args:
        vertices: (m, 3).
        faces: Vertex indices, counter-clockwise seen from outside, (k, 3).
        points: (n, 3).
        numbers: Gets the numbers.
    """
    for i in range(len(points)):
        total = 0.0
        for face in range(len(faces)):
            p, q, r = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
            ax, ay, az = p[0] - points[i, 0], p[1] - points[i, 1], p[2] - points[i, 2]
            bx, by, bz = q[0] - points[i, 0], q[1] - points[i, 1], q[2] - points[i, 2]
            cx, cy, cz = r[0] - points[i, 0], r[1] - points[i, 1], r[2] - points[i, 2]
            a = math.sqrt(ax * ax + ay * ay + az * az)
            b = math.sqrt(bx * bx + by * by + bz * bz)
            c = math.sqrt(cx * cx + cy * cy + cz * cz)
            det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
            total += math.atan2(det, a * b * c + ab * c + bc * a + ca * b)
        numbers[i] = total / (2.0 * math.pi)
