"""Section `generated_scenes`: tables and bins with clutter, what is found in them, and a dense check of all of it."""

from collections import Counter
from dataclasses import asdict, dataclass

import numpy as np

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.search import Search, find_grasps
from fingersplit.scene import Constraints, ContactRegions, Obstacle, Pose, Primitive, Region, Scene, SupportSurface
from fingersplit.scene.stable_pose import stable_poses
from fingersplit.transforms import transform_points
from fingersplit_bench.calls import SEED
from fingersplit_bench.dense_check import POINTS, measure_excess
from fingersplit_bench.suite import Bench, Chapter, table

__all__ = ["ScenesOfObject", "generate", "generated_scenes_chapter"]

MANY_STARTS = 2_080
"""Where so many find nothing, nothing is asked of an ordinary plan."""
GOES_ON = 1 + 3 + 9
"""A search in a scene that finds nothing has tried so many times the starts that were asked for."""
VIOLATED = 0.5e-3
"""[m]"""
MAX_CLUTTER = 6
"""Primitives on the table beside the object, at most."""


@dataclass(frozen=True)
class ScenesOfObject:
    """Figures of one object.

    Attributes:
        name: Of the object.
        scenes: Scenes that were planned in.
        solved: Those with a feasible grasp, whose straight approach is free.
        solvable: Those where an ordinary plan or one of very many starts found one.
        causes: What rejected most in those that were solvable and not solved, and how often.
        grasps: Feasible grasps that were checked densely.
        violating: Those that break a constraint by more than ``VIOLATED``.
        worst: The largest excess of any [m].
    """

    name: str
    scenes: int
    solved: int
    solvable: int
    causes: dict[str, int]
    grasps: int
    violating: int
    worst: float


def generated_scenes_chapter(bench: Bench) -> Chapter:
    """Plan in ``2 * repeats`` scenes for each object, tables and bins in turn."""
    measured = [_measure(bench, bench.model(name)) for name in bench.objects]
    rows = [
        [
            one.name,
            f"{one.solved} of {one.solvable} ({one.scenes})",
            ", ".join(f"{name} {count}" for name, count in one.causes.items()),
            f"{one.violating} of {one.grasps}",
            f"{1e3 * one.worst:.2f}",
        ]
        for one in measured
    ]
    solved, solvable = (sum(getattr(one, name) for one in measured) for name in ("solved", "solvable"))
    violating, grasps = (sum(getattr(one, name) for one in measured) for name in ("violating", "grasps"))
    text = (
        f"Objects in stable poses, drawn by how likely these are, on tables and in bins with up to {MAX_CLUTTER} "
        f"primitives beside them; {bench.starts} starts. Solved: {solved} of the {solvable} scenes where an ordinary "
        f"plan or one of {MANY_STARTS:,} starts finds a feasible grasp with a free approach. Violating: {violating} of "
        f"{grasps} feasible grasps break a constraint by more than {1e3 * VIOLATED:g} mm, at {POINTS} points on every "
        f"link, by formulas that the planner has no part in.\n\n"
        + table(["object", "solved", "causes where not", "violating", "worst excess mm"], rows)
    )
    return Chapter("Generated scenes", text, {}, {"objects": [asdict(one) for one in measured]})


def _measure(bench: Bench, model: ObjectModel) -> ScenesOfObject:
    bench.note(f"generated scenes for {model.name}")
    rng, plans, solvable, causes = np.random.default_rng(SEED), list[Search](), 0, Counter[str]()
    for number in range(2 * bench.repeats):
        constraints = generate(model, rng, with_bin=bool(number % 2))
        plan = _plan(model, bench.hand, constraints, bench.starts, SEED)
        plans.append(plan)
        found = plan.feasible > 0 or (
            _plan(model, bench.hand, constraints, MANY_STARTS // GOES_ON, SEED + 1).feasible > 0
        )
        solvable += found
        if found and not plan.feasible:
            ends = Counter(run.termination.label for run in plan.runs)
            causes[ends.most_common(1)[0][0] if ends else "no start"] += 1
    excesses = [measure_excess(run, bench.hand).most for plan in plans for run in plan.runs if run.feasible]
    return ScenesOfObject(
        name=model.name,
        scenes=len(plans),
        solved=sum(plan.feasible > 0 for plan in plans),
        solvable=solvable,
        causes=dict(causes),
        grasps=len(excesses),
        violating=sum(excess > VIOLATED for excess in excesses),
        worst=max(excesses, default=-np.inf),
    )


def _plan(model: ObjectModel, hand: Hand, constraints: Constraints, starts: int, seed: int) -> Search:
    return find_grasps(model, hand, starts=starts, seed=seed, top_k=1, constraints=constraints)


def generate(model: ObjectModel, rng: np.random.Generator, *, with_bin: bool) -> Constraints:
    """A table or an open bin with the object at rest in it, things beside it, and sometimes a forbidden region."""
    poses, shares = stable_poses(model)
    turned = np.eye(4)
    angle = rng.uniform(0, 2 * np.pi)
    turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    world_from_object = turned @ poses[rng.choice(len(poses), p=shares / shares.sum())]
    points = transform_points(world_from_object, model.mesh.vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    obstacles = [*(_walls(low, high, rng) if with_bin else ()), *_clutter(low, high, rng)]
    regions = ContactRegions()
    if rng.random() < 0.25:  # not below the middle, in the object's own frame
        up = world_from_object[2, :3]
        level = float(up @ model.mesh.bounds.mean(axis=0)) - 0.25 * (high[2] - low[2])
        regions = ContactRegions(forbidden=(Region("half_space", normal=tuple(up.tolist()), offset=level),))
    scene = Scene(
        object_pose=Pose.from_matrix(world_from_object),
        support_surfaces=(SupportSurface(),),
        obstacles=tuple(obstacles),
        clearance=float(rng.choice([0.0, 0.002, 0.005])),
    )
    return Constraints(scene=scene, contact_regions=regions)


def _walls(low: np.ndarray, high: np.ndarray, rng: np.random.Generator) -> list[Obstacle]:
    """Four walls about the object, with room for fingers on every side."""
    middle, half = (low + high) / 2, (high - low) / 2 + rng.uniform(0.09, 0.18)
    height = rng.uniform(0.4, 0.9) * high[2]
    return [
        Obstacle(
            f"wall {number}",
            Pose((middle[0] + x * half[0], middle[1] + y * half[1], height / 2)),
            Primitive.box(0.01 if x else 2 * half[0], 0.01 if y else 2 * half[1], height),
        )
        for number, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1)))
    ]


def _clutter(low: np.ndarray, high: np.ndarray, rng: np.random.Generator) -> list[Obstacle]:
    """Things on the table, from a few centimetres beside the object on."""
    kinds = (
        Primitive.box(0.05, 0.08, 0.1),
        Primitive.cylinder(0.12, 0.03),
        Primitive.sphere(0.05),
        Primitive.capsule(0.06, 0.03),
    )
    reach, found = float(np.linalg.norm((high - low)[:2])) / 2, []
    for number in range(int(rng.integers(0, MAX_CLUTTER + 1))):
        angle, away = rng.uniform(0, 2 * np.pi), reach + rng.uniform(0.08, 0.2)
        place = ((low + high) / 2)[:2] + away * np.array([np.cos(angle), np.sin(angle)])
        found.append(Obstacle(f"thing {number}", Pose((place[0], place[1], 0.06)), kinds[number % len(kinds)]))
    return found
