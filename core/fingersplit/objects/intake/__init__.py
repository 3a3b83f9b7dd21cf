"""Mesh intake: a file's bytes become a clean surface in metres, or a refusal that names the fault."""

from fingersplit.objects.intake.promises import MOST_FACES
from fingersplit.objects.intake.reading import LARGEST_EXTENT, SMALLEST_EXTENT, UNITS, load_mesh, read_mesh
from fingersplit.objects.intake.report import IntakeReport

__all__ = ["LARGEST_EXTENT", "MOST_FACES", "SMALLEST_EXTENT", "UNITS", "IntakeReport", "load_mesh", "read_mesh"]
