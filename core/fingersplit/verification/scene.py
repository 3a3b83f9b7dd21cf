"""The simulated world: the planner's own hand, its palm fixed, the object's convex pieces, a controller's actuators.

One scene serves every grasp of an object: poses, friction and mass are written into the compiled model, never into its
description. World frame: the object frame when the simulation starts, z up. Where a protocol moves the palm, the
simulation runs in the palm's accelerated frame, with inertial forces on every body: exact, and cheaper than a carriage.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Literal, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.transforms import wxyz_from_rotation
from fingersplit.verification.scene_parts import (
    CONDIM,
    OBJECT,
    SOLIMP,
    SOLREF,
    add_object,
    add_sensors,
    drive_fingertips,
    drive_joints,
    finger_chains,
    fingertip_servo_names,
    grip_site,
    limit_joints,
    mount_hand,
    pair_name,
    servo_name,
)

__all__ = ["Driven", "Scene"]

Driven = Literal["joints", "fingertips"]
"""What a controller's actuators move."""

IMPRATIO, NOSLIP_ITERATIONS = 10, 2
"""With elliptic cones these keep a held object from creeping through the fingers."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled world and where its parts are.

    Attributes:
        hand: The hand.
        model: Compiled ``MjModel``; used by one thread at a time.
        data: Its ``MjData``.
        palm_body: Body of the palm.
        object_body: Body of the object.
        object_qpos: First of the object's seven positions.
        finger_bodies: Bodies of each finger from the palm outwards.
        joint_qpos: Position of every joint of the hand, (N,).
        joint_dofs: Its degree of freedom, (N,).
        grip_sites: Where each finger touches, (F,).
        pairs: Pairs of fingers with a virtual spring between them, (P, 2).
        part_of_body: Finger that each body belongs to, -1 for all others, (n_bodies,).
        moving_bodies: Bodies that feel inertial forces: the fingers and the object.
        servo_controls: Controls of the fingertip servos along the palm's axes, (F, 3); none where joints are driven.
        pair_controls: Controls of the virtual springs, (P,); none where joints are driven.
        driver_qpos: Position of every driver of the active fingers, (A,).
        coupling: S, joints by those drivers, (N, A).
        joint_controls: Controls of the drivers' servos, (A,); none where fingertips are driven.
    """

    hand: Hand
    model: Any
    data: Any
    palm_body: int
    object_body: int
    object_qpos: int
    finger_bodies: tuple[tuple[int, ...], ...]
    joint_qpos: NDArray[np.int64]
    joint_dofs: NDArray[np.int64]
    grip_sites: NDArray[np.int64]
    pairs: NDArray[np.int64]
    part_of_body: NDArray[np.int64]
    moving_bodies: NDArray[np.int64]
    servo_controls: NDArray[np.int64]
    pair_controls: NDArray[np.int64]
    driver_qpos: NDArray[np.int64]
    coupling: NDArray[np.float64]
    joint_controls: NDArray[np.int64]
    _rollout_data: list[Any] = field(default_factory=list)

    @classmethod
    def build(cls, hand: Hand, pieces: ConvexPieces, driven: Driven = "joints") -> Self:
        """Compile the scene of a hand and an object: a few tenths of a second, then good for all grasps."""
        spec, chains = hand.spec(), finger_chains(hand)
        mount_hand(spec, hand)
        limit_joints(spec, hand)
        by_joints = driven == "joints"
        (drive_joints if by_joints else drive_fingertips)(spec, hand)
        add_object(spec, pieces)
        add_sensors(spec, hand, chains)
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio, spec.option.noslip_iterations = IMPRATIO, NOSLIP_ITERATIONS
        model = spec.compile()
        joints = [model.joint(name) for name in hand.joint_names]
        fingers = [finger.name for finger in hand.fingers]
        springs = [pair_name(a, b) for a, b in combinations(fingers, 2)]
        bodies = [model.body(link.name).id for link in hand.model.links[1:]]
        return cls(
            hand=hand,
            model=model,
            data=mujoco.MjData(model),
            palm_body=model.body(hand.palm).id,
            object_body=model.body(OBJECT).id,
            object_qpos=int(model.joint(OBJECT).qposadr[0]),
            finger_bodies=tuple(tuple(model.body(name).id for name in chain) for chain in chains),
            joint_qpos=np.array([joint.qposadr[0] for joint in joints]),
            joint_dofs=np.array([joint.dofadr[0] for joint in joints]),
            grip_sites=np.array([model.site(grip_site(name)).id for name in fingers]),
            pairs=np.array(list(combinations(range(len(fingers)), 2))),
            part_of_body=_parts(model, chains),
            moving_bodies=np.array([*bodies, model.body(OBJECT).id]),
            servo_controls=_actuators(model, [] if by_joints else [fingertip_servo_names(name) for name in fingers]),
            pair_controls=_actuators(model, [] if by_joints else springs),
            joint_controls=_actuators(model, [servo_name(name) for name in hand.driver_names] if by_joints else []),
            driver_qpos=np.array([model.joint(name).qposadr[0] for name in hand.driver_names]),
            coupling=hand.model.coupling.matrix[:, list(hand.drivers)],
        )

    def copy(self) -> "Scene":
        """The same scene for another thread."""
        model = copy.copy(self.model)
        return replace(self, model=model, data=mujoco.MjData(model), _rollout_data=[])

    def rollout_data(self, count: int) -> list[Any]:
        """``MjData`` (count) for rollouts, kept between them."""
        while len(self._rollout_data) < count:
            self._rollout_data.append(mujoco.MjData(self.model))
        return self._rollout_data[:count]

    def set_object(self, mass: float, center_of_mass: NDArray[np.float64], inertia: NDArray[np.float64]) -> None:
        """Mass [kg], its centre (3,) [m] and inertia (3, 3) [kg m^2] about that centre, in the object frame."""
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        body = self.object_body
        self.model.body_mass[body], self.model.body_inertia[body] = mass, moments
        self.model.body_ipos[body], self.model.body_iquat[body] = center_of_mass, wxyz_from_rotation(axes)

    def set_friction(self, sliding: NDArray[np.float64], torsional: NDArray[np.float64]) -> None:
        """Sliding and torsional [m] friction of each finger (F,) against the object; the palm takes their means.

        The hand's shapes have priority, so in a contact theirs is the friction that counts, not the object's.
        """
        friction = self.model.geom_friction
        friction[:, 0], friction[:, 1] = sliding.mean(), torsional.mean()
        fingers = self.part_of_body[self.model.geom_bodyid]  # of shapes
        of_fingers = fingers >= 0
        friction[of_fingers, 0] = sliding[fingers[of_fingers]]
        friction[of_fingers, 1] = torsional[fingers[of_fingers]]

    def place(self, grasp: Grasp) -> None:
        """Object at the world's origin, hand where the grasp has it, everything at rest.

        Each finger's grip site goes to the point of its pad that faces the planned contact.
        """
        model, data = self.model, self.data
        model.body_pos[self.palm_body] = grasp.object_from_palm[:3, 3]
        model.body_quat[self.palm_body] = wxyz_from_rotation(grasp.object_from_palm[:3, :3])
        mujoco.mj_setConst(model, data)
        mujoco.mj_resetData(model, data)
        self.set_joints(grasp.joints)
        for site, tip in zip(self.grip_sites, grasp.fingertips, strict=True):
            body = model.site_bodyid[site]
            model.site_pos[site] = (tip - data.xpos[body]) @ data.xmat[body].reshape(3, 3)
        mujoco.mj_forward(model, data)

    def move_object(self, moved: NDArray[np.float64]) -> None:
        """The object at a pose (4, 4) in the world, in which the planned one is the identity."""
        where = self.data.qpos[self.object_qpos : self.object_qpos + 7]
        where[:3], where[3:] = moved[:3, 3], wxyz_from_rotation(moved[:3, :3])
        mujoco.mj_forward(self.model, self.data)

    def object_pose(self) -> NDArray[np.float64]:
        """Position (3) [m] and quaternion (4) of the object frame, (7,)."""
        return np.asarray(self.data.qpos[self.object_qpos : self.object_qpos + 7].copy())

    def set_joints(self, joints: NDArray[np.float64]) -> None:
        """Joint angles (N,) [rad], and all that follows from them."""
        self.data.qpos[self.joint_qpos] = joints
        mujoco.mj_forward(self.model, self.data)

    def drivers_of(self, joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Angles of the drivers (A,) [rad] among joints (N,)."""
        return joints[[self.hand.joint_names.index(name) for name in self.hand.driver_names]]

    def finger_jacobians(self) -> NDArray[np.float64]:
        """Velocity of every grip site by the hand's drivers, J S, (F, 3, A) [m/rad], world frame."""
        jacobians = np.empty((len(self.grip_sites), 3, self.model.nv))
        for site, jacobian in zip(self.grip_sites, jacobians, strict=True):
            mujoco.mj_jacSite(self.model, self.data, jacobian, None, site)
        return jacobians[:, :, self.joint_dofs] @ self.coupling

    def finger_masses(self) -> NDArray[np.float64]:
        """Mass of each finger (F,) [kg]."""
        return np.array([self.model.body_mass[list(chain)].sum() for chain in self.finger_bodies])

    def penetrations(self) -> NDArray[np.float64]:
        """Deepest penetration into the object of each finger and of the palm, (F + 1,) [m], zero where none."""
        depths, contacts = np.zeros(len(self.finger_bodies) + 1), self.data.contact
        bodies = self.model.geom_bodyid[contacts.geom]  # (n, 2)
        on_object = bodies == self.object_body
        touching = on_object.any(axis=1)
        others = np.where(on_object[:, 0], bodies[:, 1], bodies[:, 0])[touching]
        np.maximum.at(depths, self.part_of_body[others], -contacts.dist[touching])
        return depths

    def grips_in_palm(self) -> NDArray[np.float64]:
        """Grip sites in the palm frame, (F, 3) [m]."""
        data, palm = self.data, self.palm_body
        return np.asarray((data.site_xpos[self.grip_sites] - data.xpos[palm]) @ data.xmat[palm].reshape(3, 3))

    def solver_document(self, step: float) -> dict[str, Any]:
        """How MuJoCo solves this scene in steps of so many seconds, as plain JSON data."""
        return {
            "integrator": "implicitfast",
            "cone": "elliptic",
            "impratio": IMPRATIO,
            "noslip_iterations": NOSLIP_ITERATIONS,
            "time_step": step,
            "contacts": {"condim": CONDIM, "solref": SOLREF, "solimp": SOLIMP},
        }

    def set_gains(self, actuators: NDArray[np.int64], stiffness: ArrayLike, damping: ArrayLike) -> None:
        """Stiffness and damping of servos, one number or one each, SI units."""
        self.model.actuator_gainprm[actuators, 0] = stiffness
        self.model.actuator_biasprm[actuators, 1] = -np.asarray(stiffness)
        self.model.actuator_biasprm[actuators, 2] = -np.asarray(damping)


def _actuators(model: Any, names: ArrayLike) -> NDArray[np.int64]:
    """Numbers of named actuators, in the shape of ``names``."""
    named = np.asarray(names, object)
    return np.array([model.actuator(name).id for name in named.ravel()], np.int64).reshape(named.shape)


def _parts(model: Any, chains: Sequence[Sequence[str]]) -> NDArray[np.int64]:
    """Finger of each body, -1 for those of none."""
    parts = np.full(model.nbody, -1)
    for finger, chain in enumerate(chains):
        parts[[model.body(name).id for name in chain]] = finger
    return parts
