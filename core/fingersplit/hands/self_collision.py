"""Which collision shapes of a hand may not meet each other."""

from functools import lru_cache
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel, Shape, Solid
from fingersplit.hands.shapes import corners_of
from fingersplit.hands.shapes_kernel import CONVEX
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["neutral_joints", "rough_shapes", "self_collision_pairs", "shape_distances"]

Array = NDArray[np.float64]

NEAR = 2e-3
"""[m]; links so near to each other while nothing is closed are taken for neighbours."""
POSTURES = 200
"""Random postures in which fitted shapes are compared with the solids they stand for."""
ENDS = 0.15
"""How often a driver stands at each of its limits, where links meet most, by how often it stands between them."""
FAR = 1.0
"""[m]; distances are not measured beyond."""


def self_collision_pairs(model: HandModel) -> NDArray[np.int64]:
    """Pairs of shapes (n, 2) that are tested against each other.

    Left out are shapes of one rigid body, of links next to each other and of pairs that the model excludes. Neighbours
    are left out, too: of two links of which one carries the other, solids that nearly touch while all drivers stand at
    zero or at the limit nearest to it; of any links, solids that nearly touch in every posture; and of one finger,
    fitted shapes that overlap in some postures where the solids they stand for never do.
    """
    return _judge(model)[0]


def rough_shapes(model: HandModel) -> frozenset[int]:
    """Fitted shapes that nearly touch another of their finger while nothing is closed, though their solids do not.

    As these meet in other postures, the pair is to be tested, and such shapes would forbid what is free.
    """
    return _judge(model)[1]


@lru_cache(maxsize=64)
def _judge(model: HandModel) -> tuple[NDArray[np.int64], frozenset[int]]:
    pairs, carried = _candidates(model)
    postures = _postures(model)
    beyond = np.array([shape.overhang for shape in model.shapes])[pairs].sum(axis=1) > NEAR
    near = shape_distances(model, postures[0], pairs) < NEAR
    doubtful = np.flatnonzero(near | (carried & beyond))
    fitted = shape_distances(model, postures, pairs[doubtful])
    tested, rough = np.ones(len(pairs), bool), set()
    for k, distances in zip(doubtful, fitted.T, strict=True):
        solids = _where_near(model, pairs[k], distances, postures)
        lasting = bool((solids < NEAR).all() or (carried[k] and solids[0] < NEAR))
        imagined = bool(carried[k] and beyond[k] and (distances < 0).any() and not (solids < 0).any())
        tested[k] = not (lasting or imagined)
        if tested[k] and carried[k] and beyond[k] and near[k]:
            rough |= {int(i) for i in pairs[k] if model.shapes[i].overhang > 0}
    return pairs[tested], frozenset(rough)


