"""Which collision shapes of a hand may not meet each other."""

from functools import lru_cache
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel, Shape, Solid
from fingersplit.hands.shapes import corners_of
from fingersplit.hands.shapes_kernel import CONVEX
from fingersplit.transforms import wxyz_from_rotation

__all__ = ["neutral_joints", "self_collision_pairs", "shape_distances"]

Array = NDArray[np.float64]

NEAR = 2e-3
"""[m]; shapes so near to each other while nothing is closed are taken for neighbours."""
POSTURES = 100
"""Random postures in which fitted shapes are compared with the solids they stand for."""
FAR = 1.0
"""[m]; distances are not measured beyond."""


@lru_cache(maxsize=64)
def self_collision_pairs(model: HandModel) -> NDArray[np.int64]:
    """Pairs of shapes (n, 2) that are tested against each other.

    Left out are shapes of one rigid body, of links next to each other, of pairs that the model excludes, and those that
    nearly touch while all drivers stand at zero or at the limit nearest to it: they are neighbours. So are fitted
    shapes of one finger that overlap in some postures where the solids they stand for never do.
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
    found = found[shape_distances(model, neutral_joints(model), found) > NEAR]
    return found[~_only_fitted_meet(model, found, bodies)]


def _only_fitted_meet(model: HandModel, pairs: NDArray[np.int64], bodies: list[int]) -> NDArray[np.bool_]:
    """Which pairs of one finger (n,) overlap in some postures though the solids they stand for never do.

    A fitted shape reaches beyond its link, most of all into the links next but one.
    """
    shapes = model.shapes
    doubtful = [
        k
        for k, (i, j) in enumerate(pairs)
        if shapes[i].overhang + shapes[j].overhang > NEAR and _one_above(model, bodies, shapes[i].link, shapes[j].link)
    ]
    none = np.zeros(len(pairs), bool)
    if not doubtful:
        return none
    solids = {solid.name: k for k, solid in enumerate(model.solids)}
    behind = [
        np.array([(solids[a], solids[b]) for a in shapes[i].sources for b in shapes[j].sources])
        for i, j in pairs[doubtful]
    ]
    rng, coupling = np.random.default_rng(0), model.coupling
    fitted, real = np.zeros(len(doubtful), int), np.zeros(len(doubtful), int)
    for _ in range(POSTURES):
        joints = model.joints_from_drivers(rng.uniform(coupling.lower, coupling.upper))
        overlap = shape_distances(model, joints, pairs[doubtful]) < 0
        fitted += overlap
        for k in np.flatnonzero(overlap & (real == 0)):
            real[k] = bool((_distances(model, model.solids, joints, behind[k]) < 0).any())
    none[doubtful] = (fitted > 0) & (real == 0)
    return none


def _one_above(model: HandModel, bodies: list[int], a: int, b: int) -> bool:
    """Whether one of two links carries the other."""
    return bodies[a] in model.path(b) or bodies[b] in model.path(a)


def neutral_joints(model: HandModel) -> Array:
    """Joint angles (N,) [rad] with every driver at zero, or at the limit nearest to it."""
    return model.joints_from_drivers(np.clip(0.0, model.coupling.lower, model.coupling.upper))


def shape_distances(model: HandModel, joints: Array, pairs: NDArray[np.int64]) -> Array:
    """Signed distances (n,) [m] of pairs of shapes at joint angles (N,) [rad], negative where they overlap."""
    return _distances(model, model.shapes, joints, pairs)


def _distances(model: HandModel, geoms: tuple[Shape | Solid, ...], joints: Array, pairs: NDArray[np.int64]) -> Array:
    scene, data = _scene(geoms)
    poses = link_poses(model, joints)
    for k, geom in enumerate(geoms):
        palm_from_geom = poses[geom.link] @ geom.pose
        data.mocap_pos[k], data.mocap_quat[k] = palm_from_geom[:3, 3], wxyz_from_rotation(palm_from_geom[:3, :3])
    mujoco.mj_kinematics(scene, data)
    return np.array([mujoco.mj_geomDistance(scene, data, int(i), int(j), FAR, None) for i, j in pairs])


@lru_cache(maxsize=64)
def _scene(geoms: tuple[Shape | Solid, ...]) -> tuple[Any, Any]:
    """A MuJoCo model with every shape or solid on a body of its own, by its origin."""
    spec = mujoco.MjSpec()
    for number, geom in enumerate(geoms):
        body = spec.worldbody.add_body(mocap=True)
        corners = geom.vertices if isinstance(geom, Solid) else None
        if isinstance(geom, Shape) and geom.kind == CONVEX:
            corners = corners_of(geom.size)
        if corners is None:
            body.add_geom(type=mujoco.mjtGeom(geom.kind), size=np.maximum(geom.size, 1e-9))
        else:
            name = f"mesh{number}"
            spec.add_mesh(name=name, uservert=corners.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
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
