"""A hand: its joints, fingers, pads and shapes, compiled from a description and the model beside it."""

from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import HandError
from fingersplit.hands.collision_shapes import convex_solids, planning_shapes, with_hulls
from fingersplit.hands.couplings import read_coupling
from fingersplit.hands.description import GripDescription, HandDescription
from fingersplit.hands.files import HandFiles, find_hand, is_shipped, shipped_hands
from fingersplit.hands.fingers import Chain, Pad, read_fingers
from fingersplit.hands.gripper import Gripper, driver_angles, read_gripper
from fingersplit.hands.kinematics_kernel import move_fingers, place_shape
from fingersplit.hands.model import HandModel
from fingersplit.hands.record import active_drivers, hand_record
from fingersplit.hands.records import POSE
from fingersplit.hands.self_collision import rough_shapes
from fingersplit.hands.shapes import shape_mesh
from fingersplit.hands.simulation import hand_spec
from fingersplit.hands.tree import Tree, compile_model, read_tree
from fingersplit.transforms import pose_matrix, transform_points

__all__ = ["Finger", "Gripper", "Hand", "available_hands", "compile_hand", "load_hand"]


@dataclass(frozen=True)
class Finger:
    """One finger: its name, its joints from the palm outwards, and the radius of its spherical pad [m]."""

    name: str
    joint_names: tuple[str, ...]
    pad_radius: float


@dataclass(frozen=True, eq=False)
class Hand:
    """A multi-fingered hand as data, with the fingers that grasp; others are parked.

    Attributes:
        name: Name of its folder or archive, as requests use it.
        title: Maker and model for people.
        sha256: Hash of the description and the model files, 64 hex digits.
        description: What the hand was compiled from.
        model: Links, joints, couplings and solids.
        chains: All fingers, active or not.
        fingers: The active fingers, in the order of every per-finger array.
        pads: The pad of each active finger.
        gripper: How the active fingers imitate a parallel gripper.
        drivers: Drivers of the active fingers, by their place in ``model.coupling``, (A,).
        arrays: The same hand for kernels, a ``HAND`` record.
        grips: The same hand for every set of active fingers, the preferred one first; itself among them.
    """

    name: str
    title: str
    sha256: str
    description: HandDescription
    model: HandModel
    chains: tuple[Chain, ...]
    fingers: tuple[Finger, ...]
    pads: tuple[Pad, ...]
    gripper: Gripper
    drivers: tuple[int, ...]
    arrays: np.record
    _siblings: list["Hand"] = field(default_factory=list, repr=False)

    @property
    def grips(self) -> tuple["Hand", ...]:
        """The same hand for every set of active fingers, the preferred one first; itself among them."""
        return tuple(self._siblings)

    def alone(self) -> "Hand":
        """The same hand that has no other set of active fingers."""
        return replace(self, _siblings=[])

    @property
    def palm(self) -> str:
        """Name of the palm's body."""
        return self.model.links[0].name

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the order of every joint vector, (N,)."""
        return self.model.joint_names

    @cached_property
    def driver_names(self) -> tuple[str, ...]:
        """Joints of active fingers that motors turn, (A,)."""
        return tuple(self.model.coupling.drivers[a] for a in self.drivers)

    @cached_property
    def shape_names(self) -> tuple[str, ...]:
        """Collision primitives in the order of ``arrays.shape_kinds``."""
        return tuple(shape.name for shape in self.model.shapes)

    @property
    def lower(self) -> NDArray[np.float64]:
        """Lower joint limits, (N,) [rad]; of a parked joint where it is parked."""
        return np.asarray(self.arrays.lower[: self.arrays.joint_count])

    @property
    def upper(self) -> NDArray[np.float64]:
        """Upper joint limits, (N,) [rad]; of a parked joint where it is parked."""
        return np.asarray(self.arrays.upper[: self.arrays.joint_count])

    @cached_property
    def torque_limits(self) -> NDArray[np.float64]:
        """Largest torque of each driver of the active fingers either way, (A,) [N m]."""
        limits = self.torque_ranges.min(axis=0)
        limits.setflags(write=False)
        return np.asarray(limits)

    @cached_property
    def torque_ranges(self) -> NDArray[np.float64]:
        """Largest torque of each of these drivers towards larger and towards smaller angles, (2, A) [N m]."""
        ranges = self.model.coupling.torque_ranges[:, list(self.drivers)]
        ranges.setflags(write=False)
        return ranges

    @cached_property
    def parked_links(self) -> tuple[str, ...]:
        """Bodies of the fingers that are not active."""
        active = {j for finger in self.fingers for j in map(self.joint_names.index, finger.joint_names)}
        links = range(1, len(self.model.links))
        moving = [[j for link in self.model.path(i) for j in self.model.links[link].joints] for i in links]
        return tuple(
            self.model.links[i].name
            for i, joints in zip(links, moving, strict=True)
            if joints and joints[-1] not in active
        )

    def spec(self) -> Any:
        """A fresh ``MjSpec`` of the hand: links, hinges, solids, couplings; no actuators."""
        return hand_spec(self.model)

    def pose(self, joints: ArrayLike, object_from_palm: ArrayLike | None = None) -> np.record:
        """Links, pads and Jacobians at ``joints`` (N,) [rad], in the palm frame or the frame given by a (4, 4) pose.

        Returns:
            A record with the fields of ``hands.records.POSE_FIELDS``.
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
        """Joint angles (N,) by joint name, or numbers (A,) by driver name."""
        names = self.joint_names if len(joints) == len(self.joint_names) else self.driver_names
        return dict(zip(names, joints.tolist(), strict=True))

    def to_document(self) -> dict[str, Any]:
        """Name, title, fingers, joints with their limits [rad] and hash, as plain JSON data."""
        names = self.joint_names
        return {
            "name": self.name,
            "title": self.title,
            "fingers": [
                {
                    "name": chain.name,
                    "joints": [names[j] for j in chain.joints],
                    "pad_radius": float(chain.pads[0].radius),
                }
                for chain in self.chains
            ],
            "joints": [
                {"name": joint.name, "lower": float(joint.lower), "upper": float(joint.upper)}
                for joint in self.model.joints
            ],
            "sha256": self.sha256,
        }


