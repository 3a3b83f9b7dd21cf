"""Iterative surface fitting: parallel grasps whose pads rest on the object with their whole face [Fan2018ISF]."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans, vq

from fingersplit.contacts.cones import cone_cosine
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.fitting_kernel import new_fit
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.guided_starts_kernel import GripperBody, guided_fits
from fingersplit.parallel_grasps.source import ParallelGraspSource, SourceRequest
from fingersplit.parallel_grasps.spread_kernel import COVERING, spread_pairs

__all__ = ["SURFACE_FITTING", "PadGripper", "fit_surfaces", "surface_fits"]

STARTS_PER_GRASP = 4
START_SAMPLES, REGIONS = 2_000, 32
NORMAL_SHARE = 0.5
"""What a normal turned by a radian counts between regions, as a share of the object's radius."""
PAD_POINTS = 5
"""Rows and columns of points that stand for a pad; odd, so that one of them is its centre."""


@dataclass(frozen=True)
class PadGripper:
    """A parallel gripper with flat pads.

    Attributes:
        opening: Least and largest distance of the pads [m].
        pad: Lateral width of a pad and its length along the approach [m].
        thickness: From a pad's face through its finger [m].
        pad_height: How far a pad stands out of its finger [m].
        reach: From the pads' centre back to the palm [m].
        palm: Lateral width of the palm and its depth along the approach [m].
    """

    opening: tuple[float, float]
    pad: tuple[float, float] = (0.02, 0.02)
    thickness: float = 0.015
    pad_height: float = 5e-3
    reach: float = 0.1
    palm: tuple[float, float] = (0.06, 0.06)

    @property
    def body(self) -> GripperBody:
        """The boxes that may not meet the object."""
        return GripperBody(
            finger=self.pad[0] / 2,
            thickness=self.thickness,
            pad_height=self.pad_height,
            tip=self.pad[1] / 2,
            reach=self.reach,
            palm_lateral=self.palm[0] / 2,
            palm_jaw=self.opening[1] / 2 + self.thickness,
            palm_depth=self.palm[1],
        )

    @property
    def pad_points(self) -> NDArray[np.float64]:
        """Points of a pad along the lateral and the approach axis, evenly spaced, (m, 2) [m]."""
        steps = (np.arange(PAD_POINTS) + 0.5) / PAD_POINTS - 0.5
        lateral, along = np.meshgrid(self.pad[0] * steps, self.pad[1] * steps, indexing="ij")
        return np.column_stack([lateral.ravel(), along.ravel()])


def fit_surfaces(
    model: ObjectModel, count: int, *, gripper: PadGripper, friction: float, rng: np.random.Generator
) -> ParallelGrasps:
    """Grasps of a gripper whose pads were fitted to the object, the best of many guided starts.

    From starts across the object, palm and width are fitted in turn; what would slip, hang in the air or put the
    gripper's body into the object is refused, and regions where that happens are tried less.

    Args:
        model: The prepared object.
        count: Most grasps to return.
        gripper: The gripper.
        friction: Coulomb friction coefficient of both pads.
        rng: Source of every random choice.

    Returns:
        At most ``count`` grasps, those first whose pads rest most squarely near the centre of mass; empty when none
        holds. Contacts are the object's nearest points to the pads' centres, approaches the gripper's.
    """
    contact_scores, contacts, approaches = surface_fits(model, STARTS_PER_GRASP * count, gripper, friction, rng)
    off_center = np.linalg.norm(contacts.mean(axis=1) - model.center_of_mass, axis=1) / model.radius
    order = np.argsort(off_center - contact_scores, kind="stable")
    order = order[contact_scores[order] > 0]
    ends = np.ascontiguousarray(contacts[order, 0]), np.ascontiguousarray(contacts[order, 1])
    kept = order[spread_pairs(*ends, count, model.radius * np.array(COVERING))]
    return ParallelGrasps(contacts[kept], approaches[kept])


def surface_fits(
    model: ObjectModel, starts: int, gripper: PadGripper, friction: float, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """What comes of every start, in their order.

    Returns:
        How squarely the pads rest (n,), the worse pad's share, 0 where a start came to nothing; contacts (n, 2, 3) [m]
        and approaches (n, 3).
    """
    contacts, approaches = np.zeros((starts, 2, 3)), np.zeros((starts, 3))
    pad = gripper.pad_points
    contact_scores, _, _ = guided_fits(
        model.triangles,
        model.surface,
        model.collision.points,
        _regions(model, rng),
        pad,
        gripper.body,
        gripper.opening,
        cone_cosine(friction),
        rng.random((starts, 4)),
        new_fit(2 * len(pad)),
        contacts,
        approaches,
    )
    return contact_scores, contacts, approaches


def _regions(model: ObjectModel, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Samples to start from, by place and facing about k-means centres: first entry of each region, and the samples."""
    samples = rng.permutation(len(model.surface.normals))[:START_SAMPLES]
    points, normals = model.surface.grid.points[samples], model.surface.normals[samples]
    features = np.hstack([points, NORMAL_SHARE * model.radius * normals])
    centers, _ = kmeans(features, features[:REGIONS], thresh=1e-3 * model.radius)
    labels, _ = vq(features, centers)
    sizes = np.bincount(labels)
    starts = np.concatenate([[0], np.cumsum(sizes[sizes > 0])])
    return starts, samples[np.argsort(labels, kind="stable")]


def _find(request: SourceRequest) -> ParallelGrasps:
    gripper = PadGripper(request.opening)
    return fit_surfaces(request.model, request.starts, gripper=gripper, friction=request.friction, rng=request.rng)


SURFACE_FITTING = ParallelGraspSource(
    "surface_fitting", "A gripper whose pads are fitted to the surface from many starts.", _find
)
