"""Files of other tools: their grasps read, ours written; one module a format, and nothing else lists them."""

from fingersplit.formats.hand_grasps import grasp_at
from fingersplit.formats.importing import import_parallel_grasps, read_hand_grasps
from fingersplit.formats.registry import available_formats, formats_that
from fingersplit.formats.writing import ExportedFile, export, export_file

__all__ = [
    "ExportedFile",
    "available_formats",
    "export",
    "export_file",
    "formats_that",
    "grasp_at",
    "import_parallel_grasps",
    "read_hand_grasps",
]
