"""From a file to a prepared object."""

from pathlib import Path

from fingersplit.objects.intake import read_file
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.source import ObjectSource

__all__ = ["load_object"]


def load_object(
    path: str | Path,
    *,
    unit: str = "m",
    scale: float = 1.0,
    viewpoint: tuple[float, float, float] | None = None,
    support: tuple[float, float, float, float] | None = None,
    name: str | None = None,
    options: ObjectOptions | None = None,
) -> ObjectModel:
    """Read the file of a mesh or a point cloud and prepare the object for planning.

    Args:
        path: The file; its suffix tells the format: STL, OBJ, PLY, OFF or GLB, and PLY, PCD or NPZ for clouds.
        unit: Length unit of the file's numbers: m, mm, cm or in.
        scale: Multiplies the file's numbers besides, as data sets give one with their meshes.
        viewpoint: Where the camera stood that saw a point cloud, in the file's frame and unit; None for what the file
            says.
        support: Plane that the object of a cloud stands on, normal on its side and offset along it, in the file's
            frame and unit; the side that one view did not see is then assumed. None for what the file says.
        name: What people call the object; None for the file's name.
        options: Mass, friction and fairing; None for the defaults.

    Raises:
        ObjectFileError: The file, or what it holds, is no graspable object; ``code`` names the fault.
    """
    path, source = Path(path), ObjectSource(unit, scale, viewpoint, support)
    shape, report = read_file(path, source)
    return prepare_object(shape, path.stem if name is None else name, options, source, report)
