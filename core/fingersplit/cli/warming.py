"""Compile every kernel once, so that the first real request does not wait for it."""

from collections.abc import Sequence

import numpy as np

from fingersplit.compilation import kernel_cache_folder
from fingersplit.execution.execution import plan_execution
from fingersplit.formats.hand_grasps import grasp_at
from fingersplit.grasp import HandPose
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.intake.cleaning import turn_outwards
from fingersplit.objects.intake.ply import parse_ply
from fingersplit.objects.intake.polygons import triangulated
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.parametric import cylinder, sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.parallel_grasps.closing_kernel import close_jaws
from fingersplit.planning.search import find_grasps
from fingersplit.planning.surroundings import clearance_of
from fingersplit.recording.posing import points_in_collision, pose_links, reference_points
from fingersplit.recording.shading import shade_hand
from fingersplit.scene import Constraints, Obstacle, Pose, Primitive, Scene, SupportSurface
from fingersplit.verification import verify

__all__ = ["compile_kernels", "kernels_are_compiled"]

_ASIDE = 0.15
"""How far an obstacle stands beside the object, within reach of a hand and out of its way [m]."""
_PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    + np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 1, 0), (0, 2, 0)], "<f4").tobytes()
    + bytes([5])
    + np.arange(5, dtype="<i4").tobytes()
)
"""A polygon that is not convex, in a binary file."""

_PINCHED = Mesh(
    np.array([(0, 0, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], np.float64),
    np.array(
        [(a, b, c) for k in (2, 4) for a, b, c in ((0, k, 1), (0, 1, k + 1), (1, k, k + 1), (k, 0, k + 1))], np.int32
    ),
)
"""Two tetrahedra that share an edge, where four faces meet."""


def kernels_are_compiled() -> bool:
    """Whether the cache holds compiled kernels of these sources."""
    return kernel_cache_folder("fingersplit.splitting.finger_splitting_kernel").exists()


def compile_kernels(hands: Sequence[Hand]) -> None:
    """Do everything once on a small object; takes minutes with an empty cache, else seconds.

    The kernels are the same for all hands. What is computed once a hand, such as where its jaws can reach, is computed
    for each of them.
    """
    model = prepare_object(cylinder(), "warm-up")
    for hand in hands:
        find_grasps(model, hand, starts=2, top_k=1)
    _plan(hands[0], model)
    _show(hands[0], model)
    triangulated(*parse_ply(_PLY))
    for mesh in (_PINCHED, model.mesh):
        turn_outwards(mesh)


def _plan(hand: Hand, model: ObjectModel) -> None:
    """Plan alone, beside obstacles of every kind and from given grasps, and verify."""
    pose = Pose((_ASIDE, 0.0, 0.0))
    obstacles = (
        Obstacle("box", pose, primitive=Primitive.box(0.02, 0.02, 0.02)),
        Obstacle("mesh", pose, model=prepare_object(sphere(0.02), "obstacle")),
        Obstacle("cloud", pose, points=np.zeros((1, 3)), point_radius=0.005),
    )
    full = Scene(support_surfaces=(SupportSurface(),), obstacles=obstacles)
    for scene in (Scene(), full):  # numba compiles the search for each
        constraints = Constraints(scene=scene)
        found = find_grasps(model, hand, source="both", starts=8, constraints=constraints, refine=True)
    best, run = found.grasps[0], found.grasps[0].run
    plan_execution(run.problem, hand, run.last, best.execution.grip)
    clearance_of(run, found.scene)
    find_grasps(model, hand, [run.parallel_grasp], starts=1)
    _ = run.trace
    verify(run.final, hand, model, decompose(model.mesh))


def _show(hand: Hand, model: ObjectModel) -> None:
    """What pictures, recordings and files of grasps need."""
    none = np.zeros((0, 3))
    close_jaws(model.triangles, none, none, none, np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 3)))
    state = hand.lower[None], np.eye(3)[None], np.zeros((1, 3))
    pose_links(hand, *state)
    points_in_collision(hand, model, *state)
    reference_points(model, none)
    shade_hand(hand)
    hand.shape_poses(hand.lower)
    grasp_at(model, hand, HandPose(np.eye(4), hand.lower))
