"""Where parallel grasps come from when none are given: every module defines one source, and nothing else lists them."""

from functools import cache

import numpy as np

from fingersplit.errors import SettingsError, suggestion
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.source import ParallelGraspSource, SourceRequest
from fingersplit.registry import find_by_name

__all__ = ["available_sources", "find_parallel_grasps", "load_source"]


@cache
def available_sources() -> dict[str, ParallelGraspSource]:
    """Every source by name."""
    return find_by_name(__name__, ParallelGraspSource)


def load_source(name: str) -> ParallelGraspSource:
    """A source by its name.

    Raises:
        SettingsError: No source of that name; the message lists the known ones.
    """
    sources = available_sources()
    if name not in sources:
        raise SettingsError(f"Unknown source of parallel grasps {name!r}; {suggestion(name, sources)}")
    return sources[name]


def find_parallel_grasps(
    model: ObjectModel,
    starts: int,
    *,
    source: str,
    friction: float,
    opening: tuple[float, float],
    rng: np.random.Generator,
    threads: int = 1,
) -> ParallelGrasps:
    """Parallel grasps for a hand to take over, each with either finger assignment; arguments as ``SourceRequest``.

    Raises:
        SettingsError: No source of that name; the message lists the known ones.
    """
    return load_source(source).find(SourceRequest(model, starts, friction, opening, rng, threads))
