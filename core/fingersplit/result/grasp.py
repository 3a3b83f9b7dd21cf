"""One planned grasp as plain data."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip_plan import GripPlan
from fingersplit.errors import ResultError
from fingersplit.grasp import Grasp, HandPose
from fingersplit.hands.hand import Hand
from fingersplit.result.grip import PlannedGrip
from fingersplit.result.scene import Clearance, Way, WorldPoses
from fingersplit.result.verification import Verification
from fingersplit.result.wire import Quaternion, Vector3, described
from fingersplit.splitting.termination import Termination
from fingersplit.transforms import pose_matrix, rotation_from_wxyz, wxyz_from_rotation

__all__ = [
    "Contact",
    "GraspMetrics",
    "GraspResult",
    "GraspTimings",
    "HoldProbability",
    "InitialGrasp",
    "Iterations",
    "PalmPose",
    "ParallelContacts",
    "Pregrasp",
    "SplitGrasp",
    "joints_in_order",
]

GraspMetrics = dict[str, float | None]
"""Every metric of a grasp by its name in ``contacts.metrics``."""


@dataclass(frozen=True)
class ParallelContacts:
    """Two opposite contacts of a parallel-jaw gripper: what a finger-splitting run starts from."""

    contacts: tuple[Vector3, Vector3] = described(
        "The two contact points on the surface, object frame", "m", examples=[[[0.03, 0.0, 0.05], [-0.03, 0.0, 0.05]]]
    )
    approach: Vector3 = described(
        "Direction in which the palm moves towards the object, object frame, unit length", examples=[[0.0, 0.0, -1.0]]
    )


@dataclass(frozen=True)
class PalmPose:
    """Where the palm is."""

    position: Vector3 = described("Origin of the palm frame in the object frame", "m")
    wxyz: Quaternion = described("Rotation from the palm frame to the object frame, unit quaternion")

    @classmethod
    def from_matrix(cls, object_from_palm: NDArray[np.float64]) -> Self:
        """The palm at a pose (4, 4)."""
        position, wxyz = object_from_palm[:3, 3].tolist(), wxyz_from_rotation(object_from_palm[:3, :3]).tolist()
        return cls((position[0], position[1], position[2]), (wxyz[0], wxyz[1], wxyz[2], wxyz[3]))

    @property
    def object_from_palm(self) -> NDArray[np.float64]:
        """The pose as a matrix, (4, 4)."""
        return pose_matrix(rotation_from_wxyz(self.wxyz), self.position)


@dataclass(frozen=True)
class Contact:
    """One finger on the surface."""

    finger: str = described("Name of the finger")
    position: Vector3 = described("Contact point on the surface, object frame", "m")
    normal: Vector3 = described("Surface normal at the contact, out of the object, object frame")
    fingertip: Vector3 = described("Point of the pad that faces the contact, object frame", "m")
    residual: float = described("How far the pad is from just touching the contact", "m")
    pad_angle: float = described(
        "Angle of the pad's normal to the inward surface normal, or to where its cap touches if that is more", "rad"
    )
    force: Vector3 | None = described(
        "Force of the finger on the object that carries its weight with gravity in the worst direction, object frame; "
        "null where none can. How hard the fingers press on the unloaded object stands in `grip`",
        "N",
    )
    assumed: bool = described(
        "Whether the surface there was not seen but assumed, as in a completed cloud", default=False
    )


@dataclass(frozen=True)
class Iterations:
    """How many iterations a run took."""

    outer: int = described("Rounds of contact and palm optimization")
    cpo: int = described("Iterations of contact point optimization (CPO), over all rounds")
    ppo: int = described("Iterations of palm pose optimization (PPO), over all rounds")


@dataclass(frozen=True)
class GraspTimings:
    """Where the time of one run went."""

    cpo_tangent_search: float = described("CPO: searching along the surface", "ms")
    cpo_projection_and_test: float = described("CPO: returning to the surface and testing", "ms")
    cpo_collision: float = described("CPO: collision checks", "ms")
    ppo_tangent_search: float = described("PPO: searching for a better palm pose", "ms")
    ppo_projection_and_test: float = described("PPO: keeping the contacts and testing", "ms")
    ppo_collision: float = described("PPO: collision checks", "ms")
    total: float = described("The whole run", "ms")


@dataclass(frozen=True)
class Pregrasp:
    """Where to come from: a free way to the grasp, straight along the palm's approach."""

    palm: PalmPose = described("The palm where the approach begins, in the object frame")
    joints: dict[str, float] = described("Joint angles by name during the approach, opened", "rad")


@dataclass(frozen=True)
class InitialGrasp:
    """What a run started from."""

    parallel_grasp: ParallelContacts = described("The parallel grasp, object frame")
    palm: PalmPose = described("The palm after the parallel grasp was mapped to the hand")
    joints: dict[str, float] = described("Joint angles by name after mapping", "rad")
    contacts: tuple[Contact, ...] = described("Contacts after mapping, one a finger")
    quality: float = described("The planner's objective Q after mapping, no unit")
    verification: Verification | None = described(
        "Report of this grasp's verification in simulation; null when it was not verified", default=None
    )

    def for_hand(self, hand: Hand) -> Grasp:
        """The mapped grasp as arrays."""
        return _grasp(hand, self.palm, self.joints, self.contacts)


@dataclass(frozen=True)
class SplitGrasp:
    """The grasp that the splitting ended with, where it was refined afterwards."""

    palm: PalmPose = described("The palm's pose in the object frame")
    joints: dict[str, float] = described("Joint angles by name", "rad")
    contacts: tuple[Contact, ...] = described("Contacts, one a finger")
    quality: float = described("The planner's objective Q, no unit")


