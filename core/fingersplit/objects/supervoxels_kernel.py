"""Kernels of `supervoxels`: clustering samples."""

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, dot, get, norm, put, scale, subtract

__all__ = ["cluster"]

NORMAL_WEIGHT = 4.0
"""Of 1 - cos of the angle between normals, beside the squared distance in units of the seeds' spacing."""
ROUNDS = 4
"""Of clustering about the centres, which then move to the middle of their clusters."""


@kernel
def cluster(points, normals, starts, neighbours, seeds, seed_spacing, least_cosine):
    """Label, middle sample and mean normal by cluster, of samples (n, 3) with their lists of neighbours."""
    n, count = len(points), seeds.size
    labels, costs, queue = np.empty(n, np.int32), np.empty(n), np.empty(n, np.int32)
    heads, middles, directions = np.empty(n, np.int32), np.empty((n, 3)), np.empty((n, 3))
    for k in range(count):
        heads[k] = seeds[k]
        put(middles, k, get(points, seeds[k]))
        put(directions, k, get(normals, seeds[k]))
    lists = starts, neighbours, np.zeros(n, np.bool_), 1.0 / seed_spacing**2, least_cosine
    for _ in range(ROUNDS):
        labels[:], costs[:] = -1, np.inf
        for k in range(count):
            queue[k], labels[heads[k]], costs[heads[k]] = heads[k], k, 0.0
        _flow(points, normals, lists, queue, count, middles, directions, labels, costs)
        for i in range(n):
            if labels[i] < 0:  # no seed reaches it, as on a small face between sharp edges: it starts its own
                put(middles, count, get(points, i))
                put(directions, count, get(normals, i))
                queue[0], labels[i], costs[i] = i, count, 0.0
                count += 1
                _flow(points, normals, lists, queue, 1, middles, directions, labels, costs)
        count = _move_centres(points, normals, labels, count, heads, middles, directions)
    centers = np.empty((count, 3))
    for k in range(count):
        put(centers, k, get(points, heads[k]))
    return labels, centers, directions[:count].copy()


@kernel
def _flow(points, normals, lists, queue, size, middles, directions, labels, costs):
    """Spread the labels of the first ``size`` samples in the queue to all for which they cost less than their own."""
    starts, neighbours, waiting, per_squared_meter, least_cosine = lists
    n, first = queue.size, 0
    for m in range(size):
        waiting[queue[m]] = True
    while size > 0:
        i = queue[first]
        first, size, waiting[i] = (first + 1) % n, size - 1, False
        k = labels[i]
        for m in range(starts[i], starts[i + 1]):
            j = neighbours[m]
            if labels[j] != k and dot(get(normals, i), get(normals, j)) >= least_cosine:
                offset = subtract(get(points, j), get(middles, k))
                turned = 1.0 - dot(get(normals, j), get(directions, k))
                cost = dot(offset, offset) * per_squared_meter + NORMAL_WEIGHT * turned
                if cost < costs[j]:
                    labels[j], costs[j] = k, cost
                    if not waiting[j]:
                        queue[(first + size) % n], waiting[j] = j, True
                        size += 1


@kernel
def _move_centres(points, normals, labels, count, heads, middles, directions):
    """Mean place and direction of every cluster and the member next to it; clusters that lost all members go.

    Returns:
        How many clusters are left; labels are numbered anew.
    """
    members = np.zeros(count, np.int64)
    middles[:count], directions[:count] = 0.0, 0.0
    for i in range(len(points)):
        k = labels[i]
        members[k] += 1
        put(middles, k, add(get(middles, k), get(points, i)))
        put(directions, k, add(get(directions, k), get(normals, i)))
    renamed, left = np.empty(count, np.int32), 0
    for k in range(count):
        if members[k] > 0:
            renamed[k] = left
            put(middles, left, scale(1.0 / members[k], get(middles, k)))
            put(directions, left, scale(1.0 / norm(get(directions, k)), get(directions, k)))
            left += 1
    closest = np.full(left, np.inf)
    for i in range(len(points)):
        labels[i] = renamed[labels[i]]
        distance = norm(subtract(get(points, i), get(middles, labels[i])))
        if distance < closest[labels[i]]:
            closest[labels[i]], heads[labels[i]] = distance, i
    return left
