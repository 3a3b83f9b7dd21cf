"""The world of the second engine, Drake [Tedrake2019]: the hand's own links and solids, and the object's exact mesh.

Masses, inertias, joint limits, drive inertia and damping, torque limits and friction are those of our simulation. What
differs is what is to be compared: the engine, the contact model (pressure fields of soft solids [Elandt2019] on a rigid
mesh instead of constraints at points of convex pieces) and the contact solver [Castro2023].
"""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydrake.common import MemoryFile
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometrySet,
    InMemoryMesh,
    ProximityProperties,
    Sphere,
)
from pydrake.geometry import Mesh as DrakeMesh
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.framework import DiagramBuilder

from fingersplit.contacts.torsion import PAD_MODULUS
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.hands.model import Solid
from fingersplit.hands.self_collision import self_collision_pairs
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.verification.published import Execution
from fingersplit.verification.scene_parts import JOINT_ARMATURE, JOINT_DAMPING, OBJECT, finger_chains
from fingersplit_bench.suite import BenchError

__all__ = ["DISSIPATION", "World", "build_world", "hydroelastic_modulus"]

TYPICAL_FORCE = 10.0
"""Force at which the patch of a pad is that of Hertz's contact [N]."""
DISSIPATION = 10.0
"""Hunt and Crossley's, of every solid of the hand [s/m]."""
STICTION_SPEED = 1e-4
"""Speed below which a contact counts as sticking [m/s]."""
RESOLUTION = 3e-3
"""Edge of the tetrahedra in round solids of the hand [m]."""


@dataclass(frozen=True, eq=False)
class World:
    """A compiled world.

    Attributes:
        hand: The hand.
        diagram: Plant and scene graph.
        plant: Drake's ``MultibodyPlant``.
        hand_instance: The hand's model instance.
        links: Bodies of the hand, in the order of ``hand.model.links``.
        joints: Joints of the hand, in the order of ``hand.joint_names``; None where it is parked.
        object_body: Body of the object.
        parts: Finger of every solid of the hand by its geometry, the number of fingers for the palm and what is parked.
        surfaces: Geometries of the object.
    """

    hand: Hand
    diagram: Any
    plant: Any
    hand_instance: Any
    links: tuple[Any, ...]
    joints: tuple[Any, ...]
    object_body: Any
    parts: dict[Any, int]
    surfaces: frozenset[Any]


def hydroelastic_modulus(radius: float, force: float = TYPICAL_FORCE) -> float:
    """Modulus [Pa] whose patch under ``force`` [N] is that of a rubber pad of this radius [m] by Hertz.

    Pressed flat by d, a sphere of pressure E depth / R carries pi E d^2 over a patch of radius a with a^2 = 2 R d;
    Hertz's a^3 = 3 N R / (4 E*) gives d.
    """
    patch = (0.75 * force * radius / PAD_MODULUS) ** (1.0 / 3.0)
    return float(4.0 * force * radius**2 / (np.pi * patch**4))


def build_world(
    hand: Hand,
    model: ObjectModel,
    grasp: Grasp,
    execution: Execution,
    *,
    mass: float,
    friction: float,
    step: float,
    pieces: ConvexPieces | None = None,
) -> World:
    """Compile the world of one grasp: the palm fixed where the grasp has it, the object free at the origin, no gravity.

    Args:
        hand: The hand; every joint is driven by itself or parked.
        model: The object.
        grasp: Where the palm is.
        execution: Stiffness and damping of the servos.
        mass: Of the object [kg]; its inertia goes with it.
        friction: Between hand and object.
        step: Time step [s].
        pieces: What the object collides as; None for its own triangles.

    Raises:
        BenchError: The hand has coupled joints, or a link with several.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, step)
    plant.set_contact_model(ContactModel.kHydroelasticWithFallback)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])  # loads are applied as forces
    instance = plant.AddModelInstance("hand")
    links, joints = _add_links(plant, instance, hand, grasp)
    _drive(plant, hand, joints, execution)
    solids = _add_solids(plant, hand, links, friction)
    body = _add_object(plant, model, mass)
    surfaces = _add_surfaces(plant, body, model, pieces, friction)
    plant.Finalize()
    plant.set_stiction_tolerance(STICTION_SPEED)
    _filter_collisions(scene_graph, hand, solids)
    chains = finger_chains(hand)
    finger_of = {name: finger for finger, chain in enumerate(chains) for name in chain}
    parts = {
        solid: finger_of.get(link.name, len(chains))
        for link, own in zip(hand.model.links, solids, strict=True)
        for solid in own
    }
    return World(hand, builder.Build(), plant, instance, links, joints, body, parts, surfaces)


def _add_links(plant: Any, instance: Any, hand: Hand, grasp: Grasp) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Bodies with their masses, and hinges with their limits."""
    model = hand.model
    bodies: list[Any] = []
    joints: dict[int, Any] = {}
    for link in model.links:
        body = plant.AddRigidBody(link.name, instance, _spatial_inertia(link.mass, link.center_of_mass, link.inertia))
        parent = plant.world_body() if link.parent < 0 else bodies[link.parent]
        bodies.append(body)
        where = RigidTransform(grasp.object_from_palm if link.parent < 0 else link.pose)
        if len(link.joints) > 1:
            raise BenchError(f"Link {link.name} has several joints; the second engine takes hands with one a link.")
        moving = [j for j in link.joints if model.joints[j].lower < model.joints[j].upper]
        if not moving:
            plant.WeldFrames(parent.body_frame(), body.body_frame(), where)
            continue
        joint, anchor = model.joints[moving[0]], RigidTransform(model.joints[moving[0]].anchor)
        frames = [
            plant.AddFrame(FixedOffsetFrame(f"{joint.name}_{side}", holder.body_frame(), pose, instance))
            for side, holder, pose in (("outer", parent, where @ anchor), ("inner", body, anchor))
        ]
        limits = joint.lower - joint.reference, joint.upper - joint.reference
        joints[moving[0]] = plant.AddJoint(
            RevoluteJoint(joint.name, *frames, joint.axis, *limits, damping=JOINT_DAMPING)
        )
    return tuple(bodies), tuple(joints.get(j) for j in range(len(model.joints)))


