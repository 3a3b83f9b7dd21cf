"""Our own JSON: contacts and approach as they are, in the object frame [m]."""

from typing import Any

from fingersplit.formats.jaw_poses import check_count
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp

__all__ = ["read_own_json", "recognises_own_json"]


def recognises_own_json(document: Any) -> bool:
    """Whether this is ``{"contacts": ..., "approach": ...}`` or a list of them."""
    first = document[0] if isinstance(document, list) and document else document
    return document == [] or (isinstance(first, dict) and ("contacts" in first or "approach" in first))


def read_own_json(document: Any, _object_name: str) -> ParallelGrasps:
    """The grasps of such a document, in its order."""
    documents = document if isinstance(document, list) else [document]
    check_count(len(documents))
    return ParallelGrasps.from_grasps(ParallelGrasp.from_document(entry) for entry in documents)
