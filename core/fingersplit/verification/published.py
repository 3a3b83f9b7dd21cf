"""What is published of how a grasp is executed, as simulations take it."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip_plan import GripPlan
from fingersplit.hands.hand import Hand
from fingersplit.result.grasp import GraspResult, joints_in_order
from fingersplit.result.grip import PlannedGrip
from fingersplit.result.wire import from_dict, to_dict

__all__ = ["Execution"]


@dataclass(frozen=True, eq=False)
class Execution:
    """How a grasp is executed.

    Attributes:
        opened: Joints from which the hand closes, (N,) [rad].
        grip: What it closes to, and how hard.
    """

    opened: NDArray[np.float64] | None
    grip: GripPlan

    @classmethod
    def of_result(cls, grasp: GraspResult, hand: Hand) -> Self:
        """As a result states it; a grasp without a way in states no opening."""
        pregrasp = grasp.pregrasp_pose(hand)
        return cls(None if pregrasp is None else pregrasp.joints, grasp.grip_plan(hand))

    @classmethod
    def from_document(cls, document: dict[str, Any], hand: Hand) -> Self:
        """As ``to_document`` wrote it.

        Raises:
            ResultError: Its joints, drivers or fingers are not those of the hand.
        """
        targets = joints_in_order(hand, document["squeeze_joints"])
        opened = joints_in_order(hand, document["pregrasp_joints"])
        return cls(opened, from_dict(PlannedGrip, document["grip"]).to_plan(hand, targets))

    def to_document(self, hand: Hand) -> dict[str, Any]:
        """All of it as plain JSON data."""
        return {
            "pregrasp_joints": None if self.opened is None else hand.named(self.opened),
            "squeeze_joints": hand.named(self.grip.targets),
            "grip": to_dict(PlannedGrip.from_plan(self.grip, hand)),
        }
