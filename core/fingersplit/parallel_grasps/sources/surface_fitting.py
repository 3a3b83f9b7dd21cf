"""Grasps of a parallel gripper whose pads are fitted to the surface."""

from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.source import ParallelGraspSource, SourceRequest
from fingersplit.parallel_grasps.surface_fitting import PadGripper, fit_surfaces

__all__ = ["SURFACE_FITTING"]


def _find(request: SourceRequest) -> ParallelGrasps:
    gripper = PadGripper(request.opening)
    return fit_surfaces(request.model, request.starts, gripper=gripper, friction=request.friction, rng=request.rng)


SURFACE_FITTING = ParallelGraspSource(
    "surface_fitting", "A gripper whose pads are fitted to the surface from many starts.", _find
)
