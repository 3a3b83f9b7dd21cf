"""What is said of an object, and what was found in its file."""

from typing import Annotated, Literal

from pydantic import Field

from fingersplit_client.schemas.base import Document, Unit, Vector3

__all__ = [
    "CloudReport",
    "Density",
    "Fairing",
    "Friction",
    "IntakeReport",
    "Mass",
    "ObjectOptions",
    "ObjectSource",
]


class IntakeReport(Document):
    """What was found in a mesh file and what was repaired."""

    file_type: str = Field(description="Format that was read.")
    unit: Unit = Field(description="Length unit the file was taken to be in.")
    scale: float = Field(default=1.0, description="What the numbers of the file were multiplied by besides.")
    vertices_in_file: int = Field(description="Vertices found.")
    faces_in_file: int = Field(description="Triangles found, after polygons were split into triangles.")
    vertices: int = Field(description="Vertices left.")
    faces: int = Field(description="Triangles left.")
    merged_vertices: int = Field(
        description="Vertices joined with one at the same place, or on the other side of a crack."
    )
    unused_vertices: int = Field(description="Vertices dropped because no kept triangle has them.")
    degenerate_faces: int = Field(description="Triangles dropped because they have no area.")
    duplicate_faces: int = Field(description="Triangles dropped because another has the same corners.")
    flipped_faces: int = Field(description="Triangles turned so that their normals point out of the object.")
    components: int = Field(description="Separate parts left.")
    inner_parts: int = Field(description="Parts dropped because they lie inside another, such as walls of cavities.")
    holes: int = Field(description="Holes in the surface, which are left open.")
    hole_perimeters: list[float] = Field(description="Lengths of the ten longest rims of holes, longest first [m].")
    boundary_edges: int = Field(description="Edges of holes, with one triangle only.")
    nonmanifold_edges: int = Field(description="Edges that more than two triangles share.")
    watertight: bool = Field(description="Whether the surface is closed, with one outside.")
    area: float = Field(description="Surface area [m^2].")
    volume: float | None = Field(description="Enclosed volume [m^3]; see `volume_method`.")
    volume_method: Literal["surface", "capped_holes", "union", "convex_hull"] = Field(
        default="surface",
        description="How the volume was found: exactly, with holes closed, with parts that overlap counted once, or of "
        "the convex hull where openings are a large part of the surface.",
    )
    open_share: float = Field(default=0.0, description="Share of the area that is missing, as its caps measure it.")
    remarks: list[str] = Field(default=[], description="What may not be expected, in sentences.")


class CloudReport(Document):
    """What was found in the file of a point cloud."""

    file_type: str = Field(description="Format that was read.")
    unit: Unit = Field(description="Length unit the file was taken to be in.")
    scale: float = Field(default=1.0, description="What the numbers of the file were multiplied by besides.")
    points_in_file: int = Field(description="Points found.")
    points: int = Field(description="Points left.")
    non_finite_points: int = Field(description="Points dropped because they are not numbers.")
    repeated_points: int = Field(description="Points dropped because another is at the same place.")
    outliers: int = Field(description="Points dropped because they stand far from all others.")
    normals: bool = Field(description="Whether the file says where the surface faces.")
    viewpoint: bool = Field(description="Whether it is known where the camera stood.")
    spacing: float = Field(description="Typical distance of a point from the nearest other [m].")
    normals_turned: bool = Field(default=False, description="Whether normals pointed inwards and were turned over.")
    plane_share: float = Field(default=0.0, description="Share of the points in planes that the others stand on.")
    support: bool = Field(
        default=False,
        description="Whether it is known what the object stands on, so that what one view did not see is assumed.",
    )
    remarks: list[str] = Field(default=[], description="What may not be expected, in sentences.")


Density = Annotated[float, Field(ge=1, le=25_000)]
Mass = Annotated[float, Field(ge=1e-6, le=100)]
Friction = Annotated[float, Field(ge=0.01, le=5)]
Fairing = Annotated[float, Field(ge=0, le=0.05)]


class ObjectOptions(Document):
    """What is known of an object beside its shape, and how it is to be prepared; null means not known."""

    density: Density | None = Field(default=None, description="Density, even over the object [kg/m^3].")
    mass: Mass | None = Field(default=None, description="Mass, instead of a density [kg].")
    friction: Friction | None = Field(default=None, description="Coulomb friction between its surface and pads.")
    fairing: Fairing = Field(default=0.0, description="Wavelength attenuated by half, by implicit fairing [m].")


class ObjectSource(Document):
    """How the numbers of an object's file became metres."""

    unit: Unit = Field(default="m", description="Length unit of the file.")
    scale: float = Field(default=1.0, gt=0, description="Multiplies the file's numbers besides.")
    viewpoint: Vector3 | None = Field(
        default=None, description="Where the camera of a cloud stood, in the file's frame and unit, if that was given."
    )
    support: tuple[float, float, float, float] | None = Field(
        default=None,
        description="Plane that the object of a cloud stood on: normal, and offset in the file's unit, if given.",
    )
