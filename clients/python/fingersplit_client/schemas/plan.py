"""The result of planning: the same document in the API, in the client and on the command line.

Written by ``python -m fingersplit.result.schema``; change the dataclasses there.
"""

from typing import Literal

from pydantic import ConfigDict, Field, JsonValue

from fingersplit_client.schemas.base import Document, Quaternion, Vector3
from fingersplit_client.schemas.objects import CloudReport, IntakeReport, ObjectOptions, ObjectSource
from fingersplit_client.schemas.verification import Verification, VerificationSummary

__all__ = [
    "Clearance",
    "Contact",
    "FramePose",
    "Grasp",
    "GraspTimings",
    "Grip",
    "HoldProbability",
    "InitialState",
    "Iterations",
    "Metrics",
    "Palm",
    "ParallelGrasp",
    "PlanResult",
    "PlanSummary",
    "PlanTimings",
    "PlannedObject",
    "Pregrasp",
    "Provenance",
    "Relaxation",
    "SceneSummary",
    "SplitGrasp",
    "Termination",
    "Way",
    "WorldPoses",
]

Termination = Literal[
    "converged",
    "stopped_by_collision",
    "stopped_by_pad_angle",
    "iteration_limit",
    "contact_off_surface",
    "pad_angle_violated",
    "in_collision",
    "joint_limit_violated",
    "stopped_by_obstacle",
    "stopped_by_region",
    "near_obstacle",
    "outside_workspace",
    "outside_region",
    "no_free_approach",
    "no_free_retreat",
    "in_self_collision",
]
"""Why a run of the planner ended."""


class Metrics(Document):
    """Every metric of a grasp by its name; `GET /v1/metrics` says what each means and which way is better."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, float | None]

    holding_margin: float | None = Field(
        description="Least friction force that a contact can still take while the fingers carry the object's weight, "
        "over all tested gravity directions [N]; negative when they cannot carry it, null when no forces balance it.",
    )
    quality: float = Field(description="What finger splitting climbs: Q = w1 Q_o + w2 Q_h, no unit.")
    object_quality: float = Field(description="w1 Q_o: weight times twice the area of the contact triangle [m^2].")
    manipulability: float = Field(
        description="w2 Q_h: minus the weighted squared distance of the joints from mid-range, no unit."
    )
    isotropy: float = Field(description="Smallest over largest singular value of the grasp matrix, 0 to 1.")
    volume: float = Field(
        description="Volume of the wrench ellipsoid of unit contact forces, torques over the object's radius [N^6]."
    )
    ferrari_canny: float = Field(
        description="Largest wrench resisted in every direction by normal forces of 1 N in total, torques over the "
        "object's radius [N].",
    )


class ParallelGrasp(Document):
    """Two opposite contacts of a parallel-jaw gripper: what a finger-splitting run starts from."""

    contacts: tuple[Vector3, Vector3] = Field(
        description="The two contact points on the surface, object frame [m].",
        examples=[[[0.03, 0.0, 0.05], [-0.03, 0.0, 0.05]]],
    )
    approach: Vector3 = Field(
        description="Direction in which the palm moves towards the object, object frame, unit length.",
        examples=[[0.0, 0.0, -1.0]],
    )


class Palm(Document):
    """Where the palm is."""

    position: Vector3 = Field(description="Origin of the palm frame in the object frame [m].")
    wxyz: Quaternion = Field(description="Rotation from the palm frame to the object frame, unit quaternion.")


class Contact(Document):
    """One finger on the surface."""

    finger: str = Field(description="Name of the finger.")
    position: Vector3 = Field(description="Contact point on the surface, object frame [m].")
    normal: Vector3 = Field(description="Surface normal at the contact, out of the object, object frame.")
    fingertip: Vector3 = Field(description="Point of the pad that faces the contact, object frame [m].")
    residual: float = Field(description="How far the pad is from just touching the contact [m].")
    pad_angle: float = Field(
        description="Angle of the pad's normal to the inward surface normal, or to where its cap touches if that is "
        "more [rad].",
    )
    force: Vector3 | None = Field(
        description="Force of the finger on the object that carries its weight with gravity in the worst direction, "
        "object frame [N]; null where none can. How hard the fingers press on the unloaded object stands in `grip`.",
    )
    assumed: bool = Field(
        default=False, description="Whether the surface there was not seen but assumed, as in a completed cloud."
    )


class Iterations(Document):
    """How many iterations a run took."""

    outer: int = Field(description="Rounds of contact and palm optimization.")
    cpo: int = Field(description="Iterations of contact point optimization (CPO), over all rounds.")
    ppo: int = Field(description="Iterations of palm pose optimization (PPO), over all rounds.")


class GraspTimings(Document):
    """Where the time of one run went."""

    cpo_tangent_search: float = Field(description="CPO: searching along the surface [ms].")
    cpo_projection_and_test: float = Field(description="CPO: returning to the surface and testing [ms].")
    cpo_collision: float = Field(description="CPO: collision checks [ms].")
    ppo_tangent_search: float = Field(description="PPO: searching for a better palm pose [ms].")
    ppo_projection_and_test: float = Field(description="PPO: keeping the contacts and testing [ms].")
    ppo_collision: float = Field(description="PPO: collision checks [ms].")
    total: float = Field(description="The whole run [ms].")


class Pregrasp(Document):
    """Where to come from: a free way to the grasp, straight along the palm's approach."""

    palm: Palm = Field(description="The palm where the approach begins, in the object frame.")
    joints: dict[str, float] = Field(description="Joint angles by name during the approach, opened [rad].")


