"""Supervoxels: surface samples clustered by place and normal, with clusters that hang together [Papon2013].

The voxels of [Papon2013] are the evenly spaced surface samples here, and colours play no part. Labels flow from seeds
to neighbouring samples, never across a sharp edge, so that the two sides of an edge or of a thin plate stay apart.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.grid_kernel import neighbour_lists, thin_evenly
from fingersplit.objects.supervoxels_kernel import cluster
from fingersplit.objects.surface import SHARP_EDGE, Surface

__all__ = ["Supervoxels", "cluster_supervoxels"]

REACH = 2.2
"""Distance of neighbouring samples, in spacings."""


class Supervoxels(NamedTuple):
    """Patches of the surface.

    Attributes:
        labels: Supervoxel of every surface sample, (n_samples,) int32.
        centers: The sample in the middle of each, (k, 3) [m].
        normals: Mean outward unit normal of each, (k, 3).
    """

    labels: NDArray[np.int32]
    centers: NDArray[np.float64]
    normals: NDArray[np.float64]


def cluster_supervoxels(surface: Surface, count: int) -> Supervoxels:
    """Cluster surface samples; the same surface always gives the same clusters.

    Args:
        surface: The samples.
        count: About how many supervoxels there should be; sharp edges and loose parts make more.
    """
    points = surface.grid.points
    seed_spacing = surface.spacing * math.sqrt(max(len(points) / count, 1.0))
    seeds = thin_evenly(points, seed_spacing)
    starts, neighbours = neighbour_lists(surface.grid, REACH * surface.spacing)
    clusters = cluster(points, surface.normals, starts, neighbours, seeds, seed_spacing, math.cos(SHARP_EDGE))
    for array in clusters:
        array.setflags(write=False)
    return Supervoxels(*clusters)
