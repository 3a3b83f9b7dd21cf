"""From a file's bytes to a `Mesh`, step by step, with the refusals on the way."""

import numpy as np
import trimesh

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake.cleaning import (
    close_cracks,
    drop_needless_faces,
    faces_at_edges,
    merge_vertices,
    turn_outwards,
)
from fingersplit.objects.intake.parsing import MESH_FORMATS, parse
from fingersplit.objects.intake.report import LISTED_HOLES, IntakeReport
from fingersplit.objects.intake.shells import drop_inner_parts, find_holes
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.solid import unmatched_sides
from fingersplit.objects.source import ObjectSource

__all__ = ["read_mesh"]

MIN_MATCHED_SIDES = 0.5
"""Least share of triangle sides that the side of another triangle matches, which runs the other way.

In a closed surface all of them are, in a scan with holes more than 0.99, in a box without its lid 0.87; of triangles
strewn at random hardly any. One half has room on both sides.
"""

_NO_AREA = 1e-12  # of the squared extent
_NO_VOLUME = 1e-9  # of the cubed extent, a thousandth of a needle's
_NO_THICKNESS = 1e-6  # of the extent


def read_mesh(data: bytes, file_type: str, source: ObjectSource | None = None) -> tuple[Mesh, IntakeReport]:
    """Turn a mesh file into a clean surface: repair what has one right answer, refuse the rest.

    Coincident vertices and those on the two sides of a crack are merged, degenerate and duplicate faces and unused
    vertices dropped, faces turned so that they run counter-clockwise seen from outside, and parts inside others
    dropped. Holes are found and left open. The frame stays the file's.

    Args:
        data: The file's bytes.
        file_type: Format, with or without a leading dot: stl, obj, ply, off or glb.
        source: Unit and scale of the file's numbers; None for metres.

    Returns:
        The surface in metres, and what was found and done.

    Raises:
        ObjectFileError: The file, or what it holds, is no graspable object; ``code`` names the fault.
    """
    source = source or ObjectSource()
    file_type = _known_format(file_type)
    vertices, faces = parse(data, file_type)
    with np.errstate(over="ignore"):  # too large is refused next
        surface = trimesh.Trimesh(vertices * source.meters, faces, process=False)
        surface.remove_unreferenced_vertices()
        extent = float(np.ptp(surface.vertices, axis=0).max())
    source.check_extent(extent)
    merged = merge_vertices(surface, extent)
    degenerate, duplicate = drop_needless_faces(surface, extent)
    _check_area(surface.area, extent)
    mesh = Mesh(surface.vertices, surface.faces)
    joined = 0 if mesh.watertight else close_cracks(surface, extent)
    if joined:
        merged += joined
        more = drop_needless_faces(surface, extent)
        degenerate, duplicate = degenerate + more[0], duplicate + more[1]
        mesh = Mesh(surface.vertices, surface.faces)
    mesh, flipped, n_parts = turn_outwards(mesh)
    n_cleaned = len(mesh.vertices)
    mesh, n_inner = drop_inner_parts(mesh)
    holes = find_holes(mesh)
    n_faces_at_edges = faces_at_edges(mesh)
    _check_solid(mesh)
    _check_volume(mesh, extent)
    return mesh, IntakeReport(
        file_type=file_type,
        unit=source.unit,
        scale=source.scale,
        vertices_in_file=len(vertices),
        faces_in_file=len(faces),
        vertices=len(mesh.vertices),
        faces=len(mesh.faces),
        merged_vertices=merged,
        unused_vertices=len(vertices) - merged - n_cleaned,
        degenerate_faces=degenerate,
        duplicate_faces=duplicate,
        flipped_faces=flipped,
        components=n_parts - n_inner,
        inner_parts=n_inner,
        holes=len(holes),
        hole_perimeters=tuple(holes[:LISTED_HOLES].tolist()),
        boundary_edges=int(np.count_nonzero(n_faces_at_edges == 1)),
        nonmanifold_edges=int(np.count_nonzero(n_faces_at_edges > 2)),
        watertight=mesh.watertight,
        area=mesh.area,
        volume=mesh.volume,
        volume_method=mesh.solid.method,
        open_share=mesh.solid.open_share,
    )


def _known_format(name: str) -> str:
    file_type = name.lower().removeprefix(".")
    if file_type not in MESH_FORMATS:
        raise ObjectFileError(
            "unknown_format", f"Unknown mesh format {name!r}; known formats: {', '.join(MESH_FORMATS)}."
        )
    return file_type


def _check_area(area: float, extent: float) -> None:
    if area <= _NO_AREA * extent**2:
        raise ObjectFileError(
            "no_area",
            "The faces have no area: their corners coincide or lie on one line; an object needs a surface.",
        )


def _check_solid(mesh: Mesh) -> None:
    unmatched = 0 if mesh.balanced else unmatched_sides(mesh.faces, len(mesh.vertices))
    matched = 1 - unmatched / (3 * len(mesh.faces))
    if matched < MIN_MATCHED_SIDES:
        raise ObjectFileError(
            "not_solid",
            f"Only {matched:.1%} of the triangle sides are matched by the side of another triangle: these are loose "
            f"triangles, not the surface of a solid, where at least {MIN_MATCHED_SIDES:.0%} are.",
        )


def _check_volume(mesh: Mesh, extent: float) -> None:
    thinnest = np.linalg.eigvalsh(np.cov(mesh.vertices, rowvar=False))[0]
    flat = np.sqrt(max(thinnest, 0.0)) < _NO_THICKNESS * extent
    if flat or mesh.volume < _NO_VOLUME * extent**3:
        raise ObjectFileError("no_volume", "The surface is flat or folded on itself: it encloses no volume to be held.")
