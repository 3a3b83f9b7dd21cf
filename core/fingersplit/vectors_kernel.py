"""Small vectors and matrices inside kernels: a 3-vector is a tuple of three floats, so nothing is allocated."""

import math

from fingersplit.compilation import kernel

__all__ = [
    "add",
    "angle_between",
    "column",
    "cross",
    "dot",
    "factorize",
    "get",
    "multiply",
    "norm",
    "put",
    "rotate",
    "rotate_back",
    "scale",
    "set_rotation_about",
    "solve_positive_definite",
    "substitute",
    "subtract",
    "vector",
]


@kernel
def get(rows, i):
    """Row ``i`` of an (n, 3) array as a vector."""
    return rows[i, 0], rows[i, 1], rows[i, 2]


@kernel
def put(rows, i, v):
    """Write vector ``v`` to row ``i`` of an (n, 3) array."""
    rows[i, 0], rows[i, 1], rows[i, 2] = v


@kernel
def column(matrix, k):
    """Column ``k`` of a (3, n) array as a vector."""
    return matrix[0, k], matrix[1, k], matrix[2, k]


@kernel
def vector(array):
    """A (3,) array as a vector."""
    return array[0], array[1], array[2]


@kernel
def add(a, b):
    """Sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@kernel
def subtract(a, b):
    """Difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def scale(s, a):
    """Product s a."""
    return s * a[0], s * a[1], s * a[2]


@kernel
def dot(a, b):
    """Inner product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """Cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def norm(a):
    """Euclidean length |a|."""
    return math.sqrt(dot(a, a))


@kernel
def angle_between(a, b):
    """Angle between two vectors [rad], exact also where the cosine is flat."""
    return math.atan2(norm(cross(a, b)), dot(a, b))


@kernel
def rotate(R, v):
    """R v for a (3, 3) array."""
    return (
        R[0, 0] * v[0] + R[0, 1] * v[1] + R[0, 2] * v[2],
        R[1, 0] * v[0] + R[1, 1] * v[1] + R[1, 2] * v[2],
        R[2, 0] * v[0] + R[2, 1] * v[1] + R[2, 2] * v[2],
    )


@kernel
def rotate_back(R, v):
    """R^T v for a (3, 3) array."""
    return (
        R[0, 0] * v[0] + R[1, 0] * v[1] + R[2, 0] * v[2],
        R[0, 1] * v[0] + R[1, 1] * v[1] + R[2, 1] * v[2],
        R[0, 2] * v[0] + R[1, 2] * v[1] + R[2, 2] * v[2],
    )


@kernel
def multiply(A, B, out):
    """Product A B of (3, 3) arrays into ``out``, which is neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@kernel
def set_rotation_about(axis, angle, out):
    """Rotation by ``angle`` [rad] about the unit vector ``axis`` (Rodrigues) into ``out`` (3, 3)."""
    x, y, z = axis
    s, c = math.sin(angle), math.cos(angle)
    v = 1.0 - c
    out[0, 0], out[0, 1], out[0, 2] = c + v * x * x, v * x * y - s * z, v * x * z + s * y
    out[1, 0], out[1, 1], out[1, 2] = v * x * y + s * z, c + v * y * y, v * y * z - s * x
    out[2, 0], out[2, 1], out[2, 2] = v * x * z - s * y, v * y * z + s * x, c + v * z * z


@kernel
def solve_positive_definite(A, B, n):
    """Solve A X = B for the leading (n, n) block by Cholesky.

    Both are overwritten; X stands in the first n rows of B.

    Rows of a block that has lost rank (pivot below 1e-12 of its diagonal) get X = 0.
    """
    factorize(A, n)
    substitute(A, B, n)


@kernel
def factorize(A, n):
    """Overwrite the lower triangle of the leading (n, n) block by its Cholesky factor, see above for lost rank."""
    for j in range(n):
        diagonal = A[j, j]
        for k in range(j):
            diagonal -= A[j, k] * A[j, k]
        pivot = math.sqrt(diagonal) if diagonal > 1e-12 * A[j, j] else math.inf
        A[j, j] = pivot
        for i in range(j + 1, n):
            entry = A[i, j]
            for k in range(j):
                entry -= A[i, k] * A[j, k]
            A[i, j] = entry / pivot


@kernel
def substitute(A, B, n):
    """Solve A X = B for a block that ``factorize`` has overwritten; X replaces the first n rows of B."""
    for column in range(B.shape[1]):
        for i in range(n):
            for k in range(i):
                B[i, column] -= A[i, k] * B[k, column]
            B[i, column] /= A[i, i]
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                B[i, column] -= A[k, i] * B[k, column]
            B[i, column] /= A[i, i]
