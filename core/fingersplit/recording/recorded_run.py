"""What a recording tells of one planned grasp, whether it was just planned or comes from a file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from fingersplit.hands.hand import Hand
from fingersplit.planning.plan import PlannedGrasp
from fingersplit.recording.traces_file import StoredRun, load_run
from fingersplit.splitting.trace import Trace
from fingersplit.verification import Simulation, Verification

__all__ = ["RecordedRun"]


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A planned grasp with its history.

    Attributes:
        trace: Every accepted state.
        document: The grasp as it stands in the result document.
        simulation: What the verification's simulation of the grasp went through, None when there was none.
        initial_simulation: The same for the grasp's mapped start.
        initial_report: The report of that verification.
    """

    trace: Trace
    document: dict[str, Any]
    simulation: Simulation | None = None
    initial_simulation: Simulation | None = None
    initial_report: dict[str, Any] | None = None

    @classmethod
    def from_planned(cls, grasp: PlannedGrasp, hand: Hand, initial_verification: Verification | None = None) -> Self:
        """From a grasp that was just planned, and on request the verification of its mapped start."""
        initial = initial_verification or grasp.initial_verification
        return cls(
            trace=grasp.run.trace,
            document=grasp.to_document(hand),
            simulation=None if grasp.verification is None else grasp.verification.simulation,
            initial_simulation=None if initial is None else initial.simulation,
            initial_report=None if initial is None else initial.to_document(),
        )

    @classmethod
    def from_file(cls, traces: Path, rank: int) -> Self:
        """From a file that ``traces_file.save_traces`` wrote.

        Raises:
            KeyError: The plan has no grasp of that rank.
        """
        return cls.from_stored(load_run(traces, rank))

    @classmethod
    def from_stored(cls, stored: StoredRun) -> Self:
        """From what such a file holds."""
        initial = stored.initial_verification
        return cls(
            trace=Trace(**stored.trace),
            document=stored.document,
            simulation=None if stored.verification is None else Simulation(**stored.verification),
            initial_simulation=None if initial is None else Simulation(**initial),
            initial_report=stored.document["initial"]["verification"],
        )

    @property
    def title(self) -> str:
        """One line that names the run's outcome."""
        verdict = "feasible" if self.document["feasible"] else "not feasible"
        return f"rank {self.document['rank']}: {verdict}, {self.document['termination'].replace('_', ' ')}"
