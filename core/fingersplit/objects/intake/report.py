"""What mesh intake found and did."""

from dataclasses import asdict, dataclass
from typing import Any, ClassVar

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
        merged_vertices: Vertices joined with one at the same place, or on the other side of a crack.
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
        volume: Enclosed volume [m^3]; see ``volume_method``.
        volume_method: ``"surface"``, ``"capped_holes"``, ``"union"`` or ``"convex_hull"``; see `Solid`.
        open_share: Share of the area that is missing, as the caps on the holes measure it [1].
    """

    computed: ClassVar[tuple[str, ...]] = ("remarks",)
    """Properties that stand in documents, too."""

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
    volume: float
    volume_method: str
    open_share: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "hole_perimeters", tuple(self.hole_perimeters))  # JSON has lists only

    @property
    def remarks(self) -> list[str]:
        """What a user may not expect, in sentences."""
        remarks = list[str]()
        if self.volume_method == "convex_hull":
            remarks.append(
                f"Openings are {self.open_share:.0%} of the surface: volume, mass and centre of mass are those of the "
                "convex hull."
            )
        elif self.holes:
            remarks.append(
                f"The surface is open ({_counted(self.holes, 'hole')}, {_share(self.open_share)} of its area): "
                "caps close it for volume, mass and what counts as inside."
            )
        if self.volume_method == "union":
            remarks.append("Parts of the surface overlap: volume and mass count the overlap once.")
        if self.inner_parts:
            parts = _counted(self.inner_parts, "part")
            remarks.append(f"{parts} inside another dropped; cavities count as solid.")
        if self.components > 1:
            remarks.append(f"The object consists of {self.components} parts that share no vertex.")
        if self.flipped_faces:
            faces = _counted(self.flipped_faces, "triangle")
            remarks.append(f"{faces} of {self.faces_in_file:,} turned over, so that all face outwards.")
        if self.nonmanifold_edges:
            remarks.append(f"{_counted(self.nonmanifold_edges, 'edge')} with more than two triangles.")
        return remarks

    def to_document(self) -> dict[str, Any]:
        """The same as plain values for JSON, and the remarks."""
        return asdict(self) | {"remarks": self.remarks}


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
        normals_turned: Whether the normals pointed inwards and were turned over.
        plane_share: Share of the points that lie in planes which the others stand on or before, as a table and walls; 0
            where there are none.
        support: Whether it is known what the object stands on, so that what one view did not see of it is assumed.
    """

    computed: ClassVar[tuple[str, ...]] = ("remarks",)
    """Properties that stand in documents, too."""

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
    normals_turned: bool = False
    plane_share: float = 0.0
    support: bool = False

    @property
    def remarks(self) -> list[str]:
        """What a user may not expect, in sentences."""
        remarks = list[str]()
        if self.plane_share:
            remarks.append(
                f"{self.plane_share:.0%} of the points lie in a plane, or several, that the others stand on or before, "
                "as a table or a wall: this looks like a scene, not an object. Cut the object out of the cloud first; "
                "from a depth image with a mask, 'fingersplit from-depth' and POST /v1/scenes/from-depth do."
            )
        if self.support and self.viewpoint:
            remarks.append(
                "What the camera did not see is assumed from symmetry, down to the support, and may carry contacts."
            )
        if self.normals_turned:
            remarks.append("All normals pointed into the object and were turned over.")
        if self.outliers:
            remarks.append(f"{_counted(self.outliers, 'point')} far from all others dropped.")
        if not self.normals and not self.viewpoint:
            remarks.append(
                "Neither usable normals nor a viewpoint are known: which side of the points the object is on was "
                "judged from their shape. Compare its extents and volume, or say where the camera stood (viewpoint)."
            )
        return remarks

    def to_document(self) -> dict[str, Any]:
        """The same as plain values for JSON, and the remarks."""
        return asdict(self) | {"remarks": self.remarks}


def report_from_document(document: dict[str, Any]) -> IntakeReport | CloudReport:
    """The report that ``to_document`` wrote."""
    values = {name: value for name, value in document.items() if name != "remarks"}
    return CloudReport(**values) if "points" in values else IntakeReport(**values)


def _counted(count: int, what: str) -> str:
    return f"{count:,} {what}{'' if count == 1 else 's'}"


def _share(share: float) -> str:
    return "under 0.1 %" if share < 1e-3 else f"{100 * share:.2g} %"