class SplitGrasp(Document):
    """The grasp that the splitting ended with, where it was refined afterwards."""

    palm: Palm = Field(description="The palm's pose in the object frame.")
    joints: dict[str, float] = Field(description="Joint angles by name [rad].")
    contacts: list[Contact] = Field(description="Contacts, one a finger.")
    quality: float = Field(description="The planner's objective Q, no unit.")


class HoldProbability(Document):
    """How probably the executed grasp holds where pose, friction and mass are not exactly as planned."""

    value: float = Field(description="Probability that the grasp holds, 0 to 1.")
    tier: Literal["estimated", "simulated"] = Field(
        description="Where it comes from: estimated from surface and closing kinematics, or simulated executions."
    )
    robustness: Literal["robust", "fragile", "futile"] = Field(
        description="In a word: robust from 0.85 on, futile below 0.4, fragile between."
    )
    position_noise: float = Field(description="Root mean square displacement of the object that is reckoned with [m].")
    rotation_noise: float = Field(description="Root mean square turn of the object that is reckoned with [rad].")


class Grip(Document):
    """How hard to grip, and what to send to the hand for it; gravity of the fingers is compensated beside it."""

    forces: list[Vector3] = Field(
        description="Force of each finger on the unloaded object, in the order of the contacts, which balance each "
        "other, object frame [N].",
    )
    supporting: list[str] = Field(
        description="Fingers that cannot take their share of the grip (a tenth of the strongest one's force) and only "
        "support.",
    )
    torques: dict[str, float] = Field(
        description="For hands that take torques: torque of each driver for these forces, to be added to stiffness "
        "about the angles at which the fingers came to rest [N m].",
    )
    stiffness: dict[str, float] = Field(
        description="For hands that take positions: stiffness kp of each driver's servo, for which squeeze_joints "
        "press with these forces [N m/rad].",
    )
    damping: dict[str, float] = Field(description="Damping kd of these servos [N m s/rad].")
    load: float = Field(description="Largest force on the object that it is planned to carry, from every side [N].")
    friction: list[float] = Field(description="Friction coefficient that it relies on at each contact.")
    max_force: float = Field(description="Most that a finger may press with, its share of the load included [N].")
    violation: float = Field(
        description="Farthest that a contact force must leave its friction cone under that load [N]."
    )
    limited: bool = Field(description="Whether the drivers have too little torque for a safer grip.")


class InitialState(Document):
    """What a run started from."""

    parallel_grasp: ParallelGrasp = Field(description="The parallel grasp, object frame.")
    palm: Palm = Field(description="The palm after the parallel grasp was mapped to the hand.")
    joints: dict[str, float] = Field(description="Joint angles by name after mapping [rad].")
    contacts: list[Contact] = Field(description="Contacts after mapping, one a finger.")
    quality: float = Field(description="The planner's objective Q after mapping, no unit.")
    verification: Verification | None = Field(
        default=None, description="Report of this grasp's verification in simulation; null when it was not verified."
    )


class FramePose(Document):
    """A pose in the scene's frame."""

    position: Vector3 = Field(description="Origin in the scene's frame [m].")
    wxyz: Quaternion = Field(description="Rotation into the scene's frame, unit quaternion.")


