"""The objects that benchmarks run on."""

import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from fingersplit.objects.intake import read_file
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_bench.suite import BenchError

__all__ = ["benchmark_objects", "corpus_folder", "measured_masses"]

MESH_SUFFIXES = {".glb", ".obj", ".off", ".ply", ".stl"}


def benchmark_objects(folder: Path | None) -> dict[str, Callable[[], Mesh]]:
    """Loaders by object name: the meshes [m] of a folder, else our own parametric objects.

    Without ``folder``, ``FINGERSPLIT_OBJECTS`` or a folder ``shared/objects`` beside the checkout is used when there.

    Raises:
        BenchError: ``folder`` holds no mesh.
    """
    if folder is not None:
        meshes = _meshes(folder)
        if not meshes:
            raise BenchError(f"{folder} holds no mesh; files that are read: {', '.join(sorted(MESH_SUFFIXES))}.")
        return meshes
    return _meshes(_shared_folder()) or dict(PARAMETRIC_OBJECTS)


def corpus_folder(folder: Path | None) -> Path | None:
    """The folder whose files are tried: the given one, else the shared one; None where there is neither."""
    folder = folder or _shared_folder()
    return folder if folder.is_dir() else None


def measured_masses() -> dict[str, float]:
    """Masses [kg] by object name, where a ``manifest.json`` beside the shared meshes has one as ``mass_kg``."""
    manifest = _shared_folder() / "manifest.json"
    if not manifest.exists():
        return {}
    objects = json.loads(manifest.read_text())["objects"]
    return {entry["name"]: float(entry["mass_kg"]) for entry in objects if entry.get("mass_kg")}


def _shared_folder() -> Path:
    beside = Path(__file__).parents[3] / "shared" / "objects"
    return Path(os.environ.get("FINGERSPLIT_OBJECTS", beside))


def _meshes(folder: Path) -> dict[str, Callable[[], Mesh]]:
    files = sorted(path for path in folder.glob("*") if path.suffix in MESH_SUFFIXES)
    return {path.stem: partial(_load, path) for path in files}


def _load(path: Path) -> Mesh:
    shape, _ = read_file(path)
    if not isinstance(shape, Mesh):
        raise BenchError(f"{path} holds a point cloud; the benchmarks need meshes.")
    return shape
