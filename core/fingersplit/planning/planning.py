"""Planning as callers use it: from object and hand to a result that stands on its own."""

from collections import Counter
from collections.abc import Sequence
from functools import cache
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from fingersplit.execution.execution import GraspExecution
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.ranking import RankedGrasp
from fingersplit.planning.run import Run
from fingersplit.planning.search import Search, find_grasps
from fingersplit.planning.surroundings import clearance_of, scene_summary, ways_of, world_poses
from fingersplit.result.grasp import (
    Contact,
    GraspResult,
    GraspTimings,
    InitialGrasp,
    Iterations,
    PalmPose,
    ParallelContacts,
    Pregrasp,
    SplitGrasp,
)
from fingersplit.result.grip import PlannedGrip
from fingersplit.result.plan import (
    SCHEMA_VERSION,
    PlannedObject,
    PlanResult,
    PlanSummary,
    PlanTimings,
    Provenance,
)
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit.scene.constraints import Constraints
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.threads import Progress

__all__ = ["plan"]


def plan(
    model: ObjectModel,
    hand: Hand,
    parallel_grasps: Sequence[ParallelGrasp] | None = None,
    *,
    source: str = "antipodal",
    starts: int = 64,
    seed: int = 0,
    top_k: int = 10,
    settings: PlannerSettings | None = None,
    friction: float | None = None,
    constraints: Constraints | None = None,
    ranking: RankingOrder | None = None,
    refine: bool = False,
    threads: int = 1,
    progress: Progress | None = None,
) -> PlanResult:
    """Plan grasps of an object: the same arguments give the same grasps, bit for bit on the same machine.

    Args:
        model: The object, from ``load_object`` or ``prepare_object``.
        hand: The hand, from ``load_hand``. Where its first grip finds nothing feasible, the others are tried.
        parallel_grasps: Two-contact grasps to start from, each taken with both finger assignments; None to have
            some found.
        source: Where they are found: ``antipodal``, ``surface_fitting`` or ``both``.
        starts: Most runs of the finger splitting; when none of their grasps can carry the object, as many follow, and
            twice as many when none of these can. With time for simulations they follow, too, when none of those that
            can is likely to hold.
        seed: Seed of every random choice.
        top_k: Most grasps to return.
        settings: Parameters of the splitting; None for the defaults.
        friction: Coulomb friction between pads and object to plan for; None for what is known of the object, else the
            default, see ``contacts.friction``.
        constraints: Scene, approach, contact regions, task and end effector; None for nothing but a free approach.
        ranking: By what grasps are ranked, and for how long they may be simulated for that; None for the estimated
            probability of holding. With time for simulations the order depends on how fast the machine is.
        refine: Whether the best grasps are improved by small moves of contacts and palm that raise the estimated
            probability of holding; each then also has the splitting's grasp beside it.
        threads: Threads that search, screen, split, judge and simulate; the answer does not depend on it, unless
            grasps are simulated for their ranking.
        progress: Called with a stage name and the share of that stage that is done, 0..1.

    Returns:
        Ranked grasps: feasible ones first that carry the object's weight, by the probability of holding. When none is
        feasible, the best infeasible ones with what they violate, and a message that says why.

    Raises:
        SettingsError: ``starts``, ``top_k`` or ``threads`` below 1, a negative seed, an unknown source, or a friction
            out of range.
        ParallelGraspError: A given contact lies off the surface.
    """
    found = find_grasps(
        model,
        hand,
        parallel_grasps,
        source=source,
        starts=starts,
        seed=seed,
        top_k=top_k,
        settings=settings,
        friction=friction,
        constraints=constraints,
        ranking=ranking,
        refine=refine,
        threads=threads,
        progress=progress,
    )
    stages = {stage: 1e3 * seconds for stage, seconds in found.seconds.items()}
    return PlanResult(
        schema_version=SCHEMA_VERSION,
        hand=hand.name,
        object=_object(model),
        seed=seed,
        starts=starts,
        friction=found.friction,
        provenance=Provenance(
            software_version=_software_version(),
            hand_sha256=hand.sha256,
            planner=found.settings.to_document(),
            constraints=found.constraints.to_document(),
            parallel_grasps=source if parallel_grasps is None else "given",
            top_k=top_k,
            ranking=(ranking or RankingOrder()).to_document() | {"refine": refine},
        ),
        summary=_summary(found),
        timings_ms=PlanTimings(**stages, total=sum(stages.values())),
        grasps=tuple(_grasp(grasp, found) for grasp in found.grasps),
        scene=scene_summary(found),
    )


