"""Triangles out of a mesh file of any format."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake.content import checked_content, or_other_format
from fingersplit.objects.intake.glb import parse_glb
from fingersplit.objects.intake.obj import parse_obj
from fingersplit.objects.intake.off import parse_off
from fingersplit.objects.intake.ply import parse_ply
from fingersplit.objects.intake.polygons import Polygons, triangulated
from fingersplit.objects.intake.refusals import malformed
from fingersplit.objects.intake.stl import parse_stl

__all__ = ["MESH_FORMATS", "check_finite", "parse"]

MESH_FORMATS: dict[str, Callable[[bytes], tuple[NDArray[np.float64], Polygons]]] = {
    "stl": parse_stl,
    "obj": parse_obj,
    "ply": parse_ply,
    "off": parse_off,
    "glb": parse_glb,
}
"""Parser of each format of meshes, by its suffix."""


def parse(data: bytes, file_type: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Parse a mesh file.

    Args:
        data: The file's bytes.
        file_type: Key of `MESH_FORMATS`.

    Returns:
        Vertices in the file's unit (n_vertices, 3) and faces (n_faces, 3), polygons cut into triangles; nothing is
        merged, turned or dropped.

    Raises:
        ObjectFileError: The file is empty, broken or cut off, or holds no or too many faces.
    """
    try:
        with np.errstate(all="ignore"):  # numbers that are not finite are named later
            vertices, polygons = MESH_FORMATS[file_type](checked_content(data, file_type))
    except ObjectFileError as refusal:
        raise or_other_format(refusal, data, file_type) from refusal.__cause__
    except MemoryError as error:
        raise ObjectFileError("too_many_faces", "The mesh does not fit in memory; simplify it first.") from error
    except Exception as error:
        # On broken files numpy and trimesh's loader raise anything; whichever it is, the file is at fault.
        raise malformed(f"The file does not follow the {file_type.upper()} format.") from error
    if not (polygons.sizes > 2).any():
        raise ObjectFileError("no_faces", "The file has no face; a surface is needed.")
    _check_indices(polygons, len(vertices))
    check_finite(vertices)
    return vertices, triangulated(vertices, polygons)


def _check_indices(polygons: Polygons, n_vertices: int) -> None:
    wrong = np.flatnonzero((polygons.corners < 0) | (polygons.corners >= n_vertices))
    if len(wrong):
        number = int(np.searchsorted(np.cumsum(polygons.sizes), wrong[0], side="right"))
        raise ObjectFileError(
            "index_out_of_range",
            f"{polygons.name(number)} names vertex {polygons.corners[wrong[0]]}, but the file has {n_vertices:,} "
            f"vertices; indices go from 0 to {n_vertices - 1}.",
        )


def check_finite(vertices: NDArray[np.float64]) -> None:
    """Refuse coordinates that are no numbers.

    Raises:
        ObjectFileError: With the first such vertex.
    """
    broken = ~np.isfinite(vertices).all(axis=1)
    if broken.any():
        first = int(np.argmax(broken))
        raise ObjectFileError(
            "non_finite",
            f"{np.count_nonzero(broken):,} of {len(vertices):,} vertices are not finite; the first is number "
            f"{first + 1} with {tuple(vertices[first].tolist())}. Every coordinate must be a number.",
        )