def _spatial_inertia(mass: float, center: NDArray[np.float64], moments: NDArray[np.float64]) -> Any:
    """Of a body of ``mass`` [kg] with its centre of mass and its inertia (3, 3) [kg m^2] about that."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = moments.tolist()
    return SpatialInertia.MakeFromCentralInertia(mass, center, RotationalInertia(xx, yy, zz, xy, xz, yz))


def _drive(plant: Any, hand: Hand, joints: tuple[Any, ...], execution: Execution) -> None:
    """A torque-limited position servo at every driver."""
    if any(joint is not None and joint.name() not in hand.driver_names for joint in joints):
        raise BenchError(f"Hand {hand.name} has coupled joints; the second engine takes hands without.")
    grip = execution.grip
    for name, limit, stiffness, damping in zip(
        hand.driver_names, hand.torque_limits, grip.stiffness, grip.damping, strict=True
    ):
        actuator = plant.AddJointActuator(f"{name}_servo", joints[hand.joint_names.index(name)], limit)
        actuator.set_default_rotor_inertia(JOINT_ARMATURE)
        actuator.set_default_gear_ratio(1.0)
        actuator.set_controller_gains(PdControllerGains(p=stiffness, d=damping))


def _add_solids(plant: Any, hand: Hand, links: tuple[Any, ...], friction: float) -> list[list[Any]]:
    """Geometries of every link, soft like its pads."""
    modulus = hydroelastic_modulus(float(np.mean([pad.radius for pad in hand.pads])))
    found: list[list[Any]] = [[] for _ in links]
    for solid in hand.model.solids:
        properties = ProximityProperties()
        AddCompliantHydroelasticProperties(RESOLUTION, modulus, properties)
        AddContactMaterial(properties, dissipation=DISSIPATION, friction=CoulombFriction(friction, friction))
        found[solid.link].append(
            plant.RegisterCollisionGeometry(
                links[solid.link], RigidTransform(solid.pose), _shape(solid), solid.name, properties
            )
        )
    return found


def _shape(solid: Solid) -> Any:
    """A solid as Drake has it; half sizes become sizes."""
    if solid.vertices is not None:
        return Convex(solid.vertices.T, solid.name)
    x, y, z = (float(value) for value in solid.size)
    kinds = mujoco.mjtGeom
    match kinds(solid.kind):
        case kinds.mjGEOM_SPHERE:
            return Sphere(x)
        case kinds.mjGEOM_CAPSULE:
            return Capsule(x, 2 * y)
        case kinds.mjGEOM_CYLINDER:
            return Cylinder(x, 2 * y)
        case kinds.mjGEOM_ELLIPSOID:
            return Ellipsoid(x, y, z)
        case kinds.mjGEOM_BOX:
            return Box(2 * x, 2 * y, 2 * z)
    raise BenchError(f"Solid {solid.name} is of a kind that the second engine does not know.")


def _add_object(plant: Any, model: ObjectModel, mass: float) -> Any:
    """The body of the object, free."""
    inertia = _spatial_inertia(mass, model.center_of_mass, mass / model.mass * model.inertia)
    return plant.AddRigidBody(OBJECT, plant.AddModelInstance(OBJECT), inertia)


def _add_surfaces(
    plant: Any, body: Any, model: ObjectModel, pieces: ConvexPieces | None, friction: float
) -> frozenset[Any]:
    """The object's surface, rigid."""
    mesh = model.mesh.solid
    if pieces is None:
        file = MemoryFile(_wavefront(mesh.vertices, mesh.faces), ".obj", OBJECT)
        shapes: list[Any] = [DrakeMesh(InMemoryMesh(mesh_file=file))]
    else:
        shapes = [Convex(vertices.T, OBJECT) for vertices, _ in pieces.pieces]
    found = []
    for number, shape in enumerate(shapes):
        properties = ProximityProperties()
        AddRigidHydroelasticProperties(properties)
        AddContactMaterial(properties, friction=CoulombFriction(friction, friction))
        found.append(plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"{OBJECT}{number}", properties))
    return frozenset(found)


def _wavefront(vertices: NDArray[np.float64], faces: NDArray[np.integer[Any]]) -> str:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist())]) + "\n"


def _filter_collisions(scene_graph: Any, hand: Hand, solids: list[list[Any]]) -> None:
    """Links of the hand meet where the planner says that they can."""
    model = hand.model
    meeting = {frozenset((model.shapes[i].link, model.shapes[j].link)) for i, j in self_collision_pairs(model).tolist()}
    filters = scene_graph.collision_filter_manager()
    for a in range(len(solids)):
        for b in range(a):
            if frozenset((a, b)) not in meeting and solids[a] and solids[b]:
                apart = CollisionFilterDeclaration().ExcludeBetween(GeometrySet(solids[a]), GeometrySet(solids[b]))
                filters.Apply(apart)
