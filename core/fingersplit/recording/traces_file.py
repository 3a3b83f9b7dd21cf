"""The file that pictures and recordings of a plan are made of: what every ranked grasp went through.

A job waits until it is written, so it holds few arrays: one table, a structured array, for each history. The service
reads it for the curves of its pages; this module loads nothing of the planner.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from fingersplit.planning.plan import Plan, PlannedGrasp

__all__ = ["StoredRun", "load_run", "save_traces"]


@dataclass(frozen=True, eq=False)
class StoredRun:
    """One ranked grasp as it is in the file.

    Attributes:
        hand: Name of its hand.
        title: One line that names object, hand, rank and outcome.
        document: The grasp as it stands in the result document.
        phase_names: What the trace's phases are called, in the order of their numbers.
        trace: The columns of its ``splitting.trace.Trace``.
        verification: The columns of its ``verification.Simulation``, None when it was not simulated.
        initial_verification: The same for its mapped start.
    """

    hand: str
    title: str
    document: dict[str, Any]
    phase_names: tuple[str, ...]
    trace: dict[str, NDArray[Any]]
    verification: dict[str, Any] | None
    initial_verification: dict[str, Any] | None


def save_traces(plan: "Plan", result: str, path: Path) -> None:
    """Write what pictures and recordings of a plan's ranked grasps need, an .npz file.

    Args:
        plan: The plan.
        result: Its result document as JSON, as it is answered.
        path: The file to write.
    """
    from fingersplit.splitting.trace import PHASE_NAMES  # where a plan is, it is loaded

    tables, grasps = dict[str, NDArray[Any]](), {}
    for grasp in plan.grasps:
        tables[f"{grasp.rank}/trace"] = _table(_columns(grasp.run.trace))
        simulations = {}
        for name in ("verification", "initial_verification"):
            report = getattr(grasp, name)
            if report is not None and report.simulation is not None:
                columns = _columns(report.simulation)
                simulations[name] = columns.pop("phase_names")
                tables[f"{grasp.rank}/{name}"] = _table(columns)
        grasps[grasp.rank] = {
            "title": f"{plan.model.name}, {plan.hand.name} hand, rank {grasp.rank}: {_outcome(grasp)}",
            "simulations": simulations,
        }
    about = json.dumps({"hand": plan.hand.name, "phase_names": PHASE_NAMES, "grasps": grasps})
    np.savez(path, allow_pickle=False, about=_text(about), result=_text(result), **tables)


def load_run(path: Path, rank: int) -> StoredRun:
    """Read one ranked grasp of a file that ``save_traces`` wrote.

    Raises:
        KeyError: The plan has no grasp of that rank.
    """
    with np.load(path, allow_pickle=False) as stored:
        about = json.loads(stored["about"].tobytes())
        grasp = about["grasps"][str(rank)]
        documents = json.loads(stored["result"].tobytes())["grasps"]
        simulations = {
            name: _read(stored[f"{rank}/{name}"]) | {"phase_names": tuple(phase_names)}
            for name, phase_names in grasp["simulations"].items()
        }
        return StoredRun(
            hand=about["hand"],
            title=grasp["title"],
            document=next(document for document in documents if document["rank"] == rank),
            phase_names=tuple(about["phase_names"]),
            trace=_read(stored[f"{rank}/trace"]),
            verification=simulations.get("verification"),
            initial_verification=simulations.get("initial_verification"),
        )


def _outcome(grasp: "PlannedGrasp") -> str:
    verdict = "feasible" if grasp.run.feasible else "not feasible"
    return f"{verdict}, {grasp.run.termination.label.replace('_', ' ')}"


def _text(text: str) -> NDArray[np.uint8]:
    return np.frombuffer(text.encode(), dtype=np.uint8)


def _columns(history: Any) -> dict[str, Any]:
    return {column.name: getattr(history, column.name) for column in fields(history)}


def _table(columns: dict[str, NDArray[Any]]) -> NDArray[Any]:
    """Arrays of equal length as one structured array."""
    rows = len(next(iter(columns.values())))
    table = np.empty(rows, [(name, column.dtype, column.shape[1:]) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    return table


def _read(table: NDArray[Any]) -> dict[str, NDArray[Any]]:
    names: Iterable[str] = table.dtype.names or ()
    return {name: np.ascontiguousarray(table[name]) for name in names}
