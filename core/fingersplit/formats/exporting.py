"""What goes out of a result: which grasps, and what every file says of them and their origin."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError
from fingersplit.grasp import HandPose
from fingersplit.hands.hand import Hand
from fingersplit.result.grasp import GraspResult, PalmPose
from fingersplit.result.plan import PlanResult

__all__ = ["Export", "ExportedGrasp"]

NO_WAY_IN = "no collision-free straight way in: it has no pre-grasp, so it cannot be executed"


@dataclass(frozen=True, eq=False)
class ExportedGrasp:
    """One grasp that goes out.

    Attributes:
        rank: Place in the result, 1 is best.
        quality: In (0, 1], for formats that have one number: it falls with the rank and says nothing else.
        pose: The hand on the object.
        pregrasp: Where the approach begins; None when no straight way in is free.
        squeeze: Targets of position servos that press the pads on.
        metrics: Every metric of the grasp by name.
    """

    rank: int
    quality: float
    pose: HandPose
    pregrasp: HandPose | None
    squeeze: HandPose
    metrics: dict[str, float | None]

    @property
    def opened(self) -> HandPose:
        """The palm of the grasp with the fingers as before it; where no pre-grasp is known, the grasp."""
        return self.pose if self.pregrasp is None else HandPose(self.pose.object_from_palm, self.pregrasp.joints)

    def way_in(self) -> tuple[NDArray[np.float64], float] | None:
        """Direction of travel (3,) in the palm frame, and length [m], from the pre-grasp; None without one."""
        if self.pregrasp is None:
            return None
        way = self.pose.position - self.pregrasp.position
        length = float(np.linalg.norm(way))
        return (self.pose.object_from_palm[:3, :3].T @ way / length, length) if length > 0.0 else None

    def to_document(self, hand: Hand) -> dict[str, Any]:
        """What a format may have no place for, as plain JSON data."""
        pregrasp, way = None, self.way_in()
        if self.pregrasp is not None:
            pregrasp = {"palm": _pose(self.pregrasp), "joints": hand.named(self.pregrasp.joints)}
        return {
            "rank": self.rank,
            "quality": self.quality,
            "metrics": self.metrics,
            "pregrasp": pregrasp,
            "approach": None if way is None else {"direction_in_hand_frame": way[0].tolist(), "distance": way[1]},
            "squeeze_joints": hand.named(self.squeeze.joints),
        }


@dataclass(frozen=True, eq=False)
class Export:
    """The grasps to write, and where they come from.

    Attributes:
        hand: The hand that was planned for.
        result: The result.
        grasps: The grasps, best first.
        left_out: Rank and reason of every grasp that stays behind.
    """

    hand: Hand
    result: PlanResult
    grasps: tuple[ExportedGrasp, ...]
    left_out: tuple[tuple[int, str], ...]

    @classmethod
    def of(cls, result: PlanResult, hand: Hand, rank: int | None = None, most: int | None = None) -> Self:
        """Grasps of a result.

        Args:
            result: The result.
            hand: The hand that it was planned for.
            rank: Only this grasp, whatever is wrong with it; None for all that can be executed.
            most: Most grasps that the format holds; None for any number.

        Raises:
            FormatError: No grasp can be executed.
            ResultError: No such rank, or another hand.
        """
        result.check_hand(hand)
        hand, chosen, left_out = result.active_grip(hand), list[GraspResult](), list[tuple[int, str]]()
        for grasp in result.grasps if rank is None else [result.grasp(rank)]:
            reason = None if rank is not None else _why_not(grasp)
            if reason is None and most is not None and len(chosen) == most:
                reason = "the format holds fewer grasps"
            if reason is None:
                chosen.append(grasp)
            else:
                left_out.append((grasp.rank, reason))
        if not chosen:
            reasons = "; ".join(f"rank {rank}: {reason}" for rank, reason in left_out[:3]) or result.message
            raise FormatError(
                f"The result holds no grasp that can be executed: {reasons.rstrip('.')}. A rank that is asked "
                f"for by its number is exported all the same."
            )
        return cls(hand, result, tuple(_exported(hand, result, grasp) for grasp in chosen), tuple(left_out))

    @property
    def object_name(self) -> str:
        """Name of the object; its frame is the frame of the mesh."""
        return self.result.object.name

    @property
    def origin(self) -> dict[str, Any]:
        """What users of a file ask for first, the same in every format: hand, frames, hashes, how to execute."""
        jaws = self.hand.gripper
        palm_from_tool = np.eye(4)
        palm_from_tool[:3, :3] = jaws.palm_from_gripper
        palm_from_tool[:3, 3] = jaws.palm_from_gripper @ (*jaws.center, sum(jaws.standoff) / 2)
        return {
            "generator": f"fingersplit {self.result.provenance.software_version}",
            "hand": self.hand.name,
            "hand_description_sha256": self.result.provenance.hand_sha256,
            "hand_frame": self.hand.palm,
            "tool": {"frame": "jaws", "hand_from_tool": _pose(HandPose(palm_from_tool, np.empty(0)))},
            "object": self.object_name,
            "object_id": self.result.object.id,
            "object_frame": "frame of the object's mesh",
            "object_scale": 1.0,
            "object_mass": self.result.object.mass,
            "friction": self.result.friction,
            "joint_names": list(self.hand.joint_names),
            "units": "m, rad, kg",
            "quaternions": "wxyz",
            "quality": "falls with the rank; the metrics stand under their own names",
            "grasps": [grasp.to_document(self.hand) for grasp in self.grasps],
            "left_out": [{"rank": rank, "reason": reason} for rank, reason in self.left_out],
        }

    @property
    def message(self) -> str:
        """The export in a sentence."""
        reasons = "; ".join(f"rank {rank}: {reason}" for rank, reason in self.left_out)
        ranks = ", ".join(str(grasp.rank) for grasp in self.grasps)
        count = f"rank {ranks}" if len(self.grasps) == 1 else f"ranks {ranks}"
        return f"{count}; left out: {reasons}." if reasons else f"{count}."


def _why_not(grasp: GraspResult) -> str | None:
    """Why a grasp cannot be executed; None when it can."""
    if not grasp.feasible:
        return f"not feasible: {grasp.violations[0].rstrip('.')}" if grasp.violations else "not feasible"
    return NO_WAY_IN if grasp.pregrasp is None else None


def _exported(hand: Hand, result: PlanResult, grasp: GraspResult) -> ExportedGrasp:
    last = max(one.rank for one in result.grasps)
    return ExportedGrasp(
        rank=grasp.rank,
        quality=1.0 - (grasp.rank - 1) / last,
        pose=grasp.for_hand(hand),
        pregrasp=grasp.pregrasp_pose(hand),
        squeeze=grasp.squeeze_pose(hand),
        metrics=dict(grasp.metrics),
    )


def _pose(pose: HandPose) -> dict[str, Any]:
    palm = PalmPose.from_matrix(pose.object_from_palm)
    return {"position": list(palm.position), "wxyz": list(palm.wxyz)}
