"""From a file of any known format to parallel grasps on the object: one line a format."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fingersplit.errors import ParallelGraspError
from fingersplit.formats.acronym import (
    read_acronym,
    read_graspgen,
    recognises_acronym,
    recognises_graspgen,
)
from fingersplit.formats.containers import opened
from fingersplit.formats.dexnet import (
    read_dexnet,
    read_dexnet_service,
    recognises_dexnet,
    recognises_dexnet_service,
)
from fingersplit.formats.graspnet import read_graspnet, recognises_graspnet
from fingersplit.formats.isaac import read_isaac, recognises_isaac
from fingersplit.formats.jaw_poses import JawPoses
from fingersplit.formats.own_json import read_own_json, recognises_own_json
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.closing_kernel import close_jaws
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps

__all__ = ["IMPORT_FORMATS", "ImportFormat", "ImportedGrasps", "import_parallel_grasps"]


@dataclass(frozen=True)
class ImportFormat:
    """A format that parallel grasps can be read from.

    Attributes:
        title: What it is, for people.
        container: Kind of file: ``json``, ``yaml``, ``hdf5`` or ``npy``.
        recognises: Whether a file's content is of this format.
        read: From the content and the object's name to grasps, or to grippers that have yet to close.
    """

    title: str
    container: str
    recognises: Callable[[Any], bool]
    read: Callable[[Any, str], JawPoses | ParallelGrasps]


IMPORT_FORMATS: dict[str, ImportFormat] = {
    "fingersplit": ImportFormat("Fingersplit JSON", "json", recognises_own_json, read_own_json),
    "dexnet": ImportFormat("Dex-Net HDF5", "hdf5", recognises_dexnet, read_dexnet),
    "dexnet_service": ImportFormat("Dex-Net as a service JSON", "json", recognises_dexnet_service, read_dexnet_service),
    "acronym": ImportFormat("ACRONYM HDF5", "hdf5", recognises_acronym, read_acronym),
    "graspgen": ImportFormat("GraspGen JSON", "json", recognises_graspgen, read_graspgen),
    "isaac_grasp": ImportFormat("Isaac grasp YAML", "yaml", recognises_isaac, read_isaac),
    "graspnet": ImportFormat("graspnetAPI .npy", "npy", recognises_graspnet, read_graspnet),
}


@dataclass(frozen=True, eq=False)
class ImportedGrasps:
    """What a file held.

    Attributes:
        format: Key of ``IMPORT_FORMATS``.
        listed: Grasps in the file.
        promising: Those that the file does not say to fail.
        grasps: Those of them whose contacts were found, best first.
    """

    format: str
    listed: int
    promising: int
    grasps: ParallelGrasps

    @property
    def message(self) -> str:
        """The import in a sentence."""
        failed = self.listed - self.promising
        left_out = f", {failed} of which failed by its own account" if failed else ""
        return (
            f"{IMPORT_FORMATS[self.format].title} with {self.listed} grasps{left_out}; "
            f"contacts were found for {len(self.grasps)} of {self.promising}."
        )


def import_parallel_grasps(path: Path, model: ObjectModel, format: str | None = None) -> ImportedGrasps:  # noqa: A002
    """Read parallel grasps of an object; where a format gives grippers, their jaws are closed on the mesh.

    Args:
        path: The file.
        model: The object, in the frame and scale that the file means.
        format: Key of ``IMPORT_FORMATS``; None to go by the file's content.

    Raises:
        ParallelGraspError: Unknown format, a file that is not what it should be, or no grasp of it meets the object.
    """
    if format is not None and format not in IMPORT_FORMATS:
        raise ParallelGraspError(f"Unknown format {format!r}; known: {', '.join(IMPORT_FORMATS)}.")
    with opened(path) as (container, content):
        name = format or _recognise(path, container, content)
        if IMPORT_FORMATS[name].container != container:
            raise ParallelGraspError(
                f"{path} is a file of kind {container}; {IMPORT_FORMATS[name].title} needs "
                f"{IMPORT_FORMATS[name].container}."
            )
        try:
            found = IMPORT_FORMATS[name].read(content, model.name)
        except ParallelGraspError as error:
            raise ParallelGraspError(f"{path}: {error}") from error
        except (AttributeError, KeyError, TypeError, OSError, RuntimeError) as error:
            raise ParallelGraspError(
                f"{path} is no complete {IMPORT_FORMATS[name].title} file: {error!r} where its grasps are read."
            ) from error
    if isinstance(found, ParallelGrasps):
        return ImportedGrasps(name, len(found), len(found), found)
    return _closed(path, name, model, found)


def _recognise(path: Path, container: str, content: Any) -> str:
    for name, known in IMPORT_FORMATS.items():
        if known.container == container and known.recognises(content):
            return name
    titles = ", ".join(known.title for known in IMPORT_FORMATS.values())
    raise ParallelGraspError(f"{path} holds parallel grasps in no known format; known: {titles}.")


def _closed(path: Path, name: str, model: ObjectModel, poses: JawPoses) -> ImportedGrasps:
    order = np.argsort(-poses.scores, kind="stable")
    order = order[poses.scores[order] >= 0]
    centers, axes, approaches, openings, pads = (
        np.ascontiguousarray(array[order])
        for array in (poses.centers, poses.axes, poses.approaches, poses.openings, poses.pads)
    )
    contacts = np.zeros((len(order), 2, 3))
    touched = close_jaws(model.triangles, centers, axes, approaches, openings, pads, contacts)
    if not touched.any():
        raise ParallelGraspError(
            f"{path}: none of {len(order)} grasps closes on the object, whose sides are "
            f"{', '.join(f'{1e3 * side:.0f}' for side in model.mesh.extents)} mm. {poses.hint}".rstrip()
        )
    return ImportedGrasps(name, len(poses.scores), len(order), ParallelGrasps(contacts[touched], approaches[touched]))
