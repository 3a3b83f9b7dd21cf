"""Grasps in another frame than the object's: the robot's, the camera's, the world's."""

import json
from typing import TYPE_CHECKING, Any, Generic

from fingersplit_client._flow import Flow
from fingersplit_client.errors import invalid
from fingersplit_client.modes import Bound, Mode, operation
from fingersplit_client.schemas import Contact, Vector3
from fingersplit_client.transforms import Transform

if TYPE_CHECKING:
    from fingersplit_client.results import Grasp

__all__ = ["PlacedGrasp"]


class PlacedGrasp(Bound[Mode], Generic[Mode]):
    """A grasp in a frame of the user's.

    Args:
        grasp: The grasp, object frame.
        frame_from_object: Pose of the object in the frame.
        frame: What the frame is called.
    """

    def __init__(self, grasp: "Grasp[Mode]", frame_from_object: Transform, frame: str) -> None:
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
