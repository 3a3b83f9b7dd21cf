"""What mesh intake found and did."""

from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["LISTED_HOLES", "CloudReport", "IntakeReport", "report_from_document"]

LISTED_HOLES = 10
"""Most holes whose rims are listed one by one."""


@dataclass(frozen=True)
class IntakeReport:
    """What intake found in a file and what it did to it.

    Attributes:
        file_type: Format that was read.
        unit: Length unit that the file was taken to be in.
        scale: What the numbers of the file were multiplied by besides.
        vertices_in_file: Vertices found.
        faces_in_file: Triangles found, polygons counted as the triangles they were split into.
        vertices: Vertices left.
        faces: Triangles left.
        merged_vertices: Vertices joined with one at the same place.
        unused_vertices: Vertices dropped because no kept face has them.
        degenerate_faces: Faces dropped because they have no area.
        duplicate_faces: Faces dropped because another has the same corners.
        flipped_faces: Faces whose winding was reversed so that all normals point out of the object.
        components: Separate parts left.
        inner_parts: Parts dropped because they lie inside another, such as the walls of cavities.
        holes: Holes in the surface, which are left open.
        hole_perimeters: Lengths of the longest rims of holes, at most `LISTED_HOLES`, the longest first [m].
        boundary_edges: Edges of holes, with one face only.
        nonmanifold_edges: Edges that more than two faces share.
        watertight: Whether every edge is shared by exactly two faces that agree on the outside.
        area: Surface area [m^2].
        volume: Enclosed volume [m^3]; None where the surface is not watertight.
    """

    file_type: str
    unit: str
    scale: float
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
    inner_parts: int
    holes: int
    hole_perimeters: tuple[float, ...]
    boundary_edges: int
    nonmanifold_edges: int
    watertight: bool
    area: float
    volume: float | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "hole_perimeters", tuple(self.hole_perimeters))  # JSON has lists only

    def to_document(self) -> dict[str, Any]:
        """The same as plain values for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class CloudReport:
    """What intake found in the file of a point cloud.

    Attributes:
        file_type: Format that was read.
        unit: Length unit that the file was taken to be in.
        scale: What the numbers of the file were multiplied by besides.
        points_in_file: Points found.
        points: Points left.
        non_finite_points: Points dropped because they are not numbers, such as pixels without depth.
        repeated_points: Points dropped because another is at the same place.
        outliers: Points dropped because they stand far from all others.
        normals: Whether the file says where the surface faces.
        viewpoint: Whether it is known where the camera stood.
        spacing: Typical distance of a point from the nearest other [m].
    """

    file_type: str
    unit: str
    scale: float
    points_in_file: int
    points: int
    non_finite_points: int
    repeated_points: int
    outliers: int
    normals: bool
    viewpoint: bool
    spacing: float

    def to_document(self) -> dict[str, Any]:
        """The same as plain values for JSON."""
        return asdict(self)


def report_from_document(document: dict[str, Any]) -> IntakeReport | CloudReport:
    """The report that ``to_document`` wrote."""
    return CloudReport(**document) if "points" in document else IntakeReport(**document)
