"""The object as the planner needs it: mesh, surface samples, collision points and mass."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.objects.cloud.checks import ONE_SIDED
from fingersplit.objects.grid import PointGrid
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.mass import MassProperties
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.packing import packed, unpacked
from fingersplit.objects.patches import Patches
from fingersplit.objects.signed_distance import DistanceGrid
from fingersplit.objects.source import ObjectSource
from fingersplit.objects.supervoxels import Supervoxels
from fingersplit.objects.surface import Surface
from fingersplit.objects.triangle_grid import TriangleGrid

__all__ = ["ObjectModel", "object_id"]

SURELY_SEEN = 0.75
"""Share of its closed surface that points show, below which the volume of a cloud's object may be wrong by far."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ObjectModel:
    """A prepared object.

    Attributes:
        name: What people call it.
        shape_hash: Hash of the mesh or cloud that it was prepared from.
        options: What was said of it beside its shape.
        source: How its file became metres; the default for an object that came as arrays.
        report: What intake found in its file and did; None for an object that came as arrays.
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
        assumed_samples: Which samples of the surface were not seen but assumed, (n,); none of a mesh's.
        support: Plane that a cloud says the object stands on: unit normal on its side and offset [m], (4,); None for
            none.
    """

    name: str
    shape_hash: str
    options: ObjectOptions
    source: ObjectSource
    report: IntakeReport | CloudReport | None
    mesh: Mesh
    surface: Surface
    supervoxels: Supervoxels
    collision: PointGrid
    distance: DistanceGrid
    triangles: TriangleGrid
    patches: Patches
    mass_properties: MassProperties
    seen: float
    assumed_samples: NDArray[np.bool_]
    support: NDArray[np.float64] | None = None

    @property
    def id(self) -> str:
        """Stands for shape and options (32 hex digits): what else an object is prepared with is the same everywhere."""
        return object_id(self.shape_hash, self.options)

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

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user may not expect of it, in sentences: of its file, and of what a cloud leaves open."""
        of_file = () if self.report is None else tuple(self.report.remarks)
        if self.assumed or self.seen >= SURELY_SEEN:
            return of_file
        volume = f"{1e6 * self.mass_properties.volume:.3g} cm^3"
        return *of_file, (
            f"Only {self.seen:.0%} of the object's surface surely runs through the cloud's points; the rest, where "
            f"these are missing, few or noisy, was closed over. Its volume ({volume}), mass and centre of mass are "
            "uncertain, and what is thin or hollow may have been filled."
        )

    @property
    def one_sided(self) -> bool:
        """Whether it is a cloud of which one side was seen and nothing assumed, so that its shape is not known."""
        if self.seen >= 1.0 or self.assumed:
            return False
        return float(np.linalg.norm(self.surface.normals.mean(axis=0))) > ONE_SIDED

    @property
    def assumed(self) -> float:
        """Share of the surface for contacts that was not seen but assumed, 0 for a mesh."""
        return float(self.assumed_samples.mean())

    def is_assumed(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points (n, 3) [m] on the surface lie where it was not seen but assumed, (n,)."""
        if not self.assumed_samples.any():
            return np.zeros(len(points), bool)
        return np.asarray(self.assumed_samples[self._samples.query(points)[1]])

    @cached_property
    def _samples(self) -> cKDTree:
        return cKDTree(self.surface.grid.points)

    @cached_property
    def radius(self) -> float:
        """Largest distance of the surface from the centre of mass [m]: the scale that makes torques forces."""
        return float(np.linalg.norm(self.surface.grid.points - self.center_of_mass, axis=1).max())

    def to_document(self) -> dict[str, Any]:
        """The ``object`` part of a result document, SI units."""
        return {
            "id": self.id,
            "name": self.name,
            "source": self.source.to_document(),
            "options": self.options.to_document(),
            "report": None if self.report is None else self.report.to_document(),
            "extents": self.mesh.extents.tolist(),
            "volume": self.mass_properties.volume,
            "mass": self.mass,
            "mass_basis": self.mass_properties.basis,
            "center_of_mass": self.center_of_mass.tolist(),
            "inertia": self.mass_properties.inertia.tolist(),
            "samples": len(self.surface.normals),
            "sample_spacing": self.surface.spacing,
            "seen": self.seen,
            "assumed": self.assumed,
        }

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """All that was computed, as named arrays for a `ContentCache`; what the caller said is not among them."""
        arrays = dict[str, NDArray[Any]]()
        for part in _COMPUTED:
            arrays.update(packed(getattr(self, part), part + "/"))
        if self.support is not None:
            arrays["support"] = self.support
        return arrays | {
            "seen": np.array(self.seen),
            "assumed_samples": self.assumed_samples,
            "shape_hash": np.array(self.shape_hash),
        }

    @classmethod
    def from_arrays(
        cls,
        arrays: dict[str, NDArray[Any]],
        name: str,
        options: ObjectOptions,
        source: ObjectSource,
        report: IntakeReport | CloudReport | None,
    ) -> "ObjectModel":
        """The model that `to_arrays` took apart, on the same arrays."""
        parts = {part: unpacked(kind, arrays, part + "/") for part, kind in _COMPUTED.items()}
        numbers = {name: arrays[name].item() for name in ("shape_hash", "seen")}
        parts |= {"assumed_samples": arrays["assumed_samples"], "support": arrays.get("support")}
        return cls(name=name, options=options, source=source, report=report, **numbers, **parts)


def object_id(shape_hash: str, options: ObjectOptions) -> str:
    """An id (32 hex digits) for a shape with options; the hash of the shape where all options are the defaults."""
    if options == ObjectOptions():
        return shape_hash
    return hashlib.sha256(f"{shape_hash} {options.content_hash}".encode()).hexdigest()[:32]


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
