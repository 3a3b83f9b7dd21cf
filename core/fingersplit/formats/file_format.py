"""What a file format is: how its files are recognised, and what this package reads from them and writes to them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingersplit.formats.exporting import Export
    from fingersplit.formats.grippers import Gripper, JawPoses
    from fingersplit.formats.hand_grasps import HandGrasps
    from fingersplit.hands.hand import Hand
    from fingersplit.parallel_grasps.grasp_set import ParallelGrasps

__all__ = ["CONTAINERS", "Container", "FileFormat", "Request"]


@dataclass(frozen=True)
class Container:
    """A kind of file: its ending, its media type, and what its content is once it is opened (``containers.opened``)."""

    suffix: str
    media_type: str


CONTAINERS = {
    "json": Container(".json", "application/json"),
    "yaml": Container(".yaml", "application/yaml"),
    "npy": Container(".npy", "application/octet-stream"),
    "hdf5": Container(".h5", "application/x-hdf5"),
}


@dataclass(frozen=True)
class Request:
    """What a reader is told beside the content of a file.

    Attributes:
        object_name: Name of the object whose grasps are wanted.
        gripper: The gripper that the grasps are for; None to go by what the file says.
        scale: Factor from the file's lengths to metres.
    """

    object_name: str
    gripper: "Gripper | None" = None
    scale: float = 1.0


@dataclass(frozen=True)
class FileFormat:
    """A format, with what it can be used for; None where it cannot.

    Attributes:
        name: What requests call it.
        title: What it is, for people.
        container: Kind of file, a key of ``CONTAINERS``.
        recognises: Whether the content of such a file is of this format.
        read_parallel: From the content to parallel grasps on the object, or to grippers that have yet to close on it.
        read_hand: From the content to poses of a multi-fingered hand.
        write: From grasps of a result to the content; ``containers.serialised`` makes bytes of it.
        one_grasp: Whether a file holds one grasp.
    """

    name: str
    title: str
    container: str
    recognises: "Callable[[Any], bool]" = lambda _content: False
    read_parallel: "Callable[[Any, Request], JawPoses | ParallelGrasps] | None" = None
    read_hand: "Callable[[Any, Hand], HandGrasps] | None" = None
    write: "Callable[[Export], Any] | None" = None
    one_grasp: bool = False

    @property
    def suffix(self) -> str:
        """Ending of its files."""
        return CONTAINERS[self.container].suffix

    @property
    def media_type(self) -> str:
        """For HTTP."""
        return CONTAINERS[self.container].media_type

    def to_document(self) -> dict[str, Any]:
        """What the API says of it, as plain JSON data."""
        return {
            "name": self.name,
            "title": self.title,
            "suffix": self.suffix,
            "media_type": self.media_type,
            "reads_parallel_grasps": self.read_parallel is not None,
            "reads_hand_grasps": self.read_hand is not None,
            "writes": self.write is not None,
            "one_grasp": self.one_grasp,
        }
