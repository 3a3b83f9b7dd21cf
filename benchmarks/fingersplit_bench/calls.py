"""How the benchmarks call the planner: the one place that knows its arguments."""

from collections.abc import Sequence

import numpy as np

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.parallel_grasps.sources import find_parallel_grasps
from fingersplit.planning.run import Run
from fingersplit.planning.search import Search, find_grasps
from fingersplit.splitting.settings import PlannerSettings

__all__ = ["FIDELITIES", "SEED", "antipodal_grasps", "paired_runs", "plan_once", "settings_of", "warm_up"]

FIDELITIES = ("paper", "default")
SEED = 1


def settings_of(fidelity: str) -> PlannerSettings:
    """Settings of a fidelity: ``"paper"`` as printed, ``"default"`` with our own step control."""
    return PlannerSettings.of(fidelity)


def plan_once(
    model: ObjectModel,
    hand: Hand,
    grasps: Sequence[ParallelGrasp] | None = None,
    *,
    fidelity: str = "default",
    starts: int = 64,
    threads: int = 1,
) -> Search:
    """One plan, on one thread unless more are asked for."""
    return find_grasps(model, hand, grasps, starts=starts, seed=SEED, settings=settings_of(fidelity), threads=threads)


def paired_runs(*plans: Search) -> list[tuple[Run, ...]]:
    """Runs of several plans that began in the same mapped state, one tuple a start."""
    runs = [{_start_of(run): run for run in each.runs} for each in plans]
    return [tuple(each[start] for each in runs) for start in runs[0] if all(start in each for each in runs)]


def _start_of(run: Run) -> bytes:
    return run.initial.object_from_palm.tobytes() + run.initial.joints.tobytes()


def warm_up(model: ObjectModel, hand: Hand) -> None:
    """Compile or load every kernel that a measurement is going to run."""
    for fidelity in FIDELITIES:
        plan_once(model, hand, fidelity=fidelity, starts=2)


def antipodal_grasps(model: ObjectModel, hand: Hand, starts: int) -> ParallelGrasps:
    """Parallel grasps as ``plan`` finds them for so many starts."""
    return find_parallel_grasps(
        model,
        starts,
        source="antipodal",
        friction=DEFAULT_FRICTION,
        opening=hand.gripper.opening,
        rng=np.random.default_rng(SEED),
    )
