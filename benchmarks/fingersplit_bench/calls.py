"""How the benchmarks call the planner: the one place that knows its arguments."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.antipodal import sample_antipodal
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.plan import Plan
from fingersplit.planning import APPROACHES, plan
from fingersplit.splitting.settings import PlannerSettings

__all__ = ["FIDELITIES", "SEED", "antipodal_grasps", "plan_on_threads", "plan_once", "settings_of", "warm_up"]

FIDELITIES = ("paper", "default")
SEED = 1


def settings_of(fidelity: str) -> PlannerSettings:
    """Settings of a fidelity: ``"paper"`` as printed, ``"default"`` with the whole tracking step at once."""
    return PlannerSettings() if fidelity == "paper" else PlannerSettings(cpo_gain=20.0, ppo_gain=20.0)


def plan_once(
    model: ObjectModel,
    hand: Hand,
    grasps: list[ParallelGrasp] | None = None,
    *,
    fidelity: str = "default",
    starts: int = 64,
    seed: int = SEED,
) -> Plan:
    """One plan on one thread."""
    return plan(model, hand, grasps, starts=starts, seed=seed, settings=settings_of(fidelity))


def plan_on_threads(model: ObjectModel, hand: Hand, *, starts: int, threads: int) -> int:
    """Plan ``starts`` starts on several threads, default fidelity, and return the number of runs."""
    with ThreadPoolExecutor(threads) as pool:
        plans = pool.map(lambda seed: plan_once(model, hand, starts=starts // threads, seed=seed), range(threads))
        return sum(len(each.runs) for each in plans)


def warm_up(model: ObjectModel, hand: Hand) -> None:
    """Compile or load every kernel that a measurement is going to run."""
    for fidelity in FIDELITIES:
        plan_once(model, hand, fidelity=fidelity, starts=2)


def antipodal_grasps(model: ObjectModel, hand: Hand, pairs: int) -> list[ParallelGrasp]:
    """Parallel grasps as ``plan`` finds them, from ``pairs`` pairs of contacts."""
    return sample_antipodal(
        model,
        pairs,
        friction=PlannerSettings().friction,
        opening=hand.gripper.opening,
        approaches=APPROACHES,
        rng=np.random.default_rng(SEED),
    )
