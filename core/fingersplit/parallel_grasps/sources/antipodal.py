"""Antipodal pairs of surface points, with approach directions all around."""

from fingersplit.parallel_grasps.antipodal import sample_antipodal
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.source import ParallelGraspSource, SourceRequest

__all__ = ["ANTIPODAL"]

APPROACHES = 8
"""Approach directions about the jaw axis that are tried for every antipodal pair."""


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
