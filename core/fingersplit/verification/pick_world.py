"""The world of a pick: hand on a carriage, object at rest on its support, obstacles, gravity; in the scene's frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces, decompose
from fingersplit.objects.grid_kernel import thin_evenly
from fingersplit.scene.preparing import PreparedScene
from fingersplit.scene.world import Obstacle, SupportSurface
from fingersplit.transforms import transform_points, wxyz_from_rotation
from fingersplit.verification.scene_parts import (
    CONDIM,
    OBJECT,
    add_object,
    drive_joints,
    finger_chains,
    limit_joints,
    mount_hand,
    servo_name,
)

__all__ = ["PickWorld"]

CARRIAGE_MASS, CARRIAGE_FREQUENCY = 1e3, 50.0
"""Heavy and stiff enough for the palm to go where it is told, whatever the fingers push: [kg], [rad/s]."""
CLOUD_SPACING, MIN_POINT_RADIUS = 4e-3, 1e-3
"""[m]; points of a cloud stand for it no closer than this, as balls no smaller than that."""
SUPPORT_DEPTH = 0.5
"""[m]; of a support of limited size."""
IMPRATIO, NOSLIP_ITERATIONS = 10, 2
"""With elliptic cones these keep a held object from creeping through the fingers."""


@dataclass(frozen=True, eq=False)
class PickWorld:
    """A compiled world and where its parts are.

    Attributes:
        hand: The hand.
        model: Compiled ``MjModel``.
        data: Its ``MjData``.
        object_body: Body of the object.
        object_qpos: First of the object's seven positions.
        touchable: Numbers of the supports that links with a pad may touch.
        finger_of_geom: Finger of each geom, -1 for the palm, -2 for what is not the hand, (n_geoms,).
        pads: Whether each geom is on a link that carries a pad, (n_geoms,).
        obstacle_of_geom: Number of each geom's obstacle or support, -1 for none, (n_geoms,).
        joint_qpos: Position of every joint of the hand, (N,).
        joint_dofs: Its degree of freedom, (N,).
        joint_controls: Controls of the drivers' servos, (A,).
        drivers: Joints that motors turn, (A,).
        coupling: S, joints by those drivers, (N, A).
        carriage_controls: Controls of the palm's slides x, y, z, (3,).
        carriage_qpos: Positions of these slides, (3,).
    """

    hand: Hand
    model: Any
    data: Any
    object_body: int
    object_qpos: int
    touchable: frozenset[int]
    finger_of_geom: NDArray[np.int64]
    pads: NDArray[np.bool_]
    obstacle_of_geom: NDArray[np.int64]
    joint_qpos: NDArray[np.int64]
    joint_dofs: NDArray[np.int64]
    joint_controls: NDArray[np.int64]
    drivers: NDArray[np.int64]
    coupling: NDArray[np.float64]
    carriage_controls: NDArray[np.int64]
    carriage_qpos: NDArray[np.int64]

    @classmethod
    def build(
        cls,
        hand: Hand,
        pieces: ConvexPieces,
        scene: PreparedScene,
        world_from_palm: NDArray[np.float64],
        stiffness: NDArray[np.float64],
        damping: NDArray[np.float64],
    ) -> Self:
        """Compile the world.

        Args:
            hand: The hand.
            pieces: The object as it collides.
            scene: What is around, with the object's pose.
            world_from_palm: Where the palm is when its carriage is at zero, (4, 4).
            stiffness: Stiffness of the drivers' servos, (A,) [N m/rad].
            damping: Their damping, (A,) [N m s/rad].
        """
        spec, chains = hand.spec(), finger_chains(hand)
        for body in scene.constraints.end_effector.attached_bodies:
            shape = body.primitive.to_mujoco()
            spec.body(hand.palm).add_geom(pos=body.pose.position, quat=body.pose.wxyz, mass=0, **shape)
        mount_hand(spec, hand)
        limit_joints(spec, hand)
        drive_joints(spec, hand)
        _mount_carriage(spec, hand, world_from_palm)
        add_object(spec, pieces)
        requested = scene.constraints.scene
        for number, surface in enumerate(requested.support_surfaces):
            _add_support(spec, number, surface)
        for number, obstacle in enumerate(requested.obstacles, len(requested.support_surfaces)):
            _add_obstacle(spec, number, obstacle)
        spec.option.gravity = requested.gravity
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio, spec.option.noslip_iterations = IMPRATIO, NOSLIP_ITERATIONS
        model = spec.compile()
        servos = [model.actuator(servo_name(name)).id for name in hand.driver_names]
        model.actuator_gainprm[servos, 0], model.actuator_biasprm[servos, 1] = stiffness, -stiffness
        model.actuator_biasprm[servos, 2] = -damping
        joints = [model.joint(name) for name in hand.joint_names]
        finger_of_geom, pads, obstacle_of_geom = _label_geoms(model, chains)
        return cls(
            hand=hand,
            model=model,
            data=mujoco.MjData(model),
            object_body=model.body(OBJECT).id,
            object_qpos=int(model.joint(OBJECT).qposadr[0]),
            touchable=frozenset(
                number for number, surface in enumerate(requested.support_surfaces) if surface.allow_finger_contact
            ),
            finger_of_geom=finger_of_geom,
            pads=pads,
            obstacle_of_geom=obstacle_of_geom,
            joint_qpos=np.array([joint.qposadr[0] for joint in joints]),
            joint_dofs=np.array([joint.dofadr[0] for joint in joints]),
            joint_controls=np.array(servos),
            drivers=np.array([hand.joint_names.index(name) for name in hand.driver_names]),
            coupling=hand.model.coupling.matrix[:, list(hand.drivers)],
            carriage_controls=np.array([model.actuator(f"carriage_{axis}").id for axis in "xyz"]),
            carriage_qpos=np.array([model.joint(f"carriage_{axis}").qposadr[0] for axis in "xyz"]),
        )

    def set_object(
        self,
        mass: float,
        center: NDArray[np.float64],
        inertia: NDArray[np.float64],
        friction: float,
        torsional: float,
        support_friction: float,
    ) -> None:
        """Mass [kg], centre (3,) [m] and inertia about it (3, 3) [kg m^2] of the object, and frictions.

        In contacts of the hand its sliding and torsional [m] friction count, else ``support_friction``.
        """
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        body = self.object_body
        self.model.body_mass[body], self.model.body_inertia[body] = mass, moments
        self.model.body_ipos[body], self.model.body_iquat[body] = center, wxyz_from_rotation(axes)
        self.model.geom_friction[:, 0] = support_friction
        self.model.geom_friction[self.finger_of_geom > -2, :2] = friction, torsional
        mujoco.mj_setConst(self.model, self.data)

    def place(self, world_from_object: NDArray[np.float64], joints: NDArray[np.float64]) -> None:
        """The object where it stands, the hand's joints at (N,) [rad], all at rest."""
        mujoco.mj_resetData(self.model, self.data)
        where = self.data.qpos[self.object_qpos : self.object_qpos + 7]
        where[:3], where[3:] = world_from_object[:3, 3], wxyz_from_rotation(world_from_object[:3, :3])
        self.data.qpos[self.joint_qpos] = joints
        self.data.ctrl[self.joint_controls] = joints[self.drivers]
        mujoco.mj_forward(self.model, self.data)

    def raise_object(self, up: NDArray[np.float64]) -> float:
        """Lift an object whose pieces stand in something that does not move out of it along ``up``; how far [m]."""
        raised = 0.0
        for _ in range(20):
            depths = [
                -contact.dist
                for contact in self.data.contact
                if self.obstacle_of_geom[list(contact.geom)].max() >= 0
                and self.finger_of_geom[list(contact.geom)].max() == -2
            ]
            if not depths or max(depths) < 1e-5:
                break
            raised += max(depths)
            self.data.qpos[self.object_qpos : self.object_qpos + 3] += max(depths) * up
            mujoco.mj_forward(self.model, self.data)
        return raised

    def finger_jacobians(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocity of a point (F, 3) [m] of every finger's last link by the hand's drivers, (F, 3, A) [m/rad]."""
        jacobians = np.empty((len(points), 3, self.model.nv))
        for finger, (point, jacobian) in enumerate(zip(points, jacobians, strict=True)):
            body = self.model.geom_bodyid[(self.finger_of_geom == finger) & self.pads][0]
            mujoco.mj_jac(self.model, self.data, jacobian, None, point, body)
        return jacobians[:, :, self.joint_dofs] @ self.coupling

    @property
    def object_pose(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin (3,) [m] and quaternion (4,) of the object frame."""
        where = self.data.qpos[self.object_qpos : self.object_qpos + 7]
        return where[:3].copy(), where[3:].copy()

    def touching(self) -> tuple[NDArray[np.bool_], int | None]:
        """Whether each finger touches the object, (F,); and the obstacle that the hand touches, if any."""
        fingers, obstacle = np.zeros(len(self.hand.fingers), np.bool_), None
        for contact in self.data.contact:
            if contact.dist > 0.0:
                continue
            first, second = contact.geom
            if self.finger_of_geom[first] == -2:
                first, second = second, first
            finger = self.finger_of_geom[first]
            if finger == -2:
                continue
            if self.model.geom_bodyid[second] == self.object_body and finger >= 0:
                fingers[finger] = True
            number = int(self.obstacle_of_geom[second])
            if number >= 0 and not (self.pads[first] and number in self.touchable):
                obstacle = number
        return fingers, obstacle


_OBSTACLE = "obstacle "
"""Begins the name of every geom that stands around the object; its number follows."""


def _mount_carriage(spec: Any, hand: Hand, world_from_palm: NDArray[np.float64]) -> None:
    """The palm on driven slides along the world's axes."""
    palm = spec.body(hand.palm)
    palm.pos, palm.quat = world_from_palm[:3, 3], wxyz_from_rotation(world_from_palm[:3, :3])
    stiffness, damping = CARRIAGE_MASS * CARRIAGE_FREQUENCY**2, 2 * CARRIAGE_MASS * CARRIAGE_FREQUENCY
    for axis, direction in zip("xyz", world_from_palm[:3, :3], strict=True):  # row k: the world's axis k in the palm
        name, slide = f"carriage_{axis}", mujoco.mjtJoint.mjJNT_SLIDE
        palm.add_joint(name=name, type=slide, axis=direction, armature=CARRIAGE_MASS)
        servo = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
        servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        servo.gainprm[0], servo.biasprm[1], servo.biasprm[2] = stiffness, -stiffness, -damping


def _add_support(spec: Any, number: int, surface: SupportSurface) -> None:
    pose = surface.scene_from_surface
    if surface.extents is None:
        kind, size, center = mujoco.mjtGeom.mjGEOM_PLANE, [0.0, 0.0, 1.0], pose[:3, 3]
    else:
        kind, size = mujoco.mjtGeom.mjGEOM_BOX, [surface.extents[0] / 2, surface.extents[1] / 2, SUPPORT_DEPTH / 2]
        center = pose[:3, 3] - SUPPORT_DEPTH / 2 * pose[:3, 2]
    quaternion = wxyz_from_rotation(pose[:3, :3])
    spec.worldbody.add_geom(
        name=f"{_OBSTACLE}{number}", type=kind, size=size, pos=center, quat=quaternion, condim=CONDIM
    )


def _add_obstacle(spec: Any, number: int, obstacle: Obstacle) -> None:
    """The geoms of one obstacle."""
    pose, name = obstacle.pose, f"{_OBSTACLE}{number}"
    if obstacle.primitive is not None:
        shape = obstacle.primitive.to_mujoco()
        spec.worldbody.add_geom(name=name, pos=pose.position, quat=pose.wxyz, condim=CONDIM, **shape)
    elif obstacle.points is not None:
        _add_balls(spec, name, transform_points(pose.matrix, obstacle.points), obstacle.point_radius)
    elif obstacle.model is not None:
        for part, (vertices, faces) in enumerate(decompose(obstacle.model.mesh).pieces):
            piece = f"{name} {part}"
            shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
            spec.add_mesh(name=piece, uservert=vertices.ravel(), userface=faces.ravel(), inertia=shell)
            kind = mujoco.mjtGeom.mjGEOM_MESH
            spec.worldbody.add_geom(name=piece, type=kind, meshname=piece, pos=pose.position, quat=pose.wxyz)


def _add_balls(spec: Any, name: str, points: NDArray[np.float64], radius: float) -> None:
    kept = points[thin_evenly(points, CLOUD_SPACING)]
    for part, point in enumerate(kept):
        spec.worldbody.add_geom(
            name=f"{name} {part}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[max(radius, MIN_POINT_RADIUS), 0, 0],
            pos=point,
            condim=CONDIM,
        )


def _label_geoms(
    model: Any, chains: Sequence[Sequence[str]]
) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.int64]]:
    """``finger_of_geom``, ``pads`` and ``obstacle_of_geom`` of a `PickWorld`."""
    fingers, pads = np.full(model.ngeom, -2, np.int64), np.zeros(model.ngeom, np.bool_)
    bodies = model.geom_bodyid
    fingers[(bodies != 0) & (bodies != model.body(OBJECT).id)] = -1  # parked fingers count as palm
    for finger, chain in enumerate(chains):
        for name in chain:
            fingers[bodies == model.body(name).id] = finger
        pads |= bodies == model.body(chain[-1]).id
    names = [str(model.geom(g).name) for g in range(model.ngeom)]
    numbers = [int(name.split()[1]) if name.startswith(_OBSTACLE) else -1 for name in names]
    return fingers, pads, np.array(numbers)
