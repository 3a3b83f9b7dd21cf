"""Intake: a file's bytes become a clean surface or a point cloud in metres, or a refusal that names the fault."""

from fingersplit.objects.intake.promises import MOST_FACES
from fingersplit.objects.intake.reading import load_mesh, read_mesh
from fingersplit.objects.intake.reading_clouds import FORMATS, load_object, read_cloud, read_object
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.intake.units import LARGEST_EXTENT, SMALLEST_EXTENT, UNITS

__all__ = [
    "FORMATS",
    "LARGEST_EXTENT",
    "MOST_FACES",
    "SMALLEST_EXTENT",
    "UNITS",
    "CloudReport",
    "IntakeReport",
    "load_mesh",
    "load_object",
    "read_cloud",
    "read_mesh",
    "read_object",
]
