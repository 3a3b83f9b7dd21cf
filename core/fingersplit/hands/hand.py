"""A hand: its joints, fingers, pads and shapes, read from one folder of MJCF and description."""

import tomllib
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import UnknownHandError
from fingersplit.hands.kernel import HandArrays, HandPose, empty_pose, move_fingers, place_shapes
from fingersplit.hands.mjcf import read_mjcf
from fingersplit.hands.shapes import shape_mesh
from fingersplit.transforms import pose_matrix, transform_points

__all__ = ["Finger", "Gripper", "Hand", "available_hands", "load_hand"]

_FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Finger:
    """One finger: its name, its joints from the palm outwards, and the radius of its spherical pad [m]."""

    name: str
    joint_names: tuple[str, ...]
    pad_radius: float


class Gripper(NamedTuple):
    """The parallel gripper that a hand imitates when it takes over a two-contact grasp; kernels read it as it is.

    Attributes:
        groups: For each finger the jaw it belongs to (0 or 1), (F,) int64.
        palm_from_gripper: Rotation with columns lateral, jaw (from jaw 1 to jaw 0) and approach axis, (3, 3).
        center: Jaw centre along the lateral and the jaw axis, (2,) [m].
        standoff: Lowest and highest jaw centre along the approach axis [m].
        opening: Least and largest distance of the two jaw contacts [m].
        preshapes: Joint angles from which the mapping starts, (n_preshapes, N) [rad].
    """

    groups: NDArray[np.int64]
    palm_from_gripper: NDArray[np.float64]
    center: NDArray[np.float64]
    standoff: tuple[float, float]
    opening: tuple[float, float]
    preshapes: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hand:
    """A multi-fingered hand as data.

    Attributes:
        name: Name of its folder, as requests use it.
        title: Maker and model for people.
        joint_names: Joints in the order of every joint vector, (N,).
        shape_names: Collision primitives in the order of ``arrays.shape_kinds``.
        fingers: The fingers, in the order of every per-finger array.
        gripper: How the hand imitates a parallel gripper.
        arrays: The same hand for kernels.
    """

    name: str
    title: str
    joint_names: tuple[str, ...]
    shape_names: tuple[str, ...]
    fingers: tuple[Finger, ...]
    gripper: Gripper
    arrays: HandArrays

    @property
    def lower(self) -> NDArray[np.float64]:
        """Lower joint limits, (N,) [rad]."""
        return self.arrays.lower

    @property
    def upper(self) -> NDArray[np.float64]:
        """Upper joint limits, (N,) [rad]."""
        return self.arrays.upper

    def pose(self, joints: ArrayLike, object_from_palm: ArrayLike | None = None) -> HandPose:
        """Links, pads and Jacobians at ``joints`` (N,) [rad], in the palm frame or the frame given by a (4, 4) pose."""
        pose: HandPose = empty_pose(self.arrays)
        pose.joints[:] = joints
        if object_from_palm is not None:
            pose.palm_rotation[:] = np.asarray(object_from_palm)[:3, :3]
            pose.palm_position[:] = np.asarray(object_from_palm)[:3, 3]
        move_fingers(self.arrays, pose, np.empty((2, 3, 3)))
        return pose

    def posed_meshes(self, joints: ArrayLike) -> list[tuple[str, NDArray[np.float64], NDArray[np.int64]]]:
        """Every collision primitive as name, vertices in the palm frame (n, 3) [m] and faces (m, 3)."""
        pose = self.pose(joints)
        place_shapes(self.arrays, pose)
        meshes = []
        for k, (name, mesh) in enumerate(zip(self.shape_names, self.shape_meshes, strict=True)):
            palm_from_shape = pose_matrix(pose.shape_rotations[k], pose.shape_positions[k])
            meshes.append((name, transform_points(palm_from_shape, mesh.vertices), np.asarray(mesh.faces)))
        return meshes

    @cached_property
    def shape_meshes(self) -> list[trimesh.Trimesh]:
        """Every collision primitive as a closed mesh in its own frame, for drawing."""
        return [
            shape_mesh(kind, size) for kind, size in zip(self.arrays.shape_kinds, self.arrays.shape_sizes, strict=True)
        ]

    def to_document(self) -> dict[str, Any]:
        """Name, title, fingers and joints with their limits [rad], as plain JSON data."""
        return {
            "name": self.name,
            "title": self.title,
            "fingers": [
                {"name": finger.name, "joints": list(finger.joint_names), "pad_radius": finger.pad_radius}
                for finger in self.fingers
            ],
            "joints": [
                {"name": name, "lower": float(low), "upper": float(high)}
                for name, low, high in zip(self.joint_names, self.lower, self.upper, strict=True)
            ],
        }


def available_hands() -> tuple[str, ...]:
    """Names of the hands that can be planned for."""
    return tuple(sorted(description.parent.name for description in _FOLDER.glob("*/hand.toml")))


@cache
def load_hand(name: str) -> Hand:
    """The hand of that name.

    Raises:
        UnknownHandError: No such hand; the message lists the known ones.
    """
    if name not in available_hands():
        raise UnknownHandError(name, available_hands())
    folder = _FOLDER / name
    description = tomllib.loads((folder / "hand.toml").read_text())
    model = read_mjcf(folder / "hand.xml", description["palm"], tuple(description["fingers"]))
    fingers = tuple(
        Finger(finger, tuple(model.joint_names[j] for j in indices[:count]), float(radius))
        for finger, indices, count, radius in zip(
            description["fingers"],
            model.arrays.joint_indices,
            model.arrays.joint_counts,
            model.arrays.pad_radii,
            strict=True,
        )
    )
    return Hand(
        name=name,
        title=description["title"],
        joint_names=model.joint_names,
        shape_names=model.shape_names,
        fingers=fingers,
        gripper=_gripper(description, model.joint_names),
        arrays=model.arrays,
    )


def _gripper(description: dict[str, Any], joint_names: tuple[str, ...]) -> Gripper:
    gripper = description["gripper"]
    jaw_of_finger = {finger: jaw for jaw, group in enumerate(gripper["groups"]) for finger in group}
    jaw, approach = np.array(gripper["jaw_axis"]), np.array(gripper["approach_axis"])
    return Gripper(
        groups=np.array([jaw_of_finger[finger] for finger in description["fingers"]]),
        palm_from_gripper=np.column_stack([np.cross(jaw, approach), jaw, approach]),
        center=np.array(gripper["center"]),
        standoff=(gripper["standoff"][0], gripper["standoff"][1]),
        opening=(gripper["opening"][0], gripper["opening"][1]),
        preshapes=np.array([[preshape[joint] for joint in joint_names] for preshape in description["preshapes"]]),
    )
