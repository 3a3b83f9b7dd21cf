"""What a result says of the world around the object: poses in it, ways in and out, clearance, and what was rejected."""

from dataclasses import dataclass

from fingersplit.result.wire import Quaternion, Vector3, described

__all__ = ["Clearance", "FramePose", "Relaxation", "SceneSummary", "Way", "WorldPoses"]


@dataclass(frozen=True)
class FramePose:
    """A pose in the scene's frame."""

    position: Vector3 = described("Origin in the scene's frame", "m")
    wxyz: Quaternion = described("Rotation into the scene's frame, unit quaternion")


@dataclass(frozen=True)
class WorldPoses:
    """Where palm and tool are in the scene's frame."""

    palm: FramePose = described("The palm in the grasp")
    tool: FramePose = described("The tool frame in the grasp")
    pregrasp_tool: FramePose | None = described("The tool frame where the approach begins; null without a free way in")


@dataclass(frozen=True)
class Way:
    """A straight way, to the grasp or away from it."""

    direction: Vector3 = described("Direction of travel, object frame, unit length")
    direction_in_world: Vector3 = described("The same in the scene's frame")
    distance: float = described("How far it is free", "m")
    blocked_by: str | None = described("What ends it; null where it is as long as wanted")


@dataclass(frozen=True)
class Clearance:
    """Where the hand is nearest to what stands around the object."""

    distance: float = described("Distance in the grasp", "m")
    link: str = described("Collision shape of the hand")
    obstacle: str = described("Obstacle or support surface")


@dataclass(frozen=True)
class Relaxation:
    """One constraint that would leave grasps if it were relaxed."""

    constraint: str = described("Entry of the request, such as `approach.directions`")
    amount: float | None = described("By how much at least; null where that is no matter of degree")
    unit: str = described("Unit of the amount: m, rad or empty")
    feasible: int = described("Feasible grasps that were found without it")
    message: str = described("The same in a sentence")


@dataclass(frozen=True)
class SceneSummary:
    """The world that was planned in."""

    frame: str = described("Name of the scene's frame")
    tool_frame: str = described("Name of the tool frame")
    object_pose: FramePose = described("The object in the scene's frame")
    stable_pose_share: float | None = described(
        "How likely a dropped object comes to rest like this; null when its pose was given"
    )
    warnings: tuple[str, ...] = described("What a caller may not expect of the scene")
    rejected_by: dict[str, int] = described("Grasps that each obstacle or support rejected, most first")
    relaxations: tuple[Relaxation, ...] = described(
        "Single constraints that would leave grasps if they were relaxed, least first; looked for when there is none"
    )
