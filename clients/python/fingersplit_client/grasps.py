"""Grasps as robot programs want them, in the object's frame or one of the user's: matrices, joint vectors, exports."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Literal, Self

from pydantic import ConfigDict, PrivateAttr

from fingersplit_client import schemas
from fingersplit_client._exchange import dump, parse, quoted
from fingersplit_client._flow import Flow
from fingersplit_client.errors import FingersplitClientError, invalid
from fingersplit_client.modes import Bound, Mode, operation
from fingersplit_client.schemas import Contact, GraspOutcome, OutcomeCreate, PoseError, Vector3
from fingersplit_client.transforms import Transform, TransformLike, norm, subtract

__all__ = ["Grasp", "JointState", "Link", "LinkedDocument", "PlacedGrasp", "Pregrasp"]

JointState = Literal["grasp", "pregrasp", "squeeze"]
"""Which joints of a grasp: when the pads touch, during the approach, or the targets that press the pads on."""


@dataclass(frozen=True)
class Link:
    """Where a result came from; not copied with it, and of a pickled result only the id is left.

    Attributes:
        mode: The client's connections; None for a result from a file.
        job_id: Id of the job; None for a result from a file.
    """

    mode: Any = None
    job_id: str | None = None

    def __deepcopy__(self, memo: Any) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Link, (None, self.job_id)


class LinkedDocument(schemas.Document, Bound[Mode], Generic[Mode]):
    """A document that knows its job."""

    model_config = ConfigDict(ignored_types=(operation,))
    _link: Link = PrivateAttr(default_factory=Link)

    @property
    def job_id(self) -> str | None:
        """Id of the job it came from; None where that is not known."""
        return self._link.job_id

    def _mode(self) -> Mode:
        if self._link.mode is None or self._link.job_id is None:
            raise FingersplitClientError(
                "This result came from a file, and the service must be asked: load it with a client and its job_id."
            )
        return self._link.mode  # type: ignore[no-any-return]

    @property
    def _job_path(self) -> str:
        self._mode()
        return f"/v1/jobs/{quoted(self._link.job_id or '')}"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__


class Pregrasp(schemas.Pregrasp):
    """Where to come from, in the object frame."""

    @property
    def pose(self) -> Transform:
        """The palm, ``object_from_palm``."""
        return Transform(self.palm.position, self.palm.wxyz)

    @property
    def matrix(self) -> Any:
        """The palm, ``object_from_palm`` (4, 4): a numpy array where numpy is installed."""
        return self.pose.matrix


class Grasp(schemas.Grasp, LinkedDocument[Mode], Generic[Mode]):
    """One planned grasp, object frame."""

    pregrasp: Pregrasp | None

    @property
    def pose(self) -> Transform:
        """The palm, ``object_from_palm``."""
        return Transform(self.palm.position, self.palm.wxyz)

    @property
    def matrix(self) -> Any:
        """The palm, ``object_from_palm`` (4, 4): a numpy array where numpy is installed, else nested tuples."""
        return self.pose.matrix

    @property
    def approach(self) -> Vector3 | None:
        """Unit direction from the pre-grasp to the grasp, object frame; None where no straight way in is free."""
        if self.pregrasp is None:
            return None
        way = subtract(self.palm.position, self.pregrasp.palm.position)
        length = norm(way)
        return None if length == 0 else (way[0] / length, way[1] / length, way[2] / length)

    @property
    def tool_pose(self) -> Transform | None:
        """The tool frame in the scene's frame, ``world_from_tool``; None where it was planned without a scene."""
        return None if self.world is None else Transform(self.world.tool.position, self.world.tool.wxyz)

    @property
    def pregrasp_tool_pose(self) -> Transform | None:
        """The same where the approach begins; None without a scene or a free way in."""
        before = None if self.world is None else self.world.pregrasp_tool
        return None if before is None else Transform(before.position, before.wxyz)

    @property
    def held(self) -> bool | None:
        """Whether it held in simulation; None where it was not simulated."""
        return None if self.verification is None else self.verification.passed

    def in_frame(self, frame_from_object: TransformLike, name: str = "world") -> "PlacedGrasp[Mode]":
        """The grasp in the frame of the robot, the camera or the world.

        Args:
            frame_from_object: Pose of the object in that frame [m]: a 4x4 matrix, a pair of position and wxyz, or a
                `Transform`.
            name: What the frame is called, for exports.
        """
        return PlacedGrasp(self, Transform.of(frame_from_object), name)

    def joint_vector(self, names: Sequence[str] | Mapping[str, str], at: JointState = "grasp") -> list[float]:
        """Joint angles in the order that a driver wants [rad].

        Args:
            names: Names of the joints in that order; where the driver has its own names, a mapping from each of them,
                in that order, to the hand's.
            at: Which joints.

        Raises:
            InvalidRequestError: The hand has no such joint, or the grasp no pre-grasp.
        """
        joints = self._joints(at)
        wanted = list(names.values()) if isinstance(names, Mapping) else list(names)
        unknown = [name for name in wanted if name not in joints]
        if unknown:
            raise invalid(f"The hand has no joints {', '.join(unknown)}; it has {', '.join(joints)}.")
        return [joints[name] for name in wanted]

    def _joints(self, at: JointState) -> dict[str, float]:
        if at == "squeeze":
            return self.squeeze_joints
        if at == "grasp":
            return self.joints
        if at != "pregrasp":
            raise invalid(f"Joints can be those at the grasp, pregrasp or squeeze, not at {at!r}.")
        if self.pregrasp is None:
            raise invalid(f"The grasp of rank {self.rank} has no pre-grasp: no straight way in is free.")
        return self.pregrasp.joints

    @operation
    def export(self, format_name: str) -> Flow[bytes]:
        """The grasp as a file of another tool, such as ``"moveit"`` or ``"isaac_grasp"``, object frame."""
        path = f"{self._job_path}/export/{quoted(format_name)}"
        response = yield from self._exchange("GET", path, params={"rank": self.rank})
        return bytes(response.content)

    @operation
    def picture(self) -> Flow[bytes]:
        """PNG of hand and object at the start and at the end, and the quality curve."""
        response = yield from self._exchange("GET", f"{self._job_path}/grasps/{self.rank}/picture.png")
        return bytes(response.content)

    @operation
    def report_outcome(
        self, *, held: bool, pose_error: TransformLike | None = None, note: str = ""
    ) -> Flow[GraspOutcome]:
        """Tell the service what became of the grasp on a robot; of every attempt, also those that went well.

        Args:
            held: Whether the object stayed in the hand for as long as it was to be held.
            pose_error: Where the object was before the grasp, against where it was planned to be,
                ``planned_from_measured``: a 4x4 matrix, a pair of position and wxyz, or a `Transform`.
            note: What people should know of it.
        """
        error = None
        if pose_error is not None:
            measured = Transform.of(pose_error)
            error = PoseError(position=measured.position, wxyz=measured.wxyz)
        path = f"{self._job_path}/grasps/{self.rank}/outcome"
        body = dump(OutcomeCreate(held=held, pose_error=error, note=note))
        return parse(GraspOutcome, (yield from self._exchange("POST", path, json=body)))

    def __repr__(self) -> str:
        words = ["feasible" if self.feasible else f"not feasible ({self.termination})"]
        if self.metrics.holding_margin is not None:
            words.append(f"holding margin {self.metrics.holding_margin:.2f} N")
        if self.held is not None:
            words.append("held in simulation" if self.held else "did not hold in simulation")
        return f"<Grasp of rank {self.rank}: {', '.join(words)}>"

    __str__ = __repr__


