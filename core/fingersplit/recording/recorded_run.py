"""What a recording tells of one planned grasp, whether it was just planned or comes from a file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np

from fingersplit.hands.hand import Hand
from fingersplit.plan import PlannedGrasp
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
        """From a file that ``Plan.save_traces`` wrote.

        Raises:
            KeyError: The plan has no grasp of that rank.
        """
        with np.load(traces, allow_pickle=False) as stored:
            document = json.loads(str(stored[f"{rank}/document"]))
            return cls(
                trace=Trace(**{column.name: stored[f"{rank}/{column.name}"] for column in fields(Trace)}),
                document=document,
                simulation=_simulation(stored, f"{rank}/verification/"),
                initial_simulation=_simulation(stored, f"{rank}/initial_verification/"),
                initial_report=document["initial"]["verification"],
            )

    @property
    def title(self) -> str:
        """One line that names the run's outcome."""
        verdict = "feasible" if self.document["feasible"] else "not feasible"
        return f"rank {self.document['rank']}: {verdict}, {self.document['termination'].replace('_', ' ')}"


def _simulation(stored: Mapping[str, Any], prefix: str) -> Simulation | None:
    """The stored simulation; None when there is none."""
    columns = {name.removeprefix(prefix): stored[name] for name in stored if name.startswith(prefix)}
    return Simulation(**columns | {"phase_names": tuple(columns["phase_names"].tolist())}) if columns else None
