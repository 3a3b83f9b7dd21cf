"""The grasps of a result as exporters write them, with what every exported grasp must say of its origin."""

from dataclasses import dataclass
from typing import Any, Self

from fingersplit.errors import ExchangeError
from fingersplit.grasp import HandPose
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.result.grasp import GraspResult
from fingersplit.result.plan import PlanResult

__all__ = ["ResultGrasp", "Results"]


@dataclass(frozen=True, eq=False)
class ResultGrasp:
    """One grasp of a result.

    Attributes:
        rank: Place in the answer, 1 is best.
        grasp: The hand on the object.
        pregrasp: Where the approach begins; None when no straight way in is free.
        squeeze: Targets of position servos that press the pads on.
        confidence: Ferrari-Canny metric, 0 to 1.
    """

    rank: int
    grasp: HandPose
    pregrasp: HandPose | None
    squeeze: HandPose
    confidence: float


@dataclass(frozen=True, eq=False)
class Results:
    """The grasps to export, and where they come from.

    Attributes:
        hand: The hand that was planned for.
        hand_sha256: Hash of the description that it was planned with.
        object_id: Id of the object.
        object_name: Its name; its frame is the frame of the mesh.
        grasps: The grasps, best first.
    """

    hand: Hand
    hand_sha256: str
    object_id: str
    object_name: str
    grasps: tuple[ResultGrasp, ...]

    @classmethod
    def from_result(cls, result: PlanResult, rank: int | None = None) -> Self:
        """The grasps of a result.

        Args:
            result: The result.
            rank: Only this grasp; None for all feasible ones.

        Raises:
            ExchangeError: No grasp is feasible.
            ResultError: No such rank, or joints that the hand does not have.
            UnknownHandError: The hand is not known here.
        """
        hand = result.active_grip(load_hand(result.hand))
        chosen = [grasp for grasp in result.grasps if grasp.feasible] if rank is None else [result.grasp(rank)]
        if not chosen:
            raise ExchangeError(f"The result holds no feasible grasp to export; it has {len(result.grasps)} grasps.")
        return cls(
            hand=hand,
            hand_sha256=result.provenance.hand_sha256,
            object_id=result.object.id,
            object_name=result.object.name,
            grasps=tuple(_grasp(hand, grasp) for grasp in chosen),
        )

    @property
    def provenance(self) -> dict[str, Any]:
        """What users of a file ask for first: hand, its description's hash, frames and units."""
        return {
            "generator": "fingersplit",
            "hand": self.hand.name,
            "hand_description_sha256": self.hand_sha256,
            "hand_frame": self.hand.palm,
            "object": self.object_name,
            "object_id": self.object_id,
            "object_frame": "frame of the object's mesh",
            "joint_names": list(self.hand.joint_names),
            "units": "m, rad",
        }


def _grasp(hand: Hand, grasp: GraspResult) -> ResultGrasp:
    return ResultGrasp(
        rank=grasp.rank,
        grasp=grasp.for_hand(hand),
        pregrasp=grasp.pregrasp_pose(hand),
        squeeze=grasp.squeeze_pose(hand),
        confidence=min(max(grasp.metrics.ferrari_canny, 0.0), 1.0),
    )
