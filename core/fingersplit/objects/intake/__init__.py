"""Intake: a file's bytes become a clean surface or a point cloud in metres, or a refusal that names the fault."""

from fingersplit.objects.intake.promises import MAX_FACES
from fingersplit.objects.intake.reading import load_mesh, read_mesh
from fingersplit.objects.intake.reading_clouds import FORMATS, load_object, read_cloud, read_object
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.intake.units import MAX_EXTENT, MIN_EXTENT, UNITS

__all__ = [
    "FORMATS",
    "MAX_EXTENT",
    "MAX_FACES",
    "MIN_EXTENT",
    "UNITS",
    "CloudReport",
    "IntakeReport",
    "load_mesh",
    "load_object",
    "read_cloud",
    "read_mesh",
    "read_object",
]
