"""Intake: a file's bytes become a clean surface or a point cloud in metres, or a refusal that names the fault."""

from fingersplit.objects.intake.files import FORMATS, read_bytes, read_file
from fingersplit.objects.intake.reading import read_mesh
from fingersplit.objects.intake.reading_clouds import read_cloud
from fingersplit.objects.intake.refusals import MAX_FACES
from fingersplit.objects.intake.report import CloudReport, IntakeReport

__all__ = [
    "FORMATS",
    "MAX_FACES",
    "CloudReport",
    "IntakeReport",
    "read_bytes",
    "read_cloud",
    "read_file",
    "read_mesh",
]
