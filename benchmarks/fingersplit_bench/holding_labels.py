"""What `p_hold` is held to: grasps of every object, executed under noise many times, and what was known before."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.ranking import RankedGrasp
from fingersplit.planning.search import find_grasps
from fingersplit.robustness.execution import Execution
from fingersplit.robustness.executions import Executor
from fingersplit.robustness.features import Candidate, estimate_features
from fingersplit.robustness.judging import simulate_closings
from fingersplit.robustness.noise import NoiseModel
from fingersplit_bench.objects import measured_masses
from fingersplit_bench.suite import Bench

__all__ = ["LEVELS", "Labels", "collect_labels", "executed", "judged"]

LEVELS = {
    "5 mm and 5 deg in all": NoiseModel(),
    "5 mm and 5 deg on each axis": NoiseModel.per_axis(5e-3, np.radians(5.0)),
}
"""Noise at which grasps are executed."""
SEED, TOP_K = 11, 12


class Labels(NamedTuple):
    """Grasps of all objects, n in all, executed E times at each of the L levels.

    Attributes:
        names: Object of each grasp, (n,).
        ranks: Its rank, (n,).
        held: Whether it held in each execution, (n, L, E).
        estimate: ``ESTIMATE_FEATURES`` at each level, (n, L, features).
        closings: ``CLOSING_FEATURES`` at each level, (n, L, features).
    """

    names: NDArray[np.str_]
    ranks: NDArray[np.int64]
    held: NDArray[np.bool_]
    estimate: NDArray[np.float64]
    closings: NDArray[np.float64]

    @property
    def shares(self) -> NDArray[np.float64]:
        """Share of the executions in which each grasp held at each level, (n, L)."""
        return np.asarray(self.held.mean(axis=2))


def collect_labels(bench: Bench, executions: int) -> Labels:
    """Execute the best ranked grasps of every object of the bench and of our own ones.

    An object's grasps are kept in the report's folder ``holding_labels`` and taken from there the next time; delete it
    when planning or simulation have changed.
    """
    folder = bench.folder / "holding_labels"
    folder.mkdir(exist_ok=True)
    loaders = dict(bench.objects) | {f"own {name}": load for name, load in PARAMETRIC_OBJECTS.items()}
    masses, parts = measured_masses(), []
    for name, load in loaders.items():
        file = folder / f"{name.replace(' ', '_')}-{SEED}-{executions}.npz"
        if not file.exists():
            bench.note(f"executing grasps of {name} under noise")
            _write(file, prepare_object(load(), name, ObjectOptions(mass=masses.get(name))), bench, executions)
        with np.load(file) as arrays:
            parts.append((np.full(len(arrays["ranks"]), name), *(arrays[key] for key in Labels._fields[1:])))
    return Labels(*(np.concatenate(column) for column in zip(*(part for part in parts if len(part[0])), strict=True)))


def judged(one: RankedGrasp) -> Candidate:
    """A ranked grasp as it is judged."""
    return Candidate(one.run.final, one.execution.pregrasp_joints, one.holding)


def executed(one: RankedGrasp) -> Execution:
    """How a ranked grasp is executed."""
    grasp, grip = one.run.final, one.execution.grip
    parts = one.execution.pregrasp_joints, grasp.joints, grip.targets, grip.stiffness, grip.damping
    return Execution(grasp.object_from_palm, *parts)


def _write(file: Path, model: ObjectModel, bench: Bench, executions: int) -> None:
    """Execute the grasps of one object and keep what came of it."""
    found = find_grasps(model, bench.hand, starts=bench.starts, seed=SEED, top_k=TOP_K)
    ranked = [one for one in found.grasps if one.run.feasible]
    levels = list(LEVELS.values())
    held = np.zeros((len(ranked), len(levels), executions), np.bool_)
    estimate, closings = [], []
    if ranked:
        executor = Executor(bench.hand, model, decompose(model.mesh), found.friction, model.mass)
        per_level = [
            estimate_features(bench.hand, model, [judged(one) for one in ranked], found.friction, noise)
            for noise in levels
        ]
        estimate = list(np.stack(per_level, axis=1))
    for row, one in enumerate(ranked):
        closings.append([simulate_closings(executor, judged(one), executed(one), model.mass, lv) for lv in levels])
        executor.place(executed(one))
        for number, noise in enumerate(levels):
            draws = noise.draw(executions, 1000 + one.rank)
            held[row, number] = [executor.holds(draws, which) for which in range(executions)]
    np.savez(
        file,
        ranks=np.array([one.rank for one in ranked], np.int64),
        held=held,
        estimate=np.array(estimate),
        closings=np.array(closings),
    )
