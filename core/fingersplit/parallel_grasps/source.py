"""What a source of parallel grasps is: a function that finds some when a request brings none."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps

__all__ = ["ParallelGraspSource", "SourceRequest"]


@dataclass(frozen=True, eq=False)
class SourceRequest:
    """What parallel grasps are wanted for.

    Attributes:
        model: The prepared object.
        starts: Starts that they are to make; each grasp makes two, one for either finger assignment.
        friction: Coulomb friction coefficient.
        opening: Least and largest jaw opening [m].
        rng: Source of every random choice.
        threads: Threads that may search; the answer must not depend on it.
    """

    model: ObjectModel
    starts: int
    friction: float
    opening: tuple[float, float]
    rng: np.random.Generator
    threads: int = 1


@dataclass(frozen=True)
class ParallelGraspSource:
    """A way to find parallel grasps.

    Attributes:
        name: What requests call it.
        meaning: How it finds them, for people.
        find: The function.
    """

    name: str
    meaning: str
    find: Callable[[SourceRequest], ParallelGrasps]
