"""A hand's model as plain data: what is left of an MJCF or URDF once MuJoCo has compiled it and it is cut at the palm.

Everything else (kernels' records, the simulated scene, pictures) is made from this, so what is planned is what is
simulated.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["Coupling", "HandModel", "Joint", "Link", "Shape", "Solid"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Joint:
    """A hinge in its link's frame.

    Attributes:
        name: Name in the model.
        axis: Direction of its axis, (3,).
        anchor: A point on the axis, (3,) [m].
        reference: Angle at which the link stands as its pose says [rad].
        lower: Lower limit [rad].
        upper: Upper limit [rad].
    """

    name: str
    axis: Array
    anchor: Array
    reference: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Link:
    """A body: its pose in its parent at the joints' reference angles, what it weighs, and the joints that move it.

    Attributes:
        name: Name of the body.
        parent: Index of the link that it hangs on; -1 for the palm.
        pose: ``parent_from_link``, (4, 4); the identity for the palm.
        joints: Its hinges, the outermost last.
        mass: Mass [kg].
        center_of_mass: Centre of mass in the link's frame, (3,) [m].
        inertia: Inertia about the centre of mass along the link's axes, (3, 3) [kg m^2].
    """

    name: str
    parent: int
    pose: Array
    joints: tuple[int, ...]
    mass: float
    center_of_mass: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Solid:
    """A geom of the model: a primitive or a mesh.

    Attributes:
        name: Name of the geom, or of its body and a number.
        link: Index of its link.
        kind: Number of ``mujoco.mjtGeom``.
        size: Half sizes as in MJCF, (3,) [m]; of no meaning for a mesh.
        pose: ``link_from_solid``, (4, 4).
        color: Red, green, blue and opacity, (4,).
        vertices: Of a mesh, (n, 3) [m].
        faces: Of a mesh, (m, 3).
    """

    name: str
    link: int
    kind: int
    size: Array
    pose: Array
    color: Array
    vertices: Array | None = None
    faces: NDArray[np.int64] | None = None


@dataclass(frozen=True, eq=False)
class Shape:
    """A primitive that the planner tests for collisions.

    Attributes:
        name: Name of the solid it stands for; of the first one where it stands for several.
        link: Index of its link.
        kind: Sphere, capsule, cylinder, box or convex solid, see ``hands.shapes_kernel``.
        size: As ``shape_distance`` takes it [m].
        pose: ``link_from_shape``, (4, 4).
        overhang: How far it reaches beyond what it stands for at most [m]; zero where it is that.
        sources: Names of the solids it stands for.
    """

    name: str
    link: int
    kind: int
    size: Array
    pose: Array
    overhang: float
    sources: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Coupling:
    """joints = matrix @ drivers + offset.

    Attributes:
        drivers: Joints that motors turn, (A,) names.
        matrix: S, (N, A).
        offset: q0, (N,) [rad].
        lower: Lower limits of the drivers, those of driven joints included, (A,) [rad].
        upper: Upper limits, (A,) [rad].
        torque_ranges: Largest torque of each driver towards larger and towards smaller angles, (2, A) [N m].
    """

    drivers: tuple[str, ...]
    matrix: Array
    offset: Array
    lower: Array
    upper: Array
    torque_ranges: Array

    @property
    def torque_limits(self) -> Array:
        """Largest torque of each driver either way, (A,) [N m]."""
        return np.asarray(self.torque_ranges.min(axis=0))


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand from the palm outwards.

    Attributes:
        links: Bodies; the first is the palm, and every other follows its parent.
        joints: Hinges, in the order of every joint vector.
        coupling: How drivers move joints.
        solids: What collides in the simulation.
        visuals: What a picture shows.
        shapes: What the planner tests for collisions.
        excluded: Pairs of links that the model says never to test against each other.
        notes: What was left out, changed or approximated, a sentence each.
        motors: Number of motors that the model names; a URDF names none.
    """

    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    coupling: Coupling
    solids: tuple[Solid, ...]
    visuals: tuple[Solid, ...]
    shapes: tuple[Shape, ...]
    excluded: frozenset[tuple[int, int]]
    notes: tuple[str, ...]
    motors: int

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the order of every joint vector, (N,)."""
        return tuple(joint.name for joint in self.joints)

    def joints_from_drivers(self, drivers: Array) -> Array:
        """Joint angles (..., N) of driver angles (..., A) [rad]."""
        return np.asarray(drivers @ self.coupling.matrix.T + self.coupling.offset)

    def link_index(self, name: str) -> int | None:
        """Index of a link, or None."""
        return next((i for i, link in enumerate(self.links) if link.name == name), None)

    def path(self, link: int) -> list[int]:
        """Links from the palm to ``link``, both included."""
        path = [link]
        while self.links[path[0]].parent >= 0:
            path.insert(0, self.links[path[0]].parent)
        return path
