"""Grasps improved for holding itself: small moves of contacts and palm that raise the estimated probability of holding.

The splitting ends where its own objective does; here the best grasps go on, by the same kind of tangent steps, towards
what predicts that they hold when executed: flat surroundings, balanced forces, margin, fingers that arrive although the
object is displaced. A move is taken when it keeps every constraint and does not lose margin. The splitting's grasp
stays in the result beside the refined one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.holding import Contacts, Holding, assess_holding
from fingersplit.hands.drivers import driver_jacobians
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.final_checks import check_finally
from fingersplit.planning.outcome import OUTCOME
from fingersplit.planning.refining_kernel import move_grasps
from fingersplit.planning.run import Run
from fingersplit.robustness.features import Candidate
from fingersplit.robustness.judging import estimate_holding
from fingersplit.robustness.noise import NoiseModel
from fingersplit.scene.task import Task
from fingersplit.scene.ways import WAY
from fingersplit.splitting.state import new_states, new_times, new_work

__all__ = ["candidate_of", "holdings_of", "refine_runs"]

ROUNDS, MOVES = 4, 8
"""Rounds of moves of a grasp, and moves that are tried in each."""
STEP, TURN = 3e-3, 0.05
"""Standard deviations of the first moves on each axis [m], [rad]; they shrink by ``SHRINK`` where none helps."""
SHRINK = 0.5
SEED = 5
MIN_GAIN = 1e-3
"""Moves that raise the probability by less are not worth it."""


def refine_runs(runs: Sequence[Run], model: ObjectModel, friction: float, noise: NoiseModel) -> list[Run]:
    """Improve finished feasible runs; one that no move improves stays as it is.

    Args:
        runs: Runs that ended in a feasible grasp.
        model: The object.
        friction: Planned friction.
        noise: What the probability of holding reckons with.
    """
    rng = np.random.default_rng(SEED)
    return [_refine(run, model, friction, noise, rng) for run in runs]


def _refine(run: Run, model: ObjectModel, friction: float, noise: NoiseModel, rng: np.random.Generator) -> Run:
    (holding,) = holdings_of([run], model, friction)
    value = _values([run], [holding], model, friction, noise)[0]
    best, size = run, 1.0
    for _ in range(ROUNDS):
        moved = [other for other in _moves(best, model, size, rng) if other.feasible]
        judged = holdings_of(moved, model, friction)
        kept = [(other, new) for other, new in zip(moved, judged, strict=True) if new.margin >= holding.margin]
        values = _values([other for other, _ in kept], [new for _, new in kept], model, friction, noise)
        if len(values) and values.max() > value + MIN_GAIN:
            chosen = int(values.argmax())
            best, value = kept[chosen][0], values[chosen]
        else:
            size *= SHRINK
    return best if best is run else replace(best, refined_from=run)


def _moves(run: Run, model: ObjectModel, size: float, rng: np.random.Generator) -> list[Run]:
    """Random moves of a grasp, whatever constraints they break."""
    fingers, last = len(run.hand.fingers), run.last
    steps = size * STEP * rng.normal(size=(MOVES, fingers, 3))
    normals = last.normals[:fingers]
    steps -= (steps * normals).sum(axis=2, keepdims=True) * normals
    turns, shifts = size * TURN * rng.normal(size=(MOVES, 3)), size * STEP * rng.normal(size=(MOVES, 3))
    moved, masks, ways = new_states(MOVES), np.zeros(MOVES, np.int64), np.rec.array(np.zeros(MOVES, WAY))
    times = new_times().settle
    move_grasps(
        run.problem, model.patches, last, steps, turns, shifts, moved, masks, ways, new_states(2), new_work(), times
    )
    others = []
    for state, mask, way in zip(moved, masks, ways, strict=True):
        outcomes = np.rec.array(np.zeros(1, OUTCOME))
        outcomes[0] = run.outcome
        outcome = outcomes[0]
        outcome.violations, outcome.way = mask, way
        others.append(replace(run, last=state, outcome=outcome))
    if run.scene is not None:
        check_finally([other for other in others if other.outcome.violations == 0], run.scene, model)
    return others


def _values(
    runs: Sequence[Run], holdings: Sequence[Holding], model: ObjectModel, friction: float, noise: NoiseModel
) -> NDArray[np.float64]:
    if not runs:
        return np.zeros(0)
    candidates = [candidate_of(run, holding) for run, holding in zip(runs, holdings, strict=True)]
    return estimate_holding(runs[0].hand, model, candidates, friction, noise)


def candidate_of(run: Run, holding: Holding) -> Candidate:
    """A feasible run's grasp with the opening of its way in."""
    return Candidate(run.final, run.outcome.way.joints[: len(run.hand.joint_names)], holding)


def holdings_of(runs: Sequence[Run], model: ObjectModel, friction: float, threads: int = 1) -> list[Holding]:
    """How all final grasps hold the object."""
    if not runs:
        return []
    hand = runs[0].hand
    points, normals, jacobians = (
        np.array([run.last[name][: len(hand.fingers)] for run in runs]) for name in ("contacts", "normals", "jacobians")
    )
    contacts = Contacts(points, normals, driver_jacobians(hand.arrays, jacobians), hand.torque_ranges)
    center, loads = model.center_of_mass, _loads(runs[0], model)
    return assess_holding(contacts, model.surface, friction, model.mass, center, threads, loads)


def _loads(run: Run, model: ObjectModel) -> NDArray[np.float64] | None:
    """Loads of a request's task (L, 6), see ``assess_holding``; None for the weight alone, whichever way is down."""
    if run.scene is None or run.scene.constraints.task == Task():
        return None
    constraints = run.scene.constraints
    gravity = np.array(constraints.scene.gravity)
    return constraints.task.loads(model.mass, model.center_of_mass, gravity, run.scene.world_from_object)
