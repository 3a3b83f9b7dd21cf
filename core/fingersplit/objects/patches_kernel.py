"""Kernels of `patches`: sharing triangles out among samples."""

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.grid_kernel import nearest
from fingersplit.vectors_kernel import add, dot, get, norm, put, scale, subtract

__all__ = ["STACKED", "halve_triangle", "share_out"]

MAX_SIDE = 1.5
"""[spacings]; sides of the pieces that triangles are cut into, each of which goes to a sample near its middle."""
NEAR = 0.75
"""[spacings]; the sample of the piece before will do if it is within this of the middle."""
STACKED = 64
"""Pieces of a triangle that wait at a time: each halving adds one, and more than 64 are of no use."""


@kernel
def share_out(vertices, faces, surface):
    """``starts``, ``members``, ``reaches`` and ``plane_deviations`` of the patches."""
    samples = len(surface.normals)
    starts, latest = np.zeros(samples + 1, np.int32), np.full(samples, -1, np.int32)
    reaches, plane_deviations = np.zeros(samples), np.zeros(samples)
    owners, owned, count = np.empty(4 * samples, np.int32), np.empty(4 * samples, np.int32), 0
    stack, sample = np.empty((STACKED, 3, 3)), -1
    for face in range(len(faces)):
        for k in range(3):
            put(stack[0], k, get(vertices, faces[face, k]))
        waiting = 1
        while waiting > 0:
            waiting -= 1
            if halve_triangle(stack, waiting, MAX_SIDE * surface.spacing):
                waiting += 2
                continue
            sample = _own(stack[waiting], surface, sample, reaches, plane_deviations)
            if latest[sample] != face:
                latest[sample] = face
                if count == owners.size:
                    owners, owned = np.concatenate((owners, owners)), np.concatenate((owned, owned))
                owners[count], owned[count] = sample, face
                count += 1
                starts[sample + 1] += 1
    for i in range(samples):
        starts[i + 1] += starts[i]
    filled, members = starts[:-1].copy(), np.empty(count, np.int32)
    for m in range(count):
        members[filled[owners[m]]] = owned[m]
        filled[owners[m]] += 1
    return starts, members, reaches, plane_deviations


@kernel
def _own(piece, surface, hint, reaches, plane_deviations):
    """A sample near the middle of a piece, which reaches as far as the piece does from now on."""
    a, b, c = get(piece, 0), get(piece, 1), get(piece, 2)
    middle, sample = scale(1.0 / 3.0, add(a, add(b, c))), hint
    if hint < 0 or norm(subtract(middle, get(surface.grid.points, hint))) > NEAR * surface.spacing:
        sample = nearest(surface.grid, middle, hint)
    place, normal = get(surface.grid.points, sample), get(surface.normals, sample)
    for corner in (a, b, c):
        offset = subtract(corner, place)
        reaches[sample] = max(reaches[sample], norm(offset))
        plane_deviations[sample] = max(plane_deviations[sample], abs(dot(offset, normal)))
    return sample


@kernel
def halve_triangle(stack, place, longest):
    """Cut a triangle on the stack (n, 3, 3) across its longest side if that is longer than ``longest`` [m].

    Returns:
        Whether it was cut; its halves then take its place and the next one.
    """
    if place + 2 > len(stack):
        return False
    a, b, c = get(stack[place], 0), get(stack[place], 1), get(stack[place], 2)
    ab, bc, ca = norm(subtract(b, a)), norm(subtract(c, b)), norm(subtract(a, c))
    if max(ab, bc, ca) <= longest:
        return False
    if bc == max(ab, bc, ca):
        a, b, c = b, c, a
    elif ca == max(ab, bc, ca):
        a, b, c = c, a, b
    middle = scale(0.5, add(a, b))
    put(stack[place], 0, a)
    put(stack[place], 1, middle)
    put(stack[place], 2, c)
    put(stack[place + 1], 0, middle)
    put(stack[place + 1], 1, b)
    put(stack[place + 1], 2, c)
    return True
