"""MJCF to arrays: finger chains, pads and collision primitives of a hand, as MuJoCo compiles them."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from fingersplit.hands.drivers import set_drivers
from fingersplit.hands.limits import MAX_CHAIN_JOINTS, MAX_FINGERS, MAX_SHAPES, MAX_SPHERES
from fingersplit.hands.records import HAND
from fingersplit.hands.shapes import bounding_radius, covering_spheres
from fingersplit.transforms import pose_matrix, rotation_from_wxyz, rotation_to_axis, transform_points

__all__ = ["HandModel", "read_mjcf"]


@dataclass(frozen=True)
class HandModel:
    """What an MJCF file says of a hand: joint and shape names, and the ``HAND`` record for kernels."""

    joint_names: tuple[str, ...]
    shape_names: tuple[str, ...]
    arrays: np.record


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
    if len(fingers) > MAX_FINGERS:
        raise ValueError(f"{path}: {len(fingers)} fingers; the kernels are built for {MAX_FINGERS}.")
    records = np.rec.array(np.zeros(1, HAND))
    hand = records[0]
    hand.finger_count, hand.chain_count, hand.joint_count = len(fingers), len(fingers), model.njnt
    hand.pad_angle_scales[:] = 1.0
    hand.lower[: model.njnt], hand.upper[: model.njnt] = model.jnt_range.T
    palm_id = model.body(palm).id
    place = {palm_id: (-1, 0)}
    link_from_body = {palm_id: np.eye(4)}
    for f, finger in enumerate(fingers):
        _read_finger(model, path, finger, palm_id, f, hand, place, link_from_body)
    shapes = [g for g in range(model.ngeom) if model.geom_bodyid[g] in place]
    if len(shapes) < model.ngeom:
        astray = next(g for g in range(model.ngeom) if g not in shapes)
        raise ValueError(f"{path}: geom {model.geom(astray).name!r} hangs on no finger's chain and not on the palm.")
    if len(shapes) > MAX_SHAPES:
        raise ValueError(f"{path}: {len(shapes)} geoms; the kernels are built for {MAX_SHAPES}.")
    hand.shape_count = len(shapes)
    for k, g in enumerate(shapes):
        body = model.geom_bodyid[g]
        link_from_shape = link_from_body[body] @ pose_matrix(rotation_from_wxyz(model.geom_quat[g]), model.geom_pos[g])
        hand.shape_fingers[k], hand.shape_links[k] = place[body]
        _set_shape(hand, k, model.geom_type[g], model.geom_size[g], link_from_shape, path)
    set_drivers(hand, np.eye(model.njnt), np.zeros(model.njnt), *model.jnt_range.T)
    records.setflags(write=False)
    names = tuple(model.joint(j).name for j in range(model.njnt))
    return HandModel(names, tuple(model.geom(g).name for g in shapes), records[0])


def _read_finger(
    model: mujoco.MjModel,
    path: Path,
    finger: str,
    palm: int,
    f: int,
    hand: np.record,
    place: dict[int, tuple[int, int]],
    link_from_body: dict[int, np.ndarray],
) -> None:
    """Chain and pad of one finger into ``hand``; for each body its place (finger, joint) and its pose in that link."""
    pad = model.site(f"{finger}_pad")
    last_from_body: np.ndarray = np.eye(4)
    for body in _chain(model, pad.bodyid[0], palm):
        last_from_body = last_from_body @ _body_pose(model, body)
        if model.body_jntnum[body]:
            j, joint = hand.joint_counts[f], model.body_jntadr[body]
            if model.body_jntnum[body] > 1 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
                raise ValueError(f"{path}: {model.body(body).name} must have one joint, a hinge.")
            if j == MAX_CHAIN_JOINTS:
                raise ValueError(f"{path}: {finger} has more than {MAX_CHAIN_JOINTS} joints.")
            body_from_link = pose_matrix(rotation_to_axis(model.jnt_axis[joint]), model.jnt_pos[joint])
            last_from_link = last_from_body @ body_from_link
            hand.rotations[f, j], hand.positions[f, j] = last_from_link[:3, :3], last_from_link[:3, 3]
            hand.joint_indices[f, j] = joint
            hand.joint_counts[f] += 1
            last_from_body = np.linalg.inv(body_from_link)
        link = hand.joint_counts[f] - 1
        place[body], link_from_body[body] = ((f, link) if link >= 0 else (-1, 0)), last_from_body
    link_from_pad = last_from_body @ pose_matrix(rotation_from_wxyz(pad.quat), pad.pos)
    hand.pad_positions[f], hand.pad_normals[f] = link_from_pad[:3, 3], link_from_pad[:3, 2]
    hand.pad_radii[f] = pad.size[0]


def _set_shape(hand: np.record, k: int, kind: int, size: np.ndarray, link_from_shape: np.ndarray, path: Path) -> None:
    """Shape ``k`` and the spheres that cover it into ``hand``."""
    hand.shape_kinds[k], hand.shape_sizes[k] = kind, size
    hand.shape_rotations[k], hand.shape_positions[k] = link_from_shape[:3, :3], link_from_shape[:3, 3]
    centers, radius, inside = covering_spheres(kind, size)
    hand.shape_radii[k] = bounding_radius(kind, size)
    first, last = hand.sphere_count, hand.sphere_count + len(centers)
    if last > MAX_SPHERES:
        raise ValueError(f"{path}: its shapes need more than the {MAX_SPHERES} spheres the kernels are built for.")
    hand.sphere_shapes[first:last] = k
    hand.sphere_radii[first:last], hand.sphere_insides[first:last] = radius, inside
    hand.sphere_centers[first:last] = transform_points(link_from_shape, centers)
    hand.sphere_count = hand.sphere_starts[k + 1] = last


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
