"""From any object's file to a mesh or a cloud."""

from pathlib import Path

from fingersplit.errors import ObjectFileError
from fingersplit.objects.cloud import PointCloud
from fingersplit.objects.intake.cloud_parsing import CLOUD_FORMATS, holds_cloud
from fingersplit.objects.intake.content import checked_content
from fingersplit.objects.intake.parsing import MESH_FORMATS
from fingersplit.objects.intake.reading import read_mesh
from fingersplit.objects.intake.reading_clouds import read_cloud
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.source import ObjectSource

__all__ = ["FORMATS", "read_bytes", "read_file"]

FORMATS = tuple(dict.fromkeys([*MESH_FORMATS, *CLOUD_FORMATS]))
"""Suffixes of all files that can be read."""


def read_file(
    path: Path, source: ObjectSource | None = None
) -> tuple[Mesh, IntakeReport] | tuple[PointCloud, CloudReport]:
    """Read the file of a mesh or a point cloud, whose suffix tells the format; see `read_bytes`.

    Raises:
        ObjectFileError: As `read_bytes`, and ``unreadable`` where the file cannot be opened.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ObjectFileError("unreadable", f"Cannot read {str(path)!r}: {error.strerror}.") from error
    return read_bytes(data, path.suffix, source)


def read_bytes(
    data: bytes, file_type: str, source: ObjectSource | None = None
) -> tuple[Mesh, IntakeReport] | tuple[PointCloud, CloudReport]:
    """Turn a file into a clean surface or a point cloud.

    Args:
        data: The file's bytes.
        file_type: Format, with or without a leading dot: one of `FORMATS`. A PLY file without faces is a cloud.
        source: Unit, scale and viewpoint; None for metres and the viewpoint that the file names.

    Returns:
        The mesh or the cloud in metres, and what was found and done.

    Raises:
        ObjectFileError: The file, or what it holds, is no graspable object, or a viewpoint is given for a mesh.
    """
    source = source or ObjectSource()
    name = file_type.lower().removeprefix(".")
    if not name:
        raise ObjectFileError(
            "unknown_format",
            f"The file's name has no suffix, which tells its format; known formats: {', '.join(FORMATS)}.",
        )
    if name not in FORMATS:
        raise ObjectFileError("unknown_format", f"Unknown format {file_type!r}; known formats: {', '.join(FORMATS)}.")
    data = checked_content(data, name)
    if holds_cloud(data, name):
        return read_cloud(data, name, source)
    if source.viewpoint is not None:
        raise ObjectFileError("needless_viewpoint", "A viewpoint belongs to a point cloud, but the file holds a mesh.")
    return read_mesh(data, name, source)