class WorldPoses(Document):
    """Where palm and tool are in the scene's frame."""

    palm: FramePose = Field(description="The palm in the grasp.")
    tool: FramePose = Field(description="The tool frame in the grasp.")
    pregrasp_tool: FramePose | None = Field(
        description="The tool frame where the approach begins; null without a free way in."
    )


class Way(Document):
    """A straight way, to the grasp or away from it."""

    direction: Vector3 = Field(description="Direction of travel, object frame, unit length.")
    direction_in_world: Vector3 = Field(description="The same in the scene's frame.")
    distance: float = Field(description="How far it is free [m].")
    blocked_by: str | None = Field(description="What ends it; null where it is as long as wanted.")


class Clearance(Document):
    """Where the hand is nearest to what stands around the object."""

    distance: float = Field(description="Distance in the grasp [m].")
    link: str = Field(description="Collision shape of the hand.")
    obstacle: str = Field(description="Obstacle or support surface.")


class Relaxation(Document):
    """One constraint that would leave grasps if it were relaxed."""

    constraint: str = Field(description="Entry of the request, such as `approach.directions`.")
    amount: float | None = Field(description="By how much at least; null where that is no matter of degree.")
    unit: str = Field(description="Unit of the amount: m, rad or empty.")
    feasible: int = Field(description="Feasible grasps that were found without it.")
    message: str = Field(description="The same in a sentence.")


class SceneSummary(Document):
    """The world that was planned in."""

    frame: str = Field(description="Name of the scene's frame.")
    tool_frame: str = Field(description="Name of the tool frame.")
    object_pose: FramePose = Field(description="The object in the scene's frame.")
    stable_pose_share: float | None = Field(
        description="How likely a dropped object comes to rest like this; null when its pose was given."
    )
    warnings: list[str] = Field(description="What a caller may not expect of the scene.")
    rejected_by: dict[str, int] = Field(description="Grasps that each obstacle or support rejected, most first.")
    relaxations: list[Relaxation] = Field(
        description="Single constraints that would leave grasps if they were relaxed, least first; looked for when "
        "there is none.",
    )


class Grasp(Document):
    """One planned grasp."""

    rank: int = Field(description="Place in the ranking, 1 is best.")
    feasible: bool = Field(description="Whether every constraint holds; the same as geometry_valid.")
    geometry_valid: bool = Field(description="Whether the hand keeps every geometric constraint.")
    carries_weight: bool = Field(
        description="Whether the fingers can support the object's weight for every tested gravity direction: the "
        "holding margin is not negative.",
    )
    violations: list[str] = Field(description="A sentence for every constraint that does not hold.")
    reason: str = Field(description="Why the grasp stands at this rank, in a sentence.")
    palm: Palm = Field(description="The palm's pose in the object frame.")
    joints: dict[str, float] = Field(description="Joint angles by name [rad].")
    contacts: list[Contact] = Field(description="Contacts, one a finger.")
    pregrasp: Pregrasp | None = Field(description="How to get there; null when no straight way in is free.")
    squeeze_joints: dict[str, float] = Field(
        description="Targets of position servos of the stiffness in grip, which press with its forces, by joint name "
        "[rad].",
    )
    grip: Grip = Field(description="How hard to grip: forces, torques and servos.")
    metrics: Metrics = Field(description="Every metric of the grasp by name; null where it has no number for it.")
    termination: Termination = Field(description="Why the run ended.")
    advice: str = Field(description="What the termination means and what to try, in a sentence.")
    iterations: Iterations = Field(description="How many iterations the run took.")
    timings_ms: GraspTimings = Field(description="Where the time of the run went [ms].")
    initial: InitialState = Field(description="What the run started from.")
    verification: Verification | None = Field(
        default=None, description="Report of the grasp's verification in simulation; null when it was not verified."
    )
    p_hold: HoldProbability | None = Field(
        default=None,
        description="How probably the grasp holds when it is executed under noise; null where it was not judged.",
    )
    split_grasp: SplitGrasp | None = Field(
        default=None, description="The grasp as the splitting left it; null where it was not refined."
    )
    world: WorldPoses | None = Field(default=None, description="Palm and tool in the scene's frame.")
    approach_path: Way | None = Field(default=None, description="The straight way in.")
    retreat_path: Way | None = Field(default=None, description="The way out with the object.")
    clearance: Clearance | None = Field(
        default=None,
        description="Where the hand is nearest to what stands around the object; null where nothing is near.",
    )
    self_clearance: float | None = Field(
        default=None,
        description="Least distance of two links of the hand that may not meet, negative inside [m]; null when over 5 "
        "mm.",
    )


