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
from fingersplit.hands.kinematics_kernel import move_fingers, place_shape
from fingersplit.hands.limits import MAX_CHAIN_JOINTS
from fingersplit.hands.mjcf import read_mjcf
from fingersplit.hands.records import POSE
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
        torque_limits: Largest torque of each joint, (N,) [N m].
        arrays: The same hand for kernels, a ``hands.kernel.HAND`` record.
        mjcf: The file that describes its bodies, for simulation.
        palm: Name of the palm's body in that file.
    """

    name: str
    title: str
    joint_names: tuple[str, ...]
    shape_names: tuple[str, ...]
    fingers: tuple[Finger, ...]
    gripper: Gripper
    torque_limits: NDArray[np.float64]
    arrays: np.record
    mjcf: Path
    palm: str

    @property
    def lower(self) -> NDArray[np.float64]:
        """Lower joint limits, (N,) [rad]."""
        return np.asarray(self.arrays.lower[: self.arrays.joint_count])

    @property
    def upper(self) -> NDArray[np.float64]:
        """Upper joint limits, (N,) [rad]."""
        return np.asarray(self.arrays.upper[: self.arrays.joint_count])

    @cached_property
    def finger_torque_limits(self) -> NDArray[np.float64]:
        """Largest torque of each finger's joints, infinite beyond its last, (F, MAX_CHAIN_JOINTS) [N m]."""
        limits = np.full((len(self.fingers), MAX_CHAIN_JOINTS), np.inf)
        for f, count in enumerate(self.arrays.joint_counts[: len(self.fingers)]):
            limits[f, :count] = self.torque_limits[self.arrays.joint_indices[f, :count]]
        return limits

    def pose(self, joints: ArrayLike, object_from_palm: ArrayLike | None = None) -> np.record:
        """Links, pads and Jacobians at ``joints`` (N,) [rad], in the palm frame or the frame given by a (4, 4) pose.

        Returns:
            A record with the fields of ``hands.kernel.POSE_FIELDS``.
        """
        pose: np.record = np.rec.array(np.zeros(1, POSE))[0]
        pose.joints[: self.arrays.joint_count] = joints
        object_from_palm = np.eye(4) if object_from_palm is None else np.asarray(object_from_palm)
        pose.palm_rotation, pose.palm_position = object_from_palm[:3, :3], object_from_palm[:3, 3]
        move_fingers(self.arrays, pose)
        return pose

    def shape_poses(self, joints: ArrayLike, object_from_palm: ArrayLike | None = None) -> list[NDArray[np.float64]]:
        """``object_from_shape`` (4, 4) of every collision primitive; arguments as ``pose``."""
        pose, rotation, poses = self.pose(joints, object_from_palm), np.empty((3, 3)), []
        for k in range(self.arrays.shape_count):
            position = place_shape(self.arrays, pose, k, rotation)
            poses.append(pose_matrix(rotation, position))
        return poses

    def posed_meshes(self, joints: ArrayLike) -> list[tuple[str, NDArray[np.float64], NDArray[np.int64]]]:
        """Every collision primitive as name, vertices in the palm frame (n, 3) [m] and faces (m, 3)."""
        return [
            (name, transform_points(palm_from_shape, mesh.vertices), np.asarray(mesh.faces))
            for name, mesh, palm_from_shape in zip(
                self.shape_names, self.shape_meshes, self.shape_poses(joints), strict=True
            )
        ]

    @cached_property
    def shape_meshes(self) -> list[trimesh.Trimesh]:
        """Every collision primitive as a closed mesh in its own frame, for drawing."""
        return [
            shape_mesh(self.arrays.shape_kinds[k], self.arrays.shape_sizes[k]) for k in range(len(self.shape_names))
        ]

    def named(self, joints: NDArray[np.float64]) -> dict[str, float]:
        """Joint angles (N,) by joint name."""
        return dict(zip(self.joint_names, joints.tolist(), strict=True))

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
    arrays = model.arrays
    fingers = tuple(
        Finger(
            finger,
            tuple(model.joint_names[j] for j in arrays.joint_indices[f, : arrays.joint_counts[f]]),
            float(arrays.pad_radii[f]),
        )
        for f, finger in enumerate(description["fingers"])
    )
    torque_limits = np.array([float(description["torque_limits"][joint]) for joint in model.joint_names])
    torque_limits.setflags(write=False)
    return Hand(
        name=name,
        title=description["title"],
        joint_names=model.joint_names,
        shape_names=model.shape_names,
        fingers=fingers,
        gripper=_gripper(description, model.joint_names),
        torque_limits=torque_limits,
        arrays=arrays,
        mjcf=folder / "hand.xml",
        palm=description["palm"],
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
