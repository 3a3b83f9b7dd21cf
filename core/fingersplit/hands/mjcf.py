"""MJCF to arrays: finger chains, pads and collision primitives of a hand, as MuJoCo compiles them."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from fingersplit.hands.kernel import MAX_JOINTS, HandArrays
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["HandModel", "read_mjcf"]


@dataclass(frozen=True)
class HandModel:
    """What an MJCF file says of a hand: joint and shape names, and the arrays for kernels."""

    joint_names: tuple[str, ...]
    shape_names: tuple[str, ...]
    arrays: HandArrays


def read_mjcf(path: Path, palm: str, fingers: tuple[str, ...]) -> HandModel:
    """Read a hand whose finger ``f`` carries the site ``f_pad`` on its last link.

    Args:
        path: MJCF file with one body for the palm and at most one hinge a body.
        palm: Name of the palm's body; its frame is the palm frame.
        fingers: Finger names in the order that all per-finger arrays take.

    Raises:
        ValueError: The file does not describe such a hand.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    palm_id = model.body(palm).id
    place: dict[int, tuple[int, int]] = {palm_id: (-1, 0)}
    body_poses = {palm_id: np.eye(4)}
    count, n = len(fingers), model.njnt
    chains = [_chain(model, model.site(f"{finger}_pad").bodyid[0], palm_id) for finger in fingers]
    joint_counts = np.zeros(count, np.int64)
    joint_indices = np.zeros((count, MAX_JOINTS), np.int64)
    rotations, positions = np.tile(np.eye(3), (count, MAX_JOINTS, 1, 1)), np.zeros((count, MAX_JOINTS, 3))
    axes = np.zeros((count, MAX_JOINTS, 3))
    pad_positions, pad_normals, pad_radii = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for f, chain in enumerate(chains):
        previous_from_body = np.eye(4)
        for body in chain:
            previous_from_body = previous_from_body @ _body_pose(model, body)
            if model.body_jntnum[body]:
                j, joint = joint_counts[f], model.body_jntadr[body]
                if model.body_jntnum[body] > 1 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
                    raise ValueError(f"{path}: {model.body(body).name} must have one joint, a hinge.")
                if j == MAX_JOINTS:
                    raise ValueError(f"{path}: {fingers[f]} has more than {MAX_JOINTS} joints.")
                joint_from_body = pose_matrix(np.eye(3), -model.jnt_pos[joint])
                previous_from_joint = previous_from_body @ np.linalg.inv(joint_from_body)
                rotations[f, j], positions[f, j] = previous_from_joint[:3, :3], previous_from_joint[:3, 3]
                axes[f, j], joint_indices[f, j] = model.jnt_axis[joint], joint
                joint_counts[f] += 1
                previous_from_body = joint_from_body
            place[body], body_poses[body] = (f, joint_counts[f] - 1), previous_from_body
        pad = model.site(f"{fingers[f]}_pad")
        link_from_pad = previous_from_body @ pose_matrix(rotation_from_wxyz(pad.quat), pad.pos)
        pad_positions[f], pad_normals[f], pad_radii[f] = link_from_pad[:3, 3], link_from_pad[:3, 2], pad.size[0]
    shapes = [g for g in range(model.ngeom) if model.geom_bodyid[g] in place]
    if len(shapes) < model.ngeom:
        astray = next(g for g in range(model.ngeom) if g not in shapes)
        raise ValueError(f"{path}: geom {model.geom(astray).name!r} hangs on no finger's chain and not on the palm.")
    link_from_shapes = [
        body_poses[model.geom_bodyid[g]] @ pose_matrix(rotation_from_wxyz(model.geom_quat[g]), model.geom_pos[g])
        for g in shapes
    ]
    arrays = HandArrays(
        joint_counts=joint_counts,
        joint_indices=joint_indices,
        rotations=rotations,
        positions=positions,
        axes=axes,
        pad_positions=pad_positions,
        pad_normals=pad_normals,
        pad_radii=pad_radii,
        lower=model.jnt_range[:, 0].copy(),
        upper=model.jnt_range[:, 1].copy(),
        shape_kinds=model.geom_type[shapes].astype(np.int64),
        shape_fingers=np.array([place[model.geom_bodyid[g]][0] for g in shapes]),
        shape_links=np.array([place[model.geom_bodyid[g]][1] for g in shapes]),
        shape_rotations=np.array([pose[:3, :3] for pose in link_from_shapes]),
        shape_positions=np.array([pose[:3, 3] for pose in link_from_shapes]),
        shape_sizes=model.geom_size[shapes].copy(),
    )
    for array in arrays:
        array.setflags(write=False)
    names = tuple(model.joint(j).name for j in range(n))
    return HandModel(names, tuple(model.geom(g).name for g in shapes), arrays)


def _chain(model: mujoco.MjModel, last: int, palm: int) -> list[int]:
    """Bodies from the first below the palm to ``last``."""
    chain: list[int] = []
    body = last
    while body != palm:
        if body == 0:
            raise ValueError(f"Body {model.body(last).name!r} does not hang below the palm.")
        chain.insert(0, body)
        body = model.body_parentid[body]
    return chain


def _body_pose(model: mujoco.MjModel, body: int) -> np.ndarray:
    """``parent_from_body`` at zero angles, (4, 4)."""
    return pose_matrix(rotation_from_wxyz(model.body_quat[body]), model.body_pos[body])
