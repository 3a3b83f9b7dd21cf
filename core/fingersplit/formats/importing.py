"""From a file of any known format to parallel grasps on the object, or to grasps of a hand."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fingersplit.errors import FormatError, ParallelGraspError, SettingsError
from fingersplit.formats.containers import opened
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.formats.grippers import JawPoses, gripper_called
from fingersplit.formats.hand_grasps import HandGrasps
from fingersplit.formats.registry import formats_that, known_format
from fingersplit.hands.hand import load_hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.closing_kernel import close_jaws
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps

__all__ = ["ImportedGrasps", "import_parallel_grasps", "read_hand_grasps"]
FAR = 5.0
"""Median distance of grasps from an object, in its largest extents, from which on their lengths are doubted."""


@dataclass(frozen=True, eq=False)
class ImportedGrasps:
    """What a file held.

    Attributes:
        format: Name of its format.
        title: The same for people.
        listed: Grasps in the file.
        promising: Those that the file does not say to fail.
        grasps: Those of them whose contacts were found, best first.
    """

    format: str
    title: str
    listed: int
    promising: int
    grasps: ParallelGrasps

    @property
    def message(self) -> str:
        """The import in a sentence."""
        failed = self.listed - self.promising
        left_out = f", {failed} of which failed by its own account" if failed else ""
        return (
            f"{self.title} with {self.listed} grasps{left_out}; "
            f"contacts were found for {len(self.grasps)} of {self.promising}."
        )


def import_parallel_grasps(
    path: Path,
    model: ObjectModel,
    format: str | None = None,  # noqa: A002
    *,
    gripper: str | None = None,
    scale: float = 1.0,
) -> ImportedGrasps:
    """Read parallel grasps of an object; where a format gives grippers, their jaws are closed on the mesh.

    Args:
        path: The file.
        model: The object, in the frame that the file means.
        format: Name of a format whose ``read_parallel`` is known; None to go by the file's content.
        gripper: Name of the gripper (``grippers.GRIPPERS``) that the grasps are for; None to go by what the file says.
        scale: Factor from the file's lengths to metres, above 0.

    Raises:
        FormatError: Unknown format or gripper, a file that is not what it should be, or no grasp of it that meets
            the object.
        SettingsError: A scale that is no positive number.
    """
    known = formats_that("read_parallel")
    chosen = None if format is None else known_format(format, known)
    if not (np.isfinite(scale) and scale > 0.0):
        raise SettingsError(f"The scale of the grasps is {scale!r}; it must be above 0.")
    request = Request(model.name, None if gripper is None else gripper_called(gripper), scale)
    with opened(path) as (container, content):
        chosen = chosen or _recognise(path, container, content, known)
        if not _holds(container, chosen):
            raise FormatError(f"{path} is a file of kind {container}; {chosen.title} needs {chosen.container}.")
        assert chosen.read_parallel is not None
        try:
            found = chosen.read_parallel(content, request)
        except (FormatError, ParallelGraspError) as error:
            raise FormatError(f"{path}: {error}") from error
        except (AttributeError, KeyError, IndexError, TypeError, OSError, RuntimeError) as error:
            raise FormatError(f"{path} is no complete {chosen.title} file: {_missing(error)}.") from error
    if isinstance(found, ParallelGrasps):
        return ImportedGrasps(chosen.name, chosen.title, len(found), len(found), found)
    return _closed(path, chosen, model, found)


_TEXTS = {"json", "yaml"}


def _holds(container: str, one: FileFormat) -> bool:
    """Whether a file of that kind may hold a format; JSON and YAML hold the same documents."""
    return one.container == container or {one.container, container} <= _TEXTS


def _missing(error: Exception) -> str:
    if isinstance(error, KeyError) and error.args and isinstance(error.args[0], str):
        return f"{error.args[0]} is missing"
    return "what should list its grasps is built otherwise"


def _recognise(path: Path, container: str, content: Any, known: dict[str, FileFormat]) -> FileFormat:
    for one in known.values():
        if _holds(container, one) and one.recognises(content):
            return one
    titles = ", ".join(one.title for one in known.values())
    raise FormatError(f"{path} holds parallel grasps in no known format; known: {titles}.")


def _closed(path: Path, chosen: FileFormat, model: ObjectModel, poses: JawPoses) -> ImportedGrasps:
    order = np.argsort(-poses.scores, kind="stable")
    order = order[poses.scores[order] >= 0]
    if not len(order):
        raise FormatError(f"{path}: all {len(poses.scores)} grasps of the file failed by its own account.")
    centers, axes, approaches, openings, pads = (
        np.ascontiguousarray(array[order])
        for array in (poses.centers, poses.axes, poses.approaches, poses.openings, poses.pads)
    )
    contacts = np.zeros((len(order), 2, 3))
    touched = close_jaws(model.triangles, centers, axes, approaches, openings, pads, contacts)
    if not touched.any():
        sides = ", ".join(f"{1e3 * side:.0f}" for side in model.mesh.extents)
        refusal = f"{path}: none of {len(order)} grasps closes on the object, whose sides are {sides} mm."
        away = float(np.median(np.linalg.norm(centers - model.center_of_mass, axis=1)))
        given, wanted = model.source.scale, poses.object_scale
        if wanted != 1.0:
            refusal += " The grasps belong to the mesh times the file's object scale: "
            scaled = math.isclose(given, wanted, rel_tol=1e-3)
            refusal += f"{wanted}, which it was given." if scaled else f"give the mesh a scale of {wanted}."
        elif away > FAR * float(model.mesh.extents.max()) and "scale" not in poses.hint:
            refusal += f" They stand {away:.3g} m from its middle: their lengths, or the mesh, may need a scale."
        raise FormatError(f"{refusal} {poses.hint}".rstrip())
    grasps = ParallelGrasps(contacts[touched], approaches[touched])
    return ImportedGrasps(chosen.name, chosen.title, len(poses.scores), len(order), grasps)


def read_hand_grasps(path: Path, hand: str) -> HandGrasps:
    """Read a file of any format that lists grasps of multi-fingered hands; its content says which it is.

    Args:
        path: The file.
        hand: Name of the hand, for files that do not say.

    Raises:
        FormatError: A file of another format, or of another hand.
        UnknownHandError: No such hand.
    """
    known, chosen = load_hand(hand), formats_that("read_hand")
    with opened(path) as (container, content):
        for one in chosen.values():
            if _holds(container, one) and one.recognises(content):
                assert one.read_hand is not None
                return one.read_hand(content, known)
    titles = ", ".join(one.title for one in chosen.values())
    raise FormatError(f"{path.name} holds grasps of hands in no known format; known: {titles}.")
