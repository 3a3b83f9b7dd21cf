"""Grasps in the formats of other tools: a result document becomes their file, and their file becomes grasps."""

from fingersplit.formats.export import EXPORT_FORMATS, ExportFormat, export

__all__ = ["EXPORT_FORMATS", "ExportFormat", "export"]
