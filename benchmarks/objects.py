"""The objects that benchmarks run on."""

import os
from collections.abc import Callable
from pathlib import Path

from fingersplit.objects.intake import load_mesh
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS

MESH_SUFFIXES = {".glb", ".obj", ".off", ".ply", ".stl"}


def benchmark_objects(folder: Path | None) -> dict[str, Callable[[], Mesh]]:
    """Loaders by object name: the meshes [m] of a folder, else our own parametric objects.

    Without ``folder``, ``FINGERSPLIT_OBJECTS`` or a folder ``shared/objects`` beside the repository is used when there.
    """
    beside = Path(__file__).parents[2] / "shared" / "objects"
    folder = folder or Path(os.environ.get("FINGERSPLIT_OBJECTS", beside))
    files = sorted(path for path in folder.glob("*") if path.suffix in MESH_SUFFIXES) if folder.is_dir() else []
    if files:
        return {path.stem: lambda path=path: load_mesh(path)[0] for path in files}
    return dict(PARAMETRIC_OBJECTS)
