"""Antipodal parallel grasps: two surface points that see each other inside their friction cones [Nguyen1988].

Approach directions stand all around the jaw axis of each pair.
"""

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.cones import cone_cosine
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.crossing_pairs_kernel import crossing_pairs
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.source import ParallelGraspSource, SourceRequest
from fingersplit.parallel_grasps.spread_kernel import COVERING, spread_pairs
from fingersplit.threads import in_threads

__all__ = ["ANTIPODAL", "MIN_OPENING", "sample_antipodal"]

APPROACHES = 8
"""Approach directions about the jaw axis that are tried for every antipodal pair."""
MIN_RAYS, RAYS_PER_PAIR = 640, 10
FOLLOWED = 64
"""Fewest rays that a thread follows at a time."""
MIN_OPENING = 1e-4
"""[m]; nearer to each other than this, two surfaces are one to the rays that look for pairs."""


def sample_antipodal(
    model: ObjectModel,
    count: int,
    *,
    friction: float,
    opening: tuple[float, float],
    approaches: int,
    rng: np.random.Generator,
    threads: int = 1,
) -> ParallelGrasps:
    """Antipodal pairs spread over the object, each with evenly turned approach directions.

    From evenly chosen surface samples, rays run inwards within the friction cone; wherever one leaves the object inside
    the friction cone of the far side, its ends are antipodal. Pairs that are aligned with the surface about both ends
    and near the centre of mass come first, and the kept ones cover the object.

    Args:
        model: The prepared object.
        count: Most pairs to return.
        friction: Coulomb friction coefficient of both jaws.
        opening: Least and largest jaw opening [m].
        approaches: Approach directions per pair, evenly about the jaw axis from a random first one.
        rng: Source of every random choice.
        threads: Threads that follow the rays; the answer does not depend on it.

    Returns:
        At most ``count * approaches`` grasps, the approaches of a pair next to each other; empty when no pair fits.
    """
    rays = max(MIN_RAYS, RAYS_PER_PAIR * count)
    draws = rng.random((rays, 3))
    draws[:, 0] = (np.arange(rays) + draws[:, 0]) / rays
    least_cosine, narrowest = cone_cosine(friction), max(opening[0], MIN_OPENING)

    def follow(part: slice) -> tuple[NDArray[np.float64], ...]:
        found: tuple[NDArray[np.float64], ...] = crossing_pairs(
            model.triangles, model.surface, draws[part], least_cosine, narrowest, opening[1]
        )
        return found

    first, second, contact_scores = map(np.concatenate, zip(*in_threads(follow, rays, FOLLOWED, threads), strict=True))
    off_center = np.linalg.norm((first + second) / 2 - model.center_of_mass, axis=1) / model.radius
    order = np.argsort(off_center - contact_scores, kind="stable")
    if (contact_scores > 0).any():  # contacts next to edges serve only where the object offers no others
        order = order[contact_scores[order] > 0]
    first, second = first[order], second[order]
    chosen = spread_pairs(first, second, count, model.radius * np.array(COVERING))
    return _turn_approaches(np.stack([first[chosen], second[chosen]], axis=1), approaches, rng)


def _turn_approaches(contacts: NDArray[np.float64], approaches: int, rng: np.random.Generator) -> ParallelGrasps:
    """Each pair of ``contacts`` (n, 2, 3) [m] with ``approaches`` directions about its jaw axis."""
    jaws = contacts[:, 0] - contacts[:, 1]
    jaws /= np.linalg.norm(jaws, axis=1, keepdims=True)
    sides = np.cross(jaws, np.eye(3)[np.argmin(np.abs(jaws), axis=1)])
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    angles = 2 * np.pi * (rng.random((len(jaws), 1)) + np.arange(approaches) / approaches)  # (n, approaches)
    directions = np.cos(angles)[..., None] * sides[:, None] + np.sin(angles)[..., None] * np.cross(jaws, sides)[:, None]
    return ParallelGrasps(np.repeat(contacts, approaches, axis=0), directions.reshape(-1, 3))


def _find(request: SourceRequest) -> ParallelGrasps:
    return sample_antipodal(
        request.model,
        max(1, request.starts // 2),
        friction=request.friction,
        opening=request.opening,
        approaches=APPROACHES,
        rng=request.rng,
        threads=request.threads,
    )


ANTIPODAL = ParallelGraspSource(
    "antipodal", "Two surface points that see each other inside their friction cones.", _find
)
