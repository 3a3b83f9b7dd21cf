"""The object as the planner needs it: mesh, surface samples, collision points and mass."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.fairing import fair
from fingersplit.objects.grid import PointGrid, build_grid
from fingersplit.objects.mass import MassProperties, mass_properties
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.packing import frozen, packed, unpacked
from fingersplit.objects.patches import Patches, build_patches
from fingersplit.objects.signed_distance import DistanceGrid, build_distance_grid
from fingersplit.objects.supervoxels import Supervoxels, cluster_supervoxels
from fingersplit.objects.surface import Surface, sample_surface
from fingersplit.objects.triangle_grid import TriangleGrid, bin_triangles

__all__ = ["COLLISION_POINTS", "ObjectModel", "prepare_object"]

COLLISION_POINTS = 2_000


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """A prepared object.

    Attributes:
        name: What people call it.
        content_hash: Hash of the mesh or cloud that it was prepared from.
        options: What was said of it beside its shape.
        mesh: The triangles, after fairing; for a cloud, those of the surface through it, closed where nothing was seen.
        surface: Evenly spaced samples with outward normals: where contacts may be. Of a cloud, the seen side only.
        supervoxels: Patches of the surface.
        collision: The points that stand for the object in collision tests: supervoxel centres, as in [Fan2018] section
            III-A3, and points of what was not seen.
        distance: Signed distance on a grid; what was not seen counts as inside.
        triangles: The mesh's triangles by cell, for exact rays.
        patches: The same by sample, for exact depths; of a cloud, the seen side only.
        mass_properties: Mass, volume, centre of mass and inertia.
        seen: Share of the closed surface's area that is known, 1 for a mesh.
    """

    name: str
    content_hash: str
    options: ObjectOptions
    mesh: Mesh
    surface: Surface
    supervoxels: Supervoxels
    collision: PointGrid
    distance: DistanceGrid
    triangles: TriangleGrid
    patches: Patches
    mass_properties: MassProperties
    seen: float

    @property
    def center_of_mass(self) -> NDArray[np.float64]:
        """Centre of mass at even density, (3,) [m]."""
        return self.mass_properties.center_of_mass

    @property
    def mass(self) -> float:
        """Mass, given or assumed [kg]."""
        return self.mass_properties.mass

    @property
    def inertia(self) -> NDArray[np.float64]:
        """Inertia about the centre of mass along the object's axes, (3, 3) [kg m^2]."""
        return self.mass_properties.inertia

    @cached_property
    def radius(self) -> float:
        """Largest distance of the surface from the centre of mass [m]: the scale that makes torques forces."""
        return float(np.linalg.norm(self.surface.grid.points - self.center_of_mass, axis=1).max())

    def to_document(self) -> dict[str, Any]:
        """The ``object`` part of a result document, SI units."""
        return {
            "id": self.content_hash,
            "name": self.name,
            "extents": self.mesh.extents.tolist(),
            "volume": self.mass_properties.volume,
            "mass": self.mass,
            "center_of_mass": self.center_of_mass.tolist(),
            "inertia": self.mass_properties.inertia.tolist(),
            "samples": len(self.surface.normals),
            "sample_spacing": self.surface.spacing,
            "seen": self.seen,
        }

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """All that was computed, as named arrays for a `ContentCache`; name and options are not among them."""
        arrays = dict[str, NDArray[Any]]()
        for part in _COMPUTED:
            arrays.update(packed(getattr(self, part), part + "/"))
        return arrays | {"seen": np.array(self.seen), "content_hash": np.array(self.content_hash)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[Any]], name: str, options: ObjectOptions) -> "ObjectModel":
        """The model that `to_arrays` took apart, on the same arrays."""
        parts = {part: unpacked(kind, arrays, part + "/") for part, kind in _COMPUTED.items()}
        seen, content_hash = arrays["seen"].item(), arrays["content_hash"].item()
        return cls(name=name, content_hash=content_hash, options=options, seen=seen, **parts)


_COMPUTED: dict[str, Any] = {
    "mesh": Mesh,
    "surface": Surface,
    "supervoxels": Supervoxels,
    "collision": PointGrid,
    "distance": DistanceGrid,
    "triangles": TriangleGrid,
    "patches": Patches,
    "mass_properties": MassProperties,
}


def prepare_object(mesh: Mesh, name: str = "object", options: ObjectOptions | None = None) -> ObjectModel:
    """Prepare a mesh for planning; the same mesh and options always give the same model.

    Args:
        mesh: From intake, or parametric.
        name: What people call it.
        options: Mass, friction and fairing; None for the defaults.
    """
    options = options or ObjectOptions()
    shape = fair(mesh, options.fairing) if options.fairing > 0 else mesh
    surface = sample_surface(shape)
    supervoxels = cluster_supervoxels(surface, COLLISION_POINTS)
    spacing = surface.spacing * (len(surface.normals) / COLLISION_POINTS) ** 0.5
    return ObjectModel(
        name=name,
        content_hash=mesh.content_hash,
        options=options,
        mesh=shape,
        surface=frozen(surface),
        supervoxels=supervoxels,
        collision=frozen(build_grid(supervoxels.centers, 2.0 * spacing)[0]),
        distance=build_distance_grid(shape, surface),
        triangles=bin_triangles(shape),
        patches=build_patches(shape, surface),
        mass_properties=frozen(mass_properties(shape, options)),
        seen=1.0,
    )
