"""What a layout of data sets is: files for each object, and lists of the splits beside them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.dataset.reading import Shard
from fingersplit.dataset.request import DatasetObject

__all__ = ["ConvertedObject", "Layout"]


@dataclass(frozen=True, eq=False)
class ConvertedObject:
    """The grasps of one object, as layouts want them.

    Attributes:
        item: The object.
        shard: Its grasps, all rounds together.
        rows: Places of the grasps that go out.
        good: Whether each of them is a good grasp.
    """

    item: DatasetObject
    shard: Shard
    rows: NDArray[np.intp]
    good: NDArray[np.bool_]

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints in the order of their columns."""
        return list(self.shard.hand["joint_names"])

    @property
    def object_scale(self) -> float:
        """Factor from the numbers of the object's file to metres."""
        units = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
        return float(units[self.shard.object["unit"]] * self.shard.object["scale"])

    def column(self, name: str) -> NDArray[Any]:
        """A column of the grasps that go out."""
        return self.shard.columns[name][self.rows]

    def object_from_palm(self) -> NDArray[np.float64]:
        """Poses of the palm, (n, 4, 4)."""
        return self.shard.object_from_palm[self.rows]

    def object_from_jaws(self) -> NDArray[np.float64]:
        """Poses at the palm's origin of the gripper that the hand imitates, x closing and z approaching, (n, 4, 4)."""
        found = self.object_from_palm()
        found[:, :3, :3] = found[:, :3, :3] @ np.array(self.shard.hand["palm_from_jaws"])
        return found

    def qpos(self, joints: str = "joints", before: bool = False) -> NDArray[np.float64]:
        """Palm position, wxyz and joints of each grasp, (n, 7 + J); ``before`` takes the palm of the pre-grasp."""
        prefix = "pregrasp" if before else "palm"
        parts = (f"{prefix}_position", f"{prefix}_wxyz", joints)
        return np.concatenate([self.column(name) for name in parts], axis=1)

    def origin(self) -> dict[str, Any]:
        """Where the grasps come from, for files that have a place for it."""
        said, shard = self.shard.attributes, self.shard
        return {
            "generator": said["generator"],
            "licence": said["licence"],
            "split": self.item.split,
            "hand": shard.hand["name"],
            "hand_description_sha256": shard.hand["description_sha256"],
            "hand_frame": shard.hand["palm_frame"],
            "joint_names": self.joint_names,
            "object_id": shard.object["id"],
            "object_file": self.item.file,
            "object_file_sha256": self.item.sha256,
            "object_scale": self.object_scale,
            "protocol": shard.protocol["name"],
            "grasp_ids": self.column("id").tolist(),
        }


@dataclass(frozen=True)
class Layout:
    """A layout.

    Attributes:
        name: What requests call it.
        title: What it is, for people.
        write: Writes the files of one object below a folder and returns them.
        failures: Whether grasps that are no good ones go out too, marked as such.
        free_way: Whether only grasps with a pre-grasp go out.
    """

    name: str
    title: str
    write: Callable[[Path, ConvertedObject], list[Path]]
    failures: bool = False
    free_way: bool = False
