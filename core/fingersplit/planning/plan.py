"""The answer to a planning request: ranked grasps, and the document that states them."""

from collections import Counter
from dataclasses import dataclass
from typing import Any

from fingersplit.contacts.assessment import Metrics
from fingersplit.contacts.holding import Holding
from fingersplit.execution.execution import GraspExecution
from fingersplit.grasp import palm_document
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.run import Run
from fingersplit.verification.report import Verification

__all__ = ["Plan", "PlannedGrasp", "Proof"]

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
        holding: How it holds the object, with the forces that do.
        execution: Pre-grasp, approach and squeeze.
        reason: Why it stands at this rank, in a sentence.
        verification: What its simulation showed, None when it was not verified.
        initial_verification: The same for the grasp it began as.
    """

    rank: int
    run: Run
    metrics: Metrics
    holding: Holding
    execution: GraspExecution
    reason: str
    verification: Verification | None = None
    initial_verification: Verification | None = None

    def to_document(self, hand: Hand) -> dict[str, Any]:
        """This grasp as it stands in a result document."""
        run = self.run
        return {
            "rank": self.rank,
            "feasible": run.feasible,
            "violations": list(run.violations),
            "reason": self.reason,
            **run.final.to_document(hand, self.holding.forces),
            **self._execution_document(hand),
            "metrics": self.metrics.to_document(),
            "termination": run.termination.label,
            "advice": run.termination.advice,
            "iterations": {"outer": int(run.outcome.rounds), "cpo": int(run.outcome.cpo), "ppo": int(run.outcome.ppo)},
            "timings_ms": {stage: 1e3 * seconds for stage, seconds in zip(_TIMED_STAGES, run.seconds, strict=True)},
            "initial": {
                "parallel_grasp": run.parallel_grasp.to_document(),
                **run.initial.to_document(hand),
                "quality": float(run.first.quality),
                "verification": _report(self.initial_verification),
            },
            "verification": _report(self.verification),
        }

    def _execution_document(self, hand: Hand) -> dict[str, Any]:
        execution = self.execution
        pregrasp = None
        if execution.pregrasp_pose is not None:
            pregrasp = {
                "palm": palm_document(execution.pregrasp_pose),
                "joints": hand.named(execution.pregrasp_joints),
            }
        return {"pregrasp": pregrasp, "squeeze_joints": hand.named(execution.squeeze_joints)}


def _report(verification: Verification | None) -> dict[str, Any] | None:
    return None if verification is None else verification.to_document()


@dataclass(frozen=True)
class Proof:
    """How the verification of ranked grasps went.

    Attributes:
        protocol: Name of the preset.
        controller: Name of the controller.
        wanted: How many grasps were to hold.
        tried: How many were verified, from rank 1 on.
        held: How many of these held.
        out_of_time: Whether the deadline ended it.
        seconds: Time that it took [s].
    """

    protocol: str
    controller: str
    wanted: int
    tried: int
    held: int
    out_of_time: bool
    seconds: float

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data, with a sentence on the outcome."""
        end = " Time ran out." if self.out_of_time else ""
        return {
            "protocol": self.protocol,
            "controller": self.controller,
            "wanted": self.wanted,
            "tried": self.tried,
            "held": self.held,
            "message": f"{self.held} of {self.tried} tried grasps held {self.protocol}; {self.wanted} wanted.{end}",
            "time_ms": 1e3 * self.seconds,
        }


@dataclass(frozen=True, eq=False)
class Plan:
    """Ranked grasps of one object for one hand.

    Attributes:
        hand: The hand.
        model: The object.
        seed: Seed of every random choice.
        starts: Starts that were asked for.
        friction: Coulomb friction between pads and object that was planned for.
        runs: Every finished run, in the order of the starts.
        grasps: The best of them, best first.
        message: One sentence on how it went.
        seconds: Time by stage [s]: parallel grasps, mapping, splitting, ranking.
        proof: How the verification of the grasps went, None when it was not asked for.
    """

    hand: Hand
    model: ObjectModel
    seed: int
    starts: int
    friction: float
    runs: tuple[Run, ...]
    grasps: tuple[PlannedGrasp, ...]
    message: str
    seconds: dict[str, float]
    proof: Proof | None = None

    @property
    def feasible(self) -> int:
        """Number of runs that ended in a feasible grasp."""
        return sum(run.feasible for run in self.runs)

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
            "friction": self.friction,
            "summary": {
                "started": len(self.runs),
                "feasible": self.feasible,
                "terminations": {end.label: ends[end] for end in sorted(ends)},
                "message": self.message,
                "verification": None if self.proof is None else self.proof.to_document(),
            },
            "timings_ms": {**timings, "total": sum(timings.values())},
            "grasps": [grasp.to_document(self.hand) for grasp in self.grasps],
        }
