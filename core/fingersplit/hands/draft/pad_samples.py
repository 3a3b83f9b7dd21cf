"""Where the pads of a hand come in its postures, and which of them oppose each other."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.hands.draft.sampling import Samples
from fingersplit.hands.fingers import Pad
from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel
from fingersplit.hands.shapes import covering_spheres
from fingersplit.transforms import transform_points

__all__ = ["ANGLE", "TOLERANCE", "WIDTHS", "PadSamples", "opposition", "pad_samples"]

Array = NDArray[np.float64]

WIDTHS = np.arange(0.02, 0.125, 0.01)
"""Openings at which opposition is counted [m]."""
TOLERANCE, ANGLE = 0.008, 0.5
"""A pad is where it should be within this distance [m] and angle [rad]."""
ASIDE = 0.04
"""[m]; two pads that face each other may stand so far aside: a finger opposes the gap between two others, too."""


@dataclass(frozen=True, eq=False)
class PadSamples:
    """A finger's pad in every posture.

    Attributes:
        contacts: Points that touch, in the palm frame, (n, 3) [m].
        normals: Unit vectors out of the pad, (n, 3).
        free: Whether the pad is outside of the palm, (n,).
    """

    contacts: Array
    normals: Array
    free: NDArray[np.bool_]

    @cached_property
    def tree(self) -> cKDTree:
        """Free postures by place and direction, each over its tolerance."""
        return cKDTree(np.hstack([self.contacts[self.free] / TOLERANCE, self.normals[self.free] / ANGLE]))


def pad_samples(pad: Pad, samples: Samples, model: HandModel | None = None) -> PadSamples:
    """Where a pad touches in every posture, and with a model whether it then is outside of the palm."""
    poses = samples.poses[:, pad.link]
    normals = poses[:, :3, :3] @ pad.normal
    centers = poses[:, :3, :3] @ pad.center + poses[:, :3, 3]
    free = np.ones(len(poses), bool)
    for place, radius in _palm_balls(model) if model is not None else ():
        free &= np.linalg.norm(centers - place, axis=1) > radius + pad.radius
    if not free.any():
        free[:] = True  # palms are drawn about their fingers by some
    return PadSamples(centers + pad.radius * normals, normals, free)


def _palm_balls(model: HandModel) -> Iterator[tuple[Array, float]]:
    """Centres and radii of balls that lie inside the palm's shapes and nearly fill them."""
    still = link_poses(model, np.array([joint.reference for joint in model.joints]))
    for shape in model.shapes:
        if not any(model.links[each].joints for each in model.path(shape.link)):
            centers, _, insides = covering_spheres(shape.kind, shape.size)
            yield from zip(transform_points(still[shape.link] @ shape.pose, centers), map(float, insides), strict=True)


def opposition(pads: list[PadSamples]) -> tuple[Array, dict[tuple[int, int], Array]]:
    """For each pair of fingers the share of postures of one that a posture of the other opposes.

    Returns:
        Shares (F, F), and for each pair with any the rows (m, 6) of middles and unit directions from the second to the
        first finger.
    """
    count = len(pads)
    shares, pairs = np.zeros((count, count)), {}
    trees = [cKDTree(np.hstack([pad.contacts[pad.free] / ASIDE, pad.normals[pad.free] / ANGLE])) for pad in pads]
    for i, j in combinations(range(count), 2):
        found = []
        chosen = np.flatnonzero(pads[i].free)[:6000]
        contacts, normals = pads[i].contacts[chosen], pads[i].normals[chosen]
        for width in WIDTHS[1::3]:
            target = np.hstack([(contacts + width * normals) / ASIDE, -normals / ANGLE])
            distance, _ = trees[j].query(target, distance_upper_bound=1.0)
            hit = np.isfinite(distance)
            found.append(np.hstack([contacts[hit] + width / 2 * normals[hit], -normals[hit]]))
        rows = np.vstack(found)
        shares[i, j] = shares[j, i] = len(rows) / (len(contacts) * len(WIDTHS[1::3]))
        pairs[i, j] = rows
    return shares, pairs
