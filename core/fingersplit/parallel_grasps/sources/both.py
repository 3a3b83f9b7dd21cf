"""Half of the grasps antipodal, half fitted to the surface."""

from dataclasses import replace

import numpy as np

from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.source import ParallelGraspSource, SourceRequest
from fingersplit.parallel_grasps.sources.antipodal import ANTIPODAL
from fingersplit.parallel_grasps.sources.surface_fitting import SURFACE_FITTING

__all__ = ["BOTH"]


def _find(request: SourceRequest) -> ParallelGrasps:
    half = replace(request, starts=max(1, request.starts // 2))
    sets = [source.find(half) for source in (ANTIPODAL, SURFACE_FITTING)]
    return ParallelGrasps(
        np.concatenate([grasps.contacts for grasps in sets]), np.concatenate([grasps.approaches for grasps in sets])
    )


BOTH = ParallelGraspSource("both", "Half of them antipodal, half fitted to the surface.", _find)
