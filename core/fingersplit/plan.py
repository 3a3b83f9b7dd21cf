"""The answer to a planning request: ranked grasps, and the document that states them."""

from collections import Counter
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.quality.assessment import Metrics
from fingersplit.splitting.starts import Run

__all__ = ["Plan", "PlannedGrasp"]

_TIMED_STAGES = (
    "cpo_tangent_search",
    "cpo_projection_and_test",
    "cpo_collision",
    "ppo_tangent_search",
    "ppo_projection_and_test",
    "ppo_collision",
    "total",
)


@dataclass(frozen=True, eq=False)
class PlannedGrasp:
    """One ranked grasp.

    Attributes:
        rank: Place in the answer, 1 is best.
        run: The finger splitting that found it, with its trace.
        metrics: Numbers that compare it with others.
        forces: Force of each finger on the object that carries its weight, (F, 3) [N], None when none can.
    """

    rank: int
    run: Run
    metrics: Metrics
    forces: NDArray[np.float64] | None

    def to_document(self, hand: Hand) -> dict[str, Any]:
        """This grasp as it stands in a result document."""
        run = self.run
        return {
            "rank": self.rank,
            "feasible": run.feasible,
            "violations": list(run.violations),
            **run.final.to_document(hand, self.forces),
            "metrics": self.metrics.to_document(),
            "termination": run.termination.label,
            "advice": run.termination.advice,
            "iterations": {"outer": run.rounds, "cpo": run.cpo, "ppo": run.ppo},
            "timings_ms": {stage: 1e3 * seconds for stage, seconds in zip(_TIMED_STAGES, run.seconds, strict=True)},
            "initial": {
                "parallel_grasp": run.start.parallel_grasp.to_document(),
                **run.initial.to_document(hand),
                "quality": float(run.trace.scores[0, 0]),
            },
            "verification": None,
        }


@dataclass(frozen=True, eq=False)
class Plan:
    """Ranked grasps of one object for one hand.

    Attributes:
        hand: The hand.
        model: The object.
        seed: Seed of every random choice.
        starts: Starts that were asked for.
        runs: Every finished run, in the order of the starts.
        grasps: The best of them, best first.
        message: One sentence on how it went.
        seconds: Time by stage [s]: parallel grasps, mapping, splitting, ranking.
    """

    hand: Hand
    model: ObjectModel
    seed: int
    starts: int
    runs: tuple[Run, ...]
    grasps: tuple[PlannedGrasp, ...]
    message: str
    seconds: dict[str, float]

    @property
    def feasible(self) -> int:
        """Number of runs that ended in a feasible grasp."""
        return sum(run.feasible for run in self.runs)

    def save_traces(self, path: Path) -> None:
        """Write what a picture of any ranked grasp needs, as an .npz file of arrays named ``<rank>/<column>``."""
        arrays: dict[str, NDArray[Any]] = {}
        for grasp in self.grasps:
            for column in fields(grasp.run.trace):
                arrays[f"{grasp.rank}/{column.name}"] = getattr(grasp.run.trace, column.name)
            end, verdict = (
                grasp.run.termination.label.replace("_", " "),
                "feasible" if grasp.run.feasible else "not feasible",
            )
            arrays[f"{grasp.rank}/title"] = np.array(
                f"{self.model.name}, {self.hand.name} hand, rank {grasp.rank}: {verdict}, {end}"
            )
        np.savez(path, hand=np.array(self.hand.name), allow_pickle=False, **arrays)

    def to_document(self) -> dict[str, Any]:
        """The result document: plain JSON data, SI units, object frame, quaternions wxyz.

        The same document is the service's answer, the client's ``PlanResult`` and the command line's JSON.
        """
        ends = Counter(run.termination for run in self.runs)
        timings = {stage: 1e3 * seconds for stage, seconds in self.seconds.items()}
        return {
            "hand": self.hand.name,
            "object": self.model.to_document(),
            "seed": self.seed,
            "starts": self.starts,
            "summary": {
                "started": len(self.runs),
                "feasible": self.feasible,
                "terminations": {end.label: ends[end] for end in sorted(ends)},
                "message": self.message,
            },
            "timings_ms": {**timings, "total": sum(timings.values())},
            "grasps": [grasp.to_document(self.hand) for grasp in self.grasps],
        }
