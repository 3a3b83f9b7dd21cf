"""Triangles out of a mesh file: trimesh parses what the header checks let through."""

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake.header_checks import check_obj, check_off, check_stl, malformed
from fingersplit.objects.intake.header_checks_glb import check_glb
from fingersplit.objects.intake.header_checks_ply import check_ply

__all__ = ["CHECKS", "parse"]

CHECKS: dict[str, Callable[[bytes], bytes]] = {
    "stl": check_stl,
    "obj": check_obj,
    "ply": check_ply,
    "off": check_off,
    "glb": check_glb,
}
"""Check of each file type, by its suffix; it returns the bytes that trimesh may see."""


def parse(data: bytes, file_type: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Parse a mesh file.

    Args:
        data: The file's bytes.
        file_type: Key of `CHECKS`.

    Returns:
        Vertices in the file's unit (n_vertices, 3) and faces (n_faces, 3), polygons split into triangles; nothing
        is merged, turned or dropped.

    Raises:
        ObjectFileError: The file is empty, broken or cut off, or holds no or too many faces.
    """
    if not data or data.isspace():
        raise ObjectFileError(
            "empty", f"The file is empty ({len(data)} bytes); it should hold a mesh as {file_type.upper()}."
        )
    try:
        vertices, faces = _load(CHECKS[file_type](data), file_type)
    except ObjectFileError:
        raise
    except MemoryError as error:
        raise ObjectFileError(
            "too_many_faces", "The mesh takes more memory than there is; simplify it first."
        ) from error
    except Exception as error:
        # On broken files json, numpy and trimesh's loaders raise anything from KeyError and AssertionError to
        # RecursionError; whichever it is, the file is at fault.
        what = f"The {file_type.upper()} file cannot be read ({type(error).__name__}: {error!s:.200})."
        raise malformed(what) from error
    if not len(faces):
        raise ObjectFileError("no_faces", "The file has no face; a surface is needed.")
    wrong = (faces < 0) | (faces >= len(vertices))
    if wrong.any():
        raise ObjectFileError(
            "index_out_of_range",
            f"A face names vertex {faces[wrong][0]}, but the file has {len(vertices):,} vertices; "
            f"indices go from 0 to {len(vertices) - 1}.",
        )
    return vertices, faces


def _load(data: bytes, file_type: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """All meshes of the scene in the file, placed by their nodes; there is no resolver, so no other file is read."""
    options = {"process": False, "skip_materials": True, "maintain_order": True}
    with np.errstate(all="ignore"):  # numbers that are not finite are named later
        scene = trimesh.load_scene(io.BytesIO(data), file_type=file_type, **options)
        meshes = [each for each in scene.dump() if isinstance(each, trimesh.Trimesh)]
    vertices, faces = trimesh.util.append_faces([each.vertices for each in meshes], [each.faces for each in meshes])
    return np.asarray(vertices, dtype=np.float64).reshape(-1, 3), np.asarray(faces, dtype=np.int64).reshape(-1, 3)
