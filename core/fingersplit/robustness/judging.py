"""`p_hold` of ranked grasps: estimated for all of them at once, simulated for the best in the time that is allowed."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from threading import Lock
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.result.grasp import HoldProbability
from fingersplit.robustness.execution import Execution
from fingersplit.robustness.executions import Executor
from fingersplit.robustness.features import Candidate, closing_features, estimate_features
from fingersplit.robustness.noise import NoiseModel
from fingersplit.robustness.probability_model import load_models

__all__ = [
    "CLOSING_OFFSET",
    "MAX_SIMULATED",
    "estimate_holding",
    "hold_probability",
    "simulate_closings",
    "simulate_holding",
]

MAX_SIMULATED = 12
"""Best estimated grasps that are simulated."""
CLOSING_OFFSET = 7.5e-3
"""Both ways along each of the palm's axes the object is displaced so far in simulated closings [m]."""
MAX_EXECUTIONS = 24
"""Of one grasp."""
CONTENDERS = 4
"""Grasps among which the next execution goes to the one that was executed least."""
ROBUST, FUTILE = 0.85, 0.4
"""Probabilities from which on a grasp is robust, and below which it is futile."""
SEED = 1


def estimate_holding(
    hand: Hand,
    model: ObjectModel,
    candidates: Sequence[Candidate],
    friction: float,
    noise: NoiseModel,
    threads: int = 1,
) -> NDArray[np.float64]:
    """Estimated probabilities of holding, (n,)."""
    if not candidates:
        return np.zeros(0)
    return load_models(hand).estimate(estimate_features(hand, model, candidates, friction, noise, threads))


@dataclass
class _Simulated:
    """What is known of a candidate: executions begun and held, and the probability that the closings give."""

    prior: float
    begun: int = 0
    ended: int = 0
    held: int = 0

    def value(self, strength: float) -> float:
        """Mean of the Beta distribution that closings and executions leave."""
        return (strength * self.prior + self.held) / (strength + self.ended)


@dataclass
class _Schedule:
    """Which candidate is executed next; shared by threads."""

    strength: float
    known: dict[int, _Simulated] = field(default_factory=dict)
    lock: Lock = field(default_factory=Lock)

    def next_execution(self) -> tuple[int, int] | None:
        """A candidate and the number of the draw; None when all contenders have been executed enough."""
        with self.lock:
            best = sorted(self.known, key=lambda i: -self.known[i].value(self.strength))[:CONTENDERS]
            open_ones = [i for i in best if self.known[i].begun < MAX_EXECUTIONS]
            if not open_ones:
                return None
            chosen = min(open_ones, key=lambda i: self.known[i].begun)
            self.known[chosen].begun += 1
            return chosen, self.known[chosen].begun - 1

    def note(self, candidate: int, held: bool) -> None:
        """What an execution showed."""
        with self.lock:
            self.known[candidate].ended += 1
            self.known[candidate].held += held


def simulate_holding(
    hand: Hand,
    model: ObjectModel,
    pieces: ConvexPieces,
    candidates: Sequence[tuple[Candidate, Execution]],
    friction: float,
    noise: NoiseModel,
    budget: float,
    threads: int = 1,
) -> dict[int, float]:
    """Probabilities of holding from simulations, by the candidates' places.

    Each candidate is closed upon displaced objects first; the time that is left goes to executions, lift included, of
    those that may be best. Within the budget results depend on how fast the machine is.

    Args:
        hand: The hand.
        model: The object.
        pieces: The same object as the simulation collides it.
        candidates: Grasps and how they are executed, the most promising first; at most ``MAX_SIMULATED`` count.
        friction: Sliding friction that was planned for.
        noise: What is not known exactly.
        budget: Time that the simulations may take [s]; one that was begun is finished.
        threads: Simulations at a time.

    Returns:
        Those that there was time for.
    """
    models, end = load_models(hand), perf_counter() + budget
    schedule, waiting = _Schedule(models.prior_strength), iter(range(min(len(candidates), MAX_SIMULATED)))
    draws = noise.draw(MAX_EXECUTIONS, SEED)

    def work() -> None:
        executor = Executor(hand, model, pieces, friction, model.mass)
        while perf_counter() < end:
            with schedule.lock:
                chosen = next(waiting, None)
            if chosen is None:
                break
            candidate, execution = candidates[chosen]
            row = simulate_closings(executor, candidate, execution, model.mass, noise)
            prior = _Simulated(float(models.closings(row[None])[0]))
            with schedule.lock:
                schedule.known[chosen] = prior
        while perf_counter() < end and (turn := schedule.next_execution()) is not None:
            executor.place(candidates[turn[0]][1])
            schedule.note(turn[0], executor.holds(draws, turn[1]))

    with ThreadPoolExecutor(threads) as pool:
        for other in [pool.submit(work) for _ in range(threads)]:
            other.result()
    return {i: one.value(models.prior_strength) for i, one in schedule.known.items()}


def simulate_closings(
    executor: Executor, candidate: Candidate, execution: Execution, mass: float, noise: NoiseModel
) -> NDArray[np.float64]:
    """``CLOSING_FEATURES`` of a grasp from six closings."""
    executor.place(execution)
    axes = candidate.grasp.object_from_palm[:3, :3].T
    closings = [executor.close(sign * CLOSING_OFFSET * axis, np.zeros(3)) for axis in axes for sign in (1.0, -1.0)]
    forces, moved, turned = zip(*((one.forces, one.moved, one.turned) for one in closings), strict=True)
    return closing_features(np.array(forces), np.array(moved), np.array(turned), candidate.holding, mass, noise)


def hold_probability(value: float, noise: NoiseModel, *, simulated: bool) -> HoldProbability:
    """A probability as it stands in results."""
    return HoldProbability(
        value=value,
        tier="simulated" if simulated else "estimated",
        robustness="robust" if value >= ROBUST else "futile" if value < FUTILE else "fragile",
        position_noise=noise.position,
        rotation_noise=noise.rotation,
    )
