"""Pads of a hand that nobody has described: the side of each last link that faces the other fingers."""

import math

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.collision_shapes import solid_points
from fingersplit.hands.draft.sampling import Samples
from fingersplit.hands.fingers import Pad
from fingersplit.hands.forward import link_poses
from fingersplit.hands.limits import PAD_ANGLE_LIMIT
from fingersplit.hands.model import HandModel
from fingersplit.hands.tip_shapes import cone
from fingersplit.transforms import transform_points

__all__ = ["TILTS", "find_pads", "tip_width"]

Array = NDArray[np.float64]

TILTS = (0.6, 0.3, 0.0)
"""[rad]; how far pads' normals lean from straight across the link towards the fingertip, what is tried first first."""
CAP_ANGLE = PAD_ANGLE_LIMIT
"""[rad]; the pad's sphere is fitted to the surface that planes touch so far from its normal."""
MIN_RADIUS, MAX_RADIUS = 0.004, 0.03
"""Of a pad's sphere [m]."""
PARALLEL = 0.9
"""Cosine of axes that bend a finger the same way."""
NEAR = 0.03
"""[m]; where two fingertips are nearer than about this, they face each other most."""


def find_pads(model: HandModel, tips: list[int], samples: Samples, tilt: float = TILTS[0]) -> list[Pad]:
    """A pad for each finger.

    The normal is across the axis of the last joint and the link's length, to the side to which the finger bends farther
    and on which the other fingertips are found when all fingers move at random, and leans towards the tip. The sphere
    is fitted to the surface of the link's solids there.

    Args:
        model: The hand.
        tips: Last moving link of each finger.
        samples: Postures.
        tilt: How far normals lean towards the tip [rad].

    Raises:
        HandError: A last link without any solid.
    """
    clouds = [_surface(model, tip) for tip in tips]
    ends = [_far_end(model, tip, cloud) for tip, cloud in zip(tips, clouds, strict=True)]
    places = [_transform_all(samples.poses[:, tip], end) for tip, end in zip(tips, ends, strict=True)]
    return [_pad(model, f, tips, clouds[f], ends[f], places, samples, tilt) for f in range(len(tips))]


def tip_width(model: HandModel, tip: int) -> float:
    """How wide a finger's last link is along its last joint's axis [m]; fingers side by side need that room."""
    return float(np.ptp(_surface(model, tip) @ model.joints[model.links[tip].joints[-1]].axis))


def _transform_all(poses: Array, point: Array) -> Array:
    """A point of a link (3,) in the palm frame for every posture, (n, 3)."""
    return np.asarray(poses[:, :3, :3] @ point + poses[:, :3, 3])


def _surface(model: HandModel, tip: int) -> Array:
    """Points on the solids of a link and of what is rigidly joined to it, in the link's frame."""
    still = link_poses(model, np.array([joint.reference for joint in model.joints]))
    carried = [i for i in range(len(model.links)) if tip in model.path(i)]
    solids = [solid for solid in model.solids if solid.link in carried]
    if not solids:
        raise HandError(
            f"The last link {model.links[tip].name!r} of a finger has no shape; give it collision geometry."
        )
    clouds = []
    for solid in solids:
        tip_from_solid = np.linalg.inv(still[tip]) @ still[solid.link] @ solid.pose
        clouds.append(transform_points(tip_from_solid, solid_points(solid)))
    return np.vstack(clouds)


def _far_end(model: HandModel, tip: int, cloud: Array) -> Array:
    """The middle of that end of a link that is farthest from its last joint's axis."""
    joint = model.joints[model.links[tip].joints[-1]]
    reach = cloud - joint.anchor
    along = np.outer(reach @ joint.axis, joint.axis)
    distances = np.linalg.norm(reach - along, axis=1)
    far = cloud[distances > 0.97 * distances.max()]
    return np.asarray(far.mean(axis=0))


def _pad(
    model: HandModel,
    f: int,
    tips: list[int],
    cloud: Array,
    end: Array,
    places: list[Array],
    samples: Samples,
    tilt: float,
) -> Pad:
    joint = model.joints[model.links[tips[f]].joints[-1]]
    length = end - joint.anchor
    length = length - (length @ joint.axis) * joint.axis
    length /= np.linalg.norm(length)
    across = np.cross(joint.axis, length)
    others = [places[g] - places[f] for g in range(len(tips)) if g != f]
    vote, total = 0.0, 0.0
    for away in others:
        direction = np.einsum("ni,nij->nj", away, samples.poses[:, tips[f], :3, :3]) @ across
        distance = np.linalg.norm(away, axis=1)
        weight = 1 / (NEAR**2 + distance**2)
        vote += float(np.sum(weight * direction / distance))
        total += float(np.sum(weight))
    side = across if vote / total + _closing(model, tips[f]) > 0 else -across
    normal = math.cos(tilt) * side + math.sin(tilt) * length
    center, radius = _fit_cap(_last_part(cloud, length, joint.axis), normal)
    return Pad(tips[f], center, normal, radius, None)


def _last_part(cloud: Array, length: Array, axis: Array) -> Array:
    """A fingertip's points, without those of the link below it: no farther from its end than it is wide."""
    heights = cloud @ length
    for _ in range(2):  # the link below may be wider
        width = float(np.ptp(cloud @ axis))
        cloud = cloud[heights >= heights.max() - width]
        heights = cloud @ length
    return cloud


def _closing(model: HandModel, tip: int) -> float:
    """Which way a finger bends farther, -1 to 1: the mean over the joints parallel to its last one."""
    joints = [model.joints[j] for link in model.path(tip) for j in model.links[link].joints]
    poses = link_poses(model, np.array([joint.reference for joint in model.joints]))
    links = [link for link in model.path(tip) for _ in model.links[link].joints]
    axes = [poses[link][:3, :3] @ joint.axis for link, joint in zip(links, joints, strict=True)]
    shares = [
        float(np.sign(axis @ axes[-1])) * (joint.upper + joint.lower) / (joint.upper - joint.lower)
        for axis, joint in zip(axes, joints, strict=True)
        if abs(axis @ axes[-1]) > PARALLEL
    ]
    return float(np.clip(np.mean(shares), -1, 1))


def _fit_cap(cloud: Array, normal: Array) -> tuple[Array, float]:
    """Centre and radius of the sphere that planes touch where they touch a cloud, for planes about one direction.

    A plane of outward normal d touches a sphere at d . center + radius, so both follow from linear equations.
    """
    directions = cone(normal, CAP_ANGLE)
    supports = (cloud @ directions.T).max(axis=0)
    center, radius = _solve_cap(directions, supports, None)
    if not MIN_RADIUS <= radius <= MAX_RADIUS:
        center, radius = _solve_cap(directions, supports, float(np.clip(radius, MIN_RADIUS, MAX_RADIUS)))
    return center, radius


def _solve_cap(directions: Array, supports: Array, radius: float | None) -> tuple[Array, float]:
    if radius is not None:
        return np.asarray(np.linalg.lstsq(directions, supports - radius, rcond=None)[0], np.float64), radius
    columns = np.column_stack([directions, np.ones(len(directions))])
    solved = np.asarray(np.linalg.lstsq(columns, supports, rcond=None)[0], np.float64)
    return solved[:3], float(solved[3])
