"""A hand with the bodies that are fixed to its palm."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from fingersplit.errors import SceneError
from fingersplit.hands.hand import Hand
from fingersplit.hands.limits import MAX_SHAPES, MAX_SPHERES
from fingersplit.hands.model import Shape
from fingersplit.hands.shapes import bounding_radius, covering_spheres
from fingersplit.scene.end_effector import AttachedBody
from fingersplit.transforms import transform_points

__all__ = ["attach_bodies"]

PALM = 0
"""Link that carries the bodies."""


@lru_cache(maxsize=16)
def attach_bodies(hand: Hand, bodies: tuple[AttachedBody, ...]) -> Hand:
    """The same hand with more collision shapes on its palm; the hand itself without any.

    Raises:
        SceneError: More shapes than the kernels have room for.
    """
    if not bodies:
        return hand
    arrays: np.record = hand.arrays.copy()
    for number, body in enumerate(bodies):
        k, kind, size = int(arrays.shape_count), body.primitive.kind, body.primitive.half_sizes
        centers, radius, insides = covering_spheres(kind, size)
        first, count = int(arrays.sphere_count), len(centers)
        if k == MAX_SHAPES or first + count > MAX_SPHERES:
            raise SceneError(
                f"end_effector.attached_bodies[{number}]",
                f"does not fit: a hand has at most {MAX_SHAPES} shapes and {MAX_SPHERES} spheres that cover them. "
                f"Give fewer bodies, or thicker ones.",
            )
        pose = body.pose.matrix
        arrays.shape_kinds[k], arrays.shape_fingers[k], arrays.shape_links[k] = kind, -1, 0
        arrays.shape_rotations[k], arrays.shape_positions[k] = pose[:3, :3], pose[:3, 3]
        arrays.shape_sizes[k, : len(size)], arrays.shape_radii[k] = size, bounding_radius(kind, size)
        spheres = slice(first, first + count)
        arrays.sphere_shapes[spheres], arrays.sphere_centers[spheres] = k, transform_points(pose, centers)
        arrays.sphere_radii[spheres], arrays.sphere_insides[spheres] = radius, insides
        arrays.shape_count, arrays.sphere_count = k + 1, first + count
        arrays.sphere_starts[k + 1] = first + count
    shapes = tuple(
        Shape(body.id, PALM, body.primitive.kind, body.primitive.half_sizes, body.pose.matrix, 0.0, (body.id,))
        for body in bodies
    )
    return replace(hand, arrays=arrays, model=replace(hand.model, shapes=(*hand.model.shapes, *shapes)))
