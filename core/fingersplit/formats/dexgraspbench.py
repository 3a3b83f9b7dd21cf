"""DexGraspBench samples: one grasp as a pickled dict of hand configurations, read and written."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError
from fingersplit.formats.exporting import Export
from fingersplit.formats.fields import numbers
from fingersplit.formats.file_format import FileFormat
from fingersplit.formats.hand_grasps import HandGrasp, HandGrasps
from fingersplit.grasp import HandPose
from fingersplit.hands.hand import Hand
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["DEXGRASPBENCH", "DexGraspBenchSample", "read_dexgraspbench"]

_OBJECT_POSE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class DexGraspBenchSample:
    """One grasp; every configuration is position xyz [m], quaternion wxyz, joints [rad] in the MJCF's order, (7 + N,).

    Attributes:
        object_pose: Object in the world, position xyz [m] and quaternion wxyz, (7,).
        object_scale: Factor from the object's mesh to metres.
        object_path: Folder of the object.
        approach: Configurations on the way in, (n, 7 + N), None when there are none.
        pregrasp: Before the fingers close.
        grasp: Fingers on the object.
        squeeze: Where position servos aim to hold it.
        joint_names: Names of the joints, None where the file does not say.
    """

    object_pose: NDArray[np.float64]
    object_scale: float
    object_path: str
    approach: NDArray[np.float64] | None
    pregrasp: NDArray[np.float64]
    grasp: NDArray[np.float64]
    squeeze: NDArray[np.float64]
    joint_names: tuple[str, ...] | None


def _recognises(content: Any) -> bool:
    return isinstance(content, dict) and "grasp_qpos" in content


def read_dexgraspbench(content: Any) -> DexGraspBenchSample:
    """The content of a sample's file.

    Raises:
        FormatError: Not such a file, a field is missing, or its numbers have the wrong shape.
    """
    if not isinstance(content, dict):
        raise FormatError(f"A DexGraspBench sample is a dict, this file holds {type(content).__name__}.")
    missing = [key for key in ("obj_pose", "obj_scale", "obj_path", "grasp_qpos") if key not in content]
    if missing:
        raise FormatError(f"The DexGraspBench sample has no {missing[0]!r}; found: {', '.join(map(str, content))}.")
    grasp = _row(content, "grasp_qpos", None)
    if len(grasp) < 7:
        raise FormatError(f"grasp_qpos of the DexGraspBench sample needs at least 7 numbers, got {len(grasp)}.")
    approach, names = content.get("approach_qpos"), content.get("joint_names")
    return DexGraspBenchSample(
        object_pose=_row(content, "obj_pose", 7),
        object_scale=float(numbers(content["obj_scale"], "obj_scale", ())),
        object_path=str(content["obj_path"]),
        approach=None if approach is None else numbers(approach, "approach_qpos", (None, len(grasp))),
        pregrasp=_row(content, "pregrasp_qpos", len(grasp)) if "pregrasp_qpos" in content else grasp,
        grasp=grasp,
        squeeze=_row(content, "squeeze_qpos", len(grasp)) if "squeeze_qpos" in content else grasp,
        joint_names=None if names is None else tuple(str(name) for name in names),
    )


def _row(content: dict[str, Any], name: str, size: int | None) -> NDArray[np.float64]:
    return numbers(np.ravel(content[name]), f"{name} of the DexGraspBench sample", (size,))


def _read_hand(content: Any, hand: Hand) -> HandGrasps:
    """The grasp of a sample, in the frame of its object."""
    sample = read_dexgraspbench(content)
    names = sample.joint_names or hand.joint_names
    if len(sample.grasp) != 7 + len(names) or set(names) != set(hand.joint_names):
        raise FormatError(
            f"The sample's hand has {len(sample.grasp) - 7} joints; {hand.name} has {len(hand.joint_names)}: "
            f"{', '.join(hand.joint_names)}."
        )
    joints = dict(zip(names, sample.grasp[7:], strict=True))
    world_from_object, world_from_palm = (
        pose_matrix(rotation_from_wxyz(pose[3:7]), pose[:3]) for pose in (sample.object_pose, sample.grasp)
    )
    pose = HandPose(
        np.linalg.inv(world_from_object) @ world_from_palm, np.array([joints[name] for name in hand.joint_names])
    )
    return HandGrasps(hand, sample.object_scale, (HandGrasp("sample", pose),))


def _write(export: Export) -> dict[str, Any]:
    """One grasp; the object stands in the world's origin, so the world frame is the object frame.

    Where a pre-grasp is known it begins the approach, and the hand opened as for it, but at the grasp's palm, is
    ``pregrasp_qpos``: DexGraspBench moves the palm first and closes then.
    """
    (best,) = export.grasps
    sample = {
        "obj_pose": np.array(_OBJECT_POSE),
        "obj_scale": 1.0,
        "obj_path": export.object_name,
        "pregrasp_qpos": best.opened.qpos,
        "grasp_qpos": best.pose.qpos,
        "squeeze_qpos": best.squeeze.qpos,
        "joint_names": list(export.hand.joint_names),
        "fingersplit": export.origin,
    }
    if best.pregrasp is not None:
        sample["approach_qpos"] = np.stack([best.pregrasp.qpos, best.opened.qpos])
    return sample


DEXGRASPBENCH = FileFormat(
    "dexgraspbench", "DexGraspBench sample .npy", "npy", _recognises, read_hand=_read_hand, write=_write, one_grasp=True
)
