"""The result of planning: ranked grasps of one object for one hand, and all that is needed to come back to them."""

from dataclasses import dataclass
from typing import Any, Self

from fingersplit.errors import ResultError
from fingersplit.hands.hand import Hand
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.source import ObjectSource
from fingersplit.result.grasp import GraspResult
from fingersplit.result.scene import SceneSummary
from fingersplit.result.verification import VerificationSummary
from fingersplit.result.wire import Json, Vector3, described, from_dict, to_dict

__all__ = [
    "SCHEMA_VERSION",
    "PlanResult",
    "PlanSummary",
    "PlanTimings",
    "PlannedObject",
    "Provenance",
]

SCHEMA_VERSION = 2
"""Of result documents; the first documents had none."""


@dataclass(frozen=True)
class PlannedObject:
    """An object as the planner saw it."""

    id: str = described("Id of the object: a hash of its shape and options")
    name: str = described("What people call it")
    source: ObjectSource = described("How the numbers of its file became metres")
    options: ObjectOptions = described("What was said of the object beside its shape")
    report: IntakeReport | CloudReport | None = described(
        "What was found in its file and repaired; null for an object that came as arrays"
    )
    extents: Vector3 = described("Edge lengths of the axis-aligned bounding box, object frame", "m")
    volume: float = described("Enclosed volume", "m^3")
    mass: float = described("Mass, given or assumed", "kg")
    mass_basis: str = described(
        "Where the mass is from: given, given_density, assumed_density (500 kg/m^3 up to 0.5 kg), or assumed_wall (a "
        "thin shell, whose walls have 1200 kg/m^3 and are 2 mm thick at least)"
    )
    center_of_mass: Vector3 = described("Centre of mass, object frame", "m")
    inertia: tuple[Vector3, Vector3, Vector3] = described(
        "Inertia about the centre of mass, along the axes of the object frame", "kg m^2"
    )
    samples: int = described("Number of surface samples")
    sample_spacing: float = described("Least distance between two samples", "m")
    seen: float = described("Share of the closed surface that is known: 1 for a mesh, less for a point cloud")
    assumed: float = described(
        "Share of the surface for contacts that was not seen but assumed: 0 for a mesh", default=0.0
    )
    remarks: tuple[str, ...] = described(
        "What may not be expected of it, in sentences: of its file, and of what a point cloud leaves open", default=()
    )


@dataclass(frozen=True)
class Provenance:
    """What the grasps were planned with: with object, seed and friction beside it, it gives them again."""

    software_version: str = described("Version of Fingersplit that planned")
    hand_sha256: str = described("SHA-256 of the hand's description, 64 hex digits")
    planner: dict[str, bool | int | float | str] = described("Every planner setting by name, SI units and radians")
    constraints: dict[str, Json] = described(
        "What the grasps had to keep to: scene, approach, contact regions, task and end effector"
    )
    parallel_grasps: str = described(
        "Where the parallel grasps came from: the name of a source, or given when they were part of the request"
    )
    top_k: int = described("How many grasps were asked for at most")
    ranking: dict[str, Json] | None = described(
        "By what the grasps were ranked, under which noise, and how long they were simulated for it [s]; null in "
        "documents from before there was a choice",
        default=None,
    )


@dataclass(frozen=True)
class PlanSummary:
    """How the starts of a plan ended."""

    started: int = described("Starts that the hand could take over and that were run")
    feasible: int = described("Starts that ended in a feasible grasp")
    terminations: dict[str, int] = described("How often each termination occurred")
    message: str = described("The outcome in a sentence")
    verification: VerificationSummary | None = described(
        "How the verification of the grasps went; null when it was not asked for", default=None
    )


@dataclass(frozen=True)
class PlanTimings:
    """Where the time of a plan went."""

    parallel_grasps: float = described("Finding parallel grasps", "ms")
    mapping: float = described("Mapping them to the hand", "ms")
    splitting: float = described("Finger splitting, all starts", "ms")
    ranking: float = described("Judging and ranking the grasps", "ms")
    total: float = described("The whole plan", "ms")


