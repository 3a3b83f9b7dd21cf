"""Which triangles lie about each surface sample, and how far they reach: samples then speak for the whole surface."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.objects.grid import PointGrid, nearest
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.surface import Surface
from fingersplit.vectors_kernel import add, dot, get, norm, put, scale, subtract

__all__ = ["STACKED", "Patches", "build_patches", "halve_triangle"]

LONGEST = 1.5
"""[spacings]; sides of the pieces that triangles are cut into, each of which goes to a sample near its middle."""
NEAR = 0.75
"""[spacings]; the sample of the piece before will do if it is within this of the middle."""
STACKED = 64
"""Pieces of a triangle that wait at a time: each halving adds one, and more than 64 are of no use."""


class Patches(NamedTuple):
    """A mesh's surface as patches, one a sample; a triangle stands in the list of every patch that has a piece of it.

    Attributes:
        grid: The samples (n, 3) [m].
        normals: Their outward unit normals, (n, 3).
        vertices: Corner points of the mesh, (n_vertices, 3) [m].
        faces: Vertex indices, (n_faces, 3) int32.
        starts: First entry of each sample in ``members``, one more than there are samples, int32.
        members: Face indices, patch after patch, int32.
        reaches: Farthest that each patch goes from its sample, (n,) [m].
        rises: Farthest that each patch goes from its sample's tangent plane, (n,) [m].
        longest_reach: The greatest of ``reaches`` [m].
    """

    grid: PointGrid
    normals: NDArray[np.float64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    starts: NDArray[np.int32]
    members: NDArray[np.int32]
    reaches: NDArray[np.float64]
    rises: NDArray[np.float64]
    longest_reach: float


def build_patches(mesh: Mesh, surface: Surface) -> Patches:
    """Share out a mesh's triangles among its samples; the arrays are read-only."""
    starts, members, reaches, rises = _share_out(mesh.vertices, mesh.faces, surface)
    for array in (starts, members, reaches, rises):
        array.setflags(write=False)
    return Patches(
        surface.grid, surface.normals, mesh.vertices, mesh.faces, starts, members, reaches, rises, float(reaches.max())
    )


@kernel
def _share_out(vertices, faces, surface):
    """``starts``, ``members``, ``reaches`` and ``rises`` of the patches."""
    samples = len(surface.normals)
    starts, latest = np.zeros(samples + 1, np.int32), np.full(samples, -1, np.int32)
    reaches, rises = np.zeros(samples), np.zeros(samples)
    owners, owned, count = np.empty(4 * samples, np.int32), np.empty(4 * samples, np.int32), 0
    stack, sample = np.empty((STACKED, 3, 3)), -1
    for face in range(len(faces)):
        for k in range(3):
            put(stack[0], k, get(vertices, faces[face, k]))
        waiting = 1
        while waiting > 0:
            waiting -= 1
            if halve_triangle(stack, waiting, LONGEST * surface.spacing):
                waiting += 2
                continue
            sample = _own(stack[waiting], surface, sample, reaches, rises)
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
    return starts, members, reaches, rises


@kernel
def _own(piece, surface, hint, reaches, rises):
    """A sample near the middle of a piece, which reaches as far as the piece does from now on."""
    a, b, c = get(piece, 0), get(piece, 1), get(piece, 2)
    middle, sample = scale(1.0 / 3.0, add(a, add(b, c))), hint
    if hint < 0 or norm(subtract(middle, get(surface.grid.points, hint))) > NEAR * surface.spacing:
        sample = nearest(surface.grid, middle, hint)
    place, normal = get(surface.grid.points, sample), get(surface.normals, sample)
    for corner in (a, b, c):
        offset = subtract(corner, place)
        reaches[sample] = max(reaches[sample], norm(offset))
        rises[sample] = max(rises[sample], abs(dot(offset, normal)))
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
