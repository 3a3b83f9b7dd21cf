"""Why a request leaves no grasp: what every obstacle rejected, and which constraint stands in the way."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fingersplit.feasibility.violations_kernel import NEAR_OBSTACLE, NO_APPROACH, NO_RETREAT
from fingersplit.hands.shapes_kernel import shape_distance
from fingersplit.planning.run import Run
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.contact_regions import ContactRegions
from fingersplit.scene.obstacles import HALF_SPACE, new_slacks
from fingersplit.scene.obstacles_kernel import measure_slacks
from fingersplit.scene.preparing import PreparedScene
from fingersplit.scene.ways import NOT_ALLOWED

__all__ = ["Relaxation", "count_obstacles", "find_relaxations"]

MAX_OBSTACLES = 3
"""Obstacles that are tried to be left out, those that rejected most first."""
DEEPEST = 1.0
"""[m]; an overlap is measured up to here."""


@dataclass(frozen=True)
class Relaxation:
    """One constraint that, were it relaxed, would leave grasps.

    Attributes:
        constraint: The entry of the request, such as ``approach.directions``.
        amount: By how much at least, None where that is no matter of degree.
        unit: Of the amount.
        feasible: Feasible grasps that were found without it.
        sentence: The same for people.
    """

    constraint: str
    amount: float | None
    unit: str
    feasible: int
    sentence: str


def count_obstacles(runs: Sequence[Run], scene: PreparedScene) -> dict[str, int]:
    """How many grasps each obstacle or support rejected, at the grasp or on the way in or out; most first."""
    counts: Counter[str] = Counter()
    for run in runs:
        number = _blocker(run)
        if number >= 0:
            counts[scene.names[number]] += 1
    return dict(counts.most_common())


def _blocker(run: Run) -> int:
    """Number of the obstacle that rejected a grasp; negative when none did."""
    mask, way = int(run.outcome.violations), run.outcome.way
    if mask >> NEAR_OBSTACLE & 1:
        around = run.last.around
        return int(around.obstacles[int(around.slacks.argmin())])
    if mask >> NO_APPROACH & 1:
        return int(way.blocked_by)
    return int(way.retreat_blocked_by) if mask >> NO_RETREAT & 1 else NOT_ALLOWED


def find_relaxations(
    scene: PreparedScene, runs: Sequence[Run], search: Callable[[Constraints], Sequence[Run]]
) -> tuple[Relaxation, ...]:
    """Leave out one constraint at a time and search again; least relaxations first.

    Args:
        scene: The scene in which nothing was feasible.
        runs: What was found in it.
        search: Runs under other constraints.
    """
    found = []
    for name, unit, relaxed, sentence in _relaxed(scene, runs):
        feasible = [run for run in search(relaxed) if run.feasible]
        if feasible:
            # An obstacle may only be in the way, and not too near to any of the grasps.
            amount = min(_excess(name, scene, run) for run in feasible) or None if unit else None
            told = (
                f"Without {name} there would be a grasp." if amount is None else sentence.format(_shown(amount, unit))
            )
            found.append(Relaxation(name, amount, unit, len(feasible), told))
    return tuple(sorted(found, key=lambda relaxation: (relaxation.amount is None, relaxation.amount or 0.0)))


def _relaxed(scene: PreparedScene, runs: Sequence[Run]) -> Iterator[tuple[str, str, Constraints, str]]:
    """Entry, unit of its relaxation, the constraints without it, and a sentence."""
    given = scene.constraints
    world, approach, arm = given.scene, given.approach, given.end_effector
    if approach.directions is not None:
        free = replace(given, approach=replace(approach, directions=None))
        yield "approach.directions", "rad", free, "Cones of approach.directions that are {} wider would leave a grasp."
    if world.workspace is not None:
        free = replace(given, scene=replace(world, workspace=None))
        yield "scene.workspace", "m", free, "A scene.workspace that is {} larger would leave a grasp."
    if arm.reach is not None:
        free = replace(given, end_effector=replace(arm, reach=None))
        yield "end_effector.reach", "m", free, "An end_effector.reach that is {} larger would leave a grasp."
    if not given.contact_regions.unbounded:
        free = replace(given, contact_regions=ContactRegions())
        yield "contact_regions", "", free, ""
    if world.clearance > 0.0 and scene.names:
        free = replace(given, scene=replace(world, clearance=0.0))
        yield "scene.clearance", "m", free, "A scene.clearance that is {} less would leave a grasp."
    blockers = list(count_obstacles(runs, scene)) if runs else _nearest(scene)
    for name in blockers[:MAX_OBSTACLES]:
        obstacles = tuple(obstacle for obstacle in world.obstacles if obstacle.id != name)
        supports = tuple(support for support in world.support_surfaces if support.id != name)
        free = replace(given, scene=replace(world, obstacles=obstacles, support_surfaces=supports))
        told = f"Without {name!r} there would be a grasp; it would have to stand at least {{}} farther away."
        yield f"obstacle {name!r}", "m", free, told  # a lower bound: the way in may need more
    if approach.required:
        free = replace(given, approach=replace(approach, required=False))
        yield "approach.required", "", free, ""


def _nearest(scene: PreparedScene) -> list[str]:
    """Names of primitives by their distance from the object's origin: what may rule out every start."""
    near = []
    for one in () if scene.arrays is None else scene.arrays.primitives:
        x, y, z = (-one.position @ one.rotation).tolist()
        far = z if one.kind == HALF_SPACE else shape_distance(int(one.kind), one["size"], x, y, z)
        near.append((far, scene.names[one.obstacle]))
    return [name for _, name in sorted(near)]


def _excess(name: str, scene: PreparedScene, run: Run) -> float:
    """By how much a grasp breaks a constraint of ``scene``."""
    given, pose = scene.constraints, scene.world_from_object @ run.final.object_from_palm
    if name == "approach.directions":
        axes, cosines = given.approach.cones(scene.world_from_object)
        angles = np.arccos(np.clip(axes @ run.outcome.way.direction, -1.0, 1.0)) - np.arccos(cosines)
        return float(max(angles.min(), 0.0))
    workspace, reach = given.scene.workspace, given.end_effector.reach
    if name == "scene.workspace" and workspace is not None:
        beyond = np.maximum(np.array(workspace.min) - pose[:3, 3], pose[:3, 3] - np.array(workspace.max))
        return float(max(beyond.max(), 0.0))
    if name == "end_effector.reach" and reach is not None:
        away = float(np.linalg.norm(pose[:3, 3] - np.array(reach.center)))
        return max(away - reach.max_radius, reach.min_radius - away, 0.0)
    if scene.arrays is None:
        return 0.0
    found, work = new_slacks()
    least = measure_slacks(scene.arrays, run.problem.hand, run.last, found, work, DEEPEST)
    return max(-float(least), 0.0)


def _shown(amount: float, unit: str) -> str:
    return f"{np.degrees(amount):.0f} degrees" if unit == "rad" else f"{1e3 * amount:.1f} mm"
