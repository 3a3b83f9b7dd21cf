"""Compile every kernel once, so that the first real request does not wait for it."""

import numpy as np

from fingersplit.compilation import kernel_cache_folder
from fingersplit.hands.hand import Hand
from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.parallel_grasps.closing_kernel import close_jaws
from fingersplit.planning.planning import plan
from fingersplit.recording.posing import points_in_collision, pose_links, reference_points
from fingersplit.recording.shading import shade_hand
from fingersplit.scene import Constraints, Scene, SupportSurface

__all__ = ["compile_kernels", "kernels_are_compiled"]


def kernels_are_compiled() -> bool:
    """Whether the cache holds compiled kernels of these sources."""
    return kernel_cache_folder("fingersplit.splitting.finger_splitting_kernel").exists()


def compile_kernels(hand: Hand) -> None:
    """Plan two starts on a small object, alone and on a table; takes minutes with an empty cache, else seconds."""
    model = prepare_object(cylinder(), "warm-up")
    for scene in (Scene(), Scene(support_surfaces=(SupportSurface(),))):  # numba compiles the search for each
        plan(model, hand, source="both", starts=2, top_k=1, constraints=Constraints(scene=scene))
    none = np.zeros((0, 3))
    close_jaws(model.triangles, none, none, none, np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 3)))
    state = hand.lower[None], np.eye(3)[None], np.zeros((1, 3))
    pose_links(hand, *state)
    points_in_collision(hand, model, *state)
    reference_points(model, none)
    shade_hand(hand)
