"""Parallel grasps to start from, as a request's scene, cones and regions allow them."""

from collections.abc import Sequence

import numpy as np

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.parallel_grasps.sources import find_parallel_grasps
from fingersplit.parallel_grasps.steering import keep_possible, steer_grasps
from fingersplit.scene.preparing import PreparedScene

__all__ = ["allowed_starts", "find_starts"]

MORE_PAIRS = 2
"""Times the pairs that are searched for where a scene may rule some out."""
GRASPS_PER_START = 4
"""Steered parallel grasps that are screened for a start; as many as without a scene."""


def find_starts(
    model: ObjectModel,
    hand: Hand,
    scene: PreparedScene,
    starts: int,
    *,
    source: str,
    friction: float,
    rng: np.random.Generator,
    threads: int,
) -> ParallelGrasps:
    """Parallel grasps for ``starts`` starts; arguments as ``parallel_grasps.sources.find_parallel_grasps``."""
    searched = starts * MORE_PAIRS if scene.restricts else starts
    found = find_parallel_grasps(
        model, searched, source=source, friction=friction, opening=hand.gripper.opening, rng=rng, threads=threads
    )
    if not scene.restricts:
        return found
    return steer_grasps(found, scene, model, hand, max(1, GRASPS_PER_START * starts))


def allowed_starts(grasps: Sequence[ParallelGrasp], scene: PreparedScene) -> Sequence[ParallelGrasp]:
    """Those of given parallel grasps whose approach a request allows."""
    given = grasps if isinstance(grasps, ParallelGrasps) else ParallelGrasps.from_grasps(grasps)
    return keep_possible(given, scene) if scene.restricts else grasps
