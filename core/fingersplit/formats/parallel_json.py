"""Our own JSON: contacts and approach as they are, in the object frame."""

from typing import Any

from fingersplit.formats.fields import check_count
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp

__all__ = ["PARALLEL_JSON"]


def _recognises(document: Any) -> bool:
    """Whether this is ``{"contacts": ..., "approach": ...}`` or a list of them."""
    first = document[0] if isinstance(document, list) and document else document
    return document == [] or (isinstance(first, dict) and ("contacts" in first or "approach" in first))


def _read(document: Any, request: Request) -> ParallelGrasps:
    """The grasps of such a document, in its order."""
    documents = document if isinstance(document, list) else [document]
    check_count(len(documents))
    grasps = ParallelGrasps.from_grasps(ParallelGrasp.from_document(entry) for entry in documents)
    return ParallelGrasps(request.scale * grasps.contacts, grasps.approaches)


PARALLEL_JSON = FileFormat("fingersplit", "Fingersplit JSON", "json", _recognises, read_parallel=_read)
