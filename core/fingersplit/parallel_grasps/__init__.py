"""Parallel grasps: what they are and where they come from."""

from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp

__all__ = ["ParallelGrasp", "ParallelGrasps"]
