"""Antipodal parallel grasps: two surface points that see each other inside their friction cones [Nguyen1988]."""

import math

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp

__all__ = ["sample_antipodal"]

RAYS_PER_PAIR = 20
LEAST_OPENING = 2e-3
"""[m]; thinner than this a pad cannot be placed on both sides."""


def sample_antipodal(
    model: ObjectModel,
    count: int,
    *,
    friction: float,
    opening: tuple[float, float],
    approaches: int,
    rng: np.random.Generator,
) -> list[ParallelGrasp]:
    """Antipodal pairs spread over the object, each with evenly turned approach directions.

    From random surface samples, rays run inwards within the friction cone; wherever one leaves the object inside the
    friction cone of the far side, its ends are antipodal. Pairs are kept best first, as long as they differ.

    Args:
        model: The prepared object.
        count: Most pairs to return.
        friction: Coulomb friction coefficient of both jaws.
        opening: Least and largest jaw opening [m].
        approaches: Approach directions per pair, evenly about the jaw axis from a random first one.
        rng: Source of every random choice.

    Returns:
        At most ``count * approaches`` grasps, the approaches of a pair next to each other; empty when no pair fits.
    """
    first, second, alignment = _antipodal_pairs(model, count * RAYS_PER_PAIR, friction, opening, rng)
    off_center = np.linalg.norm((first + second) / 2 - model.center_of_mass, axis=1) / model.radius
    order = np.argsort(off_center - alignment, kind="stable")
    pairs = _spread(first[order], second[order], count, model.radius)
    grasps = []
    for contacts in pairs:
        jaw = (contacts[0] - contacts[1]) / np.linalg.norm(contacts[0] - contacts[1])
        side = np.cross(jaw, np.eye(3)[np.argmin(np.abs(jaw))])
        side /= np.linalg.norm(side)
        angles = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(approaches) / approaches
        for angle in angles:
            approach = math.cos(angle) * side + math.sin(angle) * np.cross(jaw, side)
            grasps.append(ParallelGrasp(contacts, approach))
    return grasps


def _antipodal_pairs(
    model: ObjectModel, rays: int, friction: float, opening: tuple[float, float], rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Both ends (n, 3) [m] of antipodal pairs and their alignment, the lesser cosine to a normal, (n,)."""
    samples, normals = model.surface.grid.points, model.surface.normals
    half_angle = math.atan(friction)
    starts = rng.integers(len(samples), size=rays)
    inward = -normals[starts]
    directions = _within_cone(inward, half_angle, rng)
    step = 0.1 * model.surface.spacing
    faces, ray_of_hit, ends = model.mesh.trimesh.ray.intersects_id(
        samples[starts] + step * inward, directions, multiple_hits=True, return_locations=True
    )
    end_normals = model.mesh.trimesh.face_normals[faces]
    directions, first = directions[ray_of_hit], samples[starts][ray_of_hit]
    alignment = np.minimum(
        np.einsum("ij,ij->i", end_normals, directions), np.einsum("ij,ij->i", inward[ray_of_hit], directions)
    )
    width = np.linalg.norm(ends - first, axis=1)
    fits = (alignment >= math.cos(half_angle)) & (width >= max(opening[0], LEAST_OPENING)) & (width <= opening[1])
    return first[fits], ends[fits], alignment[fits]


def _within_cone(axes: NDArray[np.float64], half_angle: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """One random unit vector (n, 3) within ``half_angle`` [rad] of each axis, evenly over the cone's cap."""
    cosine = rng.uniform(math.cos(half_angle), 1.0, len(axes))
    turn = rng.uniform(0, 2 * np.pi, len(axes))
    first = np.cross(axes, np.eye(3)[np.argmin(np.abs(axes), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(axes, first)
    sine = np.sqrt(1 - cosine**2)
    return np.asarray(
        cosine[:, None] * axes + (sine * np.cos(turn))[:, None] * first + (sine * np.sin(turn))[:, None] * second
    )


def _spread(
    first: NDArray[np.float64], second: NDArray[np.float64], count: int, radius: float
) -> list[NDArray[np.float64]]:
    """The first ``count`` pairs (2, 3) that are not nearly an earlier one, whichever way round."""
    least_distance = 0.1 * radius
    kept: list[NDArray[np.float64]] = []
    for pair in np.stack([first, second], axis=1):
        if len(kept) == count:
            break
        if kept:
            others = np.array(kept)
            same = np.abs(others - pair).sum(axis=(1, 2)) < 2 * least_distance
            swapped = np.abs(others[:, ::-1] - pair).sum(axis=(1, 2)) < 2 * least_distance
            if (same | swapped).any():
                continue
        kept.append(pair)
    return kept
