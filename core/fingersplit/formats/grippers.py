"""Parallel grippers whose poses files list: which are known, and what an open one is before its jaws close."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError, suggestion

__all__ = ["GRIPPERS", "Gripper", "JawPoses", "gripper_called", "gripper_of"]


@dataclass(frozen=True)
class Gripper:
    """A parallel gripper; the z axis of its frame is the approach.

    Attributes:
        name: What requests call it.
        words: A name in a file that contains one of these means it, lower case.
        opening: Distance of its open pads [m].
        depth: From its frame to the middle of the pads, along the approach [m].
        pads: Lateral width of the pads and their length along the approach [m].
    """

    name: str
    words: tuple[str, ...]
    opening: float
    depth: float
    pads: tuple[float, float]


GRIPPERS = {
    gripper.name: gripper
    for gripper in (Gripper("panda", ("panda", "franka", "fr3"), opening=0.08, depth=0.103, pads=(0.018, 0.018)),)
}
"""Every gripper that is known here, by name; the hands of Panda and FR3 are the same."""


def gripper_called(name: str) -> Gripper:
    """The gripper that a request names.

    Raises:
        FormatError: It is not known.
    """
    if name not in GRIPPERS:
        raise FormatError(f"Unknown gripper {name!r}; {suggestion(name, GRIPPERS)}")
    return GRIPPERS[name]


def gripper_of(named: object, chosen: Gripper | None) -> Gripper | None:
    """The gripper of a file: the chosen one, else the one that the file names; None when neither says.

    Raises:
        FormatError: The file names one that is not known here.
    """
    if chosen is not None or named in (None, ""):
        return chosen
    text = str(named).lower()
    for gripper in GRIPPERS.values():
        if any(word in text for word in gripper.words):
            return gripper
    raise FormatError(
        f"The grasps are for the gripper {named!r}, whose jaws are not known here; known: {', '.join(GRIPPERS)}. If it "
        f"is one of these under another name, say which."
    )


@dataclass(frozen=True, eq=False)
class JawPoses:
    """Open grippers about the object, in its frame.

    Attributes:
        centers: Midway between the open pads, (n, 3) [m].
        axes: Unit direction along which the jaws close, (n, 3).
        approaches: Unit direction of travel towards the object, (n, 3).
        openings: Distance of the open pads, (n,) [m].
        pads: Lateral width of the pads and their length along the approach, (n, 2) [m].
        scores: Larger is better, (n,); below zero for a grasp that is known to fail.
        hint: What to check when no jaw meets the object, a sentence.
        object_scale: What the mesh has to be multiplied by for the grasps to be of it.
    """

    centers: NDArray[np.float64]
    axes: NDArray[np.float64]
    approaches: NDArray[np.float64]
    openings: NDArray[np.float64]
    pads: NDArray[np.float64]
    scores: NDArray[np.float64]
    hint: str = ""
    object_scale: float = 1.0

    @classmethod
    def of_gripper(
        cls,
        gripper: Gripper,
        object_from_gripper: NDArray[np.float64],
        scores: NDArray[np.float64],
        *,
        closing: int,
        opening: float | None = None,
        scale: float = 1.0,
        hint: str = "",
        object_scale: float = 1.0,
    ) -> Self:
        """Grippers at poses (n, 4, 4) whose jaws close along column ``closing`` of their frame.

        Args:
            gripper: The gripper.
            object_from_gripper: Poses, positions in the file's lengths.
            scores: As the attribute.
            closing: Column of the rotation along which the jaws close.
            opening: Distance of the open pads [m]; None for the gripper's.
            scale: Factor from the file's lengths to metres.
            hint: As the attribute.
            object_scale: As the attribute.
        """
        count, rotations = len(object_from_gripper), object_from_gripper[:, :3, :3]
        return cls(
            centers=scale * object_from_gripper[:, :3, 3] + gripper.depth * rotations[:, :, 2],
            axes=rotations[:, :, closing],
            approaches=rotations[:, :, 2],
            openings=np.full(count, gripper.opening if opening is None else opening),
            pads=np.tile(gripper.pads, (count, 1)),
            scores=scores,
            hint=hint,
            object_scale=object_scale,
        )
