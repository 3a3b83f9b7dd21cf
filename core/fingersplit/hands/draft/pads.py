"""Pads of a hand that nobody has described: the side of each last link that faces the other fingers."""

import math

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.draft.sampling import Samples
from fingersplit.hands.fingers import Pad
from fingersplit.hands.fitting import primitive_points
from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel
from fingersplit.transforms import transform_points

__all__ = ["find_pads", "tip_width"]

Array = NDArray[np.float64]

TILT = 0.6
"""[rad]; how far a pad's normal leans from straight across the link towards the fingertip."""
PATCH = 0.012
"""[m]; the pad's sphere is fitted to the surface so near to its middle."""
MIN_RADIUS, MAX_RADIUS = 0.004, 0.03
"""Of a pad's sphere [m]."""
PARALLEL = 0.9
"""Cosine of axes that bend a finger the same way."""
NEAR = 0.03
"""[m]; where two fingertips are nearer than about this, they face each other most."""


def find_pads(model: HandModel, tips: list[int], samples: Samples) -> list[Pad]:
    """A pad for each finger.

    The normal is across the axis of the last joint and the link's length, to the side to which the finger bends farther
    and on which the other fingertips are found when all fingers move at random, and leans towards the tip. The sphere
    is fitted to the surface of the link's shapes there.

    Args:
        model: The hand.
        tips: Last moving link of each finger.
        samples: Postures.

    Raises:
        HandError: A last link without any shape.
    """
    clouds = [_surface(model, tip) for tip in tips]
    ends = [_far_end(model, tip, cloud) for tip, cloud in zip(tips, clouds, strict=True)]
    places = [_transform_all(samples.poses[:, tip], end) for tip, end in zip(tips, ends, strict=True)]
    return [_pad(model, f, tips, clouds[f], ends[f], places, samples) for f in range(len(tips))]


def tip_width(model: HandModel, tip: int) -> float:
    """How wide a finger's last link is along its last joint's axis [m]; fingers side by side need that room."""
    return float(np.ptp(_surface(model, tip) @ model.joints[model.links[tip].joints[-1]].axis))


def _transform_all(poses: Array, point: Array) -> Array:
    """A point of a link (3,) in the palm frame for every posture, (n, 3)."""
    return np.asarray(poses[:, :3, :3] @ point + poses[:, :3, 3])


def _surface(model: HandModel, tip: int) -> Array:
    """Points on the shapes of a link and of what is rigidly joined to it, in the link's frame."""
    still = link_poses(model, np.array([joint.reference for joint in model.joints]))
    carried = [i for i in range(len(model.links)) if tip in model.path(i)]
    shapes = [shape for shape in model.shapes if shape.link in carried]
    if not shapes:
        raise HandError(
            f"The last link {model.links[tip].name!r} of a finger has no shape; give it collision geometry."
        )
    clouds = []
    for shape in shapes:
        tip_from_shape = np.linalg.inv(still[tip]) @ still[shape.link] @ shape.pose
        clouds.append(transform_points(tip_from_shape, primitive_points(shape.kind, shape.size)))
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
    model: HandModel, f: int, tips: list[int], cloud: Array, end: Array, places: list[Array], samples: Samples
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
    normal = math.cos(TILT) * side + math.sin(TILT) * length
    center, radius = _fit_cap(cloud, joint.axis, side, normal)
    return Pad(tips[f], center, normal, radius, None)


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


def _fit_cap(cloud: Array, axis: Array, side: Array, normal: Array) -> tuple[Array, float]:
    """Centre and radius of the sphere that fits a cloud where it is farthest out along ``normal``."""
    middle = cloud @ axis
    width = (middle.max() + middle.min()) / 2
    central = cloud[np.abs(middle - width) < 0.35 * max(np.ptp(middle), 1e-3)]
    top = central[np.argmax(central @ normal)]
    top = top + (width - top @ axis) * axis
    near = cloud[(np.linalg.norm(cloud - top, axis=1) < PATCH) & ((cloud - top) @ side > -PATCH / 2)]
    radius = MAX_RADIUS
    if len(near) >= 6:
        # |p - top + r n|^2 = r^2, linear in r with the centre held on the normal
        offsets = near - top
        lifts = offsets @ normal
        radius = float(-((offsets**2).sum(axis=1) @ lifts) / max(2 * lifts @ lifts, 1e-12))
    radius = min(max(radius, MIN_RADIUS), MAX_RADIUS)
    return top - radius * normal, radius
