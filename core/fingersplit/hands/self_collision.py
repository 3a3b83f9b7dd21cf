"""Which collision shapes of a hand may not meet each other."""

from functools import lru_cache
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel
from fingersplit.transforms import wxyz_from_rotation

__all__ = ["neutral_joints", "self_collision_pairs", "shape_distances"]

Array = NDArray[np.float64]

NEAR = 2e-3
"""[m]; shapes so near to each other while nothing is closed are taken for neighbours."""
FAR = 1.0
"""[m]; distances are not measured beyond."""


@lru_cache(maxsize=64)
def self_collision_pairs(model: HandModel) -> NDArray[np.int64]:
    """Pairs of shapes (n, 2) that are tested against each other.

    Left out are shapes of one rigid body, of links next to each other, of pairs that the model excludes, and those that
    nearly touch while all drivers stand at zero or at the limit nearest to it: they are neighbours.
    """
    bodies = [_rigid_body(model, i) for i in range(len(model.links))]
    above = [_above(model, bodies, i) for i in range(len(model.links))]
    excluded = {frozenset((bodies[a], bodies[b])) for a, b in model.excluded}
    pairs = []
    for i, j in combinations(range(len(model.shapes)), 2):
        a, b = bodies[model.shapes[i].link], bodies[model.shapes[j].link]
        if a != b and above[a] != b and above[b] != a and frozenset((a, b)) not in excluded:
            pairs.append((i, j))
    found = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return found[shape_distances(model, neutral_joints(model), found) > NEAR]


def neutral_joints(model: HandModel) -> Array:
    """Joint angles (N,) [rad] with every driver at zero, or at the limit nearest to it."""
    return model.joints_from_drivers(np.clip(0.0, model.coupling.lower, model.coupling.upper))


def shape_distances(model: HandModel, joints: Array, pairs: NDArray[np.int64]) -> Array:
    """Signed distances (n,) [m] of pairs of shapes at joint angles (N,) [rad], negative where they overlap."""
    scene, data = _scene(model)
    poses = link_poses(model, joints)
    for k, shape in enumerate(model.shapes):
        palm_from_shape = poses[shape.link] @ shape.pose
        data.mocap_pos[k], data.mocap_quat[k] = palm_from_shape[:3, 3], wxyz_from_rotation(palm_from_shape[:3, :3])
    mujoco.mj_kinematics(scene, data)
    return np.array([mujoco.mj_geomDistance(scene, data, int(i), int(j), FAR, None) for i, j in pairs])


@lru_cache(maxsize=64)
def _scene(model: HandModel) -> tuple[Any, Any]:
    """A MuJoCo model with every shape on a body of its own."""
    spec = mujoco.MjSpec()
    for shape in model.shapes:
        body = spec.worldbody.add_body(mocap=True)
        body.add_geom(type=mujoco.mjtGeom(shape.kind), size=np.maximum(shape.size, 1e-9))
    scene = spec.compile()
    return scene, mujoco.MjData(scene)


def _rigid_body(model: HandModel, link: int) -> int:
    """The link that a link without joints is rigidly joined to, up to the palm."""
    while model.links[link].parent >= 0 and not model.links[link].joints:
        link = model.links[link].parent
    return link


def _above(model: HandModel, bodies: list[int], link: int) -> int:
    parent = model.links[bodies[link]].parent
    return -1 if parent < 0 else bodies[parent]