@cache
def _software_version() -> str:
    return version("fingersplit")


def _object(model: ObjectModel) -> PlannedObject:
    return PlannedObject(
        id=model.id,
        name=model.name,
        source=model.source,
        options=model.options,
        report=model.report,
        extents=_vector(model.mesh.extents),
        volume=model.mass_properties.volume,
        mass=model.mass,
        mass_basis=model.mass_properties.basis,
        center_of_mass=_vector(model.center_of_mass),
        inertia=(_vector(model.inertia[0]), _vector(model.inertia[1]), _vector(model.inertia[2])),
        samples=len(model.surface.normals),
        sample_spacing=model.surface.spacing,
        seen=model.seen,
        assumed=model.assumed,
        remarks=model.remarks,
    )


def _summary(found: Search) -> PlanSummary:
    ends = Counter(run.termination for run in found.runs)
    return PlanSummary(
        started=len(found.runs),
        feasible=found.feasible,
        terminations={end.label: ends[end] for end in sorted(ends)},
        message=found.message,
    )


def _grasp(ranked: RankedGrasp, found: Search) -> GraspResult:
    run, execution, hand = ranked.run, ranked.execution, found.hand
    way_in, way_out = ways_of(execution, found.scene)
    return GraspResult(
        rank=ranked.rank,
        feasible=run.feasible,
        geometry_valid=run.feasible,
        carries_weight=ranked.carries_weight,
        violations=run.violations,
        reason=ranked.reason,
        palm=PalmPose.from_matrix(run.final.object_from_palm),
        joints=hand.named(run.final.joints),
        contacts=_contacts(run.final, hand, found.model, ranked.holding.forces),
        pregrasp=_pregrasp(execution, hand),
        squeeze_joints=hand.named(execution.grip.targets),
        grip=PlannedGrip.from_plan(execution.grip, hand),
        metrics=ranked.metrics,
        p_hold=ranked.p_hold,
        split_grasp=None if run.refined_from is None else _split_grasp(run.refined_from, found.model),
        self_clearance=run.self_clearance,
        termination=run.termination,
        advice=run.termination.advice,
        iterations=Iterations(outer=int(run.outcome.rounds), cpo=int(run.outcome.cpo), ppo=int(run.outcome.ppo)),
        timings_ms=GraspTimings(*(1e3 * seconds for seconds in run.seconds)),
        initial=_initial(run, hand, found.model),
        world=world_poses(run, execution, found.scene),
        approach_path=way_in,
        retreat_path=way_out,
        clearance=clearance_of(run, found.scene),
    )


def _initial(run: Run, hand: Hand, model: ObjectModel) -> InitialGrasp:
    first, second = run.parallel_grasp.contacts
    return InitialGrasp(
        parallel_grasp=ParallelContacts((_vector(first), _vector(second)), _vector(run.parallel_grasp.approach)),
        palm=PalmPose.from_matrix(run.initial.object_from_palm),
        joints=hand.named(run.initial.joints),
        contacts=_contacts(run.initial, hand, model),
        quality=float(run.first.quality),
    )


def _split_grasp(run: Run, model: ObjectModel) -> SplitGrasp:
    return SplitGrasp(
        palm=PalmPose.from_matrix(run.final.object_from_palm),
        joints=run.hand.named(run.final.joints),
        contacts=_contacts(run.final, run.hand, model),
        quality=float(run.last.quality),
    )


def _pregrasp(execution: GraspExecution, hand: Hand) -> Pregrasp | None:
    if execution.pregrasp_pose is None:
        return None
    return Pregrasp(PalmPose.from_matrix(execution.pregrasp_pose), hand.named(execution.pregrasp_joints))


def _contacts(
    grasp: Grasp, hand: Hand, model: ObjectModel, forces: NDArray[np.float64] | None = None
) -> tuple[Contact, ...]:
    assumed = model.is_assumed(grasp.contacts).tolist()
    return tuple(
        Contact(
            finger=finger.name,
            position=_vector(grasp.contacts[f]),
            normal=_vector(grasp.normals[f]),
            fingertip=_vector(grasp.fingertips[f]),
            residual=float(grasp.residuals[f]),
            pad_angle=float(grasp.pad_angles[f]),
            force=None if forces is None else _vector(forces[f]),
            assumed=assumed[f],
        )
        for f, finger in enumerate(hand.fingers)
    )


def _vector(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
