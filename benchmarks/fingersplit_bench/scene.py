"""Section `scene`: what a table, primitives and a cloud cost, what is found among them, and whether it keeps clear."""

from dataclasses import asdict, dataclass
from time import perf_counter, process_time

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.run import Run
from fingersplit.planning.search import Search, find_grasps
from fingersplit.scene import Constraints, Obstacle, Pose, Primitive, Scene, SupportSurface
from fingersplit.scene.preparing import prepare_scene
from fingersplit.scene.stable_pose import stable_poses
from fingersplit.transforms import transform_points
from fingersplit.verification.pick import verify_pick
from fingersplit.verification.picking import PickWays
from fingersplit_bench.calls import SEED
from fingersplit_bench.suite import Bench, Chapter, table

__all__ = ["ObjectScenes", "measure_scene"]

POSES = 3
"""Stable poses of an object that tables and bins are generated for, the likeliest ones."""
PRIMITIVES, CLOUD_POINTS = 20, 50_000
MANY_STARTS = 2_000
"""Where so many find nothing, nothing is asked of an ordinary plan."""
VIOLATED = 0.5e-3
"""[m]"""
DENSE = 2_000
"""Points on every link that the independent check looks at."""


@dataclass(frozen=True)
class ObjectScenes:
    """Figures of one object.

    Attributes:
        name: Of the object.
        none_ms: CPU time of a plan without a scene [ms].
        table: The same on a table, times that.
        primitives: On a table with primitives about it, times that.
        cloud: On a table with a cloud about it, times that.
        cloud_ms: Time to prepare the cloud [ms].
        scenes: Tables and bins that were tried.
        solved: Those with a feasible grasp.
        solvable: Those where an ordinary plan or one of very many starts found one.
        grasps: Feasible grasps that were checked.
        violating: Those that come nearer to anything than they may, by points on the links.
        pick: How the pick of rank 1 on the table ended.
    """

    name: str
    none_ms: float
    table: float
    primitives: float
    cloud: float
    cloud_ms: float
    scenes: int
    solved: int
    solvable: int
    grasps: int
    violating: int
    pick: str


def measure_scene(bench: Bench) -> Chapter:
    """Plan on tables, in bins and beside clouds, check every grasp, and pick the first."""
    measured = [_measure(bench, bench.model(name)) for name in bench.objects]
    rows = [
        [
            one.name,
            f"{one.none_ms:.0f}",
            f"{one.table:.2f}",
            f"{one.primitives:.2f}",
            f"{one.cloud:.2f}",
            f"{one.cloud_ms:.0f}",
            f"{one.solved} of {one.solvable} ({one.scenes})",
            f"{one.violating} of {one.grasps}",
            one.pick,
        ]
        for one in measured
    ]
    headings = [
        "object",
        "no scene ms",
        "table",
        f"{PRIMITIVES} primitives",
        f"{CLOUD_POINTS:,} points",
        "cloud ms",
        "solved",
        "violating",
        "pick",
    ]
    text = (
        f"CPU time of plans of {bench.starts} starts on one thread, least of {bench.repeats}; with a scene as a "
        f"multiple of that without. Stable poses are known beforehand. Solved: scenes with a feasible grasp, of those "
        f"where up to {MANY_STARTS:,} starts find one (of all). Violating: feasible grasps that lack more than "
        f"{1e3 * VIOLATED:g} mm of clearance at {DENSE:,} points on every link.\n\n" + table(headings, rows)
    )
    return Chapter("Scenes", text, {}, {"objects": [asdict(one) for one in measured]})


def _measure(bench: Bench, model: ObjectModel) -> ObjectScenes:
    bench.note(f"scenes for {model.name}")
    hand, rng = bench.hand, np.random.default_rng(SEED)
    on_table = _scene(model, 0)
    cluttered = _scene(model, 0, obstacles=_primitives(model, on_table, rng))
    clouded = _scene(model, 0, obstacles=(_cloud(model, on_table, rng),))
    none = _cpu(bench, model, None)[0]
    times = [_cpu(bench, model, Constraints(scene))[0] / none for scene in (on_table, cluttered, clouded)]
    began = perf_counter()
    prepare_scene(Constraints(clouded), model, hand)
    cloud_ms = 1e3 * (perf_counter() - began)
    scenes = [_scene(model, pose, with_bin) for pose in range(POSES) for with_bin in (False, True)]
    plans = [find_grasps(model, hand, starts=bench.starts, seed=SEED, constraints=Constraints(one)) for one in scenes]
    solvable = sum(
        plan.feasible > 0 or _solvable(model, hand, scene) for scene, plan in zip(scenes, plans, strict=True)
    )
    runs = [run for plan in plans for run in plan.runs if run.feasible]
    return ObjectScenes(
        name=model.name,
        none_ms=1e3 * none,
        table=times[0],
        primitives=times[1],
        cloud=times[2],
        cloud_ms=cloud_ms,
        scenes=len(scenes),
        solved=sum(plan.feasible > 0 for plan in plans),
        solvable=solvable,
        grasps=len(runs),
        violating=sum(_violates(run, hand) for run in runs),
        pick=_pick(model, hand, plans[0]),
    )


