"""What the hand is mounted on: the tool frame, bodies that move with the palm, and where an arm can bring it."""

from dataclasses import dataclass

from fingersplit.errors import SceneError
from fingersplit.scene.entries import Document, Record, entry
from fingersplit.scene.kinds import Number, Several, Text, Vector
from fingersplit.scene.shapes import MAX_SIZE, Pose, Primitive

__all__ = ["AttachedBody", "EndEffector", "Reach"]

MAX_BODIES = 16


@dataclass(frozen=True)
class AttachedBody(Document):
    """A body fixed to the palm, such as a camera or a wrist: it must not touch anything."""

    primitive: Primitive = entry(Record(Primitive), "Its shape.")
    pose: Pose = entry(Record(Pose), "Where it stands, palm_from_body.", Pose())
    id: str = entry(Text(), "Name in results.", "attached body")


@dataclass(frozen=True)
class Reach(Document):
    """Where an arm can bring the palm: between two spheres."""

    center: tuple[float, float, float] = entry(Vector(), "Centre of the spheres, scene frame [m].")
    min_radius: float = entry(Number("m", 0.0, MAX_SIZE), "Nearest.", 0.0)
    max_radius: float = entry(Number("m", 1e-3, MAX_SIZE), "Farthest.", 0.85)

    def check(self) -> None:
        """The nearest is nearer than the farthest."""
        if not self.min_radius < self.max_radius:
            raise SceneError("max_radius", f"is {self.max_radius:g} m, not above min_radius, {self.min_radius:g} m.")


@dataclass(frozen=True)
class EndEffector(Document):
    """Tool frame, attached bodies and reach."""

    tool_frame: str = entry(Text(), "Name of the frame that tool poses are given for.", "palm")
    tool_from_palm: Pose = entry(Record(Pose), "Where the palm stands in it.", Pose())
    attached_bodies: tuple[AttachedBody, ...] = entry(
        Several(Record(AttachedBody), MAX_BODIES), "What moves with the palm.", ()
    )
    reach: Reach | None = entry(Record(Reach), "Where an arm can bring the palm.", None)
