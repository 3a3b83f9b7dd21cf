"""Section `depth`: from a rendered depth image of an object on a table to a grasp that is picked on the true mesh."""

from dataclasses import asdict, dataclass, replace
from time import thread_time

import numpy as np

from fingersplit.errors import FingersplitError
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit.scene import Approach, ApproachCone, Constraints, Pose, Scene, SupportSurface
from fingersplit.scene.from_view import scene_from_view
from fingersplit.scene.preparing import prepare_scene
from fingersplit.scene.stable_pose import stable_poses
from fingersplit.transforms import transform_points
from fingersplit.verification.pick import verify_pick
from fingersplit.verification.picking import PickWays
from fingersplit_bench.calls import SEED
from fingersplit_bench.depth_views import Camera, look_at, render_view
from fingersplit_bench.suite import Bench, Chapter, table

__all__ = ["ViewedObject", "depth_chapter"]

EYE = (0.45, -0.1, 0.45)
"""[m]; where the camera stands, beside and above the object's middle."""
CAMERA = Camera(320, 240, 300.0)


@dataclass(frozen=True)
class ViewedObject:
    """Figures of one object.

    Attributes:
        name: Of the object.
        points: Measured points of the target.
        assumed: Share of its surface that was not seen.
        cut_ms: CPU time to cut the image into target and scene [ms].
        prepare_ms: CPU time to prepare the target [ms].
        plan_ms: CPU time of the plan [ms].
        pick: How the pick of rank 1 ended on the true mesh, or why there is none.
    """

    name: str
    points: int
    assumed: float
    cut_ms: float
    prepare_ms: float
    plan_ms: float
    pick: str

    @property
    def whole_ms(self) -> float:
        """From image to answer [ms]."""
        return self.cut_ms + self.prepare_ms + self.plan_ms


def depth_chapter(bench: Bench) -> Chapter:
    """Render, cut, plan and pick every object once in its likeliest stable pose."""
    measured = [_measure(bench, bench.model(name)) for name in bench.objects]
    rows = [
        [
            one.name,
            f"{one.points:,}",
            f"{one.assumed:.0%}",
            f"{one.cut_ms:.0f}",
            f"{one.prepare_ms:.0f}",
            f"{one.plan_ms:.0f}",
            f"{one.whole_ms:.0f}",
            one.pick,
        ]
        for one in measured
    ]
    held = sum(one.pick == "held" for one in measured)
    whole = [one.whole_ms for one in measured]
    text = (
        f"One depth image of {CAMERA.width} x {CAMERA.height} pixels, noise 0.5 mm, support surface by RANSAC, "
        f"{bench.starts} starts, one thread; CPU time of the second of two runs. Picks of rank 1 on the true mesh: "
        f"{held} of {len(measured)} held; from image "
        f"to answer {np.median(whole):.0f} ms at the median, {max(whole):.0f} ms at most.\n\n"
        + table(["object", "points", "assumed", "cut ms", "prepare ms", "plan ms", "whole ms", "pick"], rows)
    )
    return Chapter("Depth images", text, {}, {"objects": [asdict(one) for one in measured]})


def _measure(bench: Bench, model: ObjectModel) -> ViewedObject:
    bench.note(f"depth image of {model.name}")
    world_from_object = stable_poses(model)[0][0]
    view = render_view(model.mesh, world_from_object, look_at(np.array(EYE), np.array([0.0, 0.0, 0.04])), CAMERA)
    (cut_ms, prepare_ms, plan_ms), pick, points, assumed = (0.0, 0.0, 0.0), "", 0, 0.0
    try:
        for _ in range(2):
            began = thread_time()
            found = scene_from_view(view, support=True)
            points, cut = len(found.target.points), thread_time()
            target = prepare_object(found.target, options=replace(model.options, mass=model.mass))
            prepared, assumed = thread_time(), target.assumed
            constraints = Constraints(scene=found.scene, approach=Approach((ApproachCone((0.0, 0.0, -1.0), 1.2),)))
            plan = find_grasps(target, bench.hand, starts=bench.starts, seed=SEED, constraints=constraints)
            cut_ms, prepare_ms = 1e3 * (cut - began), 1e3 * (prepared - cut)
            plan_ms = 1e3 * (thread_time() - prepared)
        if not plan.feasible:
            pick = plan.message
        else:
            assert view.world_from_camera is not None
            camera_from_object = np.linalg.inv(view.world_from_camera) @ world_from_object
            true = prepare_object(
                Mesh(transform_points(camera_from_object, model.mesh.vertices), model.mesh.faces),
                model.name,
                replace(model.options, mass=model.mass),
            )
            resting = Scene(object_pose=Pose.from_matrix(view.world_from_camera), support_surfaces=(SupportSurface(),))
            scene = prepare_scene(Constraints(scene=resting), true, bench.hand)
            best = plan.grasps[0]
            execution = best.execution
            ways = PickWays(
                approach=execution.approach_direction,
                approach_distance=execution.approach_distance,
                opened=execution.pregrasp_joints,
                retreat=execution.retreat_direction,
                retreat_distance=execution.retreat_distance,
            )
            pieces = decompose(true.mesh)
            pick = verify_pick(best.run.final, bench.hand, true, pieces, scene, ways, grip=execution.grip).reason
    except FingersplitError as error:
        pick = str(error)
    return ViewedObject(model.name, points, assumed, cut_ms, prepare_ms, plan_ms, pick)
