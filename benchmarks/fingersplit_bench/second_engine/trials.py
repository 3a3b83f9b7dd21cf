"""The grasps that both engines execute: half as planned, half spoilt in ways that are drawn before either has run."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.planning import plan
from fingersplit.result import PlanResult
from fingersplit.verification.closing import with_opening
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.published import Execution
from fingersplit.verification.scene import Scene
from fingersplit.verification.simulation import keep_clear
from fingersplit_bench.suite import Bench

__all__ = ["SPOILT", "TrialGrasp", "trial_grasps"]

SEED = 11
PAIRS = 22
"""A planned grasp and a spoilt one make a pair; so many pairs a repeat, spread over the objects. Five repeats are 200
grasps and some that are left out."""
SPOILT = ("displaced", "slippery", "heavy", "low-ranked")
DISPLACED = 8e-3, 20e-3
"""How far the palm of a displaced grasp is from its place, at least and at most [m]."""
SLIPPERY = 0.25
"""Share of the planned friction in a slippery world."""
HEAVY = 6.0
"""Mass of a heavy object over the planned one."""


@dataclass(frozen=True, eq=False)
class TrialGrasp:
    """A grasp to execute.

    Attributes:
        object_name: The object.
        kind: ``"planned"`` or one of ``SPOILT``.
        rank: Rank of the grasp in its plan.
        grasp: The grasp.
        execution: What is published, and the joints that both engines begin with.
        mass: Of the object [kg].
        friction: In the world.
    """

    object_name: str
    kind: str
    rank: int
    grasp: Grasp
    execution: Execution
    mass: float
    friction: float


def trial_grasps(
    bench: Bench, name: str, model: ObjectModel, pieces: ConvexPieces, protocol: Protocol
) -> Iterator[TrialGrasp]:
    """The grasps of one object, of ``2 * PAIRS * bench.repeats`` over all.

    Left out are those whose hand lies deeper inside the object than the protocol simulates.
    """
    names = list(bench.objects)
    rng = np.random.default_rng([SEED, names.index(name)])
    result = plan(model, bench.hand, starts=bench.starts, seed=SEED, top_k=bench.starts, threads=2)
    if not result.grasps:
        return
    scene = Scene.build(bench.hand, pieces)
    for pair in range(names.index(name), PAIRS * bench.repeats, len(names)):
        turn = pair // len(names)
        for kind in ("planned", SPOILT[(pair + turn) % len(SPOILT)]):
            trial = _trial(result, bench.hand, name, kind, turn, rng)
            scene.place(trial.grasp)
            if scene.penetrations().max() <= protocol.largest_initial_penetration:
                yield replace(trial, execution=_clear(scene, trial))


def _trial(result: PlanResult, hand: Hand, name: str, kind: str, turn: int, rng: np.random.Generator) -> TrialGrasp:
    """The grasp of that turn, spoilt as its kind says."""
    place = turn % len(result.grasps)
    one = result.grasps[-1 - place if kind == "low-ranked" else place]
    trial = TrialGrasp(
        object_name=name,
        kind=kind,
        rank=one.rank,
        grasp=one.for_hand(hand),
        execution=Execution.of_result(one, hand),
        mass=result.object.mass * (HEAVY if kind == "heavy" else 1.0),
        friction=result.friction * (SLIPPERY if kind == "slippery" else 1.0),
    )
    if kind != "displaced":
        return trial
    direction = rng.normal(size=3)
    displacement = rng.uniform(*DISPLACED) * direction / np.linalg.norm(direction)
    pose = trial.grasp.object_from_palm.copy()
    pose[:3, 3] += displacement
    moved = replace(trial.grasp, object_from_palm=pose, fingertips=trial.grasp.fingertips + displacement)
    return replace(trial, grasp=moved)


def _clear(scene: Scene, trial: TrialGrasp) -> Execution:
    """What is published, with joints to begin with that are clear of the object; the scene is in the grasp."""
    execution = with_opening(trial.execution, scene, trial.grasp)
    assert execution.opened is not None
    scene.set_joints(execution.opened)
    keep_clear(scene, trial.grasp.normals)
    return replace(execution, opened=scene.data.qpos[scene.joint_qpos].copy())