def available_hands() -> tuple[str, ...]:
    """Names of the hands that ship and can be planned for."""
    return shipped_hands()


def load_hand(source: str | Path) -> Hand:
    """A hand by its name, its folder or its zip; loaded once as long as its files stay the same.

    Raises:
        UnknownHandError: Neither a name nor anything on disk; the message lists the known names.
        HandError: Files that describe no hand that can be planned with; the message says what to change.
    """
    if isinstance(source, str) and is_shipped(source):
        return _shipped(source)
    return _compiled(_Keyed(find_hand(source)))


@cache
def _shipped(name: str) -> Hand:
    return compile_hand(find_hand(name))


class _Keyed:
    """Files of a hand that are the same when their names and hashes are."""

    def __init__(self, files: HandFiles) -> None:
        self.files = files

    def __hash__(self) -> int:
        return hash((self.files.name, self.files.sha256))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Keyed) and (self.files.name, self.files.sha256) == (
            other.files.name,
            other.files.sha256,
        )


@cache
def _compiled(keyed: _Keyed) -> Hand:
    return compile_hand(keyed.files)


def compile_hand(files: HandFiles) -> Hand:
    """Compile a hand; the first of its grips is active.

    Raises:
        HandError: The model and the description are no hand that can be planned with.
    """
    try:
        return _compile(files)
    except HandError as error:
        raise HandError(f"{files.name}: {error}") from error


def _compile(files: HandFiles) -> Hand:
    description = files.description
    compiled, notes = compile_model(files.model, files.root)
    tree = read_tree(compiled, description)
    coupling, coupling_notes = read_coupling(compiled, tree, description)
    solids = convex_solids(tree.collision)
    model = HandModel(
        links=tree.links,
        joints=tree.joints,
        coupling=coupling,
        solids=solids,
        visuals=tree.visuals,
        shapes=(),
        excluded=_excluded(compiled, tree),
        notes=(*notes, *coupling_notes),
        motors=int(compiled.nu),
    )
    chains = read_fingers(compiled, tree, model, description)
    pads = tuple(pad for chain in chains for pad in chain.pads)
    model = replace(model, shapes=planning_shapes(solids, tree.links, description.shapes.budget, pads))
    rough = rough_shapes(model)
    if rough:
        model = replace(model, shapes=with_hulls(model.shapes, solids, rough))
    first = _with_grip(files, model, chains, description.grips[0])
    siblings = [first, *(_with_grip(files, model, chains, grip) for grip in description.grips[1:])]
    for hand in siblings:
        hand._siblings.extend(siblings)
    return first


def _with_grip(files: HandFiles, model: HandModel, chains: tuple[Chain, ...], grip: GripDescription) -> Hand:
    by_name = {chain.name: chain for chain in chains}
    active = [by_name[name] for name in (*grip.jaws[0], *grip.jaws[1])]
    pads = tuple(chain.pads[grip.pads.get(chain.name, 0)] for chain in active)
    resting = model.joints_from_drivers(driver_angles(model, grip.parked, "parked"))
    names = model.joint_names
    hand = Hand(
        name=files.name,
        title=files.description.title,
        sha256=files.sha256,
        description=files.description,
        model=model,
        chains=chains,
        fingers=tuple(
            Finger(chain.name, tuple(names[j] for j in chain.joints), float(pad.radius))
            for chain, pad in zip(active, pads, strict=True)
        ),
        pads=pads,
        gripper=read_gripper(model, grip, active_drivers(model, active)),
        drivers=tuple(active_drivers(model, active)),
        arrays=hand_record(model, active, pads, resting),
    )
    for array in (model.coupling.torque_ranges, model.coupling.matrix, model.coupling.offset):
        array.setflags(write=False)
    return hand


def _excluded(compiled: Any, tree: Tree) -> frozenset[tuple[int, int]]:
    """Pairs of links that the model excludes from contact."""
    pairs = set()
    for signature in compiled.exclude_signature:
        links = [tree.link_of_body.get(body) for body in (int(signature) >> 16, int(signature) & 0xFFFF)]
        if links[0] is not None and links[1] is not None:
            pairs.add((min(links[0], links[1]), max(links[0], links[1])))
    return frozenset(pairs)
