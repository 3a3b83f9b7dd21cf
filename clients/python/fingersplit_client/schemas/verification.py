"""Verification reports: what simulating a grasp showed.

Written by ``python -m fingersplit.result.schema``; change the dataclasses there.
"""

from typing import Literal

from pydantic import Field, JsonValue

from fingersplit_client.schemas.base import Document, Vector3

__all__ = [
    "Verification",
    "VerificationGrip",
    "VerificationPhase",
    "VerificationReason",
    "VerificationSummary",
    "VerificationTrial",
]

VerificationReason = Literal[
    "held",
    "slipped",
    "rotated",
    "contact_lost",
    "initial_penetration",
    "unstable_simulation",
    "joint_torque_saturated",
    "not_at_rest",
    "obstacle_touched",
    "object_pushed",
]
"""Why a grasp passed or failed; only ``held`` is a pass."""


class VerificationPhase(Document):
    """One phase of a simulation in numbers."""

    name: str = Field(description="What was done.")
    duration: float = Field(description="How long [s].")
    displacement: float = Field(
        description="Farthest that the object's centre of mass was from its place in the hand before the hand closed, "
        "or, after that, when it had closed [m].",
    )
    rotation: float = Field(description="Most that the object had turned in the hand since then [rad].")
    lost_contacts: list[str] = Field(description="Fingers that did not touch when the phase ended.")
    contact_force: Vector3 = Field(
        description="Sum of the contact forces on the object over the last 0.1 s, world frame [N]."
    )
    load: Vector3 = Field(description="Gravity and pull at the phase's end, world frame [N].")
    largest_force: float = Field(description="Largest contact force of one finger [N].")
    largest_penetration: float = Field(description="Deepest that the hand was pressed into the object [m].")
    saturated_joints: list[str] = Field(description="Joints that spent a tenth of the phase at their torque limit.")


class VerificationTrial(Document):
    """What was done after the squeeze, and the verdict on it."""

    name: str = Field(description="What distinguishes this trial, such as the direction of a pull.")
    passed: bool = Field(description="Whether the object was held.")
    reason: VerificationReason = Field(description="Why it was or was not.")
    phases: list[VerificationPhase] = Field(description="The phases; empty when the simulation diverged.")


class VerificationGrip(Document):
    """The grip that the simulation pressed with: the published one, or the virtual frame's for the protocol's loads.

    It balances itself; the forces in `contacts` of the grasp carry the object's weight.
    """

    forces: list[Vector3] = Field(description="Force of each finger on the unloaded object, object frame [N].")
    violation: float = Field(description="Farthest that a planned contact force leaves its friction cone [N].")
    limited: bool = Field(default=False, description="Whether the joints have too little torque for a safer grip.")


class Verification(Document):
    """Report of a grasp's simulation."""

    protocol: str = Field(description="Name of the protocol.")
    passed: bool = Field(description="Whether the grasp held in every trial.")
    held_firmly: bool = Field(
        description="Whether it held with a slip below 5 mm and a turn below 5 degrees, both while the hand closed "
        "and after.",
    )
    slip: float | None = Field(
        description="Farthest that the object moved in the closed hand in any trial [m]; null when no trial was "
        "simulated.",
    )
    turn: float | None = Field(
        description="Most that the object turned in the closed hand in any trial [rad]; null when no trial was "
        "simulated.",
    )
    reason: VerificationReason = Field(
        description="Why it passed or not; of several failed trials, the first one's reason."
    )
    explanation: str = Field(description="The reason in a sentence.")
    simulator: str = Field(description="Name and version of the simulator.")
    settings: dict[str, JsonValue] = Field(
        description="Every number of protocol, controller, object and solver, SI units and radians."
    )
    initial_penetration: float = Field(description="Deepest that the planned hand lies inside the object [m].")
    grip: VerificationGrip = Field(description="How hard the fingers were to grip.")
    squeeze: VerificationPhase | None = Field(description="The squeeze; null when the simulation did not get there.")
    trials: list[VerificationTrial] = Field(description="What was done after the squeeze.")
    time_ms: float = Field(description="Time that the verification took [ms].")
    closing: VerificationPhase | None = Field(
        default=None,
        description="The closing from the pre-grasp to the planned grasp; null for a hand that started there.",
    )
    touching: list[str] | None = Field(
        default=None,
        description="Fingers that touched the object when the hand had closed; protocols that need no contact pass "
        "without. Null when nothing was simulated, and for picks.",
    )


class VerificationSummary(Document):
    """How the verification of ranked grasps went."""

    protocol: str = Field(description="Name of the protocol.")
    controller: str = Field(description="Name of the controller.")
    wanted: int = Field(description="How many grasps were to hold.")
    tried: int = Field(description="How many were verified, from rank 1 on.")
    held: int = Field(description="How many of these held.")
    message: str = Field(description="The outcome in a sentence.")
    time_ms: float = Field(description="Time that it took [ms].")
