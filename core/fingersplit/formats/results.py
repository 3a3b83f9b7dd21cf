"""A result document as exporters read it, with what every exported grasp must say of its origin."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ExchangeError
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["HandPlacement", "ResultGrasp", "Results"]


@dataclass(frozen=True, eq=False)
class HandPlacement:
    """Where the hand is.

    Attributes:
        position: Palm origin in the object frame, (3,) [m].
        wxyz: Rotation from the palm frame to the object frame, unit quaternion, (4,).
        joints: Joint angles in the hand's order, (N,) [rad].
    """

    position: NDArray[np.float64]
    wxyz: NDArray[np.float64]
    joints: NDArray[np.float64]

    @property
    def object_from_palm(self) -> NDArray[np.float64]:
        """Palm pose, (4, 4)."""
        return pose_matrix(rotation_from_wxyz(self.wxyz), self.position)

    @property
    def qpos(self) -> NDArray[np.float64]:
        """Position xyz [m], quaternion wxyz, then joints [rad], (7 + N,)."""
        return np.concatenate([self.position, self.wxyz, self.joints])


@dataclass(frozen=True, eq=False)
class ResultGrasp:
    """One grasp of a result document.

    Attributes:
        rank: Place in the answer, 1 is best.
        grasp: The hand on the object.
        pregrasp: Where the approach begins, None when the document knows none.
        squeeze: Targets of position servos that press the pads on; the grasp itself when the document has none.
        confidence: Ferrari-Canny metric, 0 to 1.
    """

    rank: int
    grasp: HandPlacement
    pregrasp: HandPlacement | None
    squeeze: HandPlacement
    confidence: float


@dataclass(frozen=True, eq=False)
class Results:
    """The grasps to export, and where they come from.

    Attributes:
        hand: The hand that was planned for.
        object_id: Hash of the object's mesh.
        object_name: Its name; its frame is the frame of the mesh.
        grasps: The grasps, best first.
    """

    hand: Hand
    object_id: str
    object_name: str
    grasps: tuple[ResultGrasp, ...]

    @classmethod
    def from_document(cls, document: Mapping[str, Any], rank: int | None = None) -> Self:
        """Read a result document.

        Args:
            document: The document.
            rank: Only this grasp; None for all feasible ones.

        Raises:
            ExchangeError: No such grasp, none that is feasible, or no result document.
        """
        try:
            hand = load_hand(document["hand"])
            chosen = [g for g in document["grasps"] if (g["feasible"] if rank is None else g["rank"] == rank)]
            grasps = tuple(_grasp(hand, grasp) for grasp in chosen)
            results = cls(hand, str(document["object"]["id"]), str(document["object"]["name"]), grasps)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ExchangeError(
                f"This is no result document of a plan: {error!r} where its fields are read."
            ) from error
        if not grasps:
            ranks = len(document["grasps"])
            wanted = "feasible grasp" if rank is None else f"grasp of rank {rank}"
            raise ExchangeError(f"The result holds no {wanted} to export; it has {ranks} grasps, rank 1 is the best.")
        return results

    @property
    def provenance(self) -> dict[str, Any]:
        """What users of a file ask for first: hand, its description's hash, frames and units."""
        return {
            "generator": "fingersplit",
            "hand": self.hand.name,
            "hand_description_sha256": self.hand.sha256,
            "hand_frame": self.hand.palm,
            "object": self.object_name,
            "object_id": self.object_id,
            "object_frame": "frame of the object's mesh",
            "joint_names": list(self.hand.joint_names),
            "units": "m, rad",
        }


def _grasp(hand: Hand, document: Mapping[str, Any]) -> ResultGrasp:
    grasp = _placement(hand, document["palm"], document["joints"])
    pregrasp, squeeze = document.get("pregrasp"), document.get("squeeze_joints")
    return ResultGrasp(
        rank=int(document["rank"]),
        grasp=grasp,
        pregrasp=None if pregrasp is None else _placement(hand, pregrasp["palm"], pregrasp["joints"]),
        squeeze=grasp if not squeeze else _placement(hand, document["palm"], squeeze),
        confidence=float(np.clip(document["metrics"]["ferrari_canny"], 0.0, 1.0)),
    )


def _placement(hand: Hand, palm: Mapping[str, Any], joints: Mapping[str, float]) -> HandPlacement:
    position, wxyz = np.array(palm["position"], dtype=np.float64), np.array(palm["wxyz"], dtype=np.float64)
    if position.shape != (3,) or wxyz.shape != (4,):
        raise ValueError(f"palm {dict(palm)} is no position and quaternion")
    return HandPlacement(position, wxyz, np.array([float(joints[name]) for name in hand.joint_names]))
