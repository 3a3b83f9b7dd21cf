"""The ten grasps of Table I of [Fan2018], and the objects that stand in for theirs."""

from dataclasses import dataclass

from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit_bench.calls import antipodal_grasps
from fingersplit_bench.suite import Bench

__all__ = ["PAPER_CASES", "Case", "Published", "cases_of", "parallel_grasps_of"]

MIN_COSINE = 0.5
"""An approach belongs to a side when it is within 60 degrees of it."""


@dataclass(frozen=True)
class Published:
    """A row of Table I: outer iterations, CPO and PPO tangent searches, time [ms], vertices."""

    rounds: float
    cpo: float
    ppo: float
    run_ms: float
    vertices: int


@dataclass(frozen=True)
class Case:
    """One grasp of the paper and what stands in for it.

    Attributes:
        name: The paper's name.
        stand_ins: Objects that may play its part, the first one at hand does.
        side: From where the hand comes, ``"above"``, ``"below"`` or ``"beside"``; tells two poses of an object apart.
        published: The paper's row, None for a case that the paper does not have.
    """

    name: str
    stand_ins: tuple[str, ...]
    side: str
    published: Published | None

    def comes_from(self, grasp: ParallelGrasp) -> bool:
        """Whether a parallel grasp approaches from this case's side; z of the object frame is up."""
        down = -float(grasp.approach[2])
        if self.side == "beside":
            return abs(down) < MIN_COSINE
        return (down if self.side == "above" else -down) >= MIN_COSINE


PAPER_CASES = (
    Case("Mug", ("mug_dense", "mug"), "above", Published(5, 90, 22, 1257.3, 185_511)),
    Case("Oscar", ("koala", "bottle"), "above", Published(2, 69, 3, 719.7, 148_616)),
    Case("Screwdriver", ("screwdriver", "capsule"), "above", Published(3, 40, 53, 380.6, 46_721)),
    Case("Bunny", ("bunny", "ellipsoid"), "above", Published(4, 106, 28, 465.5, 43_318)),
    Case("Bunny(R)", ("bunny", "ellipsoid"), "below", Published(4, 62, 44, 403.7, 43_318)),
    Case("Doraemon", ("cat", "cylinder"), "above", Published(6, 125, 12, 484.0, 42_551)),
    Case("Hello Kitty(H)", ("rubber_duck", "wedge"), "beside", Published(5, 108, 38, 467.1, 29_659)),
    Case("Hello Kitty", ("rubber_duck", "wedge"), "above", Published(7, 69, 56, 406.6, 29_659)),
    Case("Apple", ("apple", "sphere"), "above", Published(1, 43, 2, 183.0, 22_487)),
    Case("Polygons", ("polygons", "box"), "above", Published(5, 96, 21, 1053.1, 100)),
)


def cases_of(bench: Bench) -> list[tuple[Case, str]]:
    """The paper's cases with the object that plays each; where none is at hand, one case an object, from above."""
    found = [
        (case, next(name for name in case.stand_ins if name in bench.objects))
        for case in PAPER_CASES
        if any(name in bench.objects for name in case.stand_ins)
    ]
    return found or [(Case(name, (name,), "above", None), name) for name in bench.objects]


def parallel_grasps_of(bench: Bench, case: Case, object_name: str) -> list[ParallelGrasp]:
    """Antipodal grasps of the object that come from the case's side."""
    model = bench.model(object_name)
    return [grasp for grasp in antipodal_grasps(model, bench.hand, 2 * bench.starts) if case.comes_from(grasp)]