@dataclass(frozen=True)
class PlanResult:
    """Ranked grasps and their provenance: one document in the API, the client and on the command line."""

    schema_version: int = described(f"Version of this document's schema, now {SCHEMA_VERSION}")
    hand: str = described("Name of the hand")
    object: PlannedObject = described("The object as the planner saw it")
    seed: int = described("Seed of every random choice")
    starts: int = described("How many starts were asked for")
    friction: float = described("Coulomb friction between pads and object that was planned for")
    provenance: Provenance = described("What the result was planned with")
    summary: PlanSummary = described("How many starts came how far")
    timings_ms: PlanTimings = described("Where the time of the plan went", "ms")
    grasps: tuple[GraspResult, ...] = described("Grasps, best first")
    scene: SceneSummary | None = described("The world around the object, and what it rejected", default=None)

    @classmethod
    def from_dict(cls, document: Any) -> Self:
        """The result of a document.

        Raises:
            ResultError: Another kind of document, one of another version, or one whose fields are not what they
                should be.
        """
        if not isinstance(document, dict) or not {"hand", "object", "grasps"} <= document.keys():
            raise ResultError("This is not a result of Fingersplit: it needs 'hand', 'object' and 'grasps'.")
        version = document.get("schema_version")
        if version is None:
            raise ResultError(
                "This result has no schema_version: it is from before results said what they were planned with; plan "
                "again."
            )
        if version != SCHEMA_VERSION:
            raise ResultError(
                f"This result has schema_version {version!r}; this version of Fingersplit reads {SCHEMA_VERSION}. "
                f"Plan again, or read it with the version that wrote it."
            )
        return from_dict(cls, document)

    def to_dict(self) -> dict[str, Any]:
        """The result as plain JSON data: SI units, object frame, quaternions wxyz."""
        return to_dict(self)

    @property
    def feasible(self) -> int:
        """Number of starts that ended in a feasible grasp."""
        return self.summary.feasible

    @property
    def message(self) -> str:
        """The outcome in a sentence."""
        return self.summary.message

    def check_origin(self, model: ObjectModel, hand: Hand) -> None:
        """Refuse another object or hand than the result was planned for; raises as ``check_object``, ``check_hand``."""
        self.check_object(model)
        self.check_hand(hand)

    def check_object(self, model: ObjectModel) -> None:
        """Refuse another object than the result was planned for.

        Raises:
            ResultError: The id of the object is not the result's.
        """
        if model.id != self.object.id:
            raise ResultError(
                f"The object is not the one of the result: its id over shape and options is {model.id}, the "
                f"result was planned for {self.object.id} ({self.object.name}). Give the unaltered file it was planned "
                f"for."
            )

    def check_hand(self, hand: Hand) -> None:
        """Refuse another hand than the result was planned for.

        Raises:
            ResultError: Its name, or the hash of its description, is not the result's.
        """
        if hand.name != self.hand:
            raise ResultError(f"The result was planned for the hand {self.hand!r}, not for {hand.name!r}.")
        if hand.sha256 != self.provenance.hand_sha256:
            raise ResultError(
                f"The description of the hand {self.hand!r} was altered since the result was planned: its SHA-256 is "
                f"{hand.sha256[:16]}..., not {self.provenance.hand_sha256[:16]}...; plan again."
            )

    def active_grip(self, hand: Hand) -> Hand:
        """The hand with those fingers active that the grasps use; as it is where no grip of it has these fingers."""
        for grip in hand.grips:
            fingers = [finger.name for finger in grip.fingers]
            if all([contact.finger for contact in grasp.contacts] == fingers for grasp in self.grasps):
                return grip
        return hand

    @property
    def held(self) -> int:
        """Number of grasps that held in simulation."""
        return sum(grasp.verification is not None and grasp.verification.passed for grasp in self.grasps)

    def grasp(self, rank: int) -> GraspResult:
        """The grasp of a rank.

        Raises:
            ResultError: There is none.
        """
        for grasp in self.grasps:
            if grasp.rank == rank:
                return grasp
        raise ResultError(f"The result has {len(self.grasps)} grasps and none of rank {rank}; rank 1 is the best.")
