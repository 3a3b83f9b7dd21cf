"""Isaac grasp files: YAML with one gripper, one object and a list of named grasps, read and written.

Three programs write them: the grasp editor (``object_frame_link``, ``gripper_frame_link``), the one of Isaac ROS
(``object_frame``, ``gripper_frame``), and GraspGen's data generation (``format_version`` as a text, the object's scale,
grasps that may have joints before the grasp only).
"""

import re
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError
from fingersplit.formats.exporting import Export
from fingersplit.formats.fields import check_count, numbers, one_scale
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.formats.grippers import JawPoses, gripper_of
from fingersplit.formats.hand_grasps import HandGrasp, HandGrasps
from fingersplit.grasp import HandPose
from fingersplit.hands.hand import Hand
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["ISAAC_GRASP", "IsaacGrasp", "IsaacGraspFile", "read_isaac_grasp"]

FORMAT, VERSION = "isaac_grasp", 1.0
_KNOWN = re.compile(r"\s*v?1(\.\d+)*\s*")
"""Versions that are read: all of the first, as a number or as a text."""


@dataclass(frozen=True, eq=False)
class IsaacGrasp:
    """One grasp of an Isaac grasp file.

    Attributes:
        name: Its key.
        confidence: 0 to 1; 1 where the file does not say.
        object_from_gripper: Pose of the gripper frame in the object frame, (4, 4).
        joints: Joint positions by name at the grasp [rad] or [m]; empty where the file does not say.
        pregrasp_joints: The same before it.
    """

    name: str
    confidence: float
    object_from_gripper: NDArray[np.float64]
    joints: dict[str, float]
    pregrasp_joints: dict[str, float]


@dataclass(frozen=True, eq=False)
class IsaacGraspFile:
    """An Isaac grasp file.

    Attributes:
        object_frame: Name of the object's frame.
        gripper_frame: Name of the gripper's frame.
        gripper_file: Name of the gripper's model without folder and ending, empty where the file does not say.
        object_scale: Factor on the object's mesh, 1 where the file does not say.
        grasps: The grasps in the order of the file.
    """

    object_frame: str
    gripper_frame: str
    gripper_file: str
    object_scale: float
    grasps: tuple[IsaacGrasp, ...]


def read_isaac_grasp(document: Any) -> IsaacGraspFile:
    """The parsed YAML of an Isaac grasp file; one that does not say its version is taken for one of the first.

    Raises:
        FormatError: Another format or version, or a grasp that lacks its pose.
    """
    if not _recognises(document):
        raise FormatError(f"An Isaac grasp file says 'format: {FORMAT}'; this one does not.")
    version = str(document.get("format_version", VERSION))
    if not _KNOWN.fullmatch(version):
        raise FormatError(f"The file has format_version {version}; known: {VERSION}.")
    grasps = document.get("grasps")
    if not isinstance(grasps, dict) or not grasps:
        raise FormatError("The Isaac grasp file lists no grasps under 'grasps'.")
    check_count(len(grasps))
    return IsaacGraspFile(
        object_frame=str(document.get("object_frame_link") or document.get("object_frame") or ""),
        gripper_frame=str(document.get("gripper_frame_link") or document.get("gripper_frame") or ""),
        gripper_file=PurePosixPath(str(document.get("gripper_file") or "")).stem,
        object_scale=one_scale(document.get("object_scale"), "object_scale"),
        grasps=tuple(_read_grasp(str(name), grasp) for name, grasp in grasps.items()),
    )


def _recognises(document: Any) -> bool:
    return isinstance(document, dict) and document.get("format") == FORMAT


def _read_grasp(name: str, grasp: Any) -> IsaacGrasp:
    try:
        position, orientation = grasp["position"], grasp["orientation"]
        w, xyz = orientation["w"], orientation["xyz"]
    except (TypeError, KeyError, IndexError) as error:
        raise FormatError(
            f"{name} of the Isaac grasp file needs position [x, y, z] and orientation {{w, xyz}}."
        ) from error
    wxyz = np.concatenate([[numbers(w, f"w of {name}", ())], numbers(xyz, f"xyz of {name}", (3,))])
    if not wxyz.any():
        raise FormatError(f"orientation of {name} is zero; it must be a quaternion.")
    confidence = grasp.get("confidence")
    return IsaacGrasp(
        name=name,
        confidence=1.0 if confidence is None else float(numbers(confidence, f"confidence of {name}", ())),
        object_from_gripper=pose_matrix(rotation_from_wxyz(wxyz), numbers(position, f"position of {name}", (3,))),
        joints=_joints(grasp, "cspace_position", name),
        pregrasp_joints=_joints(grasp, "pregrasp_cspace_position", name),
    )


def _joints(grasp: Any, field: str, name: str) -> dict[str, float]:
    joints = grasp.get(field) or {}
    if not isinstance(joints, dict):
        raise FormatError(f"{field} of {name} must be joint positions by name.")
    return {str(joint): float(numbers(value, f"{joint} of {name}", ())) for joint, value in joints.items()}


def _read_parallel(document: Any, request: Request) -> JawPoses:
    """Poses of the gripper in the object frame, opened fully, best confidence first; z approaches, y closes."""
    file = read_isaac_grasp(document)
    gripper = gripper_of(file.gripper_frame.rsplit("/", 1)[-1] or file.gripper_file, request.gripper)
    if gripper is None:
        raise FormatError(
            "The file does not name its gripper, by gripper_frame_link or gripper_frame; say which it is."
        )
    hint = f"Poses are in the frame {file.object_frame!r}, which must be the mesh's."
    if file.object_scale != 1.0:
        hint += f" The file says that the mesh has a scale of {file.object_scale:g}."
    return JawPoses.of_gripper(
        gripper,
        np.array([grasp.object_from_gripper for grasp in file.grasps]),
        np.array([max(grasp.confidence, 0.0) for grasp in file.grasps]),
        closing=1,
        scale=request.scale,
        hint=hint,
    )


def _read_hand(document: Any, hand: Hand) -> HandGrasps:
    file, grasps = read_isaac_grasp(document), []
    for grasp in file.grasps:
        missing = sorted(set(hand.joint_names) - set(grasp.joints))
        if missing:
            raise FormatError(
                f"cspace_position of {grasp.name} does not say where joint {missing[0]!r} of {hand.name} stands."
            )
        joints = np.array([grasp.joints[name] for name in hand.joint_names])
        grasps.append(HandGrasp(grasp.name, HandPose(grasp.object_from_gripper, joints)))
    return HandGrasps(hand, file.object_scale, tuple(grasps))


def _write(export: Export) -> dict[str, Any]:
    """One entry a grasp; what the format has no place for stands under ``fingersplit``."""
    hand = export.hand
    return {
        "format": FORMAT,
        "format_version": VERSION,
        "object_frame_link": export.object_name,
        "gripper_frame_link": hand.palm,
        "grasps": {
            f"grasp_{index}": {
                "confidence": grasp.quality,
                "position": grasp.pose.position.tolist(),
                "orientation": {"w": float(grasp.pose.wxyz[0]), "xyz": grasp.pose.wxyz[1:].tolist()},
                "cspace_position": hand.named(grasp.pose.joints),
                "pregrasp_cspace_position": hand.named(grasp.opened.joints),
            }
            for index, grasp in enumerate(export.grasps)
        },
        "fingersplit": export.origin,
    }


ISAAC_GRASP = FileFormat(
    "isaac_grasp",
    "Isaac grasp YAML",
    "yaml",
    _recognises,
    read_parallel=_read_parallel,
    read_hand=_read_hand,
    write=_write,
)