@dataclass(frozen=True)
class HoldProbability:
    """How probably the executed grasp holds where pose, friction and mass are not exactly as planned."""

    value: float = described("Probability that the grasp holds, 0 to 1")
    tier: Literal["estimated", "simulated"] = described(
        "Where it comes from: estimated from surface and closing kinematics, or simulated executions"
    )
    robustness: Literal["robust", "fragile", "futile"] = described(
        "In a word: robust from 0.85 on, futile below 0.4, fragile between"
    )
    position_noise: float = described("Root mean square displacement of the object that is reckoned with", "m")
    rotation_noise: float = described("Root mean square turn of the object that is reckoned with", "rad")


@dataclass(frozen=True)
class GraspResult:
    """One planned grasp."""

    rank: int = described("Place in the ranking, 1 is best")
    feasible: bool = described("Whether every constraint holds; the same as geometry_valid")
    geometry_valid: bool = described("Whether the hand keeps every geometric constraint")
    carries_weight: bool = described(
        "Whether the fingers can support the object's weight for every tested gravity direction: the holding margin is "
        "not negative"
    )
    violations: tuple[str, ...] = described("A sentence for every constraint that does not hold")
    reason: str = described("Why the grasp stands at this rank, in a sentence")
    palm: PalmPose = described("The palm's pose in the object frame")
    joints: dict[str, float] = described("Joint angles by name", "rad")
    contacts: tuple[Contact, ...] = described("Contacts, one a finger")
    pregrasp: Pregrasp | None = described("How to get there; null when no straight way in is free")
    squeeze_joints: dict[str, float] = described(
        "Targets of position servos of the stiffness in grip, which press with its forces, by joint name", "rad"
    )
    grip: PlannedGrip = described("How hard to grip: forces, torques and servos")
    metrics: GraspMetrics = described("Every metric of the grasp by name; null where it has no number for it")
    termination: Termination = described("Why the run ended")
    advice: str = described("What the termination means and what to try, in a sentence")
    iterations: Iterations = described("How many iterations the run took")
    timings_ms: GraspTimings = described("Where the time of the run went", "ms")
    initial: InitialGrasp = described("What the run started from")
    verification: Verification | None = described(
        "Report of the grasp's verification in simulation; null when it was not verified", default=None
    )
    p_hold: HoldProbability | None = described(
        "How probably the grasp holds when it is executed under noise; null where it was not judged", default=None
    )
    split_grasp: SplitGrasp | None = described(
        "The grasp as the splitting left it; null where it was not refined", default=None
    )
    world: WorldPoses | None = described("Palm and tool in the scene's frame", default=None)
    approach_path: Way | None = described("The straight way in", default=None)
    retreat_path: Way | None = described("The way out with the object", default=None)
    clearance: Clearance | None = described(
        "Where the hand is nearest to what stands around the object; null where nothing is near", default=None
    )
    self_clearance: float | None = described(
        "Least distance of two links of the hand that may not meet, negative inside; null when over 5 mm",
        "m",
        default=None,
    )

    def for_hand(self, hand: Hand) -> Grasp:
        """The grasp as arrays.

        Raises:
            ResultError: Its joints or fingers are not those of the hand.
        """
        return _grasp(hand, self.palm, self.joints, self.contacts)

    def pregrasp_pose(self, hand: Hand) -> HandPose | None:
        """Where the approach begins; None when no straight way in is free."""
        if self.pregrasp is None:
            return None
        return HandPose(self.pregrasp.palm.object_from_palm, joints_in_order(hand, self.pregrasp.joints))

    def squeeze_pose(self, hand: Hand) -> HandPose:
        """The palm of the grasp and the targets of position servos that press the pads on."""
        return HandPose(self.palm.object_from_palm, joints_in_order(hand, self.squeeze_joints))

    def grip_plan(self, hand: Hand) -> GripPlan:
        """The grip as arrays.

        Raises:
            ResultError: Its drivers or fingers are not those of the hand.
        """
        return self.grip.to_plan(hand, joints_in_order(hand, self.squeeze_joints))

    @property
    def assumed_fingers(self) -> tuple[str, ...]:
        """Fingers whose contacts lie where the surface was not seen but assumed."""
        return tuple(contact.finger for contact in self.contacts if contact.assumed)

    @property
    def title(self) -> str:
        """One line that names rank and outcome."""
        verdict = "feasible" if self.feasible else "not feasible"
        return f"rank {self.rank}: {verdict}, {self.termination.label.replace('_', ' ')}"


def _grasp(hand: Hand, palm: PalmPose, joints: dict[str, float], contacts: tuple[Contact, ...]) -> Grasp:
    names = [finger.name for finger in hand.fingers]
    if [contact.finger for contact in contacts] != names:
        raise ResultError(f"The grasp has contacts of {[c.finger for c in contacts]}; {hand.name} has fingers {names}.")
    return Grasp(
        object_from_palm=palm.object_from_palm,
        joints=joints_in_order(hand, joints),
        contacts=np.array([contact.position for contact in contacts]),
        normals=np.array([contact.normal for contact in contacts]),
        fingertips=np.array([contact.fingertip for contact in contacts]),
        residuals=np.array([contact.residual for contact in contacts]),
        pad_angles=np.array([contact.pad_angle for contact in contacts]),
    )


def joints_in_order(hand: Hand, joints: dict[str, float]) -> NDArray[np.float64]:
    """Joint angles in the hand's order, (N,) [rad]."""
    if joints.keys() != set(hand.joint_names):
        raise ResultError(f"The grasp has joints {sorted(joints)}; {hand.name} has {sorted(hand.joint_names)}.")
    return np.array([joints[name] for name in hand.joint_names])
