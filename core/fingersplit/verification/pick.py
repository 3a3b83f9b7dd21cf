"""Verify one grasp by a whole pick: plan the grip, build the world, run, and say what happened."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.contacts.grip import Grip, GripProblem, least_grip
from fingersplit.errors import SettingsError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.scene.preparing import PreparedScene
from fingersplit.verification.controllers import PositionServo
from fingersplit.verification.pick_world import PickWorld
from fingersplit.verification.picking import PickMotion, PickReport, PickWays, run_pick
from fingersplit.verification.protocols.pick import Pick

__all__ = ["verify_pick"]

LEAST_JERK_PEAK = 5.7735
"""Largest acceleration of the curve of least jerk over one metre in one second [m/s^2]."""


def verify_pick(
    grasp: Grasp,
    hand: Hand,
    model: ObjectModel,
    pieces: ConvexPieces,
    scene: PreparedScene,
    ways: PickWays,
    protocol: Pick | None = None,
    *,
    friction: float = DEFAULT_FRICTION,
    planned_friction: float = DEFAULT_FRICTION,
    controller: PositionServo | None = None,
) -> PickReport:
    """Simulate a whole pick; the same arguments give the same numbers.

    Args:
        grasp: The grasp.
        hand: Its hand.
        model: The object.
        pieces: The same object as the simulation collides it.
        scene: What is around; it has a support surface.
        ways: How it is reached and left.
        protocol: Times and bounds; None for the preset.
        friction: Sliding friction between hand and object in the simulation.
        planned_friction: Sliding friction that the grip is planned for.
        controller: Position servos with numbers of one's own.

    Returns:
        What happened.

    Raises:
        SettingsError: The scene has no support surface, or the grasp no approach.
    """
    protocol, controller = protocol or Pick(), controller or PositionServo()
    if not scene.constraints.scene.support_surfaces:
        raise SettingsError("Protocol 'pick' needs a scene with a support surface that the object rests on.")
    if not ways.approach_distance > 0.0:
        raise SettingsError("Protocol 'pick' needs a grasp with a free approach; this one has none.")
    palm = scene.world_from_object @ grasp.object_from_palm
    world = PickWorld.build(hand, pieces, scene, palm, controller.give, controller.damping_time)
    torsional = protocol.torsional_friction * friction / DEFAULT_FRICTION
    world.set_object(model.mass, model.center_of_mass, model.inertia, friction, torsional, protocol.support_friction)
    pressed, grip = _pressed(world, grasp, model, scene, ways, protocol, controller, planned_friction)
    forces = [(x, y, z) for x, y, z in (grip.forces @ scene.world_from_object[:3, :3]).tolist()]
    motion = PickMotion(ways, grasp.joints, pressed, tuple(forces), grip.violation)
    return run_pick(world, motion, scene, protocol)


def _pressed(
    world: PickWorld,
    grasp: Grasp,
    model: ObjectModel,
    scene: PreparedScene,
    ways: PickWays,
    protocol: Pick,
    controller: PositionServo,
    planned_friction: float,
) -> tuple[NDArray[np.float64], Grip]:
    """Servo targets (N,) [rad] that press with the least grip which carries the object along its retreat; the grip."""
    hand, pose = world.hand, scene.world_from_object
    rotation, gravity = pose[:3, :3], np.array(scene.constraints.scene.gravity)
    world.place(pose, grasp.joints)
    speed_up = LEAST_JERK_PEAK * ways.retreat_distance / protocol.lift_time**2 * (rotation @ ways.retreat)
    jacobians = world.finger_jacobians(grasp.fingertips @ rotation.T + pose[:3, 3])
    grip = least_grip(
        GripProblem(
            contacts=grasp.contacts @ rotation.T + pose[:3, 3],
            normals=grasp.normals @ rotation.T,
            jacobians=jacobians,
            torque_limits=hand.torque_limits,
            center_of_mass=rotation @ model.center_of_mass + pose[:3, 3],
            friction=controller.friction_margin * planned_friction,
            least_forces=np.full(len(hand.fingers), controller.least_force),
            loads=controller.load_margin * model.mass * np.array([gravity, gravity - speed_up, gravity + speed_up]),
        )
    )
    torques = np.einsum("fkn,fk->n", jacobians, grip.forces)
    press = np.clip(controller.give * torques / hand.torque_limits, -controller.give, controller.give)
    return np.asarray(grasp.joints + world.coupling @ press), grip