def _candidates(model: HandModel) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Pairs of shapes (n, 2) of links that could meet, and of which the link of one carries that of the other (n,)."""
    bodies = [_rigid_body(model, i) for i in range(len(model.links))]
    above = [_above(model, bodies, i) for i in range(len(model.links))]
    paths = [set(model.path(i)) for i in range(len(model.links))]
    excluded = {frozenset((bodies[a], bodies[b])) for a, b in model.excluded}
    pairs, carried = [], []
    for i, j in combinations(range(len(model.shapes)), 2):
        a, b = bodies[model.shapes[i].link], bodies[model.shapes[j].link]
        if a != b and above[a] != b and above[b] != a and frozenset((a, b)) not in excluded:
            pairs.append((i, j))
            carried.append(a in paths[b] or b in paths[a])
    return np.array(pairs, dtype=np.int64).reshape(-1, 2), np.array(carried, dtype=bool)


def _postures(model: HandModel) -> Array:
    """Joint angles (n, N) [rad], the neutral ones first."""
    coupling = model.coupling
    shares = np.random.default_rng(0).uniform(-ENDS, 1 + ENDS, (POSTURES, len(coupling.lower))).clip(0, 1)
    drivers = coupling.lower + shares * (coupling.upper - coupling.lower)
    return np.vstack([neutral_joints(model), model.joints_from_drivers(drivers)])


def _where_near(model: HandModel, pair: NDArray[np.int64], fitted: Array, postures: Array) -> Array:
    """Least distance (n,) [m] of the solids that two shapes stand for; infinite where the shapes are not near."""
    near = np.flatnonzero(fitted < NEAR)  # solids lie inside of shapes, so they are nowhere nearer
    names = [model.shapes[k].sources for k in pair]
    one, other = ([k for k, solid in enumerate(model.solids) if solid.name in sources] for sources in names)
    pairs = np.array([(i, j) for i in one for j in other], dtype=np.int64)
    found = np.full(len(postures), np.inf)
    found[near] = _distances(model, model.solids, postures[near], pairs).min(axis=-1)
    return found


def neutral_joints(model: HandModel) -> Array:
    """Joint angles (N,) [rad] with every driver at zero, or at the limit nearest to it."""
    return model.joints_from_drivers(np.clip(0.0, model.coupling.lower, model.coupling.upper))


def shape_distances(model: HandModel, joints: ArrayLike, pairs: NDArray[np.int64]) -> Array:
    """Signed distances (..., n) [m] of pairs of shapes at joint angles (..., N) [rad], negative where they overlap."""
    return _distances(model, model.shapes, joints, pairs)


def _distances(
    model: HandModel, geoms: tuple[Shape | Solid, ...], joints: ArrayLike, pairs: NDArray[np.int64]
) -> Array:
    scene, data, link_from_geom = _scene(geoms)
    angles = np.asarray(joints, dtype=np.float64)
    poses = link_poses(model, angles.reshape(-1, angles.shape[-1]))
    used = np.unique(pairs)
    found = np.empty((len(poses), len(pairs)))
    places = poses[:, [geoms[k].link for k in used]] @ link_from_geom[used]
    for row, posed in zip(found, places, strict=True):
        data.geom_xpos[used], data.geom_xmat[used] = posed[:, :3, 3], posed[:, :3, :3].reshape(-1, 9)
        row[:] = [mujoco.mj_geomDistance(scene, data, int(i), int(j), FAR, None) for i, j in pairs]
    return found.reshape(*angles.shape[:-1], len(pairs))


@lru_cache(maxsize=64)
def _scene(geoms: tuple[Shape | Solid, ...]) -> tuple[Any, Any, Array]:
    """A MuJoCo model with every shape or solid, and where its frames of them stand on their links, (n, 4, 4)."""
    spec = mujoco.MjSpec()
    for number, geom in enumerate(geoms):
        corners = geom.vertices if isinstance(geom, Solid) else None
        if isinstance(geom, Shape) and geom.kind == CONVEX:
            corners = corners_of(geom.size)
        if corners is None:
            spec.worldbody.add_geom(type=mujoco.mjtGeom(geom.kind), size=np.maximum(geom.size, 1e-9))
        else:
            name = f"mesh{number}"
            spec.add_mesh(name=name, uservert=corners.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
    scene = spec.compile()
    poses = [
        geom.pose @ pose_matrix(rotation_from_wxyz(turn), place)  # meshes are turned to their axes of inertia
        for geom, turn, place in zip(geoms, scene.geom_quat, scene.geom_pos, strict=True)
    ]
    return scene, mujoco.MjData(scene), np.array(poses).reshape(-1, 4, 4)


def _rigid_body(model: HandModel, link: int) -> int:
    """The link that a link without joints is rigidly joined to, up to the palm."""
    while model.links[link].parent >= 0 and not model.links[link].joints:
        link = model.links[link].parent
    return link


def _above(model: HandModel, bodies: list[int], link: int) -> int:
    parent = model.links[bodies[link]].parent
    return -1 if parent < 0 else bodies[parent]
