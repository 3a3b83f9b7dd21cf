"""What mesh intake found and did."""

from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["IntakeReport"]


@dataclass(frozen=True)
class IntakeReport:
    """What intake found in a file and what it did to it.

    Attributes:
        file_type: Format that was read.
        unit: Length unit that the file was taken to be in.
        vertices_in_file: Vertices found.
        faces_in_file: Triangles found, polygons counted as the triangles they were split into.
        vertices: Vertices left.
        faces: Triangles left.
        merged_vertices: Vertices joined with one at the same place.
        unused_vertices: Vertices dropped because no kept face has them.
        degenerate_faces: Faces dropped because they have no area.
        duplicate_faces: Faces dropped because another has the same corners.
        flipped_faces: Faces whose winding was reversed so that all normals point out of the object.
        components: Separate parts of the surface.
        boundary_edges: Edges of holes, with one face only.
        nonmanifold_edges: Edges that more than two faces share.
        watertight: Whether every edge is shared by exactly two faces that agree on the outside.
        area: Surface area [m^2].
        volume: Enclosed volume [m^3]; None where the surface is not watertight.
    """

    file_type: str
    unit: str
    vertices_in_file: int
    faces_in_file: int
    vertices: int
    faces: int
    merged_vertices: int
    unused_vertices: int
    degenerate_faces: int
    duplicate_faces: int
    flipped_faces: int
    components: int
    boundary_edges: int
    nonmanifold_edges: int
    watertight: bool
    area: float
    volume: float | None

    def to_document(self) -> dict[str, Any]:
        """The same as plain values for JSON."""
        return asdict(self)
