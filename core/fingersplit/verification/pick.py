"""Verify one grasp by a whole pick, executed as published: build the world, run, and say what happened."""

from collections.abc import Callable

import numpy as np

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.contacts.grip_plan import GripPlan, plan_grip
from fingersplit.errors import SettingsError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.scene.preparing import PreparedScene
from fingersplit.verification.pick_world import PickWorld
from fingersplit.verification.picking import PickMotion, PickReport, PickWays, run_pick
from fingersplit.verification.protocol import torsion_in
from fingersplit.verification.protocols.pick import Pick

__all__ = ["verify_pick"]


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
    grip: GripPlan | None = None,
    watch: Callable[[PickWorld], None] | None = None,
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
        planned_friction: Sliding friction that the grip is planned for where none is given.
        grip: The published grip; None to plan it.
        watch: Is shown the world after every step.

    Returns:
        What happened.

    Raises:
        SettingsError: The scene has no support surface, or the grasp no approach.
    """
    protocol = protocol or Pick()
    if not scene.constraints.scene.support_surfaces:
        raise SettingsError("Protocol 'pick' needs a scene with a support surface that the object rests on.")
    if not ways.approach_distance > 0.0:
        raise SettingsError("Protocol 'pick' needs a grasp with a free approach; this one has none.")
    if grip is None:
        grip = plan_grip(grasp, hand, friction=planned_friction, mass=model.mass, center_of_mass=model.center_of_mass)
    palm = scene.world_from_object @ grasp.object_from_palm
    world = PickWorld.build(hand, pieces, scene, palm, grip.stiffness, grip.damping)
    pressed = -(grasp.normals * grip.forces).sum(axis=1)
    torsional = float(torsion_in(protocol, np.full(len(pressed), friction), pressed, hand).mean())
    world.set_object(model.mass, model.center_of_mass, model.inertia, friction, torsional, protocol.support_friction)
    return run_pick(world, PickMotion(ways, grasp.joints, grip.targets), scene, protocol, watch)
