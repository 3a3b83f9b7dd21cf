"""Where parallel grasps come from when none are given: one function a source."""

from collections.abc import Callable

import numpy as np

from fingersplit.errors import SettingsError
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.antipodal import sample_antipodal
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.surface_fitting import PadGripper, fit_surfaces

__all__ = ["APPROACHES", "SOURCES", "find_parallel_grasps"]

APPROACHES = 8
"""Approach directions about the jaw axis that are tried for every antipodal pair."""

Source = Callable[[ObjectModel, int, float, tuple[float, float], np.random.Generator, int], ParallelGrasps]


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
    """Parallel grasps for a hand to take over, each with either finger assignment.

    Args:
        model: The prepared object.
        starts: Starts that they are to make.
        source: Key of ``SOURCES``.
        friction: Coulomb friction coefficient.
        opening: Least and largest jaw opening [m].
        rng: Source of every random choice.
        threads: Threads that may search; the answer does not depend on it.

    Raises:
        SettingsError: Unknown source.
    """
    if source not in SOURCES:
        raise SettingsError(f"Unknown source of parallel grasps {source!r}; known: {', '.join(SOURCES)}.")
    return SOURCES[source](model, starts, friction, opening, rng, threads)


def _antipodal(
    model: ObjectModel,
    starts: int,
    friction: float,
    opening: tuple[float, float],
    rng: np.random.Generator,
    threads: int,
) -> ParallelGrasps:
    pairs = max(1, starts // 2)
    return sample_antipodal(
        model, pairs, friction=friction, opening=opening, approaches=APPROACHES, rng=rng, threads=threads
    )


def _surface_fitting(
    model: ObjectModel,
    starts: int,
    friction: float,
    opening: tuple[float, float],
    rng: np.random.Generator,
    _threads: int,
) -> ParallelGrasps:
    return fit_surfaces(model, starts, gripper=PadGripper(opening), friction=friction, rng=rng)


def _both(
    model: ObjectModel,
    starts: int,
    friction: float,
    opening: tuple[float, float],
    rng: np.random.Generator,
    threads: int,
) -> ParallelGrasps:
    half = max(1, starts // 2)
    sets = [source(model, half, friction, opening, rng, threads) for source in (_antipodal, _surface_fitting)]
    return ParallelGrasps(
        np.concatenate([grasps.contacts for grasps in sets]), np.concatenate([grasps.approaches for grasps in sets])
    )


SOURCES: dict[str, Source] = {"antipodal": _antipodal, "surface_fitting": _surface_fitting, "both": _both}
