"""Parallel grasps from files of other tools, one module a format."""

from fingersplit.parallel_grasps.importers.importing import IMPORT_FORMATS, ImportedGrasps, import_parallel_grasps

__all__ = ["IMPORT_FORMATS", "ImportedGrasps", "import_parallel_grasps"]