def _cpu(bench: Bench, model: ObjectModel, constraints: Constraints | None) -> tuple[float, Search]:
    """Least CPU time of a plan [s]; kernels are loaded by a first one."""
    best = np.inf
    for _ in range(bench.repeats + 1):
        began = process_time()
        found = find_grasps(model, bench.hand, starts=bench.starts, seed=SEED, constraints=constraints)
        best = min(best, process_time() - began)
    return float(best), found


def _solvable(model: ObjectModel, hand: Hand, scene: Scene) -> bool:
    return find_grasps(model, hand, starts=MANY_STARTS, seed=SEED, constraints=Constraints(scene)).feasible > 0


def _scene(model: ObjectModel, pose: int, with_bin: bool = False, obstacles: tuple[Obstacle, ...] = ()) -> Scene:
    """The object in one of its stable poses on a table, perhaps in an open bin."""
    poses, _ = stable_poses(model)
    world_from_object = poses[min(pose, len(poses) - 1)]
    walls: tuple[Obstacle, ...] = ()
    if with_bin:
        low, high = _bounds(model, world_from_object)
        middle, half = (low + high) / 2, (high - low) / 2 + 0.12
        height = 0.6 * high[2]
        walls = tuple(
            Obstacle(
                f"wall {number}",
                Pose((middle[0] + x * half[0], middle[1] + y * half[1], height / 2)),
                Primitive.box(0.01 if x else 2 * half[0], 0.01 if y else 2 * half[1], height),
            )
            for number, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1)))
        )
    return Scene(
        object_pose=Pose.from_matrix(world_from_object),
        support_surfaces=(SupportSurface(),),
        obstacles=walls + obstacles,
    )


def _bounds(model: ObjectModel, world_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    points = transform_points(world_from_object, model.mesh.vertices)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _primitives(model: ObjectModel, scene: Scene, rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Boxes, cylinders, spheres and capsules on the table, 15 to 35 cm from the object's middle."""
    low, high = _bounds(model, scene.world_from_object)
    reach = float(np.linalg.norm(high - low)) / 2
    kinds = (
        Primitive.box(0.05, 0.08, 0.1),
        Primitive.cylinder(0.1, 0.03),
        Primitive.sphere(0.04),
        Primitive.capsule(0.06, 0.03),
    )
    made = []
    for number in range(PRIMITIVES):
        angle, away = rng.uniform(0, 2 * np.pi), reach + rng.uniform(0.1, 0.25)
        place = ((low + high) / 2)[:2] + away * np.array([np.cos(angle), np.sin(angle)])
        made.append(Obstacle(f"thing {number}", Pose((place[0], place[1], 0.05)), kinds[number % len(kinds)]))
    return tuple(made)


def _cloud(model: ObjectModel, scene: Scene, rng: np.random.Generator) -> Obstacle:
    """A wall as a camera sees it, beside the object."""
    low, high = _bounds(model, scene.world_from_object)
    points = np.column_stack(
        [
            rng.normal(high[0] + 0.1, 1e-3, CLOUD_POINTS),
            rng.uniform(low[1] - 0.3, high[1] + 0.3, CLOUD_POINTS),
            rng.uniform(0.0, 0.4, CLOUD_POINTS),
        ]
    )
    return Obstacle("cloud", points=points, point_radius=1e-3)


def _violates(run: Run, hand: Hand) -> bool:
    """Whether points on the links come too near to table or walls, or lie in the object, by other means than ours."""
    assert run.scene is not None
    scene, final = run.scene.constraints.scene, run.final
    links = hand.shape_poses(final.joints, final.object_from_palm)
    on_links = [
        transform_points(link, mesh.sample(DENSE, seed=SEED))
        for link, mesh in zip(links, hand.shape_meshes, strict=True)
    ]
    in_world = transform_points(run.scene.world_from_object, np.concatenate(on_links))
    least = in_world[:, 2].min()
    for obstacle in scene.obstacles:
        assert obstacle.primitive is not None
        beyond = np.abs(in_world - obstacle.pose.position) - np.array(obstacle.primitive.dimensions) / 2
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
        least = min(least, outside.min())
    return bool(least < scene.clearance - VIOLATED)


def _pick(model: ObjectModel, hand: Hand, plan: Search) -> str:
    if not plan.feasible:
        return "no grasp"
    best, execution = plan.grasps[0], plan.grasps[0].execution
    ways = PickWays(
        approach=execution.approach_direction,
        approach_distance=execution.approach_distance,
        opened=execution.pregrasp_joints,
        retreat=execution.retreat_direction,
        retreat_distance=execution.retreat_distance,
    )
    return verify_pick(best.run.final, hand, model, decompose(model.mesh), plan.scene, ways).reason