class PlacedGrasp(Bound[Mode], Generic[Mode]):
    """A grasp in a frame of the user's.

    Args:
        grasp: The grasp, object frame.
        frame_from_object: Pose of the object in the frame.
        frame: What the frame is called.
    """

    def __init__(self, grasp: Grasp[Mode], frame_from_object: Transform, frame: str) -> None:
        self.grasp, self.frame_from_object, self.frame = grasp, frame_from_object, frame

    def _mode(self) -> Mode:
        return self.grasp._mode()

    @property
    def pose(self) -> Transform:
        """The palm, ``frame_from_palm``."""
        return self.frame_from_object @ self.grasp.pose

    @property
    def matrix(self) -> Any:
        """The palm, ``frame_from_palm`` (4, 4): a numpy array where numpy is installed, else nested tuples."""
        return self.pose.matrix

    @property
    def pregrasp(self) -> Transform | None:
        """The palm where the approach begins, ``frame_from_palm``; None where no straight way in is free."""
        return None if self.grasp.pregrasp is None else self.frame_from_object @ self.grasp.pregrasp.pose

    @property
    def approach(self) -> Vector3 | None:
        """Unit direction from the pre-grasp to the grasp; None where no straight way in is free."""
        return None if self.grasp.approach is None else self.frame_from_object.rotate(self.grasp.approach)

    @property
    def contacts(self) -> list[Contact]:
        """The contacts with points, normals and forces in the frame."""
        pose = self.frame_from_object
        return [
            contact.model_copy(
                update={
                    "position": pose.apply(contact.position),
                    "normal": pose.rotate(contact.normal),
                    "fingertip": pose.apply(contact.fingertip),
                    "force": None if contact.force is None else pose.rotate(contact.force),
                }
            )
            for contact in self.grasp.contacts
        ]

    @operation
    def export(self, format_name: str = "moveit") -> Flow[bytes]:
        """The grasp as moveit_msgs/Grasp with its ``grasp_pose`` in the frame, JSON.

        Raises:
            InvalidRequestError: The format is another one; their files are in the object frame, see `Grasp.export`.
        """
        if format_name != "moveit":
            raise invalid(f"Only moveit has a frame of its own; {format_name} is in the object frame: grasp.export().")
        document = json.loads((yield from type(self.grasp).export.flow(self.grasp, "moveit")))
        w, x, y, z = self.pose.wxyz
        for message in document["grasps"]:
            message["grasp_pose"]["header"]["frame_id"] = self.frame
            message["grasp_pose"]["pose"] = {
                "position": dict(zip("xyz", self.pose.position, strict=True)),
                "orientation": {"x": x, "y": y, "z": z, "w": w},
            }
        return json.dumps(document, indent=2).encode()

    def __repr__(self) -> str:
        x, y, z = self.pose.position
        return f"<{self.grasp!r} in {self.frame}, palm at ({x:.3f}, {y:.3f}, {z:.3f}) m>"