class PlannedObject(Document):
    """An object as the planner saw it."""

    id: str = Field(description="Id of the object: a hash of its shape and options.")
    name: str = Field(description="What people call it.")
    source: ObjectSource = Field(description="How the numbers of its file became metres.")
    options: ObjectOptions = Field(description="What was said of the object beside its shape.")
    report: IntakeReport | CloudReport | None = Field(
        description="What was found in its file and repaired; null for an object that came as arrays."
    )
    extents: Vector3 = Field(description="Edge lengths of the axis-aligned bounding box, object frame [m].")
    volume: float = Field(description="Enclosed volume [m^3].")
    mass: float = Field(description="Mass, given or assumed [kg].")
    mass_basis: str = Field(
        description="Where the mass is from: given, given_density, assumed_density (500 kg/m^3 up to 0.5 kg), or "
        "assumed_wall (a thin shell, whose walls have 1200 kg/m^3 and are 2 mm thick at least).",
    )
    center_of_mass: Vector3 = Field(description="Centre of mass, object frame [m].")
    inertia: tuple[Vector3, Vector3, Vector3] = Field(
        description="Inertia about the centre of mass, along the axes of the object frame [kg m^2]."
    )
    samples: int = Field(description="Number of surface samples.")
    sample_spacing: float = Field(description="Least distance between two samples [m].")
    seen: float = Field(description="Share of the closed surface that is known: 1 for a mesh, less for a point cloud.")
    assumed: float = Field(
        default=0.0, description="Share of the surface for contacts that was not seen but assumed: 0 for a mesh."
    )
    remarks: list[str] = Field(
        default=[],
        description="What may not be expected of it, in sentences: of its file, and of what a point cloud leaves open.",
    )


class Provenance(Document):
    """What the grasps were planned with: with object, seed and friction beside it, it gives them again."""

    software_version: str = Field(description="Version of Fingersplit that planned.")
    hand_sha256: str = Field(description="SHA-256 of the hand's description, 64 hex digits.")
    planner: dict[str, bool | int | float | str] = Field(
        description="Every planner setting by name, SI units and radians."
    )
    constraints: dict[str, JsonValue] = Field(
        description="What the grasps had to keep to: scene, approach, contact regions, task and end effector."
    )
    parallel_grasps: str = Field(
        description="Where the parallel grasps came from: the name of a source, or given when they were part of the "
        "request.",
    )
    top_k: int = Field(description="How many grasps were asked for at most.")
    ranking: dict[str, JsonValue] | None = Field(
        default=None,
        description="By what the grasps were ranked, under which noise, and how long they were simulated for it [s]; "
        "null in documents from before there was a choice.",
    )


class PlanSummary(Document):
    """How the starts of a plan ended."""

    started: int = Field(description="Starts that the hand could take over and that were run.")
    feasible: int = Field(description="Starts that ended in a feasible grasp.")
    terminations: dict[str, int] = Field(description="How often each termination occurred.")
    message: str = Field(description="The outcome in a sentence.")
    verification: VerificationSummary | None = Field(
        default=None, description="How the verification of the grasps went; null when it was not asked for."
    )


class PlanTimings(Document):
    """Where the time of a plan went."""

    parallel_grasps: float = Field(description="Finding parallel grasps [ms].")
    mapping: float = Field(description="Mapping them to the hand [ms].")
    splitting: float = Field(description="Finger splitting, all starts [ms].")
    ranking: float = Field(description="Judging and ranking the grasps [ms].")
    total: float = Field(description="The whole plan [ms].")


class PlanResult(Document):
    """Ranked grasps and their provenance: one document in the API, the client and on the command line."""

    schema_version: int = Field(description="Version of this document's schema, now 2.")
    hand: str = Field(description="Name of the hand.")
    object: PlannedObject = Field(description="The object as the planner saw it.")
    seed: int = Field(description="Seed of every random choice.")
    starts: int = Field(description="How many starts were asked for.")
    friction: float = Field(description="Coulomb friction between pads and object that was planned for.")
    provenance: Provenance = Field(description="What the result was planned with.")
    summary: PlanSummary = Field(description="How many starts came how far.")
    timings_ms: PlanTimings = Field(description="Where the time of the plan went [ms].")
    grasps: list[Grasp] = Field(description="Grasps, best first.")
    scene: SceneSummary | None = Field(default=None, description="The world around the object, and what it rejected.")
