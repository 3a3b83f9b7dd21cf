"""A hand tried on simple objects: how many grasps are feasible, and why the others are not."""

from typing import Any

from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import box, cylinder, sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps

__all__ = ["try_hand"]

STARTS, SEED = 16, 0
SHARES = (0.3, 0.5, 0.75)
"""Widths of the objects by the hand's largest opening."""


def try_hand(hand: Hand) -> list[dict[str, Any]]:
    """Plan for a sphere, a box and a cylinder in three sizes, with every grip.

    Returns:
        For each: object, width [m], jaws, starts, feasible grasps, counts of how the runs ended, and their advice.
    """
    found = []
    for grip in hand.grips:
        jaws = [[f.name for f, g in zip(grip.fingers, grip.gripper.groups, strict=True) if g == jaw] for jaw in (0, 1)]
        for share in SHARES:
            width = share * grip.gripper.opening[1]
            for name, mesh in _objects(width).items():
                title = f"{name} of {1e3 * width:.0f} mm"
                planned = find_grasps(prepare_object(mesh, title), grip.alone(), starts=STARTS, seed=SEED, top_k=1)
                ends = [run.termination for run in planned.runs]
                found.append(
                    {
                        "object": title,
                        "width": width,
                        "jaws": jaws,
                        "starts": len(ends),
                        "feasible": planned.feasible,
                        "terminations": {end.label: ends.count(end) for end in sorted(set(ends))},
                        "advice": sorted({end.advice for end in ends}) if not planned.feasible else [],
                    }
                )
    return found


def _objects(width: float) -> dict[str, Mesh]:
    return {
        "sphere": sphere(width / 2),
        "box": box((width, width, 2 * width)),
        "cylinder": cylinder(width / 2, 2.5 * width),
    }
