"""Isaac grasp files: YAML with one gripper, one object and a list of named grasps, read and written."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from fingersplit.errors import ExchangeError
from fingersplit.formats.results import Results
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["IsaacGrasp", "IsaacGraspFile", "read_isaac_grasp", "write_isaac_grasp"]

FORMAT, VERSION = "isaac_grasp", 1.0


@dataclass(frozen=True, eq=False)
class IsaacGrasp:
    """One grasp of an Isaac grasp file.

    Attributes:
        name: Its key.
        confidence: 0 to 1.
        object_from_gripper: Pose of the gripper frame in the object frame, (4, 4).
        joints: Joint positions by name at the grasp [rad] or [m].
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
        grasps: The grasps in the order of the file.
    """

    object_frame: str
    gripper_frame: str
    grasps: tuple[IsaacGrasp, ...]


def write_isaac_grasp(results: Results) -> bytes:
    """An Isaac grasp file; origin and hash of the hand stand under ``fingersplit``."""
    hand = results.hand
    document = {
        "format": FORMAT,
        "format_version": VERSION,
        "object_frame_link": results.object_name,
        "gripper_frame_link": hand.palm,
        "fingersplit": results.provenance,
        "grasps": {
            f"grasp_{index}": {
                "confidence": grasp.confidence,
                "position": grasp.grasp.position.tolist(),
                "orientation": {"w": float(grasp.grasp.wxyz[0]), "xyz": grasp.grasp.wxyz[1:].tolist()},
                "cspace_position": hand.named(grasp.grasp.joints),
                "pregrasp_cspace_position": hand.named((grasp.pregrasp or grasp.grasp).joints),
            }
            for index, grasp in enumerate(results.grasps)
        },
    }
    return str(yaml.safe_dump(document, sort_keys=False)).encode()


def read_isaac_grasp(data: bytes) -> IsaacGraspFile:
    """Read an Isaac grasp file.

    Raises:
        ExchangeError: Not YAML, another format or version, or a grasp that lacks its pose.
    """
    try:
        document = yaml.safe_load(data)
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise ExchangeError(f"The Isaac grasp file is not YAML: {' '.join(str(error).split())[:200]}.") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ExchangeError(f"An Isaac grasp file starts with 'format: {FORMAT}'; this one does not.")
    if document.get("format_version") != VERSION:
        raise ExchangeError(f"The file has format_version {document.get('format_version')!r}; known: {VERSION}.")
    grasps = document.get("grasps")
    if not isinstance(grasps, dict) or not grasps:
        raise ExchangeError("The Isaac grasp file lists no grasps under 'grasps'.")
    return IsaacGraspFile(
        object_frame=str(document.get("object_frame_link", document.get("object_frame", ""))),
        gripper_frame=str(document.get("gripper_frame_link", document.get("gripper_frame", ""))),
        grasps=tuple(_read_grasp(str(name), grasp) for name, grasp in grasps.items()),
    )


def _read_grasp(name: str, grasp: Any) -> IsaacGrasp:
    try:
        position = np.array(grasp["position"], dtype=np.float64)
        wxyz = np.array([grasp["orientation"]["w"], *grasp["orientation"]["xyz"]], dtype=np.float64)
        if position.shape != (3,) or wxyz.shape != (4,) or not np.isfinite([*position, *wxyz]).all() or not wxyz.any():
            raise ValueError("position or orientation is no pose")
        return IsaacGrasp(
            name=name,
            confidence=float(grasp.get("confidence", 1.0)),
            object_from_gripper=pose_matrix(rotation_from_wxyz(wxyz), position),
            joints={str(joint): float(value) for joint, value in grasp["cspace_position"].items()},
            pregrasp_joints={
                str(joint): float(value) for joint, value in (grasp.get("pregrasp_cspace_position") or {}).items()
            },
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ExchangeError(
            f"{name} of the Isaac grasp file needs position [x, y, z], orientation {{w, xyz}} and cspace_position; "
            f"found: {error!r}."
        ) from error
