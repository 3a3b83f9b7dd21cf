"""Parallel grasps of objects: what planning starts from, found by the service or brought along."""

import os
from collections.abc import Sequence
from typing import BinaryIO, Generic

from pydantic import TypeAdapter

from fingersplit_client._exchange import dump, given, parse, parse_list, quoted
from fingersplit_client._flow import Flow, Work
from fingersplit_client.mesh_files import MeshFile, read_file
from fingersplit_client.modes import Mode, operation
from fingersplit_client.resources.objects import object_path
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import (
    GraspFormat,
    ImportedGraspSet,
    ParallelGrasp,
    ParallelGraspsCreate,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
)

__all__ = ["ParallelGrasps"]

_SETS = TypeAdapter(list[ParallelGraspSetInfo])


class ParallelGrasps(Resource[Mode], Generic[Mode]):
    """Sets of parallel grasps of an object."""

    @operation
    def generate(self, object_id: str, request: ParallelGraspsGenerate | None = None) -> Flow[ParallelGraspSet]:
        """Have parallel grasps of an object found and stored as a set, by default for the default hand."""
        body = dump(request or ParallelGraspsGenerate())
        response = yield from self._exchange("POST", f"{_sets(object_id)}/generate", json=body)
        return parse(ParallelGraspSet, response)

    @operation
    def create(self, object_id: str, grasps: Sequence[ParallelGrasp], *, name: str = "") -> Flow[ParallelGraspSet]:
        """Store parallel grasps that were found elsewhere as a set."""
        body = dump(ParallelGraspsCreate(parallel_grasps=[*grasps], name=name))
        response = yield from self._exchange("POST", _sets(object_id), json=body)
        return parse(ParallelGraspSet, response)

    @operation
    def import_file(
        self,
        object_id: str,
        file: "os.PathLike[str] | str | bytes | BinaryIO",
        *,
        file_format: GraspFormat | None = None,
        gripper: str | None = None,
        scale: float | None = None,
        name: str = "",
    ) -> Flow[ImportedGraspSet]:
        """Store the parallel grasps in a file that another tool wrote, or in the bytes of one; the best 1024 of them.

        Its content tells the format unless ``file_format`` does, and the gripper unless ``gripper`` does; its name that
        of the set unless ``name`` does. ``scale`` is the factor from its lengths to metres.
        """
        found: MeshFile = yield Work(lambda: read_file(file, "grasps"))
        response = yield from self._exchange(
            "POST",
            f"{_sets(object_id)}/import",
            data=given(name=name, format=file_format, gripper=gripper, scale=scale),
            files={"file": (found.filename, found.content, "application/octet-stream")},
        )
        return parse(ImportedGraspSet, response)

    @operation
    def list(self, object_id: str) -> "Flow[list[ParallelGraspSetInfo]]":
        """The sets of parallel grasps of an object, newest first."""
        response = yield from self._exchange("GET", _sets(object_id))
        return parse_list(_SETS, response)

    @operation
    def get(self, object_id: str, set_id: str) -> Flow[ParallelGraspSet]:
        """One set of parallel grasps."""
        response = yield from self._exchange("GET", f"{_sets(object_id)}/{quoted(set_id)}")
        return parse(ParallelGraspSet, response)

    @operation
    def delete(self, object_id: str, set_id: str) -> Flow[None]:
        """Delete a set of parallel grasps."""
        yield from self._exchange("DELETE", f"{_sets(object_id)}/{quoted(set_id)}")


def _sets(object_id: str) -> str:
    return f"{object_path(object_id)}/parallel-grasps"
